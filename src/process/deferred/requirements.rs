//! Which processes a scene requires.

use super::{LightClasses, LightVolumes, ShadowCasters, Transparency};
use crate::scene::{Blend, Camera, Light, Material, SceneRef, ShadowProjection, ViewKind};
use crate::view::LightClass;

/// What a scene requires of a frame. A frame has the processes that this requires, and no others. It follows from what
/// the scene draws: materials of the assets that no object has require nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Requirements {
    /// The classes of lights in the scene.
    lights: LightClasses,
    /// Whether an object needs transparency.
    transparency: bool,
    /// A bit for each kind of view that the scene has and might do without.
    optional_views: u8,
    /// Whether shadow maps are drawn even if no light casts shadows.
    shadow_maps: bool,
}

const _: () = assert!(ViewKind::COUNT <= 8);

/// Whether the lights of a class have paraboloid maps.
fn has_paraboloid_map(class: LightClass) -> bool {
    class.shadowed && class.kind.rules().maps == ShadowProjection::Paraboloid
}

/// The bit of a kind of view that a scene may do without; 0 for other kinds.
fn optional_bit(kind: ViewKind) -> u8 {
    u8::from(kind.rules().is_optional) << kind as u8
}

impl Requirements {
    /// What a scene with these valid lights requires, some of whose objects [need
    /// transparency](Self::needs_transparency) if `transparency` is true. If `shadows` is false, lights count as
    /// casting none.
    pub fn of(lights: &[Light], transparency: bool, shadows: bool) -> Self {
        let lights = lights.iter().map(|light| LightClass::of(light, shadows)).collect();
        let requirements = Self { lights, transparency, ..Self::default() };
        // A light that casts shadows requires the maps, so that equal plans have equal requirements.
        Self { shadow_maps: requirements.shadows(), ..requirements }
    }

    /// Whether objects with this material need transparency: it is blended, and of no material type. Objects with a
    /// material type are left to the process that reads it.
    pub fn needs_transparency(material: &Material) -> bool {
        material.blend != Blend::None && material.values.is_none()
    }

    /// Whether an object of the scene needs transparency. Looks at all objects; a renderer keeps a witness from frame
    /// to frame instead.
    pub(crate) fn any_needs_transparency(scene: &SceneRef<'_>) -> bool {
        scene.materials.iter().any(|material| scene.assets.get(*material).is_ok_and(Self::needs_transparency))
    }

    /// All that a scene can require.
    pub fn all() -> Self {
        let optional_views = ViewKind::ALL.into_iter().fold(0, |bits, kind| bits | optional_bit(kind));
        Self { lights: LightClass::all().collect(), transparency: true, optional_views, shadow_maps: true }
    }

    /// Requirements whose plans have every shader that a plan may have: transparency reads shadow maps or does not, and
    /// shadow casters are drawn in paraboloid maps too or are not.
    pub(crate) fn with_every_shader() -> [Self; 3] {
        let without = |is_absent: fn(LightClass) -> bool| {
            let lights = LightClass::all().filter(|class| !is_absent(*class)).collect();
            let requirements = Self { lights, ..Self::all() };
            Self { shadow_maps: requirements.shadows(), ..requirements }
        };
        [Self::all(), without(has_paraboloid_map), without(|class| class.shadowed)]
    }

    /// The same for a scene with these cameras.
    pub fn with_cameras(self, cameras: &[Camera]) -> Self {
        Self { optional_views: cameras.iter().fold(0, |bits, camera| bits | optional_bit(camera.kind)), ..self }
    }

    /// The requirements of a scene that needs exactly those optional processes whose names satisfy `is_kept`.
    pub(super) fn of_processes(is_kept: impl Fn(&str) -> bool) -> Self {
        let (transparency, shadow_maps) = (is_kept(Transparency::NAME), is_kept(ShadowCasters::NAME));
        let lights = LightClass::all().filter(|class| is_kept(&LightVolumes::name_of(*class))).collect();
        Self { lights, transparency, shadow_maps, ..Self::default() }
    }

    /// What either of two scenes requires. Each set of requirements is one value, so that it has one plan.
    pub(crate) fn union(self, other: Self) -> Self {
        let shadow_maps = self.shadow_maps() || other.shadow_maps();
        Self {
            lights: self.lights.union(other.lights),
            transparency: self.transparency || other.transparency,
            optional_views: self.optional_views | other.optional_views,
            shadow_maps,
        }
    }

    /// Whether the scene has views of kind [`ViewKind::Reflection`].
    pub fn reflections(&self) -> bool {
        self.has_views(ViewKind::Reflection)
    }

    /// Whether a frame has processes for views of this kind: kinds that are not optional have them in each frame.
    pub(crate) fn has_views(&self, kind: ViewKind) -> bool {
        self.optional_views & optional_bit(kind) == optional_bit(kind)
    }

    /// Whether the scene has lights of this class.
    pub fn lights(&self, class: LightClass) -> bool {
        self.lights.contains(class)
    }

    /// Whether a light of the scene casts shadows.
    pub fn shadows(&self) -> bool {
        LightClass::all().any(|class| class.shadowed && self.lights(class))
    }

    /// Whether a light of the scene casts shadows by a paraboloid map.
    pub(crate) fn paraboloid_maps(&self) -> bool {
        LightClass::all().any(|class| has_paraboloid_map(class) && self.lights(class))
    }

    /// Whether shadow maps are drawn: a light of the scene casts shadows, or the pipeline
    /// [keeps](super::Deferred::keep) their process.
    pub fn shadow_maps(&self) -> bool {
        self.shadow_maps || self.shadows()
    }

    /// Whether an object needs transparency.
    pub fn transparency(&self) -> bool {
        self.transparency
    }
}
