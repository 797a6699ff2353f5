//! What a frame's buffers hold for one of its passes.

use std::fmt::Write;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Instant;

use parking_lot::RwLock;

use super::arguments::Arguments;
use super::chooser::Sample;
use super::growing_buffer::GrowingBuffer;
use super::kept::{KeptBundles, ProcessGroup};
use super::uploads::Uploads;
use super::ways::{Encode, Record, Way, WgpuPass};
use crate::backend::BackendError;
use crate::process::Pass;

/// One pass of a frame, with what is kept for it until the next frame that has these buffers.
pub(super) struct FramePass {
    pub(super) pass: Pass,
    /// Names the process and the view in errors.
    pub(super) label: String,
    /// Where its objects are among all that are drawn; none for a pass without commands.
    pub(super) drawn_place: Option<usize>,
    /// Where its times are among those of all passes; none for a pass that is not timed.
    pub(super) timed_place: Option<usize>,
    /// Where its parameters are, and how many bytes; none for a pass without.
    pub(super) parameters: Option<(usize, usize)>,
    /// `@group(0)`.
    pub(super) frame_group: Option<wgpu::BindGroup>,
    /// `@group(2)`.
    pub(super) process_group: Option<ProcessGroup>,
    pub(super) way: Way,
    /// Its index among the ways that the backend offers.
    pub(super) way_index: usize,
    /// Whether what the way keeps from frame to frame was there when the frame began.
    is_warm: bool,
    pub(super) kept: KeptBundles,
    pub(super) arguments: Arguments,
    /// Of the triangles that remain of partial batches.
    pub(super) indices: RwLock<GrowingBuffer>,
    pub(super) spent: Spent,
}

impl Default for FramePass {
    fn default() -> Self {
        Self {
            pass: Pass { process: 0, view: 0 },
            label: String::new(),
            drawn_place: None,
            timed_place: None,
            parameters: None,
            frame_group: None,
            process_group: None,
            way: Way { record: Record::Direct, encode: Encode::PerPass },
            way_index: 0,
            is_warm: false,
            kept: KeptBundles::default(),
            arguments: Arguments::default(),
            indices: RwLock::new(index_buffer()),
            spent: Spent::default(),
        }
    }
}

impl FramePass {
    pub(super) fn set_label(&mut self, process: &str, view: &str) {
        self.label.clear();
        // Writing into a string cannot fail.
        let _ = write!(self.label, "{process:?} in view {view:?}");
    }

    /// Takes a way, and drops what other ways have kept; unless this one is only tried.
    pub(super) fn take(&mut self, way: Way, way_index: usize, is_trial: bool) {
        (self.way, self.way_index) = (way, way_index);
        self.is_warm = match way.record {
            Record::Kept => self.kept.are_there(),
            Record::Indirect => self.arguments.are_there(),
            Record::Direct | Record::Bundles => true,
        };
        if !is_trial && way.record != Record::Kept {
            self.kept.forget();
        }
        if !is_trial && way.record != Record::Indirect {
            self.arguments.forget();
        }
        self.spent = Spent::default();
    }

    /// Drops what is kept for the next frame and holds more than its own memory.
    pub(super) fn forget(&mut self) {
        self.process_group = None;
        self.kept.forget();
    }

    /// Uploads the triangles that remain of partial batches; where there are none, drops the buffer.
    ///
    /// # Errors
    /// If the device has no room.
    pub(super) fn upload_indices(
        &self,
        device: &wgpu::Device,
        uploads: &Uploads,
        indices: &[u32],
    ) -> Result<(), BackendError> {
        let mut buffer = self.indices.write();
        if indices.is_empty() {
            *buffer = index_buffer();
        } else {
            buffer.reserve(device, size_of_val(indices))?;
            buffer.write(uploads, 0, bytemuck::cast_slice(indices));
        }
        Ok(())
    }

    /// Drops what another pass that stood here has left.
    pub(super) fn forget_indices(&mut self) {
        *self.indices.get_mut() = index_buffer();
    }

    /// How it was recorded.
    pub(super) fn report(&self, process: String) -> WgpuPass {
        let spent = &self.spent;
        let (batches, bundles) = (spent.batches.load(Ordering::Relaxed), spent.bundles.load(Ordering::Relaxed));
        WgpuPass {
            process,
            view: self.pass.view,
            record: self.way.record,
            encode: self.way.encode,
            encoders: self.way.encoders(bundles),
            batches,
            recorded: spent.recorded.load(Ordering::Relaxed),
            replayed: spent.replayed.load(Ordering::Relaxed),
        }
    }

    /// What it has spent, in a frame that has spent so much on all passes and on so many workers. A pass that the others do not
    /// fill the workers beside keeps them waiting, and that is part of its price.
    pub(super) fn sample(&self, all: f64, workers: usize) -> Sample {
        let (own, critical) = (self.spent.total(), self.spent.critical(workers));
        let price = own.max(critical * workers as f64 - (all - own));
        Sample { price, batches: self.spent.batches.load(Ordering::Relaxed), is_warm: self.is_warm }
    }
}

fn index_buffer() -> GrowingBuffer {
    GrowingBuffer::new("remaining triangles", wgpu::BufferUsages::INDEX)
}

/// What a pass has spent. Written by jobs, read when the frame is submitted, which orders everything.
#[derive(Default)]
pub(super) struct Spent {
    /// In nanoseconds: before it was finished, on all workers that took part, and how many parts they shared.
    parts_time: AtomicU64,
    parts: AtomicUsize,
    /// In nanoseconds: what one thread did.
    alone_time: AtomicU64,
    batches: AtomicUsize,
    bundles: AtomicUsize,
    recorded: AtomicUsize,
    replayed: AtomicUsize,
}

impl Spent {
    /// Notes what the pass consists of.
    pub(super) fn set_size(&self, batches: usize, bundles: usize, parts: usize) {
        self.batches.store(batches, Ordering::Relaxed);
        self.bundles.store(bundles, Ordering::Relaxed);
        self.parts.store(parts, Ordering::Relaxed);
    }

    /// Adds what several workers may do at once.
    pub(super) fn on_parts<R>(&self, work: impl FnOnce() -> R) -> R {
        timed(&self.parts_time, work)
    }

    /// Adds what only one thread does.
    pub(super) fn alone<R>(&self, work: impl FnOnce() -> R) -> R {
        timed(&self.alone_time, work)
    }

    pub(super) fn count_bundle(&self, is_replayed: bool) {
        let counter = if is_replayed { &self.replayed } else { &self.recorded };
        counter.fetch_add(1, Ordering::Relaxed);
    }

    /// In nanoseconds, over all workers.
    pub(super) fn total(&self) -> f64 {
        (self.parts_time.load(Ordering::Relaxed) + self.alone_time.load(Ordering::Relaxed)) as f64
    }

    /// In nanoseconds, from beginning to end on so many workers that do nothing else.
    fn critical(&self, workers: usize) -> f64 {
        let shared = self.parts.load(Ordering::Relaxed).min(workers).max(1);
        self.parts_time.load(Ordering::Relaxed) as f64 / shared as f64 + self.alone_time.load(Ordering::Relaxed) as f64
    }
}

fn timed<R>(counter: &AtomicU64, work: impl FnOnce() -> R) -> R {
    let start = Instant::now();
    let result = work();
    counter.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
    result
}
