//! A frame in flight through the wgpu backend.

use std::sync::Arc;

use super::frame_buffers::FrameBuffers;
use super::generated_uploads::GeneratedUploads;
use super::pass_state::WgpuPassState;
use super::pending_uploads::PendingUploads;
use crate::backend::BackendError;
use crate::backend::error::broken_rule;
use crate::backend::mip_schedule::MipSchedule;
use crate::backend::wgpu::pipelines::ProcessPipelines;
use crate::backend::wgpu::read_back::{ReadBackCopy, WgpuReadBack, new_read_back};
use crate::backend::wgpu::resources::{
    BindGroupLayouts, LightMeshes, MeshSnapshot, SnapshotToken, StorageBuffers, WgpuTargets,
};
use crate::backend::wgpu::streaming::FrameUse;
use crate::process::Pass;

/// A frame in flight through the wgpu backend.
pub struct WgpuFrame {
    /// Counted from the backend's first frame.
    pub(crate) number: u64,
    /// [`FrameRequest::workers`](crate::backend::FrameRequest::workers).
    pub(crate) workers: usize,
    /// One for each render process.
    pub(crate) pipelines: Arc<[Arc<ProcessPipelines>]>,
    pub(crate) layouts: BindGroupLayouts,
    pub(crate) meshes: Arc<MeshSnapshot>,
    /// Keeps its textures from being overwritten.
    pub(crate) _textures: Arc<SnapshotToken>,
    /// Where it marks what it draws.
    pub(crate) frame_use: FrameUse,
    pub(crate) light_meshes: Option<Arc<LightMeshes>>,
    pub(crate) targets: Arc<WgpuTargets>,
    pub(crate) storage_buffers: Arc<StorageBuffers>,
    pub(crate) generated: GeneratedUploads,
    /// After which passes mip levels are generated.
    pub(crate) mip_schedule: MipSchedule,
    pub(crate) background: [f64; 3],
    /// What is read back of it.
    pub(crate) read_backs: Vec<ReadBackCopy>,
    /// Returned to the pool when the frame is dropped.
    pub(crate) buffers: FrameBuffers,
    pub(crate) pending_uploads: PendingUploads,
}

impl WgpuFrame {
    /// Has a rectangle of a view's target read back when the frame is submitted: its upper left pixel, and its width
    /// and height.
    ///
    /// # Errors
    /// See [`new_read_back`].
    pub(crate) fn read_back(
        &mut self,
        view: usize,
        target: &str,
        rectangle: [[u32; 2]; 2],
    ) -> Result<WgpuReadBack, BackendError> {
        let device = self.pending_uploads.device();
        let (read_back, copy) = new_read_back(device, &self.targets, view, target, rectangle)?;
        self.read_backs.push(copy);
        Ok(read_back)
    }

    /// Has a view's target read back as a whole.
    ///
    /// # Errors
    /// See [`new_read_back`].
    pub(crate) fn read_back_whole(&mut self, view: usize, target: &str) -> Result<WgpuReadBack, BackendError> {
        let whole =
            self.targets.find(view, target).map_or([0; 2], |found| [found.texture.width(), found.texture.height()]);
        self.read_back(view, target, [[0, 0], whole])
    }

    /// Whether mip levels are generated after a pass, by index in the frame.
    pub(crate) fn generates_mip_levels(&self, pass: usize) -> bool {
        !self.mip_schedule.after(pass).is_empty()
    }

    /// Generates the mip levels that a pass, by index in the frame, leaves out of date.
    ///
    /// # Errors
    /// If a target is missing, or what generates its mip levels. This is a bug in Drawloom.
    pub(crate) fn generate_mip_levels(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pass: usize,
    ) -> Result<(), BackendError> {
        for &(view, target) in self.mip_schedule.after(pass) {
            let levels = self.targets.of_view(view, target)?.mip_levels();
            levels.ok_or_else(|| broken_rule("a target has what generates its mip levels"))?.generate(encoder);
        }
        Ok(())
    }

    /// The state of a pass, by index in the frame.
    pub(crate) fn pass(&self, index: usize) -> &WgpuPassState {
        &self.buffers.passes()[index]
    }

    /// The pipelines of a pass's process.
    pub(crate) fn pipelines(&self, pass: Pass) -> &Arc<ProcessPipelines> {
        &self.pipelines[pass.process_index]
    }
}
