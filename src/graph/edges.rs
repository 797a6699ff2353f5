//! Who waits for whom, and why: the rules of [`FrameGraph`] turned into edges.
//!
//! Where many read what many make, an edge from each maker to each reader would be their product. So all makers lead to one
//! *junction*, and that to all readers, which means the same with an edge each. Junctions are nodes behind those of the
//! nodes: whoever follows edges passes through them, and they are in no result.

use petgraph::{
    Direction,
    graph::{DiGraph, NodeIndex},
    visit::EdgeRef,
};

use super::{
    builder::{Access, FrameGraph},
    order::Walk,
};

/// An edge per reason to wait, from the node waited for. The node of a node is its position in the graph; those of
/// junctions follow.
pub(super) type Edges = DiGraph<(), Relation>;

/// Why one node waits for another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Relation {
    /// It was told to.
    Order,
    /// It needs what the other makes of this resource.
    Data(usize),
}

/// The nodes that touch one resource, by what they do with it, each in the order they were added.
#[derive(Default)]
pub(super) struct Roles {
    pub(super) writers: Vec<NodeIndex>,
    pub(super) modifiers: Vec<NodeIndex>,
    pub(super) readers: Vec<NodeIndex>,
}

impl Roles {
    /// Every resource's.
    pub(super) fn of_all<P>(graph: &FrameGraph<P>) -> Vec<Self> {
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

    /// All that make something of the resource: writers and modifiers.
    pub(super) fn makers(&self) -> impl Iterator<Item = NodeIndex> {
        self.writers.iter().chain(&self.modifiers).copied()
    }
}

/// The edges that were told, and those that follow from what each node does with each resource alone.
pub(super) fn derive<P>(graph: &FrameGraph<P>, roles: &[Roles]) -> Edges {
    let mut edges = Edges::default();
    for _ in &graph.nodes {
        edges.add_node(());
    }
    for (before, after) in &graph.orders {
        edges.add_edge(NodeIndex::new(*before), NodeIndex::new(*after), Relation::Order);
    }
    let mut walk = Walk::new();
    for (resource, roles) in roles.iter().enumerate() {
        link(&mut edges, &mut walk, resource, &roles.writers, &roles.modifiers);
        // A reader that goes before a writer finds that writer's modifiers behind it, through the edges just made.
        let makers: Vec<NodeIndex> = roles.makers().collect();
        link(&mut edges, &mut walk, resource, &makers, &roles.readers);
    }
    edges
}

/// Lets every sink wait for every source, but for the pairs in which the sink has been put before the source.
fn link(edges: &mut Edges, walk: &mut Walk, resource: usize, sources: &[NodeIndex], sinks: &[NodeIndex]) {
    if sources.is_empty() || sinks.is_empty() {
        return;
    }
    let told = |_: NodeIndex, relation| relation == Relation::Order || relation == Relation::Data(resource);
    walk.from(edges, sources, Direction::Incoming, told);
    let (some_before, all_after): (Vec<NodeIndex>, Vec<NodeIndex>) =
        sinks.iter().copied().partition(|&sink| walk.has_met(sink));
    let mut pairs: Vec<(NodeIndex, NodeIndex)> = Vec::new();
    for &sink in &some_before {
        walk.from(edges, &[sink], Direction::Outgoing, told);
        pairs.extend(sources.iter().filter(|&&source| !walk.has_met(source)).map(|&source| (source, sink)));
    }
    if sources.len() > 1 && all_after.len() > 1 {
        let junction = edges.add_node(());
        pairs.extend(sources.iter().map(|&source| (source, junction)));
        pairs.extend(all_after.iter().map(|&sink| (junction, sink)));
    } else {
        pairs.extend(all_after.iter().flat_map(|&sink| sources.iter().map(move |&source| (source, sink))));
    }
    for (source, sink) in pairs {
        edges.add_edge(source, sink, Relation::Data(resource));
    }
}

/// Lets modifiers wait for the version they are to modify: what the last makers before them left.
///
/// Modifiers have no order of their own, so only once all edges are known is it known which of them come before which, and
/// `place` is where. That one needs what the other left is no new order, but it is a reason to keep the other.
pub(super) fn add_versions(edges: &mut Edges, roles: &[Roles], place: &[usize]) {
    let mut walk = Walk::new();
    let mut made = vec![usize::MAX; edges.node_count()];
    for (resource, roles) in roles.iter().enumerate() {
        if roles.modifiers.len() < 2 {
            continue;
        }
        roles.makers().for_each(|maker| made[maker.index()] = resource);
        for &modifier in &roles.modifiers {
            // What stands behind another maker is that maker's affair: the walk goes no further there.
            let mut last = Vec::new();
            walk.from(edges, &[modifier], Direction::Incoming, |before, _| {
                let is_maker = made[before.index()] == resource;
                last.extend(is_maker.then_some(before));
                !is_maker
            });
            last.sort_unstable_by_key(|maker| place[maker.index()]);
            last.dedup();
            for (at, &maker) in last.iter().enumerate() {
                // Writers have their edge already. All lists of roles are ascending.
                if roles.modifiers.binary_search(&maker).is_err() {
                    continue;
                }
                // A maker can have been met although it stands behind another one as well, by a way past that one.
                let later = &last[at + 1..];
                if let Some(end) = later.last() {
                    let is_between = |node: NodeIndex, _| place[node.index()] <= place[end.index()];
                    walk.from(edges, &[maker], Direction::Outgoing, is_between);
                }
                if !later.iter().any(|&other| walk.has_met(other)) {
                    edges.add_edge(maker, modifier, Relation::Data(resource));
                }
            }
        }
    }
}

/// Which nodes are needed: kept ones, those that make an output, and all that these need.
pub(super) fn needed<P>(graph: &FrameGraph<P>, roles: &[Roles], edges: &Edges) -> Vec<bool> {
    let mut needed: Vec<bool> = graph.nodes.iter().map(|node| node.kept).collect();
    needed.resize(edges.node_count(), false);
    for (resource, roles) in graph.resources.iter().zip(roles) {
        if resource.output {
            roles.makers().for_each(|maker| needed[maker.index()] = true);
        }
    }
    let mut open: Vec<NodeIndex> = edges.node_indices().filter(|node| needed[node.index()]).collect();
    while let Some(node) = open.pop() {
        for edge in edges.edges_directed(node, Direction::Incoming) {
            let source = edge.source();
            if *edge.weight() != Relation::Order && !needed[source.index()] {
                needed[source.index()] = true;
                open.push(source);
            }
        }
    }
    needed.truncate(graph.nodes.len());
    needed
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::{Roles, derive};
    use crate::graph::FrameGraph;

    #[test]
    fn edges_grow_with_what_nodes_do_and_not_with_pairs_of_them() {
        const EACH: usize = if cfg!(miri) { 10 } else { 200 };
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
        let edges = derive(&graph, &Roles::of_all(&graph));
        // Makers in a chain; writers to modifiers; both to readers.
        assert_eq!(edges.edge_count(), (2 * EACH - 1) + 2 * EACH + 3 * EACH);
        assert_eq!(edges.node_count(), 3 * EACH + 2);
        let schedule = graph.compile().unwrap();
        assert_eq!(schedule.dependencies(2 * EACH), [2 * EACH - 1]);
    }
}
