//! Work that no frame waits for: streaming, baking, whatever may take longer than a frame.

use std::{
    fmt,
    sync::{Arc, Weak},
};

use crate::{
    sync::{Condvar, Mutex},
    unwind::{JobPanic, catch, discard, emit},
};

use super::background_queue::BackgroundQueue;

/// A job that runs when no frame needs its worker, and what comes of it; made by
/// [`Scheduler::background`](super::Scheduler::background).
///
/// Who drops it lets go of the result, not of the job, which runs nevertheless. A panic that nobody has waited for is
/// reported to [`tracing`] as an error.
#[must_use = "who drops it lets go of the job's result"]
pub struct BackgroundJob<T> {
    ticket: Arc<Ticket<T>>,
    /// The queue of its scheduler, as long as that is there, and the number of the job in it.
    queue: Weak<BackgroundQueue>,
    number: u64,
}

impl<T: Send + 'static> BackgroundJob<T> {
    /// Queues a job.
    pub(super) fn queued(queue: &Arc<BackgroundQueue>, job: impl FnOnce() -> T + Send + 'static) -> Self {
        let ticket = Arc::new(Ticket {
            job: Mutex::new(Some(Box::new(job))),
            outcome: Mutex::new(Outcome { result: None, is_abandoned: false }),
            finished: Condvar::new(),
        });
        let number = queue.put(Arc::<Ticket<T>>::clone(&ticket));
        Self { ticket, queue: Arc::downgrade(queue), number }
    }

    /// Whether the job has run, so that [`wait`](Self::wait) returns at once.
    pub fn is_finished(&self) -> bool {
        self.ticket.outcome.lock().result.is_some()
    }

    /// Returns what the job returned.
    ///
    /// If the job has not begun, this thread runs it here and now, before all that were queued earlier, and nothing of it
    /// stays queued. Otherwise this thread blocks until the job has run, and runs no other job meanwhile. It may be called
    /// anywhere: in a frame's jobs, in background jobs, and on threads that are no workers. A job that waits for itself, by
    /// whatever detour, waits for ever.
    ///
    /// # Errors
    ///
    /// The [`JobPanic`] if the job panicked.
    pub fn wait(self) -> Result<T, JobPanic> {
        // Where the scheduler is gone, so is the queue.
        drop(self.queue.upgrade().and_then(|queue| queue.remove(self.number)));
        self.ticket.run();
        let mut outcome = self.ticket.outcome.lock();
        loop {
            if let Some(result) = outcome.result.take() {
                return result;
            }
            outcome = self.ticket.finished.wait(outcome);
        }
    }
}

impl<T> Drop for BackgroundJob<T> {
    fn drop(&mut self) {
        let mut outcome = self.ticket.outcome.lock();
        outcome.is_abandoned = true;
        let result = outcome.result.take();
        drop(outcome);
        if let Some(result) = result {
            abandon(result);
        }
    }
}

impl<T> fmt::Debug for BackgroundJob<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_finished = self.ticket.outcome.lock().result.is_some();
        formatter.debug_struct("BackgroundJob").field("is_finished", &is_finished).finish_non_exhaustive()
    }
}

/// A background job as the queue knows it.
pub(super) trait Queued: Send + Sync {
    /// Runs the job, unless somebody else has begun it, and says whether it did. Does not unwind.
    fn run(&self) -> bool;
}

/// What the queue and the handle share of a job.
struct Ticket<T> {
    /// Taken by whoever runs it.
    job: Mutex<Option<Box<dyn FnOnce() -> T + Send>>>,
    outcome: Mutex<Outcome<T>>,
    finished: Condvar,
}

struct Outcome<T> {
    result: Option<Result<T, JobPanic>>,
    is_abandoned: bool,
}

impl<T: Send> Queued for Ticket<T> {
    fn run(&self) -> bool {
        let Some(job) = self.job.lock().take() else { return false };
        let result = catch(job);
        let mut outcome = self.outcome.lock();
        if outcome.is_abandoned {
            drop(outcome);
            abandon(result);
        } else {
            outcome.result = Some(result);
            drop(outcome);
            self.finished.notify_one();
        }
        true
    }
}

fn abandon<T>(result: Result<T, JobPanic>) {
    match result {
        Ok(value) => discard(value),
        Err(panic) => emit(|| tracing::error!(message = %panic, "a background job that nobody waits for")),
    }
}
