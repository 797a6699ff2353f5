//! Meshes, kept over frames.

use std::sync::Arc;

use crate::quality::VertexFormat;
use crate::scene::{Assets, Mesh};
use crate::view::UsedMeshes;

/// The meshes of a frame, by slot.
pub(super) type Meshes = Arc<[Option<Arc<Mesh>>]>;

/// Keeps the meshes that a scene's objects use: a frame that is drawn later needs them after the scene has changed.
#[derive(Default)]
pub(super) struct MeshCache {
    /// The identity and revision of the collection that the meshes are of, the revision of the used ones, and the
    /// format of their vertices.
    version: (u64, u64, u64, VertexFormat),
    /// By slot, with the revision of each.
    kept: Vec<Option<(u64, Arc<Mesh>)>>,
    meshes: Meshes,
}

impl MeshCache {
    /// Those of the assets' meshes that are used, with the vertices that a device would fetch.
    pub(super) fn update(&mut self, assets: &Assets, used: &UsedMeshes, vertices: VertexFormat) -> Meshes {
        let wanted = (assets.meshes.identity(), assets.meshes.revision(), used.revision(), vertices);
        if self.version == wanted {
            return Arc::clone(&self.meshes);
        }
        let used = || assets.meshes.iter_with_revision().filter(|(handle, ..)| used.contains(*handle));
        let mut before = std::mem::take(&mut self.kept);
        if (self.version.0, self.version.3) != (wanted.0, wanted.3) {
            before.clear();
        }
        self.kept.resize(assets.meshes.slot_count(), None);
        for (handle, revision, mesh) in used() {
            let slot = handle.index() as usize;
            let same = before.get_mut(slot).and_then(Option::take).filter(|(kept, _)| *kept == revision);
            self.kept[slot] = Some(same.unwrap_or_else(|| (revision, Arc::new(as_fetched(mesh.clone(), vertices)))));
        }
        self.version = wanted;
        self.meshes = self.kept.iter().map(|kept| kept.as_ref().map(|(_, mesh)| Arc::clone(mesh))).collect();
        Arc::clone(&self.meshes)
    }
}

/// The mesh with the vertices that a device would fetch.
pub(super) fn as_fetched(mesh: Mesh, vertices: VertexFormat) -> Mesh {
    match vertices {
        VertexFormat::Full => mesh,
        VertexFormat::Packed => mesh.as_packed(),
    }
}
