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

use crate::sync::{Arc, AtomicBool, Mutex, Ordering};

use super::{
    job::{Job, JobPanic, Work, catch},
    latch::Latch,
    queue::Band,
    scheduler::Shared,
    worker::Worker,
};

/// What the tokens of a region stand for.
pub(crate) trait Tokens: Sync {
    /// Does what this token stands for.
    fn run(&self, token: u64, crew: &Crew<'_>);
}

/// A worker at work on the tokens of a region: the way to push more.
pub(crate) struct Crew<'worker> {
    region: &'static Region,
    worker: &'worker Worker,
}

impl<'worker> Crew<'worker> {
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
        self.is_owner() && self.worker.shared().mailbox(self.worker.index()).has(self.region)
    }

    /// Keeps the panic for whoever waits for the region, unless there was one before.
    pub(super) fn fail(&self, panic: JobPanic) {
        self.region.fail(panic);
    }

    /// Queues a token, for any worker.
    pub(crate) fn push(&self, token: u64, band: Band) {
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
pub(crate) fn run_tokens(worker: &Worker, tokens: &dyn Tokens, start: impl FnOnce(&Crew<'_>)) -> Result<(), JobPanic> {
    open(worker, tokens, |region| start(&Crew::new(region, worker)))
}

/// Opens a region on the worker, runs `body` in it, and works until its jobs have run. Does not unwind.
pub(super) fn open<R>(
    worker: &Worker,
    tokens: &dyn Tokens,
    body: impl FnOnce(&'static Region) -> R,
) -> Result<R, JobPanic> {
    // SAFETY: The types differ in lifetimes only. The reference is used by jobs of the region alone, which are counted,
    // and this function neither returns nor unwinds before all that are counted have run: it catches the panic of the
    // body, and `Job::run` that of a job.
    let tokens = unsafe { mem::transmute::<&dyn Tokens, &'static dyn Tokens>(tokens) };
    let storage = Region {
        latch: CachePadded::new(Latch::new(1)),
        owner: worker.index(),
        is_background: worker.is_in_background(),
        owner_starves: AtomicBool::new(false),
        panic: Mutex::new(None),
        tokens,
        shared: Arc::clone(worker.shared()),
    };
    // SAFETY: The storage is not moved, and is there for as long as anybody has the reference. That is the body, the
    // counted jobs until they have run, and workers with credit, which is counted. Who takes the last count off uses the
    // reference no more.
    let region: &'static Region = unsafe { &*ptr::from_ref(&storage) };
    worker.wait_inside(region, || catch(|| body(region)).inspect_err(|panic| region.fail(panic.clone())))
}

/// The jobs that one thread waits for.
pub(super) struct Region {
    latch: CachePadded<Latch>,
    /// The worker that opened the region.
    owner: usize,
    /// Whether it is part of a background job, so that its jobs are too.
    is_background: bool,
    /// Whether the owner waits, may not help anybody else, and has nothing to do.
    owner_starves: AtomicBool,
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

    /// Whether the next job does better to go to the owner at once. One does, as nobody can take it off the owner again. It is
    /// a hint, so it is relaxed: a job that is handed over is found in the mailbox in any case, and one that is not is
    /// found by whoever steals.
    pub(super) fn feed_owner(&self) -> bool {
        // The look before the swap spares others the cache line.
        self.owner_starves.load(Ordering::Relaxed) && self.owner_starves.swap(false, Ordering::Relaxed)
    }

    pub(super) fn set_owner_starves(&self, starves: bool) {
        self.owner_starves.store(starves, Ordering::Relaxed);
    }

    /// Hands a job to the owner, from a thread that is no worker. It is one that the scope was lent to by a job, which is
    /// counted.
    pub(super) fn post(&'static self, work: Work) {
        self.latch.add(1);
        self.shared.mailbox(self.owner).put(Job { work, region: self, depth: 0, is_stolen: false });
        self.shared.sleep().wake_worker(self.owner);
    }

    pub(super) fn is(&self, other: &Self) -> bool {
        ptr::eq(self, other)
    }
}
