//! Timestamps that the device writes at the begin and end of passes, and how they come back.

use std::mem;
use std::sync::{Arc, mpsc};
use std::time::Duration;

use parking_lot::Mutex;

use crate::backend::BackendError;
use crate::backend::wgpu::error_scope::{poll, with_error_scope};
use crate::backend::wgpu::resources::GrowingBuffer;
use crate::backend::wgpu::strategy::PassSegment;

/// Timestamps per query set. A device allows 4096; frames of more passes use several sets.
const QUERIES_PER_SET: u32 = 512;
const PASSES_PER_SET: usize = QUERIES_PER_SET as usize / 2;

/// The state of a backend that times passes on the device.
pub(crate) struct DeviceTiming {
    /// Whether raw passes are timed as well.
    pub(crate) times_raw_passes: bool,
    pub(crate) tick_period: TickPeriod,
    pub(crate) readback_pool: Arc<ReadbackPool>,
}

impl DeviceTiming {
    /// # Errors
    /// If the device writes no timestamps, naming the feature.
    pub(crate) fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Self, BackendError> {
        let missing = wgpu::Features::TIMESTAMP_QUERY - device.features();
        if !missing.is_empty() {
            return Err(BackendError::MissingFeature { missing: missing.to_string() });
        }
        if device.adapter_info().backend == wgpu::Backend::Noop {
            let missing = "TIMESTAMP_QUERY (wgpu's noop backend claims it, and writes none)".to_owned();
            return Err(BackendError::MissingFeature { missing });
        }
        let times_raw_passes = device.features().contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);
        let tick_period = TickPeriod::new(queue.get_timestamp_period());
        Ok(Self { times_raw_passes, tick_period, readback_pool: Arc::default() })
    }
}

/// The timestamps of one frame's passes, kept with its buffers for later frames.
pub(crate) struct Timestamps {
    sets: Vec<wgpu::QuerySet>,
    resolved: GrowingBuffer,
    /// Of the timed passes, in submission order.
    names: Arc<[PassName]>,
}

impl Default for Timestamps {
    fn default() -> Self {
        let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        Self { sets: Vec::new(), resolved: GrowingBuffer::new("timestamps", usage), names: Arc::default() }
    }
}

impl Timestamps {
    /// Makes room for the timed passes of a frame, given by the names of process and view.
    ///
    /// # Errors
    /// If the device has no room.
    pub(crate) fn begin_frame<'a>(
        &mut self,
        device: &wgpu::Device,
        names: impl Iterator<Item = (&'a str, &'a str)> + Clone,
    ) -> Result<(), BackendError> {
        if !self
            .names
            .iter()
            .map(|name| (&*name.process, &*name.view))
            .eq(names.clone().map(|(process, view): (&str, &str)| (process, view)))
        {
            let owned = |(process, view): (&str, &str)| PassName { process: process.to_owned(), view: view.to_owned() };
            self.names = names.map(owned).collect();
        }
        while self.sets.len() * PASSES_PER_SET < self.names.len() {
            self.sets.push(new_query_set(device, QUERIES_PER_SET));
        }
        self.resolved.reserve(device, self.sets.len() * timestamp_bytes(PASSES_PER_SET))?;
        Ok(())
    }

    /// The timestamp writes of a segment of a timed pass; `None` for a segment in the middle.
    pub(crate) fn writes_of_segment(
        &self,
        timed_pass: usize,
        segment: PassSegment,
    ) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        let (query_set, [begin, end]) = self.queries(timed_pass)?;
        (segment.is_first || segment.is_last).then_some(wgpu::RenderPassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: segment.is_first.then_some(begin),
            end_of_pass_write_index: segment.is_last.then_some(end),
        })
    }

    /// The query set of a timed pass, and its queries for begin and end.
    pub(crate) fn queries(&self, timed_pass: usize) -> Option<(&wgpu::QuerySet, [u32; 2])> {
        let begin = (timed_pass % PASSES_PER_SET) as u32 * 2;
        self.sets.get(timed_pass / PASSES_PER_SET).map(|set| (set, [begin, begin + 1]))
    }

    /// Encodes the copy of the frame's timestamps into a mappable buffer. Submit it after the passes.
    ///
    /// # Errors
    /// If the device has no room.
    pub(crate) fn read_back(
        &self,
        device: &wgpu::Device,
        timing: &DeviceTiming,
    ) -> Result<(wgpu::CommandBuffer, TimestampReadback), BackendError> {
        let descriptor = wgpu::CommandEncoderDescriptor { label: Some("timestamps") };
        let mut encoder = device.create_command_encoder(&descriptor);
        let mut target = timing.readback_pool.take();
        target.reserve(device, timestamp_bytes(self.names.len()))?;
        if let Some((resolved, mappable)) = self.resolved.buffer().zip(target.buffer()) {
            let mut remaining = self.names.len();
            for (index, set) in self.sets.iter().enumerate() {
                let passes = remaining.min(PASSES_PER_SET);
                if passes > 0 {
                    let offset = timestamp_bytes(index * PASSES_PER_SET) as u64;
                    encoder.resolve_query_set(set, 0..passes as u32 * 2, resolved, offset);
                }
                remaining -= passes;
            }
            encoder.copy_buffer_to_buffer(resolved, 0, mappable, 0, timestamp_bytes(self.names.len()) as u64);
        }
        let pool = Arc::clone(&timing.readback_pool);
        let readback = TimestampReadback::new(target, Arc::clone(&self.names), timing.tick_period, pool);
        Ok((encoder.finish(), readback))
    }
}

