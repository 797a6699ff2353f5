//! How cameras project positions.

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
}
