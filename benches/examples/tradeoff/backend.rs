//! The backend under test: wgpu or the software backend, behind one trait.

use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::backend::{Backend, Picture, SoftwareBackend, SoftwareSubmission, WgpuBackend, WgpuSubmission};
use drawloom::command::RenderCommand;
use drawloom::process::{Deferred, Fxaa, ToneMapping};
use drawloom::scene::{SceneRef, ViewKind};
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom::{Renderer, Submitter};
use drawloom_testing::adapter;

use crate::Failure;
use crate::arguments::{Arguments, BackendName};
use crate::configuration::Configuration;
use crate::shown_views::{Impostor, Mirror};
use crate::subject::{IMPOSTOR, MIRRORS, Subject};

/// A backend with timed frames and readable targets.
pub trait BackendUnderTest {
    /// The name of the adapter.
    fn name(&self) -> &str;

    /// One word for file names.
    fn kind(&self) -> &'static str;

    /// Draws the next frame as if it were the first, with these settings.
    ///
    /// # Errors
    /// Returns an error if the renderer rejects them.
    fn configure(&mut self, configuration: &Configuration) -> Result<(), Failure>;

    /// # Errors
    /// Returns an error if the frame fails.
    fn draw(&mut self, scene: SceneRef<'_>) -> Result<FrameTime, Failure>;

    /// Reads a target of the last frame's first view.
    ///
    /// # Errors
    /// Returns an error if there is no such target, or if it cannot be read.
    fn read(&self, target: &str) -> Result<Picture, Failure>;

    /// The names of the last frame's views.
    fn views(&self) -> &[String];

    /// The commands that a process drew in a view of the last frame, in order.
    fn commands(&self, process: &str, view: usize) -> Vec<RenderCommand>;
}

/// The times of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameTime {
    /// From the hand-over of the scene to the return of submit.
    pub cpu: Duration,
    /// Until the frame is drawn.
    pub frame: Duration,
    /// Objects that occlusion culling removed.
    pub occluded: usize,
    /// How many frames ago the oldest picture was drawn that a mirror shows.
    pub age: u32,
}

impl FrameTime {
    /// The mean of several frames, and the greatest age.
    pub fn mean(times: &[Self]) -> Self {
        let count = times.len().max(1) as u32;
        let mean = |of: fn(&Self) -> Duration| times.iter().map(of).sum::<Duration>() / count;
        let occluded = times.iter().map(|time| time.occluded).sum::<usize>() / times.len().max(1);
        let age = times.iter().map(|time| time.age).max().unwrap_or(0);
        Self { cpu: mean(|time| time.cpu), frame: mean(|time| time.frame), occluded, age }
    }
}

/// Opens the requested backend. By default it is wgpu, or software if there is no adapter.
///
/// # Errors
/// Returns an error if wgpu is requested and there is no adapter.
pub fn open(arguments: &Arguments, subject: &Subject) -> Result<Box<dyn BackendUnderTest>, Failure> {
    if arguments.backend == Some(BackendName::Software) {
        return software(subject);
    }
    match adapter::device() {
        Ok((device, queue)) => {
            let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
            Ok(Box::new(Runner::new(WgpuBackend::new(device, queue)?, scheduler, subject)?))
        }
        Err(_) if arguments.backend.is_none() => software(subject),
        Err(error) => Err(error),
    }
}

/// Opens the reference: the software backend in f64, with [`Configuration::exact`].
///
/// # Errors
/// Returns an error if the renderer cannot be built.
pub fn reference(subject: &Subject) -> Result<Box<dyn BackendUnderTest>, Failure> {
    Ok(Box::new(Runner::new(SoftwareBackend::reference(), Arc::new(Scheduler::new(1)?), subject)?))
}

fn software(subject: &Subject) -> Result<Box<dyn BackendUnderTest>, Failure> {
    let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
    Ok(Box::new(Runner::new(SoftwareBackend::new(Arc::clone(&scheduler)), scheduler, subject)?))
}

fn deferred(maps: ShadowMaps) -> Deferred {
    Deferred::new().shadow_maps(Some(maps)).post(ToneMapping::default()).post(Fxaa::default())
}

/// A renderer on one backend.
struct Runner<B: Backend> {
    name: String,
    renderer: Renderer<B>,
    submitter: Submitter<B>,
    maps: ShadowMaps,
    views: Vec<String>,
    last: Option<B::Submission>,
}

impl<B: Backend> Runner<B> {
    fn new(backend: B, scheduler: Arc<Scheduler>, subject: &Subject) -> Result<Self, Failure> {
        let name = backend.adapter_name();
        let Configuration { maps, quality, .. } = Configuration::exact();
        let mut builder = Renderer::builder(backend).pipeline(deferred(maps)).quality(quality);
        let mut after = None;
        for (_, (view, surface)) in subject.mirrors.iter().zip(MIRRORS) {
            builder = builder.process(Mirror { view, surface, after });
            after = Some(view);
        }
        if subject.impostor.is_some() {
            builder = builder.process(Impostor);
        }
        let (renderer, submitter) = builder.build(scheduler)?;
        Ok(Self { name, renderer, submitter, maps, views: Vec::new(), last: None })
    }
}

impl<B: Backend> BackendUnderTest for Runner<B>
where
    B::Submission: DrawnFrame,
{
    fn name(&self) -> &str {
        &self.name
    }

    fn kind(&self) -> &'static str {
        B::Submission::KIND
    }

    fn configure(&mut self, configuration: &Configuration) -> Result<(), Failure> {
        if self.maps != configuration.maps {
            self.renderer.set_pipeline(deferred(configuration.maps))?;
            self.maps = configuration.maps;
        }
        self.renderer.set_quality(configuration.quality)?;
        self.renderer.forget_previous_frames();
        Ok(())
    }

    fn draw(&mut self, scene: SceneRef<'_>) -> Result<FrameTime, Failure> {
        let start = Instant::now();
        let recorded = self.renderer.record(scene)?;
        let submitted = self.submitter.submit(recorded)?;
        let cpu = start.elapsed();
        submitted.submission.wait_until_drawn()?;
        let frame = start.elapsed();
        let views = &submitted.statistics.views;
        let occluded = views.iter().map(|view| view.occluded).sum();
        let mirrors = views.iter().filter(|view| view.kind == ViewKind::Reflection && view.name != IMPOSTOR);
        let age = mirrors.map(|view| view.age).max().unwrap_or(0);
        self.views = submitted.statistics.views.into_iter().map(|view| view.name).collect();
        self.last = Some(submitted.submission);
        Ok(FrameTime { cpu, frame, occluded, age })
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

/// A submitted frame of any backend.
trait DrawnFrame {
    const KIND: &str;

    fn wait_until_drawn(&self) -> Result<(), Failure>;
    fn read_target(&self, target: &str) -> Result<Picture, Failure>;
}

impl DrawnFrame for WgpuSubmission {
    const KIND: &str = "wgpu";

    fn wait_until_drawn(&self) -> Result<(), Failure> {
        Ok(self.wait()?)
    }

    fn read_target(&self, target: &str) -> Result<Picture, Failure> {
        Ok(self.read(0, target)?)
    }
}

impl DrawnFrame for SoftwareSubmission {
    const KIND: &str = "software";

    /// The frame is drawn by the time it is submitted.
    fn wait_until_drawn(&self) -> Result<(), Failure> {
        Ok(())
    }

    fn read_target(&self, target: &str) -> Result<Picture, Failure> {
        Ok(self.read(0, target)?)
    }
}
