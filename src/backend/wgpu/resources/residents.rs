//! The assets of one kind on the device: which are there, which are missing, and which are on their way.

use std::collections::{BTreeSet, HashMap};
use std::mem;
use std::sync::Arc;

use super::snapshot_lifetimes::{LastReader, SnapshotLifetimes};
use crate::handle::{Handle, Slots};

/// The device's memory for the assets of one kind.
pub(crate) trait AssetMemory: Default {
    type Asset;
    type Location: Copy;

    /// Its size in bytes.
    fn bytes(&self) -> u64;

    /// Frees the memory at a location. Pages or arrays that are empty then stay.
    fn vacate(&mut self, location: Self::Location);

    /// Releases the pages or the array of a location if they are empty. What is retired may still be read.
    fn release_empty(&mut self, location: Self::Location, retired: &SnapshotLifetimes<Self::Location>);

    /// Drops all memory. What a snapshot refers to lives on with it.
    fn clear(&mut self);
}

/// The assets of one kind on the device.
///
/// Without streaming, nothing is ever on its way, and the memory of an asset that changed, or is gone, stays taken
/// until no snapshot refers to it. With streaming, an asset that changed stays until the new one arrives; and the
/// memory of one that is gone is free at once, for uploads that wait until no snapshot refers to it.
pub(crate) struct Residents<M: AssetMemory> {
    pub(super) memory: M,
    /// By slot.
    pub(super) slots: Vec<Option<Resident<M>>>,
    count: usize,
    /// The slots of those that were replaced in the assets since. Without streaming there are none.
    pub(super) outdated: BTreeSet<u32>,
    /// The slots of the assets that are used, and neither on the device, unchanged, nor on their way.
    missing: BTreeSet<u32>,
    /// The slots of the assets that jobs are uploading, each with its location.
    in_flight: HashMap<u32, M::Location>,
    /// The memory of those that are gone.
    pub(super) lifetimes: SnapshotLifetimes<M::Location>,
    /// Identifies the memory: another one after it was cleared.
    epoch: Arc<()>,
    /// Of the assets that the slots were compared with last.
    version: Option<AssetVersion>,
    /// Counts how often what is on the device, or is to be there, changed.
    changes: u64,
}

/// An asset on the device.
pub(super) struct Resident<M: AssetMemory> {
    handle: Handle<M::Asset>,
    /// In the assets.
    revision: u64,
    pub(super) location: M::Location,
}

/// An asset on its way to the device.
pub(crate) struct InFlight<T> {
    /// Which memory its location is in: that of a cache that was not cleared since.
    epoch: Arc<()>,
    pub(crate) handle: Handle<T>,
    /// In the assets.
    revision: u64,
}

/// What decides which assets are to be on the device.
#[derive(Clone, Copy, PartialEq, Eq)]
struct AssetVersion {
    identity: u64,
    revision: u64,
    /// The revision of the set of those that are used.
    used: u64,
}

/// Where something that is streamed will lie.
pub(crate) struct Placed<T> {
    pub(crate) target: T,
    /// It may be written to when that is gone.
    pub(crate) last_reader: LastReader,
}

/// Why something that is streamed has no room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unplaced {
    /// It will have as soon as what is on its way to the same texture array has arrived.
    Awaited,
    /// What could make room for it is not enough.
    Full,
    /// Its texture array has as many layers as the device allows, and none can make room.
    LayerLimit,
    /// It can never have any: the bytes that it takes, and the limit of this name with the bytes that it allows.
    TooLarge { bytes: u64, limit: &'static str, allowed: u64 },
}

/// What became of an upload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EndOfUpload {
    /// It is on the device.
    Resident,
    /// It is not needed any more, or could not be uploaded.
    Dropped,
    /// It belongs to what was cleared since.
    Stale,
}

impl<M: AssetMemory> Default for Residents<M> {
    fn default() -> Self {
        Self {
            memory: M::default(),
            slots: Vec::new(),
            count: 0,
            outdated: BTreeSet::new(),
            missing: BTreeSet::new(),
            in_flight: HashMap::new(),
            lifetimes: SnapshotLifetimes::default(),
            epoch: Arc::default(),
            version: None,
            changes: 0,
        }
    }
}

