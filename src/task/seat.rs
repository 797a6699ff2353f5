//! Who is who: which worker of which scheduler a thread is just now.
//!
//! The threads a scheduler starts are its workers from 1 up for as long as they live. Worker 0 is a *seat*: the thread
//! that calls the scheduler takes it for the length of the call. A thread can be a worker of several schedulers at
//! once, if a job of the one calls the other, so what it is forms a stack.

use std::{cell::RefCell, mem::ManuallyDrop, rc::Rc};

use crate::sync::{Arc, Condvar, Deque, Mutex, thread_local};

use super::{job::Job, scheduler::Shared, worker::Worker};

thread_local! {
    /// What this thread is, the newest last. Without a destructor, so that a scheduler can be called from the
    /// destructor of some other thread-local.
    static SEATS: Seats = Seats::default();
}

type Seats = ManuallyDrop<RefCell<Vec<Rc<Worker>>>>;

/// The worker of that scheduler this thread is, if it is one. Not to be kept beyond the call it is asked for.
pub(super) fn current(shared: &Arc<Shared>) -> Option<Rc<Worker>> {
    SEATS.with(|seats| {
        let seats = seats.borrow();
        seats.iter().rev().find(|worker| Arc::ptr_eq(worker.shared(), shared)).cloned()
    })
}

/// Makes this thread the worker while `body` runs, and gives the deque back. `body` must not unwind: the deque would be
/// lost with it.
pub(super) fn occupy<R>(worker: Worker, body: impl FnOnce(&Worker) -> R) -> (R, Deque<Job>) {
    let worker = Rc::new(worker);
    SEATS.with(|seats| seats.borrow_mut().push(Rc::clone(&worker)));
    let result = body(&worker);
    SEATS.with(|seats| {
        let mut seats = seats.borrow_mut();
        seats.pop();
        if seats.is_empty() {
            // Nothing frees the memory at the end of the thread, so it is freed here.
            *seats = Vec::new();
        }
    });
    let worker = Rc::into_inner(worker).expect("nobody keeps what `current` returned");
    (result, worker.into_deque())
}

/// The seat of worker 0.
pub(super) struct Seat {
    /// The deque of worker 0, while nobody is that worker.
    deque: Mutex<Option<Deque<Job>>>,
    freed: Condvar,
}

impl Seat {
    pub(super) fn new(deque: Deque<Job>) -> Self {
        Self { deque: Mutex::new(Some(deque)), freed: Condvar::new() }
    }

    /// Waits until the seat is free, and takes it.
    pub(super) fn take(&self) -> Deque<Job> {
        let mut seat = self.deque.lock();
        loop {
            if let Some(deque) = seat.take() {
                return deque;
            }
            seat = self.freed.wait(seat);
        }
    }

    /// Frees the seat, for whoever has waited for it.
    pub(super) fn give_back(&self, deque: Deque<Job>) {
        *self.deque.lock() = Some(deque);
        self.freed.notify_one();
    }
}
