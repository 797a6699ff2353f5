//! The whole picture of which a camera draws a part.

use glam::{DVec3, Vec2};

use super::Projection;
use super::projection::MAX_SHIFT;

/// The picture of which a camera draws a [tile](super::Camera::tile) or a [jittered](super::Camera::jittered) copy: how
/// another camera of the same orientation sees it. Shadow maps of directional lights cover it, so that all parts of a
/// picture have the same shadows. What is no part of it, because the camera was changed since then, has maps of its
/// own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WholePicture {
    /// How positions are projected onto it.
    pub projection: Projection,
    /// Its [shift](super::Camera::shift), in halves of its own width and height.
    pub shift: Vec2,
    /// Where the camera is that sees it, in the world, in metres. In perspective, where all parts are seen from the
    /// same position, it makes no difference.
    pub position: DVec3,
}

impl WholePicture {
    /// What is wrong with it; `None` if nothing is.
    pub(super) fn problem(&self) -> Option<&'static str> {
        if !self.position.is_finite() {
            Some("the position of its whole picture is not finite")
        } else if !self.shift.is_finite() || self.shift.abs().max_element() > MAX_SHIFT {
            Some("the shift of its whole picture is not between -65536 and 65536")
        } else if !self.projection.is_in_range() {
            Some("the field of view or the height of its whole picture is out of range")
        } else {
            None
        }
    }
}
