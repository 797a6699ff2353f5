//! Meshes, kept from frame to frame.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use parking_lot::Mutex;

use crate::backend::subdivided::subdivided;
use crate::quality::VertexFormat;
use crate::scene::{Assets, Mesh};

/// What frames draw, by the mesh's slot.
pub(super) type Meshes = Arc<[Option<Arc<Mesh>>]>;

/// Keeps the meshes of a scene: a frame that is drawn later needs them, whatever becomes of the scene.
#[derive(Default)]
pub(super) struct MeshCache {
    /// Whose meshes they are, as of when, and how their vertices lie.
    assets: (u64, u64, VertexFormat),
    /// With the revision of each.
    kept: Vec<Option<(u64, Arc<Mesh>)>>,
    meshes: Meshes,
}

impl MeshCache {
    /// The meshes of these assets, as a device would fetch their vertices.
    pub(super) fn update(&mut self, assets: &Assets, vertices: VertexFormat) -> Meshes {
        let wanted = (assets.meshes.identity(), assets.meshes.revision(), vertices);
        if self.assets == wanted {
            return Arc::clone(&self.meshes);
        }
        let mut before = std::mem::take(&mut self.kept);
        if (self.assets.0, self.assets.2) != (wanted.0, wanted.2) {
            before.clear();
        }
        self.kept.resize(assets.meshes.slot_count(), None);
        for (handle, revision, mesh) in assets.meshes.iter_revised() {
            let slot = handle.index() as usize;
            let same = before.get_mut(slot).and_then(Option::take).filter(|(kept, _)| *kept == revision);
            let fetched = || match vertices {
                VertexFormat::Full => mesh.clone(),
                VertexFormat::Packed => mesh.as_packed(),
            };
            self.kept[slot] = Some(same.unwrap_or_else(|| (revision, Arc::new(fetched()))));
        }
        self.assets = wanted;
        self.meshes = self.kept.iter().map(|kept| kept.as_ref().map(|(_, mesh)| Arc::clone(mesh))).collect();
        Arc::clone(&self.meshes)
    }
}

/// A mesh in smaller triangles.
pub(super) struct Subdivided {
    pub(super) mesh: Arc<Mesh>,
    /// Whether it has longer edges than it should, because there would be too many triangles.
    pub(super) is_coarse: bool,
    used_in: AtomicU64,
}

/// Keeps subdivided meshes for as long as frames draw them, and a while longer.
#[derive(Default)]
pub(super) struct Subdivisions {
    /// By the mesh's slot and revision, and how often its edges are halved.
    kept: Mutex<HashMap<(u32, u64, u32), Arc<Subdivided>>>,
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
        let is_used = |mesh: &Subdivided| mesh.used_in.load(Ordering::Relaxed) + Self::KEPT_UNUSED >= frame;
        self.kept.lock().retain(|_, mesh| same_assets && is_used(mesh));
    }

    /// The mesh in a slot with its edges halved so often; `None` if there is no such mesh.
    pub(super) fn find(&self, assets: &Assets, slot: u32, halvings: u32) -> Option<Arc<Subdivided>> {
        let (revision, mesh) = assets.meshes.revised_at(slot)?;
        let key = (slot, revision, halvings);
        let kept = self.kept.lock().get(&key).cloned();
        // Two passes may do this at once, and then one of them was in vain: better than waiting for each other.
        let found = kept.unwrap_or_else(|| {
            let (mesh, is_coarse) = subdivided(mesh, halvings);
            let made = Arc::new(Subdivided { mesh: Arc::new(mesh), is_coarse, used_in: AtomicU64::new(0) });
            Arc::clone(self.kept.lock().entry(key).or_insert(made))
        });
        found.used_in.store(self.frame.load(Ordering::Relaxed), Ordering::Relaxed);
        Some(found)
    }
}
