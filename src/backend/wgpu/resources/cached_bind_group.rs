//! Bind groups that are kept from frame to frame.

use std::num::NonZeroU64;

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
}

/// What is to be bound.
#[derive(Clone)]
pub(crate) enum BindingResource<'a> {
    Buffer(wgpu::BufferBinding<'a>),
    Texture(&'a wgpu::TextureView),
}

impl CachedBindGroup {
    /// The bind group of these resources, each with the number of its binding: `before` if layout and resources are the same. `None`
    /// without a layout.
    pub(crate) fn update<'a>(
        before: Option<Self>,
        device: &wgpu::Device,
        label: &str,
        layout: Option<&wgpu::BindGroupLayout>,
        resources: impl Iterator<Item = (u32, BindingResource<'a>)> + Clone,
    ) -> Option<Self> {
        let layout = layout?;
        let is_same = |before: &Self| {
            let same_binding = |((number, bound), (other, resource)): (&(u32, BoundResource), (u32, _))| {
                *number == other && bound.is(&resource)
            };
            before.layout == *layout
                && before.bound.len() == resources.clone().count()
                && before.bound.iter().zip(resources.clone()).all(same_binding)
        };
        if let Some(before) = before.filter(is_same) {
            return Some(before);
        }
        let entry = |(binding, resource): (u32, BindingResource<'a>)| {
            let resource = match resource {
                BindingResource::Buffer(buffer) => wgpu::BindingResource::Buffer(buffer),
                BindingResource::Texture(texture) => wgpu::BindingResource::TextureView(texture),
            };
            wgpu::BindGroupEntry { binding, resource }
        };
        let entries: Vec<_> = resources.clone().map(entry).collect();
        let descriptor = wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries };
        let group = device.create_bind_group(&descriptor);
        let bound = resources.map(|(binding, resource)| (binding, BoundResource::of(resource))).collect();
        Some(Self { group, layout: layout.clone(), bound })
    }
}

impl BoundResource {
    fn of(resource: BindingResource<'_>) -> Self {
        match resource {
            BindingResource::Buffer(wgpu::BufferBinding { buffer, offset, size }) => {
                Self::Buffer { buffer: buffer.clone(), offset, size }
            }
            BindingResource::Texture(texture) => Self::Texture(texture.clone()),
        }
    }

    fn is(&self, resource: &BindingResource<'_>) -> bool {
        match (self, resource) {
            (Self::Buffer { buffer, offset, size }, BindingResource::Buffer(binding)) => {
                (buffer, *offset, *size) == (binding.buffer, binding.offset, binding.size)
            }
            (Self::Texture(bound), BindingResource::Texture(texture)) => bound == *texture,
            _ => false,
        }
    }
}
