//! Meshes in smaller triangles, for views that show straight edges bent.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use parking_lot::Mutex;

use super::{BackendError, FrameRequest};
use crate::command::{Batch, DrawList};
use crate::quality::VertexFormat;
use crate::scene::{Assets, Mesh};
use crate::view::RejectionReason;

/// Keeps subdivided meshes, as what a backend draws them from, for as long as frames draw them and a while longer.
pub(super) struct Subdivisions<T> {
    kept: Mutex<HashMap<Key, Arc<Subdivided<T>>>>,
    /// Whose meshes they are.
    assets: AtomicU64,
    frame: AtomicU64,
}

/// A subdivided mesh.
pub(super) struct Subdivided<T> {
    /// What it is drawn from.
    pub(super) drawn: T,
    /// Whether it has longer edges than it should, because there would be too many triangles.
    pub(super) is_coarse: bool,
    used_in: AtomicU64,
}

/// The subdivided meshes of a frame, by mesh slot and how often their edges are halved.
pub(super) type SubdividedMeshes<T> = HashMap<(u32, u32), Arc<Subdivided<T>>>;

/// Which mesh, how often its edges are halved, and how its vertices lie in memory. What the mesh was before it changed has another
/// revision.
type Key = (u32, u64, u32, VertexFormat);

/// No mesh becomes more triangles than this.
const MOST_TRIANGLES: usize = 1 << 18;

impl<T> Default for Subdivisions<T> {
    fn default() -> Self {
        Self { kept: Mutex::default(), assets: AtomicU64::new(0), frame: AtomicU64::new(0) }
    }
}

impl<T> Subdivisions<T> {
    /// In frames.
    const KEPT_UNUSED: u64 = 120;

    /// Begins a frame: drops what no frame has drawn for long.
    pub(super) fn begin(&self, assets: &Assets) {
        // Relaxed, here and below: frames begin one after the other, and the end of a frame's run orders what its jobs stored.
        let frame = self.frame.fetch_add(1, Ordering::Relaxed) + 1;
        let identity = assets.meshes.identity();
        let same_assets = self.assets.swap(identity, Ordering::Relaxed) == identity;
        let is_used = |mesh: &Subdivided<T>| mesh.used_in.load(Ordering::Relaxed) + Self::KEPT_UNUSED >= frame;
        self.kept.lock().retain(|_, mesh| same_assets && is_used(mesh));
    }

    /// Drops everything.
    #[cfg(feature = "wgpu")]
    pub(super) fn forget(&self) {
        self.kept.lock().clear();
    }

    /// Takes up the subdivided meshes that batches of a list draw, each as what `make` makes of it; and counts the objects that are
    /// drawn coarser than they should be.
    ///
    /// # Errors
    /// If there is no such mesh, or it cannot be made.
    pub(super) fn collect(
        &self,
        request: &FrameRequest<'_>,
        list: &DrawList,
        vertices: VertexFormat,
        mut make: impl FnMut(Mesh) -> Result<T, BackendError>,
        mut put: impl FnMut((u32, u32), Arc<Subdivided<T>>),
    ) -> Result<(), BackendError> {
        for &Batch { mesh, state, first, count } in
            list.batches.iter().filter(|batch| batch.state.subdivision_level() > 0)
        {
            let found = self.find(request.scene.assets, mesh, state.subdivision_level(), vertices, &mut make)?;
            if found.is_coarse {
                for &object in &list.objects[first as usize..][..count as usize] {
                    request.rejections.count_once(RejectionReason::CoarseEdges, object as usize);
                }
            }
            put((mesh, state.subdivision_level()), found);
        }
        Ok(())
    }

    fn find(
        &self,
        assets: &Assets,
        slot: u32,
        level: u32,
        vertices: VertexFormat,
        make: impl FnOnce(Mesh) -> Result<T, BackendError>,
    ) -> Result<Arc<Subdivided<T>>, BackendError> {
        let (revision, mesh) = assets.meshes.get_with_revision(slot).ok_or_else(no_such_mesh)?;
        let key = (slot, revision, level, vertices);
        let kept = self.kept.lock().get(&key).cloned();
        let found = match kept {
            Some(kept) => kept,
            None => {
                // Two passes may do this at once, and then one of them was in vain: better than waiting for each other.
                let (mesh, is_coarse) = subdivided(mesh, level);
                let made = Arc::new(Subdivided { drawn: make(mesh)?, is_coarse, used_in: AtomicU64::new(0) });
                Arc::clone(self.kept.lock().entry(key).or_insert(made))
            }
        };
        found.used_in.store(self.frame.load(Ordering::Relaxed), Ordering::Relaxed);
        Ok(found)
    }
}

/// The mesh with its edges halved so often; and whether it has longer edges than it should.
fn subdivided(mesh: &Mesh, level: u32) -> (Mesh, bool) {
    // A little more, lest halves that were rounded up are halved again.
    let longest = mesh.longest_edge() / (1_u64 << level) as f32 * 1.001;
    let subdivided = mesh.subdivided(longest, MOST_TRIANGLES);
    let is_coarse = subdivided.longest_edge() > longest;
    (subdivided, is_coarse)
}

/// A batch whose mesh is in no slot, which queues do not make.
pub(super) fn no_such_mesh() -> BackendError {
    BackendError::BrokenRule { rule: "a batch draws a mesh that is there".to_owned() }
}
