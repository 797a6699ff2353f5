//! The graph as an engine builds it.

use std::{
    collections::{HashMap, VecDeque},
    fmt,
    sync::atomic::{AtomicUsize, Ordering},
};

use crate::timeline::Labels;

use super::error::GraphProblem;

/// Nodes, the resources they read and write, and the order that follows.
///
/// `P` is what a node carries: anything for a graph that is only put in order, a [`Node`](super::Node) for one that runs.
///
/// # Who comes before whom
///
/// A node can *write* a resource, *modify* it (read and write it) or *read* it. Of each resource, the writers come
/// first, then the modifiers, then the readers, and each of them waits for all it needs:
///
/// - every modifier for every writer,
/// - every reader for every writer and every modifier.
///
/// Two writers, or two modifiers, have no order of their own: something else must order them, [`order`](Self::order) for
/// one, or the graph does not compile.
///
/// A reader or modifier that [`order`](Self::order) puts before a writer, directly or through others, keeps that order and
/// sees the earlier version. A reader that is put before a writer is before the modifiers of what that writer
/// makes, too.
///
/// # What is kept
///
/// The frame is for its outputs: a node is kept if an output, or a node that is [kept](Self::keep) whatever it
/// writes, needs what it writes, directly or through others. All that must be waited for is needed, and so is, for a
/// modifier, what the last modifiers before it left. Without an output and without a kept node all are dropped;
/// [`Schedule::dropped`](super::Schedule::dropped) names those that were.
///
/// What [`order`](Self::order) says puts nodes in order but keeps none. A dropped node still hands on the order: if
/// `a` comes before it, and it before `b`, then `a` comes before `b`.
///
/// ```
/// use drawloom::graph::FrameGraph;
///
/// let mut graph = FrameGraph::new();
/// let [depth, image] = ["depth", "image"].map(|name| graph.resource(name));
/// graph.output(image);
///
/// let light = graph.add("light", "what a node carries");
/// graph.read(light, depth);
/// graph.write(light, image);
/// let geometry = graph.add("geometry", "can be anything");
/// graph.write(geometry, depth);
/// graph.add("overlay", "and this one leads to no output");
///
/// let schedule = graph.compile()?;
/// let order: Vec<&str> = schedule.nodes().map(|(name, _)| name).collect();
/// assert_eq!(order, ["geometry", "light"]);
/// assert_eq!(schedule.dropped(), ["overlay"]);
/// # Ok::<(), drawloom::graph::CompileError<&str>>(())
/// ```
pub struct FrameGraph<P> {
    /// Tells this graph's ids from those of all others.
    identity: usize,
    nodes_added: usize,
    pub(super) nodes: Vec<NodeEntry<P>>,
    pub(super) resources: Vec<Resource>,
    resource_by_name: HashMap<String, usize>,
    pub(super) accesses: Vec<Access>,
    /// Pairs of positions in `nodes`: the first comes before the second.
    pub(super) orders: Vec<(usize, usize)>,
    /// Calls that were given an id that means nothing here, oldest first.
    pub(super) misuses: VecDeque<GraphProblem>,
}

/// A node of one [`FrameGraph`], and of the [`Schedule`](super::Schedule) it compiles to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct NodeId {
    pub(super) graph: usize,
    /// How many nodes had been added to the graph before it.
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

/// One call of `read` or `write`, by positions in `nodes` and `resources`.
#[derive(Clone, Copy)]
pub(super) struct Access {
    pub(super) resource: usize,
    pub(super) node: usize,
    pub(super) writes: bool,
}

impl<P> FrameGraph<P> {
    /// An empty graph.
    pub fn new() -> Self {
        // No loom atomic: those cannot stand in a static, and nothing is handed over here.
        static GRAPHS: AtomicUsize = AtomicUsize::new(0);
        Self {
            // Relaxed: only that no two graphs get one number matters.
            identity: GRAPHS.fetch_add(1, Ordering::Relaxed),
            nodes_added: 0,
            nodes: Vec::new(),
            resources: Vec::new(),
            resource_by_name: HashMap::new(),
            accesses: Vec::new(),
            orders: Vec::new(),
            misuses: VecDeque::new(),
        }
    }

