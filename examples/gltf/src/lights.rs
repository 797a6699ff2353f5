//! Lights of `KHR_lights_punctual`.

use drawloom::glam::{DAffine3, Vec3};
use drawloom::scene::Light;
use gltf::khr_lights_punctual::Kind;

use crate::error::Problem;
use crate::transforms::decompose;
use crate::warnings::Warnings;

/// A light of a node as Drawloom has it; `None` if it is dark.
///
/// # Errors
/// If its colour, its intensity, its range or its cone is none.
pub(crate) fn read_light(
    node: usize,
    light: &gltf::khr_lights_punctual::Light<'_>,
    world: &DAffine3,
    warnings: &mut Warnings,
) -> Result<Option<Light>, Problem> {
    let element = format!("light {}", light.index());
    let intensity = Vec3::from(light.color()) * light.intensity();
    if !intensity.is_finite() || intensity.min_element() < 0.0 {
        return Err(Problem::invalid(element, "has a colour or an intensity that is negative or not finite"));
    }
    if intensity == Vec3::ZERO {
        return Ok(None);
    }
    let placed = decompose(world);
    // Lights shine along -Z.
    let direction = (placed.rotation * -drawloom::glam::DVec3::Z).as_vec3().normalize();
    let position = placed.translation;
    let range = match light.range() {
        None => Light::range_for(intensity).max(f32::MIN_POSITIVE),
        Some(range) if range > 0.0 && range.is_finite() => range,
        Some(_) => return Err(Problem::invalid(element, "has a range that is not a positive distance")),
    };
    Ok(Some(match light.kind() {
        Kind::Directional => Light::Directional { direction, illuminance: intensity, casts_shadow: true },
        Kind::Point => Light::Point { position, intensity, range, casts_shadow: false },
        Kind::Spot { inner_cone_angle, outer_cone_angle } => {
            let (inner_angle, outer_angle) = (inner_cone_angle, outer_cone_angle);
            let is_cone =
                0.0 <= inner_angle && inner_angle < outer_angle && outer_angle <= std::f32::consts::FRAC_PI_2 + 1e-6;
            if !is_cone {
                return Err(Problem::invalid(
                    element,
                    "has a cone whose angles are not 0 <= inner < outer <= 90 degrees",
                ));
            }
            let outer_angle = outer_angle.min(std::f32::consts::FRAC_PI_2);
            if inner_angle.cos() <= outer_angle.cos() {
                warnings.add(format!("{element} of node {node} has too narrow a cone, and is not drawn"));
                return Ok(None);
            }
            Light::Spot { position, direction, intensity, range, inner_angle, outer_angle, casts_shadow: true }
        }
    }))
}

/// For files without lights: it shines from above, on the side of a camera that looks along -Z.
pub(crate) fn default_light() -> Light {
    let direction = Vec3::new(-0.4, -0.7, -0.6).normalize();
    Light::Directional { direction, illuminance: Vec3::splat(3.0), casts_shadow: true }
}

/// Whether the light cast a shadow, which it no longer does.
pub(crate) fn leave_out_shadow(light: &mut Light) -> bool {
    match light {
        Light::Directional { casts_shadow, .. } | Light::Spot { casts_shadow, .. } => std::mem::take(casts_shadow),
        _ => false,
    }
}
