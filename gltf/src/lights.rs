//! Lights of `KHR_lights_punctual`.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use drawloom::glam::{DAffine3, DVec3, Vec3};
use drawloom::scene::Light;

use crate::element::Element;
use crate::error::Problem;
use crate::transforms::decompose;
use crate::warnings::Warnings;

/// The greatest range of a light, in metres, whose square is still within the range of shaders.
const MAX_RANGE: f32 = 1e18;

/// A light of a node as Drawloom has it; `None` if it is dark.
///
/// # Errors
/// If its colour or its intensity is none, or it is of no known type.
pub(crate) fn read_light(
    light: &Element<'_>,
    world: &DAffine3,
    warnings: &mut Warnings,
) -> Result<Option<Light>, Problem> {
    // A dark light is checked, too: it may be of a type that is not known.
    let kind = light.text("type")?.ok_or_else(|| light.lacks("type"))?;
    if !matches!(kind, "directional" | "point" | "spot") {
        return Err(Problem::invalid(light, "has a `type` that is not known"));
    }
    let color = light.numbers::<3>("color")?.map_or(Vec3::ONE, |color| DVec3::from_array(color).as_vec3());
    let intensity = color * light.number("intensity")?.unwrap_or(1.0);
    if !intensity.is_finite() || intensity.min_element() < 0.0 {
        return Err(Problem::invalid(light, "has a colour or an intensity that is negative or not finite"));
    }
    if intensity == Vec3::ZERO {
        return Ok(None);
    }
    let placed = decompose(world);
    // Lights shine along -Z.
    let direction = (placed.rotation * DVec3::NEG_Z).as_vec3().normalize();
    let position = placed.translation;
    let endless = Light::range_for(intensity);
    let range = match warnings.keep(light.number("range"), format_args!("{light} shines without a range"))?.flatten() {
        None => endless,
        Some(range) if range > 0.0 => range,
        Some(range) => {
            warnings.add(format!("{light} has the range {range}, which is no distance, and shines without a range"));
            endless
        }
    };
    let range = range.clamp(f32::MIN_POSITIVE, MAX_RANGE);
    Ok(Some(match kind {
        "directional" => Light::Directional { direction, illuminance: intensity, casts_shadow: true },
        "point" => Light::Point { position, intensity, range, casts_shadow: false },
        _ => {
            let [inner_angle, outer_angle] = cone(light, warnings)?;
            Light::Spot { position, direction, intensity, range, inner_angle, outer_angle, casts_shadow: true }
        }
    }))
}

/// The angles of a light's cone: inside the first one it is bright, and beyond the second one dark.
///
/// # Errors
/// If a limit is exceeded.
fn cone(light: &Element<'_>, warnings: &mut Warnings) -> Result<[f32; 2], Problem> {
    let spot = warnings.keep(
        light.object("spot").and_then(|spot| spot.ok_or_else(|| light.lacks("spot"))),
        format_args!("{light} has a cone of 45 degrees"),
    )?;
    let angle = |member: &str, default: f32, warnings: &mut Warnings| {
        let read = spot.map_or(Ok(None), |spot| spot.number(member));
        let angle = warnings.keep(read, format_args!("the cone of {light} is drawn with {default} radians"))?;
        Ok::<_, Problem>(angle.flatten().unwrap_or(default))
    };
    let (inner, outer) = (angle("innerConeAngle", 0.0, warnings)?, angle("outerConeAngle", FRAC_PI_4, warnings)?);
    let [drawn_inner, drawn_outer] = drawable_cone(inner, outer);
    // Half a turn over four is more than its nearest f32 in some files.
    let is_valid = 0.0 <= inner && inner < outer && outer <= FRAC_PI_2 + 1e-6;
    if !is_valid || drawn_outer > outer {
        let reason = "which are not 0 <= inner < outer <= 90 degrees, or too narrow";
        let drawn = format!("the nearest that can be drawn: {drawn_inner} and {drawn_outer}");
        warnings.add(format!("{light} has a cone of the angles {inner} and {outer}, {reason}, and has {drawn}"));
    }
    Ok([drawn_inner, drawn_outer])
}

/// The nearest cone that can be drawn: Drawloom fades between the cosines of its angles, so they must differ.
fn drawable_cone(inner: f32, outer: f32) -> [f32; 2] {
    // The narrowest whose cosine differs from 1.
    const NARROWEST: f32 = 5e-4;
    let outer = outer.clamp(NARROWEST, FRAC_PI_2);
    let mut inner = inner.clamp(0.0, outer);
    let mut step = outer * 1e-7;
    while inner.cos() <= outer.cos() {
        inner = (outer - step).max(0.0);
        step *= 2.0;
    }
    [inner, outer]
}

/// For files without lights: it shines from above, on the side of a camera that looks along -Z.
pub(crate) fn default_light() -> Light {
    let direction = Vec3::new(-0.4, -0.7, -0.6).normalize();
    Light::Directional { direction, illuminance: Vec3::splat(3.0), casts_shadow: true }
}

/// Makes a light cast no shadow. Returns whether it cast one.
pub(crate) fn leave_out_shadow(light: &mut Light) -> bool {
    match light {
        Light::Directional { casts_shadow, .. } | Light::Spot { casts_shadow, .. } => std::mem::take(casts_shadow),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::FRAC_PI_6;

    use super::*;

    #[test]
    fn every_cone_can_be_drawn_and_valid_ones_stay() {
        let angles = [-1.0, 0.0, 1e-30, 1e-4, 4.9e-4, 5e-4, 0.1, 0.5, FRAC_PI_6, 1.0, FRAC_PI_2, 2.0, 3e38];
        for (inner, outer) in angles.into_iter().flat_map(|inner| angles.map(|outer| (inner, outer))) {
            let [drawn_inner, drawn_outer] = drawable_cone(inner, outer);
            assert!(0.0 <= drawn_inner && drawn_inner < drawn_outer && drawn_outer <= FRAC_PI_2, "{inner} {outer}");
            assert!(drawn_inner.cos() > drawn_outer.cos(), "{inner} {outer}");
            if (5e-4..=FRAC_PI_2).contains(&outer) {
                assert_eq!(drawn_outer, outer);
                // A hard edge is as hard as f32 allows: cosines have 24 bits.
                let hardness = (drawn_outer - drawn_inner) * drawn_outer.sin();
                assert!(inner < outer || hardness < 1e-6, "{inner} {outer}: {drawn_inner}");
            }
            if (0.0..outer - 0.01).contains(&inner) && outer <= FRAC_PI_2 {
                assert_eq!(drawn_inner, inner);
            }
        }
    }
}
