//! The usual coarse occlusion culling, for comparison: one sample in the centre of each tile.

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Camera, SceneRef};
use drawloom_testing::samples::{ReferenceCamera, Samples};

/// For each object, whether the method considers it hidden.
pub fn hidden(scene: &SceneRef<'_>, camera: &Camera, side: u32, in_frustum: &[bool]) -> Vec<bool> {
    let width = f64::from(side);
    let samples = Samples::new(scene, camera, width, |object| in_frustum[object]);
    let reference = ReferenceCamera::new(camera);
    let is_hidden = |object: usize| {
        let [low, high] =
            scene.assets.get(scene.meshes[object]).expect("the mesh of an object exists").corners().map(Vec3::as_dvec3);
        let position = |corner: u32| {
            let choose = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
            let scaled = scene.scales[object].as_dvec3() * DVec3::new(choose(0), choose(1), choose(2));
            reference.camera_from_world(scene.positions[object] + scene.orientations[object].as_dquat() * scaled)
        };
        let corners: Vec<_> = (0..8).map(position).collect();
        let depth = corners.iter().map(|corner| corner.z).fold(f64::INFINITY, f64::min);
        if depth <= reference.near() {
            return false;
        }
        let tiles = |axis: usize| {
            let pixels = corners.iter().map(|&corner| reference.project(corner)[axis]);
            let (first, last) =
                pixels.fold((f64::INFINITY, 0.0), |(low, high), pixel| (pixel.min(low), pixel.max(high)));
            (first / width).max(0.0) as usize
                ..((last / width).min(f64::from(camera.size[axis].div_ceil(side)) - 1.0)) as usize + 1
        };
        let (columns, rows) = (tiles(0), tiles(1));
        let nearness = reference.near() / depth;
        !columns.is_empty()
            && !rows.is_empty()
            && rows.into_iter().all(|row| columns.clone().all(|column| samples.nearness_at(column, row) > nearness))
    };
    in_frustum.iter().enumerate().map(|(object, &in_frustum)| in_frustum && is_hidden(object)).collect()
}
