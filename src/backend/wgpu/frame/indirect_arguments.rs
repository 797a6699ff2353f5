//! The arguments of a pass's indirect draws.

use parking_lot::{RwLock, RwLockReadGuard};
use wgpu::util::DrawIndexedIndirectArgs;

use crate::backend::BackendError;
use crate::backend::wgpu::resources::{MeshSnapshot, MirroredBuffer, UploadQueue};
use crate::command::DrawList;

/// The arguments of a pass's indirect draws, at the index of their batch.
#[derive(Default)]
pub(crate) struct IndirectArguments {
    buffer: RwLock<Option<MirroredBuffer>>,
}

impl IndirectArguments {
    /// Bytes per batch.
    pub(crate) const STRIDE: u64 = size_of::<DrawIndexedIndirectArgs>() as u64;

    /// Whether an earlier frame has uploaded arguments.
    pub(crate) fn is_warm(&mut self) -> bool {
        self.buffer.get_mut().is_some()
    }

    /// Drops the buffer.
    pub(crate) fn clear(&mut self) {
        *self.buffer.get_mut() = None;
    }

    /// Uploads the arguments of all batches if they changed. Partial batches and meshes outside of the pages have zeros.
    ///
    /// # Errors
    /// If a batch draws no mesh, or the device has no room.
    pub(crate) fn upload(
        &self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        meshes: &MeshSnapshot,
        list: &DrawList,
    ) -> Result<(), BackendError> {
        let mut buffer = self.buffer.write();
        let buffer = buffer.get_or_insert_with(|| MirroredBuffer::new("indirect draws", wgpu::BufferUsages::INDIRECT));
        let bytes = buffer.rewrite();
        for (index, batch) in list.batches.iter().enumerate() {
            let is_whole = batch.state.subdivision_level() == 0 && meshes.remaining(list, index).is_none();
            let mesh = if is_whole { meshes.mesh_range(batch)? } else { None };
            // Otherwise it is drawn directly, because it has buffers of its own, or not at all.
            let arguments = mesh.map_or_else(DrawIndexedIndirectArgs::default, |mesh| DrawIndexedIndirectArgs {
                index_count: mesh.index_count,
                instance_count: batch.count,
                first_index: mesh.first_index,
                base_vertex: mesh.base_vertex,
                first_instance: batch.first,
            });
            bytes.extend_from_slice(arguments.as_bytes());
        }
        buffer.upload(device, uploads).map(|_| ())
    }

    /// The buffer, locked while draws from it are recorded.
    pub(crate) fn read(&self) -> RwLockReadGuard<'_, Option<MirroredBuffer>> {
        self.buffer.read()
    }
}
