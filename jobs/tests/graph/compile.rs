//! The kept nodes, their order, and the reported problems: compared with the oracle, and in single cases.

use drawloom_jobs::graph::{FrameGraph, NodeId, Schedule};
use proptest::prelude::*;

use crate::oracle::{any_graph, check_compiled, valid_graph};

fn names<P>(schedule: &Schedule<P>) -> Vec<&str> {
    schedule.nodes().map(|(name, _)| name).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2000) })]

    #[test]
    fn compiling_any_graph_agrees_with_the_oracle(model in any_graph()) {
        let compiled = model.graph(|node| node).compile();
        check_compiled(&model, compiled.as_ref().map_err(|error| &error.problem));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

    #[test]
    fn compiling_valid_graphs_agrees_with_the_oracle(model in valid_graph()) {
        let schedule = model.graph(|node| node).compile().map_err(|error| TestCaseError::fail(error.to_string()))?;
        check_compiled(&model, Ok(&schedule));
    }

    #[test]
    fn the_same_graph_compiles_to_the_same_schedule(model in valid_graph()) {
        let compile = || model.graph(|node| node).compile().map_err(|error| TestCaseError::fail(error.to_string()));
        prop_assert_eq!(compile()?.to_dot(), compile()?.to_dot());
    }
}

/// A graph of kept nodes and imported resources, to test the order alone.
struct KeptGraph {
    graph: FrameGraph<()>,
}

impl KeptGraph {
    fn new() -> Self {
        Self { graph: FrameGraph::new() }
    }

    fn add(&mut self, name: &str, reads: &[&str], writes: &[&str]) -> NodeId {
        let node = self.graph.add(name, ());
        self.graph.keep(node);
        for resource in reads.iter().chain(writes) {
            let resource = self.graph.resource(*resource);
            self.graph.import(resource);
        }
        for resource in reads {
            let resource = self.graph.resource(*resource);
            self.graph.read(node, resource);
        }
        for resource in writes {
            let resource = self.graph.resource(*resource);
            self.graph.write(node, resource);
        }
        node
    }

    fn compile(self) -> Schedule<()> {
        self.graph.compile().expect("the graph is valid")
    }
}

#[test]
fn writers_come_before_modifiers_and_those_before_readers() {
    let mut kept = KeptGraph::new();
    kept.add("read", &["image"], &[]);
    kept.add("modify", &["image"], &["image"]);
    kept.add("write", &[], &["image"]);
    assert_eq!(names(&kept.compile()), ["write", "modify", "read"]);
}

#[test]
fn a_reader_ordered_before_a_writer_comes_before_its_modifiers() {
    let mut kept = KeptGraph::new();
    kept.add("modify", &["image"], &["image"]);
    let write = kept.add("write", &[], &["image"]);
    let read = kept.add("read", &["image"], &[]);
    kept.graph.order(read, write);
    assert_eq!(names(&kept.compile()), ["read", "write", "modify"]);
}

#[test]
fn a_reader_can_run_between_two_writers() {
    let mut kept = KeptGraph::new();
    let late = kept.add("late", &[], &["image"]);
    let read = kept.add("read", &["image"], &[]);
    let early = kept.add("early", &[], &["image"]);
    kept.graph.order(early, late);
    kept.graph.order(read, late);
    assert_eq!(names(&kept.compile()), ["early", "read", "late"]);
}

#[test]
fn the_version_that_a_kept_modifier_modifies_is_kept() {
    let mut graph = FrameGraph::new();
    let [canvas, image] = ["canvas", "image"].map(|name| graph.resource(name));
    graph.import(canvas);
    graph.output(image);
    let [first, second, unrelated] = ["first", "second", "unrelated"].map(|name| graph.add(name, ()));
    for node in [first, second] {
        graph.read(node, canvas);
        graph.write(node, canvas);
    }
    graph.write(second, image);
    graph.order(first, second);
    graph.order(unrelated, second);
    let schedule = graph.compile().expect("the graph is valid");
    assert_eq!(names(&schedule), ["first", "second"]);
    assert_eq!(schedule.dropped(), ["unrelated"]);
}

