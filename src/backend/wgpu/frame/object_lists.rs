//! The lists of objects that passes draw.

use std::ops::Range;

use crate::backend::wgpu::resources::{ALIGNMENT, CountedQueue, GrowingBuffer, size_with_headroom};
use crate::backend::{BackendError, SceneLimits};

/// The lists of objects that passes of commands draw, one after the other: in one buffer, or in several of equal size
/// where one would be larger than the device allows. A list lies in one of them.
pub(super) struct ObjectLists {
    /// At least one.
    buffers: Vec<GrowingBuffer>,
    /// The size of a list, in bytes.
    stride: usize,
    /// The lists in a buffer.
    per_buffer: usize,
}

impl ObjectLists {
    pub(super) fn new() -> Self {
        Self { buffers: vec![new_buffer()], stride: 0, per_buffer: usize::MAX }
    }

    /// Makes room for `lists` lists of `objects` objects each. Returns whether what the lists held is lost.
    ///
    /// # Errors
    /// If the device has no room.
    pub(super) fn reserve(
        &mut self,
        device: &wgpu::Device,
        (lists, objects): (usize, usize),
        limits: SceneLimits,
    ) -> Result<bool, BackendError> {
        let needed = objects * size_of::<u32>();
        // Headroom is for what fits beside it.
        let max_stride = limits.binding_bytes.min(limits.buffer_bytes / lists.max(1) as u64);
        let stride = size_with_headroom(self.stride, needed, max_stride);
        let per_buffer = usize::try_from(limits.buffer_bytes / stride as u64).unwrap_or(usize::MAX).max(1);
        let mut is_lost = (self.stride, self.per_buffer) != (stride, per_buffer);
        (self.stride, self.per_buffer) = (stride, per_buffer);
        let count = lists.div_ceil(per_buffer).max(1);
        is_lost |= count > self.buffers.len();
        self.buffers.resize_with(count, new_buffer);
        for (index, buffer) in self.buffers.iter_mut().enumerate() {
            let lists = lists.saturating_sub(index * per_buffer).min(per_buffer);
            is_lost |= buffer.reserve(device, (lists * stride).max(ALIGNMENT))?;
        }
        Ok(is_lost)
    }

    /// The maximum number of lists of `objects` objects each that one buffer holds without headroom.
    pub(super) fn max_in_one_buffer(objects: usize, limits: SceneLimits) -> u64 {
        limits.buffer_bytes / (objects * size_of::<u32>()).next_multiple_of(ALIGNMENT) as u64
    }

    /// The bytes of a list, by its place among all lists, as if these were in one buffer. The layout requires a binding
    /// even if a pass has no list; it reads nothing from it.
    pub(super) fn bytes_of(&self, list: &Range<usize>) -> Range<usize> {
        if list.is_empty() { 0..ALIGNMENT } else { list.start * self.stride..list.end * self.stride }
    }

    /// Those bytes, to be bound.
    pub(super) fn binding(&self, bytes: &Range<usize>) -> Option<wgpu::BufferBinding<'_>> {
        let (buffer, offset) = self.position(bytes.start);
        self.buffers.get(buffer)?.binding(offset, bytes.len())
    }

    /// Writes to a list that begins at `start`.
    pub(super) fn write(&self, uploads: &CountedQueue, start: usize, offset: usize, bytes: &[u8]) {
        let (buffer, start) = self.position(start);
        if let Some(buffer) = self.buffers.get(buffer) {
            buffer.write(uploads, start + offset, bytes);
        }
    }

    /// Their sizes in bytes.
    pub(super) fn sizes(&self) -> impl Iterator<Item = u64> {
        self.buffers.iter().map(GrowingBuffer::size)
    }

    /// The buffer in which a list begins, and where.
    fn position(&self, start: usize) -> (usize, usize) {
        let bytes_per_buffer = self.per_buffer.saturating_mul(self.stride.max(1));
        (start / bytes_per_buffer, start % bytes_per_buffer)
    }
}

fn new_buffer() -> GrowingBuffer {
    GrowingBuffer::new("object indices", wgpu::BufferUsages::STORAGE)
}
