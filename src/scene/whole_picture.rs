//! The whole picture of which a camera draws a part.

use glam::{DVec3, Quat, Vec2};

use super::Projection;

/// The picture of which a camera draws a [tile](super::Camera::tile) or a [jittered](super::Camera::jittered) copy: how another camera of the
/// same orientation sees it. Shadow maps of directional lights cover it, so that all parts of a picture have the same shadows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WholePicture {
    /// How positions are projected onto it.
    pub projection: Projection,
    /// Its [shift](super::Camera::shift), in halves of its own width and height.
    pub shift: Vec2,
    /// From the position of the camera that draws a part to that of the one that sees it whole, to the right and up, in metres. 0 in perspective.
    pub aside: Vec2,
}

impl WholePicture {
    /// Where the camera is that sees it whole, given where one is that draws a part of it. It is rounded to the steps of fixed-point
    /// positions, so that it is the same for all parts although theirs were rounded.
    pub(crate) fn position(&self, of_part: DVec3, orientation: Quat) -> DVec3 {
        let position = of_part + orientation.as_dquat().normalize() * self.aside.as_dvec2().extend(0.0);
        (position * STEPS_PER_METRE).round() / STEPS_PER_METRE
    }

    /// Whether a camera with this projection may draw a part of it. One whose projection was changed since then may not.
    pub(super) fn contains(&self, projection: Projection) -> bool {
        let is_same_kind = std::mem::discriminant(&self.projection) == std::mem::discriminant(&projection);
        is_same_kind && projection.half_height() <= self.projection.half_height() * (1.0 + 1e-6)
    }
}

/// Positions are fixed point in steps of 2⁻³⁰ m.
const STEPS_PER_METRE: f64 = (1_u64 << 30) as f64;
