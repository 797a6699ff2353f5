//! Which worker of which scheduler the current thread is.
//!
//! The threads that a scheduler starts are its workers from 1 up for as long as they live. Worker 0 is the thread that
//! calls the scheduler, for the length of the call. A thread can be a worker of several schedulers at once, if a job of
//! one calls another, so its workers form a list, the newest first. The links of the list are in the workers
//! themselves, which lie on the thread's stack: every call of every frame comes through here and must not allocate.

use std::cell::Cell;
use std::ptr;

use super::shared::Shared;
use super::worker::Worker;
use crate::sync::{Arc, thread_local};

thread_local! {
    /// The newest worker that this thread is, or null. It has no destructor, so a scheduler can be called from the
    /// destructor of any other thread-local.
    static INNERMOST: Innermost = Innermost::default();
}

struct Innermost(Cell<*const Worker>);

impl Default for Innermost {
    fn default() -> Self {
        Self(Cell::new(ptr::null()))
    }
}

/// Calls `body` with the worker of this scheduler that the thread is, if it is one.
pub(super) fn with_current<R>(shared: &Arc<Shared<Worker>>, body: impl FnOnce(Option<&Worker>) -> R) -> R {
    let mut next = INNERMOST.with(|innermost| innermost.0.get());
    // SAFETY: Each pointer in the list must point to a worker that lives until `body` returns. `enter` pushed it from a
    // reference that is valid until that `enter` returns, and its guard pops it before, on return and on unwind. This
    // call happens inside of that `enter`, on the same thread, so it ends first.
    while let Some(worker) = unsafe { next.as_ref() } {
        if Arc::ptr_eq(worker.shared(), shared) {
            return body(Some(worker));
        }
        next = worker.outer.get();
    }
    body(None)
}

/// Makes the thread this worker while `body` runs.
pub(super) fn enter<R>(worker: &Worker, body: impl FnOnce() -> R) -> R {
    worker.outer.set(INNERMOST.with(|innermost| innermost.0.replace(ptr::from_ref(worker))));
    let _leave = Leave(worker);
    body()
}

/// Takes a worker off the list when it is dropped.
struct Leave<'worker>(&'worker Worker);

impl Drop for Leave<'_> {
    fn drop(&mut self) {
        INNERMOST.with(|innermost| innermost.0.set(self.0.outer.get()));
    }
}
