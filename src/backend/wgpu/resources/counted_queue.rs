//! The device's queue, with a count of the bytes that are uploaded through it, and the commands that belong to them.

use std::mem;
use std::num::NonZeroU64;
use std::sync::atomic::{AtomicU64, Ordering};

use parking_lot::Mutex;

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
