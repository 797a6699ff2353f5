//! From a graph to its schedule: order it, see what is needed, check that, and lay it out flat.

use std::collections::{HashMap, HashSet};

use petgraph::{
    Direction,
    graph::{DiGraph, NodeIndex},
    visit::EdgeRef,
};

use super::{
    builder::FrameGraph,
    costs::Costs,
    edges::{self, Edges, Relation, Roles},
    error::{CompileError, GraphProblem},
    flow::Flow,
    order::{Walk, circle, in_order, places},
    progress::Progress,
    schedule::{Adjacency, Schedule},
    sharing::Sharing,
};

impl<P> FrameGraph<P> {
    /// Orders the nodes, drops those that lead to no output, and checks the rest.
    ///
    /// # Errors
    ///
    /// [`CompileError`], with the graph and the first [`GraphProblem`] in the order its variants are declared in. Names and
    /// cycles are looked at in the whole graph; a missing producer and writers without an order only matter where
    /// the nodes they belong to are kept.
    pub fn compile(mut self) -> Result<Schedule<P>, CompileError<P>> {
        match plan(&mut self) {
            Ok(plan) => Ok(lay_out(self, &plan)),
            Err(problem) => Err(CompileError { graph: Box::new(self), problem }),
        }
    }
}

/// What a graph compiles to, before it is laid out: all by positions in the graph.
struct Plan {
    needed: Vec<bool>,
    /// The needed nodes in the order they run in.
    order: Vec<usize>,
    /// Per node, the needed nodes it waits for.
    dependencies: Vec<Vec<usize>>,
}

fn plan<P>(graph: &mut FrameGraph<P>) -> Result<Plan, GraphProblem> {
    if let Some(misuse) = graph.misuses.pop_front() {
        return Err(misuse);
    }
    let graph = &*graph;
    check_names(graph)?;
    let roles = Roles::of_all(graph);
    let mut edges = edges::derive(graph, &roles);
    let order = in_order(&edges, graph.nodes.len());
    if order.len() < edges.node_count() {
        let circle = circle(&edges, graph.nodes.len(), &order);
        let nodes = circle.into_iter().map(|node| name(graph, node)).collect();
        return Err(GraphProblem::Cycle { nodes });
    }
    let place = places(order.len(), &order);
    edges::add_versions(&mut edges, &roles, &place);
    let needed = edges::needed(graph, &roles, &edges);
    let facts = Facts { graph, roles: &roles, edges: &edges, needed: &needed, place: &place };
    facts.check_producers()?;
    facts.check_writers()?;
    let dependencies = facts.dependencies();

    // Ordered anew, so that what was dropped has no say in how ties are broken.
    let mut remaining = DiGraph::<(), ()>::with_capacity(needed.len(), 0);
    for _ in &needed {
        remaining.add_node(());
    }
    for (node, dependencies) in dependencies.iter().enumerate() {
        for &dependency in dependencies {
            remaining.add_edge(NodeIndex::new(dependency), NodeIndex::new(node), ());
        }
    }
    let order =
        in_order(&remaining, needed.len()).into_iter().map(NodeIndex::index).filter(|&node| needed[node]).collect();
    Ok(Plan { needed, order, dependencies })
}

fn name<P>(graph: &FrameGraph<P>, node: NodeIndex) -> String {
    graph.nodes[node.index()].name.clone()
}

fn check_names<P>(graph: &FrameGraph<P>) -> Result<(), GraphProblem> {
    let mut names = HashSet::new();
    match graph.nodes.iter().find(|node| !names.insert(node.name.as_str())) {
        Some(node) => Err(GraphProblem::DuplicateNode { name: node.name.clone() }),
        None => Ok(()),
    }
}

/// What is known of a graph that can be put in order.
struct Facts<'a, P> {
    graph: &'a FrameGraph<P>,
    roles: &'a [Roles],
    edges: &'a Edges,
    needed: &'a [bool],
    /// Per node, its place in the order of all, dropped ones included.
    place: &'a [usize],
}

