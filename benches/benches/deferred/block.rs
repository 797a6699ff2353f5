//! A block of settings, which are measured interleaved.

use std::error::Error;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{Picture, WgpuBackend};
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom::{Renderer, RendererBuilder};
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::{Harness, Rounds, WARM_UP};
use drawloom_benches::statistics::median_duration;
use drawloom_benches::stopwatch::FrameTime;
use indicatif::ProgressBar;

use crate::Extent;
use crate::contender::{Contender, Counts};
use crate::drawloom_pipeline::DrawloomPipeline;

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
    contender: Box<dyn Contender>,
    times: Vec<FrameTime>,
}

impl<'a> Block<'a> {
    pub fn new(backend: BackendName, progress: &'a ProgressBar) -> Self {
        Self { backend, progress, schedulers: Vec::new(), settings: Vec::new() }
    }

    /// Adds a pipeline of this crate.
    ///
    /// # Errors
    /// Returns an error if the renderer cannot be built.
    pub fn add(
        &mut self,
        scene: Rc<Scene>,
        workers: usize,
        pipeline: impl FnOnce(RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend>,
    ) -> Result<(), Box<dyn Error>> {
        let contender = self.pipeline(workers, pipeline)?;
        self.add_contender(scene, Box::new(contender));
        Ok(())
    }

    /// A pipeline of this crate with a device of its own. Those with equally many workers share a scheduler.
    ///
    /// # Errors
    /// Returns an error if the renderer cannot be built.
    pub fn pipeline(
        &mut self,
        workers: usize,
        pipeline: impl FnOnce(RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend>,
    ) -> Result<DrawloomPipeline, Box<dyn Error>> {
        let known = self.schedulers.iter().find(|scheduler| scheduler.workers() == workers).cloned();
        let scheduler = match known {
            Some(known) => known,
            None => Arc::new(Scheduler::new(workers)?),
        };
        self.schedulers.push(Arc::clone(&scheduler));
        let (renderer, submitter) = pipeline(Renderer::builder(self.backend.open()?)).build(scheduler)?;
        Ok(DrawloomPipeline::new(renderer, submitter))
    }

    /// Adds any pipeline.
    pub fn add_contender(&mut self, scene: Rc<Scene>, contender: Box<dyn Contender>) {
        self.settings.push(Setting { scene, contender, times: Vec::new() });
    }

    /// Measures all settings, one frame of each per round, and returns them in the order they were added.
    ///
    /// # Errors
    /// Returns an error if a frame cannot be drawn.
    pub fn measure(mut self, extent: &Extent, block: &str) -> Result<Vec<Setting>, Box<dyn Error>> {
        self.progress.set_message(format!("{block}, {}", self.backend.name()));
        let rounds = Rounds { warm_up: WARM_UP, measured: self.backend.of(extent.rounds) };
        let times = Harness::new(rounds, self.progress).measure(&mut self.settings, |setting, _round| {
            let Setting { scene, contender, .. } = setting;
            contender.frame(scene.as_scene_ref())
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

    /// What the last frame drew.
    pub fn counts(&self) -> Counts {
        self.contender.counts()
    }

    /// The picture of the last frame.
    ///
    /// # Errors
    /// Returns an error if no frame was drawn, or if the picture cannot be read.
    pub fn picture(&self) -> Result<Picture, Box<dyn Error>> {
        self.contender.picture()
    }
}
