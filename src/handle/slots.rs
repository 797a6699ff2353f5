//! The collection whose entries handles refer to.

use std::marker::PhantomData;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use parking_lot::Mutex;

use super::{Handle, StaleHandle};

/// A slot map: a collection whose entries are accessed by [`Handle`]. An entry keeps its slot until it is removed; the
/// slot is then reused with the next generation.
#[derive(Debug)]
pub struct Slots<T> {
    identity: u64,
    revision: u64,
    /// The number of reserved slots that were filled.
    arrivals: u64,
    /// All slots but those at the end that are reserved and not filled yet.
    entries: Vec<Entry<T>>,
    free: Arc<Mutex<FreeSlots>>,
}

/// The slots that can be handed out: on any thread, so that a handle can be made before its entry is there.
#[derive(Debug, Default)]
struct FreeSlots {
    /// Each with its next generation.
    slots: Vec<(u32, u32)>,
    /// The number of slots that were ever handed out.
    count: u32,
}

impl FreeSlots {
    /// The index and generation of a free slot, which is not free any more.
    ///
    /// # Panics
    /// If there are more than `u32::MAX` slots.
    fn take(&mut self) -> (u32, u32) {
        self.slots.pop().unwrap_or_else(|| {
            let index = self.count;
            self.count = index.checked_add(1).expect("more than u32::MAX entries");
            (index, 0)
        })
    }
}

/// Makes handles of [`Slots`] on any thread, before their entries are there.
#[derive(Debug)]
pub struct SlotReserver<T> {
    collection: u32,
    free: Arc<Mutex<FreeSlots>>,
    kind: PhantomData<fn() -> T>,
}

impl<T> SlotReserver<T> {
    /// Reserves a slot. It stays reserved until [`Slots::fill`] or [`Slots::release`].
    ///
    /// # Panics
    /// If there are more than `u32::MAX` slots.
    pub fn reserve(&self) -> Handle<T> {
        let (index, generation) = self.free.lock().take();
        Handle { index, generation, collection: self.collection, kind: PhantomData }
    }
}

impl<T> Slots<T> {
    /// An empty collection.
    pub fn new() -> Self {
        static NEXT_IDENTITY: AtomicU64 = AtomicU64::new(1);
        Self {
            // Relaxed: only uniqueness matters; the counter publishes no other data.
            identity: NEXT_IDENTITY.fetch_add(1, Ordering::Relaxed),
            revision: 0,
            arrivals: 0,
            entries: Vec::new(),
            free: Arc::default(),
        }
    }

    /// Adds an entry.
    ///
    /// # Panics
    /// If there are more than `u32::MAX` slots.
    pub fn insert(&mut self, value: T) -> Handle<T> {
        let (index, generation) = self.free.lock().take();
        self.store(index, value);
        self.handle(index, generation)
    }

    /// Makes handles on other threads.
    pub fn reserver(&self) -> SlotReserver<T> {
        SlotReserver { collection: self.identity as u32, free: Arc::clone(&self.free), kind: PhantomData }
    }

    /// Whether a handle was reserved, and its entry is not there yet.
    pub fn is_reserved(&self, handle: Handle<T>) -> bool {
        self.belongs(handle)
            && self
                .entries
                .get(handle.index as usize)
                .is_none_or(|entry| entry.generation == handle.generation && entry.value.is_none())
    }

    /// Adds the entry of a reserved handle.
    ///
    /// # Errors
    /// If the handle is not reserved any more.
    pub fn fill(&mut self, handle: Handle<T>, value: T) -> Result<(), StaleHandle> {
        if !self.is_reserved(handle) {
            return Err(handle.stale());
        }
        self.arrivals += 1;
        self.store(handle.index, value);
        Ok(())
    }

    /// Frees the slot of a reserved handle, which is stale then.
    ///
    /// # Errors
    /// If the handle is not reserved any more.
    pub fn release(&mut self, handle: Handle<T>) -> Result<(), StaleHandle> {
        if !self.is_reserved(handle) {
            return Err(handle.stale());
        }
        self.revision += 1;
        // What was described as yet to arrive is stale now.
        self.arrivals += 1;
        self.add_entries(handle.index);
        self.retire(handle.index);
        Ok(())
    }

    /// The number of reserved handles that were filled or released.
    pub fn arrivals(&self) -> u64 {
        self.arrivals
    }

    /// Adds entries up to that of a slot. Those that other threads have reserved meanwhile are empty.
    fn add_entries(&mut self, index: u32) {
        let revision = self.revision;
        while self.entries.len() <= index as usize {
            self.entries.push(Entry { generation: 0, revision, value: None });
        }
    }

    fn store(&mut self, index: u32, value: T) {
        self.revision += 1;
        self.add_entries(index);
        let entry = &mut self.entries[index as usize];
        entry.revision = self.revision;
        entry.value = Some(value);
    }

    /// Begins the next generation of an empty slot. A slot without generations left is retired: reusing it would make a
    /// stale handle valid again.
    fn retire(&mut self, index: u32) {
        let entry = &mut self.entries[index as usize];
        entry.revision = self.revision;
        entry.generation = entry.generation.saturating_add(1);
        if entry.generation < u32::MAX {
            self.free.lock().slots.push((index, entry.generation));
        }
    }

    /// Removes an entry. Its handle is then stale.
    ///
    /// # Errors
    /// If the handle is stale already.
    pub fn remove(&mut self, handle: Handle<T>) -> Result<T, StaleHandle> {
        self.get(handle)?;
        let entry = &mut self.entries[handle.index as usize];
        let value = entry.value.take().ok_or_else(|| handle.stale())?;
        self.revision += 1;
        self.retire(handle.index);
        Ok(value)
    }

