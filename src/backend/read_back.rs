//! Pixels on their way from a device to the CPU, whichever backend they come from.

use super::{BackendError, Picture};

/// A target as one frame leaves it, on its way to the CPU: see [`Backend::read_back`](super::Backend::read_back).
pub trait ReadBack: Send {
    /// The pixels, if the device is done with the frame; `None` if it is not, or the frame is not submitted yet. It
    /// does not wait.
    ///
    /// # Errors
    /// If the frame was dropped, or the device is lost.
    fn try_read(&self) -> Result<Option<Picture>, BackendError>;

    /// Waits until the device is done with the frame, which is submitted, and returns the pixels.
    ///
    /// # Errors
    /// If the frame is not submitted, or the device is lost.
    fn read(&self) -> Result<Picture, BackendError>;
}
