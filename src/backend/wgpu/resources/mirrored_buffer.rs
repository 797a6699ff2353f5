//! Buffers with a copy on the CPU.

use super::growing_buffer::GrowingBuffer;
use super::upload_queue::UploadQueue;
use crate::backend::BackendError;

/// A buffer that is rewritten as a whole, and uploaded only if its bytes change.
pub(crate) struct MirroredBuffer {
    pub(crate) on_device: GrowingBuffer,
    /// The bytes it is to hold, and the bytes it holds.
    next: Vec<u8>,
    written: Vec<u8>,
}

impl MirroredBuffer {
    pub(crate) fn new(label: &'static str, usage: wgpu::BufferUsages) -> Self {
        Self { on_device: GrowingBuffer::new(label, usage), next: Vec::new(), written: Vec::new() }
    }

    /// An empty list for the bytes that it is to hold.
    pub(crate) fn rewrite(&mut self) -> &mut Vec<u8> {
        self.next.clear();
        &mut self.next
    }

    /// Uploads `bytes` if the buffer does not hold them.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn set(
        &mut self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        bytes: &[u8],
    ) -> Result<(), BackendError> {
        if self.on_device.reserve(device, bytes.len())? || bytes != self.written {
            self.on_device.write(uploads, 0, bytes);
            self.written.clear();
            self.written.extend_from_slice(bytes);
        }
        Ok(())
    }

    /// Uploads the rewritten bytes if they changed. Returns whether the buffer was reallocated.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn upload(&mut self, device: &wgpu::Device, uploads: &UploadQueue) -> Result<bool, BackendError> {
        let reallocated = self.on_device.reserve(device, self.next.len())?;
        if reallocated || self.next != self.written {
            self.on_device.write(uploads, 0, &self.next);
            std::mem::swap(&mut self.next, &mut self.written);
        }
        Ok(reallocated)
    }
}
