//! Ways through a graph of edges: an order, a circle, a walk.

use std::{cmp::Reverse, collections::BinaryHeap};

use petgraph::{
    Direction,
    graph::{DiGraph, NodeIndex},
    visit::EdgeRef,
};

use super::edges::{Edges, Relation};

/// The nodes in an order in which each comes after all before it. Where several could be next, junctions come first, and then
/// the lowest of the `nodes`: as if each junction were the edges that it stands for. Nodes on a circle, and those behind
/// one, are left out.
pub(super) fn in_order<E>(graph: &DiGraph<(), E>, nodes: usize) -> Vec<NodeIndex> {
    let rank = |node: NodeIndex| Reverse((node.index() < nodes, node));
    let mut waits_for: Vec<usize> =
        graph.node_indices().map(|node| graph.edges_directed(node, Direction::Incoming).count()).collect();
    let mut ready: BinaryHeap<Reverse<(bool, NodeIndex)>> =
        graph.node_indices().filter(|node| waits_for[node.index()] == 0).map(rank).collect();
    let mut order = Vec::with_capacity(waits_for.len());
    while let Some(Reverse((_, node))) = ready.pop() {
        order.push(node);
        for after in graph.neighbors(node) {
            waits_for[after.index()] -= 1;
            if waits_for[after.index()] == 0 {
                ready.push(rank(after));
            }
        }
    }
    order
}

/// Per node, its place in what [`in_order`] made of the graph, and the last of all for nodes that it left out.
pub(super) fn places(nodes: usize, order: &[NodeIndex]) -> Vec<usize> {
    let mut places = vec![usize::MAX; nodes];
    for (place, node) in order.iter().enumerate() {
        places[node.index()] = place;
    }
    places
}

/// The nodes of one circle, the lowest first, of a graph of so many nodes that has one; `ordered` is what [`in_order`] made
/// of it.
pub(super) fn circle(edges: &Edges, nodes: usize, ordered: &[NodeIndex]) -> Vec<NodeIndex> {
    let mut stuck = vec![true; edges.node_count()];
    for node in ordered {
        stuck[node.index()] = false;
    }
    // Whoever is stuck waits for somebody who is stuck, so the way back comes by a node twice.
    let mut path: Vec<NodeIndex> = Vec::new();
    let mut place = vec![None; stuck.len()];
    let mut next = edges.node_indices().find(|node| stuck[node.index()]);
    while let Some(node) = next {
        if let Some(start) = place[node.index()].replace(path.len()) {
            path.drain(..start);
            break;
        }
        path.push(node);
        let before = |node| edges.neighbors_directed(node, Direction::Incoming).filter(|before| stuck[before.index()]);
        // A junction stands for what leads to it.
        let (direct, junctions): (Vec<_>, Vec<_>) = before(node).partition(|node| node.index() < nodes);
        next = direct.into_iter().chain(junctions.into_iter().flat_map(before)).min();
    }
    path.reverse();
    let lowest = (0..path.len()).min_by_key(|&at| path[at]).unwrap_or(0);
    path.rotate_left(lowest);
    path
}

/// A walk along edges, from node to node, that remembers whom it met. It is used again and again, as to forget is free.
#[derive(Default)]
pub(super) struct Walk {
    /// Per node, the last walk that met it.
    met: Vec<usize>,
    walks: usize,
    open: Vec<NodeIndex>,
}

impl Walk {
    pub(super) fn new() -> Self {
        Self::default()
    }

    /// Forgets all, and walks from each of `starts` against or along the edges, to every node that `enter` lets it enter.
    pub(super) fn from(
        &mut self,
        edges: &Edges,
        starts: &[NodeIndex],
        direction: Direction,
        mut enter: impl FnMut(NodeIndex, Relation) -> bool,
    ) {
        self.walks += 1;
        self.met.resize(edges.node_count(), 0);
        starts.iter().for_each(|start| self.met[start.index()] = self.walks);
        self.open.extend(starts);
        while let Some(node) = self.open.pop() {
            for edge in edges.edges_directed(node, direction) {
                let next = match direction {
                    Direction::Incoming => edge.source(),
                    Direction::Outgoing => edge.target(),
                };
                if !self.has_met(next) && enter(next, *edge.weight()) {
                    self.met[next.index()] = self.walks;
                    self.open.push(next);
                }
            }
        }
    }

    pub(super) fn has_met(&self, node: NodeIndex) -> bool {
        self.met[node.index()] == self.walks
    }
}
