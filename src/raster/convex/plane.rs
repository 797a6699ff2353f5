//! Planes.

use glam::DVec3;

/// A plane with an outer side: what is inside is at `normal · place ≤ offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Outwards, of unit length.
    pub normal: DVec3,
    /// In metres.
    pub offset: f64,
}

impl Plane {
    /// How far a place is outside, in metres; negative inside.
    pub fn signed_distance(&self, place: DVec3) -> f64 {
        self.normal.dot(place) - self.offset
    }
}
