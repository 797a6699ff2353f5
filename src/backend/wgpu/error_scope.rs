//! Device errors as `Result`s.

use crate::backend::BackendError;
use crate::task::catch;

/// Does `work` inside error scopes of this thread, and returns the first error that the device reports.
///
/// # Errors
/// Returns the device's first error.
pub(crate) fn with_error_scope<R>(
    device: &wgpu::Device,
    label: &str,
    work: impl FnOnce() -> R,
) -> Result<R, BackendError> {
    let scopes = [wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Validation]
        .map(|filter| device.push_error_scope(filter));
    let result = work();
    let mut first = None;
    // Scopes are a stack, and each must be popped. The future of `pop` is ready at once on every native backend.
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

/// Does work whose errors wgpu reports by a panic instead of an error scope: finishing bundles.
///
/// # Errors
/// Returns the panic as the error that it reports.
pub(crate) fn catch_wgpu_panic<R>(label: &str, work: impl FnOnce() -> R) -> Result<R, BackendError> {
    catch(work).map_err(|panic| refused(label, panic.message))
}

/// Polls the device. wgpu panics if the device is lost.
///
/// # Errors
/// If the device is lost, or is not done in time.
pub(crate) fn poll(device: &wgpu::Device, poll: wgpu::PollType) -> Result<(), BackendError> {
    let lost = |error: wgpu::PollError| BackendError::DeviceLost { message: error.to_string() };
    catch_wgpu_panic("the device", || device.poll(poll).map(|_| ()))?.map_err(lost)
}

fn refused(label: &str, message: String) -> BackendError {
    // wgpu has no error type for a lost device, but all its messages about one contain these words.
    if message.contains("device is lost") {
        BackendError::DeviceLost { message }
    } else {
        BackendError::Validation { label: label.to_owned(), message }
    }
}
