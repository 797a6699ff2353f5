//! The bind group of a pass's parameters and sampled targets, kept from frame to frame.

use std::num::NonZeroU64;
use std::sync::Arc;

use super::process_pipelines::ProcessPipelines;

/// A pass's bind group at `@group(2)`: its parameters and the targets that it samples.
pub(crate) struct ProcessBindGroup {
    pub(crate) group: wgpu::BindGroup,
    pipelines: Arc<ProcessPipelines>,
    /// The buffer, offset and size.
    parameters: Option<(wgpu::Buffer, u64, Option<NonZeroU64>)>,
    sampled: Vec<wgpu::TextureView>,
}

impl ProcessBindGroup {
    /// The bind group of a pass: `before` if its bindings are the same. `None` for a process without one.
    pub(crate) fn update<'a>(
        before: Option<Self>,
        device: &wgpu::Device,
        pipelines: &Arc<ProcessPipelines>,
        parameters: Option<wgpu::BufferBinding<'a>>,
        sampled: impl Iterator<Item = &'a wgpu::TextureView> + Clone,
    ) -> Option<Self> {
        let is_same = |before: &Self| {
            let bound = before.parameters.as_ref().map(|(buffer, offset, size)| (buffer, *offset, *size));
            Arc::ptr_eq(&before.pipelines, pipelines)
                && bound == parameters.as_ref().map(|binding| (binding.buffer, binding.offset, binding.size))
                && before.sampled.iter().eq(sampled.clone())
        };
        if let Some(before) = before.filter(is_same) {
            return Some(before);
        }
        let owned = parameters.as_ref().map(|binding| (binding.buffer.clone(), binding.offset, binding.size));
        let group = pipelines.create_bind_group(device, parameters, sampled.clone())?;
        Some(Self { group, pipelines: Arc::clone(pipelines), parameters: owned, sampled: sampled.cloned().collect() })
    }
}
