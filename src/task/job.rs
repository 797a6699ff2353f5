//! One job, and what becomes of its panic.

use std::{
    any::Any,
    mem,
    panic::{AssertUnwindSafe, catch_unwind},
};

use thiserror::Error;

use super::{
    closure::Closure,
    region::{Crew, Region},
    worker::Worker,
};

/// A job panicked. The scheduler it ran on is unharmed.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("a job panicked: {message}")]
#[non_exhaustive]
pub struct JobPanic {
    /// What the panic said: its payload where that is a `&str` or a `String`, as with the `panic!` macro, and otherwise
    /// a fixed text.
    pub message: String,
}

impl JobPanic {
    #[cold]
    fn new(payload: Box<dyn Any + Send>) -> Self {
        let text = match payload.downcast_ref::<&str>() {
            Some(text) => Some(*text),
            None => payload.downcast_ref::<String>().map(String::as_str),
        };
        let message = text.unwrap_or("a panic whose payload is not text").to_owned();
        discard(payload);
        Self { message }
    }
}

/// Calls `call`, and makes an error of its panic.
///
/// The closure need not be unwind safe: whoever goes on after the error has to see to it that nothing half-done is
/// used.
///
/// # Errors
///
/// [`JobPanic`] with the message of the panic. With `panic = "abort"` there is no such error, as the process ends.
///
/// # Example
///
/// ```
/// # use drawloom::task::catch;
/// let panic = catch(|| [1, 2, 3].iter().position(|&number| number == 4).expect("four is there")).unwrap_err();
/// assert_eq!(format!("process \"count\": {}", panic.message), "process \"count\": four is there");
/// ```
#[inline]
pub fn catch<R>(call: impl FnOnce() -> R) -> Result<R, JobPanic> {
    catch_unwind(AssertUnwindSafe(call)).map_err(JobPanic::new)
}

/// Drops what is a user's and may panic at that, which then has nobody left to hear it. The payload of that second
/// panic is leaked, as dropping it might panic as well, and so on.
pub(crate) fn discard<T>(value: T) {
    if let Err(payload) = catch_unwind(AssertUnwindSafe(|| drop(value))) {
        mem::forget(payload);
    }
}

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
    /// How many regions were open on the worker that queued it, which tells a worker that waits for the innermost
    /// which of its jobs belong there.
    pub(super) depth: u32,
    /// Whether a worker has taken it out of another one's queue.
    pub(super) is_stolen: bool,
}

impl Job {
    /// Does the work. By the time it returns the closure and all it had captured are gone.
    pub(super) fn run(self, worker: &Worker) {
        let Self { work, region, .. } = self;
        let outcome = match work {
            Work::Closure(closure) => catch(|| closure.call(region, worker)),
            Work::Token(token) => catch(|| region.tokens().run(token, &Crew::new(region, worker))),
        };
        if let Err(panic) = outcome {
            region.fail(panic);
        }
    }
}
