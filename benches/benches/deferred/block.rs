//! A block of settings, which are measured interleaved.

use std::error::Error;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{Picture, WgpuBackend, WgpuSubmission};
use drawloom::process::Draws;
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom::{FrameStatistics, Renderer, RendererBuilder, Submitter};
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::{Harness, Rounds, WARM_UP};
use drawloom_benches::statistics::median_duration;
use drawloom_benches::stopwatch::{FrameTime, timed_frame};
use indicatif::ProgressBar;

use crate::Extent;

/// The settings of one table on one backend.
pub struct Block<'a> {
    backend: BackendName,
    progress: &'a ProgressBar,
    schedulers: Vec<Arc<Scheduler>>,
    settings: Vec<Setting>,
}

/// A pipeline that draws a scene, and its frame times.
pub struct Setting {
    scene: Rc<Scene>,
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    times: Vec<FrameTime>,
    statistics: FrameStatistics,
    submission: Option<WgpuSubmission>,
}

impl<'a> Block<'a> {
    pub fn new(backend: BackendName, progress: &'a ProgressBar) -> Self {
        Self { backend, progress, schedulers: Vec::new(), settings: Vec::new() }
    }

    /// Adds a setting with a device of its own. Settings with equally many workers share a scheduler.
    ///
    /// # Errors
    /// Returns an error if the renderer cannot be built.
    pub fn add(
        &mut self,
        scene: Rc<Scene>,
        workers: usize,
        pipeline: impl FnOnce(RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend>,
    ) -> Result<(), Box<dyn Error>> {
        let known = self.schedulers.iter().find(|scheduler| scheduler.workers() == workers).cloned();
        let scheduler = match known {
            Some(known) => known,
            None => Arc::new(Scheduler::new(workers)?),
        };
        self.schedulers.push(Arc::clone(&scheduler));
        let (renderer, submitter) = pipeline(Renderer::builder(self.backend.open()?)).build(scheduler)?;
        let (times, statistics) = (Vec::new(), FrameStatistics::default());
        self.settings.push(Setting { scene, renderer, submitter, times, statistics, submission: None });
        Ok(())
    }

    /// Measures all settings, one frame of each per round, and returns them in the order they were added.
    ///
    /// # Errors
    /// Returns an error if a frame cannot be drawn.
    pub fn measure(mut self, extent: &Extent, block: &str) -> Result<Vec<Setting>, Box<dyn Error>> {
        self.progress.set_message(format!("{block}, {}", self.backend.name()));
        let rounds = Rounds { warm_up: WARM_UP, measured: self.backend.of(extent.rounds) };
        let times = Harness::new(rounds, self.progress).measure(&mut self.settings, |setting, _round| {
            let Setting { scene, renderer, submitter, statistics, submission, .. } = setting;
            let (submitted, time) = timed_frame(renderer, submitter, scene.as_scene_ref(), WgpuSubmission::wait)?;
            *statistics = submitted.statistics;
            *submission = Some(submitted.submission);
            Ok::<_, Box<dyn Error>>(time)
        })?;
        self.settings.iter_mut().zip(times).for_each(|(setting, times)| setting.times = times);
        Ok(self.settings)
    }
}

impl Setting {
    /// From the hand-over of the scene to the return of submit; the median.
    pub fn cpu(&self) -> Duration {
        median_duration(self.times.iter().map(|time| time.cpu))
    }

    /// From the call of submit until the device has drawn the frame; the median.
    pub fn device(&self) -> Duration {
        median_duration(self.times.iter().map(|time| time.device))
    }

    /// Statistics of the last frame.
    pub fn statistics(&self) -> &FrameStatistics {
        &self.statistics
    }

    /// Commands of the last frame in all views.
    pub fn commands(&self) -> usize {
        self.statistics.views.iter().map(|view| view.commands).sum()
    }

    pub fn processes(&self) -> usize {
        self.renderer.plan().processes().len()
    }

    /// Instanced draws: all batches of objects, and one for each process that draws lights. Every class of lights must be in view.
    pub fn draws(&self) -> usize {
        let batches: usize = self.statistics.views.iter().map(|view| view.batches).sum();
        let draws_lights = |draws: Draws<'_>| matches!(draws, Draws::Lights(_));
        let processes = self.renderer.plan().processes().iter();
        batches + processes.filter(|planned| draws_lights(planned.process.draws())).count()
    }

    /// The picture of the last frame.
    ///
    /// # Errors
    /// Returns an error if no frame was drawn, or if the picture cannot be read.
    pub fn picture(&self) -> Result<Picture, Box<dyn Error>> {
        let submission = self.submission.as_ref().ok_or("no frame was drawn")?;
        Ok(submission.read(0, "picture")?)
    }
}
