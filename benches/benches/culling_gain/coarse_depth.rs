//! This crate's occlusion culling, in a renderer that is written by hand.

use drawloom::scene::{Blend, SceneRef};
use drawloom::view::RenderView;
use drawloom::view::internal::{ObjectTable, OccluderMeshes, OcclusionCuller, VisibleSet};

/// The coarse depth buffer of a scene whose objects stand still.
pub struct CoarseDepth {
    tile_size: u32,
    table: ObjectTable,
    meshes: OccluderMeshes,
    culler: OcclusionCuller,
    visible: VisibleSet,
}

impl CoarseDepth {
    pub fn new(scene: &SceneRef<'_>, tile_size: u32) -> Self {
        let (mut table, mut meshes) = (ObjectTable::default(), OccluderMeshes::default());
        table.update(scene);
        meshes.sync(scene.assets, table.used_meshes());
        Self { tile_size, table, meshes, culler: OcclusionCuller::default(), visible: VisibleSet::default() }
    }

    /// Finds the objects that others hide, among those in the frustum, which are in ascending order.
    pub fn cull(&mut self, scene: &SceneRef<'_>, view: &RenderView, in_frustum: &[u32]) {
        let Self { tile_size, table, meshes, culler, visible } = self;
        let word_of = |object: u32| object as usize / VisibleSet::OBJECTS_PER_WORD;
        visible.reset(scene.object_count());
        for objects in in_frustum.chunk_by(|&one, &next| word_of(one) == word_of(next)) {
            let bits =
                objects.iter().fold(0, |bits, &object| bits | 1 << (object as usize % VisibleSet::OBJECTS_PER_WORD));
            visible.replace(word_of(objects[0]), u64::MAX, bits);
        }
        culler.reset(view, *tile_size);
        culler.select_occluders(scene, table, visible, meshes, |_, draw| draw.state.blend() == Blend::None);
        (0..culler.strip_count()).for_each(|strip| culler.draw_occluders(strip));
        visible.remove_hidden(0..scene.object_count(), |first, visible| culler.hidden(scene, table, first, visible));
    }

    /// Whether the last call found that an object in the frustum may be visible.
    pub fn sees(&self, object: u32) -> bool {
        self.visible.contains(object as usize)
    }
}
