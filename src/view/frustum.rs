//! What a camera sees, as planes that never cull what it does see.

use glam::{DVec3, Vec3};

use crate::scene::Camera;

/// The pyramid that a camera sees, from its near plane to infinity.
///
/// The planes are relative to the camera, so that a place far from the world's origin costs no precision: the only
/// subtraction of large numbers, centre − camera, is done in f64.
#[derive(Clone, Debug, PartialEq)]
pub struct Frustum {
    origin: DVec3,
    /// Inward normals of the left, right, lower and upper plane, which all pass through the camera.
    sides: [Vec3; 4],
    forward: Vec3,
    near: f32,
}

impl Frustum {
    /// The pyramid of `camera`.
    pub fn new(camera: &Camera) -> Self {
        let orientation = camera.orientation.as_dquat().normalize();
        let tangent_y = (f64::from(camera.field_of_view) * 0.5).tan();
        let tangent_x = tangent_y * f64::from(camera.size[0]) / f64::from(camera.size[1]);
        let side = |normal: DVec3| (orientation * normal.normalize()).as_vec3();
        Self {
            origin: camera.position,
            sides: [
                side(DVec3::new(1.0, 0.0, -tangent_x)),
                side(DVec3::new(-1.0, 0.0, -tangent_x)),
                side(DVec3::new(0.0, 1.0, -tangent_y)),
                side(DVec3::new(0.0, -1.0, -tangent_y)),
            ],
            forward: (orientation * DVec3::NEG_Z).as_vec3(),
            near: camera.near,
        }
    }

    /// Whether any of a sphere may be seen: never `false` for one that is, sometimes `true` for one just outside.
    ///
    /// A plane's distance n·c is computed in f32 with n and c rounded to it. Each of the three products carries at most
    /// four roundings of u = 2⁻²⁴ (n, c, the product, the sums), so the distance is off by no more than 4u(‖c‖₁ + r) to
    /// first order; twice that is allowed for. The bound is made of magnitudes from before any cancellation.
    pub fn may_see(&self, center: DVec3, radius: f32) -> bool {
        let center = (center - self.origin).as_vec3();
        let magnitude = center.x.abs() + center.y.abs() + center.z.abs() + radius + self.near;
        let reach = radius + 8.0 * UNIT_ROUNDOFF * magnitude;
        let beyond_near = self.forward.dot(center) - self.near >= -reach;
        beyond_near & self.sides.iter().all(|side| side.dot(center) >= -reach)
    }
}

const UNIT_ROUNDOFF: f32 = f32::EPSILON / 2.0;

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use glam::Quat;
    use proptest::prelude::*;

    use super::*;

    /// How far the sphere's centre is inside the nearest plane, in f64, from the camera's own definition.
    fn depth_inside(camera: &Camera, center: DVec3) -> f64 {
        let local = camera.orientation.as_dquat().normalize().inverse() * (center - camera.position);
        let half = f64::from(camera.field_of_view) * 0.5;
        let half_x = (half.tan() * f64::from(camera.size[0]) / f64::from(camera.size[1])).atan();
        let away = -local.z;
        [
            away - f64::from(camera.near),
            away * half_x.sin() + local.x * half_x.cos(),
            away * half_x.sin() - local.x * half_x.cos(),
            away * half.sin() + local.y * half.cos(),
            away * half.sin() - local.y * half.cos(),
        ]
        .into_iter()
        .fold(f64::INFINITY, f64::min)
    }

    prop_compose! {
        fn any_camera()(
            place in prop::array::uniform3(-1.0..1.0_f64),
            exponent in 0.0..9.0_f64,
            axis in prop::array::uniform3(-1.0..1.0_f32),
            angle in 0.0..std::f32::consts::TAU,
            degrees in 0.1..179.0_f32,
            width in 1_u32..4000,
            height in 1_u32..4000,
            near_exponent in -5.0..2.0_f32,
        ) -> Camera {
            let mut camera = Camera::looking_at("any", DVec3::from(place) * 10_f64.powf(exponent), DVec3::ZERO);
            camera.orientation = Quat::from_axis_angle(Vec3::from(axis).normalize_or(Vec3::X), angle);
            camera.field_of_view = degrees.to_radians();
            camera.size = [width, height];
            camera.near = 10_f32.powf(near_exponent);
            camera
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        /// Spheres are moved along the direction to the nearest plane until they all but touch it.
        #[test]
        fn a_sphere_that_is_seen_is_never_culled(
            camera in any_camera(),
            direction in prop::array::uniform3(-1.0..1.0_f64),
            exponent in -3.0..7.0_f64,
            radius_exponent in -6.0..7.0_f64,
            nudge in -1e-5..1e-5_f64,
        ) {
            let center = camera.position + DVec3::from(direction).normalize_or(DVec3::X) * 10_f64.powf(exponent);
            let depth = depth_inside(&camera, center);
            let tangent = if depth < 0.0 { -depth * (1.0 + nudge) } else { 10_f64.powf(radius_exponent) };
            let radius = tangent as f32;
            if depth >= -f64::from(radius) {
                prop_assert!(Frustum::new(&camera).may_see(center, radius), "depth {depth} radius {radius}");
            }
        }

        #[test]
        fn a_sphere_well_outside_is_culled(
            camera in any_camera(),
            direction in prop::array::uniform3(-1.0..1.0_f64),
            exponent in -3.0..7.0_f64,
        ) {
            let center = camera.position + DVec3::from(direction).normalize_or(DVec3::X) * 10_f64.powf(exponent);
            let depth = depth_inside(&camera, center);
            let slack = 4e-6 * ((center - camera.position).length() + f64::from(camera.near));
            if depth < -slack {
                let radius = (-depth - slack) as f32;
                prop_assert!(!Frustum::new(&camera).may_see(center, radius), "depth {depth} radius {radius}");
            }
        }
    }

    #[test]
    fn what_is_not_a_number_is_not_seen() {
        let camera = Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z);
        let frustum = Frustum::new(&camera);
        assert!(frustum.may_see(DVec3::NEG_Z * 5.0, 1.0));
        assert!(!frustum.may_see(DVec3::NEG_Z * f64::NAN, 1.0));
        assert!(!frustum.may_see(DVec3::NEG_Z * 5.0, f32::NEG_INFINITY));
    }
}
