//! Which objects a view shows, beside its layers.

use super::{MaterialPredicate, ObjectSet};

/// Which objects a camera's view shows, beside its [layers](super::Camera::layers): all, or those that a list and a
/// predicate on materials let pass.
///
/// It decides what is visible, for all processes of the view at once, as if the scene had no other objects: what it
/// leaves out hides nothing either, and is not among the [visible objects](crate::ViewStatistics::visible). A view that
/// shows no object is an empty picture, and no error. A filter costs only the view that has it.
///
/// Shadow maps are views of their own, and show what [`ShadowMaps::layers`](crate::view::ShadowMaps::layers) says,
/// whatever the filter of the view that they light. So an object that a camera leaves out still casts its shadow there,
/// as the player's own body does in the player's own view.
///
/// Cameras derived from another one ([`reflected`](super::Camera::reflected),
/// [`through_portal`](super::Camera::through_portal), [`tile`](super::Camera::tile)) inherit its filter; that of an
/// [impostor](super::Camera::impostor) does not.
///
/// ```
/// use drawloom::glam::{DVec3, Vec3};
/// use drawloom::scene::{Blend, Camera, ClipPlane, MaterialPredicate, ViewFilter, ObjectSet};
///
/// // The player's own head is at index 17, and the mirror leaves out glass.
/// let head = ObjectSet::new([17]);
/// let no_glass = MaterialPredicate::new(|material| material.blend == Blend::None);
/// let eyes = Camera::looking_at("main", DVec3::new(0.0, 1.7, 4.0), DVec3::ZERO);
/// let plane = ClipPlane { point: DVec3::ZERO, normal: Vec3::Z };
/// let mirror = Camera { filter: ViewFilter::ALL.of_materials(no_glass), ..eyes.reflected("mirror", plane) };
/// let eyes = Camera { filter: ViewFilter::except(head), ..eyes };
/// # assert_ne!(eyes.filter, mirror.filter);
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ViewFilter {
    /// By index.
    pub objects: FilteredObjects,
    /// By material: only objects whose material the predicate contains. `None` for all.
    pub materials: Option<MaterialPredicate>,
}

/// Which objects a list lets pass.
///
/// An index at which the scene has no object makes no difference to what is drawn. Each is counted once a frame as
/// [`IssueReason::UnknownObject`](crate::view::IssueReason::UnknownObject), since the list may be one of an
/// earlier scene.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum FilteredObjects {
    /// All.
    #[default]
    All,
    /// Only these.
    Only(ObjectSet),
    /// All but these.
    Except(ObjectSet),
}

impl ViewFilter {
    /// All objects.
    pub const ALL: Self = Self { objects: FilteredObjects::All, materials: None };

    /// Only some objects. Without any, the view is empty.
    pub const fn only(objects: ObjectSet) -> Self {
        Self { objects: FilteredObjects::Only(objects), materials: None }
    }

    /// All but some objects.
    pub const fn except(objects: ObjectSet) -> Self {
        Self { objects: FilteredObjects::Except(objects), materials: None }
    }

    /// Those of these objects whose material the predicate contains, which replaces the predicate before.
    pub fn of_materials(self, materials: MaterialPredicate) -> Self {
        Self { materials: Some(materials), ..self }
    }
}

impl FilteredObjects {
    /// The set that it is made of; `None` for all objects.
    pub fn set(&self) -> Option<&ObjectSet> {
        match self {
            Self::All => None,
            Self::Only(set) | Self::Except(set) => Some(set),
        }
    }

    /// A mask of the objects that pass among the 64 from `word` × 64 on.
    #[inline]
    pub(crate) fn mask(&self, word: usize) -> u64 {
        match self {
            Self::All => u64::MAX,
            Self::Only(set) => set.mask(word),
            Self::Except(set) => !set.mask(word),
        }
    }
}
