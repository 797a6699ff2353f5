//! Builds a renderer.

use std::sync::Arc;

use super::plan_cache::{PlanCache, PlanSources};
use super::renderer::Renderer;
use super::{BuildError, Granularity, Submitter};
use crate::backend::{Backend, GuardedBackend};
use crate::process::{Contained, DeviceSupport, Pipeline, RenderProcess};
use crate::quality::Quality;
use crate::task::Scheduler;
use crate::view::ShadowMaps;

/// Builds a [`Renderer`] from render processes and settings.
pub struct RendererBuilder<B> {
    backend: GuardedBackend<B>,
    sources: PlanSources,
    processes: Vec<Arc<dyn RenderProcess>>,
    granularity: Granularity,
    instancing: bool,
    quality: Option<Quality>,
}

impl<B: Backend> Renderer<B> {
    /// Starts to build a renderer.
    pub fn builder(backend: B) -> RendererBuilder<B> {
        RendererBuilder::new(backend)
    }
}

impl<B: Backend> RendererBuilder<B> {
    fn new(backend: B) -> Self {
        Self {
            backend: GuardedBackend::new(Arc::new(backend)),
            sources: PlanSources::default(),
            processes: Vec::new(),
            granularity: Granularity::default(),
            instancing: true,
            quality: None,
        }
    }

    /// Adds a render process. The order of these calls matters only where reads and writes leave it open.
    pub fn process(mut self, process: impl RenderProcess + 'static) -> Self {
        self.processes.push(Arc::new(Contained::new(process)));
        self
    }

    /// Sets the pipeline, such as [`Deferred`](crate::process::Deferred): its outputs, and in each frame the processes
    /// that the scene requires.
    pub fn pipeline(mut self, pipeline: impl Pipeline + 'static) -> Self {
        self.sources.pipeline = Some(Contained::new(Arc::new(pipeline)));
        self
    }

    /// Names an output of the frame. Processes that lead to no output are dropped.
    pub fn output(mut self, target: impl AsRef<str>) -> Self {
        self.sources.add_output(target.as_ref().to_owned());
        self
    }

    /// Sets the shadow maps for an engine's own processes that draw in views of
    /// [`ViewKind::Shadow`](crate::scene::ViewKind::Shadow). The settings of a
    /// [pipeline](Pipeline::shadow_maps) that draws shadow maps override these.
    pub fn shadow_maps(mut self, maps: ShadowMaps) -> Self {
        self.sources.shadow_maps = maps;
        self
    }

    /// Sets how finely a frame is divided into jobs.
    pub fn granularity(mut self, granularity: Granularity) -> Self {
        self.granularity = granularity;
        self
    }

    /// Sets whether equal commands become one instanced draw, which is the default. Otherwise each object is a draw of
    /// its own: the same picture at a higher cost.
    pub fn instancing(mut self, instancing: bool) -> Self {
        self.instancing = instancing;
        self
    }

    /// Sets the quality, of the frame and of the pipeline: see
    /// [`Deferred::quality`](crate::process::Deferred::quality) and [`Pipeline::with_quality`]. Without this call the
    /// pipeline keeps its own settings, and everything else is [`Quality::balanced`].
    pub fn quality(mut self, quality: Quality) -> Self {
        self.quality = Some(quality);
        self
    }

    /// Builds the renderer, which records on the scheduler's workers, and the submitter, which cannot leave this
    /// thread: the thread that calls this is the device thread.
    ///
    /// # Errors
    /// If the processes make no frame, if the settings of shadow maps or the quality are invalid, or if the granularity
    /// is a chunk of 0.
    pub fn build(self, scheduler: Arc<Scheduler>) -> Result<(Renderer<B>, Submitter<B>), BuildError> {
        if self.granularity == Granularity::Chunk(0) {
            return Err(BuildError::EmptyChunk);
        }
        self.quality.unwrap_or_default().check()?;
        let (backend, mut sources) = (self.backend, self.sources);
        self.processes.into_iter().try_for_each(|process| sources.add_process(process))?;
        if let Some(quality) = &self.quality {
            sources.set_quality(quality)?;
        }
        let plans = PlanCache::new(sources, DeviceSupport::new(backend.can_blend_floats()))?;
        let submitter = Submitter::new(backend.clone(), Arc::clone(scheduler.timeline()));
        Ok((Renderer::new(backend, plans, self.granularity, self.instancing, self.quality, scheduler), submitter))
    }
}
