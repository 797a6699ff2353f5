//! Scopes: jobs that borrow, and a thread that waits for them.

use std::{fmt, marker::PhantomData};

use crate::unwind::JobPanic;

use super::{
    closure::Closure,
    job::Work,
    priority::Priority,
    region::{self, Region, TokenContext, Tokens},
    seat,
    worker::Worker,
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
    region: &'static Region,
    /// Makes the lifetime invariant. A scope that could pass for one of a shorter life would take jobs that borrow what
    /// does not live long enough.
    lifetime: PhantomData<&'scope mut &'scope ()>,
}

impl<'scope> Scope<'scope> {
    /// A scope over the region. Its lifetime is right if it is the one that the region was opened with, or if nobody but
    /// a job of this scope gets to see it, as such a job has been erased together with it.
    pub(super) fn new(region: &'static Region) -> Self {
        Self { region, lifetime: PhantomData }
    }

    /// Adds a job that any worker may run, in no particular order.
    ///
    /// It is queued with the worker this is called on if that waits for the scope, or if the scope was opened from outside of
    /// all jobs. That worker runs the newest of its jobs first, while others take its oldest. Otherwise it goes to the thread
    /// that opened the scope, where workers that look for something to do find it too. Called on a thread that is no worker
    /// of the scheduler just now, one that was lent the scope by the body or a job, it falls to the thread that opened it.
    pub fn spawn(&self, job: impl FnOnce(&Scope<'scope>, &Worker) + Send + 'scope) {
        let work = Self::work(job);
        seat::with_current(self.region.shared(), |current| match current {
            Some(worker) => worker.push(self.region, work, Priority::Normal),
            None => self.region.post(work),
        });
    }

    /// Adds a job that runs on the thread that opened the scope, and nowhere else, in the order of the calls.
    ///
    /// It runs when that thread waits for the scope, at the latest, and before other jobs that the thread could take up
    /// then, since nobody can take a pinned one off it.
    pub fn spawn_pinned(&self, job: impl FnOnce(&Scope<'scope>, &Worker) + Send + 'scope) {
        let work = Self::work(job);
        seat::with_current(self.region.shared(), |current| match current {
            Some(worker) => worker.push_pinned(self.region, work),
            None => self.region.post(work),
        });
    }

    /// Takes the lifetime away from the closure.
    fn work(closure: impl FnOnce(&Scope<'scope>, &Worker) + Send + 'scope) -> Work {
        // SAFETY:
        // 1. The closure is gone, run and dropped, before `'scope` ends. `'scope` outlives the call of `region::open` that
        //    opened the region, as it is a parameter of the function that calls it. `region::open` returns only when the
        //    latch is released, and an abort guard in it excludes that it unwinds. The job is counted when it is queued,
        //    and taken off after the closure is gone; and whoever spawns is counted itself: the body until it has
        //    returned, a job until it has run, and nobody can keep the scope for longer, as both are lent it for a
        //    lifetime of their own. A lost job would keep `region::open` waiting, not let it return.
        // 2. It is called with the region that its job was queued for, which is the one of this scope.
        Work::Closure(unsafe { Closure::new(closure) })
    }
}

impl fmt::Debug for Scope<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Scope").field("owner", &self.region.owner()).finish_non_exhaustive()
    }
}

/// Opens a scope on the worker, runs `body` in it, and works until its jobs have run. Does not unwind.
pub(super) fn open<'scope, R>(worker: &Worker, body: impl FnOnce(&Scope<'scope>) -> R) -> Result<R, JobPanic> {
    region::open(worker, &NoTokens, |region| body(&Scope::new(region)))
}

/// A scope's jobs are closures.
struct NoTokens;

impl Tokens for NoTokens {
    fn run(&self, _token: u64, _crew: &TokenContext<'_>) {
        unreachable!("nobody pushes tokens into a scope");
    }
}
