//! What an engine declares of a graph: all but the payloads of its nodes, so that what works with it exists once, and
//! not once for each type of payload.

use std::collections::{HashMap, VecDeque};
use std::fmt;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::error::GraphProblem;
use crate::timeline::Labels;

/// The nodes, resources and orders of a [`FrameGraph`](super::FrameGraph), whose methods of the same names say what
/// each call means.
pub(super) struct Declarations {
    /// Distinguishes this graph's ids from those of all others.
    identity: usize,
    nodes_added: usize,
    pub(super) nodes: Vec<DeclaredNode>,
    pub(super) resources: Vec<Resource>,
    pub(super) resource_by_name: HashMap<String, usize>,
    pub(super) accesses: Vec<Access>,
    /// Pairs of indices into `nodes`: the first comes before the second.
    pub(super) orders: Vec<(usize, usize)>,
    /// Calls with ids that do not belong to this graph, oldest first.
    pub(super) invalid_calls: VecDeque<GraphProblem>,
}

/// A node of one [`FrameGraph`](super::FrameGraph), and of the [`Schedule`](super::Schedule) it compiles to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct NodeId {
    pub(super) graph: usize,
    /// How many nodes were added to the graph before this one.
    pub(super) serial: usize,
}

/// A resource of one [`FrameGraph`](super::FrameGraph).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ResourceId {
    graph: usize,
    index: usize,
}

pub(super) struct DeclaredNode {
    pub(super) name: String,
    pub(super) labels: Labels,
    pub(super) id: NodeId,
    pub(super) kept: bool,
}

pub(super) struct Resource {
    pub(super) name: String,
    pub(super) imported: bool,
    pub(super) output: bool,
}

/// One call of `read` or `write`, by indices into `nodes` and `resources`.
#[derive(Clone, Copy)]
pub(super) struct Access {
    pub(super) resource: usize,
    pub(super) node: usize,
    pub(super) writes: bool,
}

impl Declarations {
    pub(super) fn new() -> Self {
        // Not a loom atomic: those cannot be statics, and this one hands nothing over.
        static GRAPHS: AtomicUsize = AtomicUsize::new(0);
        Self {
            // Relaxed: the numbers only have to be unique.
            identity: GRAPHS.fetch_add(1, Ordering::Relaxed),
            nodes_added: 0,
            nodes: Vec::new(),
            resources: Vec::new(),
            resource_by_name: HashMap::new(),
            accesses: Vec::new(),
            orders: Vec::new(),
            invalid_calls: VecDeque::new(),
        }
    }

    pub(super) fn resource(&mut self, name: String) -> ResourceId {
        let index = *self.resource_by_name.entry(name).or_insert_with_key(|name| {
            self.resources.push(Resource { name: name.clone(), imported: false, output: false });
            self.resources.len() - 1
        });
        ResourceId { graph: self.identity, index }
    }

    pub(super) fn import(&mut self, resource: ResourceId) {
        match self.resource_index(resource) {
            Some(index) => self.resources[index].imported = true,
            None => self.invalid_calls.push_back(GraphProblem::UnknownResource { call: "import(?)".to_owned() }),
        }
    }

    pub(super) fn output(&mut self, resource: ResourceId) {
        match self.resource_index(resource) {
            Some(index) => self.resources[index].output = true,
            None => self.invalid_calls.push_back(GraphProblem::UnknownResource { call: "output(?)".to_owned() }),
        }
    }

    pub(super) fn add(&mut self, name: String) -> NodeId {
        let id = NodeId { graph: self.identity, serial: self.nodes_added };
        self.nodes_added += 1;
        self.nodes.push(DeclaredNode { name, labels: Labels::default(), id, kept: false });
        id
    }

    /// Removes a node with its accesses, orders and labels, and returns the index that it had.
    pub(super) fn remove(&mut self, node: NodeId) -> Option<usize> {
        let removed = self.node_index(node)?;
        let moved = |index: usize| index - usize::from(index > removed);
        self.accesses.retain(|access| access.node != removed);
        for access in &mut self.accesses {
            access.node = moved(access.node);
        }
        self.orders.retain(|(before, after)| *before != removed && *after != removed);
        for (before, after) in &mut self.orders {
            (*before, *after) = (moved(*before), moved(*after));
        }
        self.nodes.remove(removed);
        Some(removed)
    }

    pub(super) fn read(&mut self, node: NodeId, resource: ResourceId) {
        self.access("read", node, resource, false);
    }

    pub(super) fn write(&mut self, node: NodeId, resource: ResourceId) {
        self.access("write", node, resource, true);
    }

    pub(super) fn order(&mut self, before: NodeId, after: NodeId) {
        match (self.node_index(before), self.node_index(after)) {
            (Some(before), Some(after)) => self.orders.push((before, after)),
            (before, after) => {
                let call = format!("order({}, {})", self.node_text(before), self.node_text(after));
                self.invalid_calls.push_back(GraphProblem::UnknownNode { call });
            }
        }
    }

    pub(super) fn keep(&mut self, node: NodeId) {
        match self.node_index(node) {
            Some(index) => self.nodes[index].kept = true,
            None => self.invalid_calls.push_back(GraphProblem::UnknownNode { call: "keep(?)".to_owned() }),
        }
    }

    pub(super) fn label(&mut self, node: NodeId, labels: Labels) {
        match self.node_index(node) {
            Some(index) => self.nodes[index].labels = labels,
            None => self.invalid_calls.push_back(GraphProblem::UnknownNode { call: "label(?)".to_owned() }),
        }
    }

    fn access(&mut self, call: &str, node: NodeId, resource: ResourceId, writes: bool) {
        match (self.node_index(node), self.resource_index(resource)) {
            (Some(node), Some(resource)) => self.accesses.push(Access { resource, node, writes }),
            (node, resource) => {
                let resource_text =
                    resource.map_or_else(|| "?".to_owned(), |index| format!("{:?}", self.resources[index].name));
                let text = format!("{call}({}, {resource_text})", self.node_text(node));
                self.invalid_calls.push_back(match node {
                    None => GraphProblem::UnknownNode { call: text },
                    Some(_) => GraphProblem::UnknownResource { call: text },
                });
            }
        }
    }

    fn node_index(&self, node: NodeId) -> Option<usize> {
        if node.graph != self.identity {
            return None;
        }
        self.nodes.binary_search_by_key(&node.serial, |node| node.id.serial).ok()
    }

    fn resource_index(&self, resource: ResourceId) -> Option<usize> {
        (resource.graph == self.identity).then_some(resource.index)
    }

    fn node_text(&self, index: Option<usize>) -> String {
        index.map_or_else(|| "?".to_owned(), |index| format!("{:?}", self.nodes[index].name))
    }
}

impl fmt::Debug for Declarations {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nodes: Vec<&str> = self.nodes.iter().map(|node| node.name.as_str()).collect();
        let resources: Vec<&str> = self.resources.iter().map(|resource| resource.name.as_str()).collect();
        formatter
            .debug_struct("FrameGraph")
            .field("nodes", &nodes)
            .field("resources", &resources)
            .finish_non_exhaustive()
    }
}
