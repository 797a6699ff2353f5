//! Coarse occlusion against pictures drawn in f64: nothing that shows is left out, and what hides is found.

mod extremes;
mod properties;
mod walls;

use drawloom::scene::{Blend, SceneRef, ViewKind};
use drawloom::view::{ObjectTable, OccluderMeshes, OcclusionCuller, RenderView, VisibleSet};

/// For each object, whether the scene's first camera sees it, and whether that was found to be hidden.
fn occlusion(scene: &SceneRef<'_>, side: u32) -> (Vec<bool>, Vec<bool>) {
    let count = scene.object_count();
    let view = RenderView::new(&scene.cameras[0]);
    assert_ne!(view.kind(), ViewKind::Shadow);
    let mut table = ObjectTable::default();
    table.reset(count);
    table.fill(scene, 0..count);
    let mut visible = VisibleSet::default();
    visible.reset(count);
    visible.test(0..count, |objects| {
        objects.enumerate().fold(0, |bits, (place, object)| {
            let bounds = table.block(object / ObjectTable::BLOCK_SIZE).spheres.get(object % ObjectTable::BLOCK_SIZE);
            bits | u64::from(view.frustum.intersects_sphere(bounds.center, bounds.radius)) << place
        })
    });
    let bits = |visible: &VisibleSet| {
        (0..count)
            .map(|object| visible.word(object / VisibleSet::WORD) >> (object % VisibleSet::WORD) & 1 == 1)
            .collect()
    };
    let seen: Vec<bool> = bits(&visible);
    let mut meshes = OccluderMeshes::default();
    meshes.sync(scene.assets);
    let mut occlusion = OcclusionCuller::default();
    occlusion.reset(&view, side);
    occlusion.select_occluders(scene, &table, &visible, &meshes, |draw| draw.state.blend() == Blend::None);
    (0..occlusion.strip_count()).for_each(|strip| occlusion.draw_occluders(strip));
    let hidden = visible.remove_hidden(0..count, |first, seen| occlusion.hidden(scene, &table, first, seen));
    let left: Vec<bool> = bits(&visible);
    let hidden_ones: Vec<bool> = seen.iter().zip(&left).map(|(&seen, &left)| seen && !left).collect();
    assert_eq!(hidden, hidden_ones.iter().filter(|&&hidden| hidden).count());
    (seen, hidden_ones)
}
