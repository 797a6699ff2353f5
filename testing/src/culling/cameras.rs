//! Random cameras, typical and extreme.

use drawloom::glam::{DVec3, Quat};
use drawloom::scene::{Camera, Projection, ViewKind};

use crate::random::Random;

/// A camera with random parameters from the whole range of valid values, often at its limits: fields of view from 0.1°
/// to 179°, pictures a hundred times as wide as high and the other way round, near planes from 1e-5 m, far planes up to
/// 1e9 m and at infinity, positions up to 4e9 m from the world's origin, perspective and orthographic, and shadow
/// views.
pub fn any_camera(random: &mut Random) -> Camera {
    let position = match random.below(4) {
        0 => DVec3::ZERO,
        _ => random.direction() * magnitude(random, 0.0, 9.6),
    };
    let mut camera = Camera::looking_at("any", position, DVec3::ZERO);
    camera.orientation = match random.below(8) {
        0 => Quat::IDENTITY,
        _ => Quat::from_axis_angle(random.direction().as_vec3().normalize(), random.between(-3.2, 3.2) as f32),
    };
    let wide = magnitude(random, 0.0, 2.0) as u32;
    camera.size = match random.below(3) {
        0 => [40 * wide, 40],
        1 => [40, 40 * wide],
        _ => [1_920, 1_080],
    };
    camera.near = magnitude(random, -5.0, 2.0) as f32;
    let far = match random.below(3) {
        0 => 1e9,
        _ => camera.near * magnitude(random, 0.001, 7.0) as f32,
    };
    let kind = random.below(10);
    // Half of the perspective cameras have no far plane.
    camera.far = if kind < 4 { f32::INFINITY } else { far };
    (camera.projection, camera.kind) = match kind {
        ..8 => {
            let degrees = match random.below(4) {
                0 => 0.1,
                1 => 179.0,
                2 => magnitude(random, -1.0, 2.25),
                _ => random.between(0.1, 179.0),
            };
            (Projection::Perspective { field_of_view: (degrees as f32).to_radians() }, ViewKind::Main)
        }
        8 => {
            let kind = if random.below(2) == 0 { ViewKind::Shadow } else { ViewKind::Main };
            (Projection::Orthographic { height: magnitude(random, -5.0, 7.0) as f32 }, kind)
        }
        _ => (Projection::Paraboloid, ViewKind::Shadow),
    };
    camera
}

/// A log-uniform number between two powers of ten.
pub fn magnitude(random: &mut Random, low: f64, high: f64) -> f64 {
    10_f64.powf(random.between(low, high))
}
