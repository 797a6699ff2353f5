//! Oriented planes.

use glam::DVec3;

/// An oriented plane: points with `normal · point ≤ offset` are inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// The outward unit normal.
    pub normal: DVec3,
    /// The distance from the origin along the normal, in metres.
    pub offset: f64,
}

impl Plane {
    /// The distance of a point in metres; negative inside.
    pub fn signed_distance(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }
}
