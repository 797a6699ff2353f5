//! Timestamps read back from the device.

use std::mem;
use std::sync::{Arc, mpsc};
use std::time::Duration;

use parking_lot::Mutex;

use super::device_pass_times::{DevicePassTime, DevicePassTimes};
use super::queries::{PassName, timestamp_bytes};
use super::tick_period::TickPeriod;
use crate::backend::BackendError;
use crate::backend::wgpu::error_scope::{poll, with_error_scope};
use crate::backend::wgpu::resources::GrowingBuffer;

/// A frame's timestamps in flight to the CPU.
pub(crate) struct TimestampReadback {
    /// Locked while it is mapped.
    buffer: Mutex<GrowingBuffer>,
    names: Arc<[PassName]>,
    tick_period: TickPeriod,
    /// The buffer returns to it on drop.
    pool: Arc<ReadbackPool>,
}

impl Drop for TimestampReadback {
    fn drop(&mut self) {
        self.pool.give_back(mem::replace(self.buffer.get_mut(), ReadbackPool::new_buffer()));
    }
}

impl TimestampReadback {
    pub(crate) fn new(
        buffer: GrowingBuffer,
        names: Arc<[PassName]>,
        tick_period: TickPeriod,
        pool: Arc<ReadbackPool>,
    ) -> Self {
        Self { buffer: Mutex::new(buffer), names, tick_period, pool }
    }

    /// Reads the timestamps. The device must have finished the frame.
    ///
    /// # Errors
    /// If the device refuses or is lost.
    pub(crate) fn read(&self, device: &wgpu::Device) -> Result<DevicePassTimes, BackendError> {
        let mut buffer = self.buffer.lock();
        let stamps = read_timestamps(device, &buffer, self.names.len()).inspect_err(|_| {
            // It may still be mapped, so no frame can use it again.
            *buffer = ReadbackPool::new_buffer();
        })?;
        Ok(pass_times(&self.names, self.tick_period, &stamps))
    }
}

/// A pool of mappable buffers for timestamps.
#[derive(Default)]
pub(crate) struct ReadbackPool {
    free: Mutex<Vec<GrowingBuffer>>,
}

impl ReadbackPool {
    /// Bounds the pool, because an engine may hold any number of frames and drop them at once.
    const MAX_POOLED: usize = 8;

    /// Drops all buffers, because a device error may have left some unusable.
    pub(crate) fn clear(&self) {
        self.free.lock().clear();
    }

    /// An unallocated mappable buffer.
    pub(crate) fn new_buffer() -> GrowingBuffer {
        GrowingBuffer::new("timestamps read back", wgpu::BufferUsages::MAP_READ)
    }

    pub(crate) fn take(&self) -> GrowingBuffer {
        self.free.lock().pop().unwrap_or_else(Self::new_buffer)
    }

    fn give_back(&self, buffer: GrowingBuffer) {
        let mut free = self.free.lock();
        if free.len() < Self::MAX_POOLED && buffer.buffer().is_some() {
            free.push(buffer);
        }
    }
}

/// Maps a buffer and reads the timestamps of `passes` passes: begin and end. The device must have finished the copy
/// into it.
///
/// # Errors
/// If the device refuses or is lost.
pub(crate) fn read_timestamps(
    device: &wgpu::Device,
    buffer: &GrowingBuffer,
    passes: usize,
) -> Result<Vec<[u64; 2]>, BackendError> {
    let lost = |message: String| BackendError::DeviceLost { message };
    if passes == 0 {
        return Ok(Vec::new());
    }
    let buffer = buffer.buffer().ok_or_else(|| lost("its timestamps never came back".to_owned()))?;
    let range = 0..timestamp_bytes(passes) as u64;
    let (sender, receiver) = mpsc::channel();
    with_error_scope(device, "timestamps", || {
        buffer.slice(range.clone()).map_async(wgpu::MapMode::Read, move |result| {
            // Fails only if the device refused the mapping; then the receiver below is gone.
            let _ = sender.send(result);
        });
    })?;
    // The copy is finished, so polling suffices; waiting would also wait for later submissions.
    poll(device, wgpu::PollType::Poll)?;
    let result = receiver.recv().map_err(|error| lost(error.to_string()))?;
    result.map_err(|error| lost(error.to_string()))?;
    let stamps = {
        let bytes = buffer.get_mapped_range(range).map_err(|error| lost(error.to_string()))?;
        bytemuck::pod_collect_to_vec(&bytes[..])
    };
    buffer.unmap();
    Ok(stamps)
}

/// The times of the named passes.
fn pass_times(names: &[PassName], tick_period: TickPeriod, stamps: &[[u64; 2]]) -> DevicePassTimes {
    let time = |name: &PassName, [began, ended]: [u64; 2]| {
        let (process, view) = (name.process.clone(), name.view.clone());
        // An unwritten timestamp is 0.
        if began == 0 || ended < began {
            return None;
        }
        let [began, ended] = [began, ended].map(|stamp| tick_period.nanoseconds(stamp).map(Duration::from_nanos));
        Some(DevicePassTime { process, view, began: began?, ended: ended? })
    };
    let passes: Vec<_> = names.iter().zip(stamps).filter_map(|(name, &stamps)| time(name, stamps)).collect();
    DevicePassTimes { skipped: names.len() - passes.len(), passes }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_timestamps_are_skipped_and_counted() {
        let name = |process: &str| PassName { process: process.to_owned(), view: "main".to_owned() };
        let names = ["first", "unwritten", "backwards", "half written", "endless", "last"].map(name);
        let stamps = [[10, 20], [0, 0], [30, 29], [0, 40], [50, u64::MAX], [60, 60]];
        let times = pass_times(&names, TickPeriod::new(1.5), &stamps);
        let nanoseconds = |pass: &DevicePassTime| (pass.process.clone(), pass.began.as_nanos(), pass.ended.as_nanos());
        let passes: Vec<_> = times.passes.iter().map(nanoseconds).collect();
        assert_eq!(passes, [("first".to_owned(), 15, 30), ("last".to_owned(), 90, 90)]);
        assert_eq!(times.skipped, 4);
    }
}
