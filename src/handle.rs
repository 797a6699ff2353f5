//! Generational handles: how everything refers to a mesh, a material or an object without owning it (M 10.3,
//! "Device-Independent Resource Handles").

use std::any::type_name;
use std::fmt;
use std::hash::{Hash, Hasher};
use std::marker::PhantomData;
use std::sync::atomic::{AtomicU64, Ordering};

/// Refers to a `T` kept in [`Slots`]. Once that `T` is removed the handle is stale: using it is an error, never
/// another `T`.
pub struct Handle<T> {
    index: u32,
    generation: u32,
    /// Whose entry it is: the lower half of [`Slots::identity`].
    collection: u32,
    kind: PhantomData<fn() -> T>,
}

impl<T> Handle<T> {
    /// The slot. Slots are reused, so the index alone names a `T` only while the handle is not stale.
    pub fn index(self) -> u32 {
        self.index
    }

    fn stale(self) -> StaleHandle {
        let path = type_name::<T>();
        StaleHandle { kind: path.rsplit("::").next().unwrap_or(path), index: self.index, generation: self.generation }
    }
}

/// A handle whose referent was removed, or that belongs to another collection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stale {kind} handle: slot {index}, generation {generation}")]
pub struct StaleHandle {
    /// What the handle referred to: `Mesh`, `Material` ...
    pub kind: &'static str,
    /// Its slot.
    pub index: u32,
    /// Its generation.
    pub generation: u32,
}

/// A collection whose entries are reached by [`Handle`]. Entries keep their slot for life; a removed entry's slot is
/// reused with the next generation.
#[derive(Debug)]
pub struct Slots<T> {
    identity: u64,
    revision: u64,
    entries: Vec<Entry<T>>,
    free: Vec<u32>,
    length: usize,
}

impl<T> Slots<T> {
    /// An empty collection.
    pub fn new() -> Self {
        static NEXT_IDENTITY: AtomicU64 = AtomicU64::new(1);
        Self {
            // Only uniqueness matters, and nothing else is published through this counter.
            identity: NEXT_IDENTITY.fetch_add(1, Ordering::Relaxed),
            revision: 0,
            entries: Vec::new(),
            free: Vec::new(),
            length: 0,
        }
    }

    /// Adds an entry.
    ///
    /// # Panics
    /// Beyond `u32::MAX` entries.
    pub fn insert(&mut self, value: T) -> Handle<T> {
        self.revision += 1;
        self.length += 1;
        let revision = self.revision;
        let index = self.free.pop().unwrap_or_else(|| {
            let index = u32::try_from(self.entries.len()).expect("more than u32::MAX entries");
            self.entries.push(Entry { generation: 0, revision, value: None });
            index
        });
        let entry = &mut self.entries[index as usize];
        entry.revision = revision;
        entry.value = Some(value);
        let generation = entry.generation;
        self.handle(index, generation)
    }

    /// Takes an entry out; its handle is stale from here on.
    ///
    /// # Errors
    /// If the handle is stale already.
    pub fn remove(&mut self, handle: Handle<T>) -> Result<T, StaleHandle> {
        self.get(handle)?;
        let entry = &mut self.entries[handle.index as usize];
        let value = entry.value.take().ok_or_else(|| handle.stale())?;
        self.revision += 1;
        self.length -= 1;
        entry.revision = self.revision;
        // A slot that ran out of generations is retired, so that no stale handle ever becomes valid again.
        if let Some(next) = entry.generation.checked_add(1) {
            entry.generation = next;
            self.free.push(handle.index);
        }
        Ok(value)
    }

    /// The entry.
    ///
    /// # Errors
    /// If the handle is stale.
    pub fn get(&self, handle: Handle<T>) -> Result<&T, StaleHandle> {
        self.entries
            .get(handle.index as usize)
            .filter(|entry| self.belongs(handle) && entry.generation == handle.generation)
            .and_then(|entry| entry.value.as_ref())
            .ok_or_else(|| handle.stale())
    }

    /// The entry, to change; this counts as a change for [`Slots::revision`].
    ///
    /// # Errors
    /// If the handle is stale.
    pub fn get_mut(&mut self, handle: Handle<T>) -> Result<&mut T, StaleHandle> {
        self.get(handle)?;
        self.revision += 1;
        let entry = &mut self.entries[handle.index as usize];
        entry.revision = self.revision;
        entry.value.as_mut().ok_or_else(|| handle.stale())
    }

