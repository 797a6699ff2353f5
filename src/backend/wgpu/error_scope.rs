//! Errors of the device as values.

use crate::backend::BackendError;

/// Does `work` inside an error scope of this thread, and returns the first error that the device found in it.
pub(super) fn checked<R>(device: &wgpu::Device, label: &str, work: impl FnOnce() -> R) -> Result<R, BackendError> {
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let result = work();
    // The scopes are popped when `pop` is called; what it returns is ready at once on every native backend.
    let (validation, memory) = (pollster::block_on(validation.pop()), pollster::block_on(memory.pop()));
    match memory.or(validation) {
        None => Ok(result),
        Some(wgpu::Error::OutOfMemory { .. }) => Err(BackendError::OutOfMemory { label: label.to_owned() }),
        Some(error) => Err(BackendError::Validation { label: label.to_owned(), message: error.to_string() }),
    }
}
