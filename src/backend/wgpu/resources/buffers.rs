//! Buffers on the device: how they are made, grow and are written.

use std::mem;
use std::num::NonZeroU64;
use std::sync::atomic::{AtomicU64, Ordering};

use parking_lot::Mutex;

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

    /// Uploads those of `bytes` that the buffer does not hold: whole blocks of [`BLOCK`] bytes.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn set(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        bytes: &[u8],
    ) -> Result<(), BackendError> {
        if self.on_device.reserve(device, bytes.len())? || bytes.len() != self.written.len() {
            self.on_device.write(uploads, 0, bytes);
            self.written.clear();
            self.written.extend_from_slice(bytes);
            return Ok(());
        }
        let mut start = 0;
        let blocks = || bytes.chunks(BLOCK).zip(self.written.chunks(BLOCK)).map(|(now, before)| now != before);
        for (changed, run) in runs(blocks()) {
            let end = bytes.len().min(start + run * BLOCK);
            if changed {
                self.on_device.write(uploads, start, &bytes[start..end]);
            }
            start = end;
        }
        self.written.copy_from_slice(bytes);
        Ok(())
    }

    /// Uploads the rewritten bytes if they changed. Returns whether the buffer was reallocated.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn upload(&mut self, device: &wgpu::Device, uploads: &CountedQueue) -> Result<bool, BackendError> {
        let reallocated = self.on_device.reserve(device, self.next.len())?;
        if reallocated || self.next != self.written {
            self.on_device.write(uploads, 0, &self.next);
            std::mem::swap(&mut self.next, &mut self.written);
        }
        Ok(reallocated)
    }
}

/// Smaller changes are uploaded with what is around them: another write costs more than these bytes.
const BLOCK: usize = 1024;

/// Runs of equal values, each with its length.
fn runs(values: impl Iterator<Item = bool>) -> impl Iterator<Item = (bool, usize)> {
    let mut values = values.peekable();
    std::iter::from_fn(move || {
        let first = values.next()?;
        let mut length = 1;
        while values.next_if_eq(&first).is_some() {
            length += 1;
        }
        Some((first, length))
    })
}

/// Writes to buffers, and counts the bytes. Keeps commands until no lock of the engine's resources is held.
pub(crate) struct CountedQueue {
    queue: wgpu::Queue,
    bytes: AtomicU64,
    /// In the order in which they are submitted.
    commands: Mutex<Vec<wgpu::CommandBuffer>>,
}

impl CountedQueue {
    pub(crate) fn new(queue: wgpu::Queue) -> Self {
        Self { queue, bytes: AtomicU64::new(0), commands: Mutex::default() }
    }

    pub(crate) fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// The number of bytes uploaded so far.
    pub(crate) fn bytes(&self) -> u64 {
        // Relaxed, here and below: it is a count, which is read before a frame's jobs begin and after they have ended.
        self.bytes.load(Ordering::Relaxed)
    }

    pub(crate) fn write_buffer(&self, buffer: &wgpu::Buffer, offset: u64, bytes: &[u8]) {
        self.count(bytes.len() as u64);
        self.queue.write_buffer(buffer, offset, bytes);
    }

    /// A staging view to write through; `None` if wgpu refuses, which the error scope reports.
    pub(crate) fn write_buffer_with(
        &self,
        buffer: &wgpu::Buffer,
        offset: u64,
        size: NonZeroU64,
    ) -> Option<wgpu::QueueWriteBufferView> {
        self.count(size.get());
        self.queue.write_buffer_with(buffer, offset, size)
    }

    /// Adds commands that have to be submitted before anything that reads what they make. To submit calls back for what
    /// the device has done: the engine's code, which may ask for what the caller has locked. So this does not submit.
    pub(crate) fn add_commands(&self, commands: impl IntoIterator<Item = wgpu::CommandBuffer>) {
        self.commands.lock().extend(commands);
    }

    /// Submits the commands that were added. No lock may be held.
    pub(crate) fn submit_commands(&self) {
        let commands = mem::take(&mut *self.commands.lock());
        if !commands.is_empty() {
            self.queue.submit(commands);
        }
    }

    /// Drops the commands that were added, because what they make was dropped.
    pub(crate) fn drop_commands(&self) {
        let commands = mem::take(&mut *self.commands.lock());
        drop(commands);
    }

    /// Counts bytes that were written into mapped memory.
    pub(crate) fn count(&self, bytes: u64) {
        self.bytes.fetch_add(bytes, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::wgpu::noop_device::noop_device;

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

    #[test]
    fn only_blocks_that_changed_are_uploaded() {
        let (device, queue) = noop_device();
        let uploads = CountedQueue::new(queue);
        let mut buffer = MirroredBuffer::new("", wgpu::BufferUsages::STORAGE);
        let mut bytes = vec![0; 5 * BLOCK + 8];
        let mut uploaded = |bytes: &[u8]| {
            let before = uploads.bytes();
            buffer.set(&device, &uploads, bytes).unwrap();
            uploads.bytes() - before
        };
        assert_eq!(uploaded(&bytes), bytes.len() as u64);
        assert_eq!(uploaded(&bytes), 0);
        bytes[BLOCK + 5] = 1;
        assert_eq!(uploaded(&bytes), BLOCK as u64);
        (bytes[0], bytes[2 * BLOCK], bytes[3 * BLOCK], bytes[5 * BLOCK + 7]) = (1, 1, 1, 1);
        assert_eq!(uploaded(&bytes), 3 * BLOCK as u64 + 8);
        assert_eq!(uploaded(&bytes), 0);
        bytes.truncate(BLOCK);
        assert_eq!(uploaded(&bytes), BLOCK as u64, "of another length, it is uploaded as a whole");
    }
}
