//! Scopes.

use std::{collections::VecDeque, marker::PhantomData, mem};

use crate::sync::{Arc, AtomicUsize, Mutex, Ordering};

use super::{
    job::{Closure, Job, JobPanic, catch, discard},
    latch::Latch,
    scheduler::Shared,
    worker::{Until, Worker},
};

/// Where jobs are spawned that may borrow everything that outlives the scope.
pub struct Scope<'scope> {
    state: Arc<ScopeState>,
    /// Invariant: a scope that takes jobs for `'scope` must pass neither for one that takes shorter nor longer ones.
    lifetime: PhantomData<&'scope mut &'scope ()>,
}

impl<'scope> Scope<'scope> {
    pub(super) fn new(state: Arc<ScopeState>) -> Self {
        Self { state, lifetime: PhantomData }
    }

    /// Adds a job, to be run on any worker.
    pub fn spawn(&self, job: impl FnOnce(&Scope<'scope>, &Worker) + Send + 'scope) {
        let job = self.job(job);
        match Worker::current(&self.state.shared) {
            Some(worker) => worker.push(job),
            None => self.state.post(job),
        }
    }

    /// Adds a job that is run on the thread that opened the scope, and nowhere else.
    pub fn spawn_pinned(&self, job: impl FnOnce(&Scope<'scope>, &Worker) + Send + 'scope) {
        self.state.post(self.job(job));
    }

    pub(super) fn state(&self) -> &ScopeState {
        &self.state
    }

    fn job(&self, closure: impl FnOnce(&Scope<'scope>, &Worker) + Send + 'scope) -> Job {
        let closure: Box<dyn FnOnce(&Scope<'scope>, &Worker) + Send + 'scope> = Box::new(closure);
        // SAFETY: later.
        let closure =
            unsafe { mem::transmute::<Box<dyn FnOnce(&Scope<'scope>, &Worker) + Send + 'scope>, Closure>(closure) };
        self.state.latch.add();
        Job { closure, scope: Arc::clone(&self.state) }
    }
}

/// Opens a scope on the worker, runs `body` in it and works until all its jobs have run.
pub(super) fn open<'scope, R>(worker: &Worker, body: impl FnOnce(&Scope<'scope>) -> R) -> Result<R, JobPanic> {
    let state = Arc::new(ScopeState::new(worker));
    let scope = Scope::new(Arc::clone(&state));
    let outcome = catch(|| body(&scope));
    // The thread that would be woken by the last is this one. It asks the latch all the same: the acquire is there.
    let _ = state.latch.finish();
    worker.work(Until::Finished(&state));
    match (state.panic.lock().take(), outcome) {
        (None, outcome) => outcome,
        (Some(panic), outcome) => {
            discard(outcome);
            Err(panic)
        }
    }
}

/// What a scope's jobs share with the thread that waits for them.
pub(super) struct ScopeState {
    latch: Latch,
    owner: usize,
    panic: Mutex<Option<JobPanic>>,
    mailbox: Mailbox,
    shared: Arc<Shared>,
}

impl ScopeState {
    fn new(owner: &Worker) -> Self {
        Self {
            latch: Latch::new(1),
            owner: owner.index(),
            panic: Mutex::new(None),
            mailbox: Mailbox::new(),
            shared: Arc::clone(owner.shared()),
        }
    }

    /// Keeps the first panic.
    pub(super) fn fail(&self, panic: JobPanic) {
        self.panic.lock().get_or_insert(panic);
    }

    /// Counts one job off, and wakes the owner after the last.
    pub(super) fn finish(&self) {
        if self.latch.finish() {
            self.shared.sleep().wake_worker(self.owner);
        }
    }

    pub(super) fn is_finished(&self) -> bool {
        self.latch.is_released()
    }

    pub(super) fn mailbox(&self) -> &Mailbox {
        &self.mailbox
    }

    /// Hands a job to the thread that opened the scope.
    fn post(&self, job: Job) {
        self.mailbox.put(job);
        self.shared.sleep().wake_worker(self.owner);
    }
}

/// Jobs for the owner of the scope alone, first in, first out.
pub(super) struct Mailbox {
    count: AtomicUsize,
    jobs: Mutex<VecDeque<Job>>,
}

impl Mailbox {
    fn new() -> Self {
        Self { count: AtomicUsize::new(0), jobs: Mutex::new(VecDeque::new()) }
    }

    fn put(&self, job: Job) {
        let mut jobs = self.jobs.lock();
        jobs.push_back(job);
        self.count.store(jobs.len(), Ordering::Relaxed);
    }

    pub(super) fn take(&self) -> Option<Job> {
        if self.is_empty() {
            return None;
        }
        let mut jobs = self.jobs.lock();
        let job = jobs.pop_front();
        self.count.store(jobs.len(), Ordering::Relaxed);
        job
    }

    pub(super) fn is_empty(&self) -> bool {
        self.count.load(Ordering::Relaxed) == 0
    }
}
