//! A submitted frame, and the readback of its targets.

use std::sync::Arc;
use std::time::Duration;

use super::error_scope::{check_device, poll, with_error_scope};
use super::read_back::new_read_back;
use super::resources::WgpuTargets;
use super::timing::{DevicePassTimes, TimestampReadback};
use crate::backend::{BackendError, Picture};

/// A frame that was submitted to wgpu.
pub struct WgpuSubmission {
    device: wgpu::Device,
    queue: wgpu::Queue,
    index: wgpu::SubmissionIndex,
    targets: Arc<WgpuTargets>,
    timestamps: Option<TimestampReadback>,
}

impl WgpuSubmission {
    pub(crate) fn new(
        device: wgpu::Device,
        queue: wgpu::Queue,
        index: wgpu::SubmissionIndex,
        targets: Arc<WgpuTargets>,
        timestamps: Option<TimestampReadback>,
    ) -> Self {
        Self { device, queue, index, targets, timestamps }
    }

    /// Waits until the device has drawn the frame, and returns when it drew each pass.
    ///
    /// # Errors
    /// - [`BackendError::NotTimed`] if the backend does not [time passes](super::WgpuBackend::time_passes).
    /// - If the device is lost.
    pub fn pass_times(&self) -> Result<DevicePassTimes, BackendError> {
        let timestamps = self.timestamps.as_ref().ok_or(BackendError::NotTimed)?;
        self.wait()?;
        timestamps.read(&self.device)
    }

    /// The texture of a view's target, to present or to copy, and the layer that is the target's: 0 but where views
    /// have targets that are layers of one texture. The next frame draws into the same texture. `None` if there is no
    /// such target, or it is [transient](super::WgpuBackend::transient_targets).
    pub fn texture(&self, view: usize, target: &str) -> Option<(&wgpu::Texture, u32)> {
        let found = self.targets.find(view, target).filter(|target| !target.is_transient())?;
        Some((&found.texture, found.layer))
    }

    /// Waits until the device has drawn the frame, however long that takes.
    ///
    /// # Errors
    /// If the device is lost before it has drawn the frame.
    pub fn wait(&self) -> Result<(), BackendError> {
        self.poll(None)
    }

    /// Waits until the device has drawn the frame, but no longer than this time: for engines that notice a device which
    /// hangs.
    ///
    /// # Errors
    /// - [`BackendError::Timeout`] if the time is over. The frame may still be drawn, and may be waited for again.
    /// - If the device is lost before it has drawn the frame.
    pub fn wait_timeout(&self, timeout: Duration) -> Result<(), BackendError> {
        self.poll(Some(timeout))
    }

    fn poll(&self, timeout: Option<Duration>) -> Result<(), BackendError> {
        poll(&self.device, wgpu::PollType::Wait { submission_index: Some(self.index.clone()), timeout })
    }

    /// Waits until the device has drawn the frame, and reads back a view's target.
    ///
    /// # Errors
    /// If there is no such target, it is [transient](super::WgpuBackend::transient_targets), or the device refuses or
    /// is lost.
    pub fn read(&self, view: usize, target: &str) -> Result<Picture, BackendError> {
        self.wait()?;
        // The calls below do not report it, and the wait does not if the frame was drawn before.
        check_device(&self.device)?;
        let unknown = || BackendError::UnknownTarget { view, target: target.to_owned() };
        let found = self.targets.find(view, target).ok_or_else(unknown)?;
        let whole = [found.texture.width(), found.texture.height()];
        let (read_back, copy) = new_read_back(&self.device, &self.targets, view, target, [[0, 0], whole])?;
        let index = with_error_scope(&self.device, target, || {
            let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            copy.encode(&mut encoder);
            self.queue.submit([encoder.finish()])
        })?;
        copy.submitted(&self.device, &index);
        read_back.read()
    }
}
