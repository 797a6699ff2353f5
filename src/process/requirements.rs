//! What a scene requires of a frame.

use crate::scene::{Blend, Camera, Light, Material, SceneRef, ViewKind};
use crate::view::LightClass;

/// What a frame knows of its scene before it has processes: see [`Pipeline::requirements`](super::Pipeline).
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct SceneContents<'a> {
    /// The lights that can be drawn, their ranges [cut off](crate::quality::Quality::light_cut_off).
    pub lights: &'a [Light],
    /// Whether the scene has an object that [needs transparency](Requirements::needs_transparency).
    pub transparency: bool,
    /// The cameras.
    pub cameras: &'a [Camera],
}

impl SceneContents<'_> {
    /// Those of a scene without anything.
    pub const EMPTY: Self = SceneContents { lights: &[], transparency: false, cameras: &[] };
}

/// What a scene requires of a frame. Frames with equal requirements have one plan: the same processes and targets.
///
/// The standard facts follow from what the scene draws: materials of the assets that no object has require nothing.
/// [`Self::with_own`] adds what only a pipeline of the engine's knows.
///
/// ```
/// use drawloom::process::{Requirements, SceneContents};
///
/// let nothing = Requirements::of(&SceneContents::EMPTY, true);
/// assert_eq!(nothing, Requirements::default());
/// assert_ne!(nothing.with_own(1), nothing);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Requirements {
    /// A bit for each class of lights, by [`LightClass::index`].
    lights: u32,
    transparency: bool,
    /// A bit for each kind of view that the scene has and might do without.
    optional_views: u8,
    shadow_maps: bool,
    own: u64,
}

const _: () = assert!(ViewKind::COUNT <= 8 && LightClass::COUNT <= u32::BITS as usize);

/// The bit of a kind of view that a scene may do without; 0 for other kinds.
fn optional_bit(kind: ViewKind) -> u8 {
    u8::from(kind.rules().is_optional) << kind as u8
}

impl Requirements {
    /// The standard facts of a scene. If `shadows` is false, lights count as casting none.
    pub fn of(scene: &SceneContents<'_>, shadows: bool) -> Self {
        let classes = scene.lights.iter().map(|light| LightClass::of(light, shadows));
        let requirements = Self { transparency: scene.transparency, ..Self::default() }.with_cameras(scene.cameras);
        classes.fold(requirements, Self::with_lights)
    }

    /// All standard facts.
    pub fn all() -> Self {
        let optional_views = ViewKind::ALL.into_iter().fold(0, |bits, kind| bits | optional_bit(kind));
        LightClass::all().fold(Self { transparency: true, optional_views, ..Self::default() }, Self::with_lights)
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

    /// The same with lights of a class. Lights that cast shadows require shadow maps.
    pub fn with_lights(self, class: LightClass) -> Self {
        let shadow_maps = self.shadow_maps || class.shadowed;
        Self { lights: self.lights | 1 << class.index(), shadow_maps, ..self }
    }

    /// The same without the lights of a class, and without shadow maps if no other class casts shadows.
    pub fn without_lights(self, class: LightClass) -> Self {
        let without = Self { lights: self.lights & !(1 << class.index()), ..self };
        Self { shadow_maps: if class.shadowed { without.shadows() } else { self.shadow_maps }, ..without }
    }

    /// The same with objects that need transparency.
    pub fn with_transparency(self) -> Self {
        Self { transparency: true, ..self }
    }

    /// The same with shadow maps, even if no light casts shadows.
    pub fn with_shadow_maps(self) -> Self {
        Self { shadow_maps: true, ..self }
    }

    /// The same with the views of these cameras.
    pub fn with_cameras(self, cameras: &[Camera]) -> Self {
        let bits = cameras.iter().fold(self.optional_views, |bits, camera| bits | optional_bit(camera.kind));
        Self { optional_views: bits, ..self }
    }

    /// The same with views of all kinds.
    pub(crate) fn with_all_views(self) -> Self {
        Self { optional_views: Self::all().optional_views, ..self }
    }

    /// The same with what only the engine's pipeline knows, as bits: each value has plans of its own, and what a pipeline
    /// [keeps](super::Pipeline::kept) adds its bits. A renderer keeps the
    /// [latest plans](crate::Renderer::MAX_PLANS) only, so that a value that never repeats costs time, but no memory.
    pub fn with_own(self, own: u64) -> Self {
        Self { own, ..self }
    }

    /// What either of two scenes requires; the bits of [`Self::own`] too.
    pub fn union(self, other: Self) -> Self {
        Self {
            lights: self.lights | other.lights,
            transparency: self.transparency || other.transparency,
            optional_views: self.optional_views | other.optional_views,
            shadow_maps: self.shadow_maps || other.shadow_maps,
            own: self.own | other.own,
        }
    }

    /// Whether a frame has processes for views of this kind. It has those for [`ViewKind::Reflection`] if the scene has
    /// such views, and for the other kinds always.
    pub fn has_views(&self, kind: ViewKind) -> bool {
        self.optional_views & optional_bit(kind) == optional_bit(kind)
    }

    /// Whether the scene has lights of this class.
    pub fn lights(&self, class: LightClass) -> bool {
        self.lights & 1 << class.index() != 0
    }

    /// Whether a light of the scene casts shadows.
    pub fn shadows(&self) -> bool {
        LightClass::all().any(|class| class.shadowed && self.lights(class))
    }

    /// Whether shadow maps are drawn: a light of the scene casts shadows, or they are drawn all the same.
    pub fn shadow_maps(&self) -> bool {
        self.shadow_maps
    }

    /// Whether an object needs transparency.
    pub fn transparency(&self) -> bool {
        self.transparency
    }

    /// What [`Self::with_own`] set; 0 before.
    pub fn own(&self) -> u64 {
        self.own
    }
}
