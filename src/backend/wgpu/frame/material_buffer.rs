//! The materials of a frame in flight, and `@group(1)`.

use std::sync::Arc;

use crate::backend::BackendError;
use crate::backend::wgpu::resources::{
    BindGroupLayouts, BindingResource, CachedBindGroup, CountedQueue, MaterialSnapshot, MaterialTextures,
    MirroredBuffer, check_storage_binding_size,
};

/// The materials of a frame in flight. Of materials that change, only what changed is uploaded, and the bind groups
/// stay the same.
pub(crate) struct MaterialBuffer {
    buffer: MirroredBuffer,
    /// What the buffer holds and the bind groups bind; `None` before the first update, or after one that failed.
    current: Option<(Arc<[u8]>, Arc<MaterialTextures>)>,
    /// Of each set of textures.
    cached: Vec<CachedBindGroup>,
    bind_groups: Arc<[wgpu::BindGroup]>,
}

impl MaterialBuffer {
    pub(crate) fn new() -> Self {
        let buffer = MirroredBuffer::new("materials", wgpu::BufferUsages::STORAGE);
        Self { buffer, current: None, cached: Vec::new(), bind_groups: Arc::default() }
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
        let mut before = std::mem::take(&mut self.cached).into_iter();
        for set in &textures.sets {
            let buffer = self.buffer.on_device.binding(0, materials.len()).map(BindingResource::Buffer);
            let arrays = set.arrays.iter().map(BindingResource::Texture);
            let samplers = set.samplers.iter().chain([&textures.target_sampler]).map(BindingResource::Sampler);
            let bound = (0..).zip(buffer.into_iter().chain(arrays).chain(samplers));
            let layout = Some(&layouts.assets);
            self.cached.extend(CachedBindGroup::update(before.next(), device, "materials", layout, bound)?);
        }
        let groups = self.cached.iter().map(|cached| &cached.group);
        if !groups.clone().eq(self.bind_groups.iter()) {
            self.bind_groups = groups.cloned().collect();
        }
        self.current = Some((Arc::clone(materials), Arc::clone(textures)));
        Ok(())
    }

    /// `@group(1)`, for each set of textures; none before the first update.
    pub(crate) fn bind_groups(&self) -> &Arc<[wgpu::BindGroup]> {
        &self.bind_groups
    }

    /// Its size in bytes.
    pub(crate) fn size(&self) -> u64 {
        self.buffer.on_device.size()
    }
}
