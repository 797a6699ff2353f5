//! Plans a schedule: orders the nodes, drops the unneeded ones, and checks the rest.

use std::collections::{HashMap, HashSet};

use petgraph::Direction;
use petgraph::graph::{DiGraph, NodeIndex};
use petgraph::visit::EdgeRef;

use super::declarations::Declarations;
use super::edges::{self, Edges, Relation, Roles};
use super::error::GraphProblem;
use super::order::{find_cycle, positions, topological_order};
use super::traversal::Traversal;

/// What a schedule is made from, by indices of the graph's nodes.
pub(super) struct Plan {
    pub(super) needed: Vec<bool>,
    /// The needed nodes in execution order.
    pub(super) order: Vec<usize>,
    /// Per node, the needed nodes it waits for.
    pub(super) dependencies: Vec<Vec<usize>>,
}

/// Plans the schedule of a graph. A needed node makes outputs of those resources that `outputs_of` names for its index.
///
/// # Errors
/// As [`FrameGraph::compile`](super::FrameGraph::compile).
pub(super) fn plan(graph: &mut Declarations, outputs_of: &dyn Fn(usize) -> Vec<String>) -> Result<Plan, GraphProblem> {
    if let Some(problem) = graph.invalid_calls.pop_front() {
        return Err(problem);
    }
    let graph = &*graph;
    check_names(graph)?;
    let roles = Roles::of_all(graph);
    let mut edges = edges::derive(graph, &roles);
    let order = topological_order(&edges, graph.nodes.len());
    if order.len() < edges.node_count() {
        let cycle = find_cycle(&edges, graph.nodes.len(), &order);
        let nodes = cycle.into_iter().map(|vertex| name(graph, vertex)).collect();
        return Err(GraphProblem::Cycle { nodes });
    }
    let position = positions(order.len(), &order);
    edges::add_versions(&mut edges, &roles, &position);
    let needed = edges::needed(graph, &roles, &edges, outputs_of);
    let analysis = Analysis { graph, roles: &roles, edges: &edges, needed: &needed, position: &position };
    analysis.check_producers()?;
    analysis.check_writers()?;
    let dependencies = analysis.dependencies();

    // Ordered again without the dropped nodes, so that they do not influence how ties are broken.
    let mut remaining = DiGraph::<(), ()>::with_capacity(needed.len(), 0);
    for _ in &needed {
        remaining.add_node(());
    }
    for (node, dependencies) in dependencies.iter().enumerate() {
        for &dependency in dependencies {
            remaining.add_edge(NodeIndex::new(dependency), NodeIndex::new(node), ());
        }
    }
    let order = topological_order(&remaining, needed.len())
        .into_iter()
        .map(NodeIndex::index)
        .filter(|&node| needed[node])
        .collect();
    Ok(Plan { needed, order, dependencies })
}

fn name(graph: &Declarations, vertex: NodeIndex) -> String {
    graph.nodes[vertex.index()].name.clone()
}

fn check_names(graph: &Declarations) -> Result<(), GraphProblem> {
    let mut names = HashSet::new();
    match graph.nodes.iter().find(|node| !names.insert(node.name.as_str())) {
        Some(node) => Err(GraphProblem::DuplicateNode { name: node.name.clone() }),
        None => Ok(()),
    }
}

/// An acyclic graph with its edges and order.
struct Analysis<'a> {
    graph: &'a Declarations,
    roles: &'a [Roles],
    edges: &'a Edges,
    needed: &'a [bool],
    /// Per vertex, its position in the topological order, which includes dropped nodes.
    position: &'a [usize],
}

