//! The arguments of a pass's indirect draws.

use parking_lot::{RwLock, RwLockReadGuard};
use wgpu::util::DrawIndexedIndirectArgs;

use super::assets::AssetSnapshot;
use super::growing_buffer::MirroredBuffer;
use super::record::mesh_of;
use super::uploads::Uploads;
use crate::backend::BackendError;
use crate::command::DrawList;

/// The arguments of a pass's indirect draws: those of each batch at its own place.
#[derive(Default)]
pub(super) struct Arguments {
    buffer: RwLock<Option<MirroredBuffer>>,
}

impl Arguments {
    /// Bytes of one batch's.
    pub(super) const STRIDE: u64 = size_of::<DrawIndexedIndirectArgs>() as u64;

    pub(super) fn are_there(&mut self) -> bool {
        self.buffer.get_mut().is_some()
    }

    /// Drops them.
    pub(super) fn forget(&mut self) {
        *self.buffer.get_mut() = None;
    }

    /// Uploads the arguments of all batches that draw a mesh as it is, if they have changed.
    ///
    /// # Errors
    /// If a batch draws no mesh, or the device has no room.
    pub(super) fn upload(
        &self,
        device: &wgpu::Device,
        uploads: &Uploads,
        assets: &AssetSnapshot,
        list: &DrawList,
    ) -> Result<(), BackendError> {
        let mut buffer = self.buffer.write();
        let buffer = buffer.get_or_insert_with(|| MirroredBuffer::new("indirect draws", wgpu::BufferUsages::INDIRECT));
        let bytes = buffer.rewrite();
        for (place, batch) in list.batches.iter().enumerate() {
            let arguments = match (batch.state.subdivision_level(), list.remaining(place)) {
                (0, None) => {
                    let mesh = mesh_of(assets, batch)?;
                    DrawIndexedIndirectArgs {
                        index_count: mesh.index_count,
                        instance_count: batch.count,
                        first_index: mesh.first_index,
                        base_vertex: mesh.base_vertex,
                        first_instance: batch.first,
                    }
                }
                // It has an index buffer of its own, and is drawn directly.
                _ => DrawIndexedIndirectArgs::default(),
            };
            bytes.extend_from_slice(arguments.as_bytes());
        }
        buffer.upload(device, uploads).map(|_| ())
    }

    /// The buffer while it is drawn from.
    pub(super) fn read(&self) -> RwLockReadGuard<'_, Option<MirroredBuffer>> {
        self.buffer.read()
    }
}
