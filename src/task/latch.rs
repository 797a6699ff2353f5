//! The count of jobs a region still waits for.
//!
//! # Memory ordering
//!
//! - `add` is relaxed. Whoever adds is counted itself, so the count is at least one before and after, and nobody can
//!   take the addition for a release. The job that was added reaches its worker through a deque or a lock, which order
//!   it.
//! - `finish` is a release: what the jobs did happens before their decrement. Every change of the count is a
//!   read-modify-write, so all decrements lie in one release sequence, and the load that reads zero synchronises with
//!   every one of them, not only with the last.
//! - `is_released` is the acquire that closes the pair. After it returned true the waiter sees the effects of all jobs,
//!   the dropping of what they had captured included. `finish` acquires nothing: that it returned true is no leave to
//!   touch what the jobs wrote.
//!
//! The latch wakes nobody. The worker whose `finish` returned true does that, through [`Sleep`](super::sleep::Sleep).
//! From its decrement on the region may end at any moment, and the latch with it, so that worker touches neither after.

use crate::sync::{AtomicUsize, Ordering};

/// Counts outstanding jobs down to zero, where it stays: a released latch is not used again.
pub(super) struct Latch {
    outstanding: AtomicUsize,
}

impl Latch {
    /// A latch that waits for `outstanding` jobs.
    pub(super) fn new(outstanding: usize) -> Self {
        Self { outstanding: AtomicUsize::new(outstanding) }
    }

    /// Waits for so many more. Only for callers that are counted themselves and have not finished.
    pub(super) fn add(&self, jobs: usize) {
        self.outstanding.fetch_add(jobs, Ordering::Relaxed);
    }

    /// Takes so many off, and says whether they were the last.
    pub(super) fn finish(&self, jobs: usize) -> bool {
        self.outstanding.fetch_sub(jobs, Ordering::Release) == jobs
    }

    /// Whether the last one has been taken off.
    pub(super) fn is_released(&self) -> bool {
        self.outstanding.load(Ordering::Acquire) == 0
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::Latch;

    #[test]
    fn only_the_last_one_releases() {
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
    use loom::{cell::UnsafeCell, model, thread};

    use super::Latch;
    use crate::sync::Arc;

    /// What one job writes and the waiter reads, checked by loom for races.
    struct Cells([UnsafeCell<usize>; 2]);

    #[test]
    fn the_waiter_sees_what_every_job_did() {
        model(|| {
            let state = Arc::new((Latch::new(1), Cells([UnsafeCell::new(0), UnsafeCell::new(0)])));
            let jobs = [0, 1].map(|job| {
                state.0.add(1);
                let state = Arc::clone(&state);
                thread::spawn(move || {
                    // SAFETY: the cell is this job's alone until it has finished; loom checks that.
                    state.1.0[job].with_mut(|cell| unsafe { *cell = 1 });
                    state.0.finish(1)
                })
            });
            let last_here = state.0.finish(1);
            if state.0.is_released() {
                // SAFETY: all jobs have finished; loom checks that this is seen here.
                let sum: usize = state.1.0.iter().map(|cell| cell.with(|cell| unsafe { *cell })).sum();
                assert_eq!(sum, 2);
            }
            let last_in_jobs = jobs.map(|job| job.join().unwrap());
            let last: usize = last_in_jobs.into_iter().map(usize::from).sum();
            assert_eq!(last + usize::from(last_here), 1, "one of them is the last");
            assert!(state.0.is_released());
        });
    }

    #[test]
    fn a_job_that_adds_another_keeps_the_latch_shut() {
        model(|| {
            let state = Arc::new((Latch::new(1), UnsafeCell::new(0)));
            state.0.add(1);
            let first = Arc::clone(&state);
            let job = thread::spawn(move || {
                first.0.add(1);
                let second = Arc::clone(&first);
                let child = thread::spawn(move || {
                    // SAFETY: nobody else writes, and the reader waits for the latch; loom checks that.
                    second.1.with_mut(|cell| unsafe { *cell = 1 });
                    second.0.finish(1);
                });
                first.0.finish(1);
                child.join().unwrap();
            });
            state.0.finish(1);
            if state.0.is_released() {
                // SAFETY: both jobs have finished; loom checks that this is seen here.
                assert_eq!(state.1.with(|cell| unsafe { *cell }), 1);
            }
            job.join().unwrap();
        });
    }
}
