//! Timeouts: a case that hangs fails.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use libtest_mimic::Failed;

/// Far more than any case takes without optimisations, in parallel with others.
const TIMEOUT: Duration = Duration::from_secs(240);

/// Runs `case` on a thread of its own. A thread that hangs is not joined, and ends with the program.
pub fn with_timeout(case: impl FnOnce() -> Result<(), Failed> + Send + 'static) -> Result<(), Failed> {
    let (sender, receiver) = channel();
    thread::spawn(move || {
        let outcome = catch_unwind(AssertUnwindSafe(case)).unwrap_or_else(|panic| {
            let message = panic.downcast_ref::<String>().cloned();
            let message = message.or_else(|| panic.downcast_ref::<&str>().map(|&text| text.to_owned()));
            Err(format!("it panicked: {}", message.unwrap_or_default()).into())
        });
        // After the timeout there is no receiver.
        let _ = sender.send(outcome);
    });
    match receiver.recv_timeout(TIMEOUT) {
        Ok(outcome) => outcome,
        Err(RecvTimeoutError::Timeout) => Err(format!("it hangs: nothing after {} s", TIMEOUT.as_secs()).into()),
        Err(RecvTimeoutError::Disconnected) => Err("its thread ended without a result".into()),
    }
}
