//! Timestamps that the device writes where passes begin and end.

use std::mem;
use std::sync::Arc;

use parking_lot::Mutex;

use super::frame_pass::FramePass;
use super::growing_buffer::GrowingBuffer;
use super::ways::Share;
use crate::backend::{BackendError, FrameRequest};
use crate::process::Draws;

/// Timestamps of one query set. A device allows 4096; passes that need more have several sets.
const QUERIES: u32 = 512;
const PASSES: usize = QUERIES as usize / 2;

/// Bytes of one timestamp.
const TIMESTAMP: u64 = wgpu::QUERY_SIZE as u64;

/// What a device that times passes has for it.
pub(super) struct Timing {
    /// Whether passes that encode themselves are timed as well.
    pub(super) times_raw: bool,
    pub(super) ticks: Ticks,
    pub(super) readbacks: Arc<Readbacks>,
}

impl Timing {
    /// # Errors
    /// If the device writes no timestamps, naming the feature.
    pub(super) fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Self, BackendError> {
        let missing = wgpu::Features::TIMESTAMP_QUERY - device.features();
        if !missing.is_empty() {
            return Err(BackendError::MissingFeature { missing: missing.to_string() });
        }
        if device.adapter_info().backend == wgpu::Backend::Noop {
            let missing = "TIMESTAMP_QUERY (wgpu's noop backend claims it, and writes none)".to_owned();
            return Err(BackendError::MissingFeature { missing });
        }
        let times_raw = device.features().contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);
        Ok(Self { times_raw, ticks: Ticks::new(queue.get_timestamp_period()), readbacks: Arc::default() })
    }
}

/// How long the device's ticks are.
#[derive(Clone, Copy)]
pub(super) struct Ticks {
    /// In 2⁻³² ns. Some devices count from 1970; a float would leave hundreds of nanoseconds of that.
    period: u128,
}

impl Ticks {
    /// Of so many nanoseconds each.
    pub(super) fn new(nanoseconds: f32) -> Self {
        Self { period: (f64::from(nanoseconds) * 2_f64.powi(32)) as u128 }
    }

    /// So many ticks in nanoseconds; `None` past 584 years.
    pub(super) fn nanoseconds(self, ticks: u64) -> Option<u64> {
        let product = u128::from(ticks).checked_mul(self.period)?;
        u64::try_from(product >> 32).ok()
    }
}

/// The process and the view of a pass.
pub(super) struct PassName {
    pub(super) process: String,
    pub(super) view: String,
}

/// The timestamps of one frame's passes, kept with its buffers until the next.
pub(super) struct Timestamps {
    sets: Vec<wgpu::QuerySet>,
    resolved: GrowingBuffer,
    /// Of the passes that are timed, in the order they are submitted.
    names: Arc<[PassName]>,
}

impl Default for Timestamps {
    fn default() -> Self {
        let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        Self { sets: Vec::new(), resolved: GrowingBuffer::new("timestamps", usage), names: Arc::default() }
    }
}

impl Timestamps {
    /// Gives each pass of a frame its place.
    ///
    /// # Errors
    /// If the device has no room.
    pub(super) fn begin(
        &mut self,
        device: &wgpu::Device,
        request: &FrameRequest<'_>,
        passes: &mut [FramePass],
        times_raw: bool,
    ) -> Result<(), BackendError> {
        let is_timed = |process: usize| times_raw || !matches!(request.draws[process], Draws::Raw(_));
        let mut places = 0..;
        for pass in passes.iter_mut() {
            pass.timed_place = if is_timed(pass.pass.process) { places.next() } else { None };
        }
        let names = || {
            passes.iter().filter(|pass| pass.timed_place.is_some()).map(|FramePass { pass, .. }| {
                (request.plan.processes()[pass.process].process.name(), request.views[pass.view].name())
            })
        };
        if !self.names.iter().map(|name| (&*name.process, &*name.view)).eq(names()) {
            let owned = |(process, view): (&str, &str)| PassName { process: process.to_owned(), view: view.to_owned() };
            self.names = names().map(owned).collect();
        }
        while self.sets.len() * PASSES < self.names.len() {
            self.sets.push(new_set(device, QUERIES));
        }
        self.resolved.reserve(device, self.sets.len() * bytes(PASSES))?;
        Ok(())
    }

