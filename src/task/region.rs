//! What a thread waits for: the jobs it hands out, and those that these hand out in turn.
//!
//! A region lies on the stack of the thread that opened it, its *owner*, and jobs refer to it there, so that to open one
//! takes no memory. It is closed when its latch is released, which is when each job that was counted has run.
//!
//! To count every job in and off on one latch would send its cache line to and fro with each. So a worker counts in
//! advance, for some jobs together, and keeps what it has not used as *credit*; the count of a job that it has run is
//! credit as well, for the next one that it pushes. It gives its credit back when it finds nothing to do
//! ([`Worker::settle`]). The latch is released, then, when all credit has come back: when no job is left and every
//! worker has seen so.
//!
//! Jobs of two kinds exist. A [`Scope`](super::scope::Scope) takes closures of any sort. A loop or a graph has work of
//! one sort only, many times over, and describes each piece in a number, a *token*, which costs no memory.

use std::{mem, ptr};

use crossbeam_utils::CachePadded;

use crate::{
    sync::{Arc, Mutex},
    unwind::{AbortOnUnwind, JobPanic, catch},
};

use super::{
    job::{Job, Work},
    latch::Latch,
    priority::Priority,
    scheduler::Shared,
    worker::Worker,
};

/// What the tokens of a region stand for.
pub(crate) trait Tokens: Sync {
    /// Does what this token stands for.
    fn run(&self, token: u64, crew: &TokenContext<'_>);
}

/// A worker at work on the tokens of a region: the way to push more.
pub(crate) struct TokenContext<'worker> {
    region: &'static Region,
    worker: &'worker Worker,
}

impl<'worker> TokenContext<'worker> {
    /// Only for the length of a job of this region, or of the body that opened it.
    pub(super) fn new(region: &'static Region, worker: &'worker Worker) -> Self {
        Self { region, worker }
    }

    pub(crate) fn worker(&self) -> &'worker Worker {
        self.worker
    }

    /// Whether the worker is the one that opened the region, and so the one that runs its pinned tokens.
    pub(crate) fn is_owner(&self) -> bool {
        self.region.owner == self.worker.index()
    }

    /// Whether a pinned token waits for this worker, which nobody else can run.
    pub(crate) fn has_pinned(&self) -> bool {
        self.is_owner() && self.worker.shared().mailbox(self.region.owner).has_pinned(self.region)
    }

    /// Keeps the panic for whoever waits for the region, unless there was one before.
    pub(super) fn fail(&self, panic: JobPanic) {
        self.region.fail(panic);
    }

    /// Queues a token, for any worker.
    pub(crate) fn push(&self, token: u64, band: Priority) {
        self.worker.push(self.region, Work::Token(token), band);
    }

    /// Hands a token to the thread that opened the region, in the order of the calls.
    pub(crate) fn push_pinned(&self, token: u64) {
        self.worker.push_pinned(self.region, Work::Token(token));
    }
}

/// Calls `start`, and returns when all tokens that it pushed have run, and all that those pushed. Does not unwind.
///
/// # Errors
///
/// The first panic of `start` or of a token. All other tokens have run.
pub(crate) fn run_tokens(
    worker: &Worker,
    tokens: &dyn Tokens,
    start: impl FnOnce(&TokenContext<'_>),
) -> Result<(), JobPanic> {
    open(worker, tokens, |region| start(&TokenContext::new(region, worker)))
}

/// Opens a region on the worker, runs `body` in it, and works until its jobs have run. Does not unwind.
pub(super) fn open<R>(
    worker: &Worker,
    tokens: &dyn Tokens,
    body: impl FnOnce(&'static Region) -> R,
) -> Result<R, JobPanic> {
    // SAFETY: The types differ in lifetimes only, and the referent outlives this call. Only jobs of the region use the
    // reference. Each is counted from before it is queued until it has run, and `wait_inside` returns only when the count
    // is zero. `guard`, which is made before the reference is used, excludes that this function unwinds before.
    let tokens = unsafe { mem::transmute::<&dyn Tokens, &'static dyn Tokens>(tokens) };
    let storage = Region {
        latch: CachePadded::new(Latch::new(1)),
        owner: worker.index(),
        level: worker.depth(),
        is_outermost: worker.opens_outermost(),
        is_background: worker.is_in_background(),
        panic: Mutex::new(None),
        tokens,
        shared: Arc::clone(worker.shared()),
    };
    // SAFETY: The storage is not moved, and outlives every use of the reference. `body` uses it before it returns, counted
    // jobs before they are counted off, and workers with credit before they give it back, which is counted too. Whoever
    // takes the last count off does not use it afterwards. `wait_inside` returns only when the count is zero, and `guard`
    // excludes that this function unwinds before.
    let region: &'static Region = unsafe { &*ptr::from_ref(&storage) };
    // The last of the locals, so that an unwind comes to it before it drops any other.
    let guard = AbortOnUnwind::new("an open region of jobs");
    let result = worker.wait_inside(region, || catch(|| body(region)).inspect_err(|panic| region.fail(panic.clone())));
    guard.disarm();
    result
}

/// The jobs that one thread waits for.
pub(super) struct Region {
    latch: CachePadded<Latch>,
    /// The worker that opened the region.
    owner: usize,
    /// How many regions the owner had open before.
    level: usize,
    /// Whether it was opened by a thread that called the scheduler from outside, for a frame. Its owner helps with
    /// everything of the frame while it waits.
    is_outermost: bool,
    /// Whether it is part of a background job, so that its jobs are too.
    is_background: bool,
    /// The first panic, if there was one.
    panic: Mutex<Option<JobPanic>>,
    tokens: &'static dyn Tokens,
    shared: Arc<Shared>,
}

impl Region {
    pub(super) fn latch(&self) -> &Latch {
        &self.latch
    }

    pub(super) fn owner(&self) -> usize {
        self.owner
    }

    pub(super) fn level(&self) -> usize {
        self.level
    }

    pub(super) fn is_outermost(&self) -> bool {
        self.is_outermost
    }

    pub(super) fn is_background(&self) -> bool {
        self.is_background
    }

    pub(super) fn tokens(&self) -> &'static dyn Tokens {
        self.tokens
    }

    pub(super) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    /// Keeps the panic, unless there was one before.
    pub(super) fn fail(&self, panic: JobPanic) {
        self.panic.lock().get_or_insert(panic);
    }

    pub(super) fn take_panic(&self) -> Option<JobPanic> {
        self.panic.lock().take()
    }

    /// Hands a job to the owner, from a thread that is no worker. It is one that the scope was lent to by a job, which is
    /// counted.
    pub(super) fn post(&'static self, work: Work) {
        self.latch.add(1);
        self.shared.mailbox(self.owner).put_pinned(Job { work, region: self, is_stolen: false });
        self.shared.sleep().wake_worker(self.owner);
    }

    pub(super) fn is(&self, other: &Self) -> bool {
        ptr::eq(self, other)
    }
}
