//! Bind group layouts: `@group(0)` and `@group(1)` of `drawloom.wgsl`, and `@group(2)` and `@group(3)` of each render
//! process; and bind groups that are kept from frame to frame.

use std::num::NonZeroU64;
use std::sync::Arc;

use wgpu::ShaderStages;

use crate::backend::BackendError;
use crate::backend::wgpu::error_scope::{catch_wgpu_panic, with_error_scope};
use crate::process::{Format, ShaderResource};
use crate::view::{GpuView, TextureSet};

/// The bind group layouts that all processes share.
#[derive(Clone)]
pub(crate) struct BindGroupLayouts {
    /// View, objects, the indices of drawn objects, lights.
    pub(crate) frame: wgpu::BindGroupLayout,
    /// Materials and textures.
    pub(crate) assets: wgpu::BindGroupLayout,
    pub(crate) frame_entries: Arc<[wgpu::BindGroupLayoutEntry]>,
    pub(crate) asset_entries: Arc<[wgpu::BindGroupLayoutEntry]>,
}

/// Shipped processes have no compute shaders, but raw passes of an engine may.
const ALL_STAGES: ShaderStages = ShaderStages::VERTEX_FRAGMENT.union(ShaderStages::COMPUTE);
const FRAGMENT_AND_COMPUTE: ShaderStages = ShaderStages::FRAGMENT.union(ShaderStages::COMPUTE);

impl BindGroupLayouts {
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let layout = |label, entries: &[wgpu::BindGroupLayoutEntry]| {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
        };
        let frame = [
            entry(0, ALL_STAGES, uniform(size_of::<GpuView>() as u64)),
            entry(1, ALL_STAGES, storage(false)),
            entry(2, ALL_STAGES, storage(false)),
            entry(3, ALL_STAGES, storage(false)),
        ];
        let array = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: true },
            view_dimension: wgpu::TextureViewDimension::D2Array,
            multisampled: false,
        };
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let arrays = std::iter::repeat_n(array, TextureSet::MAX_ARRAYS);
        // The last one is that of targets.
        let samplers = std::iter::repeat_n(sampler, TextureSet::MAX_ARRAYS + 1);
        let textures = (1..).zip(arrays.chain(samplers)).map(|(binding, ty)| entry(binding, FRAGMENT_AND_COMPUTE, ty));
        let assets: Vec<_> = [entry(0, ALL_STAGES, storage(false))].into_iter().chain(textures).collect();
        Self {
            frame: layout("frame", &frame),
            assets: layout("assets", &assets),
            frame_entries: frame.into(),
            asset_entries: assets.into(),
        }
    }
}

/// A target that a shader samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SampledTarget {
    pub(crate) format: Format,
    /// Whether it is one texture, an array or a cube map.
    pub(crate) dimension: wgpu::TextureViewDimension,
    /// Whether it is multisampled.
    pub(crate) multisampled: bool,
}

/// The layout of a process's `@group(2)`: its parameters if it has some, then the targets that it samples, then its
/// buffers, each with whether its shader writes it.
pub(crate) fn process_layout_entries(
    parameter_bytes: usize,
    samples: &[SampledTarget],
    writes_buffers: &[bool],
    is_compute: bool,
) -> Vec<wgpu::BindGroupLayoutEntry> {
    let [stages, fragment] = stages(is_compute);
    let mut entries = Vec::new();
    if parameter_bytes > 0 {
        // With the size, wgpu refuses a shader that reads more when its pipeline is created.
        entries.push(entry(0, stages, uniform(parameter_bytes as u64)));
    }
    for (binding, sampled) in (1..).zip(samples) {
        let sample_type = if sampled.format.has_depth() {
            wgpu::TextureSampleType::Depth
        } else if sampled.format.is_integer() {
            wgpu::TextureSampleType::Uint
        } else {
            wgpu::TextureSampleType::Float { filterable: sampled.format.is_filterable() && !sampled.multisampled }
        };
        let SampledTarget { dimension: view_dimension, multisampled, .. } = *sampled;
        let texture = wgpu::BindingType::Texture { sample_type, view_dimension, multisampled };
        entries.push(entry(binding, fragment, texture));
    }
    for (binding, writes) in (1 + samples.len() as u32..).zip(writes_buffers) {
        // Not every device lets vertex shaders write.
        entries.push(entry(binding, if *writes { fragment } else { stages }, storage(*writes)));
    }
    entries
}

