//! Runs made by hand, for tests of the simulation.

use std::sync::Arc;
use std::time::Duration;

use proptest::collection::vec;
use proptest::prelude::*;

use super::SchedulerCosts;
use crate::timeline::{Chunk, Graph, NodeInfo, Run};

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
}

impl TestRun {
    pub(super) fn new() -> Self {
        Self::default()
    }

    pub(super) fn add(mut self, dependencies: &[usize], chunks: &[u64]) -> Self {
        let (dependencies, chunks) = (dependencies.to_vec(), chunks.to_vec());
        self.nodes.push(TestNode { dependencies, pinned: false, chunks });
        self
    }

    pub(super) fn add_pinned(self, dependencies: &[usize], chunks: &[u64]) -> Self {
        let mut test_run = self.add(dependencies, chunks);
        test_run.nodes.last_mut().expect("a node was added").pinned = true;
        test_run
    }

    /// The record of a run on one thread, with these recording costs. Chunks have three items.
    pub(super) fn run(&self, costs: &SchedulerCosts) -> Run {
        let mut now = Duration::ZERO;
        let (mut nodes, mut chunks) = (Vec::new(), Vec::new());
        for (index, node) in self.nodes.iter().enumerate() {
            nodes.push(NodeInfo {
                name: format!("p{index}"),
                dependencies: node.dependencies.clone(),
                pinned: node.pinned,
                ..NodeInfo::default()
            });
            let opened = now;
            for (chunk, &cost) in node.chunks.iter().enumerate() {
                let ended = now + Duration::from_micros(cost) + costs.recording;
                let items = chunk * 3..chunk * 3 + 3;
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
    let node = (vec(any::<prop::sample::Index>(), 0..4), prop::bool::weighted(0.2), chunks);
    vec(node, 0..16).prop_map(move |picks| {
        let mut nodes = Vec::new();
        for (index, (picks, pinned, chunks)) in picks.into_iter().enumerate() {
            let mut dependencies: Vec<usize> =
                picks.iter().filter(|_| index > 0).map(|pick| pick.index(index)).collect();
            dependencies.sort_unstable();
            dependencies.dedup();
            nodes.push(TestNode { dependencies, pinned: pinned && may_be_pinned, chunks });
        }
        TestRun { nodes }
    })
}
