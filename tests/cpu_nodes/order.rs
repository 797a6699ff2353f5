//! Nodes run in the order that their declarations imply. The oracle compares every pair.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicUsize, Ordering};

use drawloom::graph::GraphProblem;
use drawloom::timeline::{Log, NodeInfo};
use drawloom::{FrameData, FrameError, FrameInputs, NodeAccesses, NodeContext, NodeResource};
use drawloom_testing::scenes::field;
use proptest::prelude::*;

use crate::{TestNode, lent, renderer};

const NAMES: [&str; 6] = ["animate", "simulate", "mix", "trace", "grow", "count"];
const OWN: [&str; 3] = ["bones", "heights", "samples"];

/// What a node declares.
#[derive(Clone, Debug)]
struct Declared {
    reads: BTreeSet<usize>,
    writes: BTreeSet<usize>,
    /// A node of a lower index.
    after: Option<usize>,
    width: usize,
}

/// The resources of the oracle: those of `OWN`, and parts of the frame.
fn resource(index: usize) -> NodeResource {
    let parts = [
        FrameData::Transforms,
        FrameData::PassInputs,
        FrameData::VisibleObjects,
        FrameData::DrawLists,
        FrameData::RecordedPasses,
    ];
    OWN.get(index).map_or_else(|| parts[index - OWN.len()].into(), |&name| name.into())
}

const TRANSFORMS: usize = OWN.len();
const PASS_INPUTS: usize = OWN.len() + 1;
/// From here on only stages write.
const VISIBLE: usize = OWN.len() + 2;
const RECORDED: usize = OWN.len() + 4;

fn declared() -> impl Strategy<Value = Vec<Declared>> {
    let resources = prop::collection::btree_set(0..=RECORDED, 0..3);
    let writes = prop::collection::btree_set(0..VISIBLE, 0..2);
    let node = (resources, writes, prop::option::of(0..NAMES.len()), 0..4_usize);
    prop::collection::vec(node, 0..NAMES.len()).prop_map(|nodes| {
        let node = |(index, (reads, writes, after, width)): (usize, (_, _, Option<usize>, _))| Declared {
            reads,
            writes,
            after: after.filter(|after| *after < index),
            width,
        };
        nodes.into_iter().enumerate().map(node).collect()
    })
}

/// Which nodes come before which, by index, and before which moments of the frame, whose indices follow: its objects
/// are read, what is visible and drawn is known, recording begins, and all passes are recorded.
fn required_order(nodes: &[Declared]) -> Vec<Vec<bool>> {
    let [objects, lists, inputs, recorded] = [0, 1, 2, 3].map(|moment| nodes.len() + moment);
    let count = nodes.len() + 4;
    let mut before = vec![vec![false; count]; count];
    for moment in [[objects, lists], [lists, inputs], [inputs, recorded]] {
        before[moment[0]][moment[1]] = true;
    }
    for (index, node) in nodes.iter().enumerate() {
        if let Some(after) = node.after {
            before[after][index] = true;
        }
        before[index][objects] |= node.writes.contains(&TRANSFORMS);
        before[index][inputs] |= node.writes.contains(&PASS_INPUTS);
        before[lists][index] |= (VISIBLE..RECORDED).any(|resource| node.reads.contains(&resource));
        before[recorded][index] |= node.reads.contains(&RECORDED);
        for (other_index, other) in nodes.iter().enumerate().filter(|(other, _)| *other != index) {
            for resource in 0..VISIBLE {
                let rank = |node: &Declared| match (node.reads.contains(&resource), node.writes.contains(&resource)) {
                    (false, true) => Some(0),
                    (true, true) => Some(1),
                    (true, false) => Some(2),
                    (false, false) => None,
                };
                if let (Some(one), Some(other)) = (rank(node), rank(other)) {
                    before[index][other_index] |= one < other;
                }
            }
        }
    }
    for middle in 0..count {
        for from in 0..count {
            for to in 0..count {
                before[from][to] |= before[from][middle] && before[middle][to];
            }
        }
    }
    before
}

