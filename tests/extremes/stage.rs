//! The backends, behind one face.

use std::sync::{Arc, OnceLock};

use drawloom::backend::{
    Backend, BackendError, NullBackend, NullSubmission, Picture, SoftwareBackend, SoftwareSubmission, WgpuBackend,
    WgpuSubmission,
};
use drawloom::process::Deferred;
use drawloom::quality::{Quality, ShadowQuality};
use drawloom::scene::{Scene, SceneRef};
use drawloom::task::Scheduler;
use drawloom::view::Rejection;
use drawloom::{BuildError, FrameError, Renderer, SubmitError, Submitter, wgpu};
use drawloom_testing::adapter;
use libtest_mimic::Failed;

use crate::look::{Look, look};

/// A backend that cases are run on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StageName {
    /// It draws nothing and checks everything.
    Null,
    /// It draws on the CPU, in f32.
    Software,
    /// It draws on the CPU, in f64.
    Reference,
    /// The machine's adapter.
    Wgpu,
}

impl StageName {
    pub const ALL: [Self; 4] = [Self::Null, Self::Software, Self::Reference, Self::Wgpu];

    pub fn name(self) -> &'static str {
        match self {
            Self::Null => "null",
            Self::Software => "software",
            Self::Reference => "reference",
            Self::Wgpu => "wgpu",
        }
    }

    /// Whether it draws on the CPU, which without optimisations takes seconds for what an adapter draws in milliseconds.
    pub fn is_slow(self) -> bool {
        matches!(self, Self::Software | Self::Reference)
    }

    /// The same quality with shadow maps that this backend has the time for.
    pub fn affordable(self, quality: Quality) -> Quality {
        let side = if self.is_slow() { quality.shadows.side.min(96) } else { quality.shadows.side };
        Quality { shadows: ShadowQuality { side, ..quality.shadows }, ..quality }
    }

    /// A renderer on it.
    fn open(self, quality: Quality) -> Result<Box<dyn Stage>, OpenError> {
        let scheduler = Arc::new(Scheduler::new(2).map_err(|error| error.to_string())?);
        match self {
            Self::Null => Troupe::open(NullBackend, scheduler, quality),
            Self::Software => Troupe::open(SoftwareBackend::new(Arc::clone(&scheduler)), scheduler, quality),
            Self::Reference => Troupe::open(SoftwareBackend::reference(), scheduler, quality),
            Self::Wgpu => {
                let (device, queue) = device().ok_or_else(|| "there is no graphics adapter".to_owned())?;
                let backend = WgpuBackend::new(device, queue).map_err(|error| error.to_string())?;
                Troupe::open(backend, scheduler, quality)
            }
        }
    }
}

/// The machine's adapter as a device that all cases share; `None` where there is none.
pub fn device() -> Option<(wgpu::Device, wgpu::Queue)> {
    static DEVICE: OnceLock<Option<(wgpu::Device, wgpu::Queue)>> = OnceLock::new();
    DEVICE.get_or_init(|| adapter::device().ok()).clone()
}

/// Why there is no renderer.
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

/// What became of a scene.
pub enum Outcome {
    /// It was drawn.
    Drawn(Drawn),
    /// It was refused while it was recorded.
    Refused(FrameError),
    /// It was refused by the device.
    NotSubmitted(SubmitError),
}

/// A frame that was drawn.
pub struct Drawn {
    /// The first view's picture; `None` where the backend draws nothing.
    pub look: Option<Look>,
    /// What was left out or could not be drawn as asked.
    pub rejections: Vec<Rejection>,
    /// How many objects the first main view's geometry buffer was asked to draw.
    pub visible: usize,
}

