//! `illumination.wgsl` in Rust: the light that reaches a surface.

use crate::process::ShaderLight;
use crate::process::cpu_shader::built_in::{inverse_square_root, smoothstep};
use crate::raster::{Real, Vector3};
use crate::scene::LightKind;

/// Shaders clamp stored radiance to this: above 65,504 a half float would become infinite.
pub(in crate::process::deferred) const MAX_STORED_RADIANCE: f64 = 60_000.0;

/// The illuminance of a light on a surface, without shadows.
pub(in crate::process::deferred) fn illuminance_from<R: Real>(
    light: &ShaderLight<R>,
    position: Vector3<R>,
    normal: Vector3<R>,
) -> Vector3<R> {
    let brightest = R::of(MAX_ILLUMINANCE);
    if light.kind == LightKind::Directional {
        let facing = normal.dot(-light.direction).max(R::zero());
        return light.intensity.map(|value| (value * facing).min(brightest));
    }
    let to_light = light.position - position;
    let distance_squared = to_light.dot(to_light);
    if distance_squared == R::zero() || distance_squared >= light.range * light.range {
        return Vector3::zero();
    }
    let towards = to_light * inverse_square_root(distance_squared);
    let along_axis = (-towards).dot(light.direction);
    let shape = match light.kind {
        LightKind::Spot => smoothstep(light.cone_end, light.cone_begin, along_axis),
        LightKind::Hemispherical => along_axis.max(R::zero()),
        LightKind::Directional | LightKind::Point => R::one(),
    };
    let fraction = distance_squared / (light.range * light.range);
    let window = R::one() - fraction * fraction;
    let factor = shape * normal.dot(towards).max(R::zero()) * window * window / distance_squared;
    light.intensity.map(|value| (value * factor.min(brightest)).min(brightest))
}

