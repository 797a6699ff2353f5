//! Bind groups that are kept from frame to frame.

use std::num::NonZeroU64;

use crate::backend::BackendError;
use crate::backend::wgpu::error_scope::{catch_wgpu_panic, with_error_scope};

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
