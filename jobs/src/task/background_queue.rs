//! Background jobs that have not begun, the oldest first. Any of them can be removed.

use std::collections::BTreeMap;
use std::mem;
use std::sync::Arc;

use crate::sync::{AtomicUsize, Mutex, Ordering};
use crate::unwind::discard;

/// A background job, without the type of its result.
pub(super) trait QueuedJob: Send + Sync {
    /// Runs the job, unless another thread has begun it. Returns whether it has run here. Does not unwind.
    fn run(&self) -> bool;
}

/// A queue behind a lock, and a count with which workers skip the lock if the queue is empty.
///
/// The count is a hint, so it is relaxed. The fences of [`Sleep`](super::sleep::Sleep) make sure that a worker which
/// goes to sleep finds a job that was put here. The lock orders the jobs themselves.
pub(super) struct BackgroundQueue {
    count: AtomicUsize,
    jobs: Mutex<NumberedJobs>,
}

#[derive(Default)]
struct NumberedJobs {
    jobs: BTreeMap<u64, Arc<dyn QueuedJob>>,
    next: u64,
}

impl BackgroundQueue {
    pub(super) fn new() -> Self {
        Self { count: AtomicUsize::new(0), jobs: Mutex::new(NumberedJobs::default()) }
    }

    pub(super) fn len(&self) -> usize {
        self.count.load(Ordering::Relaxed)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Adds a job behind all others, and returns the number with which it can be [removed](Self::remove).
    pub(super) fn put(&self, job: Arc<dyn QueuedJob>) -> u64 {
        self.update(|queue| {
            let number = queue.next;
            queue.next += 1;
            queue.jobs.insert(number, job);
            number
        })
    }

    pub(super) fn take_oldest(&self) -> Option<Arc<dyn QueuedJob>> {
        if self.is_empty() { None } else { self.update(|queue| queue.jobs.pop_first().map(|(_, job)| job)) }
    }

    /// Removes the job with this number, if it is still queued.
    pub(super) fn remove(&self, number: u64) -> Option<Arc<dyn QueuedJob>> {
        self.update(|queue| queue.jobs.remove(&number))
    }

    fn update<R>(&self, change: impl FnOnce(&mut NumberedJobs) -> R) -> R {
        let mut queue = self.jobs.lock();
        let result = change(&mut queue);
        self.count.store(queue.jobs.len(), Ordering::Relaxed);
        result
    }
}

/// Drops the jobs that have not begun. Their captures may panic when they are dropped.
impl Drop for BackgroundQueue {
    fn drop(&mut self) {
        let jobs = mem::take(&mut self.jobs.lock().jobs);
        jobs.into_values().for_each(discard);
    }
}
