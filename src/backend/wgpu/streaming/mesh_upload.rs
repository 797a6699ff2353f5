//! The upload of a mesh, in portions.

use super::upload_budget::UploadBudget;
use crate::backend::BackendError;
use crate::backend::wgpu::resources::{CountedQueue, InFlight, MeshTarget};
use crate::quality::VertexFormat;
use crate::scene::{Mesh, PackedVertex};

/// A mesh on its way to the device.
pub(crate) struct MeshUpload {
    pub(crate) in_flight: InFlight<Mesh>,
    pub(crate) mesh: Mesh,
    pub(crate) target: MeshTarget,
    packed: Vec<PackedVertex>,
    /// Bytes.
    written: u64,
}

impl MeshUpload {
    pub(crate) fn new(in_flight: InFlight<Mesh>, mesh: Mesh, target: MeshTarget) -> Self {
        Self { in_flight, mesh, target, packed: Vec::new(), written: 0 }
    }

    /// All that it uploads.
    pub(super) fn bytes(&self) -> u64 {
        self.target.bytes()
    }

    /// Uploads as much as is allowed. Returns whether all of it is uploaded.
    ///
    /// # Errors
    /// If the device has no room.
    pub(super) fn advance(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        upload_budget: &mut UploadBudget,
    ) -> Result<bool, BackendError> {
        self.target.create_buffers(device)?;
        let vertices: &[u8] = match self.target.format {
            VertexFormat::Full => bytemuck::cast_slice(self.mesh.vertices()),
            VertexFormat::Packed => {
                if self.packed.is_empty() {
                    self.packed = self.mesh.packed_vertices();
                }
                bytemuck::cast_slice(&self.packed)
            }
        };
        let (mut begin, mut written) = (0, self.written);
        self.target.for_each_write(&self.mesh, vertices, |buffer, offset, bytes| {
            let end = begin + bytes.len() as u64;
            while written < end {
                let length = upload_budget.take(end - written, 4);
                if length == 0 {
                    break;
                }
                let first = (written - begin) as usize;
                uploads.write_buffer(buffer, offset + first as u64, &bytes[first..first + length as usize]);
                written += length;
            }
            begin = end;
        })?;
        self.written = written;
        Ok(written == begin)
    }
}
