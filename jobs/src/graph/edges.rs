//! Dependency edges: the rules of [`FrameGraph`](super::FrameGraph), applied.
//!
//! If every maker of a resource had an edge to every reader, the number of edges would be their product. So all makers
//! have an edge to one *junction*, and the junction has an edge to each reader. A junction is a vertex but not a node:
//! traversals pass through it, and results leave it out.

use petgraph::Direction;
use petgraph::graph::{DiGraph, NodeIndex};
use petgraph::visit::EdgeRef;

use super::declarations::{Access, Declarations};
use super::traversal::Traversal;

/// An edge for each reason to wait, from the dependency to the dependent. The first vertices are the graph's nodes, by
/// index; junctions follow.
pub(super) type Edges = DiGraph<(), Relation>;

/// Why a node waits for another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Relation {
    /// [`FrameGraph::order`](super::FrameGraph::order) says so.
    Order,
    /// It needs what the other node writes to the resource of this index.
    Data(usize),
}

/// The nodes that access one resource, by role, each list in the order the nodes were added.
#[derive(Default)]
pub(super) struct Roles {
    pub(super) writers: Vec<NodeIndex>,
    pub(super) modifiers: Vec<NodeIndex>,
    pub(super) readers: Vec<NodeIndex>,
}

impl Roles {
    /// The roles for every resource of the graph.
    pub(super) fn of_all(graph: &Declarations) -> Vec<Self> {
        let mut accesses = graph.accesses.clone();
        accesses.sort_unstable_by_key(|access| (access.resource, access.node, access.writes));
        let mut roles: Vec<Self> = graph.resources.iter().map(|_| Self::default()).collect();
        for of_one in accesses.chunk_by(|one, next| (one.resource, one.node) == (next.resource, next.node)) {
            let reads = of_one.iter().any(|access| !access.writes);
            let writes = of_one.iter().any(|access| access.writes);
            let Access { resource, node, .. } = of_one[0];
            let roles = &mut roles[resource];
            let role = match (reads, writes) {
                (_, false) => &mut roles.readers,
                (false, true) => &mut roles.writers,
                (true, true) => &mut roles.modifiers,
            };
            role.push(NodeIndex::new(node));
        }
        roles
    }

    /// The writers, then the modifiers.
    pub(super) fn makers(&self) -> impl Iterator<Item = NodeIndex> {
        self.writers.iter().chain(&self.modifiers).copied()
    }
}

/// The explicit edges, and those that follow from each node's accesses. [`add_versions`] adds the rest.
pub(super) fn derive(graph: &Declarations, roles: &[Roles]) -> Edges {
    let mut edges = Edges::default();
    for _ in &graph.nodes {
        edges.add_node(());
    }
    for (before, after) in &graph.orders {
        edges.add_edge(NodeIndex::new(*before), NodeIndex::new(*after), Relation::Order);
    }
    let mut traversal = Traversal::new();
    for (resource, roles) in roles.iter().enumerate() {
        link(&mut edges, &mut traversal, resource, &roles.writers, &roles.modifiers);
        // A reader that comes before a writer also comes before that writer's modifiers, through the edges just added.
        let makers: Vec<NodeIndex> = roles.makers().collect();
        link(&mut edges, &mut traversal, resource, &makers, &roles.readers);
    }
    edges
}

/// Makes every sink (a modifier or reader of the resource) wait for every source (a maker of it), except for pairs in
/// which the sink is already ordered before the source.
fn link(edges: &mut Edges, traversal: &mut Traversal, resource: usize, sources: &[NodeIndex], sinks: &[NodeIndex]) {
    if sources.is_empty() || sinks.is_empty() {
        return;
    }
    let orders = |_: NodeIndex, relation| relation == Relation::Order || relation == Relation::Data(resource);
    traversal.run(edges, sources, Direction::Incoming, orders);
    let (before_a_source, after_all): (Vec<NodeIndex>, Vec<NodeIndex>) =
        sinks.iter().copied().partition(|&sink| traversal.has_visited(sink));
    let mut pairs: Vec<(NodeIndex, NodeIndex)> = Vec::new();
    for &sink in &before_a_source {
        traversal.run(edges, &[sink], Direction::Outgoing, orders);
        pairs.extend(sources.iter().filter(|&&source| !traversal.has_visited(source)).map(|&source| (source, sink)));
    }
    if sources.len() > 1 && after_all.len() > 1 {
        let junction = edges.add_node(());
        pairs.extend(sources.iter().map(|&source| (source, junction)));
        pairs.extend(after_all.iter().map(|&sink| (junction, sink)));
    } else {
        pairs.extend(after_all.iter().flat_map(|&sink| sources.iter().map(move |&source| (source, sink))));
    }
    for (source, sink) in pairs {
        edges.add_edge(source, sink, Relation::Data(resource));
    }
}

