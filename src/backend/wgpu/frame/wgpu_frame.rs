//! A frame in flight through the wgpu backend.

use std::sync::Arc;

use super::frame_buffers::FrameBuffers;
use super::pass_state::WgpuPassState;
use crate::backend::wgpu::pipelines::ProcessPipelines;
use crate::backend::wgpu::resources::{AssetSnapshot, LightMeshes, WgpuTargets};
use crate::process::Pass;

/// A frame in flight through the wgpu backend.
pub struct WgpuFrame {
    /// Counted from the backend's first frame.
    pub(crate) number: u64,
    /// One for each render process.
    pub(crate) pipelines: Arc<[Arc<ProcessPipelines>]>,
    pub(crate) assets: Arc<AssetSnapshot>,
    pub(crate) light_meshes: Option<Arc<LightMeshes>>,
    pub(crate) targets: Arc<WgpuTargets>,
    pub(crate) background: [f64; 3],
    /// Returned to the pool when the frame is dropped.
    pub(crate) buffers: FrameBuffers,
}

impl WgpuFrame {
    /// The state of a pass, by index in the frame.
    pub(crate) fn pass(&self, index: usize) -> &WgpuPassState {
        &self.buffers.passes()[index]
    }

    /// The pipelines of a pass's process.
    pub(crate) fn pipelines(&self, pass: Pass) -> &Arc<ProcessPipelines> {
        &self.pipelines[pass.process_index]
    }
}
