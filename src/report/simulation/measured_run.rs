//! A recorded run as the simulation needs it: how long its chunks took.

use std::iter;
use std::ops::Range;
use std::time::Duration;

use super::scheduler_costs::SchedulerCosts;
use crate::task::Chunks;
use crate::timeline::{Chunk, Run};

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
}

impl MeasuredRun {
    /// From a run that is complete.
    pub(super) fn new(run: &Run, costs: &SchedulerCosts) -> Self {
        let nodes = run.graph.nodes.iter().enumerate().map(|(index, node)| {
            let chunks = run.chunks_of(index);
            let size = chunks.iter().map(|chunk| chunk.items.len()).max().unwrap_or(0);
            let sums = chunks.iter().scan(0, |sum, chunk| {
                *sum += nanoseconds(Chunk::duration(chunk).saturating_sub(costs.recording));
                Some(*sum)
            });
            MeasuredNode {
                group: node.group().to_owned(),
                pinned: node.pinned,
                chunks: Chunks::new(run.width(index), size),
                sums: iter::once(0).chain(sums).collect(),
            }
        });
        let dependencies = run.graph.nodes.iter().map(|node| node.dependencies.clone());
        Self { dependencies: dependencies.collect(), nodes: nodes.collect(), always_parallel: run.always_parallel }
    }

    /// Removes all items from the nodes of a group.
    pub(super) fn remove_work_of(&mut self, group: &str) {
        for node in self.nodes.iter_mut().filter(|node| node.group == group) {
            (node.chunks, node.sums) = (Chunks::new(0, 1), vec![0]);
        }
    }

    /// How long all chunks took together, in nanoseconds.
    pub(super) fn work(&self) -> u64 {
        self.nodes.iter().map(|node| node.work(0..node.chunks.count())).sum()
    }

    /// How long the run takes on one thread, in nanoseconds.
    pub(super) fn serial_time(&self, costs: &SchedulerCosts) -> u64 {
        let chunks: u64 = self.nodes.iter().map(|node| node.chunks.count() as u64).sum();
        let nodes = self.nodes.len() as u64;
        self.work() + chunks * nanoseconds(costs.chunk) + nodes * nanoseconds(costs.node_serial)
    }
}

impl MeasuredNode {
    /// How long these chunks took together, in nanoseconds.
    pub(super) fn work(&self, chunks: Range<usize>) -> u64 {
        self.sums[chunks.end] - self.sums[chunks.start]
    }
}

/// Longer times are cut to this one, so that sums of costs do not overflow even if a cost is infinite, which is how a caller
/// says that no worker is ever to be woken.
const MAX_TIME: Duration = Duration::from_secs(3_600);

pub(super) fn nanoseconds(time: Duration) -> u64 {
    time.min(MAX_TIME).as_nanos() as u64
}
