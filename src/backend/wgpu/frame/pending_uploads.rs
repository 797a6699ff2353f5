//! The uploads of a frame that is not submitted yet.

use crate::backend::wgpu::error_scope::{catch_wgpu_panic, with_error_scope};
use crate::unwind::emit;

/// The uploads of a frame, which wgpu keeps in memory until something is submitted. If the frame never is, an empty
/// submission takes its place when this is dropped, so that frames that are recorded and dropped leave no memory
/// behind.
///
/// What is uploaded early does no harm: buffers of the frame are used by nothing else, and what is shared with earlier
/// frames that are not submitted yet would have been uploaded before them, too.
pub(crate) struct PendingUploads {
    device: wgpu::Device,
    queue: wgpu::Queue,
    are_submitted: bool,
}

impl PendingUploads {
    pub(crate) fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        Self { device: device.clone(), queue: queue.clone(), are_submitted: false }
    }

    /// The device of the frame.
    pub(crate) fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The frame was submitted.
    pub(crate) fn submitted(&mut self) {
        self.are_submitted = true;
    }
}

impl Drop for PendingUploads {
    fn drop(&mut self) {
        if self.are_submitted {
            return;
        }
        let label = "the uploads of a frame that was dropped";
        let submit = || with_error_scope(&self.device, label, || self.queue.submit(None));
        if let Err(error) = catch_wgpu_panic(label, submit).flatten() {
            // The next frame meets the same, and returns it.
            let message = "uploads of a frame that was dropped stay in memory";
            emit(|| tracing::warn!(target: "drawloom", %error, "{message}"));
        }
    }
}
