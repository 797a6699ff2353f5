//! Jobs that must not lie in a worker's queues: those for one worker alone, and those that have strayed.

use std::collections::VecDeque;

use crate::sync::{AtomicUsize, Mutex, Ordering};

use super::{job::Job, region::Region};

/// Jobs, first in, first out. Those in a worker's own mailbox belong to regions that it has opened, and nobody else runs
/// them.
///
/// The count is only a hint, so it is relaxed: it saves the worker the lock where there is nothing. That a sleeping
/// worker learns of a job is up to the fences of [`Sleep`](super::sleep::Sleep), and the lock orders the job itself.
pub(super) struct Mailbox {
    count: AtomicUsize,
    jobs: Mutex<VecDeque<Job>>,
}

impl Mailbox {
    pub(super) fn new() -> Self {
        Self { count: AtomicUsize::new(0), jobs: Mutex::new(VecDeque::new()) }
    }

    pub(super) fn put(&self, job: Job) {
        let mut jobs = self.jobs.lock();
        jobs.push_back(job);
        self.count.store(jobs.len(), Ordering::Relaxed);
    }

    /// The first job of that region.
    pub(super) fn take(&self, region: &Region) -> Option<Job> {
        if !self.has_any() {
            return None;
        }
        let mut jobs = self.jobs.lock();
        let first = jobs.iter().position(|job| job.region.is(region))?;
        let job = jobs.remove(first);
        self.count.store(jobs.len(), Ordering::Relaxed);
        job
    }

    /// The first job of all.
    pub(super) fn take_any(&self) -> Option<Job> {
        if !self.has_any() {
            return None;
        }
        let mut jobs = self.jobs.lock();
        let job = jobs.pop_front();
        self.count.store(jobs.len(), Ordering::Relaxed);
        job
    }

    pub(super) fn has_any(&self) -> bool {
        self.count.load(Ordering::Relaxed) > 0
    }

    /// Whether there is a job of that region.
    pub(super) fn has(&self, region: &Region) -> bool {
        self.has_any() && self.jobs.lock().iter().any(|job| job.region.is(region))
    }
}
