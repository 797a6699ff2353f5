//! What a frame finds on the device, and changes there.

use std::sync::Arc;

use super::budget::StreamingBudget;
use super::upload_jobs::Upload;
use crate::backend::wgpu::resources::{CountedQueue, LastReader, MaterialCache, MeshCache};
use crate::backend::{BackendError, FrameRequest};

/// The device, and what is on it.
pub(crate) struct Residency<'a> {
    pub(crate) device: &'a wgpu::Device,
    pub(crate) uploads: &'a CountedQueue,
    pub(crate) meshes: &'a mut MeshCache,
    pub(crate) materials: &'a mut MaterialCache,
}

/// An upload whose memory is still read by a frame in flight.
pub(super) struct HeldUpload {
    pub(super) upload: Upload,
    /// It may begin when that is gone.
    pub(super) last_reader: LastReader,
}

/// Which pages and arrays there are: others after the caches were cleared.
#[derive(Default)]
pub(super) struct Epochs {
    meshes: Arc<()>,
    textures: Arc<()>,
}

impl Residency<'_> {
    /// Drops what is gone.
    ///
    /// # Errors
    /// If the device has no room for what was replaced.
    pub(super) fn begin_frame(
        &mut self,
        request: &FrameRequest<'_>,
        budget: &StreamingBudget,
    ) -> Result<(), BackendError> {
        let (assets, used, vertices) = (request.scene.assets, request.objects.used_meshes(), request.quality.vertices);
        let budget = (budget.mesh_bytes, budget.upload_bytes_per_frame);
        self.meshes.begin_streamed_frame(self.device, self.uploads, (assets, used), vertices, budget)?;
        self.materials.textures.begin_streamed_frame(assets);
        Ok(())
    }

    /// Whether an upload is to the pages and arrays that there are.
    pub(super) fn is_current(&self, upload: &Upload) -> bool {
        match upload {
            Upload::Mesh(mesh) => self.meshes.is_current(&mesh.epoch),
            Upload::Texture(texture) => self.materials.textures.is_current(&texture.epoch),
        }
    }

    /// Whether the memory of an upload may be written.
    pub(super) fn may_begin(&self, held: &HeldUpload) -> bool {
        match held.upload {
            Upload::Mesh(_) => self.meshes.is_gone(held.last_reader),
            Upload::Texture(_) => self.materials.textures.is_gone(held.last_reader),
        }
    }

    /// Brings the epochs up to date. Returns whether one is another.
    pub(super) fn update_epochs(&self, epochs: &mut Epochs) -> bool {
        let (meshes, textures) = (self.meshes.epoch(), self.materials.textures.epoch());
        let is_same = Arc::ptr_eq(&epochs.meshes, meshes) && Arc::ptr_eq(&epochs.textures, textures);
        *epochs = Epochs { meshes: Arc::clone(meshes), textures: Arc::clone(textures) };
        !is_same
    }
}
