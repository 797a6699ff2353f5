//! The graph while an engine builds it.

use std::collections::{HashMap, VecDeque};
use std::fmt;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::error::GraphProblem;
use crate::timeline::Labels;

/// Nodes, the resources they read and write, and the order that follows from that.
///
/// `P` is a node's payload: anything in a graph that is only put in order, a [`Node`](super::Node) in a graph that is run.
///
/// # Order
///
/// A node *writes*, *modifies* (reads and writes) or *reads* a resource. The writers of a resource come first, then its
/// modifiers, then its readers:
///
/// - every modifier waits for every writer,
/// - every reader waits for every writer and every modifier.
///
/// Two writers, or two modifiers, of a resource have no order by themselves. Something else must order them, such as
/// [`order`](Self::order), or the graph does not compile.
///
/// If [`order`](Self::order) puts a reader or modifier before a writer, directly or through other nodes, it stays there and
/// sees the earlier version of the resource. A reader that is put before a writer also comes before the modifiers of that
/// writer's version.
///
/// # Dropped nodes
///
/// A node is kept if an output of the graph depends on it, directly or through other nodes, or if a node depends on it that was
/// [kept](Self::keep) explicitly. A modifier also depends on the version it modifies, so the modifiers before it are kept
/// with it. All other nodes are dropped, and [`Schedule::dropped`](super::Schedule::dropped) names them; a graph without
/// an output and without a kept node drops all its nodes.
///
/// [`order`](Self::order) keeps no node. It does work through dropped nodes: if `a` comes before `b`, and `b` before `c`, then
/// `a` comes before `c` even if `b` is dropped.
///
/// ```
/// use drawloom::graph::FrameGraph;
///
/// let mut graph = FrameGraph::new();
/// let [depth, image] = ["depth", "image"].map(|name| graph.resource(name));
/// graph.output(image);
///
/// let light = graph.add("light", "the payload of a node");
/// graph.read(light, depth);
/// graph.write(light, image);
/// let geometry = graph.add("geometry", "can be anything");
/// graph.write(geometry, depth);
/// graph.add("overlay", "this node leads to no output");
///
/// let schedule = graph.compile()?;
/// let order: Vec<&str> = schedule.nodes().map(|(name, _)| name).collect();
/// assert_eq!(order, ["geometry", "light"]);
/// assert_eq!(schedule.dropped(), ["overlay"]);
/// # Ok::<(), drawloom::graph::CompileError<&str>>(())
/// ```
pub struct FrameGraph<P> {
    /// Distinguishes this graph's ids from those of all others.
    identity: usize,
    nodes_added: usize,
    pub(super) nodes: Vec<NodeEntry<P>>,
    pub(super) resources: Vec<Resource>,
    pub(super) resource_by_name: HashMap<String, usize>,
    pub(super) accesses: Vec<Access>,
    /// Pairs of indices into `nodes`: the first comes before the second.
    pub(super) orders: Vec<(usize, usize)>,
    /// Calls with ids that do not belong to this graph, oldest first.
    pub(super) invalid_calls: VecDeque<GraphProblem>,
}

/// A node of one [`FrameGraph`], and of the [`Schedule`](super::Schedule) it compiles to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct NodeId {
    pub(super) graph: usize,
    /// How many nodes were added to the graph before this one.
    pub(super) serial: usize,
}

/// A resource of one [`FrameGraph`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ResourceId {
    graph: usize,
    index: usize,
}

pub(super) struct NodeEntry<P> {
    pub(super) name: String,
    pub(super) labels: Labels,
    pub(super) id: NodeId,
    pub(super) kept: bool,
    pub(super) payload: P,
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

impl<P> FrameGraph<P> {
    /// An empty graph.
    pub fn new() -> Self {
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

    /// The resource of that name. The first call with a name creates the resource.
    pub fn resource(&mut self, name: impl Into<String>) -> ResourceId {
        let name = name.into();
        let index = *self.resource_by_name.entry(name).or_insert_with_key(|name| {
            self.resources.push(Resource { name: name.clone(), imported: false, output: false });
            self.resources.len() - 1
        });
        ResourceId { graph: self.identity, index }
    }

    /// Marks the resource as imported: it exists before the frame starts, and needs no writer.
    pub fn import(&mut self, resource: ResourceId) {
        match self.resource_index(resource) {
            Some(index) => self.resources[index].imported = true,
            None => self.invalid_calls.push_back(GraphProblem::UnknownResource { call: "import(?)".to_owned() }),
        }
    }

    /// Marks the resource as an output of the frame.
    pub fn output(&mut self, resource: ResourceId) {
        match self.resource_index(resource) {
            Some(index) => self.resources[index].output = true,
            None => self.invalid_calls.push_back(GraphProblem::UnknownResource { call: "output(?)".to_owned() }),
        }
    }

    /// Adds a node. The graph only compiles if each node's name is unique.
    pub fn add(&mut self, name: impl Into<String>, payload: P) -> NodeId {
        let id = NodeId { graph: self.identity, serial: self.nodes_added };
        self.nodes_added += 1;
        let labels = Labels::default();
        self.nodes.push(NodeEntry { name: name.into(), labels, id, kept: false, payload });
        id
    }

    /// Removes a node with its accesses, orders and labels, and returns its payload. `None` if the graph does not contain it.
    pub fn remove(&mut self, node: NodeId) -> Option<P> {
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
        Some(self.nodes.remove(removed).payload)
    }

    /// Declares that the node reads the resource.
    pub fn read(&mut self, node: NodeId, resource: ResourceId) {
        self.access("read", node, resource, false);
    }

    /// Declares that the node writes the resource. A node that also reads it modifies it in place.
    pub fn write(&mut self, node: NodeId, resource: ResourceId) {
        self.access("write", node, resource, true);
    }

    /// Makes one node run before another, whatever they read and write. This does not keep either of them.
    pub fn order(&mut self, before: NodeId, after: NodeId) {
        match (self.node_index(before), self.node_index(after)) {
            (Some(before), Some(after)) => self.orders.push((before, after)),
            (before, after) => {
                let call = format!("order({}, {})", self.node_text(before), self.node_text(after));
                self.invalid_calls.push_back(GraphProblem::UnknownNode { call });
            }
        }
    }

    /// Keeps the node even if no output depends on it, because of its side effects.
    pub fn keep(&mut self, node: NodeId) {
        match self.node_index(node) {
            Some(index) => self.nodes[index].kept = true,
            None => self.invalid_calls.push_back(GraphProblem::UnknownNode { call: "keep(?)".to_owned() }),
        }
    }

    /// Labels the node with what it is a part of, for [timelines](crate::timeline) and spans.
    pub fn label(&mut self, node: NodeId, labels: Labels) {
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

impl<P> Default for FrameGraph<P> {
    fn default() -> Self {
        Self::new()
    }
}

impl<P> fmt::Debug for FrameGraph<P> {
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
