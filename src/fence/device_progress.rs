//! A device that sets a fence.

use std::sync::Arc;
use std::time::Duration;

/// A device on its way to the place of a fence.
pub trait DeviceProgress: Send + Sync + 'static {
    /// Waits until the device has reached the place, at most as long as `limit`, and less if it likes, and has the device call back for all that
    /// it has done.
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
