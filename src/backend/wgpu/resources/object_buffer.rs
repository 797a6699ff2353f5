//! A buffer with an element for each of a frame's objects.

use std::ops::Range;
use std::sync::Arc;

use parking_lot::Mutex;

use super::growing_buffer::GrowingBuffer;
use crate::backend::BackendError;
use crate::backend::wgpu::error_scope::{poll, refused, with_error_scope};

/// A buffer with an element for each of a frame's objects. Where the device shares the CPU's memory, jobs write
/// straight into it while it is mapped, so nothing is staged, and nothing copied when the frame is submitted.
///
/// A mapping is requested only when the device is done with all submissions that use the buffer. wgpu would grant a
/// request that was made and cancelled before when the submission of that time is done, while a later one still reads
/// the buffer.
pub(crate) struct ObjectBuffer {
    label: &'static str,
    on_device: GrowingBuffer,
    /// `None` if writes are staged.
    usage: Option<Arc<Mutex<Usage>>>,
}

/// Who uses a buffer that can be mapped.
#[derive(Debug, Default)]
struct Usage {
    /// The number of submissions that use it, and the number of those that the device is done with.
    submitted: u64,
    done: u64,
    is_mapped: bool,
    /// Whether wgpu refused to map it.
    is_refused: bool,
}

impl Usage {
    /// Whether the buffer may be mapped. Before its first submission it may have writes that are staged, and not
    /// submitted.
    fn is_idle(&self) -> bool {
        self.submitted > 0 && self.done == self.submitted
    }
}

impl ObjectBuffer {
    /// A buffer without room. `maps_memory`: see [`shares_memory`].
    pub(crate) fn new(label: &'static str, maps_memory: bool) -> Self {
        use wgpu::BufferUsages;
        let usage = if maps_memory { BufferUsages::STORAGE | BufferUsages::MAP_WRITE } else { BufferUsages::STORAGE };
        Self { label, on_device: GrowingBuffer::new(label, usage), usage: maps_memory.then(Arc::default) }
    }

    pub(crate) fn on_device(&self) -> &GrowingBuffer {
        &self.on_device
    }

    /// Makes room for `bytes`. Returns whether the buffer was reallocated, and lost its contents.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn reserve(&mut self, device: &wgpu::Device, bytes: usize) -> Result<bool, BackendError> {
        let reallocated = self.on_device.reserve(device, bytes)?;
        if reallocated {
            // Submissions of the earlier buffer say nothing about this one.
            self.usage = self.usage.as_ref().map(|_| Arc::default());
        }
        Ok(reallocated)
    }

    /// Whether a frame can write at once: the buffer is mapped, or can be, or is not meant to be.
    pub(crate) fn is_ready(&self) -> bool {
        self.usage.as_ref().is_none_or(|usage| {
            let usage = usage.lock();
            usage.is_mapped || usage.is_idle()
        })
    }

    /// Maps the buffer if the device is done with it. Otherwise writes are staged.
    ///
    /// # Errors
    /// If the device is lost.
    pub(crate) fn map(&mut self, device: &wgpu::Device) -> Result<(), BackendError> {
        let Some((usage, buffer)) = self.usage.as_ref().zip(self.on_device.buffer()) else { return Ok(()) };
        if self.is_mapped() || !usage.lock().is_idle() {
            return Ok(());
        }
        let in_callback = Arc::clone(usage);
        let mapped = move |result: Result<_, _>| {
            let mut usage = in_callback.lock();
            (usage.is_mapped, usage.is_refused) = (result.is_ok(), result.is_err());
        };
        with_error_scope(device, self.label, || buffer.map_async(wgpu::MapMode::Write, .., mapped))?;
        poll(device, wgpu::PollType::Poll)?;
        let maps_memory = !usage.lock().is_refused;
        if !self.is_mapped() {
            // A new buffer, without the request. It is pending if a frame was dropped whose staged writes the device
            // still executes.
            *self = Self::new(self.label, maps_memory);
        }
        Ok(())
    }

    /// A view of a range in bytes, to write through; `None` if writes are staged. Views at the same time must not
    /// overlap.
    ///
    /// # Errors
    /// If wgpu refuses.
    pub(crate) fn mapped(&self, bytes: Range<usize>) -> Result<Option<wgpu::BufferViewMut>, BackendError> {
        let Some(buffer) = self.on_device.buffer().filter(|_| self.is_mapped()) else { return Ok(None) };
        let view = buffer.get_mapped_range_mut(bytes.start as u64..bytes.end as u64);
        view.map(Some).map_err(|error| refused(self.label, error.to_string()))
    }

    /// Gives the buffer to the device, before a submission that reads it.
    pub(crate) fn unmap(&self) {
        let Some((usage, buffer)) = self.usage.as_ref().zip(self.on_device.buffer()) else { return };
        let mut usage = usage.lock();
        usage.submitted += 1;
        if std::mem::take(&mut usage.is_mapped) {
            buffer.unmap();
        }
    }

    /// Notices when the device is done with the submission, which was the latest one of the queue.
    pub(crate) fn await_submission(&self, queue: &wgpu::Queue) {
        let Some(usage) = &self.usage else { return };
        let (usage, number) = (Arc::clone(usage), usage.lock().submitted);
        queue.on_submitted_work_done(move || {
            let mut usage = usage.lock();
            usage.done = usage.done.max(number);
        });
    }

    fn is_mapped(&self) -> bool {
        self.usage.as_ref().is_some_and(|usage| usage.lock().is_mapped)
    }
}