/// A backend that scenes can be handed to.
pub trait Stage {
    /// # Errors
    /// If a picture cannot be brought back, or has a pixel that is not a number.
    fn draw(&mut self, scene: &SceneRef<'_>) -> Result<Outcome, Failed>;
}

/// A backend, and one renderer on it: a frame that fails is to leave no trace in the next.
pub struct Studio {
    name: StageName,
    stage: Box<dyn Stage>,
}

impl Studio {
    pub fn new(name: StageName) -> Result<Self, Failed> {
        Ok(Self { name, stage: name.open(name.affordable(Quality::balanced()))? })
    }

    /// Another renderer on the same backend.
    ///
    /// # Errors
    /// If the quality cannot be.
    pub fn with_quality(&self, quality: Quality) -> Result<Self, OpenError> {
        Ok(Self { name: self.name, stage: self.name.open(quality)? })
    }

    pub fn name(&self) -> StageName {
        self.name
    }

    pub fn outcome(&mut self, scene: &SceneRef<'_>) -> Result<Outcome, Failed> {
        self.stage.draw(scene)
    }

    /// What is drawn of a scene that can be.
    pub fn draw(&mut self, scene: &Scene) -> Result<Drawn, Failed> {
        match self.outcome(&scene.as_scene_ref())? {
            Outcome::Drawn(drawn) => Ok(drawn),
            Outcome::Refused(error) => Err(format!("it was refused: {error}").into()),
            Outcome::NotSubmitted(error) => Err(format!("it was not submitted: {error}").into()),
        }
    }

    /// The same, where nothing is to be left out.
    pub fn draw_whole(&mut self, scene: &Scene) -> Result<Drawn, Failed> {
        let drawn = self.draw(scene)?;
        if drawn.rejections.is_empty() { Ok(drawn) } else { Err(format!("left out: {:?}", drawn.rejections).into()) }
    }

    /// Why a scene is refused that is to be.
    pub fn refusal(&mut self, scene: &SceneRef<'_>) -> Result<FrameError, Failed> {
        match self.outcome(scene)? {
            Outcome::Refused(error) => Ok(error),
            Outcome::Drawn(drawn) => Err(format!("it was drawn, without {:?}", drawn.rejections).into()),
            Outcome::NotSubmitted(error) => Err(format!("it was recorded, and then: {error}").into()),
        }
    }
}

/// What a submission knows of its pictures.
pub trait Pictures {
    /// One of a view's targets; `None` where nothing was drawn.
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
struct Troupe<B: Backend> {
    renderer: Renderer<B>,
    submitter: Submitter<B>,
}

impl<B: Backend<Submission: Pictures>> Troupe<B> {
    fn open(backend: B, scheduler: Arc<Scheduler>, quality: Quality) -> Result<Box<dyn Stage>, OpenError> {
        let builder = Renderer::builder(backend).deferred(Deferred::to_picture()).quality(quality);
        let (renderer, submitter) = builder.build(scheduler)?;
        Ok(Box::new(Self { renderer, submitter }))
    }
}

impl<B: Backend<Submission: Pictures>> Stage for Troupe<B> {
    fn draw(&mut self, scene: &SceneRef<'_>) -> Result<Outcome, Failed> {
        let recorded = match self.renderer.record(*scene) {
            Ok(recorded) => recorded,
            Err(FrameError::Panicked { phase, message }) => return Err(format!("{phase} panicked: {message}").into()),
            Err(FrameError::Job(panic)) => return Err(format!("a job panicked: {panic}").into()),
            Err(error) => return Ok(Outcome::Refused(error)),
        };
        let submitted = match self.submitter.submit(recorded) {
            Ok(submitted) => submitted,
            Err(error) => return Ok(Outcome::NotSubmitted(error)),
        };
        let target = |name| submitted.submission.target(0, name).transpose();
        let look = match (target("radiance")?, target("picture")?) {
            (Some(radiance), Some(picture)) => Some(look(&radiance, picture)?),
            _ => None,
        };
        Ok(Outcome::Drawn(Drawn {
            look,
            visible: submitted.statistics.views.first().map_or(0, |view| view.visible),
            rejections: submitted.statistics.rejections,
        }))
    }
}
