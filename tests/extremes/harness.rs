//! A common interface to all backends.

use std::sync::Arc;

use drawloom::backend::internal::NullSubmission;
use drawloom::backend::{
    Backend, BackendError, NullBackend, Picture, SoftwareBackend, SoftwareSubmission, WgpuSubmission,
};
use drawloom::process::{Deferred, RenderProcess};
use drawloom::quality::{Quality, ShadowQuality};
use drawloom::scene::{Scene, SceneRef};
use drawloom::task::Scheduler;
use drawloom::view::SceneIssue;
use drawloom::{BuildError, CpuNode, FrameError, FrameInputs, Renderer, SubmitError, Submitter};
use drawloom_testing::adapter;
use libtest_mimic::Failed;

use crate::capture::{Capture, capture};

/// A backend that cases are run on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BackendName {
    /// [`NullBackend`], which draws no picture: cases compare counts, scene issues and errors only, as its name says.
    Null,
    /// [`SoftwareBackend`] in f32.
    Software,
    /// [`SoftwareBackend`] in f64.
    Reference,
    /// [`WgpuBackend`] on the machine's adapter.
    Wgpu,
}

impl BackendName {
    pub const ALL: [Self; 4] = [Self::Null, Self::Software, Self::Reference, Self::Wgpu];

    pub fn name(self) -> &'static str {
        match self {
            Self::Null => "counts_on_null",
            Self::Software => "software",
            Self::Reference => "reference",
            Self::Wgpu => "wgpu",
        }
    }

    /// Whether it draws on the CPU, where a frame takes seconds without optimisations.
    pub fn is_slow(self) -> bool {
        matches!(self, Self::Software | Self::Reference)
    }

    /// The same quality with shadow maps that are small enough for this backend.
    pub fn affordable(self, quality: Quality) -> Quality {
        let side = if self.is_slow() { quality.shadows.side.min(96) } else { quality.shadows.side };
        Quality { shadows: ShadowQuality { side, ..quality.shadows }, ..quality }
    }

    /// Creates a renderer on this backend.
    fn open(self, setup: Setup) -> Result<Box<dyn Runner>, OpenError> {
        let scheduler = Arc::new(Scheduler::new(2).map_err(|error| error.to_string())?);
        match self {
            Self::Null => RendererOn::open(NullBackend, scheduler, setup),
            Self::Software => RendererOn::open(SoftwareBackend::new(Arc::clone(&scheduler)), scheduler, setup),
            Self::Reference => RendererOn::open(SoftwareBackend::reference(), scheduler, setup),
            Self::Wgpu => {
                let backend = adapter::shared_backend().map_err(|error| error.to_string())?;
                RendererOn::open(backend, scheduler, setup)
            }
        }
    }
}

/// What a renderer is built with.
pub struct Setup {
    pub quality: Quality,
    pub deferred: Deferred,
    /// A process of the test's own.
    pub process: Option<Arc<dyn RenderProcess>>,
    /// The targets of it that are read back.
    pub own_targets: &'static [&'static str],
}

impl From<Quality> for Setup {
    fn from(quality: Quality) -> Self {
        Self { quality, deferred: Deferred::to_picture(), process: None, own_targets: &[] }
    }
}

/// Why a renderer could not be created.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    #[error(transparent)]
    Build(#[from] BuildError),
    #[error("{0}")]
    Other(String),
}

impl From<String> for OpenError {
    fn from(message: String) -> Self {
        Self::Other(message)
    }
}

/// The outcome of drawing a scene.
pub enum Outcome {
    /// It was drawn.
    Drawn(Drawn),
    /// Recording failed.
    Refused(FrameError),
    /// Submission failed.
    NotSubmitted(SubmitError),
}

impl Outcome {
    /// The frame, which must have been drawn.
    pub fn drawn(self) -> Result<Drawn, Failed> {
        match self {
            Self::Drawn(drawn) => Ok(drawn),
            Self::Refused(error) => Err(format!("it was refused: {error}").into()),
            Self::NotSubmitted(error) => Err(format!("it was not submitted: {error}").into()),
        }
    }
}

/// A frame that was drawn.
pub struct Drawn {
    /// The pictures of the first view. `None` if the backend draws nothing.
    pub capture: Option<Capture>,
    /// The objects and effects that were left out or drawn at lower quality.
    pub scene_issues: Vec<SceneIssue>,
    /// The number of visible objects of the first view.
    pub visible: usize,
    /// The triangles of the levels of detail that it draws, if there are any.
    pub triangles: Option<usize>,
    /// The static groups that it executes.
    pub static_groups: usize,
    /// The targets of the process of the test's own; none if the backend draws nothing.
    pub own_targets: Vec<Picture>,
}

/// Draws scenes on a backend.
pub trait Runner {
    /// # Errors
    /// If a picture cannot be read back, or contains NaN.
    fn draw(&mut self, scene: &SceneRef<'_>, nodes: &[&dyn CpuNode]) -> Result<Outcome, Failed>;
}

/// One renderer on a backend, for all frames of a case: a failed frame must not affect the next one.
pub struct Harness {
    name: BackendName,
    runner: Box<dyn Runner>,
}

impl Harness {
    pub fn new(name: BackendName) -> Result<Self, Failed> {
        Ok(Self { name, runner: name.open(name.affordable(Quality::balanced()).into())? })
    }

