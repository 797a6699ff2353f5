//! Errors of the device as values.

use crate::backend::BackendError;
use crate::task::catch;

/// Does `work` inside error scopes of this thread, and returns the first error that the device found in it.
pub(super) fn checked<R>(device: &wgpu::Device, label: &str, work: impl FnOnce() -> R) -> Result<R, BackendError> {
    let scopes = [wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Validation]
        .map(|filter| device.push_error_scope(filter));
    let result = work();
    let mut first = None;
    // The innermost scope is the last; each must be popped. What `pop` returns is ready at once on every native backend.
    for scope in scopes.into_iter().rev() {
        let error = pollster::block_on(scope.pop());
        first = first.or(error);
    }
    match first {
        None => Ok(result),
        Some(wgpu::Error::OutOfMemory { .. }) => Err(BackendError::OutOfMemory { label: label.to_owned() }),
        Some(error) => Err(refused(label, error.to_string())),
    }
}

/// Does what wgpu answers with a panic, rather than in a scope, where it is wrong: finishing bundles.
pub(super) fn caught<R>(label: &str, work: impl FnOnce() -> R) -> Result<R, BackendError> {
    catch(work).map_err(|panic| refused(label, panic.message))
}

fn refused(label: &str, message: String) -> BackendError {
    // wgpu has no error of its own for a lost device; this is how it words it wherever it finds out.
    if message.contains("device is lost") {
        BackendError::DeviceLost { message }
    } else {
        BackendError::Validation { label: label.to_owned(), message }
    }
}
