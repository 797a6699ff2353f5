//! Cameras.

use drawloom::glam::{DAffine3, DVec3};
use drawloom::scene::{Camera, Projection};

use crate::element::Element;
use crate::error::Problem;
use crate::nodes::MAX_DISTANCE;
use crate::transforms::decompose;
use crate::warnings::Warnings;

/// The fields of view that are drawn, in radians.
const FIELDS_OF_VIEW: [f32; 2] = [1e-4, std::f32::consts::PI - 1e-3];

/// A camera of a node, for a picture of a size.
///
/// # Errors
/// If its planes, its field of view or its height are none.
pub(crate) fn read_camera(
    camera: &Element<'_>,
    world: &DAffine3,
    size: [u32; 2],
    warnings: &mut Warnings,
) -> Result<Camera, Problem> {
    let aspect = size[0] as f32 / size[1] as f32;
    let lens = |member: &str| camera.object(member)?.ok_or_else(|| camera.lacks(member));
    let (projection, near, far, own_aspect) = match camera.text("type")? {
        Some("perspective") => {
            let lens = lens("perspective")?;
            let needed = |member: &str| lens.number(member)?.ok_or_else(|| lens.lacks(member));
            let wanted = needed("yfov")?;
            if wanted <= 0.0 {
                return Err(Problem::invalid(camera, "has a field of view that is not positive"));
            }
            let field_of_view = wanted.clamp(FIELDS_OF_VIEW[0], FIELDS_OF_VIEW[1]);
            if field_of_view != wanted {
                warnings.add(format!("{camera}: its field of view of {wanted} is drawn as {field_of_view}"));
            }
            let far = lens.number("zfar")?.unwrap_or(f32::INFINITY);
            (Projection::Perspective { field_of_view }, needed("znear")?, far, lens.number("aspectRatio")?)
        }
        Some("orthographic") => {
            let lens = lens("orthographic")?;
            let needed = |member: &str| lens.number(member)?.ok_or_else(|| lens.lacks(member));
            let (half_height, far) = (needed("ymag")?, needed("zfar")?);
            let height = 2.0 * half_height.abs();
            if !(height > 1e-6 && height.is_finite()) {
                return Err(Problem::invalid(camera, "has a height that is not a positive distance"));
            }
            // Drawloom's near plane is before the camera.
            let near = needed("znear")?.max(far * 1e-6);
            (Projection::Orthographic { height }, near, far, Some((needed("xmag")? / half_height).abs()))
        }
        Some(_) => return Err(Problem::invalid(camera, "has a `type` that is neither perspective nor orthographic")),
        None => return Err(camera.lacks("type")),
    };
    if !(near > 1e-20 && near < far && near.is_finite()) {
        return Err(Problem::invalid(camera, "has planes that are not 0 < near < far"));
    }
    if own_aspect.is_some_and(|own| (own / aspect - 1.0).abs() > 0.01) {
        warnings.add(format!("{camera}: its height is kept, and its width is that of the picture"));
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

/// A camera that sees a whole sphere, from before, from the right and from above; a part of one that is larger than the
/// world.
pub(crate) fn framing_camera(center: DVec3, radius: f64, size: [u32; 2]) -> Camera {
    const FIELD_OF_VIEW: f64 = 0.8;
    let narrowest = (size[0] as f64 / size[1] as f64).min(1.0);
    let half_angle = ((FIELD_OF_VIEW / 2.0).tan() * narrowest).atan();
    let distance = 1.1 * radius / half_angle.sin();
    let back = DVec3::new(0.35, 0.3, 1.0).normalize();
    let position = (center + back * distance).clamp_length_max(MAX_DISTANCE);
    let projection = Projection::Perspective { field_of_view: FIELD_OF_VIEW as f32 };
    let near = ((distance - radius) * 0.1).max(distance * 1e-3) as f32;
    Camera { projection, near: near.clamp(1e-20, 1e30), size, ..Camera::looking_at("main", position, position - back) }
}