/// Above the range of f32 light would be infinite, and NaN once it is multiplied by 0.
const MAX_ILLUMINANCE: f64 = 1e30;

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};
    use proptest::prelude::*;

    use super::*;
    use crate::process::cpu_shader::test_inputs::{UNIT, direction, light_values};
    use crate::raster::Vector;
    use crate::scene::Light;

    const INTENSITY: Vec3 = Vec3::new(8.0, 2.0, 0.5);
    const ANGLES: [f32; 2] = [0.3, 0.7];

    fn lights(range: f32) -> [Light; 4] {
        let (position, direction) = (DVec3::new(1.0, 2.0, -3.0), Vec3::new(0.48, -0.6, 0.64));
        let [inner_angle, outer_angle] = ANGLES;
        let (intensity, casts_shadow) = (INTENSITY, false);
        [
            Light::Directional { direction, illuminance: intensity, casts_shadow },
            Light::Point { position, intensity, range, casts_shadow: false },
            Light::Spot { position, direction, intensity, range, inner_angle, outer_angle, casts_shadow },
            Light::Hemispherical { position, direction, intensity, range, casts_shadow },
        ]
    }

    /// From angles, as the documentation of [`Light`] defines it.
    fn expected(light: &Light, position: DVec3, normal: DVec3) -> f64 {
        let axis = Vec3::new(0.48, -0.6, 0.64).as_dvec3();
        let Some((light_position, range)) = light.bounding_sphere() else {
            return (-axis).angle_between(normal).cos().max(0.0);
        };
        let way = position - light_position;
        let (distance, off_axis) = (way.length(), way.angle_between(axis));
        let shape = match light {
            Light::Spot { .. } => {
                let [begin, end] = ANGLES.map(|angle| f64::from(angle).cos());
                let share = ((off_axis.cos() - end) / (begin - end)).clamp(0.0, 1.0);
                3.0 * share.powi(2) - 2.0 * share.powi(3)
            }
            Light::Hemispherical { .. } => off_axis.cos().max(0.0),
            _ => 1.0,
        };
        let window = (1.0 - (distance / f64::from(range)).powi(4)).max(0.0).powi(2);
        shape * (-way).angle_between(normal).cos().max(0.0) * window / distance.powi(2)
    }

    proptest! {
        /// In f64, to within what f32 cosines and directions that are not quite of unit length make.
        ///
        /// In f32, u being 2⁻²⁴: the way to the light is off by u in each coordinate, its square by 5u of itself, and
        /// its direction by 6u; the two cosines, sums of three products, by 6u√3 + 3u < 14u. The window's share is off
        /// by 8u of itself, so the window by 17u and its square by 36u. Each factor is at most 1, so what is left of
        /// their product is 14u·(2 for a hemispherical light, or 1.5/(begin − end) for a spot light) + 14u + 36u, and
        /// 10u for products and the quotient, of I/d².
        #[test]
        fn illuminance_follows_the_documentation_of_lights(
            way in prop::array::uniform3(-4.0..4.0_f32),
            normal in direction(),
            range in 0.5..9.0_f32,
        ) {
            let position = DVec3::new(1.0, 2.0, -3.0).as_vec3() + Vec3::from(way);
            prop_assume!(position.as_dvec3().distance(DVec3::new(1.0, 2.0, -3.0)) > 1e-3);
            let normal = normal.as_vec3();
            for light in lights(range) {
                let at = |normal: Vec3| (Vector3::of_single(position), Vector3::of_single(normal));
                let (there, facing) = at(normal);
                let double: Vector3<f64> = illuminance_from(&light_values(&light, None), there, facing);
                let most = light.bounding_sphere().map_or(1.0, |(light_position, _)| position.as_dvec3().distance_squared(light_position).recip());
                let factor = expected(&light, position.as_dvec3(), normal.as_dvec3());
                let single: Vector3<f32> = illuminance_from(
                    &light_values(&light, None),
                    Vector3::of_single(position),
                    Vector3::of_single(normal),
                );
                let [begin, end] = ANGLES.map(|angle| f64::from(angle).cos());
                let steepness = if matches!(light, Light::Spot { .. }) { 1.5 / (begin - end) } else { 1.0 };
                for channel in 0..3 {
                    let intensity = f64::from(INTENSITY[channel]);
                    prop_assert!((double[channel] - intensity * factor).abs() <= 1e-5 * intensity * most);
                    let bound = UNIT * (14.0 * (1.0 + steepness) + 46.0) * intensity * most;
                    prop_assert!((f64::from(single[channel]) - double[channel]).abs() <= bound);
                }
            }
        }

        /// The window subtracts I/r²·(2s − s³), where s is (d/r)², which is largest at s = √(2/3).
        #[test]
        fn the_window_subtracts_little_within_the_range_for_an_intensity(share in 1e-3..1.0_f64, intensity in 0.1..1e3_f32) {
            let range = Light::range_for(Vec3::splat(intensity));
            let light = Light::Point { position: DVec3::ZERO, intensity: Vec3::splat(intensity), range, casts_shadow: false };
            let distance = share * f64::from(range);
            let position = Vector([0.0, 0.0, distance]);
            let found = illuminance_from(&light_values(&light, None), position, Vector([0.0, 0.0, -1.0]))[0];
            let taken = f64::from(intensity) / distance.powi(2) - found;
            let bound = 4.0 / 3.0 * (2.0 / 3.0_f64).sqrt() / 256.0;
            prop_assert!((-1e-6..=bound * (1.0 + 1e-6)).contains(&taken), "{taken} {bound}");
        }
    }

    #[test]
    fn degenerate_lights_are_dark_and_bright_ones_are_finite() {
        for light in lights(2.0).iter().skip(1) {
            let light = light_values::<f32>(light, None);
            let up = Vector([0.0, 1.0, 0.0]);
            assert_eq!(illuminance_from(&light, light.position, up), Vector::zero(), "on the light itself");
            assert_eq!(illuminance_from(&light, Vector::splat(1e30), up), Vector::zero());
            let mut bright = light;
            bright.intensity = Vector::splat(f32::MAX);
            bright.position = Vector::zero();
            let axis = Vector([0.48, -0.6, 0.64]);
            let close = illuminance_from(&bright, axis * 1e-18, -axis);
            assert_eq!(close, Vector::splat(1e30));
        }
        let mut sudden = light_values::<f32>(&lights(2.0)[2], None);
        sudden.cone_end = sudden.cone_begin;
        let edge = illuminance_from(&sudden, sudden.position + sudden.direction, -sudden.direction);
        assert!(edge[0] > 0.0);
    }
}
