//! The parts of a schedule that are the same for all types of payloads, in flat arrays.

use std::collections::HashMap;

use super::adjacency::{Adjacency, RankedAdjacency};
use super::declarations::{Declarations, NodeId};
use super::plan::Plan;
use crate::timeline::Labels;

/// What a schedule has beside the payloads of its nodes, by their position in it.
pub(super) struct FlatGraph {
    pub(super) names: Vec<String>,
    pub(super) labels: Vec<Labels>,
    pub(super) indices: HashMap<NodeId, usize>,
    pub(super) dependencies: Adjacency,
    pub(super) dependents: Adjacency,
    pub(super) dropped: Vec<String>,
    pub(super) adjacency: RankedAdjacency,
}

impl FlatGraph {
    pub(super) fn new(graph: Declarations, plan: &Plan) -> Self {
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
        let dropped =
            graph.nodes.iter().zip(&plan.needed).filter(|(_, needed)| !**needed).map(|(node, _)| node.name.clone());
        let mut flat = Self {
            names: Vec::with_capacity(plan.order.len()),
            labels: Vec::with_capacity(plan.order.len()),
            indices: HashMap::with_capacity(plan.order.len()),
            adjacency: RankedAdjacency::new(&dependencies),
            dependencies: Adjacency::new(dependencies),
            dependents: Adjacency::new(dependents),
            dropped: dropped.collect(),
        };
        for (index, node) in in_order(graph.nodes, &plan.order).into_iter().enumerate() {
            flat.names.push(node.name);
            flat.labels.push(node.labels);
            flat.indices.insert(node.id, index);
        }
        flat
    }
}

/// The values at these indices, in this order. The others are dropped.
pub(super) fn in_order<T>(values: Vec<T>, order: &[usize]) -> Vec<T> {
    let mut values: Vec<Option<T>> = values.into_iter().map(Some).collect();
    order.iter().filter_map(|&index| values[index].take()).collect()
}
