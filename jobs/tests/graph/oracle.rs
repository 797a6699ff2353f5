//! Random graphs.

pub use super::graph_model::{GraphModel, Oracle, Role, check_compiled};
use proptest::collection::vec;
use proptest::prelude::*;

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
