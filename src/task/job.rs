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

/// A job panicked.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("a job panicked: {message}")]
#[non_exhaustive]
pub struct JobPanic {
    /// What the panic said, or a fixed text where its payload is neither a `&str` nor a `String`.
    pub message: String,
}

/// Calls `f`, and turns a panic into an error.
///
/// # Errors
///
/// [`JobPanic`] with the panic's message.
pub fn catch<R>(f: impl FnOnce() -> R) -> Result<R, JobPanic> {
    catch_unwind(AssertUnwindSafe(f)).map_err(|payload| {
        let message = message(payload.as_ref());
        discard(payload);
        JobPanic { message }
    })
}

fn message(payload: &(dyn Any + Send)) -> String {
    if let Some(text) = payload.downcast_ref::<&str>() {
        (*text).to_owned()
    } else if let Some(text) = payload.downcast_ref::<String>() {
        text.clone()
    } else {
        "a payload that is no text".to_owned()
    }
}

/// Drops a payload, which is the user's and may panic in turn. What that second panic carries is leaked, as there is no end
/// to it otherwise.
pub(super) fn discard<T>(value: T) {
    if let Err(payload) = catch_unwind(AssertUnwindSafe(|| drop(value))) {
        mem::forget(payload);
    }
}

/// The closure of a job, with the lifetime of what it borrows taken away.
pub(super) type Closure = Box<dyn FnOnce(&Scope<'static>, &Worker) + Send>;

/// A closure that waits in a deque or a mailbox, and the scope that waits for it.
pub(super) struct Job {
    pub(super) closure: Closure,
    pub(super) scope: Arc<ScopeState>,
}

impl Job {
    /// Runs the closure and then counts it off, so that nothing of the closure is left when its scope may end.
    pub(super) fn run(self, worker: &Worker) {
        let Self { closure, scope } = self;
        let scope = Scope::new(scope);
        if let Err(panic) = catch(|| closure(&scope, worker)) {
            scope.state().fail(panic);
        }
        scope.state().finish();
    }
}
