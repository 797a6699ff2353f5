//! The meshes that objects have, among those of the assets.

use super::changed_objects::ChangedObjects;
use super::draw_states::DrawStates;
use crate::bit_set::BITS_PER_WORD;
use crate::handle::Handle;
use crate::scene::{Assets, Mesh, SceneRef};

/// The meshes that an object of the scene has, or had in an earlier frame: what a backend uploads. A mesh that no
/// object has any more stays among them until it is removed from the assets, so that an object that comes back finds it
/// on the device.
///
/// A frame looks at the objects that changed, and at none while all meshes of the assets are used.
#[derive(Debug, Default)]
pub struct UsedMeshes {
    /// The identity and revision of the meshes, and that of the draw states; `None` before the first update.
    version: Option<(u64, u64, u64)>,
    /// By slot: each mesh of the assets that can be drawn.
    meshes: Vec<Option<Handle<Mesh>>>,
    /// By slot: whether there is a mesh that is not used. A frame in which all objects changed looks here for each of
    /// them.
    is_unused: Vec<bool>,
    /// The number of meshes that are not used.
    unused: usize,
    revision: u64,
}

impl UsedMeshes {
    /// Whether a mesh is used. None is that has been removed.
    pub fn contains(&self, mesh: Handle<Mesh>) -> bool {
        let slot = mesh.index() as usize;
        self.meshes.get(slot) == Some(&Some(mesh)) && !self.is_unused[slot]
    }

    /// Whether the mesh in a slot is used.
    #[cfg(any(feature = "occlusion", feature = "wgpu"))]
    pub(crate) fn contains_slot(&self, slot: u32) -> bool {
        let slot = slot as usize;
        self.meshes.get(slot).is_some_and(Option::is_some) && !self.is_unused[slot]
    }

    /// Whether there is a mesh in a slot that can be drawn, used or not.
    #[cfg(feature = "wgpu")]
    pub(crate) fn can_be_used(&self, slot: u32) -> bool {
        self.meshes.get(slot as usize).is_some_and(Option::is_some)
    }

    /// A counter that grows whenever a mesh becomes used.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Adds the meshes of the objects that changed. Those of the others are among the used ones already: an object that
    /// has not changed cannot have a mesh that is new.
    pub(super) fn update(&mut self, scene: &SceneRef<'_>, changed: &ChangedObjects, draw_states: &DrawStates) {
        self.update_assets(scene.assets, draw_states);
        let unused_before = self.unused;
        for word in (0..changed.word_count()).map(|index| changed.word(index)) {
            if self.unused == 0 {
                break;
            }
            if word.mask == u64::MAX {
                let meshes = &scene.meshes[word.index() * BITS_PER_WORD..][..BITS_PER_WORD];
                meshes.iter().for_each(|mesh| self.add(*mesh));
            } else {
                word.indices().for_each(|object| self.add(scene.meshes[object]));
            }
        }
        self.revision += u64::from(self.unused < unused_before);
    }

    fn update_assets(&mut self, assets: &Assets, draw_states: &DrawStates) {
        let version = Some((assets.meshes.identity(), assets.meshes.revision(), draw_states.limits_revision()));
        if self.version == version {
            return;
        }
        let mut meshes = vec![None; assets.meshes.slot_count()];
        let mut is_unused = vec![false; assets.meshes.slot_count()];
        for (mesh, _) in assets.iter::<Mesh>() {
            let slot = mesh.index() as usize;
            if !draw_states.is_drawable(slot) {
                continue;
            }
            meshes[slot] = Some(mesh);
            is_unused[slot] = !self.contains(mesh);
        }
        self.unused = is_unused.iter().filter(|is_unused| **is_unused).count();
        (self.version, self.meshes, self.is_unused) = (version, meshes, is_unused);
    }

    #[inline(always)]
    fn add(&mut self, mesh: Handle<Mesh>) {
        let slot = mesh.index() as usize;
        if self.is_unused.get(slot) == Some(&true) && self.meshes[slot] == Some(mesh) {
            self.is_unused[slot] = false;
            self.unused -= 1;
        }
    }
}
