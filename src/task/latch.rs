//! The count of jobs a scope still waits for.
//!
//! # Memory ordering
//!
//! - `add` is relaxed. Whoever adds is counted itself, so the count is at least one before and after, and nobody can take
//!   the addition for a release. The job that was added reaches its worker through a deque or a lock, which order it.
//! - `finish` is a release: what a job did happens before its decrement. Every change of the count is a
//!   read-modify-write, so all decrements lie in one release sequence, and the one load that reads zero synchronises with
//!   every one of them, not only with the last.
//! - `is_released` is the acquire that closes the pair. After it returned true the waiter sees the effects of all jobs,
//!   the dropping of what they had captured included.
//!
//! The latch wakes nobody. The worker whose `finish` returned true does that, through [`Sleep`](super::sleep::Sleep), and
//! may find the scope gone by then: what it needs has to be reachable without the scope.

use crate::sync::{AtomicUsize, Ordering};

/// Counts outstanding jobs down to zero, where it stays: a released latch is not used again.
pub(super) struct Latch {
    outstanding: AtomicUsize,
}

impl Latch {
    /// A latch that waits for `outstanding` calls of [`finish`](Self::finish).
    pub(super) fn new(outstanding: usize) -> Self {
        Self { outstanding: AtomicUsize::new(outstanding) }
    }

    /// Waits for one more. Only for callers that are counted themselves and have not finished.
    pub(super) fn add(&self) {
        self.outstanding.fetch_add(1, Ordering::Relaxed);
    }

    /// Takes one off, and says whether it was the last.
    #[must_use = "whoever takes the last one off wakes the waiter"]
    pub(super) fn finish(&self) -> bool {
        self.outstanding.fetch_sub(1, Ordering::Release) == 1
    }

    /// Whether the last one has been taken off.
    pub(super) fn is_released(&self) -> bool {
        self.outstanding.load(Ordering::Acquire) == 0
    }
}
