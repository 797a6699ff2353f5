//! The plane that limits what a camera draws.

use glam::{DVec3, Vec3};

use super::transform::is_unit;

/// A plane in the world, such as a mirror's. A camera behind it, or in it, draws only what is in front of it; for a
/// camera in front of it, it clips nothing.
///
/// It becomes the near plane of the camera's frustum (Lengyel 2005, for a reversed depth without a far plane), in place
/// of [`Camera::near`](super::Camera::near), unless the whole part of it that the picture shows is nearer than that.
/// The device clips objects that are entirely behind the plane; the CPU does not cull them.
///
/// It costs depth precision, because depth changes across the picture, and devices move corners to multiples of 1/256
/// of a pixel. Take a camera D metres behind the plane, with a focal length of f pixels. At a distance of t metres,
/// depth then distinguishes surfaces that are t² ÷ (180 · f · D) apart: t² ÷ (170,000 · D) at 1080p and 60°. With an
/// ordinary near plane it distinguishes surfaces that are some millionths of t apart.
///
/// Precision limits how near the plane may be: D counts as at least a 16th of [`Camera::near`](super::Camera::near). A
/// camera that is nearer to the plane, such as one that goes through a portal, draws only what is farther away than
/// that.
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