/// Makes each modifier depend on the version it modifies: the last makers before it.
///
/// The accesses do not order modifiers. Which of them come before others is only known once all other edges are, and
/// `position` has the topological order of those. The edges add no new order. They only prevent the earlier modifier
/// from being dropped.
pub(super) fn add_versions(edges: &mut Edges, roles: &[Roles], position: &[usize]) {
    let mut traversal = Traversal::new();
    let mut made = vec![usize::MAX; edges.node_count()];
    for (resource, roles) in roles.iter().enumerate() {
        if roles.modifiers.len() < 2 {
            continue;
        }
        roles.makers().for_each(|maker| made[maker.index()] = resource);
        for &modifier in &roles.modifiers {
            // The traversal stops at makers: what comes before a maker belongs to that maker's version.
            let mut last = Vec::new();
            traversal.run(edges, &[modifier], Direction::Incoming, |before, _| {
                let is_maker = made[before.index()] == resource;
                last.extend(is_maker.then_some(before));
                !is_maker
            });
            last.sort_unstable_by_key(|maker| position[maker.index()]);
            last.dedup();
            for (index, &maker) in last.iter().enumerate() {
                // Writers have their edge already. Lists of roles are ascending.
                if roles.modifiers.binary_search(&maker).is_err() {
                    continue;
                }
                // The traversal may have found a maker along one path although another maker follows it on another
                // path.
                let later = &last[index + 1..];
                if let Some(end) = later.last() {
                    let is_between = |vertex: NodeIndex, _| position[vertex.index()] <= position[end.index()];
                    traversal.run(edges, &[maker], Direction::Outgoing, is_between);
                }
                if !later.iter().any(|&other| traversal.has_visited(other)) {
                    edges.add_edge(maker, modifier, Relation::Data(resource));
                }
            }
        }
    }
}

/// Per node, whether it is needed: it is kept, or makes an output, or a needed node depends on its data. The resources
/// that `outputs_of` names for the index of a needed node are outputs too.
pub(super) fn needed(
    graph: &Declarations,
    roles: &[Roles],
    edges: &Edges,
    outputs_of: &dyn Fn(usize) -> Vec<String>,
) -> Vec<bool> {
    let mut needed = vec![false; edges.node_count()];
    let mut stack: Vec<NodeIndex> = Vec::new();
    let mut need = |vertex: NodeIndex, stack: &mut Vec<NodeIndex>| {
        if !std::mem::replace(&mut needed[vertex.index()], true) {
            stack.push(vertex);
        }
    };
    let kept = graph.nodes.iter().enumerate().filter(|(_, node)| node.kept);
    kept.for_each(|(index, _)| need(NodeIndex::new(index), &mut stack));
    let outputs = graph.resources.iter().zip(roles).filter(|(resource, _)| resource.output);
    outputs.for_each(|(_, roles)| roles.makers().for_each(|maker| need(maker, &mut stack)));
    while let Some(vertex) = stack.pop() {
        let edges = edges.edges_directed(vertex, Direction::Incoming);
        edges.filter(|edge| *edge.weight() != Relation::Order).for_each(|edge| need(edge.source(), &mut stack));
        let is_node = vertex.index() < graph.nodes.len();
        let outputs = if is_node { outputs_of(vertex.index()) } else { Vec::new() };
        let outputs = outputs.iter().filter_map(|name| graph.resource_by_name.get(name));
        outputs.for_each(|resource| roles[*resource].makers().for_each(|maker| need(maker, &mut stack)));
    }
    needed.truncate(graph.nodes.len());
    needed
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use super::{Roles, derive};
    use crate::graph::FrameGraph;

    #[test]
    fn the_number_of_edges_is_linear_in_the_number_of_accesses() {
        const EACH: usize = if cfg!(miri) { 4 } else { 200 };
        let mut graph = FrameGraph::new();
        let image = graph.resource("image");
        let mut before = None;
        for number in 0..3 * EACH {
            let node = graph.add(number.to_string(), ());
            graph.keep(node);
            if number >= EACH {
                graph.read(node, image);
            }
            if number < 2 * EACH {
                graph.write(node, image);
                if let Some(before) = before.replace(node) {
                    graph.order(before, node);
                }
            }
        }
        let edges = derive(&graph.declarations, &Roles::of_all(&graph.declarations));
        // The explicit chain of makers; writers to modifiers; makers to readers.
        assert_eq!(edges.edge_count(), (2 * EACH - 1) + 2 * EACH + 3 * EACH);
        assert_eq!(edges.node_count(), 3 * EACH + 2);
        let schedule = graph.compile().unwrap();
        assert_eq!(schedule.dependencies(2 * EACH), [2 * EACH - 1]);
    }
}
