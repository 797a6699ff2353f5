//! One job, and what becomes of its panic.

use std::{
    any::Any,
    mem,
    panic::{AssertUnwindSafe, catch_unwind},
};

use thiserror::Error;

use crate::sync::Arc;

use super::{
    scope::{Scope, ScopeState},
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
pub fn catch<R>(call: impl FnOnce() -> R) -> Result<R, JobPanic> {
    catch_unwind(AssertUnwindSafe(call)).map_err(|payload| {
        let message = text(payload.as_ref()).unwrap_or("a panic whose payload is not text").to_owned();
        discard(payload);
        JobPanic { message }
    })
}

/// Drops what is a user's and may panic at that, which then has nobody left to hear it. The payload of that second
/// panic is leaked, as dropping it might panic as well, and so on.
pub(super) fn discard<T>(value: T) {
    if let Err(payload) = catch_unwind(AssertUnwindSafe(|| drop(value))) {
        mem::forget(payload);
    }
}

fn text(payload: &(dyn Any + Send)) -> Option<&str> {
    match payload.downcast_ref::<&str>() {
        Some(text) => Some(text),
        None => payload.downcast_ref::<String>().map(String::as_str),
    }
}

/// What a job runs. The lifetime of what it borrows has been taken away by [`Scope`], which vouches for it.
pub(super) type Closure = Box<dyn FnOnce(&Scope<'static>, &Worker) + Send>;

/// A closure on its way to a worker, and the scope that waits for it.
pub(super) struct Job {
    closure: Closure,
    scope: Arc<ScopeState>,
}

impl Job {
    /// A job that is counted by its scope already.
    pub(super) fn new(closure: Closure, scope: Arc<ScopeState>) -> Self {
        Self { closure, scope }
    }

    /// Runs the closure, and then counts it off: by then the call has returned or unwound, and the closure and all it
    /// had captured are gone, so the scope may end.
    pub(super) fn run(self, worker: &Worker) {
        let Self { closure, scope } = self;
        let scope = Scope::new(scope);
        if let Err(panic) = catch(|| closure(&scope, worker)) {
            scope.state().fail(panic);
        }
        scope.state().finish();
    }
}
