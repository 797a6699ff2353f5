//! Cameras.

use glam::{DVec3, Quat, Vec3};

use super::SceneError;
use super::transform::is_unit;

/// A camera: it looks along its own −Z, +Y is up, +X to the right.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// What it is called in reports, and what its view is called.
    pub name: String,
    /// In the world, in metres.
    pub position: DVec3,
    /// From camera space to the world; of unit length.
    pub orientation: Quat,
    /// How places become places of the picture.
    pub projection: Projection,
    /// The distance from which on it sees, in metres, 1e-27 or more.
    pub near: f32,
    /// The distance up to which it sees, in metres. In perspective it may be infinite; there it leaves out objects that are
    /// farther away as a whole, and depth does not depend on it.
    pub far: f32,
    /// Width and height of the picture, in pixels.
    pub size: [u32; 2],
    /// What the picture is for; decides which processes draw it.
    pub kind: ViewKind,
}

/// How places become places of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Projection {
    /// Through one point: what is farther is smaller.
    Perspective {
        /// The angle between the picture's lower and upper edge, in radians, from a ten-thousandth of a degree to just below
        /// π.
        field_of_view: f32,
    },
    /// Along parallel rays: everything is as large as it is.
    ///
    /// In a [`ViewKind::Shadow`] picture, what is nearer than `near` is drawn as if it were just there: it casts its shadow
    /// from however far in front of the picture it is.
    Orthographic {
        /// The distance between the picture's lower and upper edge, in metres, 1e-6 or more.
        height: f32,
    },
    /// Everything that lies before the camera, as a mirror shaped like a paraboloid shows it: the half space becomes a disc
    /// as wide as the picture (Brabec et al. 2002; the shadow map of L 4.2.2). Straight edges are drawn straight although
    /// they should be curved, so meshes are subdivided as far as their angle wants it. For [`ViewKind::Shadow`] alone.
    Paraboloid,
}

/// What a view's picture is for (M listing 10.4). Where the graph leaves the order of two views open, the earlier kind
/// goes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ViewKind {
    /// What a light sees.
    Shadow,
    /// What a mirror, a portal or a screen in the scene shows.
    Reflection,
    /// What a person looks at.
    #[default]
    Main,
    /// A picture made of pictures.
    Post,
}

impl ViewKind {
    /// How many kinds there are.
    pub const COUNT: usize = 4;

    /// In small letters, as reports print it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Shadow => "shadow",
            Self::Reflection => "reflection",
            Self::Main => "main",
            Self::Post => "post",
        }
    }
}

impl Camera {
    /// A camera at `position` that looks at `target`, upright (+Y), with a vertical field of view of 60°, a near plane at
    /// 5 cm and a picture of 960 × 540 pixels.
    pub fn looking_at(name: impl Into<String>, position: DVec3, target: DVec3) -> Self {
        let forward = (target - position).normalize_or(DVec3::NEG_Z).as_vec3();
        // Straight up or down leaves no upright; any perpendicular will do then.
        let right = forward.cross(Vec3::Y).try_normalize().unwrap_or(Vec3::X);
        let axes = glam::Mat3::from_cols(right, right.cross(forward), -forward);
        Self {
            name: name.into(),
            position,
            orientation: Quat::from_mat3(&axes).normalize(),
            projection: Projection::Perspective { field_of_view: 60_f32.to_radians() },
            near: 0.05,
            far: f32::INFINITY,
            size: [960, 540],
            kind: ViewKind::Main,
        }
    }

    /// Width ÷ height of the picture.
    pub fn aspect(&self) -> f32 {
        self.size[0] as f32 / self.size[1] as f32
    }

    /// # Errors
    /// If a number is not finite or out of its range. A picture of 0 × 0 pixels is for the frame to refuse, since it is
    /// what a window reports while it is minimised.
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        let reason = if !self.position.is_finite() {
            "its position is not finite"
        } else if !is_unit(self.orientation.length_squared()) {
            "its orientation is not of unit length"
        } else if !(self.near > 0.0 && self.near.is_finite()) {
            "its near plane is not a positive distance"
        } else if self.near < NEAREST {
            "its near plane is nearer than 1e-27 m"
        } else if self.far.is_nan() || self.far <= self.near {
            "its far plane is not beyond its near plane"
        } else if let Some(reason) = self.projection_problem() {
            reason
        } else {
            return Ok(());
        };
        Err(SceneError::InvalidCamera { camera: self.name.clone(), reason })
    }

    fn projection_problem(&self) -> Option<&'static str> {
        let in_range = |value: f32, least: f32| value >= least && value.is_finite();
        match self.projection {
            Projection::Perspective { field_of_view } => (!in_range(field_of_view, NARROWEST)
                || field_of_view >= std::f32::consts::PI)
                .then_some("its field of view is not between 0.0001 and 180 degrees"),
            _ if self.far.is_infinite() => Some("without perspective its far plane must be finite"),
            Projection::Orthographic { height } => {
                (!in_range(height, LOWEST)).then_some("its height is not a distance of 1e-6 m or more")
            }
            Projection::Paraboloid => {
                (self.kind != ViewKind::Shadow).then_some("only what a light sees can be drawn as a paraboloid")
            }
        }
    }
}

/// The nearest near plane in metres. Depth is its distance over that of what is seen, and what is seen may be 1.5e10 m away, from
/// one end of the world's reach to the other: nearer than 2e-28 m, that leaves the range of f32, and nothing would be seen.
const NEAREST: f32 = 1e-27;

/// The lowest picture without perspective in metres: below, the steps of the places of objects, 2⁻³⁰ m, would be seen as steps of
/// whole pixels.
const LOWEST: f32 = 1e-6;

/// The narrowest field of view in radians: some 2 m at a million metres. Far below it the projection leaves the range of f32.
const NARROWEST: f32 = 1.7e-6;
