//! The device's queue, with a count of the bytes that are uploaded through it.

use std::num::NonZeroU64;
use std::sync::atomic::{AtomicU64, Ordering};

/// Writes to buffers, and counts the bytes.
pub(crate) struct UploadQueue {
    queue: wgpu::Queue,
    bytes: AtomicU64,
}

impl UploadQueue {
    pub(crate) fn new(queue: wgpu::Queue) -> Self {
        Self { queue, bytes: AtomicU64::new(0) }
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

    /// Counts bytes that were written into mapped memory.
    pub(crate) fn count(&self, bytes: u64) {
        self.bytes.fetch_add(bytes, Ordering::Relaxed);
    }
}
