//! The buffers that processes share.

use super::buffers::{check_storage_binding_size, new_buffer};
use crate::backend::BackendError;
use crate::backend::wgpu::error_scope::with_error_scope;
use crate::process::{BufferLayout, FramePlan};

/// The buffers that processes share. Buffers of other plans stay, because frames with those plans may follow.
#[derive(Default)]
pub(crate) struct StorageBuffers {
    buffers: Vec<(BufferLayout, wgpu::Buffer)>,
}

impl StorageBuffers {
    /// Whether these are all that a plan's processes use.
    pub(crate) fn covers(&self, plan: &FramePlan) -> bool {
        plan.buffers().iter().all(|layout| self.find(*layout).is_some())
    }

    /// These buffers, and those that a plan's processes use and that are missing, of zeros. A buffer of the same name
    /// and another size is replaced.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn with_missing_buffers_of(
        &self,
        device: &wgpu::Device,
        plan: &FramePlan,
    ) -> Result<Self, BackendError> {
        let mut buffers = self.buffers.clone();
        for layout in plan.buffers().iter().filter(|layout| self.find(**layout).is_none()) {
            buffers.retain(|(known, _)| known.name != layout.name);
            check_storage_binding_size(device, usize::try_from(layout.bytes).unwrap_or(usize::MAX))?;
            let usage = wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::INDIRECT
                | wgpu::BufferUsages::COPY_SRC
                | wgpu::BufferUsages::COPY_DST;
            buffers.push((*layout, new_buffer(device, layout.name, layout.bytes, usage)?));
        }
        Ok(Self { buffers })
    }

    /// These buffers but for those that were destroyed. wgpu tells that only when a buffer is used.
    pub(crate) fn without_destroyed(&self, device: &wgpu::Device) -> Self {
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Storage { read_only: true },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let bind = |buffer: &wgpu::Buffer| {
            let entries = &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }];
            device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &layout, entries })
        };
        let exists = |buffer: &wgpu::Buffer| with_error_scope(device, "a shared buffer", || bind(buffer)).is_ok();
        Self { buffers: self.buffers.iter().filter(|(_, buffer)| exists(buffer)).cloned().collect() }
    }

    /// A buffer of the plan.
    pub(crate) fn find(&self, layout: BufferLayout) -> Option<&wgpu::Buffer> {
        self.buffers.iter().find(|(known, _)| *known == layout).map(|(_, buffer)| buffer)
    }

    /// Their sizes in bytes.
    pub(crate) fn sizes(&self) -> impl Iterator<Item = u64> {
        self.buffers.iter().map(|(layout, _)| layout.bytes)
    }
}
