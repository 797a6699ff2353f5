//! Buffers that are reallocated when they are too small.

use super::buffers::new_buffer;
use super::counted_queue::CountedQueue;
use crate::backend::BackendError;

/// The alignment of offsets into uniform and storage buffers that every device supports.
pub(crate) const ALIGNMENT: usize = 256;

/// A buffer that is replaced by a larger one when it is too small. Reallocation loses its contents.
pub(crate) struct GrowingBuffer {
    label: &'static str,
    usage: wgpu::BufferUsages,
    buffer: Option<wgpu::Buffer>,
}

impl GrowingBuffer {
    pub(crate) fn new(label: &'static str, usage: wgpu::BufferUsages) -> Self {
        Self { label, usage: usage | wgpu::BufferUsages::COPY_DST, buffer: None }
    }

    /// In bytes.
    pub(crate) fn size(&self) -> u64 {
        self.buffer.as_ref().map_or(0, wgpu::Buffer::size)
    }

    /// `None` before [`GrowingBuffer::reserve`].
    pub(crate) fn buffer(&self) -> Option<&wgpu::Buffer> {
        self.buffer.as_ref()
    }

    /// Makes room for `bytes`. Returns whether the buffer was reallocated.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn reserve(&mut self, device: &wgpu::Device, bytes: usize) -> Result<bool, BackendError> {
        let needed = (bytes as u64).max(ALIGNMENT as u64);
        if self.size() >= needed {
            return Ok(false);
        }
        // Half as much again, so that a scene that grows by one object per frame does not reallocate in every frame.
        let size = (needed + needed / 2).next_multiple_of(4).min(device.limits().max_buffer_size & !3).max(needed);
        self.buffer = Some(new_buffer(device, self.label, size, self.usage)?);
        Ok(true)
    }

    pub(crate) fn write(&self, uploads: &CountedQueue, offset: usize, bytes: &[u8]) {
        if let Some(buffer) = self.buffer.as_ref().filter(|_| !bytes.is_empty()) {
            uploads.write_buffer(buffer, offset as u64, bytes);
        }
    }

    /// A part of the buffer; `None` before [`GrowingBuffer::reserve`].
    pub(crate) fn binding(&self, offset: usize, bytes: usize) -> Option<wgpu::BufferBinding<'_>> {
        let size = std::num::NonZeroU64::new(bytes as u64);
        self.buffer.as_ref().map(|buffer| wgpu::BufferBinding { buffer, offset: offset as u64, size })
    }
}

/// The size of an allocation for `needed` bytes that had `before` bytes: `before` again if that is enough and not far
/// too much, so that bindings change rarely; otherwise a quarter more than needed, within `max`. A multiple of
/// [`ALIGNMENT`].
pub(crate) fn size_with_headroom(before: usize, needed: usize, max: u64) -> usize {
    let needed = needed.max(1).next_multiple_of(ALIGNMENT);
    let max = usize::try_from(max).unwrap_or(usize::MAX) / ALIGNMENT * ALIGNMENT;
    if (needed..=max.min(4 * needed)).contains(&before) {
        return before;
    }
    (needed + needed / 4).next_multiple_of(ALIGNMENT).min(max).max(needed)
}

/// Checks that a shader on this device can bind a storage buffer of that many bytes.
///
/// # Errors
/// If it cannot.
pub(crate) fn check_storage_binding_size(device: &wgpu::Device, bytes: usize) -> Result<(), BackendError> {
    let (allowed, needed) = (device.limits().max_storage_buffer_binding_size, bytes as u64);
    if needed > allowed {
        return Err(BackendError::Limit { limit: "max_storage_buffer_binding_size", allowed, needed });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_size_changes_rarely_and_is_always_enough() {
        let mut before = 0;
        let mut changes = 0;
        for step in 0..10_000_usize {
            // Up and down by a third.
            let needed = 9_000 + (step % 600).abs_diff(300) * 10;
            let size = size_with_headroom(before, needed, u64::MAX);
            assert!(size >= needed && size <= 5 * needed && size.is_multiple_of(ALIGNMENT));
            changes += usize::from(size != before);
            before = size;
        }
        assert!(changes <= 2, "{changes}");
        assert_eq!(size_with_headroom(1 << 20, 100, u64::MAX), 512);
        assert_eq!(size_with_headroom(0, 1000, 1100), 1024);
        // The maximum may have shrunk below the size before.
        assert_eq!(size_with_headroom(2048, 1000, 1500), 1280);
        assert_eq!(size_with_headroom(0, 0, u64::MAX), 512);
    }
}