    /// The number of entries.
    pub fn len(&self) -> usize {
        self.length
    }

    /// Whether there is no entry.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One more than the highest slot in use so far: the length of an array indexed by [`Handle::index`].
    pub fn slot_count(&self) -> usize {
        self.entries.len()
    }

    /// The entries in slot order.
    pub fn iter(&self) -> impl Iterator<Item = (Handle<T>, &T)> {
        self.iter_revised().map(|(handle, _, value)| (handle, value))
    }

    /// The entries in slot order, each with the revision at which it last changed.
    pub fn iter_revised(&self) -> impl Iterator<Item = (Handle<T>, u64, &T)> {
        self.entries.iter().enumerate().filter_map(|(index, entry)| {
            let handle = self.handle(index as u32, entry.generation);
            entry.value.as_ref().map(|value| (handle, entry.revision, value))
        })
    }

    /// The entry in a slot, with the revision at which it last changed.
    pub fn revised_at(&self, slot: u32) -> Option<(u64, &T)> {
        let entry = self.entries.get(slot as usize)?;
        entry.value.as_ref().map(|value| (entry.revision, value))
    }

    /// A number that no other collection of this process has, so that a cache knows whose entries it holds.
    pub fn identity(&self) -> u64 {
        self.identity
    }

    /// Grows whenever an entry is added, changed or removed.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    fn handle(&self, index: u32, generation: u32) -> Handle<T> {
        Handle { index, generation, collection: self.identity as u32, kind: PhantomData }
    }

    fn belongs(&self, handle: Handle<T>) -> bool {
        handle.collection == self.identity as u32
    }
}

impl<T> Default for Slots<T> {
    fn default() -> Self {
        Self::new()
    }
}

#[derive(Debug)]
struct Entry<T> {
    generation: u32,
    revision: u64,
    value: Option<T>,
}

// Written by hand because derives would ask the same of `T`, which a handle does not hold.
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

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    #[test]
    fn a_removed_entry_leaves_a_stale_handle_even_when_its_slot_is_reused() {
        let mut names = Slots::new();
        let first = names.insert(String::from("first"));
        assert_eq!(names.remove(first), Ok(String::from("first")));
        let second = names.insert(String::from("second"));
        assert_eq!(second.index(), first.index());
        assert_eq!(names.get(first), Err(StaleHandle { kind: "String", index: 0, generation: 0 }));
        let revision = names.revision();
        assert!(names.get_mut(first).is_err());
        assert_eq!(names.revision(), revision);
        assert!(names.remove(first).is_err());
        assert_eq!(names.get(second), Ok(&String::from("second")));
        assert_eq!((names.len(), names.slot_count()), (1, 1));
    }

    #[test]
    fn a_slot_without_generations_left_is_retired() {
        let mut numbers = Slots::new();
        let handle = numbers.insert(1);
        numbers.entries[0].generation = u32::MAX;
        let last = Handle { generation: u32::MAX, ..handle };
        assert_eq!(numbers.remove(last), Ok(1));
        assert_eq!(numbers.insert(2).index(), 1);
        assert!(numbers.get(last).is_err());
    }

    #[test]
    fn only_what_changed_has_a_new_revision() {
        let mut numbers = Slots::new();
        let (first, second) = (numbers.insert(1), numbers.insert(2));
        let before = numbers.revision();
        *numbers.get_mut(first).unwrap() = 10;
        let revisions: Vec<_> = numbers.iter_revised().map(|(handle, revision, _)| (handle, revision)).collect();
        assert!(revisions.iter().any(|&(handle, revision)| handle == first && revision > before));
        assert!(revisions.iter().any(|&(handle, revision)| handle == second && revision <= before));
    }

    #[test]
    fn a_handle_of_another_collection_is_no_panic() {
        let mut many = Slots::new();
        let handles: Vec<_> = (0..3).map(|number| many.insert(number)).collect();
        assert!(Slots::<i32>::new().get(handles[2]).is_err());
        let mut as_many = Slots::new();
        for number in 0..3 {
            as_many.insert(number);
        }
        assert!(as_many.get(handles[1]).is_err() && as_many.get_mut(handles[1]).is_err());
        assert!(as_many.remove(handles[1]).is_err());
        assert_eq!(as_many.len(), 3);
    }
}
