//! Which transforms can be drawn.

use glam::{DVec3, Quat, Vec3};

/// Whether the object's transform can be drawn: it is finite, and its orientation is a rotation.
pub(crate) fn transform_is_valid(position: DVec3, orientation: Quat, scale: Vec3) -> bool {
    position.is_finite() && scale.is_finite() && is_unit(orientation.length_squared())
}

/// Whether this is the squared length of a unit vector or quaternion, within a tolerance.
///
/// Repeated rotations in an engine's own arithmetic may drift by a thousandth. Users of the value normalise it first.
pub(crate) fn is_unit(length_squared: f32) -> bool {
    (length_squared - 1.0).abs() < 2e-3
}
