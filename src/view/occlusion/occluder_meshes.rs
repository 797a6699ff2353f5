//! The convex parts of every mesh, worked out once.

use crate::raster::ConvexPart;
use crate::scene::Assets;

/// The [convex parts](ConvexPart) of a collection's meshes, worked out when a mesh comes or changes.
#[derive(Debug, Default)]
pub struct OccluderMeshes {
    /// Whose meshes they are, and as of when.
    synced: Option<(u64, u64)>,
    /// For each slot: the mesh's revision, and its parts.
    parts: Vec<(u64, Vec<ConvexPart>)>,
}

impl OccluderMeshes {
    /// Takes in what has changed.
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
            match assets.meshes.revised_at(slot) {
                Some((revision, _)) if parts.0 == revision => {}
                Some((revision, mesh)) => *parts = (revision, ConvexPart::of(mesh)),
                None => *parts = (0, Vec::new()),
            }
        }
    }

    /// Those of the mesh in a slot, the largest first; none where there is no mesh.
    pub fn parts(&self, slot: u32) -> &[ConvexPart] {
        self.parts.get(slot as usize).map_or(&[], |(_, parts)| parts)
    }
}
