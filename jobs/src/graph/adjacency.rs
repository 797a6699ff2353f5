//! The edges of a schedule as compressed adjacency lists: one array of targets, and where each node's list starts in
//! it.

/// The lists of all nodes, one after another in one array (compressed sparse rows).
pub(super) struct Adjacency {
    /// Where each list starts, and where the last one ends.
    starts: Vec<usize>,
    targets: Vec<usize>,
}

impl Adjacency {
    pub(super) fn new<List: IntoIterator<Item = usize>>(lists: impl IntoIterator<Item = List>) -> Self {
        let mut adjacency = Self { starts: vec![0], targets: Vec::new() };
        for list in lists {
            adjacency.targets.extend(list);
            adjacency.starts.push(adjacency.targets.len());
        }
        adjacency
    }

    /// The list of the node with that index; empty if there is no such node.
    pub(super) fn of(&self, index: usize) -> &[usize] {
        match self.starts.get(index..).unwrap_or_default() {
            [start, end, ..] => &self.targets[*start..*end],
            _ => &[],
        }
    }
}

/// What a run needs to know about the edges: each node's number of dependencies, and its dependents, the most critical
/// first.
///
/// Nodes are identified by their index in the schedule, which is a topological order. An index takes 32 bits: a graph
/// with more nodes or edges than that would not have fitted into memory while it was built.
pub(crate) struct RankedAdjacency {
    /// Where each node's list starts in `dependents`, and where the last one ends.
    starts: Box<[u32]>,
    /// The dependents of each node, by descending cost to the end.
    dependents: Box<[u32]>,
    dependency_counts: Box<[u32]>,
    /// The nodes without dependencies, by descending cost to the end.
    roots: Box<[u32]>,
    /// Whether the node is on a critical path: the longest path through the node is about as long as the longest of
    /// all.
    is_critical: Box<[bool]>,
    /// Per node, the nanoseconds from its start to the end of the run, and from the start of the run to its own, if no
    /// node has to wait for a worker: the bottom level and the top level of list scheduling.
    cost_to_end: Box<[u64]>,
    cost_from_start: Box<[u64]>,
}

impl RankedAdjacency {
    /// The edges of the graph in which each node has these dependencies, all of them with a lower index.
    pub(crate) fn new(dependencies: &[Vec<usize>]) -> Self {
        let count = dependencies.len();
        let mut dependents = vec![Vec::new(); count];
        for (node, list) in dependencies.iter().enumerate() {
            for &dependency in list {
                dependents[dependency].push(node as u32);
            }
        }
        let mut starts = vec![0];
        starts.extend(dependents.iter().scan(0, |end, list| {
            *end += list.len() as u32;
            Some(*end)
        }));
        Self {
            starts: starts.into(),
            dependents: dependents.concat().into(),
            dependency_counts: dependencies.iter().map(|list| list.len() as u32).collect(),
            roots: (0..count as u32).filter(|&node| dependencies[node as usize].is_empty()).collect(),
            is_critical: vec![false; count].into(),
            cost_to_end: vec![0; count].into(),
            cost_from_start: vec![0; count].into(),
        }
    }

    /// How many nodes there are.
    pub(crate) fn len(&self) -> usize {
        self.dependency_counts.len()
    }

    pub(crate) fn dependents(&self, node: u32) -> &[u32] {
        let node = node as usize;
        &self.dependents[self.starts[node] as usize..self.starts[node + 1] as usize]
    }

    /// The index of the node's first dependent in the array of all dependents.
    pub(crate) fn dependents_start(&self, node: u32) -> u32 {
        self.starts[node as usize]
    }

    pub(crate) fn edge_count(&self) -> usize {
        self.dependents.len()
    }

    pub(crate) fn dependency_count(&self, node: u32) -> u32 {
        self.dependency_counts[node as usize]
    }

    pub(crate) fn roots(&self) -> &[u32] {
        &self.roots
    }

    pub(crate) fn is_critical(&self, node: u32) -> bool {
        self.is_critical[node as usize]
    }

