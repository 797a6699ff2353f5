//! How finely a frame is divided into jobs: as the engine asks, or by measured cost.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use drawloom_jobs::internal::{Estimate, Filter, Stopwatch, job_size};

use super::culling::OcclusionControls;
use super::statistics::StageTimes;
use super::tables::FrameTables;
use crate::backend::{Backend, CallPanic, GuardedBackend};
use crate::command::DrawList;
use crate::graph::ModeChoice;
use crate::process::{FramePlan, Pass};
use crate::timeline::{FrameTuning, JobSize, Labels, Timeline, TuningAlternative, TuningChoice, TuningSubject};
use crate::view::RenderView;

/// How finely a frame is divided into jobs, from the first command of a pass to its last (M 10.5, "Better Load
/// Balancing"): the stages *fill*, *bin*, *sort*, *instance*, *triangles* and *record*. It decides which worker does
/// what, never the picture.
///
/// Before that there are no draws. Updating objects and uploading them, which all cameras share, and culling them for a
/// view are cut by measured cost in every mode; with [`PerCamera`](Self::PerCamera), culling is one job a view.
///
/// Frames of all but [`Adaptive`](Self::Adaptive) are executed in parallel even where one worker alone would be faster.
/// Two things are not divided: [static groups](crate::scene::StaticGroup) keep their bundles of
/// [`BATCHES_PER_BUNDLE`](DrawList::BATCHES_PER_BUNDLE) draws, and a backend whose recording strategy an engine has
/// fixed records by that strategy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Granularity {
    /// By measured cost: each stage of each process is divided into as many jobs as its work is worth. It adapts to a
    /// scene, or to a change of it, within 30 frames.
    #[default]
    Adaptive,
    /// One job for each stage of a camera's processes: M's first design.
    PerCamera,
    /// One job for each draw, which is recorded as a bundle of its own: M's "more advanced solution". To divide
    /// commands into parts of one, one job sorts them all.
    PerDraw,
    /// One job for this many draws. Not 0. A job that records divides them into bundles of equal size, at most
    /// [`BATCHES_PER_BUNDLE`](DrawList::BATCHES_PER_BUNDLE) draws each, and rounds up to whole bundles.
    Chunk(usize),
}

impl Granularity {
    /// The number of draws in a job; `None` where something else decides.
    pub(in crate::frame) fn draws_per_job(self) -> Option<usize> {
        match self {
            Self::Adaptive | Self::PerCamera => None,
            Self::PerDraw => Some(1),
            Self::Chunk(draws) => Some(draws),
        }
    }

    /// The number of items in a job that divides draws, where an item has up to `draws_per_item`; `None` where the
    /// cost model decides.
    pub(in crate::frame) fn items_per_job_by_draws(self, draws_per_item: usize) -> Option<usize> {
        match self {
            Self::Adaptive => None,
            Self::PerCamera => Some(usize::MAX),
            Self::PerDraw | Self::Chunk(_) => self.draws_per_job().map(|draws| draws.div_ceil(draws_per_item)),
        }
    }

    /// The number of batches in a bundle: a job records whole bundles.
    pub(in crate::frame) fn batches_per_bundle(self) -> usize {
        let max = DrawList::BATCHES_PER_BUNDLE;
        self.draws_per_job().map_or(max, |draws| draws.div_ceil(draws.div_ceil(max)))
    }
}

/// What the items of a frame's stages cost. The nodes of one cost kind share an estimate; each node has its own width,
/// and so a job size of its own. Nodes are counted in the order of the stage graph.
#[derive(Debug, Default)]
pub(in crate::frame) struct CostModel {
    /// By node, the index of its cost kind. Not in `sizes`, because jobs read this one while others write there.
    kinds: Vec<usize>,
    /// By cost kind.
    costs: Vec<ItemCost>,
    /// By node.
    sizes: Vec<NodeSize>,
}

/// The cost of one kind of item.
#[derive(Debug, Default)]
struct ItemCost {
    /// Nanoseconds per item.
    estimate: Estimate,
    /// The samples of the current frame: nanoseconds and items.
    time: AtomicU64,
    items: AtomicU64,
}

/// The job size of a node.
#[derive(Debug, Default)]
struct NodeSize {
    /// The job size in items that was chosen last by an estimate; 0 before the first choice.
    chosen: AtomicUsize,
    /// The number of the node's items in the current frame; 0 if it did not ask for a job size.
    width: AtomicUsize,
    /// The job size of the current frame.
    used: AtomicUsize,
}

