//! Buffers that are initialised when they are made.

use super::counted_queue::CountedQueue;
use crate::backend::BackendError;

/// A zeroed buffer. It is mapped at creation, so that wgpu regards it as initialized: otherwise wgpu clears it again
/// whenever a bind group uses it.
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
    uploads: &CountedQueue,
    label: &'static str,
    bytes: &[u8],
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer, BackendError> {
    let buffer = new_buffer(device, label, bytes.len() as u64, usage | wgpu::BufferUsages::COPY_DST)?;
    uploads.write_buffer(&buffer, 0, bytes);
    Ok(buffer)
}
