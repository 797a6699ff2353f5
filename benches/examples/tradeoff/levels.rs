//! The error of the levels of detail that are drawn.

use drawloom::command::RenderCommand;
use drawloom::glam::Vec3;
use drawloom::scene::{Camera, Projection, Scene};

use crate::errors::worst_of;

/// By how many pixels the error of a drawn level moves a vertex in the picture, at most. `None` if no command draws a
/// mesh that has levels, or if the camera has no perspective.
pub fn greatest_error(scene: &Scene, camera: &Camera, commands: &[RenderCommand]) -> Option<f64> {
    let Projection::Perspective { field_of_view } = camera.projection else { return None };
    let focal = f64::from(camera.size[1]) * 0.5 / (f64::from(field_of_view) * 0.5).tan();
    let turn = camera.orientation.as_dquat().normalize().inverse();
    let objects = scene.as_scene_ref();
    let mut worst: Option<f64> = None;
    for command in commands {
        let object = command.object as usize;
        let Ok(mesh) = objects.assets.get(objects.meshes[object]) else { continue };
        if mesh.levels().is_empty() {
            continue;
        }
        let level = command.state.level_of_detail() as usize;
        let error = level.checked_sub(1).map_or(0.0, |coarser| f64::from(mesh.levels()[coarser].error()));
        let scale = objects.scales[object];
        let moved_by = error * f64::from(scale.abs().max_element());
        let orientation = objects.orientations[object].as_dquat().normalize();
        let pixels = mesh.vertices().iter().filter_map(|vertex| {
            let local = (Vec3::from(vertex.position) * scale).as_dvec3();
            let in_camera = turn * (objects.positions[object] - camera.position + orientation * local);
            let depth = -in_camera.z;
            // A step that turns the ray away from the axis moves the point most: by the secant of its angle more than
            // one at the axis.
            (depth > f64::from(camera.near)).then(|| moved_by * focal / depth * in_camera.length() / depth)
        });
        worst = pixels.chain(worst).reduce(worst_of);
    }
    worst
}
