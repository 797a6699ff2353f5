//! Scopes: jobs that borrow, and a thread that waits for them.

use std::fmt;
use std::marker::PhantomData;

use super::closure::Closure;
use super::current_worker;
use super::job::{Job, Work};
use super::priority::Priority;
use super::region::Region;
use super::tokens::{TokenContext, Tokens};
use super::worker::Worker;
use crate::unwind::JobPanic;

/// Spawns jobs that may borrow anything that outlives the call of [`Scheduler::scope`](super::Scheduler::scope).
///
/// Every job gets the scope, to spawn more jobs, and the [`Worker`] that it runs on. Jobs cannot borrow what the body
/// of the scope owns, because they may outlive the body:
///
/// ```compile_fail,E0597
/// # let scheduler = drawloom_jobs::task::Scheduler::new(2)?;
/// scheduler.scope(|scope| {
///     let local = 7;
///     scope.spawn(|_scope, _worker| assert_eq!(local, 7));
/// })?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Scope<'scope> {
    region: &'static Region<Worker>,
    /// Makes the lifetime invariant. If a scope could pass for one with a shorter lifetime, it would accept jobs that
    /// borrow what does not live long enough.
    lifetime: PhantomData<&'scope mut &'scope ()>,
}

impl<'scope> Scope<'scope> {
    /// A scope over the region. `'scope` must be the lifetime that the region was opened with.
    fn new(region: &'static Region<Worker>) -> Self {
        Self { region, lifetime: PhantomData }
    }

    /// Spawns a job that any worker may run, in no particular order.
    ///
    /// The job goes to the queues of the calling worker if that worker waits for the scope, or if the scope was opened
    /// outside of all jobs. A worker runs the newest job of its queues first, while others steal the oldest. Otherwise
    /// the job goes to the thread that opened the scope, where workers that look for jobs find it too. On a thread that
    /// is not a worker of the scheduler, to which the body or a job has lent the scope, the job goes to the thread that
    /// opened the scope.
    pub fn spawn(&self, job: impl FnOnce(&Scope<'scope>, &Worker) + Send + 'scope) {
        let work = Self::work(job);
        current_worker::with_current(self.region.shared(), |current| match current {
            Some(worker) => worker.push(self.region, work, Priority::Normal),
            None => self.push_from_outside(work),
        });
    }

    /// Spawns a job that only the thread that opened the scope runs. That thread runs pinned jobs in the order of the
    /// calls.
    ///
    /// It runs them when it waits for the scope, at the latest, and before any other jobs, because no other thread can.
    pub fn spawn_pinned(&self, job: impl FnOnce(&Scope<'scope>, &Worker) + Send + 'scope) {
        let work = Self::work(job);
        current_worker::with_current(self.region.shared(), |current| match current {
            Some(worker) => worker.push_pinned(self.region, work),
            None => self.push_from_outside(work),
        });
    }

    /// Hands a job to the owner of the region, from a thread that is no worker. The body or a job has lent it the
    /// scope, and that is counted, so the latch is not released yet.
    fn push_from_outside(&self, work: Work<Worker>) {
        let Self { region, .. } = *self;
        region.latch().add(1);
        region.shared().mailbox(region.owner()).put_pinned(Job { work, region, is_stolen: false });
        region.shared().sleep().wake_worker(region.owner());
    }

    /// Erases the type and the lifetime of a job.
    fn work(job: impl FnOnce(&Scope<'scope>, &Worker) + Send + 'scope) -> Work<Worker> {
        // The region is the one that the job was queued for, which is that of this scope, so `'scope` is its lifetime.
        let closure =
            move |region: &'static Region<Worker>, worker: &Worker| job(&Scope::<'scope>::new(region), worker);
        // SAFETY: The closure must be called or dropped before `'scope` ends.
        // - `'scope` outlives the call of `Worker::open_region` that opened the region, because it is a parameter of
        //   the function that makes that call.
        // - `Worker::open_region` returns only when the latch is released, and a guard in it aborts if it unwinds.
        // - The job is counted when it is queued, and counted off after its closure has been called and dropped.
        // - The latch is not released before the job is queued, because the spawning code is counted too: the body
        //   until it returns, a job until it has run. Neither can keep the scope longer, as each borrows it for a
        //   lifetime of its own.
        // - A lost job would make `Worker::open_region` wait for ever, not return.
        Work::Closure(unsafe { Closure::new(closure) })
    }
}

impl fmt::Debug for Scope<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Scope").field("owner", &self.region.owner()).finish_non_exhaustive()
    }
}

/// Opens a scope on the worker, runs `body` in it, and works until all of its jobs have run. Does not unwind.
///
/// # Errors
/// Returns the panic if the body or a job panicked.
pub(super) fn open<'scope, R>(worker: &Worker, body: impl FnOnce(&Scope<'scope>) -> R) -> Result<R, JobPanic> {
    worker.open_region(&NoTokens, |region| body(&Scope::new(region)))
}

/// The jobs of a scope are closures.
struct NoTokens;

impl Tokens for NoTokens {
    fn run(&self, _token: u64, _context: &TokenContext<'_>) {
        unreachable!("a scope has no tokens");
    }
}
