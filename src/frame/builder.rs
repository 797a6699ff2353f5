//! How a renderer is put together.

use std::sync::Arc;

use super::plans::Plans;
use super::renderer::Renderer;
use super::{BuildError, Granularity, Submitter};
use crate::backend::Backend;
use crate::process::{Deferred, RenderProcess};
use crate::quality::Quality;
use crate::task::Scheduler;
use crate::view::ShadowMaps;

/// Puts a renderer together from processes.
pub struct RendererBuilder<B> {
    backend: B,
    deferred: Option<Deferred>,
    processes: Vec<Arc<dyn RenderProcess>>,
    outputs: Vec<String>,
    shadow_maps: ShadowMaps,
    granularity: Granularity,
    instancing: bool,
    quality: Option<Quality>,
}

impl<B: Backend> RendererBuilder<B> {
    pub(super) fn new(backend: B) -> Self {
        Self {
            backend,
            deferred: None,
            processes: Vec::new(),
            outputs: Vec::new(),
            shadow_maps: ShadowMaps::default(),
            granularity: Granularity::default(),
            instancing: true,
            quality: None,
        }
    }

    /// Adds a process. The order of these calls only matters where reads and writes leave it open.
    pub fn process(mut self, process: impl RenderProcess + 'static) -> Self {
        self.processes.push(Arc::new(process));
        self
    }

    /// Adds the processes of a deferred pipeline, which follow from frame to frame what the scene requires, and its output.
    pub fn deferred(mut self, deferred: Deferred) -> Self {
        self.deferred = Some(deferred);
        self
    }

    /// Names a target that the frame is for. Processes that lead to none are dropped.
    pub fn output(mut self, target: impl Into<String>) -> Self {
        self.outputs.push(target.into());
        self
    }

    /// How lights that cast shadows are seen, for processes of the engine's own that draw in views of
    /// [`ViewKind::Shadow`](crate::scene::ViewKind::Shadow). If a [`Deferred`] pipeline draws shadow maps, it says how instead.
    pub fn shadow_maps(mut self, maps: ShadowMaps) -> Self {
        self.shadow_maps = maps;
        self
    }

    /// How finely a frame is cut into jobs.
    pub fn granularity(mut self, granularity: Granularity) -> Self {
        self.granularity = granularity;
        self
    }

    /// Whether equal commands become one instanced draw, which they do unless said otherwise. Without it each object is a draw
    /// of its own, as in engines that do not merge: the same picture, at a higher price.
    pub fn instancing(mut self, instancing: bool) -> Self {
        self.instancing = instancing;
        self
    }

    /// How accurate frames are, and so what they cost. It says so of the [`Deferred`] pipeline as well, whatever that was told:
    /// see [`Deferred::quality`]. Without it the pipeline stays as it is, and all else is [`Quality::balanced`].
    pub fn quality(mut self, quality: Quality) -> Self {
        self.quality = Some(quality);
        self
    }

    /// The renderer, which records on the scheduler's workers, and the submitter. The thread that calls this is the device
    /// thread: the submitter cannot leave it.
    ///
    /// # Errors
    /// If the processes do not make a frame, if shadow maps or the quality cannot be as they are set, or if the granularity is a
    /// chunk of 0.
    pub fn build(self, scheduler: Arc<Scheduler>) -> Result<(Renderer<B>, Submitter<B>), BuildError> {
        if self.granularity == Granularity::Chunk(0) {
            return Err(BuildError::EmptyChunk);
        }
        self.quality.unwrap_or_default().check()?;
        let deferred = match (self.deferred, &self.quality) {
            (Some(deferred), Some(quality)) => Some(deferred.quality(quality)),
            (deferred, _) => deferred,
        };
        let plans = Plans::new(deferred, self.processes, self.outputs, self.shadow_maps)?;
        let backend = Arc::new(self.backend);
        let submitter = Submitter::new(Arc::clone(&backend), Arc::clone(scheduler.timeline()));
        Ok((Renderer::new(backend, plans, self.granularity, self.instancing, self.quality, scheduler), submitter))
    }
}
