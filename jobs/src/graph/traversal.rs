//! Traversal of the vertices that a set of start vertices reaches.

use petgraph::Direction;
use petgraph::graph::{DiGraph, NodeIndex};
use petgraph::visit::EdgeRef;

/// Finds the vertices that can be reached from others. It is reusable: marks are numbers of traversals, so none has to
/// be cleared.
#[derive(Default)]
pub(super) struct Traversal {
    /// Per vertex, the last traversal that visited it.
    visited_by: Vec<usize>,
    traversals: usize,
    stack: Vec<NodeIndex>,
}

impl Traversal {
    pub(super) fn new() -> Self {
        Self::default()
    }

    /// Starts over, and visits everything that `starts` reach along the edges, or against them. `enter` decides, by an
    /// unvisited vertex and the edge that leads to it, whether to enter that vertex.
    pub(super) fn run<E: Copy>(
        &mut self,
        graph: &DiGraph<(), E>,
        starts: &[NodeIndex],
        direction: Direction,
        mut enter: impl FnMut(NodeIndex, E) -> bool,
    ) {
        self.traversals += 1;
        self.visited_by.resize(graph.node_count(), 0);
        starts.iter().for_each(|start| self.visited_by[start.index()] = self.traversals);
        self.stack.extend(starts);
        while let Some(vertex) = self.stack.pop() {
            for edge in graph.edges_directed(vertex, direction) {
                let next = match direction {
                    Direction::Incoming => edge.source(),
                    Direction::Outgoing => edge.target(),
                };
                if !self.has_visited(next) && enter(next, *edge.weight()) {
                    self.visited_by[next.index()] = self.traversals;
                    self.stack.push(next);
                }
            }
        }
    }

    /// Whether the last traversal visited the vertex.
    pub(super) fn has_visited(&self, vertex: NodeIndex) -> bool {
        self.visited_by[vertex.index()] == self.traversals
    }
}
