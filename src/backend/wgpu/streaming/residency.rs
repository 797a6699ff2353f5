//! What a frame finds on the device, changes there, and draws with.

use std::sync::Arc;

use super::budget::StreamingBudget;
use super::frame_use::FrameUse;
use super::upload_jobs::Upload;
use crate::backend::wgpu::resources::{
    CountedQueue, LastReader, MaterialCache, MaterialSnapshot, MeshBudget, MeshCache, MeshSnapshot,
};
use crate::backend::{BackendError, FrameRequest};

/// The device, and what is on it.
pub(crate) struct Residency<'a> {
    pub(crate) device: &'a wgpu::Device,
    pub(crate) uploads: &'a CountedQueue,
    pub(crate) meshes: &'a mut MeshCache,
    pub(crate) materials: &'a mut MaterialCache,
}

/// What a frame draws with.
pub(crate) struct FrameAssets {
    pub(crate) meshes: Arc<MeshSnapshot>,
    pub(crate) materials: MaterialSnapshot,
    pub(crate) frame_use: FrameUse,
}

/// An upload whose memory is still read by a frame in flight.
pub(super) struct HeldUpload {
    pub(super) upload: Upload,
    /// It may begin when that is gone.
    pub(super) last_reader: LastReader,
}

impl Residency<'_> {
    /// Drops what is gone. Without a budget, uploads all that is missing; with one, only what replaces others.
    ///
    /// # Errors
    /// If the device has no room for what is uploaded.
    pub(crate) fn begin_frame(
        &mut self,
        request: &FrameRequest<'_>,
        budget: Option<&StreamingBudget>,
    ) -> Result<(), BackendError> {
        let (assets, used, vertices) = (request.scene.assets, request.objects.used_meshes(), request.quality.vertices);
        let of_meshes =
            budget.map(|budget| MeshBudget { pages: budget.mesh_bytes, at_once: budget.upload_bytes_per_frame });
        self.meshes.begin_frame(self.device, self.uploads, (assets, used), vertices, of_meshes)?;
        let sets = request.objects.texture_sets();
        self.materials.begin_frame(self.device, self.uploads, (assets, sets), budget.is_some())
    }

    /// The snapshots of what is on the device. The caches have forgotten the ones before then.
    pub(crate) fn snapshots(
        &mut self,
        request: &FrameRequest<'_>,
        is_streamed: bool,
    ) -> (Arc<MeshSnapshot>, MaterialSnapshot) {
        let FrameRequest { plan, scene, limits, scene_issues, objects, .. } = *request;
        let (types, assets) = (plan.material_types(), (scene.assets, objects.texture_sets()));
        let materials = self.materials.snapshot(self.device, assets, types, (limits, scene_issues));
        (self.meshes.snapshot(is_streamed), materials)
    }

    /// Whether an upload is to the pages and arrays that there are.
    pub(super) fn is_current(&self, upload: &Upload) -> bool {
        match upload {
            Upload::Mesh(mesh) => self.meshes.residents.is_current(&mesh.in_flight),
            Upload::Texture(texture) => self.materials.textures.is_current(&texture.in_flight),
        }
    }

    /// Whether the memory of an upload may be written.
    pub(super) fn may_begin(&self, held: &HeldUpload) -> bool {
        match held.upload {
            Upload::Mesh(_) => self.meshes.residents.is_gone(held.last_reader),
            Upload::Texture(_) => self.materials.textures.is_gone(held.last_reader),
        }
    }
}