/// Bytes of one timestamp.
const TIMESTAMP_BYTES: u64 = wgpu::QUERY_SIZE as u64;

/// The names of a pass's process and view.
pub(crate) struct PassName {
    pub(crate) process: String,
    pub(crate) view: String,
}

/// The size of both timestamps of this many passes.
pub(crate) fn timestamp_bytes(passes: usize) -> usize {
    passes * 2 * TIMESTAMP_BYTES as usize
}

/// A query set for `count` timestamps.
pub(crate) fn new_query_set(device: &wgpu::Device, count: u32) -> wgpu::QuerySet {
    let descriptor = wgpu::QuerySetDescriptor { label: Some("timestamps"), ty: wgpu::QueryType::Timestamp, count };
    device.create_query_set(&descriptor)
}

/// How long a tick of the device's clock is.
#[derive(Clone, Copy)]
pub(crate) struct TickPeriod {
    /// In 2⁻³² ns: fixed point, because some devices count from 1970, and a float of that has an error of hundreds of
    /// nanoseconds.
    period: u128,
}

impl TickPeriod {
    pub(crate) fn new(nanoseconds: f32) -> Self {
        Self { period: (f64::from(nanoseconds) * 2_f64.powi(32)) as u128 }
    }

    /// This many ticks in nanoseconds; `None` after 584 years.
    pub(crate) fn nanoseconds(self, ticks: u64) -> Option<u64> {
        let product = u128::from(ticks).checked_mul(self.period)?;
        u64::try_from(product >> 32).ok()
    }
}

/// When the device drew the passes of a frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DevicePassTimes {
    /// In submission order. A device may draw several passes at once.
    pub passes: Vec<DevicePassTime>,
    /// The number of passes left out because their timestamps are invalid: not written, or an end before the begin.
    pub skipped: usize,
}

/// When the device drew a pass.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DevicePassTime {
    /// The render process's name.
    pub process: String,
    /// The view's name.
    pub view: String,
    /// When it began, on the device's own clock, whose origin only the device knows.
    pub began: Duration,
    /// When it ended, on the same clock.
    pub ended: Duration,
}

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
    fn large_tick_counts_convert_without_losing_a_nanosecond() {
        let epoch = 1_700_000_000_000_000_001;
        assert_eq!(TickPeriod::new(1.0).nanoseconds(epoch), Some(epoch));
        assert_eq!(TickPeriod::new(2.0).nanoseconds(epoch), Some(epoch * 2));
        assert_eq!(TickPeriod::new(0.25).nanoseconds(41), Some(10));
        assert_eq!(TickPeriod::new(1000.0).nanoseconds(epoch), None);
        let coarse = TickPeriod::new(83.333_336);
        assert!((0..1000).map(|tick| coarse.nanoseconds(tick * 1_000_003)).is_sorted());
        assert_eq!(coarse.nanoseconds(12_000_000).map(|time| time / 1000), Some(1_000_000));
    }

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