/// The layout of a process's `@group(3)`: arrays for the columns of objects and the materials that it reads, then the
/// resources of the engine's own.
pub(crate) fn engine_layout_entries(
    arrays: usize,
    resources: &[wgpu::BindingType],
    is_compute: bool,
) -> Vec<wgpu::BindGroupLayoutEntry> {
    let [stages, _] = stages(is_compute);
    let types = std::iter::repeat_n(storage(false), arrays).chain(resources.iter().copied());
    (0..).zip(types).map(|(binding, ty)| entry(binding, stages, ty)).collect()
}

/// The stages of a process's shaders, and those that sample targets and write buffers.
fn stages(is_compute: bool) -> [ShaderStages; 2] {
    if is_compute { [ShaderStages::COMPUTE; 2] } else { [ShaderStages::VERTEX_FRAGMENT, ShaderStages::FRAGMENT] }
}

/// What the layout of a bind group says about a resource.
pub(crate) fn binding_type(device_features: wgpu::Features, resource: &ShaderResource<'_>) -> wgpu::BindingType {
    match resource {
        ShaderResource::Bytes(_) | ShaderResource::SharedBytes(_) | ShaderResource::Buffer(_) => storage(false),
        ShaderResource::Texture { view, dimension } | ShaderResource::TextureOfView { other: view, dimension, .. } => {
            let texture = view.texture();
            // A depth-stencil texture is sampled as depth.
            let depth = wgpu::TextureSampleType::Depth;
            let multisampled = texture.sample_count() > 1;
            let sample_type = match texture.format().sample_type(None, Some(device_features)).unwrap_or(depth) {
                // Samplers do not take multisampled textures.
                wgpu::TextureSampleType::Float { filterable } => {
                    wgpu::TextureSampleType::Float { filterable: filterable && !multisampled }
                }
                other => other,
            };
            wgpu::BindingType::Texture { sample_type, view_dimension: *dimension, multisampled }
        }
        ShaderResource::Sampler { kind, .. } => wgpu::BindingType::Sampler(*kind),
    }
}

/// A target's format as a wgpu format.
pub(crate) fn texture_format(format: Format) -> wgpu::TextureFormat {
    match format {
        Format::R8Unorm => wgpu::TextureFormat::R8Unorm,
        Format::Rg8Unorm => wgpu::TextureFormat::Rg8Unorm,
        Format::Rgba8Unorm => wgpu::TextureFormat::Rgba8Unorm,
        Format::Rgba8Srgb => wgpu::TextureFormat::Rgba8UnormSrgb,
        Format::Bgra8Unorm => wgpu::TextureFormat::Bgra8Unorm,
        Format::Bgra8Srgb => wgpu::TextureFormat::Bgra8UnormSrgb,
        Format::Rgb10a2Unorm => wgpu::TextureFormat::Rgb10a2Unorm,
        Format::Rgba16Float => wgpu::TextureFormat::Rgba16Float,
        Format::Rg16Float => wgpu::TextureFormat::Rg16Float,
        Format::R16Float => wgpu::TextureFormat::R16Float,
        Format::Rgba32Float | Format::Rgba32FloatBlendable => wgpu::TextureFormat::Rgba32Float,
        Format::R32Float => wgpu::TextureFormat::R32Float,
        Format::R32Uint => wgpu::TextureFormat::R32Uint,
        Format::Depth32Float => wgpu::TextureFormat::Depth32Float,
        Format::Depth32FloatStencil8 => wgpu::TextureFormat::Depth32FloatStencil8,
        Format::Stencil8 => wgpu::TextureFormat::Stencil8,
    }
}

fn entry(binding: u32, visibility: ShaderStages, ty: wgpu::BindingType) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

