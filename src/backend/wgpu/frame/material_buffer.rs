//! The materials of a frame in flight, and `@group(1)`.

use std::sync::Arc;

use crate::backend::BackendError;
use crate::backend::wgpu::resources::{
    BindGroupLayouts, BindingResource, CachedBindGroup, MaterialSnapshot, MirroredBuffer, UploadQueue,
    check_storage_binding_size,
};

/// The materials of a frame in flight. Of materials that change, only what changed is uploaded, and the bind group stays the same.
pub(crate) struct MaterialBuffer {
    buffer: MirroredBuffer,
    /// What the buffer holds.
    held: Option<Arc<[u8]>>,
    bind_group: Option<CachedBindGroup>,
}

impl MaterialBuffer {
    pub(crate) fn new() -> Self {
        let buffer = MirroredBuffer::new("materials", wgpu::BufferUsages::STORAGE);
        Self { buffer, held: None, bind_group: None }
    }

    /// Uploads materials, and binds them and their textures.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn update(
        &mut self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        layouts: &BindGroupLayouts,
        MaterialSnapshot { materials, textures, .. }: &MaterialSnapshot,
    ) -> Result<(), BackendError> {
        let is_held = self.held.as_ref().is_some_and(|held| Arc::ptr_eq(held, materials));
        if !is_held {
            check_storage_binding_size(device, materials.len())?;
            self.held = None;
            self.buffer.set(device, uploads, materials)?;
            self.held = Some(Arc::clone(materials));
        }
        let materials = self.buffer.on_device.binding(0, materials.len()).map(BindingResource::Buffer);
        let arrays = textures.arrays.iter().map(BindingResource::Texture);
        let samplers = textures.samplers.iter().map(BindingResource::Sampler);
        let bound = (0..).zip(materials.into_iter().chain(arrays).chain(samplers));
        let before = self.bind_group.take();
        self.bind_group = CachedBindGroup::update(before, device, "materials", Some(&layouts.assets), bound)?;
        Ok(())
    }

    /// `@group(1)`; `None` before the first update.
    pub(crate) fn bind_group(&self) -> Option<&wgpu::BindGroup> {
        self.bind_group.as_ref().map(|cached| &cached.group)
    }

    /// Its size in bytes.
    pub(crate) fn size(&self) -> u64 {
        self.buffer.on_device.size()
    }
}
