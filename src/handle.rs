//! Generational handles: references to meshes, materials and objects without ownership (M 10.3, "Device-Independent
//! Resource Handles").

mod slots;

use std::any::type_name;
use std::fmt;
use std::hash::{Hash, Hasher};
use std::marker::PhantomData;

pub(crate) use slots::{SlotReserver, Slots};

/// A reference to a `T` in a collection. When that `T` is removed, the handle is stale: using it is an error, and never
/// returns another `T`.
pub struct Handle<T> {
    index: u32,
    generation: u32,
    /// The collection of the entry: the lower half of [`Slots::identity`].
    collection: u32,
    kind: PhantomData<fn() -> T>,
}

impl<T> Handle<T> {
    /// The index of the slot. Slots are reused, so an index alone identifies a `T` only until its handle is stale.
    pub fn index(self) -> u32 {
        self.index
    }

    fn stale(self) -> StaleHandle {
        let path = type_name::<T>();
        StaleHandle { kind: path.rsplit("::").next().unwrap_or(path), index: self.index, generation: self.generation }
    }
}

/// The error for a handle whose entry has been removed, or that belongs to another collection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stale {kind} handle: slot {index}, generation {generation}")]
pub struct StaleHandle {
    /// The type of the entry: `Mesh`, `Material` ...
    pub kind: &'static str,
    /// The index of the slot.
    pub index: u32,
    /// The generation of the handle.
    pub generation: u32,
}

// Implemented by hand: derives would require the traits of `T`, which a handle does not contain.
impl<T> Clone for Handle<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Handle<T> {}

impl<T> PartialEq for Handle<T> {
    fn eq(&self, other: &Self) -> bool {
        (self.index, self.generation, self.collection) == (other.index, other.generation, other.collection)
    }
}

impl<T> Eq for Handle<T> {}

impl<T> Hash for Handle<T> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        (self.index, self.generation, self.collection).hash(state);
    }
}

impl<T> fmt::Debug for Handle<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}v{}", self.index, self.generation)
    }
}
