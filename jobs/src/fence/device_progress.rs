//! A device that sets a fence.

use std::sync::Arc;
use std::time::Duration;

use crate::unwind::{JobPanic, catch};

/// A device on its way to the place of a fence.
pub trait DeviceProgress: Send + Sync + 'static {
    /// Waits until the device has reached the place, at most as long as `limit`, and less if it likes, and has the
    /// device call back for all that it has done.
    ///
    /// # Errors
    /// Returns the device's message if it has failed, so that the fence will never be set. A panic counts as a
    /// failure.
    fn advance(&self, limit: Duration) -> Result<(), String>;
}

/// Calls [`DeviceProgress::advance`].
///
/// # Errors
/// As that, and if it panics.
pub(super) fn advance(progress: &dyn DeviceProgress, limit: Duration) -> Result<(), String> {
    catch(|| progress.advance(limit))
        .unwrap_or_else(|JobPanic { message }| Err(format!("its progress panicked: {message}")))
}

impl<D: DeviceProgress + ?Sized> DeviceProgress for Arc<D> {
    fn advance(&self, limit: Duration) -> Result<(), String> {
        (**self).advance(limit)
    }
}
