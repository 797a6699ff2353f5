//! One buffer for many suballocations.

use super::upload_queue::UploadQueue;
use crate::backend::BackendError;

/// A linear arena: a buffer that is filled from its start. No range is ever overwritten, because a frame that is recorded but
/// not yet submitted may still draw from it. Space is reclaimed by moving to a new buffer; the old one lives as long as a
/// frame uses it.
pub(crate) struct Arena {
    label: &'static str,
    usage: wgpu::BufferUsages,
    buffer: Option<wgpu::Buffer>,
    used: u64,
}

impl Arena {
    pub(crate) fn new(label: &'static str, usage: wgpu::BufferUsages) -> Self {
        Self { label, usage: usage | wgpu::BufferUsages::COPY_DST, buffer: None, used: 0 }
    }

    /// Whether `bytes` more fit.
    pub(crate) fn fits(&self, bytes: u64) -> bool {
        self.buffer.as_ref().is_some_and(|buffer| self.used + bytes <= buffer.size())
    }

    /// Moves to a new, empty buffer with room for twice `bytes`.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn reallocate(&mut self, device: &wgpu::Device, bytes: u64) -> Result<(), BackendError> {
        let max_size = device.limits().max_buffer_size;
        let size = (bytes * 2).clamp(1 << 16, max_size & !3).max(bytes);
        self.buffer = Some(new_buffer(device, self.label, size, self.usage)?);
        self.used = 0;
        Ok(())
    }

    /// Appends bytes, whose number is a multiple of 4, and returns their offset. They must [fit](Self::fits).
    pub(crate) fn append(&mut self, uploads: &UploadQueue, bytes: &[u8]) -> u64 {
        let start = self.used;
        if let Some(buffer) = &self.buffer {
            uploads.write_buffer(buffer, start, bytes);
        }
        self.used += bytes.len() as u64;
        start
    }

    /// In bytes.
    pub(crate) fn size(&self) -> u64 {
        self.buffer.as_ref().map_or(0, wgpu::Buffer::size)
    }

    pub(crate) fn buffer(&self) -> Option<&wgpu::Buffer> {
        self.buffer.as_ref()
    }
}

/// A zeroed buffer. It is mapped at creation, so that wgpu regards it as initialized: otherwise wgpu clears it again whenever
/// a bind group uses it.
///
/// # Errors
/// If the device allows no buffer of that size.
pub(crate) fn new_buffer(
    device: &wgpu::Device,
    label: &'static str,
    size: u64,
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer, BackendError> {
    let allowed = device.limits().max_buffer_size;
    if size > allowed {
        return Err(BackendError::Limit { limit: "max_buffer_size", allowed, needed: size });
    }
    let size = size.next_multiple_of(4);
    let buffer =
        device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: true });
    buffer.unmap();
    Ok(buffer)
}

/// A buffer that holds exactly these bytes.
///
/// # Errors
/// If the device allows no buffer of that size.
pub(crate) fn filled_buffer(
    device: &wgpu::Device,
    uploads: &UploadQueue,
    label: &'static str,
    bytes: &[u8],
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer, BackendError> {
    let buffer = new_buffer(device, label, bytes.len() as u64, usage | wgpu::BufferUsages::COPY_DST)?;
    uploads.write_buffer(&buffer, 0, bytes);
    Ok(buffer)
}
