//! A compiled graph.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use super::costs::NodeCosts;
use super::declarations::NodeId;
use super::execution_policy::{ExecutionPolicy, ModeChoice};
use super::flat_graph::FlatGraph;
use super::progress::Progress;
use crate::timeline::Graph;

/// A compiled graph: checked, in execution order, and stored in flat arrays. It is compiled once and [run](Self::run)
/// every frame.
///
/// Nodes have indices from 0 up to [`len`](Self::len), in topological order: a node's index is higher than those of all
/// its dependencies. Where several nodes could be next, the one that was added first is, so the same graph always
/// compiles to the same schedule.
pub struct Schedule<P> {
    pub(super) graph: FlatGraph,
    /// The payload of each node.
    pub(super) nodes: Vec<P>,
    pub(super) progress: Progress,
    pub(super) costs: NodeCosts,
    pub(super) policy: ExecutionPolicy,
    /// The schedule as timelines and spans describe it, built for the first run that is recorded or traced.
    pub(super) description: Option<Arc<Graph>>,
    pub(super) always_parallel: bool,
}

impl<P> Schedule<P> {
    /// A schedule that has not run yet. `nodes` are the payloads of the graph's nodes.
    pub(super) fn new(graph: FlatGraph, nodes: Vec<P>) -> Self {
        let (progress, costs) = (Progress::new(&graph.adjacency), NodeCosts::new(graph.adjacency.len()));
        Self {
            graph,
            nodes,
            progress,
            costs,
            policy: ExecutionPolicy::default(),
            description: None,
            always_parallel: false,
        }
    }

    /// The number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether the schedule has no nodes.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The names and payloads of the nodes, in execution order.
    pub fn nodes(&self) -> impl ExactSizeIterator<Item = (&str, &P)> {
        self.graph.names.iter().map(String::as_str).zip(&self.nodes)
    }

    /// The names and payloads of the nodes, in execution order, to be changed between two runs.
    pub fn nodes_mut(&mut self) -> impl ExactSizeIterator<Item = (&str, &mut P)> {
        self.description = None;
        self.graph.names.iter().map(String::as_str).zip(&mut self.nodes)
    }

    /// The index of a node: `None` if it was dropped, or belongs to another graph.
    pub fn index(&self, node: NodeId) -> Option<usize> {
        self.graph.indices.get(&node).copied()
    }

    /// The payload of a node: `None` if it was dropped, or belongs to another graph.
    pub fn node(&self, node: NodeId) -> Option<&P> {
        self.index(node).map(|index| &self.nodes[index])
    }

    /// The payload of a node, to be changed between two runs: `None` if it was dropped, or belongs to another graph.
    pub fn node_mut(&mut self, node: NodeId) -> Option<&mut P> {
        self.description = None;
        self.index(node).map(|index| &mut self.nodes[index])
    }

    /// The indices of the nodes that a node waits for, ascending; empty if there is no such node.
    ///
    /// Nodes that it only waits for through other nodes may be left out.
    pub fn dependencies(&self, index: usize) -> &[usize] {
        self.graph.dependencies.of(index)
    }

    /// The indices of the nodes that wait for a node, ascending; empty if there is no such node.
    pub fn dependents(&self, index: usize) -> &[usize] {
        self.graph.dependents.of(index)
    }

    /// Executes every run in parallel, however little work it is. This is for nodes that wait for each other while they
    /// run, which deadlock on one thread, and for measuring what parallel execution costs. Off by default; no effect
    /// with a single worker.
    pub fn always_parallel(&mut self, always: bool) {
        self.always_parallel = always;
    }

    /// Takes over what was measured of another schedule whose runs do similar work: the first runs are executed in the
    /// [mode](Self::run_mode) that the other one would have, instead of trying out which.
    pub fn inherit_measurements(&mut self, before: &Self) {
        self.policy = before.policy.of_successor();
    }

    /// The time from a node's start to its end: an average over the latest measured runs. `None` if no run was
    /// measured, or if there is no such node.
    ///
    /// Some of the parallel runs are measured: the first few, and later ones now and then.
    pub fn cost(&self, index: usize) -> Option<Duration> {
        self.costs.of(index)
    }

    /// Whether a node is on a critical path, by the measured [costs](Self::cost): the longest path through the node is
    /// at most a tenth shorter than the longest path of the graph. Idle workers take critical nodes first.
    pub fn is_critical(&self, index: usize) -> bool {
        index < self.len() && self.graph.adjacency.is_critical(index as u32)
    }

    /// The mode of the latest run that had a choice, and the estimates by which it was chosen; `None` before the first
    /// one. There is no choice with a single worker, for a schedule that is [always parallel](Self::always_parallel),
    /// and if the scheduler [shuffles](crate::task::SchedulerBuilder::shuffle).
    pub fn run_mode(&self) -> Option<ModeChoice> {
        self.policy.latest()
    }

    /// The names of the nodes that were dropped because no output needs them, in the order they were added.
    pub fn dropped(&self) -> &[String] {
        &self.graph.dropped
    }
}

impl<P> fmt::Debug for Schedule<P> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Schedule")
            .field("nodes", &self.graph.names)
            .field("dropped", &self.graph.dropped)
            .finish_non_exhaustive()
    }
}
