//! What a worker does: run jobs, look for jobs, sleep.

use std::{
    cell::{Cell, RefCell},
    fmt,
    marker::PhantomData,
    mem,
    rc::Rc,
};

use crate::sync::{Arc, Deque, Steal, spin_loop};

use super::{job::Job, scheduler::Shared, scope::ScopeState};

/// How often a worker looks for jobs in vain before it sleeps. With the pauses between, that is some microseconds, less
/// than a sleep and a wake-up cost together.
const IDLE_ROUNDS: usize = if cfg!(drawloom_loom) { 0 } else { 16 };

/// How many pauses of the processor lie between two looks.
const PAUSES: usize = 16;

/// The witness that code runs as a job of a scheduler: only there can a reference to it be had, and it stays on its
/// thread.
///
/// No two threads are the same worker at the same time, so what an engine keeps once per [`index`](Self::index) is
/// never shared between threads. But a job that opens a scope or a loop and waits in it may find itself interrupted by
/// another job on the same worker, so such a thing should not stay borrowed over a wait.
///
/// ```compile_fail,E0277
/// # let scheduler = drawloom::task::Scheduler::new(2)?;
/// scheduler.scope(|scope| {
///     // A witness could testify for a thread that is no worker at all.
///     scope.spawn(|_scope, worker| std::thread::scope(|threads| { threads.spawn(|| worker.index()); }));
/// })?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Worker {
    index: usize,
    deque: Deque<Job>,
    shared: Arc<Shared>,
    /// Whom to steal from first: where there was something the last time.
    victim: Cell<usize>,
    /// The passes this worker is inside of, the innermost last.
    visits: RefCell<Vec<Visit>>,
    on_this_thread: PhantomData<Rc<()>>,
}

impl Worker {
    pub(super) fn new(index: usize, deque: Deque<Job>, shared: Arc<Shared>) -> Self {
        Self {
            index,
            deque,
            shared,
            victim: Cell::new(0),
            visits: RefCell::new(Vec::new()),
            on_this_thread: PhantomData,
        }
    }

    /// Which worker this is, from 0 up to [`Scheduler::workers`](super::Scheduler::workers). 0 is the thread that
    /// called the scheduler.
    pub fn index(&self) -> usize {
        self.index
    }

    pub(super) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    pub(super) fn into_deque(self) -> Deque<Job> {
        self.deque
    }

    /// Queues a job here, and wakes somebody for it.
    pub(super) fn push(&self, job: Job) {
        self.deque.push(job);
        self.shared.sleep().wake_any();
    }

    /// Runs jobs, and sleeps where there are none, until that time has come. Does not unwind.
    pub(super) fn work(&self, until: Until<'_>) {
        let mut idle_rounds = 0;
        let mut called = false;
        while !until.has_come(&self.shared) {
            let was_called = mem::take(&mut called);
            if let Some(job) = self.next_job(until) {
                // It may have been called for another job than the one it found, a pinned one say.
                self.pass_on(was_called);
                job.run(self);
                idle_rounds = 0;
            } else if idle_rounds == IDLE_ROUNDS {
                self.sleep(until);
                called = true;
                idle_rounds = 0;
            } else {
                (0..PAUSES).for_each(|_| spin_loop());
                idle_rounds += 1;
            }
        }
        // It may have been called for a job that it does not look for any more.
        self.pass_on(called);
    }

    /// Passes a call on, if there was one and there is something that others could do.
    fn pass_on(&self, was_called: bool) {
        if was_called && self.sees_loot() {
            self.shared.sleep().wake_any();
        }
    }

    /// Pinned jobs come first, as nobody else can run them: while this worker does, others take those of its deque.
    fn next_job(&self, until: Until<'_>) -> Option<Job> {
        until.pinned_job().or_else(|| self.deque.pop()).or_else(|| self.steal())
    }

    /// One job of somebody else.
    fn steal(&self) -> Option<Job> {
        let stealers = self.shared.stealers();
        let first = self.victim.get();
        loop {
            let mut interrupted = false;
            for victim in (first..stealers.len()).chain(0..first).filter(|&victim| victim != self.index) {
                match stealers[victim].steal() {
                    Steal::Success(job) => {
                        self.victim.set(victim);
                        return Some(job);
                    }
                    // Another thief was faster, and there may be more.
                    Steal::Retry => interrupted = true,
                    Steal::Empty => {}
                }
            }
            if !interrupted {
                return None;
            }
            spin_loop();
        }
    }

    fn sleep(&self, until: Until<'_>) {
        let sees_work = || until.has_come(&self.shared) || until.has_pinned_job() || self.sees_loot();
        self.shared.sleep().sleep(self.index, sees_work);
    }

    /// Whether there is something to steal. Its own deque is empty when a worker asks, as nobody else puts anything in.
    fn sees_loot(&self) -> bool {
        let others = self.shared.stealers().iter().enumerate().filter(|&(victim, _)| victim != self.index);
        others.map(|(_, stealer)| stealer).any(|stealer| !stealer.is_empty())
    }

    /// Goes into the pass, and holds the token that it was brought. Is the worker inside already, further out, it stays
    /// there, holds the token there, and this is false.
    pub(super) fn enter(&self, pass: usize) -> bool {
        let mut visits = self.visits.borrow_mut();
        if let Some(visit) = visits.iter_mut().find(|visit| visit.pass == pass) {
            visit.holds_token = true;
            return false;
        }
        visits.push(Visit { pass, holds_token: true });
        true
    }

    /// Takes the token of the innermost pass off the worker, if it holds that.
    pub(super) fn take_token(&self) -> bool {
        self.visits.borrow_mut().last_mut().is_some_and(|visit| mem::take(&mut visit.holds_token))
    }

    /// Leaves the innermost pass.
    pub(super) fn leave(&self) {
        self.visits.borrow_mut().pop();
    }
}

impl fmt::Debug for Worker {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Worker").field("index", &self.index).finish_non_exhaustive()
    }
}

/// A worker's stay inside a pass.
struct Visit {
    /// The address of the pass.
    pass: usize,
    holds_token: bool,
}

/// How long a worker works.
#[derive(Clone, Copy)]
pub(super) enum Until<'state> {
    /// Until the scheduler ends.
    Shutdown,
    /// Until the jobs of the scope have run. The worker is the one that opened it, and runs its pinned jobs.
    Finished(&'state ScopeState),
}

impl Until<'_> {
    fn has_come(self, shared: &Shared) -> bool {
        match self {
            Self::Shutdown => shared.is_shut_down(),
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
