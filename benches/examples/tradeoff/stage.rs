//! What draws: wgpu, or the software backend, behind one trait.

use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::backend::{Backend, Picture, SoftwareBackend, SoftwareSubmission, WgpuBackend, WgpuSubmission};
use drawloom::command::RenderCommand;
use drawloom::process::{Deferred, Fxaa, ToneMapping};
use drawloom::quality::Quality;
use drawloom::scene::SceneRef;
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use drawloom_testing::adapter;

use crate::Failure;
use crate::arguments::{Arguments, BackendName};

/// Draws frames.
pub trait Stage {
    /// What draws.
    fn name(&self) -> &str;

    /// The same in a word, for the names of files.
    fn kind(&self) -> &'static str;

    /// # Errors
    /// If there can be no frames of that quality.
    fn set_quality(&mut self, quality: &Quality) -> Result<(), Failure>;

    /// # Errors
    /// If the frame fails.
    fn draw(&mut self, scene: SceneRef<'_>) -> Result<FrameTime, Failure>;

    /// A target of the first view of the frame drawn last.
    ///
    /// # Errors
    /// If there is none, or it cannot be read.
    fn read(&self, target: &str) -> Result<Picture, Failure>;

    /// The names of the last frame's views, in order.
    fn views(&self) -> &[String];

    /// What a process drew in a view of the last frame, in order; nothing where it drew none.
    fn commands(&self, process: &str, view: usize) -> Vec<RenderCommand>;
}

/// What a frame took.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameTime {
    /// From the scene's hand-over to the return of submit.
    pub cpu: Duration,
    /// Until it is drawn.
    pub frame: Duration,
    /// Objects that were left out because others hide them.
    pub occluded: usize,
}

impl FrameTime {
    /// Of the mean of some frames.
    pub fn mean(times: &[Self]) -> Self {
        let count = times.len().max(1) as u32;
        let mean = |of: fn(&Self) -> Duration| times.iter().map(of).sum::<Duration>() / count;
        let occluded = times.iter().map(|time| time.occluded).sum::<usize>() / times.len().max(1);
        Self { cpu: mean(|time| time.cpu), frame: mean(|time| time.frame), occluded }
    }
}

/// What the command line asks for: wgpu, unless there is no adapter and nobody insists.
///
/// # Errors
/// If there is no adapter and somebody does.
pub fn open(arguments: &Arguments) -> Result<Box<dyn Stage>, Failure> {
    if arguments.backend == Some(BackendName::Software) {
        return software();
    }
    match adapter::device() {
        Ok((device, queue)) => {
            let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
            Ok(Box::new(Painter::new(WgpuBackend::new(device, queue)?, scheduler)?))
        }
        Err(_) if arguments.backend.is_none() => software(),
        Err(error) => Err(error),
    }
}

/// The reference that all others are measured by: f64, nothing rounded, and [`Quality::exact`].
///
/// # Errors
/// If it cannot be made.
pub fn reference() -> Result<Box<dyn Stage>, Failure> {
    let mut painter = Painter::new(SoftwareBackend::reference(), Arc::new(Scheduler::new(1)?))?;
    painter.set_quality(&Quality::exact())?;
    Ok(Box::new(painter))
}

fn software() -> Result<Box<dyn Stage>, Failure> {
    let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
    Ok(Box::new(Painter::new(SoftwareBackend::new(Arc::clone(&scheduler)), scheduler)?))
}

struct Painter<B: Backend> {
    name: String,
    renderer: Renderer<B>,
    submitter: Submitter<B>,
    views: Vec<String>,
    last: Option<B::Submission>,
}

impl<B: Backend> Painter<B> {
    fn new(backend: B, scheduler: Arc<Scheduler>) -> Result<Self, Failure> {
        let name = backend.adapter();
        let deferred = Deferred::new().post(ToneMapping::default()).post(Fxaa::default());
        let (renderer, submitter) = Renderer::builder(backend).deferred(deferred).build(scheduler)?;
        Ok(Self { name, renderer, submitter, views: Vec::new(), last: None })
    }
}

impl<B: Backend> Stage for Painter<B>
where
    B::Submission: Drawn,
{
    fn name(&self) -> &str {
        &self.name
    }

    fn kind(&self) -> &'static str {
        B::Submission::KIND
    }

    fn set_quality(&mut self, quality: &Quality) -> Result<(), Failure> {
        Ok(self.renderer.set_quality(*quality)?)
    }

    fn draw(&mut self, scene: SceneRef<'_>) -> Result<FrameTime, Failure> {
        let start = Instant::now();
        let recorded = self.renderer.record(scene)?;
        let submitted = self.submitter.submit(recorded)?;
        let cpu = start.elapsed();
        submitted.submission.wait_until_drawn()?;
        let frame = start.elapsed();
        let occluded = submitted.statistics.views.iter().map(|view| view.occluded).sum();
        self.views = submitted.statistics.views.into_iter().map(|view| view.name).collect();
        self.last = Some(submitted.submission);
        Ok(FrameTime { cpu, frame, occluded })
    }

    fn read(&self, target: &str) -> Result<Picture, Failure> {
        self.last.as_ref().ok_or("nothing was drawn")?.read_target(target)
    }

    fn views(&self) -> &[String] {
        &self.views
    }

    fn commands(&self, process: &str, view: usize) -> Vec<RenderCommand> {
        self.renderer.draw_list(process, view).map_or_else(Vec::new, |list| list.commands().copied().collect())
    }
}

/// A frame that was submitted, whoever draws it.
trait Drawn {
    const KIND: &str;

    fn wait_until_drawn(&self) -> Result<(), Failure>;
    fn read_target(&self, target: &str) -> Result<Picture, Failure>;
}

impl Drawn for WgpuSubmission {
    const KIND: &str = "wgpu";

    fn wait_until_drawn(&self) -> Result<(), Failure> {
        Ok(self.wait()?)
    }

    fn read_target(&self, target: &str) -> Result<Picture, Failure> {
        Ok(self.read(0, target)?)
    }
}

impl Drawn for SoftwareSubmission {
    const KIND: &str = "software";

    /// It is drawn when it is submitted.
    fn wait_until_drawn(&self) -> Result<(), Failure> {
        Ok(())
    }

    fn read_target(&self, target: &str) -> Result<Picture, Failure> {
        Ok(self.read(0, target)?)
    }
}
