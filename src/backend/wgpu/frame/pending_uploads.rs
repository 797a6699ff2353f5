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
    /// `None` once they are submitted.
    device: Option<(wgpu::Device, wgpu::Queue)>,
}

impl PendingUploads {
    pub(crate) fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        Self { device: Some((device.clone(), queue.clone())) }
    }

    /// The frame was submitted.
    pub(crate) fn submitted(&mut self) {
        self.device = None;
    }
}

impl Drop for PendingUploads {
    fn drop(&mut self) {
        let Some((device, queue)) = self.device.take() else { return };
        let label = "the uploads of a frame that was dropped";
        let submit = || with_error_scope(&device, label, || queue.submit(None));
        if let Err(error) = catch_wgpu_panic(label, submit).flatten() {
            // The next frame meets the same, and returns it.
            let message = "uploads of a frame that was dropped stay in memory";
            emit(|| tracing::warn!(target: "drawloom", %error, "{message}"));
        }
    }
}