    /// Where a share of a pass writes that the pass begins, and that it ends; `None` if it does neither.
    pub(super) fn of_share(&self, place: usize, share: Share) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        let (query_set, [began, ended]) = self.of_pass(place)?;
        (share.is_first || share.is_last).then_some(wgpu::RenderPassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: share.is_first.then_some(began),
            end_of_pass_write_index: share.is_last.then_some(ended),
        })
    }

    /// Where it is written that a pass begins, and that it ends.
    pub(super) fn of_pass(&self, place: usize) -> Option<(&wgpu::QuerySet, [u32; 2])> {
        let began = (place % PASSES) as u32 * 2;
        self.sets.get(place / PASSES).map(|set| (set, [began, began + 1]))
    }

    /// Encodes that the frame's timestamps are copied to where they can be read. To be submitted after the passes.
    ///
    /// # Errors
    /// If the device has no room.
    pub(super) fn read_back(
        &self,
        device: &wgpu::Device,
        timing: &Timing,
    ) -> Result<(wgpu::CommandBuffer, Readback), BackendError> {
        let descriptor = wgpu::CommandEncoderDescriptor { label: Some("timestamps") };
        let mut encoder = device.create_command_encoder(&descriptor);
        let mut target = timing.readbacks.take();
        target.reserve(device, bytes(self.names.len()))?;
        if let Some((resolved, read_back)) = self.resolved.buffer().zip(target.buffer()) {
            let mut left = self.names.len();
            for (index, set) in self.sets.iter().enumerate() {
                let passes = left.min(PASSES);
                if passes > 0 {
                    encoder.resolve_query_set(set, 0..passes as u32 * 2, resolved, bytes(index * PASSES) as u64);
                }
                left -= passes;
            }
            encoder.copy_buffer_to_buffer(resolved, 0, read_back, 0, bytes(self.names.len()) as u64);
        }
        let readback = Readback {
            buffer: Mutex::new(target),
            names: Arc::clone(&self.names),
            ticks: timing.ticks,
            pool: Arc::clone(&timing.readbacks),
        };
        Ok((encoder.finish(), readback))
    }
}

/// Of both timestamps of so many passes.
pub(super) fn bytes(passes: usize) -> usize {
    passes * 2 * TIMESTAMP as usize
}

/// For so many timestamps.
pub(super) fn new_set(device: &wgpu::Device, count: u32) -> wgpu::QuerySet {
    let descriptor = wgpu::QuerySetDescriptor { label: Some("timestamps"), ty: wgpu::QueryType::Timestamp, count };
    device.create_query_set(&descriptor)
}

/// A frame's timestamps on their way back.
pub(super) struct Readback {
    /// Locked while it is mapped.
    pub(super) buffer: Mutex<GrowingBuffer>,
    pub(super) names: Arc<[PassName]>,
    pub(super) ticks: Ticks,
    /// Where the buffer goes when nobody can ask any more.
    pool: Arc<Readbacks>,
}

impl Drop for Readback {
    fn drop(&mut self) {
        self.pool.give_back(mem::replace(self.buffer.get_mut(), Readbacks::none()));
    }
}

/// Buffers that no frame's timestamps are in at present.
#[derive(Default)]
pub(super) struct Readbacks {
    free: Mutex<Vec<GrowingBuffer>>,
}

impl Readbacks {
    /// An engine may keep any number of frames and read them at once; then the pool is not to hold as many for good.
    const MOST_KEPT: usize = 8;

    /// Drops all of them, because a device error may have left some unusable.
    pub(super) fn forget(&self) {
        self.free.lock().clear();
    }

    pub(super) fn none() -> GrowingBuffer {
        GrowingBuffer::new("timestamps read back", wgpu::BufferUsages::MAP_READ)
    }

    fn take(&self) -> GrowingBuffer {
        self.free.lock().pop().unwrap_or_else(Self::none)
    }

    fn give_back(&self, buffer: GrowingBuffer) {
        let mut free = self.free.lock();
        if free.len() < Self::MOST_KEPT && buffer.buffer().is_some() {
            free.push(buffer);
        }
    }
}