/// Whether a device reads the CPU's own memory as fast as any other. Devices with memory of their own read the CPU's
/// through a bus.
pub(crate) fn shares_memory(adapter: &wgpu::AdapterInfo) -> bool {
    use wgpu::{Backend, DeviceType};
    adapter.backend == Backend::Noop || matches!(adapter.device_type, DeviceType::IntegratedGpu | DeviceType::Cpu)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::wgpu::noop_device::noop_device;

    fn submit(buffer: &ObjectBuffer, queue: &wgpu::Queue) {
        buffer.unmap();
        queue.submit([]);
        buffer.await_submission(queue);
    }

    fn can_write(buffer: &ObjectBuffer, bytes: Range<usize>) -> bool {
        buffer.mapped(bytes).unwrap().is_some()
    }

    #[test]
    fn a_buffer_is_mapped_when_the_device_is_done_with_it() {
        let (device, queue) = noop_device();
        let mut buffer = ObjectBuffer::new("objects", true);
        for bytes in [1_000, 4_000] {
            buffer.reserve(&device, bytes).unwrap();
            buffer.map(&device).unwrap();
            assert!(!buffer.is_ready() && !can_write(&buffer, 0..64), "new, so the first frame is staged");
            for _frame in 0..3 {
                submit(&buffer, &queue);
                assert!(!buffer.is_ready());
                buffer.map(&device).unwrap();
                assert!(!can_write(&buffer, 0..64), "nobody has polled");
                poll(&device, wgpu::PollType::Poll).unwrap();
                assert!(buffer.is_ready());
                buffer.map(&device).unwrap();
                let views = [0..64, 64..bytes].map(|bytes| buffer.mapped(bytes).unwrap());
                assert!(views.iter().all(Option::is_some));
                assert!(buffer.mapped(32..96).is_err(), "views must not overlap");
            }
        }
    }

    #[test]
    fn the_end_of_an_earlier_submission_does_not_free_the_buffer() {
        let (device, queue) = noop_device();
        let mut buffer = ObjectBuffer::new("objects", true);
        buffer.reserve(&device, 64).unwrap();
        submit(&buffer, &queue);
        buffer.unmap();
        poll(&device, wgpu::PollType::Poll).unwrap();
        assert!(!buffer.is_ready());
        queue.submit([]);
        buffer.await_submission(&queue);
        poll(&device, wgpu::PollType::Poll).unwrap();
        assert!(buffer.is_ready());
        submit(&buffer, &queue);
        buffer.reserve(&device, 1 << 20).unwrap();
        poll(&device, wgpu::PollType::Poll).unwrap();
        assert!(!buffer.is_ready(), "the submission read another buffer");
    }

    #[test]
    fn without_mapping_writes_are_staged() {
        let (device, queue) = noop_device();
        let mut buffer = ObjectBuffer::new("objects", false);
        buffer.reserve(&device, 64).unwrap();
        submit(&buffer, &queue);
        buffer.map(&device).unwrap();
        assert!(buffer.is_ready() && !can_write(&buffer, 0..64));
    }
}
