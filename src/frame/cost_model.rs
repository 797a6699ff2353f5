//! The cost model: what the items of each stage cost, measured every frame, and the job size that follows.

use std::sync::atomic::{AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use crate::view::ObjectTable;

/// What the items of a frame's stages cost. The nodes of one cost kind share an estimate; each node has its own width, and so a job
/// size of its own.
#[derive(Debug, Default)]
pub(super) struct CostModel {
    /// By cost kind.
    estimates: Vec<Estimate>,
    /// For each node, the job size in items that was chosen last; 0 before the first choice.
    chosen: Vec<AtomicUsize>,
}

/// Where the cost model keeps what belongs to a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeCosts {
    /// The index of its cost kind.
    pub(super) kind: usize,
    /// The index of the node.
    pub(super) node: usize,
}

/// The estimated cost of an item.
#[derive(Debug, Default)]
struct Estimate {
    /// Nanoseconds as the bits of an f32: an exponential average over recent frames. 0 before the first.
    per_item: AtomicU32,
    /// The number of frames in the average, up to [`AVERAGED_FRAMES`].
    frames: u32,
    /// The samples of the current frame: nanoseconds and items.
    time: AtomicU64,
    items: AtomicU64,
}

/// The time constant of the average in frames.
const AVERAGED_FRAMES: u32 = 6;

/// A frame counts as at most this multiple of the average: now and then the system preempts a worker, which says nothing about the
/// next frame.
const OUTLIER_LIMIT: f32 = 2.0;

/// Work that is worth a second job: more than it costs another worker to take the job and to fetch what the job reads into its
/// caches.
const PARALLEL_THRESHOLD: Duration = Duration::from_micros(12);

/// Jobs per worker: with several, workers do not wait long for the last one to end.
const JOBS_PER_WORKER: f32 = 4.0;

/// The shortest job: its scheduling costs a few percent. The longest job: an urgent one does not queue behind it for long.
const MIN_JOB: Duration = Duration::from_micros(6);
const MAX_JOB: Duration = Duration::from_micros(60);

/// Hysteresis: a job size stays until it is wrong by this factor.
const HYSTERESIS: f32 = 1.6;

impl CostModel {
    /// An empty model for `kinds` cost kinds and `nodes` nodes.
    pub(super) fn new(kinds: usize, nodes: usize) -> Self {
        let mut model = Self::default();
        model.estimates.resize_with(kinds, Estimate::default);
        model.chosen.resize_with(nodes, AtomicUsize::default);
        model
    }

    /// Adds a sample: the time of a job over `items` items.
    pub(super) fn add_sample(&self, costs: NodeCosts, items: usize, took: Duration) {
        let cost = &self.estimates[costs.kind];
        // Relaxed, here and below: sums, read after the run.
        cost.time.fetch_add(took.as_nanos() as u64, Ordering::Relaxed);
        cost.items.fetch_add(items as u64, Ordering::Relaxed);
    }

    /// Updates the estimates with the samples of a frame.
    pub(super) fn update(&mut self) {
        for cost in &mut self.estimates {
            let (time, items) = (std::mem::take(cost.time.get_mut()), std::mem::take(cost.items.get_mut()));
            if items == 0 {
                continue;
            }
            let latest = (time as f32 / items as f32).max(f32::MIN_POSITIVE);
            let average = f32::from_bits(*cost.per_item.get_mut());
            let average = match cost.frames {
                // The first frame makes buffers and fills caches, so the second replaces it.
                0 | 1 => latest,
                frames => average + (latest.min(average * OUTLIER_LIMIT) - average) / frames as f32,
            };
            cost.frames = (cost.frames + 1).min(AVERAGED_FRAMES);
            *cost.per_item.get_mut() = average.to_bits();
        }
    }

    /// Discards the samples of a frame that failed.
    pub(super) fn discard_frame(&mut self) {
        for cost in &mut self.estimates {
            *cost.time.get_mut() = 0;
            *cost.items.get_mut() = 0;
        }
    }

    /// The number of a node's `width` items that make a job on this number of workers.
    ///
    /// One job is best for little work, and for a single worker. Otherwise each worker gets several jobs, none shorter than
    /// [`MIN_JOB`]. Hysteresis around the latest choice keeps it from flapping.
    pub(super) fn items_per_job(&self, costs: NodeCosts, width: usize, workers: usize) -> usize {
        let NodeCosts { kind, node } = costs;
        let per_item = f32::from_bits(self.estimates[kind].per_item.load(Ordering::Relaxed));
        if workers == 1 {
            return usize::MAX;
        }
        if per_item == 0.0 {
            return FIRST_JOB_ITEMS;
        }
        let work = per_item * width as f32;
        let nanoseconds = |time: Duration| time.as_nanos() as f32;
        let chosen = self.chosen[node].load(Ordering::Relaxed);
        let is_cut = chosen != 0 && chosen != usize::MAX;
        let threshold = nanoseconds(PARALLEL_THRESHOLD) * if is_cut { 1.0 } else { HYSTERESIS };
        let best = if work < threshold {
            usize::MAX
        } else {
            let job = work / (JOBS_PER_WORKER * workers as f32);
            let items = job.clamp(nanoseconds(MIN_JOB), nanoseconds(MAX_JOB)) / per_item;
            if is_cut && items < chosen as f32 * HYSTERESIS && items * HYSTERESIS > chosen as f32 {
                return chosen;
            }
            whole_blocks(items as usize)
        };
        self.chosen[node].store(best, Ordering::Relaxed);
        best
    }
}

