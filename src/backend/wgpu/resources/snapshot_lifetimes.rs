//! When the device's memory may be written again.

use std::sync::{Arc, Weak};

/// Lives as long as something may read what a snapshot refers to: a recorded frame that is not submitted yet, for
/// example.
pub(crate) struct SnapshotToken {
    number: u64,
}

impl SnapshotToken {
    /// A number that no other snapshot of the same cache has.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }
}

/// The latest snapshot that may read a resource: once it is gone, the resource may be written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct LastReader(u64);

/// Resources that snapshots refer to, and that the next snapshot will not have: each is free once no snapshot is alive
/// that may refer to it.
///
/// Writes to the device are ordered by submissions. What is written after the last of these frames was submitted does
/// not reach it, and what is written before it was submitted would.
pub(crate) struct SnapshotLifetimes<T> {
    /// Those that may be alive, the oldest first.
    snapshots: Vec<Weak<SnapshotToken>>,
    latest: u64,
    /// Each with the number of the latest snapshot that may refer to it.
    retired: Vec<(u64, T)>,
}

impl<T> Default for SnapshotLifetimes<T> {
    fn default() -> Self {
        Self { snapshots: Vec::new(), latest: 0, retired: Vec::new() }
    }
}

impl<T> SnapshotLifetimes<T> {
    /// For other resources than those before, with further numbers for snapshots.
    pub(super) fn following(before: &Self) -> Self {
        Self { latest: before.latest, ..Self::default() }
    }

    /// Begins the life of a snapshot that refers to nothing that was retired before.
    pub(super) fn begin_snapshot(&mut self) -> Arc<SnapshotToken> {
        self.latest += 1;
        let token = Arc::new(SnapshotToken { number: self.latest });
        self.snapshots.push(Arc::downgrade(&token));
        token
    }

    /// Retires a resource: the snapshots to come do not refer to it.
    pub(super) fn retire(&mut self, resource: T) {
        self.retired.push((self.latest, resource));
    }

    /// The retired resources that no living snapshot refers to. They are no longer retired.
    pub(super) fn reclaim(&mut self) -> Vec<T> {
        if self.retired.is_empty() && self.snapshots.len() < 16 {
            return Vec::new();
        }
        self.snapshots.retain(|snapshot| snapshot.strong_count() > 0);
        let oldest = self.oldest();
        self.retired.extract_if(.., |(latest, _)| *latest < oldest).map(|(_, resource)| resource).collect()
    }

    /// The last reader of those retired resources that `is_written` says are about to be written.
    pub(super) fn last_reader(&self, is_written: impl Fn(&T) -> bool) -> LastReader {
        let readers = self.retired.iter().filter(|(_, resource)| is_written(resource));
        LastReader(readers.map(|(latest, _)| *latest).max().unwrap_or(0))
    }

    /// Whether a snapshot and all before it are gone.
    pub(super) fn is_gone(&self, LastReader(number): LastReader) -> bool {
        number == 0 || self.oldest() > number
    }

    /// The number of the oldest living snapshot; `u64::MAX` if none lives.
    fn oldest(&self) -> u64 {
        self.snapshots.iter().find_map(Weak::upgrade).map_or(u64::MAX, |oldest| oldest.number)
    }

    /// Drops retired resources that no snapshot refers to any more, because they were replaced by others.
    pub(super) fn forget_retired(&mut self, is_replaced: impl Fn(&T) -> bool) {
        self.retired.retain(|(_, resource)| !is_replaced(resource));
    }

    /// The resources that are retired.
    pub(super) fn retired(&self) -> impl Iterator<Item = &T> {
        self.retired.iter().map(|(_, resource)| resource)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resource_is_reclaimed_when_the_last_snapshot_that_may_refer_to_it_is_gone() {
        let mut lifetimes = SnapshotLifetimes::default();
        let first = lifetimes.begin_snapshot();
        lifetimes.retire("of the first");
        let second = lifetimes.begin_snapshot();
        lifetimes.retire("of both");
        assert!(lifetimes.reclaim().is_empty());
        drop(second);
        assert!(lifetimes.reclaim().is_empty(), "the first snapshot may refer to both");
        let third = lifetimes.begin_snapshot();
        lifetimes.retire("of the third");
        drop(first);
        assert_eq!(lifetimes.reclaim(), ["of the first", "of both"]);
        assert_eq!(lifetimes.retired().copied().collect::<Vec<_>>(), ["of the third"]);
        drop(third);
        assert_eq!(lifetimes.reclaim(), ["of the third"]);
    }

    #[test]
    fn what_is_retired_may_be_written_once_its_last_reader_is_gone() {
        let mut lifetimes = SnapshotLifetimes::default();
        let first = lifetimes.begin_snapshot();
        lifetimes.retire("of the first");
        let second = lifetimes.begin_snapshot();
        lifetimes.retire("of both");
        let [of_first, of_both, of_none] =
            ["of the first", "of both", "of none"].map(|name| lifetimes.last_reader(|retired| *retired == name));
        assert!(of_first < of_both && lifetimes.last_reader(|_| true) == of_both);
        let gone =
            |lifetimes: &SnapshotLifetimes<_>| [of_first, of_both, of_none].map(|reader| lifetimes.is_gone(reader));
        assert_eq!(gone(&lifetimes), [false, false, true]);
        drop(first);
        assert_eq!(gone(&lifetimes), [true, false, true]);
        drop(second);
        assert_eq!(gone(&lifetimes), [true, true, true]);
    }

    #[test]
    fn tokens_of_snapshots_that_are_gone_do_not_pile_up() {
        let mut lifetimes = SnapshotLifetimes::<u32>::default();
        for _ in 0..1000 {
            drop(lifetimes.begin_snapshot());
            assert!(lifetimes.reclaim().is_empty() && lifetimes.snapshots.len() <= 16);
        }
    }
}