    /// Returns an entry.
    ///
    /// # Errors
    /// If the handle is stale, or its entry is not there yet.
    pub fn get(&self, handle: Handle<T>) -> Result<&T, StaleHandle> {
        self.entries
            .get(handle.index as usize)
            .filter(|entry| self.belongs(handle) && entry.generation == handle.generation)
            .and_then(|entry| entry.value.as_ref())
            .ok_or_else(|| handle.stale())
    }

    /// Returns an entry for modification, which counts as a change for [`Slots::revision`].
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

    /// The number of slots ever used: the length of an array indexed by [`Handle::index`].
    pub fn slot_count(&self) -> usize {
        self.entries.len()
    }

    /// The entries in slot order.
    pub fn iter(&self) -> impl Iterator<Item = (Handle<T>, &T)> {
        self.iter_with_revision().map(|(handle, _, value)| (handle, value))
    }

    /// The entries in slot order, each with the revision of its last change.
    pub fn iter_with_revision(&self) -> impl Iterator<Item = (Handle<T>, u64, &T)> {
        self.entries.iter().enumerate().filter_map(|(index, entry)| {
            let handle = self.handle(index as u32, entry.generation);
            entry.value.as_ref().map(|value| (handle, entry.revision, value))
        })
    }

    /// The entry in a slot, with its handle and the revision of its last change.
    #[cfg(feature = "wgpu")]
    pub fn entry(&self, slot: u32) -> Option<(Handle<T>, u64, &T)> {
        let entry = self.entries.get(slot as usize)?;
        entry.value.as_ref().map(|value| (self.handle(slot, entry.generation), entry.revision, value))
    }

    /// The entry in a slot, with the revision of its last change.
    pub fn get_with_revision(&self, slot: u32) -> Option<(u64, &T)> {
        let entry = self.entries.get(slot as usize)?;
        entry.value.as_ref().map(|value| (entry.revision, value))
    }

    /// A number that is unique among the collections of the OS process. A cache identifies a collection by it.
    pub fn identity(&self) -> u64 {
        self.identity
    }

    /// A counter that grows whenever an entry is added, changed or removed.
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

#[cfg(test)]
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
        assert_eq!((names.iter().count(), names.slot_count()), (1, 1));
    }

    #[test]
    fn a_slot_without_generations_left_is_retired() {
        let mut numbers = Slots::new();
        let handle = numbers.insert(1);
        numbers.entries[0].generation = u32::MAX - 1;
        let last = Handle { generation: u32::MAX - 1, ..handle };
        assert_eq!(numbers.remove(last), Ok(1));
        assert_eq!(numbers.insert(2).index(), 1);
        assert!(numbers.get(last).is_err() && !numbers.is_reserved(last));
    }

    #[test]
    fn reserved_handles_are_filled_in_any_order_among_others() {
        let mut numbers = Slots::new();
        let first = numbers.insert(1);
        let reserver = numbers.reserver();
        let reserved: Vec<_> = std::thread::scope(|scope| {
            let threads: Vec<_> =
                (0..4).map(|_| scope.spawn(|| (0..50).map(|_| reserver.reserve()).collect::<Vec<_>>())).collect();
            threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect()
        });
        let inserted = numbers.insert(2);
        assert!(reserved.iter().all(|handle| numbers.is_reserved(*handle) && numbers.get(*handle).is_err()));
        assert!(!numbers.is_reserved(first) && !numbers.is_reserved(inserted));
        for (number, handle) in reserved.iter().enumerate().rev() {
            let outcome =
                if number % 3 == 0 { numbers.release(*handle) } else { numbers.fill(*handle, 10 + number as i32) };
            assert_eq!(outcome, Ok(()));
            assert!(!numbers.is_reserved(*handle));
            assert!(numbers.fill(*handle, 0).is_err() && numbers.release(*handle).is_err());
        }
        assert_eq!((numbers.get(first), numbers.get(inserted)), (Ok(&1), Ok(&2)));
        for (number, handle) in reserved.iter().enumerate() {
            assert_eq!(numbers.get(*handle).ok().copied(), (number % 3 != 0).then_some(10 + number as i32));
        }
        // Released slots are used again, by both kinds of handles.
        let again = reserver.reserve();
        assert!(reserved.iter().any(|handle| handle.index() == again.index()));
        assert_eq!(numbers.fill(again, 7), Ok(()));
        assert_eq!((numbers.get(again), numbers.iter().count()), (Ok(&7), 200 + 2 - 67 + 1));
        assert!(!Slots::<i32>::new().is_reserved(again), "of another collection");
    }

    #[test]
    fn only_a_changed_entry_has_a_new_revision() {
        let mut numbers = Slots::new();
        let (first, second) = (numbers.insert(1), numbers.insert(2));
        let before = numbers.revision();
        *numbers.get_mut(first).unwrap() = 10;
        let revisions: Vec<_> = numbers.iter_with_revision().map(|(handle, revision, _)| (handle, revision)).collect();
        assert!(revisions.iter().any(|&(handle, revision)| handle == first && revision > before));
        assert!(revisions.iter().any(|&(handle, revision)| handle == second && revision <= before));
    }

    #[test]
    fn a_handle_of_another_collection_is_stale() {
        let mut numbers = Slots::new();
        let handles: Vec<_> = (0..3).map(|number| numbers.insert(number)).collect();
        assert!(Slots::<i32>::new().get(handles[2]).is_err());
        let mut other = Slots::new();
        for number in 0..3 {
            other.insert(number);
        }
        assert!(other.get(handles[1]).is_err() && other.get_mut(handles[1]).is_err());
        assert!(other.remove(handles[1]).is_err());
        assert_eq!(other.iter().count(), 3);
    }
}
