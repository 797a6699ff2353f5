//! The buffers that processes share.

use std::sync::Arc;

use super::arena::new_buffer;
use super::growing_buffer::check_storage_binding_size;
use crate::backend::BackendError;
use crate::process::{BufferLayout, FramePlan};

/// The buffers that processes share. Buffers of other plans stay, because frames with those plans may follow.
#[derive(Default)]
pub(crate) struct StorageBuffers {
    buffers: Vec<(BufferLayout, wgpu::Buffer)>,
}

impl StorageBuffers {
    /// Adds what a plan's processes use and is missing, of zeros. A buffer of the same name and another size is replaced.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn update(
        self: &mut Arc<Self>,
        device: &wgpu::Device,
        plan: &FramePlan,
    ) -> Result<Arc<Self>, BackendError> {
        let is_known = |layout: &BufferLayout| self.buffers.iter().any(|(known, _)| known == layout);
        if !plan.buffers().iter().all(is_known) {
            let mut next = self.buffers.clone();
            for layout in plan.buffers().iter().filter(|layout| !is_known(layout)) {
                next.retain(|(known, _)| known.name != layout.name);
                check_storage_binding_size(device, usize::try_from(layout.bytes).unwrap_or(usize::MAX))?;
                let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT;
                next.push((*layout, new_buffer(device, layout.name, layout.bytes, usage)?));
            }
            *self = Arc::new(Self { buffers: next });
        }
        Ok(Arc::clone(self))
    }

    /// A buffer of the plan.
    pub(crate) fn find(&self, layout: BufferLayout) -> Option<&wgpu::Buffer> {
        self.buffers.iter().find(|(known, _)| *known == layout).map(|(_, buffer)| buffer)
    }

    /// Their size in bytes.
    pub(crate) fn size(&self) -> u64 {
        self.buffers.iter().map(|(layout, _)| layout.bytes).sum()
    }
}
