//! The rules of a graph, implemented naively with matrices.

use drawloom::graph::{FrameGraph, NodeId};
use proptest::collection::vec;
use proptest::prelude::*;

/// A relation of nodes as a matrix: `[before][after]`.
pub type Relation = Vec<Vec<bool>>;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    Writes,
    Modifies,
    Reads,
}

/// A graph as plain data. Nodes are named `p0`, `p1`, and so on, resources `r0`, `r1`.
#[derive(Clone, Debug)]
pub struct GraphModel {
    /// Per node and resource.
    pub roles: Vec<Vec<Option<Role>>>,
    pub orders: Vec<(usize, usize)>,
    pub kept: Vec<bool>,
    pub imported: Vec<bool>,
    pub output: Vec<bool>,
}

/// Any graph. Most of them are invalid.
pub fn any_graph() -> impl Strategy<Value = GraphModel> {
    let role = prop_oneof![
        6 => Just(None),
        2 => Just(Some(Role::Writes)),
        1 => Just(Some(Role::Modifies)),
        2 => Just(Some(Role::Reads)),
    ];
    (1..7usize, 1..4usize).prop_flat_map(move |(nodes, resources)| {
        (
            vec(vec(role.clone(), resources), nodes),
            vec((0..nodes, 0..nodes), 0..=nodes),
            vec(prop::bool::weighted(0.2), nodes),
            vec(prop::bool::weighted(0.7), resources),
            vec(prop::bool::weighted(0.5), resources),
        )
            .prop_map(|(roles, orders, kept, imported, output)| GraphModel {
                roles,
                // Mostly from low to high, because random orders would nearly always form a cycle.
                orders: orders
                    .into_iter()
                    .map(|(a, b)| if (a + b) % 7 == 0 { (a, b) } else { (a.min(b), a.max(b)) })
                    .filter(|(a, b)| a != b || a % 5 == 4)
                    .collect(),
                kept,
                imported,
                output,
            })
    })
}

/// A valid graph: edges go from low to high, the makers of each resource are ordered, and all resources are imported.
pub fn valid_graph() -> impl Strategy<Value = GraphModel> {
    (1..24usize, 1..8usize).prop_flat_map(|(nodes, resources)| {
        (
            vec(vec(prop::bool::weighted(0.25), resources), nodes),
            vec((0..=nodes, 0..=nodes), resources),
            vec((0..nodes, 0..nodes), 0..nodes),
            vec(prop::bool::weighted(0.1), nodes),
            vec(prop::bool::weighted(0.3), resources),
        )
            .prop_map(|(accesses, splits, orders, kept, output)| {
                let role = |node: usize, resource: usize| {
                    let (a, b) = splits[resource];
                    if node < a.min(b) {
                        Role::Writes
                    } else if node < a.max(b) {
                        Role::Modifies
                    } else {
                        Role::Reads
                    }
                };
                let roles: Vec<Vec<_>> = (0..accesses.len())
                    .map(|node| {
                        (0..output.len())
                            .map(|resource| accesses[node][resource].then(|| role(node, resource)))
                            .collect()
                    })
                    .collect();
                let mut orders: Vec<_> =
                    orders.into_iter().filter(|(a, b)| a != b).map(|(a, b)| (a.min(b), a.max(b))).collect();
                for resource in 0..output.len() {
                    let makers: Vec<usize> = (0..roles.len())
                        .filter(|&node| matches!(roles[node][resource], Some(Role::Writes | Role::Modifies)))
                        .collect();
                    orders.extend(makers.windows(2).map(|pair| (pair[0], pair[1])));
                }
                GraphModel { kept, imported: vec![true; output.len()], output, roles, orders }
            })
    })
}

impl GraphModel {
    /// Builds the graph with a payload for each node.
    pub fn graph<P>(&self, mut payload: impl FnMut(usize) -> P) -> FrameGraph<P> {
        let mut graph = FrameGraph::new();
        let resources: Vec<_> = (0..self.output.len()).map(|index| graph.resource(format!("r{index}"))).collect();
        let nodes: Vec<NodeId> =
            (0..self.roles.len()).map(|index| graph.add(format!("p{index}"), payload(index))).collect();
        for (index, &resource) in resources.iter().enumerate() {
            if self.imported[index] {
                graph.import(resource);
            }
            if self.output[index] {
                graph.output(resource);
            }
            for (&node, roles) in nodes.iter().zip(&self.roles) {
                if matches!(roles[index], Some(Role::Reads | Role::Modifies)) {
                    graph.read(node, resource);
                }
                if matches!(roles[index], Some(Role::Writes | Role::Modifies)) {
                    graph.write(node, resource);
                }
            }
        }
        for &(before, after) in &self.orders {
            graph.order(nodes[before], nodes[after]);
        }
        for (&node, _) in nodes.iter().zip(&self.kept).filter(|(_, kept)| **kept) {
            graph.keep(node);
        }
        graph
    }

