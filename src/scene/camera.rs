//! Cameras.

use glam::{DVec3, Quat, Vec3};

use super::SceneError;
use super::scene_ref::is_unit;

/// A perspective camera: it looks along its own −Z, +Y is up, +X to the right. Its far plane is infinitely far away.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// What it is called in reports, and what its view is called.
    pub name: String,
    /// In the world, in metres.
    pub position: DVec3,
    /// From camera space to the world; of unit length.
    pub orientation: Quat,
    /// The angle between the picture's lower and upper edge, in radians, from a ten-thousandth of a degree to just below π.
    pub field_of_view: f32,
    /// The distance of the near plane, in metres, above 0.
    pub near: f32,
    /// Width and height of the picture, in pixels.
    pub size: [u32; 2],
    /// What the picture is for; decides which processes draw it.
    pub kind: ViewKind,
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
            field_of_view: 60_f32.to_radians(),
            near: 0.05,
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
        } else if !(self.field_of_view >= NARROWEST && self.field_of_view < std::f32::consts::PI) {
            "its field of view is not between 0.0001 and 180 degrees"
        } else if !(self.near > 0.0 && self.near.is_finite()) {
            "its near plane is not a positive distance"
        } else {
            return Ok(());
        };
        Err(SceneError::InvalidCamera { camera: self.name.clone(), reason })
    }
}

/// The narrowest field of view in radians: some 2 m at a million metres. Far below it the projection leaves the range of f32.
const NARROWEST: f32 = 1.7e-6;