    /// Computes each node's cost from the start and to the end, and sorts dependents and roots by cost to the end.
    /// `cost_of` returns the nanoseconds of a node.
    pub(crate) fn rank(&mut self, cost_of: &dyn Fn(usize) -> u64) {
        self.cost_from_start.fill(0);
        for node in 0..self.len() {
            let end = self.cost_from_start[node].saturating_add(cost_of(node));
            for edge in self.starts[node]..self.starts[node + 1] {
                let dependent = self.dependents[edge as usize] as usize;
                self.cost_from_start[dependent] = self.cost_from_start[dependent].max(end);
            }
        }
        for node in (0..self.len()).rev() {
            let dependents = self.starts[node] as usize..self.starts[node + 1] as usize;
            let rest = self.dependents[dependents].iter().map(|&dependent| self.cost_to_end[dependent as usize]).max();
            self.cost_to_end[node] = cost_of(node).saturating_add(rest.unwrap_or(0));
        }
        let longest = self.cost_to_end.iter().copied().max().unwrap_or(0);
        // A tenth of the frame is within the variation of measured costs.
        let threshold = longest - longest / 10;
        for node in 0..self.len() {
            let path = self.cost_from_start[node].saturating_add(self.cost_to_end[node]);
            self.is_critical[node] = longest > 0 && path >= threshold;
        }
        let cost_to_end = &self.cost_to_end;
        let longest_first = |node: &u32| std::cmp::Reverse(cost_to_end[*node as usize]);
        for ends in self.starts.windows(2) {
            self.dependents[ends[0] as usize..ends[1] as usize].sort_unstable_by_key(longest_first);
        }
        self.roots.sort_unstable_by_key(longest_first);
    }
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use std::iter;

    use fastrand::Rng;

    use super::RankedAdjacency;

    const GRAPH_COUNT: usize = if cfg!(miri) { 8 } else { 1_024 };

    /// A graph of one to eleven nodes: the dependencies of each node, at most three, and its cost.
    fn random_graph(random: &mut Rng) -> (Vec<Vec<usize>>, Vec<u64>) {
        let count = random.usize(1..12);
        let dependencies = (0..count).map(|node| {
            let picks = if node == 0 { 0 } else { random.usize(0..4) };
            let mut list: Vec<usize> = iter::repeat_with(|| random.usize(..node)).take(picks).collect();
            list.sort_unstable();
            list.dedup();
            list
        });
        let dependencies = dependencies.collect();
        // Some graphs cost nothing, and in some many paths are as long as each other.
        let cost_limit = [1, 3, 1_000][random.usize(..3)];
        (dependencies, iter::repeat_with(|| random.u64(..cost_limit)).take(count).collect())
    }

    /// The length of the longest path from the node to the end, by trying all paths.
    fn cost_to_end(dependencies: &[Vec<usize>], costs: &[u64], node: usize) -> u64 {
        let after = (0..costs.len()).filter(|&later| dependencies[later].contains(&node));
        costs[node] + after.map(|later| cost_to_end(dependencies, costs, later)).max().unwrap_or(0)
    }

    fn cost_from_start(dependencies: &[Vec<usize>], costs: &[u64], node: usize) -> u64 {
        let before = dependencies[node].iter();
        before.map(|&earlier| cost_from_start(dependencies, costs, earlier) + costs[earlier]).max().unwrap_or(0)
    }

    #[test]
    fn dependents_are_sorted_by_cost_to_the_end_and_the_longest_paths_are_critical() {
        let mut random = Rng::with_seed(9);
        for graph in 0..GRAPH_COUNT {
            let (dependencies, costs) = random_graph(&mut random);
            let mut adjacency = RankedAdjacency::new(&dependencies);
            adjacency.rank(&|node| costs[node]);

            let paths: Vec<u64> = (0..costs.len()).map(|node| cost_to_end(&dependencies, &costs, node)).collect();
            let longest = *paths.iter().max().unwrap();
            for node in 0..costs.len() {
                let context = format!("graph {graph}, node {node} of {dependencies:?} with costs {costs:?}");
                let path = cost_from_start(&dependencies, &costs, node) + paths[node];
                let is_critical = longest > 0 && path >= longest - longest / 10;
                assert_eq!(adjacency.is_critical(node as u32), is_critical, "{context}");

                let mut dependents = adjacency.dependents(node as u32).to_vec();
                assert!(
                    dependents.is_sorted_by(|first, second| paths[*first as usize] >= paths[*second as usize]),
                    "{context}"
                );
                dependents.sort_unstable();
                let expected: Vec<u32> = (0..costs.len())
                    .filter(|&later| dependencies[later].contains(&node))
                    .map(|later| later as u32)
                    .collect();
                assert_eq!(dependents, expected, "{context}");
            }
            let roots = adjacency.roots();
            assert!(
                roots.is_sorted_by(|first, second| paths[*first as usize] >= paths[*second as usize]),
                "graph {graph}, {dependencies:?} with costs {costs:?}"
            );
        }
    }
}
