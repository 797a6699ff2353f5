//! Meshes in smaller triangles, for views that show straight edges bent.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use parking_lot::Mutex;

use super::arena::filled_buffer;
use super::uploads::Uploads;
use super::vertices::with_bytes;
use crate::backend::BackendError;
use crate::backend::subdivided::subdivided;
use crate::quality::VertexFormat;
use crate::scene::{Assets, Mesh};

/// A subdivided mesh on the device.
pub(super) struct SubdividedMesh {
    pub(super) vertices: wgpu::Buffer,
    pub(super) indices: wgpu::Buffer,
    pub(super) index_count: u32,
    /// Whether it has longer edges than it should, because there would be too many triangles.
    pub(super) is_coarse: bool,
    used_in: AtomicU64,
}

/// Which mesh, how often its edges are halved, and how its vertices lie in memory. What the mesh was before it changed has another
/// revision.
type Key = (u32, u64, u32, VertexFormat);

/// Keeps subdivided meshes for as long as frames draw them, and a while longer.
#[derive(Default)]
pub(super) struct Subdivisions {
    kept: Mutex<HashMap<Key, Arc<SubdividedMesh>>>,
    /// Whose meshes they are.
    assets: AtomicU64,
    frame: AtomicU64,
}

impl Subdivisions {
    /// In frames.
    const KEPT_UNUSED: u64 = 120;

    /// Begins a frame: drops what no frame has drawn for long.
    pub(super) fn begin(&self, assets: &Assets) {
        // Frames begin one after the other, so nothing is ordered by these.
        let frame = self.frame.fetch_add(1, Ordering::Relaxed) + 1;
        let identity = assets.meshes.identity();
        let same_assets = self.assets.swap(identity, Ordering::Relaxed) == identity;
        let is_used = |mesh: &SubdividedMesh| mesh.used_in.load(Ordering::Relaxed) + Self::KEPT_UNUSED >= frame;
        self.kept.lock().retain(|_, mesh| same_assets && is_used(mesh));
    }

    /// Drops everything.
    pub(super) fn forget(&self) {
        self.kept.lock().clear();
    }

    /// The mesh in a slot with its edges halved so often.
    ///
    /// # Errors
    /// If there is no such mesh, or the device has no room.
    pub(super) fn find(
        &self,
        device: &wgpu::Device,
        uploads: &Uploads,
        assets: &Assets,
        vertices: VertexFormat,
        slot: u32,
        halvings: u32,
    ) -> Result<Arc<SubdividedMesh>, BackendError> {
        let lost = || BackendError::BrokenRule { rule: "a batch draws a mesh that is there".to_owned() };
        let (revision, mesh) = assets.meshes.revised_at(slot).ok_or_else(lost)?;
        let frame = self.frame.load(Ordering::Relaxed);
        let key = (slot, revision, halvings, vertices);
        let kept = self.kept.lock().get(&key).cloned();
        let subdivided = match kept {
            Some(kept) => kept,
            None => {
                // Two passes may do this at once, and then one of them was in vain: better than waiting for each other.
                let made = Arc::new(SubdividedMesh::new(device, uploads, mesh, vertices, halvings)?);
                Arc::clone(self.kept.lock().entry(key).or_insert(made))
            }
        };
        subdivided.used_in.store(frame, Ordering::Relaxed);
        Ok(subdivided)
    }
}

impl SubdividedMesh {
    fn new(
        device: &wgpu::Device,
        uploads: &Uploads,
        mesh: &Mesh,
        format: VertexFormat,
        halvings: u32,
    ) -> Result<Self, BackendError> {
        let (subdivided, is_coarse) = subdivided(mesh, halvings);
        let upload = |label, bytes: &[u8], usage| filled_buffer(device, uploads, label, bytes, usage);
        let indices = bytemuck::cast_slice(subdivided.indices());
        Ok(Self {
            vertices: with_bytes(&subdivided, format, |vertices| {
                upload("subdivided vertices", vertices, wgpu::BufferUsages::VERTEX)
            })?,
            indices: upload("subdivided indices", indices, wgpu::BufferUsages::INDEX)?,
            index_count: subdivided.indices().len() as u32,
            is_coarse,
            used_in: AtomicU64::new(0),
        })
    }
}
