//! A recorded run as the simulation needs it: how long its chunks took, or would take if it were cut for other workers.

use std::collections::HashMap;
use std::iter;
use std::ops::Range;
use std::time::Duration;

use super::scheduler_costs::SchedulerCosts;
use crate::task::Chunks;
use crate::timeline::{Chunk, NodeInfo, Run};
use crate::tuning::job_size;

/// The nodes of a run, and how long their chunks took.
#[derive(Clone, Debug)]
pub(super) struct MeasuredRun {
    pub(super) dependencies: Vec<Vec<usize>>,
    pub(super) nodes: Vec<MeasuredNode>,
    /// Whether it runs in parallel however little work it is.
    pub(super) always_parallel: bool,
}

/// A node, and how long its chunks took.
#[derive(Clone, Debug)]
pub(super) struct MeasuredNode {
    group: String,
    pub(super) pinned: bool,
    pub(super) chunks: Chunks,
    /// Prefix sums: how long the first chunks took together, in nanoseconds, for each number of them.
    sums: Vec<u64>,
    /// What the chunk size follows from; `None` if it is fixed.
    by_cost: Option<ChunkedByCost>,
}

/// What the chunk size of a node follows from, beside the number of workers.
#[derive(Clone, Copy, Debug)]
struct ChunkedByCost {
    width: usize,
    nanoseconds_per_item: f32,
}

impl MeasuredRun {
    /// From a run that is complete.
    pub(super) fn new(run: &Run, costs: &SchedulerCosts) -> Self {
        let measured = |chunk: &Chunk| nanoseconds(chunk.duration().saturating_sub(costs.recording));
        let item_costs = item_costs(run, measured);
        let nodes = run.graph.nodes.iter().enumerate().map(|(index, node)| {
            let chunks = run.chunks_of(index);
            let width = run.width(index);
            let size = chunks.iter().map(|chunk| chunk.items.len()).max().unwrap_or(0);
            let sums = chunks.iter().scan(0, |sum, chunk| {
                *sum += measured(chunk);
                Some(*sum)
            });
            let by_cost = |&nanoseconds_per_item| ChunkedByCost { width, nanoseconds_per_item };
            MeasuredNode {
                group: node.group().to_owned(),
                pinned: node.pinned,
                chunks: Chunks::new(width, size),
                sums: iter::once(0).chain(sums).collect(),
                by_cost: item_costs.get(&cost_kind(node)).filter(|_| node.chunked_by_cost).map(by_cost),
            }
        });
        let dependencies = run.graph.nodes.iter().map(|node| node.dependencies.clone());
        Self { dependencies: dependencies.collect(), nodes: nodes.collect(), always_parallel: run.always_parallel }
    }

    /// The run as this number of workers would have it: nodes that are chunked by cost have the chunks that are chosen
    /// there. The time of a recorded chunk is spread evenly over its items, and the time of each node stays the same.
    pub(super) fn cut_for(&self, workers: usize) -> Self {
        let nodes = self.nodes.iter().map(|node| node.cut_for(workers)).collect();
        Self { dependencies: self.dependencies.clone(), nodes, always_parallel: self.always_parallel }
    }

    /// Removes all items from the nodes of a group.
    pub(super) fn remove_work_of(&mut self, group: &str) {
        for node in self.nodes.iter_mut().filter(|node| node.group == group) {
            (node.chunks, node.sums, node.by_cost) = (Chunks::new(0, 1), vec![0], None);
        }
    }

    /// How long all chunks took together, in nanoseconds.
    pub(super) fn work(&self) -> u64 {
        self.nodes.iter().map(|node| node.work(0..node.chunks.count())).sum()
    }

    /// The number of chunks of all nodes.
    pub(super) fn chunk_count(&self) -> usize {
        self.nodes.iter().map(|node| node.chunks.count()).sum()
    }

    /// How long the run takes on one thread, in nanoseconds.
    pub(super) fn serial_time(&self, costs: &SchedulerCosts) -> u64 {
        let (chunks, nodes) = (self.chunk_count() as u64, self.nodes.len() as u64);
        self.work() + chunks * nanoseconds(costs.chunk) + nodes * nanoseconds(costs.node_serial)
    }
}

impl MeasuredNode {
    /// How long these chunks took together, in nanoseconds.
    pub(super) fn work(&self, chunks: Range<usize>) -> u64 {
        self.sums[chunks.end] - self.sums[chunks.start]
    }

    /// The node with the chunks that this number of workers would have.
    fn cut_for(&self, workers: usize) -> Self {
        let Some(ChunkedByCost { width, nanoseconds_per_item }) = self.by_cost else { return self.clone() };
        let previous = (self.chunks.count() > 1).then(|| self.chunks.range(0).len());
        let size = job_size(nanoseconds_per_item, width, workers, previous).max(width.div_ceil(MAX_CHUNKS));
        let chunks = Chunks::new(width, size);
        let ends = (0..chunks.count()).map(|chunk| chunks.range(chunk).end);
        let sums = iter::once(0).chain(ends.map(|end| self.work_of_first(end))).collect();
        Self { group: self.group.clone(), chunks, sums, ..*self }
    }

