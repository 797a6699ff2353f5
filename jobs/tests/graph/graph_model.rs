//! The rules of a graph, implemented naively with matrices, and what a compiled graph has to have in common with them.

use drawloom_jobs::graph::{FrameGraph, GraphProblem, NodeId, Schedule};

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

/// Checks what a graph was compiled to, or why it was not.
///
/// # Panics
/// If that is not what the rules say.
pub fn check_compiled<P>(model: &GraphModel, compiled: Result<&Schedule<P>, &GraphProblem>) {
    match compiled {
        Ok(schedule) => {
            assert!(!is_invalid(model));
            check_schedule(model, schedule);
        }
        Err(problem) => check_problem(model, problem),
    }
}

fn number(name: &str) -> usize {
    name[1..].parse().expect("names are a letter and a number")
}

/// Checks the kept nodes of a schedule, their order, and what they wait for.
fn check_schedule<P>(model: &GraphModel, schedule: &Schedule<P>) {
    let oracle = Oracle::new(model);
    let order: Vec<usize> = schedule.nodes().map(|(name, _)| number(name)).collect();
    assert_eq!(order, oracle.order());
    let dropped: Vec<usize> = schedule.dropped().iter().map(|name| number(name)).collect();
    let unneeded: Vec<usize> = (0..oracle.needed.len()).filter(|&node| !oracle.needed[node]).collect();
    assert_eq!(dropped, unneeded);

    let mut waits = vec![vec![false; order.len()]; order.len()];
    for (index, _) in schedule.nodes().enumerate() {
        for &dependency in schedule.dependencies(index) {
            waits[dependency][index] = true;
            assert!(schedule.dependents(dependency).contains(&index));
        }
    }
    let waits = closure(&waits);
    for before in 0..order.len() {
        for after in 0..order.len() {
            assert_eq!(waits[before][after], oracle.before[order[before]][order[after]]);
        }
    }
}

/// Checks that a graph has the problem for which it does not compile.
fn check_problem(model: &GraphModel, problem: &GraphProblem) {
    let oracle = Oracle::new(model);
    if let GraphProblem::Cycle { nodes } = problem {
        let cycle: Vec<usize> = nodes.iter().map(|name| number(name)).collect();
        assert_eq!(cycle.first(), cycle.iter().min());
        for (index, &before) in cycle.iter().enumerate() {
            let after = cycle[(index + 1) % cycle.len()];
            let is_edge =
                oracle.data.iter().any(|edges| edges[before][after]) || model.orders.contains(&(before, after));
            assert!(is_edge, "p{} is not right before p{}", before, after);
        }
        return;
    }
    assert!(!oracle.has_cycle());
    let missing = (0..model.output.len()).filter(|&resource| !model.imported[resource]).find_map(|resource| {
        let mut readers = model.with_role(resource, &[Role::Reads, Role::Modifies]);
        readers.retain(|&reader| oracle.needed[reader] && !oracle.data[resource].iter().any(|edges| edges[reader]));
        let output = model.output[resource] && model.makers(resource).is_empty();
        (output || !readers.is_empty()).then(|| GraphProblem::MissingProducer {
            resource: format!("r{resource}"),
            output,
            readers: readers.iter().map(|reader| format!("p{reader}")).collect(),
        })
    });
    if let Some(missing) = missing {
        assert_eq!(problem, &missing);
        return;
    }
    let unordered = |resource: usize, first: usize, second: usize| {
        let makers = model.makers(resource);
        first != second
            && [first, second].iter().all(|maker| makers.contains(maker) && oracle.needed[*maker])
            && !oracle.before[first][second]
            && !oracle.before[second][first]
    };
    let GraphProblem::UnorderedWriters { resource, first, second } = problem else {
        panic!("the graph is valid, but compiling it returned {problem:?}");
    };
    assert!(unordered(number(resource), number(first), number(second)));
    let nodes = 0..model.roles.len();
    let any_earlier =
        (0..number(resource)).any(|resource| nodes.clone().any(|a| nodes.clone().any(|b| unordered(resource, a, b))));
    assert!(!any_earlier, "an earlier resource has unordered writers");
}

/// Whether the graph has any problem.
fn is_invalid(model: &GraphModel) -> bool {
    let oracle = Oracle::new(model);
    let unordered = (0..model.output.len()).any(|resource| {
        let mut makers = model.makers(resource);
        makers.retain(|&maker| oracle.needed[maker]);
        makers.iter().any(|&a| makers.iter().any(|&b| a < b && !oracle.before[a][b] && !oracle.before[b][a]))
    });
    let missing = (0..model.output.len()).filter(|&resource| !model.imported[resource]).any(|resource| {
        let lacks =
            |reader: &usize| oracle.needed[*reader] && !oracle.data[resource].iter().any(|edges| edges[*reader]);
        (model.output[resource] && model.makers(resource).is_empty())
            || model.with_role(resource, &[Role::Reads, Role::Modifies]).iter().any(lacks)
    });
    oracle.has_cycle() || unordered || missing
}
