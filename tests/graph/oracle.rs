//! What the rules say of a graph, worked out the slow way: matrices of who comes before whom.

use drawloom::graph::{FrameGraph, NodeId};
use proptest::{collection::vec, prelude::*};

/// Who comes before whom: `[before][after]`.
pub type Relation = Vec<Vec<bool>>;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    Writes,
    Modifies,
    Reads,
}

/// A graph as plain data. Nodes are named `p0`, `p1`, and so on, resources `r0`, `r1`.
#[derive(Clone, Debug)]
pub struct Sketch {
    /// Per node and resource.
    pub roles: Vec<Vec<Option<Role>>>,
    pub orders: Vec<(usize, usize)>,
    pub kept: Vec<bool>,
    pub imported: Vec<bool>,
    pub output: Vec<bool>,
}

/// Anything goes: most of these have something wrong with them.
pub fn any_sketch() -> impl Strategy<Value = Sketch> {
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
            .prop_map(|(roles, orders, kept, imported, output)| Sketch {
                roles,
                // Mostly forwards, or there would be little but cycles.
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

/// Nothing is wrong with these: edges go from low to high, all makers of a resource are ordered, all is imported.
pub fn sound_sketch() -> impl Strategy<Value = Sketch> {
    (1..24usize, 1..8usize).prop_flat_map(|(nodes, resources)| {
        (
            vec(vec(prop::bool::weighted(0.25), resources), nodes),
            vec((0..=nodes, 0..=nodes), resources),
            vec((0..nodes, 0..nodes), 0..nodes),
            vec(prop::bool::weighted(0.1), nodes),
            vec(prop::bool::weighted(0.3), resources),
        )
            .prop_map(|(touches, splits, orders, kept, output)| {
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
                let roles: Vec<Vec<_>> = (0..touches.len())
                    .map(|node| {
                        (0..output.len())
                            .map(|resource| touches[node][resource].then(|| role(node, resource)))
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
                Sketch { kept, imported: vec![true; output.len()], output, roles, orders }
            })
    })
}

impl Sketch {
    /// The graph of it, with a payload for each node.
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

/// All that follows from a sketch.
pub struct Oracle {
    /// Needs what the other makes of the resource: `[resource][before][after]`.
    pub data: Vec<Relation>,
    /// Comes before, through any number of others.
    pub before: Relation,
    pub needed: Vec<bool>,
}

impl Oracle {
    pub fn new(sketch: &Sketch) -> Self {
        let count = sketch.roles.len();
        let mut order = vec![vec![false; count]; count];
        for &(before, after) in &sketch.orders {
            order[before][after] = true;
        }
        let ordered = closure(&order);
        let mut all = order;
        let mut data = Vec::new();
        for resource in 0..sketch.output.len() {
            let mut edges = vec![vec![false; count]; count];
            for writer in sketch.with_role(resource, &[Role::Writes]) {
                for modifier in sketch.with_role(resource, &[Role::Modifies]) {
                    edges[writer][modifier] = !ordered[modifier][writer];
                }
            }
            let told = closure(&union(&ordered, &edges));
            for maker in sketch.makers(resource) {
                for reader in sketch.with_role(resource, &[Role::Reads]) {
                    edges[maker][reader] = !told[reader][maker];
                }
            }
            all = union(&all, &edges);
            data.push(edges);
        }
        let before = closure(&all);
        for (resource, edges) in data.iter_mut().enumerate() {
            let makers = sketch.makers(resource);
            for modifier in sketch.with_role(resource, &[Role::Modifies]) {
                for &maker in &makers {
                    // The last maker before it: none stands between the two.
                    let between = |&other: &usize| {
                        other != maker && other != modifier && before[maker][other] && before[other][modifier]
                    };
                    if maker != modifier && before[maker][modifier] && !makers.iter().any(between) {
                        edges[maker][modifier] = true;
                    }
                }
            }
        }
        let mut needed = sketch.kept.clone();
        for resource in (0..sketch.output.len()).filter(|&resource| sketch.output[resource]) {
            sketch.makers(resource).into_iter().for_each(|maker| needed[maker] = true);
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

    /// The needed nodes: always the first of those that nothing left out comes before.
    pub fn order(&self) -> Vec<usize> {
        let mut left: Vec<usize> = (0..self.needed.len()).filter(|&node| self.needed[node]).collect();
        let mut order = Vec::new();
        while !left.is_empty() {
            let is_next = |&node: &usize| left.iter().all(|&other| !self.before[other][node]);
            let at = left.iter().position(is_next).expect("there is no cycle");
            order.push(left.remove(at));
        }
        order
    }
}

fn union(one: &Relation, other: &Relation) -> Relation {
    let row = |(one, other): (&Vec<bool>, &Vec<bool>)| one.iter().zip(other).map(|(one, other)| one | other).collect();
    one.iter().zip(other).map(row).collect()
}

/// Through any number of others (Warshall).
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
