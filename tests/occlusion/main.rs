//! Occlusion culling compared with pictures drawn in f64: no visible object is culled, and occluders are found.

mod extremes;
mod margins;
mod properties;
mod walls;

use drawloom::scene::{Blend, SceneRef, ViewKind};
use drawloom::view::RenderView;
use drawloom::view::internal::{ObjectTable, OccluderMeshes, OcclusionCuller, VisibleSet};

/// For each object, whether the frustum of the scene's first camera intersects it, and whether the occlusion culler
/// finds it hidden.
fn occlusion(scene: &SceneRef<'_>, tile_size: u32) -> (Vec<bool>, Vec<bool>) {
    let count = scene.object_count();
    let view = RenderView::new(&scene.cameras[0]);
    assert_ne!(view.kind(), ViewKind::Shadow);
    let mut table = ObjectTable::default();
    table.update(scene);
    let mut visible = VisibleSet::default();
    visible.reset(count);
    for object in 0..count {
        let bounds = table.block(object / ObjectTable::BLOCK_SIZE).spheres.get(object % ObjectTable::BLOCK_SIZE);
        let sees = view.frustum.intersects_sphere(bounds.center, bounds.radius);
        let bit = 1 << (object % VisibleSet::OBJECTS_PER_WORD);
        visible.replace(object / VisibleSet::OBJECTS_PER_WORD, bit, if sees { bit } else { 0 });
    }
    let bits = |visible: &VisibleSet| {
        (0..count)
            .map(|object| {
                visible.word(object / VisibleSet::OBJECTS_PER_WORD) >> (object % VisibleSet::OBJECTS_PER_WORD) & 1 == 1
            })
            .collect()
    };
    let visible_before: Vec<bool> = bits(&visible);
    let mut meshes = OccluderMeshes::default();
    meshes.sync(scene.assets, table.used_meshes());
    let mut culler = OcclusionCuller::default();
    culler.reset(&view, tile_size);
    culler.select_occluders(scene, &table, &visible, &meshes, |_, draw| draw.state.blend() == Blend::None);
    (0..culler.strip_count()).for_each(|strip| culler.draw_occluders(strip));
    let hidden = visible.remove_hidden(0..count, |first, mask| culler.hidden(scene, &table, first, mask));
    let visible_after: Vec<bool> = bits(&visible);
    let is_hidden: Vec<bool> =
        visible_before.iter().zip(&visible_after).map(|(&before, &after)| before && !after).collect();
    assert_eq!(hidden, is_hidden.iter().filter(|&&hidden| hidden).count());
    (visible_before, is_hidden)
}