/// The job size in items before the first sample.
const FIRST_JOB_ITEMS: usize = 512;

/// Rounds down to whole blocks of objects and commands: jobs that share no block do not contend for its lock.
fn whole_blocks(items: usize) -> usize {
    if items < ObjectTable::BLOCK_SIZE { items.max(1) } else { items - items % ObjectTable::BLOCK_SIZE }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    const NODE: NodeCosts = NodeCosts { kind: 0, node: 0 };

    /// Runs a frame of one node whose items take `per_item` nanoseconds, and returns the job size.
    fn frame(model: &mut CostModel, width: usize, per_item: u64) -> usize {
        let items = model.items_per_job(NODE, width, 2);
        for start in (0..width).step_by(items.min(width)) {
            let length = items.min(width - start);
            model.add_sample(NODE, length, Duration::from_nanos(per_item * length as u64));
        }
        model.update();
        items
    }

    /// Runs `count` frames.
    fn frames(count: usize, model: &mut CostModel, width: usize, per_item: u64) {
        (0..count).for_each(|_| {
            frame(model, width, per_item);
        });
    }

    #[test]
    fn a_job_size_settles_within_thirty_frames_and_stays() {
        for (width, per_item) in [(10, 3), (1_000, 5), (40_000, 3), (1_000_000, 20), (64, 2_000), (7, 300_000)] {
            let mut model = CostModel::new(1, 1);
            // The first frame runs with cold caches.
            frame(&mut model, width, per_item * 20);
            frames(29, &mut model, width, per_item);
            let settled = frame(&mut model, width, per_item);
            let work = width as u64 * per_item;
            if work < PARALLEL_THRESHOLD.as_nanos() as u64 {
                assert_eq!(settled, usize::MAX, "{width} × {per_item}");
            } else {
                let job = settled as u64 * per_item;
                assert!(job < 2 * MAX_JOB.as_nanos() as u64 || settled == 1, "{width} × {per_item}: {settled}");
                assert!(settled <= width.div_ceil(4), "{width} × {per_item}: {settled}");
                assert!(2 * job > MIN_JOB.as_nanos() as u64, "{width} × {per_item}: {settled}");
            }
            // Ten percent more or less, or one disturbed frame, changes nothing.
            for wobble in 0..60 {
                let disturbed = if wobble == 30 { 50 } else { 1 };
                let per_item = (per_item * (1000 + wobble % 3 * 100 - 100) / 1000).max(1) * disturbed;
                assert_eq!(frame(&mut model, width, per_item), settled, "{width} × {per_item}");
            }
        }
    }

    #[test]
    fn the_job_size_follows_a_change_of_scene() {
        let mut model = CostModel::new(1, 1);
        frames(30, &mut model, 10_000, 4);
        let before = frame(&mut model, 10_000, 4);
        frames(30, &mut model, 10_000, 400);
        let after = frame(&mut model, 10_000, 400);
        assert!(after * 4 < before, "{after} {before}");
        // Too few items for a second job, then many again.
        frames(30, &mut model, 20, 400);
        assert_eq!(frame(&mut model, 20, 400), usize::MAX);
        assert!(frame(&mut model, 10_000, 400) < 1_000);
    }

    #[test]
    fn work_near_the_parallel_threshold_does_not_flap() {
        let mut model = CostModel::new(1, 1);
        let width_of = |nanoseconds: u128| (nanoseconds / 10) as usize;
        let threshold = PARALLEL_THRESHOLD.as_nanos();
        let chosen: Vec<_> =
            (0..60).map(|turn| frame(&mut model, width_of(threshold * (95 + turn % 2 * 25) / 100), 10)).collect();
        assert!(chosen[30..].iter().all(|&items| items == chosen[30]), "{chosen:?}");
    }

    #[test]
    fn one_worker_has_one_job() {
        let model = CostModel::new(1, 1);
        model.add_sample(NODE, 1_000_000, Duration::from_secs(1));
        assert_eq!(model.items_per_job(NODE, 1_000_000, 1), usize::MAX);
    }
}
