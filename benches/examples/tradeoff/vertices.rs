//! The error of vertex positions.

use drawloom::glam::{DVec2, Vec3};
use drawloom::quality::TransformPrecision;
use drawloom::scene::{Camera, Mesh, Projection, Scene};
use drawloom::view::RenderView;
use drawloom::view::internal::FixedPosition;

use crate::errors::worst_of;

/// The greatest error in pixels of a vertex in the picture that is at least its mesh's radius away from the camera.
/// Positions are computed in f32, as shaders do, and compared with f64 from the camera's definition. `None` if there is
/// no such vertex, or if the camera has no perspective.
pub fn greatest_error(scene: &Scene, camera: &Camera, precision: TransformPrecision) -> Option<f64> {
    let Projection::Perspective { field_of_view } = camera.projection else { return None };
    let view = RenderView::new(camera);
    let clip_from_relative = view.clip_from_relative();
    let turn = camera.orientation.as_dquat().normalize().inverse();
    let focal = 1.0 / (f64::from(field_of_view) * 0.5).tan();
    let [width, height] = camera.size.map(f64::from);
    let pixel = |x: f64, y: f64| DVec2::new(x * width, y * height) * 0.5;
    let objects = scene.as_scene_ref();
    let mut worst: Option<f64> = None;
    for object in 0..objects.object_count() {
        let Ok(mesh) = objects.assets.get(objects.meshes[object]) else { continue };
        let (position, scale) = (objects.positions[object], objects.scales[object]);
        let (orientation, exact_turn) =
            (objects.orientations[object].normalize(), objects.orientations[object].as_dquat().normalize());
        let radius = f64::from(objects.bounds[object].radius * scale.abs().max_element());
        let (Some(fixed), Some(eye)) = (FixedPosition::new(position), FixedPosition::new(camera.position)) else {
            continue;
        };
        let origin = Vec3::from(fixed.relative_to(eye));
        for vertex in mesh.vertices() {
            let local = Vec3::from(vertex.position) * scale;
            let exact_local = Vec3::from(vertex.position).as_dvec3() * scale.as_dvec3();
            let exact = position - camera.position + exact_turn * exact_local;
            let in_camera = turn * exact;
            if -in_camera.z < f64::from(camera.near) || exact.length() < radius {
                continue;
            }
            let right = pixel(in_camera.x * focal * height / width / -in_camera.z, in_camera.y * focal / -in_camera.z);
            let relative = match precision {
                TransformPrecision::CameraRelative => origin + orientation * local,
                TransformPrecision::Absolute => position.as_vec3() + orientation * local - camera.position.as_vec3(),
            };
            let clip = (clip_from_relative * relative.extend(1.0)).as_dvec4();
            let error = pixel(clip.x / clip.w, clip.y / clip.w).distance(right);
            let is_in_picture = (right / pixel(1.0, 1.0)).abs().max_element() <= 1.0;
            if is_in_picture {
                worst = Some(worst.map_or(error, |worst| worst_of(worst, error)));
            }
        }
    }
    worst
}

/// Whether the normals of each triangle are at right angles at most, and all objects are scaled uniformly.
pub fn normals_are_bounded(scene: &Scene) -> bool {
    let objects = scene.as_scene_ref();
    let is_even = |scale: &Vec3| scale.abs().max_element() <= scale.abs().min_element() * 1.001;
    objects.scales.iter().all(is_even)
        && objects.assets.iter::<Mesh>().all(|(_, mesh)| {
            mesh.triangles().all(|corners| {
                let [a, b, c] = corners.map(|corner| Vec3::from(mesh.vertices()[corner as usize].normal));
                a.dot(b) >= 0.0 && b.dot(c) >= 0.0 && c.dot(a) >= 0.0
            })
        })
}
