//! Errors of waiting for fences.

use std::fmt;
use std::time::Duration;

/// Why a fence was waited for in vain.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FenceError {
    /// Nobody set the fence in time. If two wait for each other, `waits` has both.
    #[error("fence {fence:?} was not set within {limit:?}; waiting for a fence are: {}", list(waits))]
    TimedOut {
        /// The fence's name.
        fence: String,
        /// How long it was waited for.
        limit: Duration,
        /// All who waited for a fence at that time, in this OS process, the longest wait first.
        waits: Vec<FenceWait>,
    },
    /// The fence's setter was dropped: its thread returned or panicked, or its frame was dropped or refused by the
    /// device.
    #[error("fence {fence:?} was abandoned before it was set")]
    Abandoned {
        /// The fence's name.
        fence: String,
    },
    /// The device that would set the fence failed.
    #[error("the device that sets fence {fence:?} failed: {message}")]
    Device {
        /// The fence's name.
        fence: String,
        /// What the device says.
        message: String,
    },
}

/// Someone who waits for a fence.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FenceWait {
    /// Who waits: a thread, or the submission of a frame.
    pub waiter: String,
    /// The name of the fence.
    pub fence: String,
    /// For how long so far.
    pub waited: Duration,
}

impl fmt::Display for FenceWait {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} for {:?}, since {:.1?}", self.waiter, self.fence, self.waited)
    }
}

fn list(waits: &[FenceWait]) -> String {
    waits.iter().map(FenceWait::to_string).collect::<Vec<_>>().join("; ")
}
