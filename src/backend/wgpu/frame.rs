//! A frame on its way through the wgpu backend.

use std::sync::Arc;

use super::assets::AssetSnapshot;
use super::frame_buffers::FrameBuffers;
use super::frame_pass::FramePass;
use super::light_meshes::LightMeshes;
use super::pipelines::ProcessPipelines;
use super::targets::FrameTargets;
use crate::process::Pass;

/// A frame on its way through the wgpu backend.
pub struct WgpuFrame {
    /// Counted from the backend's first.
    pub(super) number: u64,
    /// One for each process.
    pub(super) pipelines: Arc<[Arc<ProcessPipelines>]>,
    pub(super) assets: Arc<AssetSnapshot>,
    pub(super) light_meshes: Option<Arc<LightMeshes>>,
    pub(super) targets: Arc<FrameTargets>,
    pub(super) background: [f64; 3],
    /// Given back to the pool when the frame is dropped.
    pub(super) buffers: FrameBuffers,
}

impl WgpuFrame {
    /// The index of a pass among the frame's.
    pub(super) fn index(&self, pass: Pass) -> usize {
        // Passes are in the order of their process, then their view, which is the order of `Pass`.
        self.buffers.passes().partition_point(|other| other.pass < pass)
    }

    pub(super) fn pass(&self, index: usize) -> &FramePass {
        &self.buffers.passes()[index]
    }

    /// Those of a pass's process.
    pub(super) fn pipelines(&self, pass: Pass) -> &Arc<ProcessPipelines> {
        &self.pipelines[pass.process]
    }
}

/// A part of a pass, recorded before the pass is finished.
pub struct WgpuPart(pub(super) Part);

/// What parts there are.
pub(super) enum Part {
    Bundle(wgpu::RenderBundle),
    /// One of several encoders.
    Encoder(wgpu::CommandBuffer),
}

/// A recorded pass.
pub struct WgpuCommands(pub(super) Commands);

/// How far a pass has come.
pub(super) enum Commands {
    Finished(wgpu::CommandBuffer),
    /// By several encoders, in the order they are submitted.
    Parts(Vec<WgpuPart>),
    /// Left for the device thread to finish.
    Open(wgpu::CommandEncoder),
}
