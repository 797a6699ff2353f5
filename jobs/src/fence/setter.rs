//! The setter of a fence.

use std::fmt;
use std::sync::Arc;
use std::time::Instant;

use super::device_progress::DeviceProgress;
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

    /// From now on, whoever waits for the fence lets this device advance meanwhile: for backends whose device tells of
    /// finished work only when it is asked. The first call counts.
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
