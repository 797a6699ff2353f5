//! What a camera sees, as planes that never cull what it does see.

use glam::{DVec3, Vec3};

use super::Spheres;
use crate::scene::{Camera, Projection, ViewKind};

/// What a camera sees: a pyramid, a box or half a ball, within six planes.
///
/// The planes are relative to the camera, so that a place far from the world's origin costs no precision: the only
/// subtraction of large numbers, centre − camera, is done in f64.
#[derive(Clone, Debug, PartialEq)]
pub struct Frustum {
    origin: DVec3,
    /// Those of the picture's four edges, then near, then far.
    planes: [Plane; 6],
}

/// A plane relative to the camera. What is at `normal · c + offset ≥ 0` is inside.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Plane {
    normal: Vec3,
    /// In metres, moved out by what is allowed for the rounding of itself; see [`Frustum::may_see`].
    offset: f32,
}

impl Plane {
    /// Everything is inside of it.
    const NOWHERE: Self = Self { normal: Vec3::ZERO, offset: f32::INFINITY };

    fn new(normal: Vec3, offset: f32) -> Self {
        Self { normal, offset: offset + ALLOWANCE * offset.abs() }
    }

    /// Whether any of a sphere of that reach may be inside.
    #[inline]
    fn may_hold(&self, [x, y, z]: [f32; 3], reach: f32) -> bool {
        self.normal.x * x + self.normal.y * y + self.normal.z * z + self.offset >= -reach
    }
}

/// How far a sphere relative to the camera reaches, with what is allowed for rounding.
#[inline]
fn reach([x, y, z]: [f32; 3], radius: f32) -> f32 {
    radius + ALLOWANCE * (x.abs() + y.abs() + z.abs() + radius)
}

impl Frustum {
    /// What `camera` sees.
    pub fn new(camera: &Camera) -> Self {
        let orientation = camera.orientation.as_dquat().normalize();
        let plane = |normal: DVec3, offset| Plane::new((orientation * normal.normalize()).as_vec3(), offset);
        let [width, height] = camera.size.map(f64::from);
        let near = plane(DVec3::NEG_Z, -camera.near);
        let far = if camera.far.is_finite() { plane(DVec3::Z, camera.far) } else { Plane::NOWHERE };
        // Offsets are rounded up, so that a plane is rather too far out.
        let between = |reach_x: f64, reach_y: f64| {
            [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y]
                .map(|normal| plane(normal, (normal.abs().dot(DVec3::new(reach_x, reach_y, 0.0)) as f32).next_up()))
        };
        let (edges, near) = match camera.projection {
            Projection::Perspective { field_of_view } => {
                let tangent_y = (f64::from(field_of_view) * 0.5).tan();
                let tangent_x = tangent_y * width / height;
                let edge = |x: f64, y: f64, tangent: f64| plane(DVec3::new(x, y, -tangent), 0.0);
                let right_and_left = [edge(1.0, 0.0, tangent_x), edge(-1.0, 0.0, tangent_x)];
                let up_and_down = [edge(0.0, 1.0, tangent_y), edge(0.0, -1.0, tangent_y)];
                ([right_and_left[0], right_and_left[1], up_and_down[0], up_and_down[1]], near)
            }
            Projection::Orthographic { height: picture } => {
                let half = f64::from(picture) * 0.5;
                // Into a shadow map, what is before the near plane casts its shadow too.
                let near = if camera.kind == ViewKind::Shadow { Plane::NOWHERE } else { near };
                (between(half * width / height, half), near)
            }
            Projection::Paraboloid => {
                let reach = f64::from(camera.far);
                // Who filters a shadow map at the disc's rim looks a few pixels past it.
                (between(reach, reach), plane(DVec3::NEG_Z, camera.far * PAST_THE_RIM))
            }
        };
        let [right, left, upper, lower] = edges;
        Self { origin: camera.position, planes: [right, left, upper, lower, near, far] }
    }

