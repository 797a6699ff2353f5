//! The CPU time that recording a pass costs.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Instant;

/// What recording a pass cost. The frame's jobs write it, with relaxed atomics; the thread that submits the frame reads
/// it, and the hand-over of the frame to that thread orders both.
#[derive(Default)]
pub(crate) struct PassTiming {
    /// In nanoseconds, summed over all workers: the recording of parts.
    parallel_time: AtomicU64,
    parts: AtomicUsize,
    /// In nanoseconds: the work of one thread.
    serial_time: AtomicU64,
    batches: AtomicUsize,
    bundles: AtomicUsize,
    recorded_bundles: AtomicUsize,
    replayed_bundles: AtomicUsize,
}

impl PassTiming {
    /// Sets the size of the pass.
    pub(crate) fn set_size(&self, batches: usize, bundles: usize, parts: usize) {
        self.batches.store(batches, Ordering::Relaxed);
        self.bundles.store(bundles, Ordering::Relaxed);
        self.parts.store(parts, Ordering::Relaxed);
    }

    /// Times work that several workers may do at once.
    pub(crate) fn time_parallel<R>(&self, work: impl FnOnce() -> R) -> R {
        time(&self.parallel_time, work)
    }

    /// Times work that only one thread does.
    pub(crate) fn time_serial<R>(&self, work: impl FnOnce() -> R) -> R {
        time(&self.serial_time, work)
    }

    /// Adds a time in nanoseconds that one thread spent on the pass, measured with that of other passes.
    pub(crate) fn add_serial(&self, nanoseconds: u64) {
        self.serial_time.fetch_add(nanoseconds, Ordering::Relaxed);
    }

    pub(crate) fn count_bundle(&self, is_replayed: bool) {
        let counter = if is_replayed { &self.replayed_bundles } else { &self.recorded_bundles };
        counter.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn batches(&self) -> usize {
        self.batches.load(Ordering::Relaxed)
    }

    /// The batches of the pass; `None` if it was not recorded.
    pub(crate) fn latest_batches(&self) -> Option<usize> {
        (self.total() > 0.0).then(|| self.batches())
    }

    pub(crate) fn bundles(&self) -> usize {
        self.bundles.load(Ordering::Relaxed)
    }

    pub(crate) fn recorded_bundles(&self) -> usize {
        self.recorded_bundles.load(Ordering::Relaxed)
    }

    pub(crate) fn replayed_bundles(&self) -> usize {
        self.replayed_bundles.load(Ordering::Relaxed)
    }

    /// In nanoseconds, summed over all workers.
    pub(crate) fn total(&self) -> f64 {
        (self.parallel_time.load(Ordering::Relaxed) + self.serial_time.load(Ordering::Relaxed)) as f64
    }

    /// The critical path in nanoseconds, on `workers` workers that do nothing else.
    pub(crate) fn critical_path(&self, workers: usize) -> f64 {
        let shared = self.parts.load(Ordering::Relaxed).min(workers).max(1);
        self.parallel_time.load(Ordering::Relaxed) as f64 / shared as f64
            + self.serial_time.load(Ordering::Relaxed) as f64
    }
}

fn time<R>(counter: &AtomicU64, work: impl FnOnce() -> R) -> R {
    let start = Instant::now();
    let result = work();
    counter.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
    result
}
