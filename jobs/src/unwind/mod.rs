//! The boundary to code of the engine's, which may panic: its jobs, nodes, hooks, destructors, clocks, and subscriber
//! of `tracing`.
//!
//! A panic is caught where the engine's code is called, and becomes an error that names the call. Behind these catches
//! stand others around the work of each thread, for a call that was forgotten. Where an unwind would free memory that
//! another thread still uses, an [`AbortOnUnwind`] guards the code as well. So soundness does not depend on every call
//! being caught.
//!
//! These are all places where this crate calls such code. `tests/boundary` of the workspace makes each of these calls
//! panic in turn. The module `unwind` of `drawloom` has the renderer's.
//!
//! | code | called in | its panic |
//! | --- | --- | --- |
//! | nodes of graphs: `width`, `run` and others | `graph/execute.rs` | `RunError::Panicked` with the node |
//! | callbacks of fences | `fence/state.rs` | an event |
//! | `DeviceProgress` | `fence/device_progress.rs` | `FenceError::Device` |
//! | jobs, loops with their iterators, scopes | `task/job.rs`, `task/worker.rs`, `task/parallel_loop.rs`, `task/scheduler.rs` | [`JobPanic`] |
//! | background jobs | `task/background_job.rs` | [`JobPanic`] |
//! | hooks of the scheduler's threads | `task/builder.rs`, `task/worker_thread.rs` | `SchedulerError`, or an event |
//! | clocks | `timeline/clock.rs` | an event; the time stands still |
//! | subscribers of `tracing` | [`emit`], [`CaughtSpan`], and nowhere else: `tests/architecture` checks that | the event or span is lost |
//! | writers that the engine passes to `report`, on its own thread | there | unwinds to the caller |
//! | destructors of any of these, and of the payloads of panics | [`discard`], [`Contained`] | nothing |

mod caught_span;
mod contained;

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::{mem, process};

use thiserror::Error;

pub use self::caught_span::{CaughtSpan, EnteredSpan};
pub use self::contained::Contained;

