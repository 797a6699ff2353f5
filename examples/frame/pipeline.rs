//! The backends, and the pipeline that draws with them.

use std::error::Error;
use std::sync::Arc;

use drawloom::backend::{Backend, SoftwareBackend, WgpuBackend};
use drawloom::process::{Deferred, Fxaa, ToneMapping};
use drawloom::scene::{Mesh, Scene, VERTEX_COLOR};
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter, wgpu};
use drawloom_testing::adapter;

use crate::arguments::{Arguments, BackendName};

/// The capacity of the timeline, in events of each worker.
const TIMELINE_CAPACITY: usize = 1 << 18;

/// The pipeline for a scene, on a scheduler of its own.
pub fn renderer<B: Backend>(
    arguments: &Arguments,
    scene: &Scene,
    make: impl FnOnce(&Arc<Scheduler>) -> B,
) -> Result<(Renderer<B>, Submitter<B>), Box<dyn Error>> {
    let builder = Scheduler::builder().timeline_capacity(TIMELINE_CAPACITY);
    let scheduler = Arc::new(match arguments.workers {
        Some(workers) => builder.workers(workers.get()).build()?,
        None => builder.build()?,
    });
    let deferred = Deferred::new()
        .depth_pre_pass(arguments.depth_pre_pass)
        .vertex_colors(has_vertex_colors(scene))
        .post(ToneMapping::default())
        .post(Fxaa::default());
    let backend = make(&scheduler);
    Ok(Renderer::builder(backend).pipeline(deferred).granularity(arguments.granularity.0).build(scheduler)?)
}

fn has_vertex_colors(scene: &Scene) -> bool {
    scene.assets().iter::<Mesh>().any(|(_, mesh)| mesh.attribute(VERTEX_COLOR).is_some())
}

/// wgpu on the machine's best adapter.
pub fn adapter_backend(arguments: &Arguments) -> Result<WgpuBackend, Box<dyn Error>> {
    wgpu_backend(arguments, adapter::device()?)
}

/// wgpu on a device.
pub fn wgpu_backend(
    arguments: &Arguments,
    (device, queue): (wgpu::Device, wgpu::Queue),
) -> Result<WgpuBackend, Box<dyn Error>> {
    let backend = WgpuBackend::new(device, queue)?;
    Ok(match arguments.record {
        None => backend,
        Some(record) => backend.recording_strategy(record.strategy()),
    })
}

/// The software backend, or its reference if that is requested.
pub fn software_backend(requested: Option<BackendName>, scheduler: &Arc<Scheduler>) -> SoftwareBackend {
    match requested {
        Some(BackendName::Reference) => SoftwareBackend::reference(),
        _ => SoftwareBackend::new(Arc::clone(scheduler)),
    }
}