const FILTER: Filter = Filter::limiting_outliers(6.0);

impl CostModel {
    /// An empty model. For each node the index of its cost kind.
    pub(in crate::frame) fn new(kinds: Vec<usize>) -> Self {
        let costs = kinds.iter().max().map_or(0, |last| last + 1);
        Self {
            costs: (0..costs).map(|_| ItemCost::default()).collect(),
            sizes: kinds.iter().map(|_| NodeSize::default()).collect(),
            kinds,
        }
    }

    /// Takes over estimates of another model. `same` are pairs of cost kinds that are the same, of this model and of
    /// the other.
    pub(in crate::frame) fn inherit_estimates(
        &mut self,
        before: &Self,
        same: impl IntoIterator<Item = (usize, usize)>,
    ) {
        for (kind, kind_before) in same {
            self.costs[kind].estimate = before.costs[kind_before].estimate;
        }
    }

    /// Adds a sample: the time of a job over `items` items of a node.
    pub(in crate::frame) fn add_sample(&self, node: usize, items: usize, took: Duration) {
        let cost = &self.costs[self.kinds[node]];
        // Relaxed, here and below: sums, read after the run.
        cost.time.fetch_add(took.as_nanos() as u64, Ordering::Relaxed);
        cost.items.fetch_add(items as u64, Ordering::Relaxed);
    }

    /// Updates the estimates with the samples of a frame.
    pub(in crate::frame) fn update(&mut self) {
        for cost in &mut self.costs {
            let (time, items) = (std::mem::take(cost.time.get_mut()), std::mem::take(cost.items.get_mut()));
            if items > 0 {
                cost.estimate.add((time as f32 / items as f32).max(f32::MIN_POSITIVE), FILTER);
            }
        }
    }

    /// Discards the samples and sizes of a frame that failed.
    pub(in crate::frame) fn discard_frame(&mut self) {
        for cost in &mut self.costs {
            *cost.time.get_mut() = 0;
            *cost.items.get_mut() = 0;
        }
        self.sizes.iter_mut().for_each(|size| *size.width.get_mut() = 0);
    }

    /// The number of a node's `width` items that make a job on this number of workers: see [`job_size`].
    pub(in crate::frame) fn items_per_job(&self, node: usize, width: usize, workers: usize) -> usize {
        let size = &self.sizes[node];
        let used = match self.costs[self.kinds[node]].estimate.get() {
            None if workers == 1 => usize::MAX,
            None => FIRST_JOB_ITEMS,
            Some(per_item) => {
                let before = size.chosen.load(Ordering::Relaxed);
                let previous = Some(before).filter(|&items| items != 0 && items != usize::MAX);
                let best = job_size(per_item, width, workers, previous);
                if best != before {
                    size.chosen.store(best, Ordering::Relaxed);
                }
                best
            }
        };
        self.report_size(node, width, used);
        used
    }

    /// Reports the job size that a node uses in this frame.
    pub(in crate::frame) fn report_size(&self, node: usize, width: usize, items_per_job: usize) {
        self.sizes[node].width.store(width, Ordering::Relaxed);
        self.sizes[node].used.store(items_per_job, Ordering::Relaxed);
    }

    /// Takes out the job sizes of the latest frame, with the estimates before its [`update`](Self::update). Nodes that
    /// did not ask for one are left out. `labels` are those of the nodes.
    pub(in crate::frame) fn take_sizes(&mut self, labels: &[Arc<Labels>]) -> impl Iterator<Item = JobSize> {
        let nodes = self.sizes.iter_mut().zip(&self.kinds).zip(labels);
        nodes.filter_map(|((size, &kind), labels)| {
            let items = std::mem::take(size.width.get_mut());
            (items > 0).then(|| JobSize {
                labels: Arc::clone(labels),
                items,
                items_per_job: (*size.used.get_mut()).min(items),
                nanoseconds_per_item: self.costs[kind].estimate.get(),
            })
        })
    }
}

/// The job size in items before the first sample.
const FIRST_JOB_ITEMS: usize = 512;

/// What is tuned by measurement in the frames of one stage graph, beside the run mode, which its schedule tunes.
pub(in crate::frame) struct StageTuning {
    pub(in crate::frame) costs: CostModel,
    pub(in crate::frame) occlusion: OcclusionControls,
    labels: TuningLabels,
}

