//! The graph as it is run.

use std::{collections::HashMap, fmt, sync::Arc, time::Duration};

use crate::timeline::{Graph, Labels};

use super::{builder::NodeId, costs::Costs, flow::Flow, progress::Progress, sharing::Sharing};

/// A graph in the order it runs in, checked, and flat: compiled once and [run](Self::run) every frame.
///
/// Nodes are known by their index, from 0 up to [`len`](Self::len): their place in an order in which each comes after
/// all it depends on. Of the nodes that could be next, the one that was added first is. So the same graph always gives
/// the same schedule.
pub struct Schedule<P> {
    pub(super) names: Vec<String>,
    pub(super) labels: Vec<Labels>,
    pub(super) nodes: Vec<P>,
    pub(super) indices: HashMap<NodeId, usize>,
    pub(super) dependencies: Adjacency,
    pub(super) dependents: Adjacency,
    pub(super) dropped: Vec<String>,
    pub(super) flow: Flow,
    pub(super) progress: Progress,
    pub(super) costs: Costs,
    pub(super) sharing: Sharing,
    /// What is told of it to whoever looks on, once somebody did.
    pub(super) graph: Option<Arc<Graph>>,
    pub(super) always_parallel: bool,
}

impl<P> Schedule<P> {
    /// How many nodes are run.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether there is nothing to run.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The nodes and their names, in order.
    pub fn nodes(&self) -> impl ExactSizeIterator<Item = (&str, &P)> {
        self.names.iter().map(String::as_str).zip(&self.nodes)
    }

    /// The nodes and their names, in order, to be changed between two runs.
    pub fn nodes_mut(&mut self) -> impl ExactSizeIterator<Item = (&str, &mut P)> {
        self.graph = None;
        self.names.iter().map(String::as_str).zip(&mut self.nodes)
    }

    /// The index of a node: `None` if it was dropped, or is of another graph.
    pub fn index(&self, node: NodeId) -> Option<usize> {
        self.indices.get(&node).copied()
    }

    /// The node with that id: `None` if it was dropped, or is of another graph.
    pub fn node(&self, node: NodeId) -> Option<&P> {
        self.index(node).map(|index| &self.nodes[index])
    }

    /// The node with that id, to be changed between two runs: `None` if it was dropped, or is of another graph.
    pub fn node_mut(&mut self, node: NodeId) -> Option<&mut P> {
        self.graph = None;
        self.index(node).map(|index| &mut self.nodes[index])
    }

    /// The nodes, taken out, with their names, in execution order.
    pub fn into_nodes(self) -> impl ExactSizeIterator<Item = (String, P)> {
        self.names.into_iter().zip(self.nodes)
    }

    /// The indices of what the node of that index waits for, ascending; none if there is no such node.
    ///
    /// What it waits for only through others may be left out.
    pub fn dependencies(&self, index: usize) -> &[usize] {
        self.dependencies.of(index)
    }

    /// The indices of what waits for the node of that index, ascending; none if there is no such node.
    pub fn dependents(&self, index: usize) -> &[usize] {
        self.dependents.of(index)
    }

    /// Shares every run between the workers, however little work it is: for nodes that wait for one another while they
    /// run, which one thread alone cannot do, and to see what sharing costs. It is off at first, and of no effect with a
    /// single worker.
    pub fn always_parallel(&mut self, always: bool) {
        self.always_parallel = always;
    }

    /// What the node of that index costs, from its start to its end: an average over those of the latest runs that were
    /// measured. `None` if there was none, or if there is no such node.
    ///
    /// Some of the runs that several workers share are measured: the first few, and later ones every now and then.
    pub fn cost(&self, index: usize) -> Option<Duration> {
        self.costs.of(index)
    }

    /// Whether the end of a run waits for the node of that index, as far as is known: by what the nodes
    /// [cost](Self::cost), no way through the graph is longer by more than a tenth than the longest through it. Workers
    /// that look for something to do take up such nodes before others.
    pub fn is_critical(&self, index: usize) -> bool {
        index < self.len() && self.flow.is_urgent(index as u32)
    }

    /// The names of the nodes that no output needs, in the order they were added.
    pub fn dropped(&self) -> &[String] {
        &self.dropped
    }
}

impl<P> fmt::Debug for Schedule<P> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Schedule")
            .field("nodes", &self.names)
            .field("dropped", &self.dropped)
            .finish_non_exhaustive()
    }
}

/// Lists of indices, one after another in one array (compressed sparse rows).
pub(super) struct Adjacency {
    /// Where each list starts, and where the last one ends.
    starts: Vec<usize>,
    targets: Vec<usize>,
}

impl Adjacency {
    pub(super) fn new<List: IntoIterator<Item = usize>>(lists: impl IntoIterator<Item = List>) -> Self {
        let mut adjacency = Self { starts: vec![0], targets: Vec::new() };
        for list in lists {
            adjacency.targets.extend(list);
            adjacency.starts.push(adjacency.targets.len());
        }
        adjacency
    }

    pub(super) fn of(&self, index: usize) -> &[usize] {
        match self.starts.get(index..).unwrap_or_default() {
            [start, end, ..] => &self.targets[*start..*end],
            _ => &[],
        }
    }
}
