//! Latch counts that a worker holds in advance.
//!
//! If every job were counted in and off on the latch of its region, the latch's cache line would move between cores
//! twice a job. So a worker adds the count of some jobs at once, and holds what it has not used yet: its *prepaid
//! count*. When a job has run, its count goes back to the prepaid count of the worker that ran it, for the next job
//! that this worker pushes. A worker that finds nothing to do flushes its prepaid count to the latch. So the latch is
//! released when no job is left and every worker has found that out.

use std::cell::Cell;

use super::region::{JobContext, Region};

/// How many jobs a worker counts at once.
const BATCH: usize = if cfg!(drawloom_model_check) { 2 } else { 32 };

/// The count that a worker holds of one region's latch.
pub(super) struct PrepaidCount<W: JobContext> {
    /// Reserved, unused units; they keep the latch closed. While there are none and there is a region, a job of the
    /// region is running on this worker.
    count: Cell<usize>,
    region: Cell<Option<&'static Region<W>>>,
}

impl<W: JobContext> PrepaidCount<W> {
    pub(super) fn new() -> Self {
        Self { count: Cell::new(0), region: Cell::new(None) }
    }

    /// Takes the count for one more job of the region.
    #[inline]
    pub(super) fn acquire(&self, region: &'static Region<W>, wake_owner: impl FnOnce(usize)) {
        self.switch_to(region, wake_owner);
        if self.count.get() == 0 {
            region.latch().add(BATCH);
            self.count.set(BATCH);
        }
        self.count.set(self.count.get() - 1);
    }

    /// Takes back the count of a job of the region that has run on this worker.
    #[inline]
    pub(super) fn release(&self, region: &'static Region<W>, wake_owner: impl FnOnce(usize)) {
        self.switch_to(region, wake_owner);
        self.count.set(self.count.get() + 1);
    }

    /// Flushes the count of any other region, so that the count is this region's from now on.
    #[inline]
    pub(super) fn switch_to(&self, region: &'static Region<W>, wake_owner: impl FnOnce(usize)) {
        if !self.region.get().is_some_and(|current| current.is(region)) {
            self.flush(wake_owner);
            self.region.set(Some(region));
        }
    }

    /// Gives the whole count back to the latch. If that releases the latch, calls `wake_owner` with the region's owner.
    #[inline]
    pub(super) fn flush(&self, wake_owner: impl FnOnce(usize)) {
        let count = self.count.take();
        let Some(region) = self.region.take() else { return };
        // The region may end as soon as the latch is released, so nothing of it is read after `finish`. Until `finish`
        // returns only the latch is referred to, which is nothing but an atomic.
        let (latch, owner) = (region.latch(), region.owner());
        if count > 0 && latch.finish(count) {
            wake_owner(owner);
        }
    }
}
