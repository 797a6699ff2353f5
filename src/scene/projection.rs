//! How cameras project positions.

use std::f32::consts::PI;

/// How positions are projected onto the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Projection {
    /// Central projection.
    Perspective {
        /// The vertical field of view, in radians, from 0.0001° to just below π.
        field_of_view: f32,
    },
    /// Parallel projection.
    ///
    /// In a [`ViewKind::Shadow`](super::ViewKind::Shadow) view, depth is clamped to the near plane: an object in front
    /// of it still casts a shadow.
    Orthographic {
        /// The height of the view volume, in metres, 1e-6 or more.
        height: f32,
    },
    /// Paraboloid projection: the half space before the camera becomes a disc as wide as the picture (Brabec et al.
    /// 2002; the shadow map of L 4.2.2). Rasterised edges are straight although the projection curves them, so meshes
    /// are subdivided as far as the angle of their edges requires. Only for
    /// [`ViewKind::Shadow`](super::ViewKind::Shadow).
    Paraboloid,
}

impl Projection {
    /// Half the picture's height, in metres; in perspective at a distance of 1.
    pub(crate) fn half_height(self) -> f64 {
        match self {
            Self::Perspective { field_of_view } => (f64::from(field_of_view) * 0.5).tan(),
            Self::Orthographic { height } => f64::from(height) * 0.5,
            Self::Paraboloid => 1.0,
        }
    }

    /// Whether its field of view or its height is one that a camera can have.
    pub(super) fn is_in_range(self) -> bool {
        match self {
            Self::Perspective { field_of_view } => (MIN_FIELD_OF_VIEW..PI).contains(&field_of_view),
            Self::Orthographic { height } => height >= MIN_HEIGHT && height.is_finite(),
            Self::Paraboloid => true,
        }
    }
}

/// The largest shift: tiles of a picture of the largest size that are a pixel wide.
pub(super) const MAX_SHIFT: f32 = 65_536.0;

/// The smallest height of a parallel projection, in metres. Below it, the resolution of object positions, 2⁻³⁰ m, would
/// be larger than a pixel.
const MIN_HEIGHT: f32 = 1e-6;

/// The smallest field of view, in radians: some 2 m at a distance of 1,000 km. A much smaller one leaves the range of
/// f32.
pub(super) const MIN_FIELD_OF_VIEW: f32 = 1.7e-6;
