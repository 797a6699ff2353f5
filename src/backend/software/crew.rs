//! Who draws.

use std::sync::{Arc, OnceLock};

use crate::task::{JobPanic, Scheduler, catch};

/// Who draws.
#[derive(Clone)]
pub(super) enum Crew {
    /// The workers of a scheduler, with the thread that calls.
    Shared(Arc<Scheduler>),
    /// The thread that calls.
    Alone,
}

impl Crew {
    /// Does so many jobs, in any order.
    ///
    /// # Errors
    /// If one panics. Some of the others may not have begun.
    pub(super) fn each(&self, jobs: usize, work: impl Fn(usize) + Sync) -> Result<(), JobPanic> {
        match self {
            Self::Shared(scheduler) => scheduler.parallel_for(jobs, 1, |range, _worker| range.for_each(&work)),
            Self::Alone => catch(|| (0..jobs).for_each(work)),
        }
    }

    /// Does so many jobs, in any order, and says in order what came of them.
    ///
    /// # Errors
    /// If one panics.
    pub(super) fn map<T: Send + Sync>(
        &self,
        jobs: usize,
        work: impl Fn(usize) -> T + Sync,
    ) -> Result<Vec<T>, JobPanic> {
        let mut results = Vec::new();
        results.resize_with(jobs, OnceLock::new);
        // Each is set once.
        self.each(jobs, |job| _ = results[job].set(work(job)))?;
        Ok(results.into_iter().filter_map(OnceLock::into_inner).collect())
    }
}
