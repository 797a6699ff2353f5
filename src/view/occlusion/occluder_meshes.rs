//! The convex parts of meshes.

use crate::raster::ConvexPart;
use crate::scene::Assets;
use crate::view::UsedMeshes;

/// The convex parts of the meshes that objects use, computed when a mesh is first used or changes.
#[derive(Debug, Default)]
pub struct OccluderMeshes {
    /// The identity and the revision of the collection at the last [`OccluderMeshes::sync`], and the revision of the
    /// used meshes.
    synced: Option<(u64, u64, u64)>,
    /// For each slot, the mesh's revision and its parts.
    parts: Vec<(u64, Vec<ConvexPart>)>,
}

impl OccluderMeshes {
    /// Updates the parts of meshes that have changed, or that objects use for the first time.
    pub fn sync(&mut self, assets: &Assets, used: &UsedMeshes) {
        let identity = assets.meshes.identity();
        let version = (identity, assets.meshes.revision(), used.revision());
        if self.synced == Some(version) {
            return;
        }
        if self.synced.is_none_or(|(other, ..)| other != identity) {
            self.parts.clear();
        }
        self.synced = Some(version);
        self.parts.resize_with(assets.meshes.slot_count(), || (0, Vec::new()));
        for (slot, parts) in (0..).zip(&mut self.parts) {
            match assets.meshes.get_with_revision(slot).filter(|_| used.contains_slot(slot)) {
                Some((revision, _)) if parts.0 == revision => {}
                Some((revision, mesh)) => *parts = (revision, ConvexPart::decompose(mesh)),
                None => *parts = (0, Vec::new()),
            }
        }
    }

    /// The parts of the mesh in a slot, the largest first; none if no object uses it.
    pub fn parts(&self, slot: u32) -> &[ConvexPart] {
        self.parts.get(slot as usize).map_or(&[], |(_, parts)| parts)
    }
}