    /// Whether any of a sphere may be seen: never `false` for one that is, sometimes `true` for one just outside.
    ///
    /// A plane's distance n·c + o is computed in f32 with n, c and o rounded to it. Each of the three products carries at
    /// most four roundings of u = 2⁻²⁴ (n, c, the product, the sums), so the distance is off by no more than
    /// 4u(‖c‖₁ + r + |o|) to first order; twice that is allowed for, 8u(‖c‖₁ + r) in the sphere's reach and 8u|o| in the
    /// plane's offset. The bound is made of magnitudes from before any cancellation.
    pub fn may_see(&self, center: DVec3, radius: f32) -> bool {
        let center = (center - self.origin).as_vec3().to_array();
        let reach = reach(center, radius);
        self.planes.iter().all(|plane| plane.may_hold(center, reach))
    }

    /// The same for the [`Frustum::AT_ONCE`] spheres from `first` on: a bit each, from the lowest.
    ///
    /// # Panics
    /// If there are fewer.
    pub fn may_see_each(&self, spheres: &Spheres, first: usize) -> u64 {
        let entries = first..first + Self::AT_ONCE;
        // One loop a step, over arrays of a fixed length: such loops become vector instructions.
        let relative = |coordinates: &[f64], origin: f64| -> [f32; Self::AT_ONCE] {
            let mut relative = [0.0; Self::AT_ONCE];
            for (relative, coordinate) in relative.iter_mut().zip(coordinates) {
                *relative = (coordinate - origin) as f32;
            }
            relative
        };
        let [x, y, z] = spheres.coordinates();
        let x = relative(&x[entries.clone()], self.origin.x);
        let y = relative(&y[entries.clone()], self.origin.y);
        let z = relative(&z[entries.clone()], self.origin.z);
        let radii = &spheres.radii()[entries];
        let mut reaches = [0.0; Self::AT_ONCE];
        for (entry, reached) in reaches.iter_mut().enumerate() {
            *reached = reach([x[entry], y[entry], z[entry]], radii[entry]);
        }
        let mut seen = [u32::MAX; Self::AT_ONCE];
        for plane in &self.planes {
            for entry in 0..Self::AT_ONCE {
                let holds = plane.may_hold([x[entry], y[entry], z[entry]], reaches[entry]);
                seen[entry] &= u32::from(holds).wrapping_neg();
            }
        }
        (0..).zip(seen).fold(0, |bits, (entry, seen)| bits | u64::from(seen & 1) << entry)
    }

    /// How many spheres [`Frustum::may_see_each`] looks at.
    pub const AT_ONCE: usize = 64;
}

/// How far behind a paraboloid's camera is looked, as a share of its range.
const PAST_THE_RIM: f32 = 0.05;

