//! Which threads draw.

use std::sync::{Arc, OnceLock};

use crate::task::{JobPanic, Scheduler, catch};

/// Which threads draw.
#[derive(Clone)]
pub(super) enum Executor {
    /// The workers of a scheduler, with the calling thread.
    Scheduler(Arc<Scheduler>),
    /// The calling thread alone.
    CallingThread,
}

impl Executor {
    /// Calls `work` for each of `count` indices, in any order.
    ///
    /// # Errors
    /// If a call panics. Some of the others may not have started.
    pub(super) fn for_each(&self, count: usize, work: impl Fn(usize) + Sync) -> Result<(), JobPanic> {
        match self {
            Self::Scheduler(scheduler) => scheduler.parallel_for(count, 1, |range, _worker| range.for_each(&work)),
            Self::CallingThread => catch(|| (0..count).for_each(work)),
        }
    }

    /// Calls `work` for each of `count` indices, in any order, and returns the results in order.
    ///
    /// # Errors
    /// If a call panics.
    pub(super) fn map<T: Send + Sync>(
        &self,
        count: usize,
        work: impl Fn(usize) -> T + Sync,
    ) -> Result<Vec<T>, JobPanic> {
        let mut results = Vec::new();
        results.resize_with(count, OnceLock::new);
        // Each is set once.
        self.for_each(count, |index| _ = results[index].set(work(index)))?;
        Ok(results.into_iter().filter_map(OnceLock::into_inner).collect())
    }
}
