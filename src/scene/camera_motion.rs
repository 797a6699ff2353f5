//! How far a camera may move after its view was recorded.

use std::time::Duration;

use glam::{DVec3, Quat};

/// How far a camera may move between the recording of a frame and its submission, so that
/// [`Recorded::replace_camera`](crate::Recorded::replace_camera) may replace it by a newer one: late latching.
///
/// The view draws all that any camera within these bounds sees: see [`Frustum`](crate::view::Frustum). It does not test for occlusion and
/// culls no triangles, and a directional light's shadow maps cover that much more. So the price grows with the bounds.
///
/// ```
/// use std::time::Duration;
///
/// use drawloom::glam::DVec3;
/// use drawloom::scene::{Camera, CameraMotion};
///
/// let mut camera = Camera::looking_at("main", DVec3::new(0.0, 1.7, 5.0), DVec3::ZERO);
/// // The player runs at 5 m/s at most and turns by half a turn a second, and a frame waits 16 ms until it is submitted.
/// let half_turn = std::f32::consts::PI;
/// camera.late_latch = Some(CameraMotion::from_speeds(5.0, half_turn, Duration::from_millis(16)));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraMotion {
    /// In metres, in any direction: from 0 to [`CameraMotion::MAX_DISTANCE`].
    pub distance: f32,
    /// In radians, about any axis through the camera: 0 or more. With π the camera may look anywhere.
    pub angle: f32,
}

impl CameraMotion {
    /// The largest [`CameraMotion::distance`]: 1,000 km.
    pub const MAX_DISTANCE: f32 = 1e6;

    /// The motion of a camera that moves by at most `linear_speed` metres and turns by at most `angular_speed` radians a second, in this
    /// time.
    pub fn from_speeds(linear_speed: f32, angular_speed: f32, time: Duration) -> Self {
        let seconds = time.as_secs_f32();
        Self { distance: linear_speed * seconds, angle: angular_speed * seconds }
    }

    /// The motion that leads from one camera to another: how far they are apart, and the smallest angle by which one turns into the other.
    /// Each is a position and an orientation.
    pub(crate) fn between(one: (DVec3, Quat), other: (DVec3, Quat)) -> PreciseMotion {
        let [from, to] = [one.1, other.1].map(|orientation| orientation.as_dquat().normalize());
        let turn = from.inverse() * to;
        let angle = 2.0 * DVec3::new(turn.x, turn.y, turn.z).length().atan2(turn.w.abs());
        PreciseMotion { distance: one.0.distance(other.0), angle }
    }

    /// The largest motion that is accepted, and that culling allows for. It exceeds these bounds by what orientations in f32, and positions
    /// in f64 at the end of the world, are rounded by, so that a camera on the bounds is within them.
    pub(crate) fn with_rounding(self) -> PreciseMotion {
        let PreciseMotion { distance, angle } = self.precise();
        PreciseMotion { distance: distance * (1.0 + ROUNDING) + ROUNDING, angle: angle + ROUNDING }
    }

    fn precise(self) -> PreciseMotion {
        PreciseMotion { distance: f64::from(self.distance), angle: f64::from(self.angle) }
    }

    /// These bounds, for a camera that is rigidly connected to one with them, at so many metres from it.
    pub(super) fn at_distance(self, metres: f32) -> Self {
        let Self { distance, angle } = self;
        Self { distance: distance + self.precise().moves_at(f64::from(metres)) as f32, angle }
    }

    /// What is wrong with it; `None` if nothing is.
    pub(super) fn problem(self) -> Option<&'static str> {
        if !(0.0..=Self::MAX_DISTANCE).contains(&self.distance) {
            Some("the distance of its late_latch is not from 0 to 1,000 km")
        } else if !(self.angle >= 0.0 && self.angle.is_finite()) {
            Some("the angle of its late_latch is negative or not finite")
        } else {
            None
        }
    }
}

/// A motion in metres and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PreciseMotion {
    pub(crate) distance: f64,
    pub(crate) angle: f64,
}

impl PreciseMotion {
    /// How far a point at this distance from the camera, and fixed to it, moves at most when the camera turns by the angle, in metres: the
    /// chord.
    pub(crate) fn moves_at(self, distance: f64) -> f64 {
        2.0 * (0.5 * self.angle.min(std::f64::consts::PI)).sin() * distance
    }
}

/// In metres, radians, and as a share of a distance.
const ROUNDING: f64 = 4e-6;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_times_time_are_a_distance_and_an_angle() {
        let motion = CameraMotion::from_speeds(5.0, 3.0, Duration::from_millis(500));
        assert_eq!(motion, CameraMotion { distance: 2.5, angle: 1.5 });
    }

    #[test]
    fn the_motion_between_cameras_is_the_shortest() {
        let one = (DVec3::new(1e9, 2.0, 3.0), Quat::from_rotation_y(2.0));
        for angle in [0.0, 1e-4, 0.5, 3.0_f32] {
            let turn = Quat::from_axis_angle(glam::Vec3::new(0.6, 0.0, 0.8), angle);
            // Both signs of a quaternion are one orientation.
            for sign in [1.0, -1.0] {
                let motion = CameraMotion::between(one, (one.0 + DVec3::Z * 4.0, one.1 * turn * sign));
                assert!((motion.distance - 4.0).abs() < 1e-6);
                assert!((motion.angle - f64::from(angle)).abs() < 1e-6, "{} is not {angle}", motion.angle);
            }
        }
    }
}
