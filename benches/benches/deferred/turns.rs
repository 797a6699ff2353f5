//! Settings that take turns.

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
use drawloom_benches::stopwatch::{FrameTime, WARM_UP, median, timed_frame};
use drawloom_testing::random::Random;
use indicatif::ProgressBar;

use crate::Extent;

/// Those of one block, all on one backend.
pub struct Turns<'a> {
    backend: BackendName,
    progress: &'a ProgressBar,
    schedulers: Vec<Arc<Scheduler>>,
    settings: Vec<Setting>,
}

/// A pipeline that draws a scene, and what its frames took.
pub struct Setting {
    scene: Rc<Scene>,
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    times: Vec<FrameTime>,
    statistics: FrameStatistics,
    submission: Option<WgpuSubmission>,
}

impl<'a> Turns<'a> {
    pub fn new(backend: BackendName, progress: &'a ProgressBar) -> Self {
        Self { backend, progress, schedulers: Vec::new(), settings: Vec::new() }
    }

    /// Adds a setting: on a device of its own, and a scheduler that it shares with the others of as many workers.
    ///
    /// # Errors
    /// If it cannot be built.
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

    /// Lets them take turns, a frame each, and returns them in the order they were added. Each round has an order of its own:
    /// a frame takes longer after one that filled the caches, or kept a device in software busy beyond its end, and it must
    /// not be the same one that always comes after it.
    ///
    /// # Errors
    /// If a frame cannot be drawn.
    pub fn take(mut self, extent: &Extent, block: &str) -> Result<Vec<Setting>, Box<dyn Error>> {
        let rounds = self.backend.of(extent.rounds);
        self.progress.set_message(format!("{block}, {}", self.backend.name()));
        self.progress.inc_length(((WARM_UP + rounds) * self.settings.len()) as u64);
        let mut random = Random::new();
        for round in 0..WARM_UP + rounds {
            for index in random.order(self.settings.len()) {
                let Setting { scene, renderer, submitter, times, statistics, submission } = &mut self.settings[index];
                let (submitted, time) = timed_frame(renderer, submitter, scene.as_scene_ref(), WgpuSubmission::wait)?;
                if round >= WARM_UP {
                    times.push(time);
                }
                *statistics = submitted.statistics;
                *submission = Some(submitted.submission);
                self.progress.inc(1);
            }
        }
        Ok(self.settings)
    }
}

impl Setting {
    /// From the scene's hand-over to the return of submit; the median.
    pub fn processor(&self) -> Duration {
        median(self.times.iter().map(|time| time.processor))
    }

    /// From the call of submit until the device has drawn the frame; the median.
    pub fn device(&self) -> Duration {
        median(self.times.iter().map(|time| time.device))
    }

    /// What the last frame was.
    pub fn statistics(&self) -> &FrameStatistics {
        &self.statistics
    }

    /// Over all views.
    pub fn commands(&self) -> usize {
        self.statistics.views.iter().map(|view| view.commands).sum()
    }

    pub fn processes(&self) -> usize {
        self.renderer.plan().processes().len()
    }

    /// Instanced draws: those of objects over all views, and one for each process that draws lights, of each of whose class
    /// there is one in sight.
    pub fn draws(&self) -> usize {
        let batches: usize = self.statistics.views.iter().map(|view| view.batches).sum();
        let draws_lights = |draws: Draws<'_>| matches!(draws, Draws::Lights(_));
        let processes = self.renderer.plan().processes().iter();
        batches + processes.filter(|planned| draws_lights(planned.process.draws())).count()
    }

    /// What the last frame looks like.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn picture(&self) -> Result<Picture, Box<dyn Error>> {
        let submission = self.submission.as_ref().ok_or("no frame was drawn")?;
        Ok(submission.read(0, "picture")?)
    }
}
