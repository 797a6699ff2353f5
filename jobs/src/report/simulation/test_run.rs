//! Runs made by hand, for tests of the simulation.

use std::sync::Arc;
use std::time::Duration;

use proptest::collection::vec;
use proptest::prelude::*;

use super::SchedulerCosts;
use crate::chunked_array::BLOCK_SIZE;
use crate::timeline::{Chunk, Graph, Labels, NodeInfo, Run};

/// A graph with the costs of its chunks.
#[derive(Clone, Debug, Default)]
pub(super) struct TestRun {
    pub(super) nodes: Vec<TestNode>,
}

#[derive(Clone, Debug)]
pub(super) struct TestNode {
    pub(super) dependencies: Vec<usize>,
    pub(super) pinned: bool,
    /// How long each chunk takes, in microseconds.
    pub(super) chunks: Vec<u64>,
    /// The number of items in a chunk. The last one may have fewer.
    pub(super) items_per_chunk: usize,
    /// The number of items that the last chunk lacks.
    pub(super) missing_items: usize,
    /// For a node that is chunked by cost: the name that the nodes of one cost kind share.
    pub(super) cost_kind: Option<String>,
}

impl Default for TestNode {
    fn default() -> Self {
        let (dependencies, chunks) = (Vec::new(), Vec::new());
        Self { dependencies, pinned: false, chunks, items_per_chunk: 3, missing_items: 0, cost_kind: None }
    }
}

impl TestRun {
    pub(super) fn new() -> Self {
        Self::default()
    }

    pub(super) fn add(mut self, dependencies: &[usize], chunks: &[u64]) -> Self {
        let (dependencies, chunks) = (dependencies.to_vec(), chunks.to_vec());
        self.nodes.push(TestNode { dependencies, chunks, ..TestNode::default() });
        self
    }

    /// Adds a node of this cost kind that waits for none.
    pub(super) fn add_by_cost(self, cost_kind: &str, items_per_chunk: usize, chunks: &[u64]) -> Self {
        let mut test_run = self.add(&[], chunks);
        let node = test_run.nodes.last_mut().expect("a node was added");
        (node.items_per_chunk, node.cost_kind) = (items_per_chunk, Some(cost_kind.to_owned()));
        test_run
    }

    pub(super) fn add_pinned(self, dependencies: &[usize], chunks: &[u64]) -> Self {
        let mut test_run = self.add(dependencies, chunks);
        test_run.nodes.last_mut().expect("a node was added").pinned = true;
        test_run
    }

    /// The record of a run on one thread, with these recording costs.
    pub(super) fn run(&self, costs: &SchedulerCosts) -> Run {
        let mut now = Duration::ZERO;
        let (mut nodes, mut chunks) = (Vec::new(), Vec::new());
        for (index, node) in self.nodes.iter().enumerate() {
            nodes.push(NodeInfo {
                name: format!("p{index}"),
                dependencies: node.dependencies.clone(),
                pinned: node.pinned,
                labels: Labels { process: node.cost_kind.as_deref().map(Into::into), ..Labels::default() },
                chunked_by_cost: node.cost_kind.is_some(),
            });
            let opened = now;
            for (chunk, &cost) in node.chunks.iter().enumerate() {
                let ended = now + Duration::from_micros(cost) + costs.recording;
                let is_last = chunk + 1 == node.chunks.len();
                let start = chunk * node.items_per_chunk;
                let items = start..start + node.items_per_chunk - if is_last { node.missing_items } else { 0 };
                chunks.push(Chunk { node: index, items, opened, started: now, ended, ..Chunk::default() });
                now = ended;
            }
        }
        let graph = Arc::new(Graph { nodes });
        Run { graph, workers: 1, ended: now, complete: true, chunks, ..Run::default() }
    }
}

/// Any graph, with pinned nodes if `may_be_pinned`.
pub(super) fn any_test_run(may_be_pinned: bool) -> impl Strategy<Value = TestRun> {
    let chunks = prop_oneof![
        vec(0..200_u64, 0..3),
        vec(0..30_u64, 0..40),
        vec(0..3_u64, 0..200),
        (0..100_usize, 0..20_u64).prop_map(|(count, cost)| vec![cost; count]),
    ];
    let cost_kind = prop::option::weighted(0.3, prop::sample::select(vec!["fill", "sort"]));
    // The sizes that nodes which are chunked by cost can have.
    let size = prop_oneof![1..256_usize, (1..4_usize).prop_map(|blocks| blocks * BLOCK_SIZE)];
    let items = size.prop_flat_map(|items| (Just(items), 0..items));
    let node = (vec(any::<prop::sample::Index>(), 0..4), prop::bool::weighted(0.2), chunks, cost_kind, items);
    vec(node, 0..16).prop_map(move |picks| {
        let mut nodes = Vec::new();
        for (index, (picks, pinned, chunks, cost_kind, (items_per_chunk, missing_items))) in
            picks.into_iter().enumerate()
        {
            let mut dependencies: Vec<usize> =
                picks.iter().filter(|_| index > 0).map(|pick| pick.index(index)).collect();
            dependencies.sort_unstable();
            dependencies.dedup();
            let (pinned, cost_kind) = (pinned && may_be_pinned, cost_kind.map(str::to_owned));
            nodes.push(TestNode { dependencies, pinned, chunks, items_per_chunk, missing_items, cost_kind });
        }
        TestRun { nodes }
    })
}
