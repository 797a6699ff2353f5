//! How many workers run background jobs at once. The others stay free for frames.
//!
//! # Memory ordering
//!
//! A slot hands no data over: the queues do. So both numbers are relaxed. That no job is left waiting rests on the
//! fences of [`Sleep`](super::sleep::Sleep): see *Background slots* there.

use crate::sync::{AtomicUsize, Ordering};

/// The slots of a scheduler. A worker's thread takes one before it looks for background jobs, and keeps it until it
/// finds none or finds a frame's job.
pub(super) struct BackgroundSlots {
    limit: AtomicUsize,
    taken: AtomicUsize,
}

impl BackgroundSlots {
    /// A quarter of the workers, and at least one: with four workers or more, a frame that runs beside long background
    /// jobs takes a third longer at most.
    pub(super) fn new(workers: usize) -> Self {
        Self { limit: AtomicUsize::new((workers / 4).max(1)), taken: AtomicUsize::new(0) }
    }

    pub(super) fn limit(&self) -> usize {
        self.limit.load(Ordering::Relaxed)
    }

    /// Workers that hold a slot keep it, even beyond a lower limit.
    pub(super) fn set_limit(&self, limit: usize) {
        self.limit.store(limit, Ordering::Relaxed);
    }

    pub(super) fn is_free(&self) -> bool {
        self.taken.load(Ordering::Relaxed) < self.limit()
    }

    /// Takes a slot, if one is free.
    pub(super) fn try_take(&self) -> bool {
        let limit = self.limit();
        let take = |taken: usize| (taken < limit).then_some(taken + 1);
        self.taken.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take).is_ok()
    }

    /// Frees a slot that the caller has taken.
    pub(super) fn release(&self) {
        self.taken.fetch_sub(1, Ordering::Relaxed);
    }
}
