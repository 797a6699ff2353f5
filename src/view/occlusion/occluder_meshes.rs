//! The convex parts of all meshes.

use crate::raster::ConvexPart;
use crate::scene::Assets;

/// The convex parts of a collection's meshes, computed when a mesh is added or changes.
#[derive(Debug, Default)]
pub struct OccluderMeshes {
    /// The identity and the revision of the collection at the last [`OccluderMeshes::sync`].
    synced: Option<(u64, u64)>,
    /// For each slot, the mesh's revision and its parts.
    parts: Vec<(u64, Vec<ConvexPart>)>,
}

impl OccluderMeshes {
    /// Updates the parts of meshes that have changed.
    pub fn sync(&mut self, assets: &Assets) {
        let (identity, revision) = (assets.meshes.identity(), assets.meshes.revision());
        if self.synced == Some((identity, revision)) {
            return;
        }
        if self.synced.is_none_or(|(other, _)| other != identity) {
            self.parts.clear();
        }
        self.synced = Some((identity, revision));
        self.parts.resize_with(assets.meshes.slot_count(), || (0, Vec::new()));
        for (slot, parts) in (0..).zip(&mut self.parts) {
            match assets.meshes.get_with_revision(slot) {
                Some((revision, _)) if parts.0 == revision => {}
                Some((revision, mesh)) => *parts = (revision, ConvexPart::decompose(mesh)),
                None => *parts = (0, Vec::new()),
            }
        }
    }

    /// The parts of the mesh in a slot, the largest first; none if there is no mesh.
    pub fn parts(&self, slot: u32) -> &[ConvexPart] {
        self.parts.get(slot as usize).map_or(&[], |(_, parts)| parts)
    }
}
