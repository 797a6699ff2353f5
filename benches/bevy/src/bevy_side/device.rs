//! Bevy's device.

use bevy_render::renderer::{
    RenderAdapter, RenderAdapterInfo, RenderDevice, RenderInstance, RenderQueue, initialize_renderer,
};
use bevy_render::settings::{RenderResources, WgpuSettings};
use bevy_tasks::block_on;
use drawloom::wgpu;
use drawloom_benches::backends::BackendName;

use crate::contender::Failure;

/// # Errors
/// Returns an error if no device can be opened.
pub fn open(backend: BackendName) -> Result<RenderResources, Failure> {
    match backend {
        BackendName::Noop => noop(),
        BackendName::Adapter => {
            // As `RenderCreation::Automatic` does it. wgpu does not check indirect draws then.
            let settings = WgpuSettings::default();
            let backends = settings.backends.unwrap_or(wgpu::Backends::all());
            Ok(block_on(initialize_renderer(backends, None, &settings)))
        }
    }
}

/// A device on wgpu's no-op backend with what a desktop's graphics card has: Bevy culls and draws indirectly there,
/// with bindless materials.
fn noop() -> Result<RenderResources, Failure> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::NOOP;
    // wgpu's check of indirect draws panics on this backend.
    descriptor.flags.remove(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
    descriptor.backend_options.noop = wgpu::NoopBackendOptions { enable: true, ..Default::default() };
    let instance = wgpu::Instance::new(descriptor);
    let adapter = block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let (device, queue) = block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_features: FEATURES,
        required_limits: limits(),
        ..wgpu::DeviceDescriptor::default()
    }))?;
    Ok(RenderResources(
        RenderDevice::from(device),
        RenderQueue::new(queue),
        RenderAdapterInfo::new(adapter.get_info()),
        RenderAdapter::new(adapter),
        RenderInstance::new(instance),
    ))
}

/// The features that Bevy's renderer looks for. The adapter also claims features of formats that it then has no answer
/// for.
const FEATURES: wgpu::Features = wgpu::Features::INDIRECT_FIRST_INSTANCE
    .union(wgpu::Features::IMMEDIATES)
    .union(wgpu::Features::MULTI_DRAW_INDIRECT_COUNT)
    .union(wgpu::Features::TEXTURE_BINDING_ARRAY)
    .union(wgpu::Features::BUFFER_BINDING_ARRAY)
    .union(wgpu::Features::STORAGE_RESOURCE_BINDING_ARRAY)
    .union(wgpu::Features::PARTIALLY_BOUND_BINDING_ARRAY)
    .union(wgpu::Features::SAMPLED_TEXTURE_AND_STORAGE_BUFFER_ARRAY_NON_UNIFORM_INDEXING)
    .union(wgpu::Features::DEPTH_CLIP_CONTROL)
    .union(wgpu::Features::DUAL_SOURCE_BLENDING)
    .union(wgpu::Features::FLOAT32_FILTERABLE)
    .union(wgpu::Features::RG11B10UFLOAT_RENDERABLE)
    .union(wgpu::Features::SUBGROUP)
    .union(wgpu::Features::TIMESTAMP_QUERY);

/// wgpu does not support the limits that the adapter claims. These are common ones of desktops' graphics cards.
fn limits() -> wgpu::Limits {
    wgpu::Limits {
        max_bindings_per_bind_group: 65_535,
        max_sampled_textures_per_shader_stage: 128,
        max_samplers_per_shader_stage: 64,
        max_storage_buffers_per_shader_stage: 32,
        max_storage_textures_per_shader_stage: 32,
        max_buffers_and_acceleration_structures_per_shader_stage: 64,
        max_binding_array_elements_per_shader_stage: 500_000,
        max_binding_array_sampler_elements_per_shader_stage: 1_000,
        max_storage_buffer_binding_size: 1 << 30,
        max_buffer_size: 1 << 30,
        max_immediate_size: 128,
        max_non_sampler_bindings: 1_000_000,
        ..wgpu::Limits::default()
    }
}
