//! The plane that limits what a camera draws.

use glam::{DVec3, Vec3};

use super::transform::is_unit;

/// A plane in the world, such as a mirror's: what is behind it is not drawn.
///
/// It becomes the near plane of the camera's frustum (Lengyel 2005, for a reversed depth without a far plane). That costs depth
/// precision: for a camera D metres behind the plane, depth resolves D ÷ (16.8 million · t) of the distance at t metres, where an ordinary
/// near plane resolves a 16.8 millionth of it everywhere. The plane of a camera that is itself in front of it clips nothing. Objects
/// behind it are clipped by the device, and not culled before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipPlane {
    /// A point of the plane, in the world, in metres.
    pub point: DVec3,
    /// Towards what is drawn; of unit length.
    pub normal: Vec3,
}

impl ClipPlane {
    /// How far a point in the world is in front of the plane, in metres; negative behind it.
    pub fn distance(&self, point: DVec3) -> f64 {
        self.normal.as_dvec3().normalize().dot(point - self.point)
    }

    /// What is wrong with it; `None` if nothing is.
    pub(super) fn problem(&self) -> Option<&'static str> {
        if !self.point.is_finite() {
            Some("its clip plane's point is not finite")
        } else if !is_unit(self.normal.length_squared()) {
            Some("its clip plane's normal is not of unit length")
        } else {
            None
        }
    }
}
