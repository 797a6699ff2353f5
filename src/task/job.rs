//! One job.

use crate::unwind::catch;

use super::{
    closure::Closure,
    region::{Region, TokenContext},
    worker::Worker,
};

/// What a job does.
pub(super) enum Work {
    /// Something of its own. What it borrows is [`Scope`](super::scope::Scope)'s to vouch for.
    Closure(Closure),
    /// What the region's [`Tokens`](super::region::Tokens) do with this number. It takes no memory but the deque's.
    Token(u64),
}

/// Work on its way to a worker, and the region that waits for it. It is counted by the region from before it is made
/// until after it has run.
pub(super) struct Job {
    pub(super) work: Work,
    pub(super) region: &'static Region,
    /// Whether a worker has taken it out of another one's queue.
    pub(super) is_stolen: bool,
}

impl Job {
    /// Does the work. By the time it returns the closure and all it had captured are gone.
    pub(super) fn run(self, worker: &Worker) {
        let Self { work, region, .. } = self;
        let outcome = match work {
            Work::Closure(closure) => catch(|| closure.call(region, worker)),
            Work::Token(token) => catch(|| region.tokens().run(token, &TokenContext::new(region, worker))),
        };
        if let Err(panic) = outcome {
            region.fail(panic);
        }
    }
}