    /// How long the first items took together, in nanoseconds.
    fn work_of_first(&self, items: usize) -> u64 {
        let size = self.chunks.range(0).len();
        let (whole, rest) = (items / size, items % size);
        if rest == 0 {
            return self.sums[whole];
        }
        let (work, length) = (self.work(whole..whole + 1), self.chunks.range(whole).len());
        self.sums[whole] + (u128::from(work) * rest as u128 / length as u128) as u64
    }
}

/// No node is cut into more chunks: four seconds of work in the longest jobs. Without a bound, a log of a frame that
/// took hours would be replayed for as long.
const MAX_CHUNKS: usize = 1 << 16;

/// Nodes of one kind have items of the same cost: see [`Node::chunked_by_cost`](crate::graph::Node::chunked_by_cost).
type CostKind<'run> = [Option<&'run str>; 2];

fn cost_kind(node: &NodeInfo) -> CostKind<'_> {
    [node.labels.process.as_deref(), node.labels.stage.as_deref()]
}

/// What an item costs in nanoseconds, by kind of the nodes that are chunked by cost, if `measured` says how long a
/// chunk took.
fn item_costs(run: &Run, measured: impl Fn(&Chunk) -> u64) -> HashMap<CostKind<'_>, f32> {
    let mut sums = HashMap::<_, [u64; 2]>::new();
    for chunk in &run.chunks {
        let node = &run.graph.nodes[chunk.node];
        if node.chunked_by_cost {
            let [time, items] = sums.entry(cost_kind(node)).or_default();
            *time += measured(chunk);
            *items += chunk.items.len() as u64;
        }
    }
    let cost = |[time, items]: [u64; 2]| (time as f32 / items.max(1) as f32).max(f32::MIN_POSITIVE);
    sums.into_iter().map(|(kind, sums)| (kind, cost(sums))).collect()
}

/// Longer times are cut to this one, so that sums of costs do not overflow even if a cost is infinite, which is how a
/// caller says that no worker is ever to be woken.
const MAX_TIME: Duration = Duration::from_secs(3_600);