    /// Another renderer on the same backend.
    ///
    /// # Errors
    /// If the quality is invalid.
    pub fn with(&self, setup: impl Into<Setup>) -> Result<Self, OpenError> {
        Ok(Self { name: self.name, runner: self.name.open(setup.into())? })
    }

    pub fn name(&self) -> BackendName {
        self.name
    }

    pub fn outcome(&mut self, scene: &SceneRef<'_>) -> Result<Outcome, Failed> {
        self.runner.draw(scene, &[])
    }

    /// The same, with nodes that make some of the scene.
    pub fn outcome_with(&mut self, scene: &SceneRef<'_>, nodes: &[&dyn CpuNode]) -> Result<Outcome, Failed> {
        self.runner.draw(scene, nodes)
    }

    /// Draws a scene, which must succeed.
    pub fn draw(&mut self, scene: &Scene) -> Result<Drawn, Failed> {
        self.outcome(&scene.as_scene_ref())?.drawn()
    }

    /// The same; nothing may be left out.
    pub fn draw_whole(&mut self, scene: &Scene) -> Result<Drawn, Failed> {
        let drawn = self.draw(scene)?;
        if drawn.scene_issues.is_empty() {
            Ok(drawn)
        } else {
            Err(format!("left out: {:?}", drawn.scene_issues).into())
        }
    }

    /// Records a scene, which must fail, and returns the error.
    pub fn refusal(&mut self, scene: &SceneRef<'_>) -> Result<FrameError, Failed> {
        match self.outcome(scene)? {
            Outcome::Refused(error) => Ok(error),
            Outcome::Drawn(drawn) => Err(format!("it was drawn, without {:?}", drawn.scene_issues).into()),
            Outcome::NotSubmitted(error) => Err(format!("it was recorded, and then: {error}").into()),
        }
    }
}

/// Reads back the pictures of a submission.
pub trait Pictures {
    /// A target of a view. `None` if the backend draws nothing.
    fn target(&self, view: usize, target: &str) -> Option<Result<Picture, BackendError>>;
}

impl Pictures for NullSubmission {
    fn target(&self, _view: usize, _target: &str) -> Option<Result<Picture, BackendError>> {
        None
    }
}

impl Pictures for SoftwareSubmission {
    fn target(&self, view: usize, target: &str) -> Option<Result<Picture, BackendError>> {
        Some(self.read(view, target))
    }
}

impl Pictures for WgpuSubmission {
    fn target(&self, view: usize, target: &str) -> Option<Result<Picture, BackendError>> {
        Some(self.read(view, target))
    }
}

/// A renderer and its submitter.
struct RendererOn<B: Backend> {
    renderer: Renderer<B>,
    submitter: Submitter<B>,
    own_targets: &'static [&'static str],
}

impl<B: Backend<Submission: Pictures>> RendererOn<B> {
    fn open(backend: B, scheduler: Arc<Scheduler>, setup: Setup) -> Result<Box<dyn Runner>, OpenError> {
        let Setup { quality, deferred, process, own_targets } = setup;
        let builder = Renderer::builder(backend).pipeline(deferred).quality(quality);
        let builder = process.into_iter().fold(builder, |builder, process| builder.process(process));
        let builder = own_targets.iter().fold(builder, |builder, target| builder.output(*target));
        let (renderer, submitter) = builder.build(scheduler)?;
        Ok(Box::new(Self { renderer, submitter, own_targets }))
    }
}

impl<B: Backend<Submission: Pictures>> Runner for RendererOn<B> {
    fn draw(&mut self, scene: &SceneRef<'_>, nodes: &[&dyn CpuNode]) -> Result<Outcome, Failed> {
        let recorded = match self.renderer.record_with(FrameInputs { nodes, ..FrameInputs::new(*scene) }) {
            Ok(recorded) => recorded,
            Err(FrameError::Panicked { stage, message }) => return Err(format!("{stage} panicked: {message}").into()),
            Err(FrameError::Scheduler(panic)) => return Err(format!("a job panicked: {panic}").into()),
            Err(error) => return Ok(Outcome::Refused(error)),
        };
        let submitted = match self.submitter.submit(recorded) {
            Ok(submitted) => submitted,
            Err(error) => return Ok(Outcome::NotSubmitted(error)),
        };
        let target = |name| submitted.submission.target(0, name).transpose();
        let capture = match (target("radiance")?, target("picture")?) {
            (Some(radiance), Some(picture)) => Some(capture(&radiance, picture)?),
            _ => None,
        };
        let own_targets = self.own_targets.iter().filter_map(|name| target(name).transpose());
        let view = submitted.statistics.views.first();
        Ok(Outcome::Drawn(Drawn {
            capture,
            visible: view.map_or(0, |view| view.visible),
            triangles: view.and_then(|view| view.levels_of_detail).map(|levels| levels.triangles),
            static_groups: view.map_or(0, |view| view.static_groups),
            own_targets: own_targets.collect::<Result<_, _>>()?,
            scene_issues: submitted.statistics.scene_issues,
        }))
    }
}
