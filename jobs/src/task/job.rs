//! A job, as queues hold it.

use super::closure::Closure;
use super::region::{JobContext, Region};
use crate::unwind::catch;

/// What a job does.
pub(super) enum Work<W: JobContext> {
    /// Calls a closure. What it borrows is the responsibility of [`Scope`](super::Scope).
    Closure(Closure<Region<W>, W>),
    /// Runs this token of the region. It needs no memory but the deque's.
    Token(u64),
}

/// Work for some worker, and the region that waits for it. The region counts the job from before its creation until it
/// has run.
pub(super) struct Job<W: JobContext> {
    pub(super) work: Work<W>,
    pub(super) region: &'static Region<W>,
    /// Whether a worker has taken it out of another worker's queue.
    pub(super) is_stolen: bool,
}

impl<W: JobContext> Job<W> {
    /// Runs the job. When this returns, the closure and its captures have been dropped. Does not unwind.
    pub(super) fn run(self, worker: &W) {
        let Self { work, region, .. } = self;
        let outcome = match work {
            Work::Closure(closure) => catch(|| closure.call(region, worker)),
            Work::Token(token) => catch(|| region.tokens().run_token(token, region, worker)),
        };
        if let Err(panic) = outcome {
            region.fail(panic);
        }
    }
}
