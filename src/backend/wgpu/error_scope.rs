//! Device errors as `Result`s.

use std::time::Duration;

use crate::backend::BackendError;
use crate::task::catch;

/// Does `work` inside error scopes of this thread, and returns the first error that the device reports.
///
/// # Errors
/// Returns the device's first error. On a lost device, whose resources are all invalid, that is the loss.
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
        // What is created on a lost device is invalid, and only its first use is an error.
        Some(error) => Err(loss_or(device, refused(label, error.to_string()))),
    }
}

/// The loss of the device if it is lost, as that makes what is created on it invalid. Otherwise the error.
pub(crate) fn loss_or(device: &wgpu::Device, error: BackendError) -> BackendError {
    check_device(device).err().unwrap_or(error)
}

/// Checks that the device is not lost. A lost device reports that only when a bundle is finished, and a frame may have
/// none.
///
/// # Errors
/// If the device is lost.
pub(crate) fn check_device(device: &wgpu::Device) -> Result<(), BackendError> {
    let finish = || {
        let descriptor = wgpu::RenderBundleEncoderDescriptor {
            color_formats: &[Some(wgpu::TextureFormat::Rgba8Unorm)],
            sample_count: 1,
            ..wgpu::RenderBundleEncoderDescriptor::default()
        };
        device.create_render_bundle_encoder(&descriptor).finish(&wgpu::RenderBundleDescriptor::default())
    };
    catch_wgpu_panic("the device", finish).map(|_| ())
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
    let timeout = match &poll {
        wgpu::PollType::Wait { timeout, .. } => timeout.unwrap_or(Duration::MAX),
        wgpu::PollType::Poll => Duration::ZERO,
    };
    let refused = |error: wgpu::PollError| match error {
        wgpu::PollError::Timeout => BackendError::Timeout { timeout },
        // The submission that is waited for was refused, because the device was lost.
        other => BackendError::DeviceLost { message: other.to_string() },
    };
    match catch_wgpu_panic("the device", || device.poll(poll).map(|_| ())) {
        // A wait that times out at the moment when another thread finds all work done: wgpu takes that for a
        // contradiction.
        Err(BackendError::Validation { message, .. }) if message.starts_with("If the queue is empty") => Ok(()),
        polled => polled?.map_err(refused),
    }
}

/// What wgpu refuses with this message.
pub(crate) fn refused(label: &str, message: String) -> BackendError {
    // wgpu has no error type for a lost device, but all its messages about one contain these words.
    if message.contains("device is lost") {
        BackendError::DeviceLost { message }
    } else {
        BackendError::Validation { label: label.to_owned(), message }
    }
}