impl<M: AssetMemory> Residents<M> {
    /// Begins a frame: finds which assets changed, are gone or are missing, by the revision of the used ones and
    /// whether an asset in a slot is one of them. Returns `false` if the assets are those of the frame before.
    pub(super) fn begin_frame(
        &mut self,
        assets: &Slots<M::Asset>,
        (used, is_used): (u64, impl Fn(u32, &M::Asset) -> bool),
        is_streamed: bool,
    ) -> bool {
        self.release_unread(is_streamed);
        let version = AssetVersion { identity: assets.identity(), revision: assets.revision(), used };
        if self.version == Some(version) {
            return false;
        }
        if self.version.is_some_and(|before| before.identity != version.identity) {
            self.clear();
        }
        (self.version, self.changes) = (Some(version), self.changes + 1);
        self.slots.resize_with(assets.slot_count(), || None);
        let slots = 0..assets.slot_count() as u32;
        let used = |slot| assets.entry(slot).filter(|(.., asset)| is_used(slot, asset));
        for slot in slots.clone() {
            let Some(resident) = &self.slots[slot as usize] else { continue };
            match used(slot) {
                Some((_, revision, _)) if revision == resident.revision => {}
                Some((handle, ..)) if is_streamed && handle == resident.handle => {
                    self.outdated.insert(slot);
                }
                _ if is_streamed => self.take_off(slot),
                _ => self.retire(slot),
            }
        }
        self.missing = slots.filter(|slot| self.is_missing(*slot) && used(*slot).is_some()).collect();
        true
    }

    /// Releases the memory of what is gone, as soon as no frame in flight may read it.
    pub(super) fn release_unread(&mut self, is_streamed: bool) {
        for location in self.lifetimes.reclaim() {
            if !is_streamed {
                self.memory.vacate(location);
            }
            self.memory.release_empty(location, &self.lifetimes);
        }
    }

    /// Frees memory that no snapshot refers to.
    pub(super) fn free(&mut self, location: M::Location) {
        self.memory.vacate(location);
        self.memory.release_empty(location, &self.lifetimes);
    }

    /// Moves to new memory, in which nothing is.
    pub(super) fn clear(&mut self) {
        let mut memory = mem::take(&mut self.memory);
        memory.clear();
        let lifetimes = SnapshotLifetimes::following(&self.lifetimes);
        *self = Self { memory, lifetimes, changes: self.changes + 1, ..Self::default() };
    }

    /// Adds an asset that was written to its location, in place of one that was taken off.
    pub(super) fn add(&mut self, (handle, revision): (Handle<M::Asset>, u64), location: M::Location) {
        let slot = handle.index();
        self.missing.remove(&slot);
        (self.count, self.changes) = (self.count + 1, self.changes + 1);
        self.slots[slot as usize] = Some(Resident { handle, revision, location });
    }

    /// Takes an asset off the device. Its memory is free for uploads that wait until nothing reads it.
    pub(super) fn take_off(&mut self, slot: u32) {
        if let Some(location) = self.location(slot) {
            self.memory.vacate(location);
            self.retire(slot);
        }
    }

    /// Takes an asset off the device, but leaves its memory as it is.
    pub(super) fn retire(&mut self, slot: u32) {
        if let Some(resident) = self.slots.get_mut(slot as usize).and_then(Option::take) {
            self.lifetimes.retire(resident.location);
            (self.count, self.changes) = (self.count - 1, self.changes + 1);
            self.outdated.remove(&slot);
            // One that is being uploaded, in place of this version, is not missing.
            if !self.in_flight.contains_key(&slot) {
                self.missing.insert(slot);
            }
        }
    }

    /// Whether the slot has no asset that is on the device unchanged, or on its way.
    fn is_missing(&self, slot: u32) -> bool {
        let is_current = self.is_resident(slot) && !self.outdated.contains(&slot);
        !is_current && !self.in_flight.contains_key(&slot)
    }

