//! Backends that share their compiled pipelines.

use super::backend::WgpuBackend;
use super::pipelines::SharedPipelines;
use crate::backend::BackendError;

/// Makes backends on one device that share their compiled shaders and pipelines: for an engine that opens renderers
/// while it runs, such as one for thumbnails, or for the preview of a material.
///
/// A renderer compiles in its first frame what its processes need, which takes tenths of a second. A renderer on a
/// backend of a library compiles only what no other backend of the library has compiled before. They share nothing
/// else: each tunes its own strategies, and counts the [pipelines](super::WgpuResources::pipelines) that it uses.
///
/// The library keeps all that was compiled, until it and its backends are dropped or until it is
/// [cleared](Self::clear). Clones are the same library.
///
/// ```no_run
/// # use drawloom::{Renderer, backend::PipelineLibrary, process::Deferred, task::Scheduler, wgpu};
/// # use std::sync::Arc;
/// # fn open(device: wgpu::Device, queue: wgpu::Queue, scheduler: Arc<Scheduler>) -> Result<(), Box<dyn std::error::Error>> {
/// let library = PipelineLibrary::new(device, queue);
/// let game = Renderer::builder(library.backend()?).pipeline(Deferred::to_picture()).build(Arc::clone(&scheduler))?;
/// // Later: what the game has drawn with needs no compiling.
/// let preview = Renderer::builder(library.backend()?).pipeline(Deferred::to_picture()).build(scheduler)?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone)]
pub struct PipelineLibrary {
    device: wgpu::Device,
    queue: wgpu::Queue,
    shared: SharedPipelines,
}

impl PipelineLibrary {
    /// An empty library of the engine's device.
    pub fn new(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        Self { device, queue, shared: SharedPipelines::new(true) }
    }

    /// A backend on the device, as [`WgpuBackend::new`] makes it, that uses and adds to what the library has.
    ///
    /// # Errors
    /// If the device lacks a feature or a limit, naming it.
    pub fn backend(&self) -> Result<WgpuBackend, BackendError> {
        let backend = WgpuBackend::new(self.device.clone(), self.queue.clone())?;
        Ok(WgpuBackend { shared_pipelines: self.shared.clone(), ..backend })
    }

    /// Drops all that was compiled, for example after many versions of a shader that is being edited. Renderers keep
    /// what they use.
    pub fn clear(&self) {
        self.shared.clear();
    }

    /// The number of pipelines that the library has.
    pub fn pipeline_count(&self) -> usize {
        self.shared.kept_pipeline_count()
    }
}
