//! What a run needs to know of a schedule, flat: who waits for how many, who comes after whom, and how urgent they are.

/// All by the nodes' indices in the schedule, which are also an order they may run in. An index takes 32 bits: more
/// nodes, or edges between them, than that counts do not fit into memory as long as the graph is being built.
pub(crate) struct Flow {
    /// Where the dependents of each node start in `dependents`, and where the last ones end.
    starts: Box<[u32]>,
    /// The dependents of each node, those with the longest way to the end of the frame first.
    dependents: Box<[u32]>,
    dependency_counts: Box<[u32]>,
    /// Those that depend on none, in the same order.
    roots: Box<[u32]>,
    /// Whether the end of the frame waits for the node: there is hardly a longer way through the graph than through it.
    is_urgent: Box<[bool]>,
    /// Per node, nanoseconds from its start to the end of the frame, and from the start of the frame to its own, if
    /// nobody has to wait for a worker.
    to_end: Box<[u64]>,
    from_start: Box<[u64]>,
}

impl Flow {
    /// The flow of nodes, of each of which its dependencies are given, all of them before it.
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
            is_urgent: vec![false; count].into(),
            to_end: vec![0; count].into(),
            from_start: vec![0; count].into(),
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

    /// The place of the first dependent of a node in a list of those of all, in which each node has a place for each.
    pub(crate) fn first_place(&self, node: u32) -> u32 {
        self.starts[node as usize]
    }

    pub(crate) fn edges(&self) -> usize {
        self.dependents.len()
    }

    pub(crate) fn dependency_count(&self, node: u32) -> u32 {
        self.dependency_counts[node as usize]
    }

    pub(crate) fn roots(&self) -> &[u32] {
        &self.roots
    }

    pub(crate) fn is_urgent(&self, node: u32) -> bool {
        self.is_urgent[node as usize]
    }

    /// Ranks the nodes by what they cost, in nanoseconds each: by the longest way through the graph that leads through
    /// them.
    pub(crate) fn rank(&mut self, costs: &[u64]) {
        self.from_start.fill(0);
        for (node, &cost) in costs.iter().enumerate() {
            let end = self.from_start[node].saturating_add(cost);
            for place in self.starts[node]..self.starts[node + 1] {
                let dependent = self.dependents[place as usize] as usize;
                self.from_start[dependent] = self.from_start[dependent].max(end);
            }
        }
        for node in (0..self.len()).rev() {
            let dependents = self.starts[node] as usize..self.starts[node + 1] as usize;
            let rest = self.dependents[dependents].iter().map(|&dependent| self.to_end[dependent as usize]).max();
            self.to_end[node] = costs[node].saturating_add(rest.unwrap_or(0));
        }
        let longest = self.to_end.iter().copied().max().unwrap_or(0);
        // A tenth of the frame is no more than what costs vary by.
        let urgent = longest - longest / 10;
        for node in 0..self.len() {
            let way = self.from_start[node].saturating_add(self.to_end[node]);
            self.is_urgent[node] = longest > 0 && way >= urgent;
        }
        let to_end = &self.to_end;
        let longest_way_first = |node: &u32| std::cmp::Reverse(to_end[*node as usize]);
        for ends in self.starts.windows(2) {
            self.dependents[ends[0] as usize..ends[1] as usize].sort_unstable_by_key(longest_way_first);
        }
        self.roots.sort_unstable_by_key(longest_way_first);
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use proptest::prelude::*;

    use super::Flow;

    /// The longest way from the start of the node to the end, by trying all.
    fn to_end(dependencies: &[Vec<usize>], costs: &[u64], node: usize) -> u64 {
        let after = (0..costs.len()).filter(|&later| dependencies[later].contains(&node));
        costs[node] + after.map(|later| to_end(dependencies, costs, later)).max().unwrap_or(0)
    }

    fn from_start(dependencies: &[Vec<usize>], costs: &[u64], node: usize) -> u64 {
        let before = dependencies[node].iter();
        before.map(|&earlier| from_start(dependencies, costs, earlier) + costs[earlier]).max().unwrap_or(0)
    }

    proptest! {
        #[test]
        fn ranks_are_the_longest_ways(
            picks in prop::collection::vec((prop::collection::vec(any::<prop::sample::Index>(), 0..4), 0_u64..1000), 1..12),
        ) {
            let costs: Vec<u64> = picks.iter().map(|(_, cost)| *cost).collect();
            let dependencies: Vec<Vec<usize>> = picks.iter().enumerate().map(|(node, (picks, _))| {
                let mut list: Vec<usize> =
                    picks.iter().filter(|_| node > 0).map(|pick| pick.index(node)).collect();
                list.sort_unstable();
                list.dedup();
                list
            }).collect();
            let mut flow = Flow::new(&dependencies);
            flow.rank(&costs);
            let ways: Vec<u64> = (0..costs.len()).map(|node| to_end(&dependencies, &costs, node)).collect();
            let longest = *ways.iter().max().unwrap();
            for node in 0..costs.len() {
                let way = from_start(&dependencies, &costs, node) + ways[node];
                prop_assert_eq!(flow.is_urgent(node as u32), longest > 0 && way >= longest - longest / 10);
                let order: Vec<u64> =
                    flow.dependents(node as u32).iter().map(|&dependent| ways[dependent as usize]).collect();
                prop_assert!(order.is_sorted_by(|first, second| first >= second));
                let mut dependents = flow.dependents(node as u32).to_vec();
                dependents.sort_unstable();
                let expected: Vec<u32> =
                    (0..costs.len()).filter(|&later| dependencies[later].contains(&node)).map(|later| later as u32).collect();
                prop_assert_eq!(dependents, expected);
            }
            let roots: Vec<u64> = flow.roots().iter().map(|&root| ways[root as usize]).collect();
            prop_assert!(roots.is_sorted_by(|first, second| first >= second));
        }
    }
}
