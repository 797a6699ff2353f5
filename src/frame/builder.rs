//! How a renderer is put together.

use std::sync::Arc;

use super::renderer::Renderer;
use super::{BuildError, Granularity, Submitter};
use crate::backend::Backend;
use crate::process::{FramePlan, GeometryBuffer, Lighting, RenderProcess, ToneMapping};
use crate::task::Scheduler;

/// Puts a renderer together from processes.
pub struct RendererBuilder<B> {
    backend: B,
    processes: Vec<Box<dyn RenderProcess>>,
    outputs: Vec<String>,
    granularity: Granularity,
}

impl<B: Backend> RendererBuilder<B> {
    pub(super) fn new(backend: B) -> Self {
        Self { backend, processes: Vec::new(), outputs: Vec::new(), granularity: Granularity::default() }
    }

    /// Adds a process. The order of these calls only matters where reads and writes leave it open.
    pub fn process(mut self, process: impl RenderProcess + 'static) -> Self {
        self.processes.push(Box::new(process));
        self
    }

    /// Adds [`GeometryBuffer`], [`Lighting`] and [`ToneMapping`], and their output `picture`.
    pub fn deferred(self) -> Self {
        self.process(GeometryBuffer).process(Lighting).process(ToneMapping::default()).output("picture")
    }

    /// Names a target that the frame is for. Processes that lead to none are dropped.
    pub fn output(mut self, target: impl Into<String>) -> Self {
        self.outputs.push(target.into());
        self
    }

    /// How finely a frame is cut into jobs.
    pub fn granularity(mut self, granularity: Granularity) -> Self {
        self.granularity = granularity;
        self
    }

    /// The renderer, which records on the scheduler's workers, and the submitter. The thread that calls this is the device
    /// thread: the submitter cannot leave it.
    ///
    /// # Errors
    /// If the processes do not make a frame, or the granularity is a chunk of 0.
    pub fn build(self, scheduler: Arc<Scheduler>) -> Result<(Renderer<B>, Submitter<B>), BuildError> {
        if self.granularity == Granularity::Chunk(0) {
            return Err(BuildError::EmptyChunk);
        }
        let plan = FramePlan::new(self.processes, &self.outputs)?;
        let backend = Arc::new(self.backend);
        let submitter = Submitter::new(Arc::clone(&backend));
        Ok((Renderer::new(backend, plan, self.granularity, scheduler), submitter))
    }
}