impl<P> Facts<'_, P> {
    /// Whether it is a node that is needed. A junction is none.
    fn is_needed(&self, node: NodeIndex) -> bool {
        self.needed.get(node.index()).is_some_and(|&needed| needed)
    }

    fn place(&self, node: NodeIndex) -> usize {
        self.place[node.index()]
    }

    fn check_producers(&self) -> Result<(), GraphProblem> {
        for (index, (resource, roles)) in self.graph.resources.iter().zip(self.roles).enumerate() {
            if resource.imported {
                continue;
            }
            let has_producer = |node: NodeIndex| {
                let mut incoming = self.edges.edges_directed(node, Direction::Incoming);
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

    /// All makers of a resource have an order if each, in the order of all nodes, leads to the next.
    fn check_writers(&self) -> Result<(), GraphProblem> {
        let mut walk = Walk::new();
        for (resource, roles) in self.graph.resources.iter().zip(self.roles) {
            let mut makers: Vec<NodeIndex> = roles.makers().filter(|&maker| self.is_needed(maker)).collect();
            makers.sort_unstable_by_key(|&maker| self.place(maker));
            for pair in makers.windows(2) {
                let end = self.place(pair[1]);
                walk.from(self.edges, &[pair[0]], Direction::Outgoing, |node, _| self.place(node) <= end);
                if !walk.has_met(pair[1]) {
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

    /// Per node, the needed ones it waits for, if it is needed itself.
    fn dependencies(&self) -> Vec<Vec<usize>> {
        let last_maker = self.last_makers_of_junctions();
        let mut passed = vec![usize::MAX; self.edges.node_count()];
        let mut dependencies = vec![Vec::new(); self.needed.len()];
        for node in self.edges.node_indices().filter(|&node| self.is_needed(node)) {
            let dependencies = &mut dependencies[node.index()];
            self.add_last_makers(node, &last_maker, dependencies);
            // An order that leads through dropped nodes ends at the needed ones before them.
            let mut open = vec![node];
            while let Some(after) = open.pop() {
                for edge in self.edges.edges_directed(after, Direction::Incoming) {
                    let before = edge.source();
                    if after == node && *edge.weight() != Relation::Order {
                        continue;
                    }
                    if self.is_needed(before) {
                        dependencies.push(before.index());
                    } else if passed[before.index()] != node.index() {
                        passed[before.index()] = node.index();
                        open.push(before);
                    }
                }
            }
            dependencies.sort_unstable();
            dependencies.dedup();
        }
        dependencies
    }

    /// Per node, the last of the makers that lead to it, if it is a junction.
    fn last_makers_of_junctions(&self) -> Vec<Option<NodeIndex>> {
        let last_maker = |node: NodeIndex| {
            let is_junction = node.index() >= self.needed.len();
            let makers = self.edges.neighbors_directed(node, Direction::Incoming).filter(|_| is_junction);
            makers.max_by_key(|&maker| self.place(maker))
        };
        self.edges.node_indices().map(last_maker).collect()
    }

    /// Of all makers of a resource that a node needs, it has to wait for the last one only, since they have an order.
    fn add_last_makers(&self, node: NodeIndex, of_junction: &[Option<NodeIndex>], dependencies: &mut Vec<usize>) {
        let mut last: HashMap<usize, NodeIndex> = HashMap::new();
        for edge in self.edges.edges_directed(node, Direction::Incoming) {
            if let Relation::Data(resource) = *edge.weight() {
                let source = of_junction[edge.source().index()].unwrap_or(edge.source());
                let maker = last.entry(resource).or_insert(source);
                if self.place(source) > self.place(*maker) {
                    *maker = source;
                }
            }
        }
        dependencies.extend(last.into_values().map(NodeIndex::index));
    }
}

fn lay_out<P>(graph: FrameGraph<P>, plan: &Plan) -> Schedule<P> {
    let mut index_of = vec![0; plan.needed.len()];
    for (index, &node) in plan.order.iter().enumerate() {
        index_of[node] = index;
    }
    let mut dependencies = vec![Vec::new(); plan.order.len()];
    let mut dependents = vec![Vec::new(); plan.order.len()];
    for (index, &node) in plan.order.iter().enumerate() {
        dependencies[index] = plan.dependencies[node].iter().map(|&dependency| index_of[dependency]).collect();
        dependencies[index].sort_unstable();
        for &dependency in &dependencies[index] {
            dependents[dependency].push(index);
        }
    }
    let mut dropped = Vec::new();
    let mut kept = Vec::with_capacity(plan.order.len());
    for (position, node) in graph.nodes.into_iter().enumerate() {
        if plan.needed[position] {
            kept.push((index_of[position], node));
        } else {
            dropped.push(node.name);
        }
    }
    kept.sort_unstable_by_key(|(index, _)| *index);
    let flow = Flow::new(&dependencies);
    let mut schedule = Schedule {
        names: Vec::with_capacity(kept.len()),
        labels: Vec::with_capacity(kept.len()),
        nodes: Vec::with_capacity(kept.len()),
        indices: HashMap::with_capacity(kept.len()),
        progress: Progress::new(&flow),
        costs: Costs::new(flow.len()),
        sharing: Sharing::default(),
        graph: None,
        always_parallel: false,
        flow,
        dependencies: Adjacency::new(dependencies),
        dependents: Adjacency::new(dependents),
        dropped,
    };
    for (index, node) in kept {
        schedule.names.push(node.name);
        schedule.labels.push(node.labels);
        schedule.nodes.push(node.payload);
        schedule.indices.insert(node.id, index);
    }
    schedule
}
