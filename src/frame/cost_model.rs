//! What a frame's jobs cost, learnt from frame to frame, and how large that makes them.

use std::sync::atomic::{AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use crate::view::ObjectTable;

/// What the jobs of a frame cost. All nodes that do the same for one process share what is known of an item of theirs;
/// each node has its own number of items, and so a job size of its own.
#[derive(Debug, Default)]
pub(super) struct CostModel {
    costs: Vec<Cost>,
    /// For each node, the items in a job that were last chosen; 0 before the first time.
    chosen: Vec<AtomicUsize>,
}

/// What an item costs.
#[derive(Debug, Default)]
struct Cost {
    /// Nanoseconds, as an f32's bits: an average over the latest frames, the latest counting most. 0 before the first.
    per_item: AtomicU32,
    /// How many frames the average is of, up to as many as matter.
    frames: u32,
    /// Of the frame on its way: nanoseconds and items.
    time: AtomicU64,
    items: AtomicU64,
}

/// Frames that count for the average, about.
const MEMORY: u32 = 6;

/// How many times the average a frame may count at most: once in a while the system takes the processor away, which says
/// nothing of the next frame.
const OUTLIER: f32 = 2.0;

/// Work that is worth a second job: it is to outweigh what it costs a worker to come for it, and to fetch what the job reads
/// from another's memory.
const WORTH_SHARING: Duration = Duration::from_micros(12);

/// Jobs for each worker that takes part, so that the last of them to end is not awaited for long.
const JOBS_PER_WORKER: f32 = 4.0;

/// The shortest and the longest job that work is cut into: as short that its own price is some percent, and as long
/// that who waits for one that is urgent does not wait for long.
const SHORTEST: Duration = Duration::from_micros(6);
const LONGEST: Duration = Duration::from_micros(60);

/// How far from the best a job size may be before it is changed: as a factor.
const RELUCTANCE: f32 = 1.6;

impl CostModel {
    /// Of as many kinds of items and as many nodes, of which nothing is known.
    pub(super) fn new(kinds: usize, nodes: usize) -> Self {
        let mut model = Self::default();
        model.costs.resize_with(kinds, Cost::default);
        model.chosen.resize_with(nodes, AtomicUsize::default);
        model
    }

    /// Takes note of a job: so many items of a kind took that long.
    pub(super) fn note(&self, kind: usize, items: usize, took: Duration) {
        let cost = &self.costs[kind];
        // Relaxed, here and below: they are sums, which are read when all jobs have ended.
        cost.time.fetch_add(took.as_nanos() as u64, Ordering::Relaxed);
        cost.items.fetch_add(items as u64, Ordering::Relaxed);
    }

    /// Takes in what the frame that has ended cost.
    pub(super) fn learn(&mut self) {
        for cost in &mut self.costs {
            let (time, items) = (std::mem::take(cost.time.get_mut()), std::mem::take(cost.items.get_mut()));
            if items == 0 {
                continue;
            }
            let latest = (time as f32 / items as f32).max(f32::MIN_POSITIVE);
            let average = f32::from_bits(*cost.per_item.get_mut());
            let average = match cost.frames {
                // The first frame sets up what the others find, so the second replaces it.
                0 | 1 => latest,
                frames => average + (latest.min(average * OUTLIER) - average) / frames as f32,
            };
            cost.frames = (cost.frames + 1).min(MEMORY);
            *cost.per_item.get_mut() = average.to_bits();
        }
    }

    /// Forgets what a frame that failed has cost so far.
    pub(super) fn forget_frame(&mut self) {
        for cost in &mut self.costs {
            *cost.time.get_mut() = 0;
            *cost.items.get_mut() = 0;
        }
    }

    /// How many of a node's `width` items, each of a kind, should make a job where there are so many workers.
    ///
    /// One job is best for little work, and for a single worker. All else is cut so that every worker has several jobs,
    /// none of them shorter than its own price allows. Around what was chosen last there is room before it is changed, so that
    /// it does not change back and forth.
    pub(super) fn items(&self, kind: usize, node: usize, width: usize, workers: usize) -> usize {
        let per_item = f32::from_bits(self.costs[kind].per_item.load(Ordering::Relaxed));
        if workers == 1 {
            return usize::MAX;
        }
        if per_item == 0.0 {
            return FIRST;
        }
        let work = per_item * width as f32;
        let nanoseconds = |time: Duration| time.as_nanos() as f32;
        let chosen = self.chosen[node].load(Ordering::Relaxed);
        let is_cut = chosen != 0 && chosen != usize::MAX;
        let worth = nanoseconds(WORTH_SHARING) * if is_cut { 1.0 } else { RELUCTANCE };
        let best = if work < worth {
            usize::MAX
        } else {
            let job = work / (JOBS_PER_WORKER * workers as f32);
            let items = job.clamp(nanoseconds(SHORTEST), nanoseconds(LONGEST)) / per_item;
            if is_cut && items < chosen as f32 * RELUCTANCE && items * RELUCTANCE > chosen as f32 {
                return chosen;
            }
            whole_blocks(items as usize)
        };
        self.chosen[node].store(best, Ordering::Relaxed);
        best
    }
}

/// Items in a job before anything is known of them.
const FIRST: usize = 512;

/// Objects and commands lie in blocks, and jobs that share none do not wait for each other.
fn whole_blocks(items: usize) -> usize {
    if items < ObjectTable::BLOCK_SIZE { items.max(1) } else { items - items % ObjectTable::BLOCK_SIZE }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    /// A frame of one node, whose items take that many nanoseconds; says how many of them make a job.
    fn frame(model: &mut CostModel, width: usize, per_item: u64) -> usize {
        let items = model.items(0, 0, width, 2);
        for start in (0..width).step_by(items.min(width)) {
            let length = items.min(width - start);
            model.note(0, length, Duration::from_nanos(per_item * length as u64));
        }
        model.learn();
        items
    }

    /// The same so many times.
    fn frames(count: usize, model: &mut CostModel, width: usize, per_item: u64) {
        (0..count).for_each(|_| {
            frame(model, width, per_item);
        });
    }

    #[test]
    fn a_job_size_is_found_within_thirty_frames_and_stays() {
        for (width, per_item) in [(10, 3), (1_000, 5), (40_000, 3), (1_000_000, 20), (64, 2_000), (7, 300_000)] {
            let mut model = CostModel::new(1, 1);
            // Nothing is in memory yet.
            frame(&mut model, width, per_item * 20);
            frames(29, &mut model, width, per_item);
            let settled = frame(&mut model, width, per_item);
            let work = width as u64 * per_item;
            if work < WORTH_SHARING.as_nanos() as u64 {
                assert_eq!(settled, usize::MAX, "{width} × {per_item}");
            } else {
                let job = settled as u64 * per_item;
                assert!(job < 2 * LONGEST.as_nanos() as u64 || settled == 1, "{width} × {per_item}: {settled}");
                assert!(settled <= width.div_ceil(4), "{width} × {per_item}: {settled}");
                assert!(2 * job > SHORTEST.as_nanos() as u64, "{width} × {per_item}: {settled}");
            }
            // A tenth more or less, or a frame that was disturbed, changes nothing.
            for wobble in 0..60 {
                let disturbed = if wobble == 30 { 50 } else { 1 };
                let per_item = (per_item * (1000 + wobble % 3 * 100 - 100) / 1000).max(1) * disturbed;
                assert_eq!(frame(&mut model, width, per_item), settled, "{width} × {per_item}");
            }
        }
    }

    #[test]
    fn a_scene_that_changes_is_learnt_again() {
        let mut model = CostModel::new(1, 1);
        frames(30, &mut model, 10_000, 4);
        let before = frame(&mut model, 10_000, 4);
        frames(30, &mut model, 10_000, 400);
        let after = frame(&mut model, 10_000, 400);
        assert!(after * 4 < before, "{after} {before}");
        // So few that they are one job, and many again.
        frames(30, &mut model, 20, 400);
        assert_eq!(frame(&mut model, 20, 400), usize::MAX);
        assert!(frame(&mut model, 10_000, 400) < 1_000);
    }

    #[test]
    fn work_around_what_is_worth_sharing_does_not_go_back_and_forth() {
        let mut model = CostModel::new(1, 1);
        let width_of = |nanoseconds: u128| (nanoseconds / 10) as usize;
        let worth = WORTH_SHARING.as_nanos();
        let chosen: Vec<_> =
            (0..60).map(|turn| frame(&mut model, width_of(worth * (95 + turn % 2 * 25) / 100), 10)).collect();
        assert!(chosen[30..].iter().all(|&items| items == chosen[30]), "{chosen:?}");
    }

    #[test]
    fn one_worker_has_one_job() {
        let model = CostModel::new(1, 1);
        model.note(0, 1_000_000, Duration::from_secs(1));
        assert_eq!(model.items(0, 0, 1_000_000, 1), usize::MAX);
    }
}