fn check(nodes: &[Declared], workers: usize) -> Result<(), TestCaseError> {
    let clock = AtomicUsize::new(0);
    // First and last tick of each node.
    let times: Vec<_> = nodes.iter().map(|_| [AtomicUsize::new(usize::MAX), AtomicUsize::new(0)]).collect();
    let make = |(index, node): (usize, &Declared)| {
        let (clock, times, declared) = (&clock, &times[index], node.clone());
        let declare = move |accesses: &mut NodeAccesses| {
            for resource_index in declared.reads.union(&declared.writes) {
                let resource = resource(*resource_index);
                match (declared.reads.contains(resource_index), declared.writes.contains(resource_index)) {
                    (true, true) => accesses.modifies(resource),
                    (true, false) => accesses.reads(resource),
                    (false, _) => accesses.writes(resource),
                };
            }
            if let Some(after) = declared.after {
                accesses.after(NAMES[after]);
            }
        };
        let body = move |_: &NodeContext<'_>, _| {
            times[0].fetch_min(clock.fetch_add(1, Ordering::SeqCst), Ordering::SeqCst);
            times[1].fetch_max(clock.fetch_add(1, Ordering::SeqCst), Ordering::SeqCst);
            Ok(())
        };
        TestNode::new(NAMES[index], declare, body).with_width(node.width)
    };
    let lent_nodes: Vec<_> = nodes.iter().enumerate().map(make).collect();
    let (mut renderer, _submitter) = renderer(workers);
    renderer.scheduler().timeline().start();
    let scene = field(300);
    let before = required_order(nodes);
    let outcome = renderer
        .record_with(FrameInputs { nodes: &lent(&lent_nodes), ..FrameInputs::new(scene.as_scene_ref()) })
        .map(drop);
    let log = renderer.scheduler().timeline().take();

    let is_circular = (0..before.len()).any(|node| before[node][node]);
    let role = |node: &Declared, resource| (node.reads.contains(&resource), node.writes.contains(&resource));
    let unwritten = (0..OWN.len()).any(|resource| {
        nodes.iter().any(|node| role(node, resource).0)
            && !nodes.iter().any(|node| role(node, resource) == (false, true))
    });
    let unordered = (0..nodes.len()).any(|one| {
        (0..one).any(|other| {
            let both_write = |resource| {
                let roles = [one, other].map(|node| role(&nodes[node], resource));
                roles[0] == roles[1] && roles[0].1
            };
            (0..VISIBLE).any(both_write) && !before[one][other] && !before[other][one]
        })
    });
    match outcome {
        Err(FrameError::Nodes(GraphProblem::Cycle { .. })) => prop_assert!(is_circular, "{:?}", nodes),
        Err(FrameError::Nodes(GraphProblem::MissingProducer { .. })) => {
            prop_assert!(unwritten || is_circular, "{:?}", nodes)
        }
        Err(FrameError::Nodes(GraphProblem::UnorderedWriters { .. })) => {
            prop_assert!(unordered || is_circular, "{:?}", nodes)
        }
        Err(other) => prop_assert!(false, "{:?}: {}", nodes, other),
        Ok(()) => {
            // What is put before its writer sees the version before, so such a circle is none.
            if !is_circular {
                prop_assert!(!unwritten && !unordered, "{:?}", nodes);
                check_times(nodes, &before, &times)?;
            }
            check_stages(nodes, &log)?;
            let ran = |node: usize| times[node][1].load(Ordering::SeqCst) > 0;
            for (index, node) in nodes.iter().enumerate() {
                prop_assert_eq!(ran(index), node.width > 0);
                if let Some(after) = node.after.filter(|after| ran(index) && ran(*after)) {
                    prop_assert!(times[after][1].load(Ordering::SeqCst) < times[index][0].load(Ordering::SeqCst));
                }
            }
        }
    }
    Ok(())
}

fn check_times(nodes: &[Declared], before: &[Vec<bool>], times: &[[AtomicUsize; 2]]) -> Result<(), TestCaseError> {
    let time = |node: usize, end: usize| times[node][end].load(Ordering::SeqCst);
    for one in 0..nodes.len() {
        for other in (0..nodes.len()).filter(|other| before[one][*other]) {
            prop_assert!(
                nodes[one].width == 0 || nodes[other].width == 0 || time(one, 1) < time(other, 0),
                "{} before {} in {:?}",
                one,
                other,
                nodes
            );
        }
    }
    Ok(())
}

/// Checks nodes against stages, of which the timeline knows when they ran.
fn check_stages(nodes: &[Declared], log: &Log) -> Result<(), TestCaseError> {
    let run = &log.runs[0];
    let node_of = |name: &str| run.graph.nodes.iter().position(|node| node.name == name).unwrap();
    let stages_of = |stages: &[&str]| -> Vec<usize> {
        let is_one = |node: &NodeInfo| node.labels.stage.as_deref().is_some_and(|stage| stages.contains(&stage));
        (0..run.graph.nodes.len()).filter(|node| is_one(&run.graph.nodes[*node])).collect()
    };
    let start = |node: usize| run.chunks_of(node).iter().map(|chunk| chunk.started).min();
    let end = |node: usize| run.chunks_of(node).iter().map(|chunk| chunk.ended).max();
    for (index, node) in nodes.iter().enumerate() {
        let own = node_of(NAMES[index]);
        let follows = |earlier: usize, later: usize| match (end(earlier), start(later)) {
            (Some(end), Some(start)) => end <= start,
            _ => true,
        };
        let waits_for = |resource: usize, stages: &[&str]| {
            !node.reads.contains(&resource) || stages_of(stages).into_iter().all(|stage| follows(stage, own))
        };
        prop_assert!(waits_for(VISIBLE, &["compact"]), "{:?}", nodes);
        prop_assert!(waits_for(VISIBLE + 1, &["join", "triangles"]), "{:?}", nodes);
        prop_assert!(waits_for(RECORDED, &["finish", "record", "prepare"]), "{:?}", nodes);
        let precedes = |resource: usize, stages: &[&str]| {
            !node.writes.contains(&resource) || stages_of(stages).into_iter().all(|stage| follows(own, stage))
        };
        prop_assert!(precedes(TRANSFORMS, &["objects", "visibility"]), "{:?}", nodes);
        prop_assert!(precedes(PASS_INPUTS, &["prepare", "record", "finish"]), "{:?}", nodes);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 80, ..ProptestConfig::default() })]

    #[test]
    fn nodes_run_in_the_order_that_their_declarations_imply(nodes in declared(), workers in 1..4_usize) {
        check(&nodes, workers)?;
    }
}
