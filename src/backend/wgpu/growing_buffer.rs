//! Buffers that are replaced by larger ones when they are too small.

use super::arena::new_buffer;
use super::uploads::Uploads;
use crate::backend::BackendError;

/// Every device takes multiples of this as offsets into uniform and storage buffers.
pub(super) const ALIGNMENT: usize = 256;

/// A buffer that is replaced by a larger one when it is too small.
pub(super) struct GrowingBuffer {
    label: &'static str,
    usage: wgpu::BufferUsages,
    buffer: Option<wgpu::Buffer>,
}

impl GrowingBuffer {
    pub(super) fn new(label: &'static str, usage: wgpu::BufferUsages) -> Self {
        Self { label, usage: usage | wgpu::BufferUsages::COPY_DST, buffer: None }
    }

    /// In bytes.
    pub(super) fn size(&self) -> u64 {
        self.buffer.as_ref().map_or(0, wgpu::Buffer::size)
    }

    /// `None` before [`GrowingBuffer::reserve`].
    pub(super) fn buffer(&self) -> Option<&wgpu::Buffer> {
        self.buffer.as_ref()
    }

    /// Makes room for `bytes`, and says whether that took another buffer.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(super) fn reserve(&mut self, device: &wgpu::Device, bytes: usize) -> Result<bool, BackendError> {
        let needed = (bytes as u64).max(ALIGNMENT as u64);
        if self.size() >= needed {
            return Ok(false);
        }
        // Half as much again, so that a scene that grows by one object a frame does not move every frame.
        let size = (needed + needed / 2).min(device.limits().max_buffer_size & !3).max(needed);
        self.buffer = Some(new_buffer(device, self.label, size, self.usage)?);
        Ok(true)
    }

    pub(super) fn write(&self, uploads: &Uploads, offset: usize, bytes: &[u8]) {
        if let Some(buffer) = self.buffer.as_ref().filter(|_| !bytes.is_empty()) {
            uploads.write_buffer(buffer, offset as u64, bytes);
        }
    }

    /// A part of the buffer; `None` before [`GrowingBuffer::reserve`].
    pub(super) fn binding(&self, offset: usize, bytes: usize) -> Option<wgpu::BufferBinding<'_>> {
        let size = std::num::NonZeroU64::new(bytes as u64);
        self.buffer.as_ref().map(|buffer| wgpu::BufferBinding { buffer, offset: offset as u64, size })
    }
}

/// A buffer that is written as a whole, and only where that changes it.
pub(super) struct MirroredBuffer {
    pub(super) on_device: GrowingBuffer,
    /// What it is to hold, and what it holds.
    next: Vec<u8>,
    written: Vec<u8>,
}

impl MirroredBuffer {
    pub(super) fn new(label: &'static str, usage: wgpu::BufferUsages) -> Self {
        Self { on_device: GrowingBuffer::new(label, usage), next: Vec::new(), written: Vec::new() }
    }

    /// Where to put what it is to hold; empty at first.
    pub(super) fn rewrite(&mut self) -> &mut Vec<u8> {
        self.next.clear();
        &mut self.next
    }

    /// Brings to the device what was put there, and says whether that took another buffer.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(super) fn upload(&mut self, device: &wgpu::Device, uploads: &Uploads) -> Result<bool, BackendError> {
        let renewed = self.on_device.reserve(device, self.next.len())?;
        if renewed || self.next != self.written {
            self.on_device.write(uploads, 0, &self.next);
            std::mem::swap(&mut self.next, &mut self.written);
        }
        Ok(renewed)
    }
}

/// Appends bytes, and zeros up to the next place that a binding may begin at.
pub(super) fn append_aligned(bytes: &mut Vec<u8>, more: &[u8]) {
    bytes.extend_from_slice(more);
    bytes.resize(bytes.len().next_multiple_of(ALIGNMENT), 0);
}

/// How much room to give to something that needs so many bytes and had `before`: the same again if that will do, so that
/// bindings seldom change; otherwise a quarter more than it needs, or as much as `most` allows. A multiple of [`ALIGNMENT`].
pub(super) fn roomy(before: usize, needed: usize, most: u64) -> usize {
    let needed = needed.max(1).next_multiple_of(ALIGNMENT);
    let most = usize::try_from(most).unwrap_or(usize::MAX) / ALIGNMENT * ALIGNMENT;
    if (needed..=most.min(4 * needed)).contains(&before) {
        return before;
    }
    (needed + needed / 4).next_multiple_of(ALIGNMENT).min(most).max(needed)
}

/// # Errors
/// If a shader on this device cannot read a storage buffer of that many bytes.
pub(super) fn check_storage(device: &wgpu::Device, bytes: usize) -> Result<(), BackendError> {
    let (allowed, needed) = (device.limits().max_storage_buffer_binding_size, bytes as u64);
    if needed > allowed {
        return Err(BackendError::Limit { limit: "max_storage_buffer_binding_size", allowed, needed });
    }
    Ok(())
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    #[test]
    fn room_changes_seldom_and_always_holds_what_is_needed() {
        let mut before = 0;
        let mut changes = 0;
        for step in 0..10_000_usize {
            // Up and down by a third.
            let needed = 9_000 + (step % 600).abs_diff(300) * 10;
            let room = roomy(before, needed, u64::MAX);
            assert!(room >= needed && room <= 5 * needed && room.is_multiple_of(ALIGNMENT));
            changes += usize::from(room != before);
            before = room;
        }
        assert!(changes <= 2, "{changes}");
        assert_eq!(roomy(1 << 20, 100, u64::MAX), 512);
        assert_eq!(roomy(0, 1000, 1100), 1024);
        // There may be less room than there was.
        assert_eq!(roomy(2048, 1000, 1500), 1280);
        assert_eq!(roomy(0, 0, u64::MAX), 512);
    }
}