pub(super) fn nanoseconds(time: Duration) -> u64 {
    time.min(MAX_TIME).as_nanos() as u64
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use std::sync::Arc;

    use proptest::prelude::*;

    use super::super::test_run::{TestNode, TestRun, any_test_run};
    use super::*;

    const COSTS: SchedulerCosts = SchedulerCosts::ZERO;

    fn measured(test_run: &TestRun) -> MeasuredRun {
        MeasuredRun::new(&test_run.run(&COSTS), &COSTS)
    }

    fn counts(run: &MeasuredRun) -> Vec<usize> {
        run.nodes.iter().map(|node| node.chunks.count()).collect()
    }

    /// How long each chunk of a node takes, in nanoseconds.
    fn works(node: &MeasuredNode) -> Vec<u64> {
        (0..node.chunks.count()).map(|chunk| node.work(chunk..chunk + 1)).collect()
    }

    fn items(node: &MeasuredNode) -> usize {
        (0..node.chunks.count()).map(|chunk| node.chunks.range(chunk).len()).sum()
    }

    #[test]
    fn nodes_are_cut_by_cost_and_workers_unless_their_chunks_are_fixed() {
        let run = measured(&TestRun::new().add_by_cost("fill", 1_000, &[1_000]).add(&[], &[1_000]));
        let cuts = [1, 2, 4, 8, 16, 32, 64].map(|workers| counts(&run.cut_for(workers)));
        assert_eq!(cuts, [[1, 1], [17, 1], [17, 1], [33, 1], [67, 1], [143, 1], [167, 1]]);
        let on_sixteen = works(&run.cut_for(16).nodes[0]);
        assert!(on_sixteen[..66].iter().all(|&work| work == 15_000) && on_sixteen[66] == 10_000, "{on_sixteen:?}");
    }

    #[test]
    fn a_node_that_took_hours_is_cut_into_a_bounded_number_of_chunks() {
        let mut run = TestRun::new().add_by_cost("fill", 100, &[400]).run(&COSTS);
        for items in [1 << 22, 1 << 40, usize::MAX] {
            run.chunks[0].items = 0..items;
            run.chunks[0].ended = run.chunks[0].started + Duration::from_secs(7_200);
            let cut = MeasuredRun::new(&run, &COSTS).cut_for(64);
            assert!((MAX_CHUNKS / 2..=MAX_CHUNKS).contains(&cut.nodes[0].chunks.count()), "{items} items");
            assert_eq!(cut.work(), 3_600_000_000_000, "{items} items");
        }
    }

    #[test]
    fn the_time_of_a_recorded_chunk_is_spread_over_its_items() {
        // 200 items of 0.5 µs, then 200 of 1.5. The chunk from item 198 to 230 has both.
        let run = measured(&TestRun::new().add_by_cost("fill", 200, &[100, 300]));
        assert_eq!(works(&run.cut_for(1).nodes[0]), [400_000]);
        let two = [[25_000; 4], [75_000; 4]].concat();
        assert_eq!(works(&run.cut_for(2).nodes[0]), two);
        let three = [vec![16_500; 6], vec![47_500], vec![49_500; 5], vec![6_000]].concat();
        assert_eq!(works(&run.cut_for(3).nodes[0]), three);
    }

    #[test]
    fn a_node_with_fixed_chunks_keeps_them_beside_others_of_its_kind() {
        let mut run = TestRun::new().add_by_cost("fill", 100, &[400]).add_by_cost("fill", 100, &[400]).run(&COSTS);
        Arc::make_mut(&mut run.graph).nodes[0].chunked_by_cost = false;
        assert_eq!(counts(&MeasuredRun::new(&run, &COSTS).cut_for(2)), [1, 9]);
    }

    #[test]
    fn a_recorded_cut_is_kept_while_it_is_nearly_right() {
        // On two workers 50, 48 and 48.75 µs are best: 1.25, 1.5 and 1.63 times the recorded chunks. 1.6 times is
        // wrong.
        let cut =
            |size, time, count| measured(&TestRun::new().add_by_cost("fill", size, &vec![time; count])).cut_for(2);
        let sizes = [cut(40, 40, 10), cut(32, 32, 12), cut(30, 30, 13)].map(|run| run.nodes[0].chunks.range(0).len());
        assert_eq!(sizes, [40, 32, 48]);
    }

    #[test]
    fn nodes_of_one_kind_share_the_cost_of_an_item() {
        let of_kinds = |one, other| {
            let test_run = TestRun::new().add_by_cost(one, 100, &[40]).add_by_cost(other, 100, &[960]);
            counts(&measured(&test_run).cut_for(2))
        };
        // 12 items of 5 µs; 15 of 0.4, and 6 of 9.6.
        assert_eq!(of_kinds("fill", "fill"), [9, 9]);
        assert_eq!(of_kinds("fill", "sort"), [7, 17]);
    }

    /// A node as a frame on this many workers cuts it, by the cost of an item in microseconds.
    fn cut_node(width: usize, per_item: u64, workers: usize) -> TestNode {
        let size = job_size(per_item as f32 * 1e3, width, workers, None).min(width);
        let chunks = Chunks::new(width, size);
        TestNode {
            chunks: (0..chunks.count()).map(|chunk| chunks.range(chunk).len() as u64 * per_item).collect(),
            items_per_chunk: size,
            missing_items: chunks.count() * size - width,
            cost_kind: Some("fill".to_owned()),
            ..TestNode::default()
        }
    }

    proptest! {
        #[test]
        fn the_time_of_each_node_is_kept_and_more_workers_never_have_fewer_chunks(test_run in any_test_run(true)) {
            let run = measured(&test_run);
            let mut fewer = counts(&run.cut_for(1));
            for workers in 1..=64 {
                let cut = run.cut_for(workers);
                for ((node, cut), test_node) in run.nodes.iter().zip(&cut.nodes).zip(&test_run.nodes) {
                    let work = works(node).iter().sum::<u64>();
                    prop_assert_eq!(works(cut).iter().sum::<u64>(), work);
                    prop_assert_eq!(work, 1_000 * test_node.chunks.iter().sum::<u64>());
                    prop_assert_eq!(items(cut), items(node));
                    prop_assert!(test_node.cost_kind.is_some() || works(cut) == works(node));
                }
                let more = counts(&cut);
                prop_assert!(fewer.iter().zip(&more).all(|(fewer, more)| fewer <= more), "{:?} {:?}", fewer, more);
                fewer = more;
            }
        }

        #[test]
        fn the_workers_that_cut_a_frame_cut_it_the_same_again(
            width in 1..5_000_usize,
            per_item in 1..40_u64,
            [recorded, others] in [1..=64_usize, 1..=64],
        ) {
            let node = cut_node(width, per_item, recorded);
            let run = measured(&TestRun { nodes: vec![node] });
            let again = run.cut_for(recorded);
            prop_assert_eq!(works(&again.nodes[0]), works(&run.nodes[0]));
            // Others cut it as their own frames, or keep its chunks if these are wrong by less than the hysteresis.
            // Their own are rounded down to whole items.
            let size = |run: &MeasuredRun| run.nodes[0].chunks.range(0).len() as f32;
            let own = size(&measured(&TestRun { nodes: vec![cut_node(width, per_item, others)] }));
            let (cut, recorded) = (size(&run.cut_for(others)), size(&run));
            prop_assert!(cut == own || cut == recorded && own < 1.6 * recorded && recorded < 1.6 * (own + 1.0));
        }
    }
}
