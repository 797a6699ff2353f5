//! Workers.

use std::{
    cell::{Cell, RefCell},
    mem::{self, ManuallyDrop},
    rc::Rc,
};

use crate::sync::{Arc, Deque, Steal, spin_loop};

use super::{job::Job, scheduler::Shared, scope::ScopeState};

/// How often an idle worker looks for work before it sleeps, and how long it pauses between two looks.
#[cfg(not(drawloom_loom))]
const SPIN_ROUNDS: usize = 16;
#[cfg(drawloom_loom)]
const SPIN_ROUNDS: usize = 1;
#[cfg(not(drawloom_loom))]
const SPIN_PAUSES: usize = 16;
#[cfg(drawloom_loom)]
const SPIN_PAUSES: usize = 0;

thread_local! {
    static SEATS: ManuallyDrop<RefCell<Vec<Rc<Worker>>>> = const { ManuallyDrop::new(RefCell::new(Vec::new())) };
}

/// The witness that code runs as a job.
pub struct Worker {
    index: usize,
    deque: Deque<Job>,
    shared: Arc<Shared>,
    /// Whom to rob first: the last victim that had something.
    victim: Cell<usize>,
    visits: RefCell<Vec<Visit>>,
}

impl Worker {
    pub(super) fn new(index: usize, deque: Deque<Job>, shared: Arc<Shared>) -> Self {
        Self { index, deque, shared, victim: Cell::new(index), visits: RefCell::new(Vec::new()) }
    }

    /// Which worker this is, from 0 up to [`Scheduler::workers`](super::Scheduler::workers).
    pub fn index(&self) -> usize {
        self.index
    }

    /// Who this thread is for that scheduler.
    pub(super) fn current(shared: &Arc<Shared>) -> Option<Rc<Self>> {
        SEATS.with(|seats| seats.borrow().iter().rev().find(|worker| Arc::ptr_eq(&worker.shared, shared)).cloned())
    }

    pub(super) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    pub(super) fn push(&self, job: Job) {
        self.deque.push(job);
        self.shared.sleep().wake_any();
    }

    /// Runs jobs, and sleeps where there are none, until that has come.
    pub(super) fn work(&self, until: Until<'_>) {
        let mut idle_rounds = 0;
        while !until.reached(self) {
            if let Some(job) = self.next_job(until) {
                job.run(self);
                idle_rounds = 0;
            } else if idle_rounds < SPIN_ROUNDS {
                (0..SPIN_PAUSES).for_each(|_| spin_loop());
                idle_rounds += 1;
            } else {
                self.sleep(until);
                idle_rounds = 0;
            }
        }
    }

    fn next_job(&self, until: Until<'_>) -> Option<Job> {
        until.pinned_job().or_else(|| self.deque.pop()).or_else(|| self.steal())
    }

    fn sleep(&self, until: Until<'_>) {
        self.shared.sleep().sleep(self.index, || until.reached(self) || until.has_pinned_job() || self.sees_loot());
        if until.reached(self) && self.sees_loot() {
            self.shared.sleep().wake_any();
        }
    }

    fn steal(&self) -> Option<Job> {
        let stealers = self.shared.stealers();
        let first = self.victim.get();
        loop {
            let mut contended = false;
            for victim in (first..stealers.len()).chain(0..first) {
                if victim == self.index {
                    continue;
                }
                match stealers[victim].steal() {
                    Steal::Success(job) => {
                        self.victim.set(victim);
                        return Some(job);
                    }
                    Steal::Retry => contended = true,
                    Steal::Empty => {}
                }
            }
            if !contended {
                return None;
            }
            spin_loop();
        }
    }

    fn sees_loot(&self) -> bool {
        self.shared.stealers().iter().enumerate().any(|(victim, stealer)| victim != self.index && !stealer.is_empty())
    }

    /// Notes that the worker is inside of the pass, or, where it already is, that it was brought the pass's token again.
    pub(super) fn enter(&self, pass: usize) -> bool {
        let mut visits = self.visits.borrow_mut();
        if let Some(visit) = visits.iter_mut().find(|visit| visit.pass == pass) {
            visit.token = true;
            return false;
        }
        visits.push(Visit { pass, token: true });
        true
    }

    /// Takes the token of the pass entered last, if the worker has it.
    pub(super) fn take_token(&self) -> bool {
        self.visits.borrow_mut().last_mut().is_some_and(|visit| mem::take(&mut visit.token))
    }

    pub(super) fn leave(&self) {
        self.visits.borrow_mut().pop();
    }
}

struct Visit {
    pass: usize,
    token: bool,
}

/// What a worker works towards.
#[derive(Clone, Copy)]
pub(super) enum Until<'state> {
    /// The end of the scheduler.
    Shutdown,
    /// The end of a scope that this worker opened.
    Finished(&'state ScopeState),
}

impl Until<'_> {
    fn reached(self, worker: &Worker) -> bool {
        match self {
            Self::Shutdown => worker.shared.is_shut_down(),
            Self::Finished(scope) => scope.is_finished(),
        }
    }

    fn pinned_job(self) -> Option<Job> {
        match self {
            Self::Shutdown => None,
            Self::Finished(scope) => scope.mailbox().take(),
        }
    }

    fn has_pinned_job(self) -> bool {
        match self {
            Self::Shutdown => false,
            Self::Finished(scope) => !scope.mailbox().is_empty(),
        }
    }
}

/// Makes this thread the worker for as long as `body` runs, and gives the deque back. `body` must not unwind, as the deque
/// would be lost with it.
pub(super) fn occupy<R>(
    index: usize,
    deque: Deque<Job>,
    shared: Arc<Shared>,
    body: impl FnOnce(&Worker) -> R,
) -> (R, Deque<Job>) {
    let worker = Rc::new(Worker::new(index, deque, shared));
    SEATS.with(|seats| seats.borrow_mut().push(Rc::clone(&worker)));
    let result = body(&worker);
    SEATS.with(|seats| {
        let mut seats = seats.borrow_mut();
        seats.pop();
        if seats.is_empty() {
            // Nothing frees a `ManuallyDrop` when the thread ends.
            *seats = Vec::new();
        }
    });
    let worker = Rc::into_inner(worker).expect("what `current` hands out lives no longer than the call it is for");
    (result, worker.deque)
}
