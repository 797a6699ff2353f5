//! The boundary to code of the engine's: each call of it panics once, in turn, and so does each destructor. Nothing
//! unwinds out of the crate or hangs, the error names what panicked, nothing stays in memory, and the next frame is
//! that of a renderer which knew no panic. The changes that the frame before was told of are in it.
//!
//! The tables in `src/unwind.rs`, `jobs/src/unwind/mod.rs` and `async-post/src/unwind.rs` list the calls;
//! `drawloom_obj::read` has one more. These hold with debug assertions and without.

mod async_post;
mod builds;
mod callers;
mod engine;
mod frames;
mod fuse;
mod loops;
mod preparations;
#[cfg(feature = "wgpu")]
mod raw;
mod schedulers;

use std::panic;
use std::sync::{Mutex, MutexGuard, Once, PoisonError, mpsc};
use std::thread;
use std::time::Duration;

use engine::OwnSubscriber;
use fuse::{PLANNED, PanicsWhenDropped};

/// Longer than any case takes, also on a machine that is busy.
const LONG: Duration = Duration::from_secs(200);

/// The fuse and the subscriber are the whole program's.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Runs a case on a thread of its own, and fails if it hangs.
fn within_time(case: impl FnOnce() + Send + 'static) {
    let _turn: MutexGuard<'_, ()> = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    set_up();
    let (done, is_done) = mpsc::channel();
    let thread = thread::spawn(move || {
        case();
        done.send(()).unwrap();
    });
    match is_done.recv_timeout(LONG) {
        Err(mpsc::RecvTimeoutError::Timeout) => panic!("it hangs"),
        Ok(()) | Err(mpsc::RecvTimeoutError::Disconnected) => {}
    }
    if let Err(payload) = thread.join() {
        panic::resume_unwind(payload);
    }
    // The last job of a scheduler, or the last frame of a loop, may end on a thread of theirs.
    wait_until(|| fuse::alive() == 0, "values of the engine's are kept");
}

/// Waits until something holds.
///
/// # Panics
/// If it does not.
fn wait_until(holds: impl Fn() -> bool, otherwise: &str) {
    for _ in 0..10_000 {
        if holds() {
            return;
        }
        thread::sleep(Duration::from_millis(1));
    }
    panic!("{otherwise}");
}

/// Sets the program's subscriber, and hides the panics that are wanted.
fn set_up() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        tracing::subscriber::set_global_default(OwnSubscriber::default()).unwrap();
        let hook = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            let is_planned = info.payload_as_str() == Some(PLANNED) || info.payload().is::<PanicsWhenDropped>();
            if !is_planned {
                hook(info);
            }
        }));
    });
}