/// What the parts of a frame are called in [`FrameTuning`].
pub(in crate::frame) struct TuningLabels {
    /// By node of the cost model.
    nodes: Vec<Arc<Labels>>,
    passes: Vec<Arc<Labels>>,
    views: Vec<Arc<Labels>>,
}

impl TuningLabels {
    /// The labels of a graph. Those of nodes are in the order of the cost model.
    pub(in crate::frame) fn new(
        nodes: Vec<Arc<Labels>>,
        plan: &FramePlan,
        passes: &[Pass],
        views: &[RenderView],
    ) -> Self {
        let labels = |process: Option<&str>, view: &RenderView| {
            let (process, view) = (process.map(Arc::from), Some(Arc::from(view.name())));
            Arc::new(Labels { process, stage: None, view })
        };
        let name = |pass: &Pass| plan.processes()[pass.process_index].name.as_str();
        Self {
            nodes,
            passes: passes.iter().map(|pass| labels(Some(name(pass)), &views[pass.view_index])).collect(),
            views: views.iter().map(|view| labels(None, view)).collect(),
        }
    }
}

impl StageTuning {
    /// The tuning of nodes whose cost kinds have these indices, and of views with these occlusion tests.
    pub(in crate::frame) fn new(kind_of_node: Vec<usize>, occlusion: OcclusionControls, labels: TuningLabels) -> Self {
        Self { costs: CostModel::new(kind_of_node), occlusion, labels }
    }

    /// What was chosen for the frame that has run. Chooses for the next frame by what was measured.
    ///
    /// # Errors
    /// If the backend panics.
    pub(in crate::frame) fn update<B: Backend>(
        &mut self,
        run_mode: Option<ModeChoice>,
        tables: &FrameTables,
        backend: &GuardedBackend<B>,
        frame: &B::Frame,
    ) -> Result<FrameTuning, CallPanic> {
        let occlusion = self.occlusion.choices(tables, &self.labels.views);
        let mut recording = Vec::new();
        for (pass, labels) in self.labels.passes.iter().enumerate() {
            recording.extend(backend.recording_choice(frame, pass, labels)?);
        }
        let choices = run_mode.map(run_mode_choice).into_iter().chain(occlusion).chain(recording).collect();
        let job_sizes = self.costs.take_sizes(&self.labels.nodes).collect();
        self.occlusion.update(tables);
        self.costs.update();
        Ok(FrameTuning { choices, job_sizes })
    }
}

fn run_mode_choice(choice: ModeChoice) -> TuningChoice {
    let ModeChoice { parallel, is_trial, serial_nanoseconds, parallel_nanoseconds } = choice;
    let alternatives = vec![
        TuningAlternative { name: "serial".into(), nanoseconds: serial_nanoseconds },
        TuningAlternative { name: "parallel".into(), nanoseconds: Some(parallel_nanoseconds) },
    ];
    let (subject, chosen) = (TuningSubject::RunMode, usize::from(parallel));
    TuningChoice { subject, labels: Arc::default(), alternatives, chosen, is_trial }
}

/// A group of stages in [`StageTimes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::frame) enum StageGroup {
    Visibility,
    Fill,
    Sort,
    Instance,
    Record,
    Nodes,
}

/// Sums up thread time by group while jobs run.
pub(in crate::frame) struct StageClock<'a> {
    nanoseconds: [AtomicU64; 6],
    timeline: &'a Timeline,
}

impl<'a> StageClock<'a> {
    /// A clock that measures as this timeline does.
    pub(in crate::frame) fn new(timeline: &'a Timeline) -> Self {
        Self { nanoseconds: Default::default(), timeline }
    }

    /// A stopwatch that starts now.
    pub(in crate::frame) fn stopwatch(&self) -> Stopwatch<'a> {
        self.timeline.stopwatch()
    }

    /// Runs `work`, adds its time to `group`, and returns its result and its time.
    pub(in crate::frame) fn measure<R>(&self, group: StageGroup, work: impl FnOnce() -> R) -> (R, Duration) {
        let start = self.stopwatch();
        let result = work();
        let took = start.elapsed();
        // Relaxed: a sum, read after the run.
        self.nanoseconds[group as usize].fetch_add(took.as_nanos() as u64, Ordering::Relaxed);
        (result, took)
    }

    pub(in crate::frame) fn times(&self) -> StageTimes {
        let of = |group: StageGroup| Duration::from_nanos(self.nanoseconds[group as usize].load(Ordering::Relaxed));
        StageTimes {
            visibility: of(StageGroup::Visibility),
            fill: of(StageGroup::Fill),
            sort: of(StageGroup::Sort),
            instance: of(StageGroup::Instance),
            record: of(StageGroup::Record),
            nodes: of(StageGroup::Nodes),
            submit: Duration::ZERO,
        }
    }
}