/// A job panicked. Its scheduler works as before.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("a job panicked: {message}")]
#[non_exhaustive]
pub struct JobPanic {
    /// The message of the panic: its payload if that is a `&str` or a `String`, as with the `panic!` macro, and
    /// otherwise a fixed text.
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

/// Calls `call`, and turns its panic into an error.
///
/// The closure need not be unwind safe: after an error the caller must not use values that the closure has left
/// half-changed.
///
/// ```
/// # use drawloom_jobs::task::catch;
/// let panic = catch(|| [1, 2, 3].iter().position(|&number| number == 4).expect("4 is in the list")).unwrap_err();
/// assert_eq!(format!("process \"count\": {}", panic.message), "process \"count\": 4 is in the list");
/// ```
///
/// # Errors
/// Returns a [`JobPanic`] with the message of the panic. With `panic = "abort"` the program ends instead.
#[inline]
pub fn catch<R>(call: impl FnOnce() -> R) -> Result<R, JobPanic> {
    catch_unwind(AssertUnwindSafe(call)).map_err(JobPanic::new)
}

/// Drops a value of the engine's, and ignores a panic of its destructor. The payload of that panic is leaked, because
/// dropping it might panic as well.
pub fn discard<T>(value: T) {
    if let Err(payload) = catch_unwind(AssertUnwindSafe(|| drop(value))) {
        mem::forget(payload);
    }
}

/// [Discards](discard) values one by one, so that a panic of one destructor does not meet that of another, which would
/// end the process.
pub fn discard_all<T>(values: impl IntoIterator<Item = T>) {
    values.into_iter().for_each(discard);
}

/// Calls `event`, which sends an event to the engine's `tracing` subscriber. If the subscriber panics, the event is
/// lost, the panic hook gets the message, and this function returns as usual.
pub fn emit(event: impl FnOnce()) {
    if let Err(payload) = catch_unwind(AssertUnwindSafe(event)) {
        discard(payload);
    }
}

/// Sends an event.
type HeldEvent = Box<dyn FnOnce()>;

thread_local! {
    /// The events that wait until this thread leaves [`hold_events`]; `None` outside it.
    static HELD_EVENTS: std::cell::RefCell<Option<Vec<HeldEvent>>> = const { std::cell::RefCell::new(None) };
}

/// Calls `work`, which may hold locks, and only then sends the events of [`emit_unlocked`]: the engine's subscriber may
/// ask for what the locks guard. `work` must have let go of them when it returns.
pub fn hold_events<R>(work: impl FnOnce() -> R) -> R {
    /// Sends the events when it is dropped, also by an unwind.
    struct Held {
        is_outermost: bool,
    }

    impl Drop for Held {
        fn drop(&mut self) {
            if self.is_outermost {
                let events = HELD_EVENTS.take().unwrap_or_default();
                events.into_iter().for_each(emit);
            }
        }
    }

    let is_outermost = HELD_EVENTS.with_borrow_mut(|held| {
        let is_outermost = held.is_none();
        held.get_or_insert_default();
        is_outermost
    });
    let _held = Held { is_outermost };
    work()
}

/// [Emits](emit) an event when this thread leaves [`hold_events`]; at once if it is not there.
pub fn emit_unlocked(event: impl FnOnce() + 'static) {
    let unheld = HELD_EVENTS.with_borrow_mut(|held| match held {
        Some(events) => {
            events.push(Box::new(event));
            None
        }
        None => Some(event),
    });
    unheld.into_iter().for_each(emit);
}

/// Aborts the process if it is dropped. Only an unwind drops it: every other path [disarms](Self::disarm) it.
///
/// It guards code that must run to its end because other threads rely on it. Rayon does the same.
#[must_use = "it guards the code that follows until it is disarmed"]
pub struct AbortOnUnwind {
    what: &'static str,
}

impl AbortOnUnwind {
    /// `what` names the code that must not unwind, for the message before the process aborts.
    pub fn new(what: &'static str) -> Self {
        Self { what }
    }

    /// The work is done, and did not unwind.
    pub fn disarm(self) {
        mem::forget(self);
    }
}

impl Drop for AbortOnUnwind {
    #[cold]
    fn drop(&mut self) {
        // A model checker that has found a failure drops the threads of its model in the middle of their work.
        if cfg!(drawloom_model_check) {
            return;
        }
        eprintln!("drawloom: a panic tried to unwind through {}, which other threads rely on: aborting", self.what);
        process::abort();
    }
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use std::env;
    use std::panic::panic_any;
    use std::process::Command;

    use super::{AbortOnUnwind, catch, emit, emit_unlocked, hold_events};

    #[test]
    fn a_panic_in_an_event_does_not_leave_emit() {
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
    fn events_are_held_until_the_outermost_call_returns_or_unwinds() {
        let count = std::rc::Rc::new(std::cell::Cell::new(0));
        let event = || {
            let count = count.clone();
            emit_unlocked(move || count.set(count.get() + 1));
        };
        event();
        assert_eq!(count.get(), 1);
        hold_events(|| {
            event();
            hold_events(event);
            assert_eq!(count.get(), 1);
        });
        assert_eq!(count.get(), 3);
        assert!(catch(|| hold_events(|| [event()].map(|()| panic!("as planned")))).is_err());
        event();
        assert_eq!(count.get(), 5);
    }

    #[test]
    fn a_disarmed_guard_does_not_abort() {
        AbortOnUnwind::new("nothing").disarm();
    }

    /// Starts itself as a child process, which aborts. Miri cannot start processes.
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
        let message = String::from_utf8_lossy(&child.stderr);
        assert!(message.contains("unwind through a test"), "{message}");
        assert!(!message.contains("let a panic through"), "{message}");
        assert!(!child.status.success());
    }
}
