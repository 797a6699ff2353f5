//! The device's queue as it is written through, which counts what goes up.

use std::num::NonZeroU64;
use std::sync::atomic::{AtomicU64, Ordering};

/// Writes to buffers and textures, and counts the bytes.
pub(super) struct Uploads {
    queue: wgpu::Queue,
    bytes: AtomicU64,
}

impl Uploads {
    pub(super) fn new(queue: wgpu::Queue) -> Self {
        Self { queue, bytes: AtomicU64::new(0) }
    }

    pub(super) fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// How many bytes have gone up so far.
    pub(super) fn bytes(&self) -> u64 {
        // Relaxed, here and below: it is a count, which is read before a frame's jobs begin and when they have ended.
        self.bytes.load(Ordering::Relaxed)
    }

    pub(super) fn write_buffer(&self, buffer: &wgpu::Buffer, offset: u64, bytes: &[u8]) {
        self.count(bytes.len() as u64);
        self.queue.write_buffer(buffer, offset, bytes);
    }

    /// `None` if wgpu refuses, and has told the error scope why.
    pub(super) fn write_buffer_with(
        &self,
        buffer: &wgpu::Buffer,
        offset: u64,
        size: NonZeroU64,
    ) -> Option<wgpu::QueueWriteBufferView> {
        self.count(size.get());
        self.queue.write_buffer_with(buffer, offset, size)
    }

    pub(super) fn write_texture(
        &self,
        texture: wgpu::TexelCopyTextureInfo<'_>,
        bytes: &[u8],
        layout: wgpu::TexelCopyBufferLayout,
        size: wgpu::Extent3d,
    ) {
        self.count(bytes.len() as u64);
        self.queue.write_texture(texture, bytes, layout, size);
    }

    fn count(&self, bytes: u64) {
        self.bytes.fetch_add(bytes, Ordering::Relaxed);
    }
}
