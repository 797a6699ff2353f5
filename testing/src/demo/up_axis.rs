//! Which way is up.

use std::f32::consts::FRAC_PI_2;

use drawloom::glam::{DVec3, Quat};
use drawloom::scene::Camera;

/// The axis along which a scene is upright.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// +Y, as in most OBJ files and in glTF.
    #[default]
    Y,
    /// +Z, as in most programs for buildings, machines and maps.
    Z,
}

impl UpAxis {
    /// As [`Camera::looking_at`], with this axis up.
    pub fn looking_at(self, name: impl Into<String>, position: DVec3, target: DVec3) -> Camera {
        let camera = Camera::looking_at(name, self.to_y_up(position), self.to_y_up(target));
        Camera { position, orientation: self.rotation() * camera.orientation, ..camera }
    }

    /// A vector of the scene in coordinates with +Y up and the same x axis.
    pub(super) fn to_y_up(self, DVec3 { x, y, z }: DVec3) -> DVec3 {
        match self {
            Self::Y => DVec3::new(x, y, z),
            Self::Z => DVec3::new(x, z, -y),
        }
    }

    /// The inverse of [`Self::to_y_up`].
    pub(super) fn to_scene(self, DVec3 { x, y, z }: DVec3) -> DVec3 {
        match self {
            Self::Y => DVec3::new(x, y, z),
            Self::Z => DVec3::new(x, -z, y),
        }
    }

    /// The rotation of [`Self::to_scene`].
    fn rotation(self) -> Quat {
        match self {
            Self::Y => Quat::IDENTITY,
            Self::Z => Quat::from_rotation_x(FRAC_PI_2),
        }
    }
}
