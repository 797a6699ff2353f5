//! Timestamps that the device writes at the begin and end of passes.

use std::sync::Arc;

use super::queries::{PassName, new_query_set, timestamp_bytes};
use super::readback::{ReadbackPool, TimestampReadback};
use super::tick_period::TickPeriod;
use crate::backend::BackendError;
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
