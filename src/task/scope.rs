//! Scopes: jobs that borrow, and a thread that waits for them.

use std::{collections::VecDeque, fmt, marker::PhantomData, mem};

use crate::sync::{Arc, AtomicUsize, Mutex, Ordering};

use super::{
    job::{Closure, Job, JobPanic, catch, discard},
    latch::Latch,
    scheduler::Shared,
    seat,
    worker::{Until, Worker},
};

/// Where jobs are spawned that may borrow whatever outlives the call of [`Scheduler::scope`](super::Scheduler::scope).
///
/// Every job is given the scope again, to spawn more, and the [`Worker`] it runs on. What the body of the scope owns
/// itself cannot be borrowed, as the jobs may outlive the body:
///
/// ```compile_fail,E0597
/// # let scheduler = drawloom::task::Scheduler::new(2)?;
/// scheduler.scope(|scope| {
///     let local = 7;
///     scope.spawn(|_scope, _worker| assert_eq!(local, 7));
/// })?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Scope<'scope> {
    state: Arc<ScopeState>,
    /// Makes the lifetime invariant. A scope that could pass for one of a shorter life would take jobs that borrow what
    /// does not live long enough.
    lifetime: PhantomData<&'scope mut &'scope ()>,
}

impl<'scope> Scope<'scope> {
    /// A scope over the state. Its lifetime is right if it is the one that the state was opened with, or if nobody but
    /// a job of this scope gets to see it, as such a job has been erased together with it.
    pub(super) fn new(state: Arc<ScopeState>) -> Self {
        Self { state, lifetime: PhantomData }
    }

    /// Adds a job that any worker may run, in no particular order.
    ///
    /// It is queued with the worker this is called on, who runs the newest of its jobs first, while others take its
    /// oldest. Called on a thread that is no worker of the scheduler just now, one that was lent the scope by the body
    /// or a job, it falls to the thread that opened the scope.
    pub fn spawn(&self, job: impl FnOnce(&Scope<'scope>, &Worker) + Send + 'scope) {
        let job = self.job(job);
        match seat::current(&self.state.shared) {
            Some(worker) => worker.push(job),
            None => self.state.post(job),
        }
    }

    /// Adds a job that runs on the thread that opened the scope, and nowhere else, in the order of the calls.
    ///
    /// It runs when that thread waits for the scope, at the latest, and before other jobs that the thread could take up
    /// then, since nobody can take a pinned one off it.
    pub fn spawn_pinned(&self, job: impl FnOnce(&Scope<'scope>, &Worker) + Send + 'scope) {
        self.state.post(self.job(job));
    }

    pub(super) fn state(&self) -> &ScopeState {
        &self.state
    }

    /// Takes the lifetime away from the closure and counts it.
    fn job(&self, closure: impl FnOnce(&Scope<'scope>, &Worker) + Send + 'scope) -> Job {
        type Borrowing<'scope> = Box<dyn FnOnce(&Scope<'scope>, &Worker) + Send + 'scope>;
        let closure: Borrowing<'scope> = Box::new(closure);
        // SAFETY: The two types differ in lifetimes only, so they have one layout, and the call through the one is the
        // call through the other. That leaves two obligations.
        // 1. The closure is gone, run and dropped, before `'scope` ends. `'scope` outlives the call of `open` that made
        //    the state, as it is a parameter of that function. `open` returns only when the latch is released, and
        //    cannot unwind before: it catches the panic of its body, and `Job::run` that of a job. The count that is
        //    added below is taken off by `Job::run` after the closure is gone, and whoever spawns is counted itself:
        //    the body until it has returned, a job until it has run, and nobody can keep the scope for longer, as both
        //    are lent it for a lifetime of their own. A job that were lost would keep `open` waiting, not let it
        //    return.
        // 2. The closure is called with a `Scope<'static>` where it was made for a `Scope<'scope>`. It takes it for the
        //    latter, and may, as a scope holds nothing of that lifetime. Nobody sees it as `Scope<'static>` but
        //    `Job::run`, which spawns nothing.
        let closure = unsafe { mem::transmute::<Borrowing<'scope>, Closure>(closure) };
        self.state.latch.add();
        Job::new(closure, Arc::clone(&self.state))
    }
}

impl fmt::Debug for Scope<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Scope").field("owner", &self.state.owner).finish_non_exhaustive()
    }
}

/// Opens a scope on the worker, runs `body` in it, and works until its jobs have run. Does not unwind.
pub(super) fn open<'scope, R>(worker: &Worker, body: impl FnOnce(&Scope<'scope>) -> R) -> Result<R, JobPanic> {
    let scope = Scope::new(Arc::new(ScopeState::new(worker)));
    let state = scope.state();
    let result = catch(|| body(&scope)).inspect_err(|panic| state.fail(panic.clone()));
    // Even if this was the last, nobody has to be woken, and the latch is asked all the same: the acquire is there.
    state.latch.finish();
    worker.work(Until::Finished(state));
    let Some(first) = state.panic.lock().take() else { return result };
    discard(result);
    Err(first)
}

/// What the jobs of a scope share with the thread that waits for them.
pub(super) struct ScopeState {
    latch: Latch,
    /// The worker that opened the scope.
    owner: usize,
    /// The first panic, if there was one.
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

    /// Keeps the panic, unless there was one before.
    pub(super) fn fail(&self, panic: JobPanic) {
        self.panic.lock().get_or_insert(panic);
    }

    /// Counts a job off, and wakes the owner after the last. The caller's share keeps the state for that.
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

    /// Hands a job to the owner.
    fn post(&self, job: Job) {
        self.mailbox.put(job);
        self.shared.sleep().wake_worker(self.owner);
    }
}

/// The jobs that only the owner of the scope runs, first in, first out.
///
/// The count is only a hint, so it is relaxed: it saves the owner the lock where there is nothing. That a sleeping
/// owner learns of a job is up to the fences of [`Sleep`](super::sleep::Sleep), and the lock orders the job itself.
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
