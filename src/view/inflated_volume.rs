//! What a camera sees that may still move: its frustum, inflated for late latching.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use crate::scene::{Camera, CameraMotion, PreciseMotion, Projection};

/// What a camera may see, wherever within its [`CameraMotion`] it is when the frame is submitted: a convex volume around the frusta of all
/// these cameras. Coordinates are along the axes of the recorded camera, to the right, up and forward, in metres.
///
/// # The bound
///
/// Let the recorded camera be at the origin, let d be the distance and a the angle of its motion, and v₁ … v₈ the corners of its frustum.
/// Another camera, displaced by δ with |δ| ≤ d and turned by R about an axis through itself, sees the hull of the points δ + R vᵢ. For any
/// normal n a half-space n · p + o ≥ 0 contains all of these hulls if o ≥ −n · δ − n · R vᵢ for all i, δ and R. The first term is at most
/// d |n|. A turn by at most a brings vᵢ, which is at an angle of θᵢ from n, at most to an angle of min(θᵢ + a, π), so −n · R vᵢ is at most
/// −|n| |vᵢ| cos min(θᵢ + a, π). So
///
/// o = d |n| + maxᵢ (−|n| |vᵢ| cos min(θᵢ + a, π))
///
/// is right for *any* n, and the least offset for that one. A far plane at infinity replaces four corners by rays: one for which the cosine
/// is negative makes o infinite, and the plane excludes nothing. This covers every case: a near plane that the camera's turn moves behind
/// its own position, parallel projection, where far corners sweep wide arcs, angles of 90° and more, and objects behind the camera, which
/// it may face after half a turn. A clip plane stays where it is in the world, the device alone applies it, and the near plane, which it
/// replaces, counts as being at the camera.
///
/// Only how much is kept depends on n. The near and far planes, and those of a parallel projection, keep theirs. If the side planes of a
/// perspective did, their offset would grow with the distance of the far corners. They are turned outwards instead, until no ray counts.
/// The one that is turned by α from the view direction, towards +X, has n = (−cos α, 0, sin α), and the ray through a corner (x, y, 1) is
/// at an angle of at most 90° − a from n if sin (α − atan x) ≥ sin a √((1 + x² + y²) ÷ (1 + x²)). The least α for which this holds at all
/// corners is taken. Where a corner's ray may turn to 90° from the view direction there is none, and the side planes keep their normals.
pub(super) struct InflatedVolume {
    corners: [DVec3; 8],
    /// Whether the last four are directions, as there is no far plane.
    is_endless: bool,
    motion: PreciseMotion,
    /// Of a perspective: the tangents of its side planes' angles from the view direction, of both pairs.
    tangents: [[f64; 2]; 2],
}

impl InflatedVolume {
    /// The volume of a camera. `half_extents` are those of its picture, in metres; in perspective at a distance of 1. The near plane is at a
    /// distance of `near`.
    pub(super) fn new(camera: &Camera, motion: CameraMotion, half_extents: [f64; 2], near: f64) -> Self {
        let motion = motion.with_rounding();
        let shift = camera.shift.as_dvec2().to_array();
        let ends: [[f64; 2]; 2] = [0, 1].map(|pair| [-1.0, 1.0].map(|end| half_extents[pair] * (shift[pair] + end)));
        let far = f64::from(camera.far);
        let is_perspective = matches!(camera.projection, Projection::Perspective { .. });
        let corner = |index: usize| DVec3::new(ends[0][index & 1], ends[1][index >> 1 & 1], 1.0);
        let at_depth = |index: usize, depth: f64| match is_perspective {
            true if depth.is_infinite() => corner(index),
            true => corner(index) * depth,
            false => corner(index).with_z(depth),
        };
        let corners = std::array::from_fn(|index| at_depth(index, if index < 4 { near } else { far }));
        let widened = |pair: usize, sign: f64| {
            let other_pair = &ends[1 - pair];
            let corners = ends[pair].iter().flat_map(|x| other_pair.iter().map(move |y| [x * sign, *y]));
            widened_angle(corners, motion.angle).map(|angle| sign * angle.tan())
        };
        let tangents = [0, 1].map(|pair| match [widened(pair, -1.0), widened(pair, 1.0)] {
            [Some(low), Some(high)] => [low, high],
            _ => ends[pair],
        });
        Self { corners, is_endless: far.is_infinite(), motion, tangents }
    }

    /// Of a perspective: half the extent and the middle of the volume at a distance of 1, along the axis of a pair of side planes.
    pub(super) fn half_and_middle(&self, pair: usize) -> [f64; 2] {
        let [low, high] = self.tangents[pair];
        [(high - low) * 0.5, (high + low) * 0.5]
    }

