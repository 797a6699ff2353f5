//! Background jobs that nobody has begun, the oldest first; any of them can be taken out.

use std::{collections::BTreeMap, mem, sync::Arc};

use crate::{
    sync::{AtomicUsize, Mutex, Ordering},
    unwind::discard,
};

use super::background::Queued;

/// A queue behind a lock, and a count that spares those who find it empty the lock.
///
/// The count is a hint, so it is relaxed. That a sleeping worker learns of a job that is put here is up to the fences of
/// [`Sleep`](super::sleep::Sleep), and the lock orders the jobs themselves.
pub(super) struct BackgroundQueue {
    count: AtomicUsize,
    jobs: Mutex<Numbered>,
}

#[derive(Default)]
struct Numbered {
    jobs: BTreeMap<u64, Arc<dyn Queued>>,
    next: u64,
}

impl BackgroundQueue {
    pub(super) fn new() -> Self {
        Self { count: AtomicUsize::new(0), jobs: Mutex::new(Numbered::default()) }
    }

    pub(super) fn len(&self) -> usize {
        self.count.load(Ordering::Relaxed)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Puts a job behind all others, and gives it the number by which it can be [removed](Self::remove).
    pub(super) fn put(&self, job: Arc<dyn Queued>) -> u64 {
        self.change(|queue| {
            let number = queue.next;
            queue.next += 1;
            queue.jobs.insert(number, job);
            number
        })
    }

    pub(super) fn take_oldest(&self) -> Option<Arc<dyn Queued>> {
        if self.is_empty() { None } else { self.change(|queue| queue.jobs.pop_first().map(|(_, job)| job)) }
    }

    /// Takes out the job of that number, unless somebody has.
    pub(super) fn remove(&self, number: u64) -> Option<Arc<dyn Queued>> {
        self.change(|queue| queue.jobs.remove(&number))
    }

    fn change<R>(&self, change: impl FnOnce(&mut Numbered) -> R) -> R {
        let mut queue = self.jobs.lock();
        let result = change(&mut queue);
        self.count.store(queue.jobs.len(), Ordering::Relaxed);
        result
    }
}

/// Jobs that nobody has begun are dropped by whoever drops the queue, and what they have captured may panic at that.
impl Drop for BackgroundQueue {
    fn drop(&mut self) {
        let jobs = mem::take(&mut self.jobs.lock().jobs);
        jobs.into_values().for_each(discard);
    }
}
