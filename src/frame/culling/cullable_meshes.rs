//! The meshes whose triangles are culled.

use crate::scene::{Assets, Mesh};
use crate::view::UsedMeshes;

/// The meshes that ask for triangle culling, and that objects use.
#[derive(Debug, Default)]
pub(super) struct CullableMeshes {
    /// The identity and revision of the mesh collection that this was built from, and the revision of the used meshes.
    version: Option<(u64, u64, u64)>,
    /// For each slot, up to the last cullable one.
    is_cullable: Vec<bool>,
}

impl CullableMeshes {
    /// Rebuilds the set if the meshes have changed, or others are used.
    pub(super) fn update(&mut self, assets: &Assets, used: &UsedMeshes) {
        let version = (assets.meshes.identity(), assets.meshes.revision(), used.revision());
        if self.version == Some(version) {
            return;
        }
        self.version = Some(version);
        self.is_cullable.clear();
        let is_cullable = |(handle, mesh): &(_, &Mesh)| mesh.culls_triangles() && used.contains(*handle);
        for (handle, _) in assets.iter::<Mesh>().filter(is_cullable) {
            self.is_cullable.resize(handle.index() as usize, false);
            self.is_cullable.push(true);
        }
    }

    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.is_cullable.is_empty()
    }

    /// Whether the mesh in a slot is one of them.
    pub(super) fn contains(&self, slot: u32) -> bool {
        self.is_cullable.get(slot as usize).is_some_and(|is_cullable| *is_cullable)
    }
}