    /// The offset of the plane with an inward normal: the volume's points p have `normal · p + offset ≥ 0`. Infinite if no such plane
    /// bounds it.
    pub(super) fn offset(&self, normal: DVec3) -> f64 {
        let PreciseMotion { distance, angle } = self.motion;
        let lowest = |corner: DVec3| {
            let from_normal = normal.cross(corner).length().atan2(normal.dot(corner));
            (from_normal + angle).min(PI).cos() * corner.length() * normal.length()
        };
        let mut offset = f64::NEG_INFINITY;
        for (index, corner) in self.corners.into_iter().enumerate() {
            let outside = -lowest(corner);
            offset = offset.max(match self.is_endless && index >= 4 {
                true if outside > 0.0 => f64::INFINITY,
                true => f64::NEG_INFINITY,
                false => outside,
            });
        }
        offset + distance * normal.length()
    }
}

/// The angle from the view direction of the side plane towards +X, so that the rays through the corners (x, y, 1) stay inside of it when
/// they are turned by `angle`. `None` if it would be 90° or more.
fn widened_angle(corners: impl Iterator<Item = [f64; 2]>, angle: f64) -> Option<f64> {
    let sine = (angle + EXCESS).min(FRAC_PI_2).sin();
    let of_corner = |[x, y]: [f64; 2]| {
        let toward_x = x.hypot(1.0);
        // Above 1, the arcsine is NaN.
        x.atan() + (sine * (y.hypot(toward_x) / toward_x)).asin()
    };
    let mut widest = -FRAC_PI_2;
    for angle in corners.map(of_corner) {
        widest = if angle <= FRAC_PI_2 - EXCESS { widest.max(angle) } else { return None };
    }
    Some(widest)
}

/// By how much side planes are turned further than they have to, and how much less than 90° they are from the view direction at least, in
/// radians. So rounding does not move a ray outside.
const EXCESS: f64 = 1e-7;

#[cfg(test)]
mod tests {
    use glam::Quat;
    use proptest::prelude::*;

    use super::*;
    use crate::scene::ViewKind;
    use crate::view::Frustum;
    use crate::view::frustum::tests::any_camera;

    prop_compose! {
        /// A direction, and a share of an angle or a distance that is often all of it.
        fn any_step()(
            direction in prop::array::uniform3(-1.0..1.0_f64),
            share in prop_oneof![Just(1.0), 0.0..1.0_f64],
        ) -> (DVec3, f64) {
            (DVec3::from(direction).normalize_or(DVec3::X), share)
        }
    }

    fn any_motion() -> impl Strategy<Value = CameraMotion> {
        let angle = prop_oneof![Just(0.0), 0.0..0.2_f32, 0.0..3.3_f32, Just(std::f32::consts::FRAC_PI_2)];
        let distance = prop_oneof![Just(0.0), 0.0..1.0_f32, (-2.0..6.0_f32).prop_map(|exponent| 10_f32.powf(exponent))];
        (distance, angle).prop_map(|(distance, angle)| CameraMotion { distance, angle })
    }

    /// Latchable: a perspective or parallel camera that draws no shadow map.
    fn latchable(mut camera: Camera, motion: CameraMotion) -> Camera {
        if camera.projection == Projection::Paraboloid {
            camera.projection = Projection::Orthographic { height: camera.near * 3.0 };
        }
        Camera { kind: ViewKind::Main, late_latch: Some(motion), ..camera }
    }

