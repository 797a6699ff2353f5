//! Buffers with a copy on the CPU.

use super::counted_queue::CountedQueue;
use super::growing_buffer::GrowingBuffer;
use crate::backend::BackendError;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::wgpu::noop_device::noop_device;

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