    /// The resource of that name, which is made by naming it.
    pub fn resource(&mut self, name: impl Into<String>) -> ResourceId {
        let name = name.into();
        let index = *self.resource_by_name.entry(name).or_insert_with_key(|name| {
            self.resources.push(Resource { name: name.clone(), imported: false, output: false });
            self.resources.len() - 1
        });
        ResourceId { graph: self.identity, index }
    }

    /// Says that the resource comes from outside: it is there before the frame starts and needs no writer.
    pub fn import(&mut self, resource: ResourceId) {
        match self.resource_position(resource) {
            Some(position) => self.resources[position].imported = true,
            None => self.misuses.push_back(GraphProblem::UnknownResource { call: "import(?)".to_owned() }),
        }
    }

    /// Says that the resource is what the frame is for.
    pub fn output(&mut self, resource: ResourceId) {
        match self.resource_position(resource) {
            Some(position) => self.resources[position].output = true,
            None => self.misuses.push_back(GraphProblem::UnknownResource { call: "output(?)".to_owned() }),
        }
    }

    /// Adds a node. No two nodes of a graph that compiles have one name.
    pub fn add(&mut self, name: impl Into<String>, node: P) -> NodeId {
        let id = NodeId { graph: self.identity, serial: self.nodes_added };
        self.nodes_added += 1;
        let labels = Labels::default();
        self.nodes.push(NodeEntry { name: name.into(), labels, id, kept: false, payload: node });
        id
    }

    /// Takes a node out, with all that was said about it, and gives it back: `None` if it is not there.
    pub fn remove(&mut self, node: NodeId) -> Option<P> {
        let removed = self.node_position(node)?;
        let moved = |position: usize| position - usize::from(position > removed);
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

    /// Says that the node reads the resource.
    pub fn read(&mut self, node: NodeId, resource: ResourceId) {
        self.access("read", node, resource, false);
    }

    /// Says that the node writes the resource. One that also reads it modifies it in place.
    pub fn write(&mut self, node: NodeId, resource: ResourceId) {
        self.access("write", node, resource, true);
    }

    /// Says that one node runs before another, whatever they read and write. It keeps neither.
    pub fn order(&mut self, before: NodeId, after: NodeId) {
        match (self.node_position(before), self.node_position(after)) {
            (Some(before), Some(after)) => self.orders.push((before, after)),
            (before, after) => {
                let call = format!("order({}, {})", self.node_text(before), self.node_text(after));
                self.misuses.push_back(GraphProblem::UnknownNode { call });
            }
        }
    }

    /// Keeps the node whatever it writes, for what it does besides.
    pub fn keep(&mut self, node: NodeId) {
        match self.node_position(node) {
            Some(position) => self.nodes[position].kept = true,
            None => self.misuses.push_back(GraphProblem::UnknownNode { call: "keep(?)".to_owned() }),
        }
    }

    /// Says what the node is a part of, for [timelines](crate::timeline) and spans.
    pub fn label(&mut self, node: NodeId, labels: Labels) {
        match self.node_position(node) {
            Some(position) => self.nodes[position].labels = labels,
            None => self.misuses.push_back(GraphProblem::UnknownNode { call: "label(?)".to_owned() }),
        }
    }

    fn access(&mut self, call: &str, node: NodeId, resource: ResourceId, writes: bool) {
        match (self.node_position(node), self.resource_position(resource)) {
            (Some(node), Some(resource)) => self.accesses.push(Access { resource, node, writes }),
            (node, resource) => {
                let resource_text =
                    resource.map_or_else(|| "?".to_owned(), |position| format!("{:?}", self.resources[position].name));
                let text = format!("{call}({}, {resource_text})", self.node_text(node));
                self.misuses.push_back(match node {
                    None => GraphProblem::UnknownNode { call: text },
                    Some(_) => GraphProblem::UnknownResource { call: text },
                });
            }
        }
    }

    fn node_position(&self, node: NodeId) -> Option<usize> {
        if node.graph != self.identity {
            return None;
        }
        self.nodes.binary_search_by_key(&node.serial, |node| node.id.serial).ok()
    }

    fn resource_position(&self, resource: ResourceId) -> Option<usize> {
        (resource.graph == self.identity).then_some(resource.index)
    }

    fn node_text(&self, position: Option<usize>) -> String {
        position.map_or_else(|| "?".to_owned(), |position| format!("{:?}", self.nodes[position].name))
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
