//! Fences order work of the CPU and work of a device (S 9.4, which calls them reports).
//!
//! A [`Fence`] is set once: by the CPU through its [`FenceSetter`], or by the device at a place in a frame that
//! `RecordedFrame::fence_at` names. Whoever has the fence can ask whether it is set, wait for it, or be called back.
//! `RecordedFrame::submit_after` makes the submission of a frame wait for a fence that the CPU sets.
//!
//! | S table 9.1 | here |
//! | --- | --- |
//! | the device waits for a report that the CPU sets | `RecordedFrame::submit_after`, then [`FenceSetter::set`] |
//! | the CPU waits for a report that the device sets | `RecordedFrame::fence_at`, then [`Fence::wait`] |
//! | both set one report: a race | does not compile: a fence has one setter, which cannot be cloned, and which setting consumes |
//! | each waits for a report that the other would set next: a deadlock | every wait has a limit, and its [error](FenceError::TimedOut) names all who wait and what each waits for |
//!
//! Nobody waits in vain either for a fence that can no longer be set: it is [abandoned](FenceError::Abandoned) when its
//! setter is dropped, also by a panic, or with the frame that would have set it.

mod device_progress;
mod error;
mod setter;
mod state;
pub(crate) mod waits;

use std::fmt;
use std::sync::Arc;
use std::time::{Duration, Instant};

pub use device_progress::DeviceProgress;
pub use error::{FenceError, FenceWait};
pub use setter::FenceSetter;

use self::device_progress::advance;
use self::state::{FenceState, Outcome};
pub(crate) use self::waits::{current_thread, list_wait};

/// Something that happens once, on the CPU or on a device, and that others wait for.
///
/// ```
/// use std::thread;
/// use std::time::Duration;
///
/// use drawloom_jobs::fence::Fence;
///
/// let (setter, terrain_is_loaded) = Fence::new("terrain is loaded");
/// let loader = thread::spawn(move || setter.set());
/// terrain_is_loaded.wait(Duration::from_secs(10))?;
/// assert!(terrain_is_loaded.is_set());
/// # loader.join().unwrap();
/// # Ok::<(), drawloom_jobs::fence::FenceError>(())
/// ```
///
/// Two threads cannot both set it, so there is no order of theirs to get wrong (S table 9.1, the race):
///
/// ```compile_fail,E0382
/// let (setter, fence) = drawloom_jobs::fence::Fence::new("12 or 15");
/// std::thread::spawn(move || setter.set());
/// setter.set();
/// ```
#[derive(Clone)]
pub struct Fence {
    state: Arc<FenceState>,
}

impl Fence {
    /// A fence that the CPU sets, and its setter. The name is for errors.
    #[allow(clippy::new_ret_no_self, reason = "a fence is made with the one setter that it ever has")]
    pub fn new(name: impl Into<String>) -> (FenceSetter, Self) {
        let state = Arc::new(FenceState::new(name.into()));
        (FenceSetter::new(Arc::clone(&state)), Self { state })
    }

    /// The fence's name.
    pub fn name(&self) -> &str {
        self.state.name()
    }

    /// Whether the fence is set. For a fence of a device this asks the device, and does not wait; other callbacks of
    /// that device may be called meanwhile.
    pub fn is_set(&self) -> bool {
        self.set_at().is_some()
    }

    /// When the fence was set. For a fence of a device that is when the device was found to have reached its place:
    /// when something polled the device, waited for it or submitted to it.
    pub fn set_at(&self) -> Option<Instant> {
        if self.state.outcome().is_none()
            && let Some(progress) = self.state.progress()
        {
            // A lost device sets nothing. Who waits is told why.
            let _ = advance(progress, Duration::ZERO);
        }
        match self.state.outcome() {
            Some(Outcome::Set(time)) => Some(time),
            Some(Outcome::Abandoned | Outcome::Failed(_)) | None => None,
        }
    }

    /// Waits until the fence is set, at most as long as `limit`.
    ///
    /// # Errors
    /// - [`FenceError::TimedOut`] if the fence is not set within `limit`, with everyone in this OS process who waits
    ///   for a fence.
    /// - [`FenceError::Abandoned`] if nothing can set the fence any more.
    /// - [`FenceError::Device`] if the device that would set it fails.
    pub fn wait(&self, limit: Duration) -> Result<(), FenceError> {
        self.wait_as(limit, current_thread)
    }

    /// [Waits](Self::wait) on behalf of someone, whom errors of other waits name.
    ///
    /// # Errors
    /// As [`wait`](Self::wait).
    #[doc(hidden)]
    pub fn wait_as(&self, limit: Duration, waiter: impl FnOnce() -> String) -> Result<(), FenceError> {
        let start = Instant::now();
        if let Some(outcome) = self.state.outcome() {
            return self.result(outcome);
        }
        let listed = list_wait(waiter(), self.name());
        loop {
            let left = limit.saturating_sub(start.elapsed());
            let outcome = match self.state.progress() {
                Some(progress) => {
                    let advanced = advance(progress, left);
                    // Another thread may be about to call back for what this one waited for.
                    let outcome = self.state.wait(left.min(CALLBACK_TIME), true);
                    if let (None, Err(message)) = (&outcome, advanced) {
                        // From now on, for all who wait or are called back.
                        self.state.finish(Outcome::Failed(message.into()));
                    }
                    outcome.or_else(|| self.state.outcome())
                }
                None => self.state.wait(left, false),
            };
            if let Some(outcome) = outcome {
                return self.result(outcome);
            }
            if start.elapsed() >= limit {
                let waits = listed.all_waits();
                return Err(FenceError::TimedOut { fence: self.name().to_owned(), limit, waits });
            }
        }
    }

    /// Calls back when the fence is set or abandoned, or somebody who waits for it finds that its device has failed; at
    /// once, if that has happened. The callback runs on the thread that finds out: the one that sets a fence or drops
    /// its setter; for a fence of a device, one that polls the device, waits for it or submits to it. It should be
    /// short, hold no lock that this thread may hold, and not use the device: a submission may be under way. If it
    /// panics, the panic goes no further.
    pub fn on_set(&self, callback: impl FnOnce(Result<(), FenceError>) + Send + 'static) {
        let fence = self.clone();
        self.state.call_back(Box::new(move |outcome| callback(fence.result(outcome))));
    }

    fn result(&self, outcome: Outcome) -> Result<(), FenceError> {
        match outcome {
            Outcome::Set(_) => Ok(()),
            Outcome::Abandoned => Err(FenceError::Abandoned { fence: self.name().to_owned() }),
            Outcome::Failed(message) => {
                Err(FenceError::Device { fence: self.name().to_owned(), message: message.to_string() })
            }
        }
    }
}

/// The time between the end of a device's work and the callback for it, on another thread.
const CALLBACK_TIME: Duration = Duration::from_micros(50);

impl fmt::Debug for Fence {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Fence").field("name", &self.name()).field("outcome", &self.state.outcome()).finish()
    }
}
