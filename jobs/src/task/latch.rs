//! The number of jobs that a region still waits for.
//!
//! # Memory ordering
//!
//! - `add` is relaxed. Its caller is counted itself, so the count is at least one before and after, and nobody can take
//!   the addition for a release of the latch. A deque or a lock orders the added job before the worker that runs it.
//! - `finish` is a release: what the jobs did happens before their decrement. Every change of the count is a
//!   read-modify-write, so all decrements are in one release sequence, and the load that reads zero synchronises with
//!   each of them, not only with the last.
//! - `is_released` is the acquire that pairs with them. When it has returned true, the waiter sees the effects of all
//!   jobs, including the drops of their captures. `finish` acquires nothing: a worker for which it returned true must
//!   not read what the jobs wrote.
//!
//! The latch wakes nobody. The worker for which `finish` returned true does, through [`Sleep`](super::sleep::Sleep).
//! After its decrement the region, and the latch in it, may end at any moment, so that worker touches neither.

use crate::sync::{AtomicUsize, Ordering};

/// Counts outstanding jobs down to zero. A released latch is not used again.
pub(super) struct Latch {
    outstanding: AtomicUsize,
}

impl Latch {
    /// A latch that waits for `outstanding` jobs.
    #[inline]
    pub(super) fn new(outstanding: usize) -> Self {
        Self { outstanding: AtomicUsize::new(outstanding) }
    }

    /// Adds `jobs` to the number that the latch waits for. The caller must be counted itself, and must not have
    /// finished.
    #[inline]
    pub(super) fn add(&self, jobs: usize) {
        self.outstanding.fetch_add(jobs, Ordering::Relaxed);
    }

    /// Counts off `jobs` jobs, and returns whether they were the last.
    #[inline]
    pub(super) fn finish(&self, jobs: usize) -> bool {
        self.outstanding.fetch_sub(jobs, Ordering::Release) == jobs
    }

    /// Whether the last job has been counted off.
    #[inline]
    pub(super) fn is_released(&self) -> bool {
        self.outstanding.load(Ordering::Acquire) == 0
    }
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use super::Latch;

    #[test]
    fn only_the_last_job_releases_the_latch() {
        let latch = Latch::new(1);
        latch.add(1);
        assert!(!latch.finish(1));
        assert!(!latch.is_released());
        assert!(latch.finish(1));
        assert!(latch.is_released());
    }
}

#[cfg(all(test, drawloom_loom))]
mod loom_tests {
    use loom::cell::UnsafeCell;
    use loom::{model, thread};

    use super::Latch;
    use crate::sync::Arc;

    /// Written by one job each and read by the waiter. Loom checks the accesses for races.
    struct Cells([UnsafeCell<usize>; 2]);

    #[test]
    fn the_waiter_sees_what_every_job_did() {
        model(|| {
            let state = Arc::new((Latch::new(1), Cells([UnsafeCell::new(0), UnsafeCell::new(0)])));
            let jobs = [0, 1].map(|job| {
                state.0.add(1);
                let state = Arc::clone(&state);
                thread::spawn(move || {
                    // SAFETY: The access must be exclusive. Only this job uses the cell until it has finished, which
                    // loom checks.
                    state.1.0[job].with_mut(|cell| unsafe { *cell = 1 });
                    state.0.finish(1)
                })
            });
            let last_here = state.0.finish(1);
            if state.0.is_released() {
                // SAFETY: Nobody may write at the same time. All jobs have finished, and loom checks that this thread
                // sees it.
                let sum: usize = state.1.0.iter().map(|cell| cell.with(|cell| unsafe { *cell })).sum();
                assert_eq!(sum, 2);
            }
            let last_in_jobs = jobs.map(|job| job.join().unwrap());
            let last: usize = last_in_jobs.into_iter().map(usize::from).sum();
            assert_eq!(last + usize::from(last_here), 1, "exactly one of them is the last");
            assert!(state.0.is_released());
        });
    }

    #[test]
    fn a_job_that_adds_another_keeps_the_latch_closed() {
        model(|| {
            let state = Arc::new((Latch::new(1), UnsafeCell::new(0)));
            state.0.add(1);
            let first = Arc::clone(&state);
            let job = thread::spawn(move || {
                first.0.add(1);
                let second = Arc::clone(&first);
                let child = thread::spawn(move || {
                    // SAFETY: The access must be exclusive. Nobody else writes, and the reader waits for the latch,
                    // which loom checks.
                    second.1.with_mut(|cell| unsafe { *cell = 1 });
                    second.0.finish(1);
                });
                first.0.finish(1);
                child.join().unwrap();
            });
            state.0.finish(1);
            if state.0.is_released() {
                // SAFETY: Nobody may write at the same time. Both jobs have finished, and loom checks that this thread
                // sees it.
                assert_eq!(state.1.with(|cell| unsafe { *cell }), 1);
            }
            job.join().unwrap();
        });
    }
}
