//! Cameras.

use drawloom::glam::{DAffine3, DVec3};
use drawloom::scene::{Camera, Projection};

use crate::error::Problem;
use crate::transforms::decompose;
use crate::warnings::Warnings;

/// A camera of a node, for a picture of a size.
///
/// # Errors
/// If its planes, its field of view or its height are none.
pub(crate) fn read_camera(
    camera: &gltf::Camera<'_>,
    world: &DAffine3,
    size: [u32; 2],
    warnings: &mut Warnings,
) -> Result<Camera, Problem> {
    let element = match camera.name() {
        Some(name) => format!("camera {} ({name})", camera.index()),
        None => format!("camera {}", camera.index()),
    };
    let aspect = size[0] as f32 / size[1] as f32;
    let (projection, near, far, own_aspect) = match camera.projection() {
        gltf::camera::Projection::Perspective(perspective) => {
            let field_of_view = perspective.yfov();
            if !(field_of_view > 1e-5 && field_of_view < std::f32::consts::PI) {
                return Err(Problem::invalid(element, "has a field of view that is not between 0 and 180 degrees"));
            }
            let far = perspective.zfar().unwrap_or(f32::INFINITY);
            (Projection::Perspective { field_of_view }, perspective.znear(), far, perspective.aspect_ratio())
        }
        gltf::camera::Projection::Orthographic(orthographic) => {
            let (height, far) = (2.0 * orthographic.ymag().abs(), orthographic.zfar());
            if !(height > 1e-6 && height.is_finite() && far.is_finite()) {
                return Err(Problem::invalid(element, "has a height or a far plane that is not a positive distance"));
            }
            // Drawloom's near plane is before the camera.
            let near = orthographic.znear().max(far * 1e-6);
            (Projection::Orthographic { height }, near, far, Some(orthographic.xmag() / orthographic.ymag()))
        }
    };
    if !(near > 1e-20 && near < far && near.is_finite()) {
        return Err(Problem::invalid(element, "has planes that are not 0 < near < far"));
    }
    if own_aspect.is_some_and(|own| (own / aspect - 1.0).abs() > 0.01) {
        warnings.add(format!("{element}: its height is kept, and its width is that of the picture"));
    }
    let placed = decompose(world);
    Ok(Camera {
        position: placed.translation,
        orientation: placed.rotation.as_quat().normalize(),
        projection,
        near,
        far,
        size,
        ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z)
    })
}

/// A camera that sees a whole sphere, from before, from the right and from above.
pub(crate) fn framing_camera(center: DVec3, radius: f64, size: [u32; 2]) -> Camera {
    const FIELD_OF_VIEW: f64 = 0.8;
    let narrowest = (size[0] as f64 / size[1] as f64).min(1.0);
    let half_angle = ((FIELD_OF_VIEW / 2.0).tan() * narrowest).atan();
    let distance = 1.1 * radius / half_angle.sin();
    let position = center + DVec3::new(0.35, 0.3, 1.0).normalize() * distance;
    let projection = Projection::Perspective { field_of_view: FIELD_OF_VIEW as f32 };
    let near = ((distance - radius) * 0.1).max(distance * 1e-3) as f32;
    Camera { projection, near: near.max(1e-20), size, ..Camera::looking_at("main", position, center) }
}