    pub fn with_role(&self, resource: usize, wanted: &[Role]) -> Vec<usize> {
        (0..self.roles.len())
            .filter(|&node| self.roles[node][resource].is_some_and(|role| wanted.contains(&role)))
            .collect()
    }

    pub fn makers(&self, resource: usize) -> Vec<usize> {
        self.with_role(resource, &[Role::Writes, Role::Modifies])
    }
}

/// What the rules of `FrameGraph` imply for a graph, by nodes and resources.
pub struct Oracle {
    /// Whether a node depends on another one's write to a resource: `[resource][before][after]`.
    pub data: Vec<Relation>,
    /// Whether a node comes before another, directly or through others.
    pub before: Relation,
    pub needed: Vec<bool>,
}

impl Oracle {
    pub fn new(model: &GraphModel) -> Self {
        let count = model.roles.len();
        let mut order = vec![vec![false; count]; count];
        for &(before, after) in &model.orders {
            order[before][after] = true;
        }
        let ordered = closure(&order);
        let mut all = order;
        let mut data = Vec::new();
        for resource in 0..model.output.len() {
            let mut edges = vec![vec![false; count]; count];
            for writer in model.with_role(resource, &[Role::Writes]) {
                for modifier in model.with_role(resource, &[Role::Modifies]) {
                    edges[writer][modifier] = !ordered[modifier][writer];
                }
            }
            let before = closure(&union(&ordered, &edges));
            for maker in model.makers(resource) {
                for reader in model.with_role(resource, &[Role::Reads]) {
                    edges[maker][reader] = !before[reader][maker];
                }
            }
            all = union(&all, &edges);
            data.push(edges);
        }
        let before = closure(&all);
        for (resource, edges) in data.iter_mut().enumerate() {
            let makers = model.makers(resource);
            for modifier in model.with_role(resource, &[Role::Modifies]) {
                for &maker in &makers {
                    // The last maker before the modifier: there is no maker between the two.
                    let between = |&other: &usize| {
                        other != maker && other != modifier && before[maker][other] && before[other][modifier]
                    };
                    if maker != modifier && before[maker][modifier] && !makers.iter().any(between) {
                        edges[maker][modifier] = true;
                    }
                }
            }
        }
        let mut needed = model.kept.clone();
        for resource in (0..model.output.len()).filter(|&resource| model.output[resource]) {
            model.makers(resource).into_iter().for_each(|maker| needed[maker] = true);
        }
        for _ in 0..count {
            for node in 0..count {
                let is_source = |edges: &Relation| (0..count).any(|after| needed[after] && edges[node][after]);
                needed[node] |= data.iter().any(is_source);
            }
        }
        Self { data, before, needed }
    }

    pub fn has_cycle(&self) -> bool {
        (0..self.needed.len()).any(|node| self.before[node][node])
    }

    /// The needed nodes in execution order: of the nodes that no remaining node comes before, the lowest is next.
    pub fn order(&self) -> Vec<usize> {
        let mut remaining: Vec<usize> = (0..self.needed.len()).filter(|&node| self.needed[node]).collect();
        let mut order = Vec::new();
        while !remaining.is_empty() {
            let is_next = |&node: &usize| remaining.iter().all(|&other| !self.before[other][node]);
            let index = remaining.iter().position(is_next).expect("there is no cycle");
            order.push(remaining.remove(index));
        }
        order
    }
}

fn union(one: &Relation, other: &Relation) -> Relation {
    let row = |(one, other): (&Vec<bool>, &Vec<bool>)| one.iter().zip(other).map(|(one, other)| one | other).collect();
    one.iter().zip(other).map(row).collect()
}

/// The transitive closure (Warshall).
pub fn closure(relation: &Relation) -> Relation {
    let mut closed = relation.clone();
    for middle in 0..closed.len() {
        for before in 0..closed.len() {
            for after in 0..closed.len() {
                closed[before][after] |= closed[before][middle] && closed[middle][after];
            }
        }
    }
    closed
}
