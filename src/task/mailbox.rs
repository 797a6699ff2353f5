//! Jobs that must not lie in a worker's queues: those for one worker alone, and those that have strayed.

use super::{job::Job, locked_queue::LockedQueue, region::Region};

/// Jobs, first in, first out. Those in a worker's own mailbox belong to regions that it has opened, and nobody else runs
/// them.
pub(super) struct Mailbox {
    jobs: LockedQueue<Job>,
}

impl Mailbox {
    pub(super) fn new() -> Self {
        Self { jobs: LockedQueue::new() }
    }

    pub(super) fn put(&self, job: Job) {
        self.jobs.put(job);
    }

    /// The first job of that region.
    pub(super) fn take(&self, region: &Region) -> Option<Job> {
        self.jobs.change_unless_empty(|jobs| {
            let first = jobs.iter().position(|job| job.region.is(region))?;
            jobs.remove(first)
        })
    }

    /// The first job of all.
    pub(super) fn take_any(&self) -> Option<Job> {
        self.jobs.take_oldest()
    }

    pub(super) fn has_any(&self) -> bool {
        !self.jobs.is_empty()
    }

    /// Whether there is a job of that region.
    pub(super) fn has(&self, region: &Region) -> bool {
        self.jobs.has(|job| job.region.is(region))
    }
}