impl Analysis<'_> {
    /// Whether the vertex is a needed node. A junction is not a node.
    fn is_needed(&self, vertex: NodeIndex) -> bool {
        self.needed.get(vertex.index()).is_some_and(|&needed| needed)
    }

    fn position(&self, vertex: NodeIndex) -> usize {
        self.position[vertex.index()]
    }

    fn check_producers(&self) -> Result<(), GraphProblem> {
        for (index, (resource, roles)) in self.graph.resources.iter().zip(self.roles).enumerate() {
            if resource.imported {
                continue;
            }
            let has_producer = |vertex: NodeIndex| {
                let mut incoming = self.edges.edges_directed(vertex, Direction::Incoming);
                incoming.any(|edge| *edge.weight() == Relation::Data(index))
            };
            let readers = roles.modifiers.iter().chain(&roles.readers);
            let mut readers: Vec<NodeIndex> =
                readers.copied().filter(|&reader| self.is_needed(reader) && !has_producer(reader)).collect();
            let output = resource.output && roles.makers().next().is_none();
            if output || !readers.is_empty() {
                readers.sort_unstable();
                return Err(GraphProblem::MissingProducer {
                    resource: resource.name.clone(),
                    output,
                    readers: readers.into_iter().map(|reader| name(self.graph, reader)).collect(),
                });
            }
        }
        Ok(())
    }

    /// The makers of a resource are ordered if, in topological order, each of them has a path to the next.
    fn check_writers(&self) -> Result<(), GraphProblem> {
        let mut traversal = Traversal::new();
        for (resource, roles) in self.graph.resources.iter().zip(self.roles) {
            let mut makers: Vec<NodeIndex> = roles.makers().filter(|&maker| self.is_needed(maker)).collect();
            makers.sort_unstable_by_key(|&maker| self.position(maker));
            for pair in makers.windows(2) {
                let end = self.position(pair[1]);
                traversal.run(self.edges, &[pair[0]], Direction::Outgoing, |vertex, _| self.position(vertex) <= end);
                if !traversal.has_visited(pair[1]) {
                    return Err(GraphProblem::UnorderedWriters {
                        resource: resource.name.clone(),
                        first: name(self.graph, pair[0]),
                        second: name(self.graph, pair[1]),
                    });
                }
            }
        }
        Ok(())
    }

    /// Per node, the needed nodes it waits for; empty for a node that is not needed.
    fn dependencies(&self) -> Vec<Vec<usize>> {
        let last_makers = self.last_makers_of_junctions();
        let mut visited_for = vec![usize::MAX; self.edges.node_count()];
        let mut dependencies = vec![Vec::new(); self.needed.len()];
        for node in self.edges.node_indices().filter(|&vertex| self.is_needed(vertex)) {
            let dependencies = &mut dependencies[node.index()];
            self.add_last_makers(node, &last_makers, dependencies);
            // Explicit orders work through dropped nodes, up to the needed nodes before those.
            let mut stack = vec![node];
            while let Some(after) = stack.pop() {
                for edge in self.edges.edges_directed(after, Direction::Incoming) {
                    let before = edge.source();
                    if after == node && *edge.weight() != Relation::Order {
                        continue;
                    }
                    if self.is_needed(before) {
                        dependencies.push(before.index());
                    } else if visited_for[before.index()] != node.index() {
                        visited_for[before.index()] = node.index();
                        stack.push(before);
                    }
                }
            }
            dependencies.sort_unstable();
            dependencies.dedup();
        }
        dependencies
    }

    /// Per vertex, the last of the makers that lead to it, if it is a junction.
    fn last_makers_of_junctions(&self) -> Vec<Option<NodeIndex>> {
        let last_maker = |vertex: NodeIndex| {
            let is_junction = vertex.index() >= self.needed.len();
            let makers = self.edges.neighbors_directed(vertex, Direction::Incoming).filter(|_| is_junction);
            makers.max_by_key(|&maker| self.position(maker))
        };
        self.edges.node_indices().map(last_maker).collect()
    }

    /// A node only has to wait for the last maker of each resource it needs, because makers are ordered.
    fn add_last_makers(&self, node: NodeIndex, of_junction: &[Option<NodeIndex>], dependencies: &mut Vec<usize>) {
        let mut last: HashMap<usize, NodeIndex> = HashMap::new();
        for edge in self.edges.edges_directed(node, Direction::Incoming) {
            if let Relation::Data(resource) = *edge.weight() {
                let source = of_junction[edge.source().index()].unwrap_or(edge.source());
                let maker = last.entry(resource).or_insert(source);
                if self.position(source) > self.position(*maker) {
                    *maker = source;
                }
            }
        }
        dependencies.extend(last.into_values().map(NodeIndex::index));
    }
}