    /// The assets that are used, and neither on the device, unchanged, nor on their way: with handle and revision.
    pub(crate) fn missing<'a>(
        &self,
        assets: &'a Slots<M::Asset>,
    ) -> impl Iterator<Item = (Handle<M::Asset>, u64, &'a M::Asset)> {
        self.missing.iter().filter_map(|slot| assets.entry(*slot))
    }

    /// The slots of the assets on the device.
    pub(crate) fn resident(&self) -> impl Iterator<Item = u32> {
        (0..).zip(&self.slots).filter(|(_, resident)| resident.is_some()).map(|(slot, _)| slot)
    }

    /// Whether an asset in a slot is on the device, be it the current one or one that it replaced.
    pub(crate) fn is_resident(&self, slot: u32) -> bool {
        self.location(slot).is_some()
    }

    /// The size of all memory in bytes.
    pub(crate) fn resident_bytes(&self) -> u64 {
        self.memory.bytes()
    }

    /// The number of assets on the device.
    pub(crate) fn resident_count(&self) -> usize {
        self.count
    }

    /// The location of the asset in a slot; `None` if it is not on the device.
    pub(crate) fn location(&self, slot: u32) -> Option<M::Location> {
        self.slots.get(slot as usize)?.as_ref().map(|resident| resident.location)
    }

    /// Whether what may be written once this reader is gone may be written now.
    pub(crate) fn is_gone(&self, last_reader: LastReader) -> bool {
        self.lifetimes.is_gone(last_reader)
    }

    /// A job is about to upload an asset to a location.
    pub(crate) fn begin_upload(
        &mut self,
        (handle, revision): (Handle<M::Asset>, u64),
        location: M::Location,
    ) -> InFlight<M::Asset> {
        self.in_flight.insert(handle.index(), location);
        self.missing.remove(&handle.index());
        InFlight { epoch: Arc::clone(&self.epoch), handle, revision }
    }

    /// A job has uploaded an asset, or could not. Nothing is drawn with an asset that is gone meanwhile, or not used
    /// any more; one that changed is drawn until the next one arrives.
    pub(crate) fn end_upload(
        &mut self,
        upload: &InFlight<M::Asset>,
        assets: &Slots<M::Asset>,
        is_used: impl Fn(u32, &M::Asset) -> bool,
        is_complete: bool,
    ) -> EndOfUpload {
        if !self.is_current(upload) {
            return EndOfUpload::Stale;
        }
        let (handle, revision) = (upload.handle, upload.revision);
        let slot = handle.index();
        let Some(location) = self.in_flight.remove(&slot) else { return EndOfUpload::Stale };
        let current = assets.entry(slot).filter(|(.., asset)| is_used(slot, asset));
        let before = self.slots.get(slot as usize).and_then(Option::as_ref);
        let is_newer = before.is_none_or(|before| before.handle != handle || before.revision < revision);
        let is_needed = is_complete && is_newer && current.is_some_and(|(current, ..)| current == handle);
        if is_needed {
            self.take_off(slot);
            self.add((handle, revision), location);
        } else {
            self.free(location);
        }
        if let Some((_, current, _)) = current {
            let resident = self.slots.get(slot as usize).and_then(Option::as_ref);
            if resident.is_some_and(|resident| resident.revision != current) {
                self.outdated.insert(slot);
            }
            if self.is_missing(slot) {
                self.missing.insert(slot);
            }
        }
        if is_needed { EndOfUpload::Resident } else { EndOfUpload::Dropped }
    }

    /// Where assets are on their way to.
    pub(crate) fn in_flight(&self) -> impl ExactSizeIterator<Item = M::Location> {
        self.in_flight.values().copied()
    }

    /// Whether an upload is to this memory.
    pub(crate) fn is_current(&self, upload: &InFlight<M::Asset>) -> bool {
        Arc::ptr_eq(&upload.epoch, &self.epoch)
    }

    /// Counts how often what is on the device, or is to be there, changed.
    pub(super) fn changes(&self) -> u64 {
        self.changes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Memory of cells, each of which holds a name.
    #[derive(Default)]
    struct Cells {
        taken: BTreeSet<u32>,
    }

    impl AssetMemory for Cells {
        type Asset = &'static str;
        type Location = u32;

        fn bytes(&self) -> u64 {
            self.taken.len() as u64
        }

        fn vacate(&mut self, cell: u32) {
            assert!(self.taken.remove(&cell), "cell {cell} is freed once");
        }

        fn release_empty(&mut self, _: u32, _: &SnapshotLifetimes<u32>) {}

        fn clear(&mut self) {
            self.taken.clear();
        }
    }

    struct Fixture {
        residents: Residents<Cells>,
        names: Slots<&'static str>,
        handles: [Handle<&'static str>; 2],
        is_streamed: bool,
    }

    impl Fixture {
        /// Two names, the one in slot 0 on the device in cell 0.
        fn new(is_streamed: bool) -> Self {
            let mut names = Slots::new();
            let handles = ["one", "two"].map(|name| names.insert(name));
            let mut fixture = Self { residents: Residents::default(), names, handles, is_streamed };
            assert!(fixture.begin_frame());
            fixture.residents.memory.taken.insert(0);
            let revision = fixture.names.entry(0).unwrap().1;
            fixture.residents.add((handles[0], revision), 0);
            fixture
        }

        /// Everything but "unused" is used.
        fn begin_frame(&mut self) -> bool {
            self.residents.begin_frame(&self.names, (0, |_, name: &&str| *name != "unused"), self.is_streamed)
        }

        fn missing(&self) -> Vec<&'static str> {
            self.residents.missing(&self.names).map(|(.., name)| *name).collect()
        }

        fn begin_upload(&mut self, slot: usize, cell: u32) -> InFlight<&'static str> {
            self.residents.memory.taken.insert(cell);
            let revision = self.names.entry(slot as u32).unwrap().1;
            self.residents.begin_upload((self.handles[slot], revision), cell)
        }

        fn end_upload(&mut self, upload: &InFlight<&'static str>) -> EndOfUpload {
            self.residents.end_upload(upload, &self.names, |_, _| true, true)
        }
    }

    #[test]
    fn only_what_changed_is_compared_and_what_is_not_used_is_taken_off() {
        for is_streamed in [false, true] {
            let mut fixture = Fixture::new(is_streamed);
            assert_eq!((fixture.begin_frame(), fixture.missing()), (false, vec!["two"]));
            *fixture.names.get_mut(fixture.handles[0]).unwrap() = "unused";
            assert_eq!((fixture.begin_frame(), fixture.missing()), (true, vec!["two"]));
            assert_eq!((fixture.residents.is_resident(0), fixture.residents.resident_count()), (false, 0));
            fixture.names = Slots::new();
            assert_eq!((fixture.begin_frame(), fixture.missing()), (true, vec![]));
        }
    }

    #[test]
    fn without_streaming_what_changed_is_missing_and_its_memory_is_free_when_no_snapshot_has_it() {
        let mut fixture = Fixture::new(false);
        let token = fixture.residents.lifetimes.begin_snapshot();
        *fixture.names.get_mut(fixture.handles[0]).unwrap() = "other";
        assert_eq!((fixture.begin_frame(), fixture.missing()), (true, vec!["other", "two"]));
        assert!(!fixture.residents.is_resident(0));
        assert_eq!(fixture.residents.resident_bytes(), 1, "a frame in flight may read it");
        drop(token);
        assert_eq!((fixture.begin_frame(), fixture.residents.resident_bytes()), (false, 0));
    }

    #[test]
    fn with_streaming_what_changed_stays_until_the_new_one_arrives() {
        let mut fixture = Fixture::new(true);
        let _token = fixture.residents.lifetimes.begin_snapshot();
        let early = fixture.begin_upload(1, 1);
        for name in ["other", "latest"] {
            *fixture.names.get_mut(fixture.handles[0]).unwrap() = name;
        }
        assert_eq!((fixture.begin_frame(), fixture.missing()), (true, vec!["latest"]));
        assert!(fixture.residents.is_resident(0) && fixture.residents.outdated.contains(&0));
        let upload = fixture.begin_upload(0, 2);
        assert_eq!((fixture.missing(), fixture.residents.in_flight().len()), (vec![], 2));
        assert_eq!(fixture.end_upload(&upload), EndOfUpload::Resident);
        assert_eq!((fixture.residents.location(0), fixture.residents.outdated.len()), (Some(2), 0));
        assert!(!fixture.residents.memory.taken.contains(&0), "its memory is free for what waits");
        // It changed on its way: it is drawn, and the next one is missing.
        *fixture.names.get_mut(fixture.handles[1]).unwrap() = "second";
        assert_eq!((fixture.begin_frame(), fixture.missing()), (true, vec![]));
        assert_eq!(fixture.end_upload(&early), EndOfUpload::Resident);
        assert_eq!((fixture.missing(), fixture.residents.outdated.contains(&1)), (vec!["second"], true));
    }

    #[test]
    fn an_upload_of_what_is_gone_is_dropped_and_one_to_memory_that_was_cleared_is_stale() {
        let mut fixture = Fixture::new(true);
        let upload = fixture.begin_upload(1, 1);
        fixture.names.remove(fixture.handles[1]).unwrap();
        fixture.begin_frame();
        assert_eq!(fixture.end_upload(&upload), EndOfUpload::Dropped);
        assert_eq!((fixture.missing(), fixture.residents.resident_bytes()), (vec![], 1));
        let upload = fixture.begin_upload(0, 1);
        fixture.residents.clear();
        fixture.begin_frame();
        let again = fixture.begin_upload(0, 0);
        assert_eq!(fixture.end_upload(&upload), EndOfUpload::Stale);
        assert_eq!(fixture.residents.in_flight().len(), 1, "the other one is still on its way");
        assert_eq!(fixture.end_upload(&again), EndOfUpload::Resident);
    }
}
