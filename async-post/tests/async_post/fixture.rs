//! A renderer with asynchronous post-processing, on either backend.

use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::{Duration, Instant};

use drawloom::backend::{Backend, Picture, SoftwareBackend, SoftwareSubmission, WgpuBackend, WgpuSubmission};
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom::{Renderer, RendererBuilder, Submitter, wgpu};
use drawloom_async_post::{AsyncPost, AsyncPostStatistics, AsyncStep, StepSource, UploadPicture};
use drawloom_testing::adapter;
use libtest_mimic::Failed;

/// Longer than anything here takes, also on a machine that is busy.
pub const LONG: Duration = Duration::from_secs(60);

/// A device on the machine's adapter, which all cases share; `None` without an adapter.
pub fn device() -> Option<(wgpu::Device, wgpu::Queue)> {
    static DEVICE: OnceLock<Option<(wgpu::Device, wgpu::Queue)>> = OnceLock::new();
    DEVICE.get_or_init(|| adapter::device().ok()).clone()
}

/// A backend that draws.
pub trait DrawingBackend: Backend + UploadPicture {
    fn open(scheduler: &Arc<Scheduler>) -> Result<Self, Failed>
    where
        Self: Sized;

    /// The pixels of a view's target, when the frame is drawn.
    fn read(submission: &Self::Submission, view: usize, target: &str) -> Result<Picture, Failed>;
}

impl DrawingBackend for WgpuBackend {
    fn open(_scheduler: &Arc<Scheduler>) -> Result<Self, Failed> {
        let (device, queue) = device().ok_or("there is no graphics adapter")?;
        Ok(Self::new(device, queue)?)
    }

    fn read(submission: &WgpuSubmission, view: usize, target: &str) -> Result<Picture, Failed> {
        Ok(submission.read(view, target)?)
    }
}

impl DrawingBackend for SoftwareBackend {
    fn open(scheduler: &Arc<Scheduler>) -> Result<Self, Failed> {
        Ok(Self::new(Arc::clone(scheduler)))
    }

    fn read(submission: &SoftwareSubmission, view: usize, target: &str) -> Result<Picture, Failed> {
        Ok(submission.read(view, target)?)
    }
}

/// A renderer with asynchronous post-processing.
pub struct Engine<B: Backend> {
    pub renderer: Renderer<B>,
    pub submitter: Submitter<B>,
    pub post: AsyncPost,
}

/// A frame that was submitted.
pub struct Frame<B: Backend> {
    pub submission: B::Submission,
    /// Of each view.
    pub statistics: Vec<AsyncPostStatistics>,
}

impl<B: DrawingBackend> Engine<B> {
    pub fn new(
        step: impl AsyncStep,
        source: StepSource,
        build: impl FnOnce(RendererBuilder<B>, &AsyncPost) -> RendererBuilder<B>,
    ) -> Result<Self, Failed> {
        Self::with_workers(2, step, source, build)
    }

    pub fn with_workers(
        workers: usize,
        step: impl AsyncStep,
        source: StepSource,
        build: impl FnOnce(RendererBuilder<B>, &AsyncPost) -> RendererBuilder<B>,
    ) -> Result<Self, Failed> {
        let scheduler = Arc::new(Scheduler::new(workers)?);
        let post = AsyncPost::new(Arc::clone(&scheduler), step, source);
        let builder = build(Renderer::builder(B::open(&scheduler)?), &post);
        let (renderer, submitter) = builder.output(post.source_target()).build(scheduler)?;
        Ok(Self { renderer, submitter, post })
    }

    /// Draws a frame.
    pub fn draw(&mut self, scene: &Scene) -> Result<Frame<B>, Failed> {
        self.post.begin_frame(&self.renderer, &scene.cameras);
        let mut recorded = self.renderer.record(scene.as_scene_ref())?;
        self.post.read_back(&mut recorded);
        let statistics = self.post.statistics();
        Ok(Frame { submission: self.submitter.submit(recorded)?.submission, statistics })
    }

    /// Draws a frame, and waits until its results are there in these views.
    pub fn draw_and_wait(&mut self, scene: &Scene, views: &[&str]) -> Result<Frame<B>, Failed> {
        let frame = self.draw(scene)?;
        self.wait_for(&frame.submission, frame.statistics[0].frame, views)?;
        Ok(frame)
    }

    /// Waits until the results of a frame are there in these views.
    pub fn wait_for(&self, submission: &B::Submission, number: u64, views: &[&str]) -> Result<(), Failed> {
        // Waits until the frame is drawn.
        B::read(submission, 0, self.post.source_target())?;
        for view in views {
            wait_until("a result", || self.post.latest(view).is_some_and(|(latest, _)| latest >= number))?;
        }
        Ok(())
    }

    /// # Errors
    /// If there was an error.
    pub fn check_no_errors(&self) -> Result<(), Failed> {
        match self.post.take_errors().into_iter().next() {
            Some(error) => Err(error.to_string().into()),
            None => Ok(()),
        }
    }
}

/// # Errors
/// If it never comes true.
pub fn wait_until(what: &str, is_so: impl Fn() -> bool) -> Result<(), Failed> {
    let deadline = Instant::now() + LONG;
    while !is_so() {
        if Instant::now() > deadline {
            return Err(format!("{what} never came").into());
        }
        thread::sleep(Duration::from_micros(100));
    }
    Ok(())
}
