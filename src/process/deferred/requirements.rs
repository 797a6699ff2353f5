//! Which processes a scene requires.

use crate::scene::{Assets, Blend, Camera, Light, LightKind, Material, ViewKind};
use crate::view::LightClass;

/// What a scene requires of a frame. A frame has the processes that this requires, and no others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Requirements {
    /// A bit for each class of lights in the scene, by [`LightClass::index`].
    lights: u8,
    /// Whether a material is blended.
    transparency: bool,
    /// Whether a camera draws a reflection.
    reflections: bool,
}

const _: () = assert!(LightClass::COUNT <= 8);

impl Requirements {
    /// What a scene with these valid lights and assets requires. If `shadows` is false, lights count as casting none.
    pub fn of(lights: &[Light], assets: &Assets, shadows: bool) -> Self {
        let mut requirements = Self::default();
        for light in lights {
            requirements.lights |= 1 << LightClass::of(light, shadows).index();
        }
        let mut materials = assets.iter::<Material>();
        requirements.transparency =
            materials.any(|(_, material)| material.blend != Blend::None && material.values.is_none());
        requirements
    }

    /// All that a scene can require.
    pub fn all() -> Self {
        let mut requirements = Self { lights: 0, transparency: true, reflections: true };
        // Point lights cast no shadows.
        for class in LightClass::all().filter(|class| !class.shadowed || class.kind != LightKind::Point) {
            requirements.lights |= 1 << class.index();
        }
        requirements
    }

    /// The same for a scene with these cameras.
    pub fn with_cameras(self, cameras: &[Camera]) -> Self {
        Self { reflections: cameras.iter().any(|camera| camera.kind == ViewKind::Reflection), ..self }
    }

    /// Whether the scene has views of kind [`ViewKind::Reflection`].
    pub fn reflections(&self) -> bool {
        self.reflections
    }

    /// Whether the scene has lights of this class.
    pub fn lights(&self, class: LightClass) -> bool {
        self.lights & 1 << class.index() != 0
    }

    /// Whether a light of the scene casts shadows.
    pub fn shadows(&self) -> bool {
        LightClass::all().any(|class| class.shadowed && self.lights(class))
    }

    /// Whether a material is blended.
    pub fn transparency(&self) -> bool {
        self.transparency
    }
}
