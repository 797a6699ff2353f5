//! One buffer for many things that come and go.

use super::uploads::Uploads;
use crate::backend::BackendError;

/// A buffer that is filled from its start. What a range held is never overwritten: a frame that was recorded but not yet
/// submitted may still draw from it. Space is won back by moving to a new buffer, and the old one lives as long as somebody
/// draws from it.
pub(super) struct Arena {
    label: &'static str,
    usage: wgpu::BufferUsages,
    buffer: Option<wgpu::Buffer>,
    used: u64,
}

impl Arena {
    pub(super) fn new(label: &'static str, usage: wgpu::BufferUsages) -> Self {
        Self { label, usage: usage | wgpu::BufferUsages::COPY_DST, buffer: None, used: 0 }
    }

    /// Whether `bytes` more fit.
    pub(super) fn fits(&self, bytes: u64) -> bool {
        self.buffer.as_ref().is_some_and(|buffer| self.used + bytes <= buffer.size())
    }

    /// Moves to a new, empty buffer with room for twice `bytes`.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(super) fn renew(&mut self, device: &wgpu::Device, bytes: u64) -> Result<(), BackendError> {
        let largest = device.limits().max_buffer_size;
        let size = (bytes * 2).clamp(1 << 16, largest & !3).max(bytes);
        self.buffer = Some(new_buffer(device, self.label, size, self.usage)?);
        self.used = 0;
        Ok(())
    }

    /// Appends bytes, whose number is a multiple of 4, and says where they begin. There must be room.
    pub(super) fn append(&mut self, uploads: &Uploads, bytes: &[u8]) -> u64 {
        let start = self.used;
        if let Some(buffer) = &self.buffer {
            uploads.write_buffer(buffer, start, bytes);
        }
        self.used += bytes.len() as u64;
        start
    }

    pub(super) fn buffer(&self) -> Option<&wgpu::Buffer> {
        self.buffer.as_ref()
    }
}

/// A buffer whose bytes are all 0. It is mapped for a moment, so that wgpu takes it as written to: a bind group of a
/// buffer that is not would clear it again and again.
///
/// # Errors
/// If the device allows no buffer of that size.
pub(super) fn new_buffer(
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

/// A buffer of these bytes, and of no others.
///
/// # Errors
/// If the device allows no buffer of that size.
pub(super) fn filled_buffer(
    device: &wgpu::Device,
    uploads: &Uploads,
    label: &'static str,
    bytes: &[u8],
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer, BackendError> {
    let buffer = new_buffer(device, label, bytes.len() as u64, usage | wgpu::BufferUsages::COPY_DST)?;
    uploads.write_buffer(&buffer, 0, bytes);
    Ok(buffer)
}
