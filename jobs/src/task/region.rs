//! What a thread waits for: a scope, a loop or the run of a graph, with all jobs that belong to it.
//!
//! A region lies on the stack of the thread that opened it, its *owner*, and its jobs refer to it there, so opening one
//! allocates nothing. The owner waits until the latch is released, which is when every counted job has run.
//!
//! There are two kinds of jobs. A [`Scope`](super::Scope) takes any closures. A loop or a graph repeats one kind of
//! work, and describes each piece by a number, a *token*, which needs no memory of its own.

use std::ptr;

use crossbeam_utils::CachePadded;

use super::latch::Latch;
use crate::sync::{Arc, Mutex};
use crate::unwind::JobPanic;

/// The worker that runs a job, as far as jobs, regions and queues know it: they only pass it on. So they depend on
/// nothing above them.
pub(super) trait JobContext: Sized + 'static {
    /// What all workers of a scheduler share.
    type Shared: Send + Sync;
}

/// Runs the tokens of a region.
pub(super) trait RunToken<W: JobContext>: Sync {
    /// Runs the piece of work that this token stands for.
    fn run_token(&self, token: u64, region: &'static Region<W>, worker: &W);
}

/// All jobs that one thread waits for.
pub(super) struct Region<W: JobContext> {
    latch: CachePadded<Latch>,
    owner: usize,
    level: usize,
    kind: RegionKind,
    /// The first panic of a job.
    panic: Mutex<Option<JobPanic>>,
    tokens: &'static dyn RunToken<W>,
    shared: Arc<W::Shared>,
}

/// What a region is part of.
#[derive(Clone, Copy)]
pub(super) struct RegionKind {
    /// Whether a thread that called the scheduler from outside opened it, for a frame. While its owner waits, it runs
    /// any job of the frame.
    pub(super) is_outermost: bool,
    /// Whether it is part of a background job, so that its jobs are background jobs too.
    pub(super) is_background: bool,
}

impl<W: JobContext> Region<W> {
    /// A region with a count of one, that of its body. `owner` is the worker that opens it, and `level` the number of
    /// regions that the worker has open already.
    #[inline]
    pub(super) fn new(
        owner: usize,
        level: usize,
        kind: RegionKind,
        tokens: &'static dyn RunToken<W>,
        shared: Arc<W::Shared>,
    ) -> Self {
        let (latch, panic) = (CachePadded::new(Latch::new(1)), Mutex::new(None));
        Self { latch, owner, level, kind, panic, tokens, shared }
    }

    #[inline]
    pub(super) fn latch(&self) -> &Latch {
        &self.latch
    }

    /// The worker that opened the region.
    #[inline]
    pub(super) fn owner(&self) -> usize {
        self.owner
    }

    /// How many regions the owner had open before this one.
    #[inline]
    pub(super) fn level(&self) -> usize {
        self.level
    }

    #[inline]
    pub(super) fn is_outermost(&self) -> bool {
        self.kind.is_outermost
    }

    #[inline]
    pub(super) fn is_background(&self) -> bool {
        self.kind.is_background
    }

    #[inline]
    pub(super) fn tokens(&self) -> &'static dyn RunToken<W> {
        self.tokens
    }

    #[inline]
    pub(super) fn shared(&self) -> &Arc<W::Shared> {
        &self.shared
    }

    /// Stores the panic for the owner, unless there was one before.
    pub(super) fn fail(&self, panic: JobPanic) {
        self.panic.lock().get_or_insert(panic);
    }

    pub(super) fn take_panic(&self) -> Option<JobPanic> {
        self.panic.lock().take()
    }

    #[inline]
    pub(super) fn is(&self, other: &Self) -> bool {
        ptr::eq(self, other)
    }
}
