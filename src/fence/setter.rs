//! The setter of a fence, and the device that it may be set by.

use std::fmt;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::state::{FenceState, Outcome};

/// Sets one fence, once. If it is dropped instead, the fence is [abandoned](super::FenceError::Abandoned).
#[must_use = "a fence is abandoned if its setter is dropped"]
pub struct FenceSetter {
    state: Arc<FenceState>,
}

impl FenceSetter {
    pub(super) fn new(state: Arc<FenceState>) -> Self {
        Self { state }
    }

    /// The fence's name.
    pub fn name(&self) -> &str {
        self.state.name()
    }

    /// Sets the fence: all who wait for it go on.
    pub fn set(self) {
        self.state.finish(Outcome::Set(Instant::now()));
    }

    /// From now on, whoever waits for the fence lets this device advance meanwhile: for backends whose device tells of finished work
    /// only when it is asked. The first call counts.
    pub fn advance_by(&self, progress: impl DeviceProgress) {
        self.state.set_progress(Arc::new(progress));
    }
}

impl Drop for FenceSetter {
    fn drop(&mut self) {
        // Has no effect after `set`.
        self.state.finish(Outcome::Abandoned);
    }
}

impl fmt::Debug for FenceSetter {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("FenceSetter").field("name", &self.name()).finish()
    }
}

/// A device on its way to the place of a fence.
pub trait DeviceProgress: Send + Sync + 'static {
    /// Waits until the device has reached the place, at most as long as `limit`, and has the device call back for all that it has done.
    ///
    /// # Errors
    /// Returns the device's message if it has failed, so that the fence will never be set.
    fn advance(&self, limit: Duration) -> Result<(), String>;
}

impl<D: DeviceProgress + ?Sized> DeviceProgress for Arc<D> {
    fn advance(&self, limit: Duration) -> Result<(), String> {
        (**self).advance(limit)
    }
}
