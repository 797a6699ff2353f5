//! The error of an impostor whose picture is kept.

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::Camera;

use crate::errors::worst_of;
use crate::subject::{ORIGINAL, Subject};

/// By how much the impostor displaces a vertex of the original, at most, along the path: in degrees as seen over the
/// original's radius. `None` if the scene has no impostor, or if no camera of the path is outside of the original.
pub fn greatest_displacement(subject: &Subject, path: &[Camera], max_angle: f64) -> Option<f64> {
    let impostor = subject.impostor.as_ref()?;
    let objects = subject.scene.as_scene_ref();
    let (mut worst, mut before): (Option<f64>, Option<Camera>) = (None, None);
    for viewer in path {
        let picture = impostor.camera(viewer, before.as_ref(), max_angle);
        if let Some(picture) = &picture {
            // Relative to the centre of the original and of the square.
            let [here, there] = [viewer, picture].map(|camera| camera.position - impostor.center);
            let normal = picture.orientation.as_dquat().normalize() * DVec3::Z;
            for object in (0..objects.object_count()).filter(|&object| objects.layers[object] == ORIGINAL) {
                let Ok(mesh) = objects.assets.get(objects.meshes[object]) else { continue };
                let orientation = objects.orientations[object].as_dquat().normalize();
                let displaced = mesh.vertices().iter().map(|vertex| {
                    let local = (Vec3::from(vertex.position) * objects.scales[object]).as_dvec3();
                    let point = objects.positions[object] - impostor.center + orientation * local;
                    let ray = point - there;
                    let on_square = there - ray * (normal.dot(there) / normal.dot(ray));
                    (point - here).cross((on_square - here).normalize()).length() / impostor.radius
                });
                worst = displaced.map(f64::to_degrees).chain(worst).reduce(worst_of);
            }
        }
        before = picture;
    }
    worst
}