    /// A camera within the motion.
    fn moved(camera: &Camera, motion: CameraMotion, step: (DVec3, f64), turn: (DVec3, f64)) -> Camera {
        let position = camera.position + step.0 * (step.1 * f64::from(motion.distance));
        let turn = Quat::from_axis_angle(turn.0.as_vec3().normalize(), motion.angle * turn.1 as f32);
        Camera { position, orientation: (turn * camera.orientation).normalize(), ..camera.clone() }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(5_000))]

        /// Each sphere touches a point that the moved camera sees.
        #[test]
        fn what_an_allowed_camera_sees_is_never_culled(
            camera in any_camera(),
            motion in any_motion(),
            (step, turn) in (any_step(), any_step()),
            picture in prop::array::uniform2(prop_oneof![-1.0..1.0_f64, Just(-1.0), Just(1.0)]),
            depth in prop_oneof![Just(0.0), Just(1.0), 0.0..1.0_f64],
            side in prop::array::uniform3(-1.0..1.0_f64),
            exponent in -4.0..4.0_f64,
        ) {
            let camera = latchable(camera, motion);
            let drawn = moved(&camera, motion, step, turn);
            let bounds = motion.with_rounding();
            let between = CameraMotion::between((camera.position, camera.orientation), (drawn.position, drawn.orientation));
            prop_assert!(between.distance <= bounds.distance && between.angle <= bounds.angle, "{between:?}");
            let (near, far) = (f64::from(drawn.near), f64::from(drawn.far));
            let far = if far.is_finite() { far } else { near * 10_f64.powf(1.0 + exponent.abs() * 2.0) };
            let away = near + (far - near) * depth.powi(4);
            let half = match drawn.projection {
                Projection::Perspective { field_of_view } => (f64::from(field_of_view) * 0.5).tan() * away,
                Projection::Orthographic { height } => f64::from(height) * 0.5,
                Projection::Paraboloid => unreachable!(),
            };
            let aspect = f64::from(drawn.size[0]) / f64::from(drawn.size[1]);
            let [x, y] = [0, 1].map(|pair| picture[pair] + f64::from(drawn.shift[pair]));
            let local = DVec3::new(x * half * aspect, y * half, -away);
            let point = drawn.position + drawn.orientation.as_dquat().normalize() * local;
            let radius = 10_f64.powf(exponent) as f32;
            let center = point + DVec3::from(side).normalize_or(DVec3::Y) * f64::from(radius) * (1.0 - 1e-6);
            prop_assert!(Frustum::new(&camera).intersects_sphere(center, radius), "{drawn:?} sees {center} {radius}");
        }

        /// The other side of the bound: without motion it is the frustum, to within what rounding takes.
        #[test]
        fn a_camera_that_may_hardly_move_keeps_hardly_more(
            camera in any_camera(),
            direction in prop::array::uniform3(-1.0..1.0_f64),
            exponent in 0.0..4.0_f64,
        ) {
            let latched = latchable(camera, CameraMotion::default());
            let exact = Camera { late_latch: None, ..latched.clone() };
            let offset = DVec3::from(direction).normalize_or(DVec3::X) * 10_f64.powf(exponent);
            let Projection::Perspective { field_of_view } = exact.projection else { return Ok(()) };
            let widest = (0.5 * field_of_view).tan() * (1.0 + exact.shift.abs().max_element()) * exact.aspect().max(1.0);
            if widest > 10.0 {
                return Ok(());
            }
            let radius = (1e-2 * offset.length()) as f32;
            let center = exact.position + offset;
            let [kept, needed] = [(&latched, radius), (&exact, radius * 1.2)]
                .map(|(camera, radius)| Frustum::new(camera).intersects_sphere(center, radius));
            prop_assert!(needed || !kept, "{center} is kept");
        }
    }

    #[test]
    fn a_runner_keeps_little_more_than_a_camera_at_rest() {
        let angle = std::f32::consts::PI * 0.016;
        let motion = CameraMotion { distance: 0.08, angle };
        let camera = Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z);
        let latched = Camera { late_latch: Some(motion), ..camera.clone() };
        let directions = || (0..1000).map(|step| (f64::from(step) - 500.0) * 0.0031);
        let seen = |camera: &Camera| {
            let frustum = Frustum::new(camera);
            let sees = |turn: &f64| frustum.intersects_sphere(DVec3::new(turn.sin(), 0.0, -turn.cos()) * 100.0, 0.1);
            directions().filter(sees).count() as f64 * 0.0031
        };
        // At the corners of the picture the angle is seen enlarged: here by 1.16, the secant of the vertical half-angle.
        let more = seen(&latched) - seen(&camera);
        assert!(more > 2.0 * f64::from(angle) && more < 2.6 * f64::from(angle), "{more} for {angle}");
    }

    /// Where the picture is off centre, one corner of the far plane is farther away than the others: here 36.7 m.
    #[test]
    fn the_farthest_corner_may_turn_into_the_view_direction() {
        let motion = CameraMotion { distance: 0.0, angle: 1.2 };
        for shift in [[-2.0, -2.0], [2.0, -2.0], [-2.0, 2.0], [2.0, 2.0]] {
            let camera = Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z);
            let camera =
                Camera { far: 10.0, size: [1600, 900], shift: shift.into(), late_latch: Some(motion), ..camera };
            let sees = |distance: f64| Frustum::new(&camera).intersects_sphere(DVec3::NEG_Z * distance, 0.1);
            assert!(sees(36.0) && !sees(38.0), "{shift:?}");
        }
    }

    #[test]
    fn a_camera_that_may_look_anywhere_culls_nothing_within_its_far_plane() {
        let motion = CameraMotion { distance: 1.0, angle: 4.0 };
        let camera = Camera { late_latch: Some(motion), ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z) };
        let nearby = Camera { far: 10.0, ..camera.clone() };
        let sees = |camera: &Camera, center: DVec3| Frustum::new(camera).intersects_sphere(center, 0.1);
        for axis in DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]) {
            assert!(sees(&camera, axis * 1e6));
            assert!(sees(&nearby, axis * 10.9) && !sees(&nearby, axis * 30.0), "{axis}");
        }
    }
}