#[cfg(test)]
mod tests {
    use drawloom_jobs::internal::{MAX_JOB, MIN_JOB, PARALLEL_THRESHOLD};
    use drawloom_signal::{ControllerBounds, check_controller};

    use super::*;

    #[test]
    fn a_job_records_whole_bundles() {
        for draws in (1..2_000).chain([usize::MAX - 1, usize::MAX]) {
            let granularity = Granularity::Chunk(draws);
            let (bundle, bundles) = (
                granularity.batches_per_bundle() as u128,
                granularity.items_per_job_by_draws(DrawList::BATCHES_PER_BUNDLE).unwrap() as u128,
            );
            assert!((1..=DrawList::BATCHES_PER_BUNDLE as u128).contains(&bundle));
            // Rounded up to bundles of equal size.
            assert!(
                (draws as u128..draws as u128 + bundles).contains(&(bundle * bundles)),
                "{draws}: {bundles} × {bundle}"
            );
        }
        assert_eq!(Granularity::PerDraw.batches_per_bundle(), 1);
        assert_eq!(Granularity::PerCamera.batches_per_bundle(), DrawList::BATCHES_PER_BUNDLE);
    }

    const NODE: usize = 0;

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
            let mut model = CostModel::new(vec![0]);
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
    fn it_settles_does_not_flap_and_recovers() {
        let bounds = ControllerBounds { settles_within: [30; 3], max_wrong: 0, max_changes: 2 };
        let nanoseconds = |is_after| if is_after { 400.0 } else { 20.0 };
        check_controller(
            &bounds,
            || CostModel::new(vec![0]),
            |model, is_after, signal| frame(model, 10_000, signal.sample(nanoseconds(is_after)) as u64),
            |&items, is_after| {
                let job = nanoseconds(is_after) * items as f32;
                items <= 10_000 / 4 && (3_000.0..120_000.0).contains(&job)
            },
        );
    }

    #[test]
    fn the_job_size_follows_a_change_of_scene() {
        let mut model = CostModel::new(vec![0]);
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
        let mut model = CostModel::new(vec![0]);
        let width_of = |nanoseconds: u128| (nanoseconds / 10) as usize;
        let threshold = PARALLEL_THRESHOLD.as_nanos();
        let chosen: Vec<_> =
            (0..60).map(|turn| frame(&mut model, width_of(threshold * (95 + turn % 2 * 25) / 100), 10)).collect();
        assert!(chosen[30..].iter().all(|&items| items == chosen[30]), "{chosen:?}");
    }

    #[test]
    fn a_node_that_did_not_ask_has_no_size() {
        let (mut model, labels) = (CostModel::new(vec![0, 0]), [Arc::default(), Arc::default()]);
        let sizes = |model: &mut CostModel| {
            let sizes =
                model.take_sizes(&labels).map(|size| (size.items, size.items_per_job, size.nanoseconds_per_item));
            sizes.collect::<Vec<_>>()
        };
        model.items_per_job(NODE, 1000, 2);
        model.add_sample(NODE, 1000, Duration::from_micros(3));
        assert_eq!(sizes(&mut model), [(1000, FIRST_JOB_ITEMS, None)]);
        model.update();
        assert_eq!(sizes(&mut model), []);
        model.items_per_job(NODE, 700, 2);
        assert_eq!(sizes(&mut model), [(700, 700, Some(3.0))]);
        model.items_per_job(NODE, 500, 2);
        model.discard_frame();
        assert_eq!(sizes(&mut model), []);
    }

    #[test]
    fn one_worker_has_one_job() {
        let mut model = CostModel::new(vec![0]);
        for _frame in 0..3 {
            assert_eq!(model.items_per_job(NODE, 1_000_000, 1), usize::MAX);
            model.add_sample(NODE, 1_000_000, Duration::from_secs(1));
            model.update();
        }
    }
}
