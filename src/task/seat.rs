//! Who is who: which worker of which scheduler a thread is just now.
//!
//! The threads a scheduler starts are its workers from 1 up for as long as they live. Worker 0 is a *seat*: the thread
//! that calls the scheduler takes it for the length of the call. A thread can be a worker of several schedulers at
//! once, if a job of the one calls the other, so what it is forms a list, from the newest to the oldest. The list goes
//! through the workers themselves, which lie on the thread's stack, as every call of every frame comes through here and
//! is to take no memory.

use std::{cell::Cell, ptr};

use crate::sync::{Arc, Condvar, Mutex, thread_local};

use super::{queue::Queues, scheduler::Shared, worker::Worker};

thread_local! {
    /// What this thread is, the newest, and null if it is nothing. It has no destructor, so that a scheduler can be
    /// called from the destructor of some other thread-local.
    static INNERMOST: Innermost = Innermost::default();
}

struct Innermost(Cell<*const Worker>);

impl Default for Innermost {
    fn default() -> Self {
        Self(Cell::new(ptr::null()))
    }
}

/// Calls `body` with the worker of that scheduler this thread is, if it is one.
pub(super) fn with_current<R>(shared: &Arc<Shared>, body: impl FnOnce(Option<&Worker>) -> R) -> R {
    let mut next = INNERMOST.with(|innermost| innermost.0.get());
    // SAFETY: What is in the list is a worker that `occupy` of this thread was given a reference to and has not returned
    // from, as it takes the worker off again before it does, whichever way it is left. So it is there for the rest of
    // this function, which is called inside of that `occupy`.
    while let Some(worker) = unsafe { next.as_ref() } {
        if Arc::ptr_eq(worker.shared(), shared) {
            return body(Some(worker));
        }
        next = worker.outer.get();
    }
    body(None)
}

/// Makes this thread the worker while `body` runs.
pub(super) fn occupy<R>(worker: &Worker, body: impl FnOnce() -> R) -> R {
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

/// The seat of worker 0.
pub(super) struct Seat {
    /// The queues of worker 0, while nobody is that worker.
    queues: Mutex<Option<Box<Queues>>>,
    freed: Condvar,
}

impl Seat {
    pub(super) fn new(queues: Box<Queues>) -> Self {
        Self { queues: Mutex::new(Some(queues)), freed: Condvar::new() }
    }

    /// Waits until the seat is free, and takes it.
    pub(super) fn take(&self) -> Box<Queues> {
        let mut seat = self.queues.lock();
        loop {
            if let Some(queues) = seat.take() {
                return queues;
            }
            seat = self.freed.wait(seat);
        }
    }

    /// Takes the seat if it is free.
    pub(super) fn try_take(&self) -> Option<Box<Queues>> {
        self.queues.lock().take()
    }

    /// Whether no thread from outside is being served.
    pub(super) fn is_free(&self) -> bool {
        self.queues.lock().is_some()
    }

    /// Frees the seat, for whoever has waited for it.
    pub(super) fn give_back(&self, queues: Box<Queues>) {
        *self.queues.lock() = Some(queues);
        self.freed.notify_one();
    }
}
