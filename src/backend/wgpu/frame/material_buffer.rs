//! The materials of a frame in flight, and `@group(1)`.

use std::sync::Arc;

use crate::backend::BackendError;
use crate::backend::wgpu::resources::{
    BindGroupLayouts, BindingResource, CachedBindGroup, CountedQueue, MaterialSnapshot, MaterialTextures,
    MirroredBuffer, check_storage_binding_size,
};

/// The materials of a frame in flight. Of materials that change, only what changed is uploaded, and the bind group
/// stays the same.
pub(crate) struct MaterialBuffer {
    buffer: MirroredBuffer,
    /// What the buffer holds and the bind group binds; `None` before the first update, or after one that failed.
    current: Option<(Arc<[u8]>, Arc<MaterialTextures>)>,
    bind_group: Option<CachedBindGroup>,
}

impl MaterialBuffer {
    pub(crate) fn new() -> Self {
        let buffer = MirroredBuffer::new("materials", wgpu::BufferUsages::STORAGE);
        Self { buffer, current: None, bind_group: None }
    }

    /// Uploads materials, and binds them and their textures.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn update(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        layouts: &BindGroupLayouts,
        MaterialSnapshot { materials, textures, .. }: &MaterialSnapshot,
    ) -> Result<(), BackendError> {
        let is_current = |(bytes, bound): &(Arc<[u8]>, Arc<MaterialTextures>)| {
            Arc::ptr_eq(bytes, materials) && Arc::ptr_eq(bound, textures)
        };
        if self.current.as_ref().is_some_and(is_current) {
            return Ok(());
        }
        self.current = None;
        check_storage_binding_size(device, materials.len())?;
        self.buffer.set(device, uploads, materials)?;
        let buffer = self.buffer.on_device.binding(0, materials.len()).map(BindingResource::Buffer);
        let arrays = textures.arrays.iter().map(BindingResource::Texture);
        let samplers = textures.samplers.iter().map(BindingResource::Sampler);
        let bound = (0..).zip(buffer.into_iter().chain(arrays).chain(samplers));
        let before = self.bind_group.take();
        self.bind_group = CachedBindGroup::update(before, device, "materials", Some(&layouts.assets), bound)?;
        self.current = Some((Arc::clone(materials), Arc::clone(textures)));
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
