//! Topological order of a graph, and a cycle of a graph that has none.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use petgraph::Direction;
use petgraph::graph::{DiGraph, NodeIndex};

/// The vertices in topological order. Vertices on a cycle, or behind one, are left out.
///
/// The first `nodes` vertices are nodes, the rest are junctions. Where several vertices could be next, junctions come
/// first, then the node with the lowest index, so the order of nodes is the same as with the edges that a junction
/// stands for.
pub(super) fn topological_order<E>(graph: &DiGraph<(), E>, nodes: usize) -> Vec<NodeIndex> {
    let priority = |vertex: NodeIndex| Reverse((vertex.index() < nodes, vertex));
    let mut pending: Vec<usize> =
        graph.node_indices().map(|vertex| graph.edges_directed(vertex, Direction::Incoming).count()).collect();
    let mut ready: BinaryHeap<Reverse<(bool, NodeIndex)>> =
        graph.node_indices().filter(|vertex| pending[vertex.index()] == 0).map(priority).collect();
    let mut order = Vec::with_capacity(pending.len());
    while let Some(Reverse((_, vertex))) = ready.pop() {
        order.push(vertex);
        for after in graph.neighbors(vertex) {
            pending[after.index()] -= 1;
            if pending[after.index()] == 0 {
                ready.push(priority(after));
            }
        }
    }
    order
}

/// Per vertex, its position in a topological order, or `usize::MAX` if the order lacks it.
pub(super) fn positions(vertices: usize, order: &[NodeIndex]) -> Vec<usize> {
    let mut positions = vec![usize::MAX; vertices];
    for (position, vertex) in order.iter().enumerate() {
        positions[vertex.index()] = position;
    }
    positions
}

/// The nodes of one cycle, starting at the lowest. The graph must have a cycle; its first `nodes` vertices are nodes,
/// and `ordered` is its [`topological_order`].
pub(super) fn find_cycle<E>(graph: &DiGraph<(), E>, nodes: usize, ordered: &[NodeIndex]) -> Vec<NodeIndex> {
    let mut is_stuck = vec![true; graph.node_count()];
    for vertex in ordered {
        is_stuck[vertex.index()] = false;
    }
    // Every stuck vertex has a stuck predecessor, so following predecessors visits some vertex twice.
    let mut path: Vec<NodeIndex> = Vec::new();
    let mut index_in_path = vec![None; is_stuck.len()];
    let mut next = graph.node_indices().find(|vertex| is_stuck[vertex.index()]);
    while let Some(vertex) = next {
        if let Some(start) = index_in_path[vertex.index()].replace(path.len()) {
            path.drain(..start);
            break;
        }
        path.push(vertex);
        let before =
            |vertex| graph.neighbors_directed(vertex, Direction::Incoming).filter(|before| is_stuck[before.index()]);
        // A junction stands for its predecessors.
        let (direct, junctions): (Vec<_>, Vec<_>) = before(vertex).partition(|vertex| vertex.index() < nodes);
        next = direct.into_iter().chain(junctions.into_iter().flat_map(before)).min();
    }
    path.reverse();
    let lowest = (0..path.len()).min_by_key(|&index| path[index]).unwrap_or(0);
    path.rotate_left(lowest);
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    fn indices(vertices: &[NodeIndex]) -> Vec<usize> {
        vertices.iter().map(|vertex| vertex.index()).collect()
    }

    #[test]
    fn a_junction_does_not_change_the_order_of_nodes() {
        // Node 0 depends on node 1, and node 2 on nothing.
        let mut direct: DiGraph<(), ()> = DiGraph::from_edges([(1, 0)]);
        direct.add_node(());
        assert_eq!(indices(&topological_order(&direct, 3)), [1, 0, 2]);
        let mut through_junction = direct.clone();
        through_junction.clear_edges();
        let junction = through_junction.add_node(());
        through_junction.extend_with_edges([(NodeIndex::new(1), junction), (junction, NodeIndex::new(0))]);
        assert_eq!(indices(&topological_order(&through_junction, 3)), [1, 3, 0, 2]);
    }

    #[test]
    fn a_cycle_through_a_junction_is_one_of_nodes() {
        // Node 1 depends on node 0 through junction 2, and node 0 on node 1.
        let graph: DiGraph<(), ()> = DiGraph::from_edges([(0, 2), (2, 1), (1, 0)]);
        let ordered = topological_order(&graph, 2);
        assert!(ordered.is_empty());
        assert_eq!(indices(&find_cycle(&graph, 2, &ordered)), [0, 1]);
    }
}
