//! A submitted frame, and the readback of its targets.

use std::sync::Arc;

use super::error_scope::with_error_scope;
use super::resources::{ViewTarget, WgpuTargets};
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

    /// The texture of a view's target, to present or to copy; for a shared target, the texture array of all views. The next frame
    /// draws into the same texture.
    pub fn texture(&self, view: usize, target: &str) -> Option<&wgpu::Texture> {
        self.targets.find(view, target).map(|target| &target.texture)
    }

    /// Waits until the device has drawn the frame.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn wait(&self) -> Result<(), BackendError> {
        let poll = wgpu::PollType::Wait { submission_index: Some(self.index.clone()), timeout: None };
        self.device.poll(poll).map(|_| ()).map_err(|error| BackendError::DeviceLost { message: error.to_string() })
    }

    /// Waits until the device has drawn the frame, and reads back a view's target.
    ///
    /// # Errors
    /// If there is no such target, or the device refuses or is lost.
    pub fn read(&self, view: usize, target: &str) -> Result<Picture, BackendError> {
        // Only this reports a lost device; the calls below do not.
        self.wait()?;
        let unknown = || BackendError::UnknownTarget { view, target: target.to_owned() };
        let found = self.targets.find(view, target).ok_or_else(unknown)?;
        let (size, format) = (found.texture.size(), found.format());
        let row = size.width as usize * format.bytes();
        let padded_row = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as usize);
        let (sender, receiver) = std::sync::mpsc::channel();
        let buffer = with_error_scope(&self.device, target, || {
            let buffer = self.copy_to_buffer(found, padded_row);
            buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| {
                // Fails only if the device refused the mapping; then the receiver below is gone.
                let _ = sender.send(result);
            });
            buffer
        })?;
        let lost = |message: String| BackendError::DeviceLost { message };
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| lost(error.to_string()))?;
        let mapped = receiver.recv().map_err(|error| lost(error.to_string()))?;
        mapped.map_err(|error| lost(error.to_string()))?;
        let padded = buffer.get_mapped_range(..).map_err(|error| lost(error.to_string()))?;
        let bytes = padded.chunks_exact(padded_row).flat_map(|padded| &padded[..row]).copied().collect();
        Ok(Picture { width: size.width, height: size.height, format, bytes })
    }

    fn copy_to_buffer(&self, target: &ViewTarget, padded_row: usize) -> wgpu::Buffer {
        let size = wgpu::Extent3d { depth_or_array_layers: 1, ..target.texture.size() };
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: padded_row as u64 * u64::from(size.height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded_row as u32), rows_per_image: None };
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo {
                origin: wgpu::Origin3d { z: target.layer, ..wgpu::Origin3d::ZERO },
                ..target.texture.as_image_copy()
            },
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            size,
        );
        self.queue.submit([encoder.finish()]);
        buffer
    }
}
