//! The graph while an engine builds it.

use std::fmt;

use super::declarations::{Declarations, NodeId, ResourceId};
use crate::timeline::Labels;

/// Nodes, the resources they read and write, and the order that follows from that.
///
/// `P` is a node's payload: anything in a graph that is only put in order, a [`Node`](super::Node) in a graph that is
/// run.
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
/// If [`order`](Self::order) puts a reader or modifier before a writer, directly or through other nodes, it stays there
/// and sees the earlier version of the resource. A reader that is put before a writer also comes before the modifiers
/// of that writer's version.
///
/// # Dropped nodes
///
/// A node is kept if an output of the graph depends on it, directly or through other nodes, or if a node depends on it
/// that was [kept](Self::keep) explicitly. A modifier also depends on the version it modifies, so the modifiers before
/// it are kept with it. All other nodes are dropped, and [`Schedule::dropped`](super::Schedule::dropped) names them; a
/// graph without an output and without a kept node drops all its nodes.
///
/// [`order`](Self::order) keeps no node. It does work through dropped nodes: if `a` comes before `b`, and `b` before
/// `c`, then `a` comes before `c` even if `b` is dropped.
///
/// ```
/// use drawloom_jobs::graph::FrameGraph;
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
/// # Ok::<(), drawloom_jobs::graph::CompileError<&str>>(())
/// ```
pub struct FrameGraph<P> {
    pub(super) declarations: Declarations,
    /// The payload of each declared node.
    pub(super) payloads: Vec<P>,
}

impl<P> FrameGraph<P> {
    /// An empty graph.
    pub fn new() -> Self {
        Self { declarations: Declarations::new(), payloads: Vec::new() }
    }

    /// The resource of that name. The first call with a name creates the resource.
    pub fn resource(&mut self, name: impl Into<String>) -> ResourceId {
        self.declarations.resource(name.into())
    }

    /// Marks the resource as imported: it exists before the frame starts, and needs no writer.
    pub fn import(&mut self, resource: ResourceId) {
        self.declarations.import(resource);
    }

    /// Marks the resource as an output of the frame.
    pub fn output(&mut self, resource: ResourceId) {
        self.declarations.output(resource);
    }

    /// Adds a node. The graph only compiles if each node's name is unique.
    pub fn add(&mut self, name: impl Into<String>, payload: P) -> NodeId {
        self.payloads.push(payload);
        self.declarations.add(name.into())
    }

    /// Removes a node with its accesses, orders and labels, and returns its payload. `None` if the graph does not
    /// contain it.
    pub fn remove(&mut self, node: NodeId) -> Option<P> {
        self.declarations.remove(node).map(|index| self.payloads.remove(index))
    }

    /// Declares that the node reads the resource.
    pub fn read(&mut self, node: NodeId, resource: ResourceId) {
        self.declarations.read(node, resource);
    }

    /// Declares that the node writes the resource. A node that also reads it modifies it in place.
    pub fn write(&mut self, node: NodeId, resource: ResourceId) {
        self.declarations.write(node, resource);
    }

    /// Makes one node run before another, whatever they read and write. This does not keep either of them.
    pub fn order(&mut self, before: NodeId, after: NodeId) {
        self.declarations.order(before, after);
    }

    /// Keeps the node even if no output depends on it, because of its side effects.
    pub fn keep(&mut self, node: NodeId) {
        self.declarations.keep(node);
    }

    /// Labels the node with what it is a part of, for [timelines](crate::timeline) and spans.
    pub fn label(&mut self, node: NodeId, labels: Labels) {
        self.declarations.label(node, labels);
    }
}

impl<P> Default for FrameGraph<P> {
    fn default() -> Self {
        Self::new()
    }
}

impl<P> fmt::Debug for FrameGraph<P> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.declarations.fmt(formatter)
    }
}