fn uniform(size: u64) -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: std::num::NonZeroU64::new(size),
    }
}

fn storage(writes: bool) -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Storage { read_only: !writes },
        has_dynamic_offset: false,
        min_binding_size: None,
    }
}

/// A bind group, and what it was made from. It is made anew only if that changes.
pub(crate) struct CachedBindGroup {
    pub(crate) group: wgpu::BindGroup,
    layout: wgpu::BindGroupLayout,
    bound: Vec<(u32, BoundResource)>,
}

/// What a bind group binds. Handles compare by identity, and keep what they refer to alive.
enum BoundResource {
    Buffer { buffer: wgpu::Buffer, offset: u64, size: Option<NonZeroU64> },
    Texture(wgpu::TextureView),
    Sampler(wgpu::Sampler),
}

/// What is to be bound.
#[derive(Clone)]
pub(crate) enum BindingResource<'a> {
    Buffer(wgpu::BufferBinding<'a>),
    Texture(&'a wgpu::TextureView),
    Sampler(&'a wgpu::Sampler),
}

impl CachedBindGroup {
    /// The bind group of these resources, each with the number of its binding: `before` if layout and resources are the
    /// same. `None` without a layout. The label is of errors.
    ///
    /// # Errors
    /// If the device refuses a resource.
    pub(crate) fn update<'a>(
        before: Option<Self>,
        device: &wgpu::Device,
        label: &str,
        layout: Option<&wgpu::BindGroupLayout>,
        resources: impl Iterator<Item = (u32, BindingResource<'a>)> + Clone,
    ) -> Result<Option<Self>, BackendError> {
        let Some(layout) = layout else { return Ok(None) };
        let is_same = |before: &Self| {
            let same_binding = |((number, bound), (other, resource)): (&(u32, BoundResource), (u32, _))| {
                *number == other && bound.is(&resource)
            };
            let mut bound = before.bound.iter();
            let is_bound = |resource| bound.next().is_some_and(|bound| same_binding((bound, resource)));
            before.layout == *layout && resources.clone().all(is_bound) && bound.next().is_none()
        };
        if let Some(before) = before.filter(is_same) {
            return Ok(Some(before));
        }
        let entry = |(binding, resource): (u32, BindingResource<'a>)| {
            let resource = match resource {
                BindingResource::Buffer(buffer) => wgpu::BindingResource::Buffer(buffer),
                BindingResource::Texture(texture) => wgpu::BindingResource::TextureView(texture),
                BindingResource::Sampler(sampler) => wgpu::BindingResource::Sampler(sampler),
            };
            wgpu::BindGroupEntry { binding, resource }
        };
        let entries: Vec<_> = resources.clone().map(entry).collect();
        let descriptor = wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries };
        // wgpu panics over resources of another instance.
        let create = || catch_wgpu_panic(label, || device.create_bind_group(&descriptor));
        let group = with_error_scope(device, label, create).flatten()?;
        let bound = resources.map(|(binding, resource)| (binding, BoundResource::of(resource))).collect();
        Ok(Some(Self { group, layout: layout.clone(), bound }))
    }
}

impl BoundResource {
    fn of(resource: BindingResource<'_>) -> Self {
        match resource {
            BindingResource::Buffer(wgpu::BufferBinding { buffer, offset, size }) => {
                Self::Buffer { buffer: buffer.clone(), offset, size }
            }
            BindingResource::Texture(texture) => Self::Texture(texture.clone()),
            BindingResource::Sampler(sampler) => Self::Sampler(sampler.clone()),
        }
    }

    fn is(&self, resource: &BindingResource<'_>) -> bool {
        match (self, resource) {
            (Self::Buffer { buffer, offset, size }, BindingResource::Buffer(binding)) => {
                (buffer, *offset, *size) == (binding.buffer, binding.offset, binding.size)
            }
            (Self::Texture(bound), BindingResource::Texture(texture)) => bound == *texture,
            (Self::Sampler(bound), BindingResource::Sampler(sampler)) => bound == *sampler,
            _ => false,
        }
    }
}