#[test]
fn an_overwritten_version_is_not_kept_for_a_modifier() {
    let mut graph = FrameGraph::new();
    let [canvas, image] = ["canvas", "image"].map(|name| graph.resource(name));
    graph.output(image);
    let [before, write, modify] = ["before", "write", "modify"].map(|name| graph.add(name, ()));
    for node in [before, modify] {
        graph.read(node, canvas);
    }
    for node in [before, write, modify] {
        graph.write(node, canvas);
    }
    graph.write(modify, image);
    graph.order(before, write);
    graph.order(before, modify);
    let schedule = graph.compile().expect("the node without a producer is dropped");
    assert_eq!(names(&schedule), ["write", "modify"]);
}

#[test]
fn orders_work_through_dropped_nodes() {
    let mut kept = KeptGraph::new();
    let last = kept.add("last", &[], &["image"]);
    let first = kept.add("first", &[], &["image"]);
    let dropped = kept.graph.add("dropped", ());
    kept.graph.order(first, dropped);
    kept.graph.order(dropped, last);
    let schedule = kept.compile();
    assert_eq!(names(&schedule), ["first", "last"]);
    assert_eq!(schedule.dependencies(1), [0]);
}

#[test]
fn dropped_nodes_do_not_break_ties() {
    let mut kept = KeptGraph::new();
    let first = kept.add("first", &[], &[]);
    kept.add("second", &[], &[]);
    let dropped = kept.graph.add("dropped", ());
    kept.graph.order(dropped, first);
    assert_eq!(names(&kept.compile()), ["first", "second"]);
}

#[test]
fn a_reader_depends_on_the_last_maker_only() {
    let mut kept = KeptGraph::new();
    let makers = ["a", "b", "c"].map(|name| kept.add(name, &["image"], &["image"]));
    kept.graph.order(makers[0], makers[1]);
    kept.graph.order(makers[1], makers[2]);
    kept.add("read", &["image"], &[]);
    let schedule = kept.compile();
    assert_eq!(schedule.dependencies(3), [2]);
    assert_eq!(schedule.dependents(0), [1]);
}

#[test]
fn nodes_are_found_by_id() {
    let mut graph = FrameGraph::new();
    let [dropped, late, early] = ["dropped", "late", "early"].map(|name| graph.add(name, name.len()));
    graph.keep(late);
    graph.keep(early);
    graph.order(early, late);
    let mut schedule = graph.compile().expect("the graph is valid");
    assert_eq!([dropped, late, early].map(|node| schedule.index(node)), [None, Some(1), Some(0)]);
    assert_eq!(schedule.node(late), Some(&4));
    *schedule.node_mut(early).expect("it is kept") = 7;
    schedule.nodes_mut().for_each(|(_, payload)| *payload += 1);
    assert_eq!(schedule.nodes().collect::<Vec<_>>(), [("early", &8), ("late", &5)]);
    assert_eq!((schedule.dependencies(2), schedule.dependents(usize::MAX)), (&[][..], &[][..]));
    let foreign = FrameGraph::new().add("early", ());
    assert_eq!(schedule.index(foreign), None);
}

#[test]
fn a_schedule_counts_its_nodes() {
    for count in 0..3 {
        let mut graph = FrameGraph::new();
        for index in 0..count {
            let node = graph.add(format!("node {index}"), ());
            graph.keep(node);
        }
        let schedule = graph.compile().expect("the graph is valid");
        assert_eq!((schedule.len(), schedule.is_empty()), (count, count == 0));
    }
}

#[test]
fn a_graph_and_its_schedule_are_printed_with_the_names_of_their_nodes() {
    let mut graph = FrameGraph::new();
    let kept = graph.add("kept", ());
    graph.add("unneeded", ());
    graph.keep(kept);
    let text = format!("{graph:?}");
    assert!(text.contains("\"kept\"") && text.contains("\"unneeded\""), "{text}");
    let schedule = graph.compile().expect("the graph is valid");
    assert_eq!(format!("{schedule:?}"), r#"Schedule { nodes: ["kept"], dropped: ["unneeded"], .. }"#);
}