/// 8 unit roundoffs, of 2⁻²⁴ each.
const ALLOWANCE: f32 = 8.0 * (f32::EPSILON / 2.0);

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use glam::Quat;
    use proptest::prelude::*;

    use super::*;
    use crate::view::WorldBounds;

    /// How far the sphere's centre is inside the nearest plane, in f64, from the camera's own definition.
    fn depth_inside(camera: &Camera, center: DVec3) -> f64 {
        let local = camera.orientation.as_dquat().normalize().inverse() * (center - camera.position);
        let away = -local.z;
        let aspect = f64::from(camera.size[0]) / f64::from(camera.size[1]);
        let (near, far) = (away - f64::from(camera.near), f64::from(camera.far) - away);
        let distances = match camera.projection {
            Projection::Perspective { field_of_view } => {
                let half = f64::from(field_of_view) * 0.5;
                let half_x = (half.tan() * aspect).atan();
                let edge = |aside: f64, half: f64| away * half.sin() - aside.abs() * half.cos();
                [near, far, edge(local.x, half_x), edge(local.y, half)]
            }
            Projection::Orthographic { height } => {
                let half = f64::from(height) * 0.5;
                let near = if camera.kind == ViewKind::Shadow { f64::INFINITY } else { near };
                [near, far, half * aspect - local.x.abs(), half - local.y.abs()]
            }
            // The planes hold half a ball; what counts is that none of it is outside of them.
            Projection::Paraboloid => [away, f64::from(camera.far) - local.length(), f64::INFINITY, f64::INFINITY],
        };
        distances.into_iter().fold(f64::INFINITY, f64::min)
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
            far_exponent in 0.001..6.0_f32,
            projection in 0_usize..4,
        ) -> Camera {
            let mut camera = Camera::looking_at("any", DVec3::from(place) * 10_f64.powf(exponent), DVec3::ZERO);
            camera.orientation = Quat::from_axis_angle(Vec3::from(axis).normalize_or(Vec3::X), angle);
            camera.size = [width, height];
            camera.near = 10_f32.powf(near_exponent);
            let perspective = Projection::Perspective { field_of_view: degrees.to_radians() };
            camera.projection = match projection {
                0 | 1 => perspective,
                2 => Projection::Orthographic { height: degrees * camera.near },
                _ => Projection::Paraboloid,
            };
            // One perspective in two sees for ever.
            if projection != 0 {
                camera.far = camera.near * 10_f32.powf(far_exponent);
            }
            camera.kind = if projection == 3 || width % 2 == 0 { ViewKind::Shadow } else { ViewKind::Main };
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
        fn spheres_are_seen_together_as_each_by_itself(
            camera in any_camera(),
            exponents in prop::collection::vec((-3.0..7.0_f64, -6.0..7.0_f32), Spheres::COUNT),
            turn in 0.0..1.0_f64,
        ) {
            let frustum = Frustum::new(&camera);
            let mut spheres = Spheres::default();
            for (entry, (distance, radius)) in exponents.into_iter().enumerate() {
                let (height, angle) = ((entry as f64 * 0.618 + turn).fract() * 2.0 - 1.0, entry as f64 * 2.4);
                let across = (1.0 - height * height).sqrt();
                let direction = DVec3::new(across * angle.cos(), height, across * angle.sin());
                let center = camera.position + direction * 10_f64.powf(distance);
                let bounds = match entry % 19 {
                    0 => WorldBounds::NOTHING,
                    1 => WorldBounds { center: DVec3::NAN, radius: 1.0 },
                    2 => WorldBounds { center, radius: f32::INFINITY },
                    _ => WorldBounds { center, radius: 10_f32.powf(radius) },
                };
                spheres.set(entry, bounds);
            }
            for first in [0, 64, 100, 192] {
                let together = frustum.may_see_each(&spheres, first);
                for entry in 0..Frustum::AT_ONCE {
                    let WorldBounds { center, radius } = spheres.get(first + entry);
                    prop_assert_eq!(together >> entry & 1 == 1, frustum.may_see(center, radius), "{} {}", center, radius);
                }
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
            let far = if camera.far.is_finite() { f64::from(camera.far) } else { 0.0 };
            let slack = 4e-6 * ((center - camera.position).length() + f64::from(camera.near) + far);
            if depth < -slack && camera.projection != Projection::Paraboloid {
                let radius = (-depth - slack) as f32;
                prop_assert!(!Frustum::new(&camera).may_see(center, radius), "depth {depth} radius {radius}");
            }
        }
    }

    #[test]
    fn a_paraboloid_leaves_out_what_is_behind_it_and_beyond_its_range() {
        let camera = Camera {
            projection: Projection::Paraboloid,
            far: 10.0,
            kind: ViewKind::Shadow,
            ..Camera::looking_at("lamp", DVec3::ZERO, DVec3::NEG_Y)
        };
        let frustum = Frustum::new(&camera);
        assert!(frustum.may_see(DVec3::new(9.0, -0.1, 0.0), 0.0));
        assert!(!frustum.may_see(DVec3::new(0.0, 2.0, 0.0), 1.0));
        assert!(!frustum.may_see(DVec3::new(0.0, -12.0, 0.0), 1.0));
        assert!(!frustum.may_see(DVec3::new(12.0, -1.0, 0.0), 1.0));
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
