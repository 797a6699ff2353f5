//! Jobs that no frame waits for: streaming, baking, anything that may take longer than a frame.

use std::fmt;
use std::sync::{Arc, Weak};

use super::background_queue::{BackgroundQueue, QueuedJob};
use crate::sync::{Condvar, Mutex};
use crate::unwind::{Contained, JobPanic, catch, discard, emit};

/// A job that runs when no frame needs its worker, and its result.
/// [`Scheduler::background`](super::Scheduler::background) makes it.
///
/// Dropping it drops the result, but not the job, which runs nevertheless, unless the scheduler is dropped before it
/// has begun. If the job panics and nobody waits for it, the panic is reported to [`tracing`] as an error.
#[must_use = "dropping it drops the result of the job"]
pub struct BackgroundJob<T> {
    state: Arc<JobState<T>>,
    /// The queue of the job's scheduler, as long as that exists, and the number of the job in it.
    queue: Weak<BackgroundQueue>,
    number: u64,
}

impl<T: Send + 'static> BackgroundJob<T> {
    /// Queues a job.
    pub(super) fn queued(queue: &Arc<BackgroundQueue>, job: impl FnOnce() -> T + Send + 'static) -> Self {
        let state = Arc::new(JobState {
            job: Mutex::new(Some(Contained::new(Box::new(job)))),
            outcome: Mutex::new(Outcome { result: None, is_abandoned: false }),
            finished: Condvar::new(),
        });
        let number = queue.put(Arc::<JobState<T>>::clone(&state));
        Self { state, queue: Arc::downgrade(queue), number }
    }

    /// Runs the job at once, unless it has begun.
    #[doc(hidden)]
    pub fn run(&self) {
        // If the scheduler was dropped, the queue was too.
        drop(self.queue.upgrade().and_then(|queue| queue.remove(self.number)));
        self.state.run();
    }

    /// Whether the job has run, so that [`wait`](Self::wait) returns at once.
    pub fn is_finished(&self) -> bool {
        self.state.outcome.lock().result.is_some()
    }

    /// Returns the result of the job.
    ///
    /// If the job has not begun, this thread runs it at once, before all jobs that were queued earlier, and removes it
    /// from the queue. Otherwise this thread blocks until the job has run, and runs no other job meanwhile. It may be
    /// called anywhere: in a frame's jobs, in background jobs, and on threads that are no workers. A job that waits for
    /// itself, directly or through others, waits for ever.
    ///
    /// # Errors
    /// Returns the [`JobPanic`] if the job panicked.
    pub fn wait(self) -> Result<T, JobPanic> {
        self.run();
        let mut outcome = self.state.outcome.lock();
        loop {
            if let Some(result) = outcome.result.take() {
                return result;
            }
            outcome = self.state.finished.wait(outcome);
        }
    }
}

impl<T> Drop for BackgroundJob<T> {
    fn drop(&mut self) {
        let mut outcome = self.state.outcome.lock();
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
        let is_finished = self.state.outcome.lock().result.is_some();
        formatter.debug_struct("BackgroundJob").field("is_finished", &is_finished).finish_non_exhaustive()
    }
}

type Job<T> = Box<dyn FnOnce() -> T + Send>;

/// What the queue and the handle share of a job.
struct JobState<T> {
    /// The thread that runs the job takes it.
    job: Mutex<Option<Contained<Job<T>>>>,
    outcome: Mutex<Outcome<T>>,
    finished: Condvar,
}

struct Outcome<T> {
    result: Option<Result<T, JobPanic>>,
    /// Whether the handle has been dropped.
    is_abandoned: bool,
}

impl<T: Send> QueuedJob for JobState<T> {
    fn run(&self) -> bool {
        let Some(job) = self.job.lock().take() else { return false };
        let result = catch(job.into_inner());
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

/// Drops a result that nobody waits for, and reports a panic.
fn abandon<T>(result: Result<T, JobPanic>) {
    match result {
        Ok(value) => discard(value),
        Err(panic) => {
            emit(|| tracing::error!(target: "drawloom", message = %panic, "a background job that nobody waits for"))
        }
    }
}
