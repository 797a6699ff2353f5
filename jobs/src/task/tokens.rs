//! Regions whose jobs are tokens: loops and the runs of graphs.

use super::job::Work;
use super::priority::Priority;
use super::region::{Region, RunToken};
use super::worker::Worker;
use crate::unwind::JobPanic;

/// What the tokens of a region stand for.
pub(crate) trait Tokens: Sync {
    /// Runs the piece of work that this token stands for.
    fn run(&self, token: u64, context: &TokenContext<'_>);
}

impl<T: Tokens> RunToken<Worker> for T {
    #[inline]
    fn run_token(&self, token: u64, region: &'static Region<Worker>, worker: &Worker) {
        self.run(token, &TokenContext { region, worker });
    }
}

/// A worker that runs a token of a region, and can push more of them.
pub(crate) struct TokenContext<'worker> {
    region: &'static Region<Worker>,
    worker: &'worker Worker,
}

impl<'worker> TokenContext<'worker> {
    #[inline]
    pub(crate) fn worker(&self) -> &'worker Worker {
        self.worker
    }

    /// Whether the worker opened the region, and so runs its pinned tokens.
    #[inline]
    pub(crate) fn is_owner(&self) -> bool {
        self.region.owner() == self.worker.index()
    }

    /// Whether a pinned token waits for this worker, the only one that can run it.
    pub(crate) fn has_pinned(&self) -> bool {
        self.is_owner() && self.worker.shared().mailbox(self.region.owner()).has_pinned(self.region)
    }

    /// Stores the panic for the owner of the region, unless there was one before.
    pub(super) fn fail(&self, panic: JobPanic) {
        self.region.fail(panic);
    }

    /// Queues a token that any worker may run.
    pub(crate) fn push(&self, token: u64, priority: Priority) {
        self.worker.push(self.region, Work::Token(token), priority);
    }

    /// Hands a token to the thread that opened the region. That thread runs pinned tokens in the order of the calls.
    pub(crate) fn push_pinned(&self, token: u64) {
        self.worker.push_pinned(self.region, Work::Token(token));
    }
}

/// Calls `start`, and returns when all tokens that it pushed, and that those pushed, have run. Does not unwind.
///
/// # Errors
/// Returns the first [`JobPanic`] of `start` or of a token. All other tokens have run nevertheless.
pub(crate) fn run_tokens(
    worker: &Worker,
    tokens: &impl Tokens,
    start: impl FnOnce(&TokenContext<'_>),
) -> Result<(), JobPanic> {
    worker.open_region(tokens, |region| start(&TokenContext { region, worker }))
}
