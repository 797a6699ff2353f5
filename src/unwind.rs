//! What becomes of panics in code that an engine supplies: jobs, hooks, clocks, and subscribers of `tracing`.
//!
//! A panic is caught where the engine's code is called, and becomes an error there. Where an unwind would leave memory
//! that another thread still uses, an [`AbortOnUnwind`] stands behind that, so that soundness never depends on every call
//! having been found.

use std::{
    any::Any,
    mem,
    panic::{AssertUnwindSafe, catch_unwind},
    process,
};

use thiserror::Error;

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

/// Drops a value of the engine's. If its destructor panics, nobody is left to hear it. The payload of that second panic is
/// leaked, as dropping it might panic as well, and so on.
pub(crate) fn discard<T>(value: T) {
    if let Err(payload) = catch_unwind(AssertUnwindSafe(|| drop(value))) {
        mem::forget(payload);
    }
}

/// Calls `event`, which sends an event to the engine's `tracing` subscriber. If the subscriber panics, the event is lost and
/// the panic ends here: its message has gone to the panic hook, and the work that is reported on goes on.
pub(crate) fn emit(event: impl FnOnce()) {
    if let Err(payload) = catch_unwind(AssertUnwindSafe(event)) {
        discard(payload);
    }
}

/// Aborts the process if it is dropped, which only an unwind does: every other way out [disarms](Self::disarm) it.
///
/// It guards code that other threads rely on to run to its end. Rayon does the same.
#[must_use = "it guards what follows until it is disarmed"]
pub(crate) struct AbortOnUnwind {
    what: &'static str,
}

impl AbortOnUnwind {
    /// `what` names the code that must not unwind, for the last message of the process.
    pub(crate) fn new(what: &'static str) -> Self {
        Self { what }
    }

    pub(crate) fn disarm(self) {
        mem::forget(self);
    }
}

impl Drop for AbortOnUnwind {
    #[cold]
    fn drop(&mut self) {
        // A model checker that has found something drops the threads of its model where they stand.
        if cfg!(any(drawloom_loom, drawloom_shuttle)) {
            return;
        }
        eprintln!("drawloom: a panic tried to unwind through {}, which other threads rely on: aborting", self.what);
        process::abort();
    }
}

#[cfg(all(test, not(any(drawloom_loom, drawloom_shuttle))))]
mod tests {
    use std::{env, panic::panic_any, process::Command};

    use super::{AbortOnUnwind, catch, emit};

    #[test]
    fn a_panic_in_an_event_ends_there() {
        emit(|| panic!("as planned"));
        struct PanicsAgain;
        impl Drop for PanicsAgain {
            fn drop(&mut self) {
                panic!("as planned");
            }
        }
        emit(|| panic_any(PanicsAgain));
    }

    #[test]
    fn a_disarmed_guard_does_nothing() {
        AbortOnUnwind::new("nothing").disarm();
    }

    /// This test is its own child process, which is the one that aborts. Miri starts no processes.
    #[test]
    #[cfg_attr(miri, ignore)]
    fn an_unwind_through_a_guard_aborts_the_process() {
        const IS_CHILD: &str = "DRAWLOOM_UNWINDS_THROUGH_A_GUARD";
        if env::var_os(IS_CHILD).is_some() {
            let caught = catch(|| {
                let _guard = AbortOnUnwind::new("a test");
                panic!("as planned");
            });
            unreachable!("the guard let a panic through: {caught:?}");
        }
        let this = "unwind::tests::an_unwind_through_a_guard_aborts_the_process";
        let child = Command::new(env::current_exe().unwrap())
            .args(["--exact", this, "--nocapture"])
            .env(IS_CHILD, "1")
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&child.stderr);
        assert!(said.contains("unwind through a test"), "{said}");
        assert!(!said.contains("let a panic through"), "{said}");
        assert!(!child.status.success());
    }
}
