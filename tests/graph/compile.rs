//! What is kept, in which order, and what is found wrong: against the oracle, and case by case.

use drawloom::graph::{FrameGraph, GraphProblem, NodeId, Schedule};
use proptest::prelude::*;

use crate::oracle::{Oracle, Role, Sketch, any_sketch, closure, sound_sketch};

fn number(name: &str) -> usize {
    name[1..].parse().expect("names are a letter and a number")
}

fn names<P>(schedule: &Schedule<P>) -> Vec<&str> {
    schedule.nodes().map(|(name, _)| name).collect()
}

fn check_schedule(sketch: &Sketch, schedule: &Schedule<usize>) -> Result<(), TestCaseError> {
    let oracle = Oracle::new(sketch);
    let order: Vec<usize> = schedule.nodes().map(|(_, node)| *node).collect();
    prop_assert_eq!(&order, &oracle.order());
    for (name, node) in schedule.nodes() {
        prop_assert_eq!(number(name), *node);
    }
    let dropped: Vec<usize> = schedule.dropped().iter().map(|name| number(name)).collect();
    let unneeded: Vec<usize> = (0..oracle.needed.len()).filter(|&node| !oracle.needed[node]).collect();
    prop_assert_eq!(dropped, unneeded);

    let mut waits = vec![vec![false; order.len()]; order.len()];
    for (index, _) in schedule.nodes().enumerate() {
        for &dependency in schedule.dependencies(index) {
            waits[dependency][index] = true;
            prop_assert!(schedule.dependents(dependency).contains(&index));
        }
    }
    let waits = closure(&waits);
    for before in 0..order.len() {
        for after in 0..order.len() {
            prop_assert_eq!(waits[before][after], oracle.before[order[before]][order[after]]);
        }
    }
    Ok(())
}

fn check_problem(sketch: &Sketch, problem: &GraphProblem) -> Result<(), TestCaseError> {
    let oracle = Oracle::new(sketch);
    if let GraphProblem::Cycle { nodes } = problem {
        let circle: Vec<usize> = nodes.iter().map(|name| number(name)).collect();
        prop_assert_eq!(circle.first(), circle.iter().min());
        for (at, &before) in circle.iter().enumerate() {
            let after = circle[(at + 1) % circle.len()];
            let is_edge =
                oracle.data.iter().any(|edges| edges[before][after]) || sketch.orders.contains(&(before, after));
            prop_assert!(is_edge, "p{} is not right before p{}", before, after);
        }
        return Ok(());
    }
    prop_assert!(!oracle.has_cycle());
    let missing = (0..sketch.output.len()).filter(|&resource| !sketch.imported[resource]).find_map(|resource| {
        let mut readers = sketch.with_role(resource, &[Role::Reads, Role::Modifies]);
        readers.retain(|&reader| oracle.needed[reader] && !oracle.data[resource].iter().any(|edges| edges[reader]));
        let output = sketch.output[resource] && sketch.makers(resource).is_empty();
        (output || !readers.is_empty()).then(|| GraphProblem::MissingProducer {
            resource: format!("r{resource}"),
            output,
            readers: readers.iter().map(|reader| format!("p{reader}")).collect(),
        })
    });
    if let Some(missing) = missing {
        prop_assert_eq!(problem, &missing);
        return Ok(());
    }
    let unordered = |resource: usize, first: usize, second: usize| {
        let makers = sketch.makers(resource);
        first != second
            && [first, second].iter().all(|maker| makers.contains(maker) && oracle.needed[*maker])
            && !oracle.before[first][second]
            && !oracle.before[second][first]
    };
    let GraphProblem::UnorderedWriters { resource, first, second } = problem else {
        return Err(TestCaseError::fail(format!("nothing is wrong, but {problem:?}")));
    };
    prop_assert!(unordered(number(resource), number(first), number(second)));
    let nodes = 0..sketch.roles.len();
    let any_earlier =
        (0..number(resource)).any(|resource| nodes.clone().any(|a| nodes.clone().any(|b| unordered(resource, a, b))));
    prop_assert!(!any_earlier, "an earlier resource has writers without an order");
    Ok(())
}

fn is_wrong(sketch: &Sketch) -> bool {
    let oracle = Oracle::new(sketch);
    let unordered = (0..sketch.output.len()).any(|resource| {
        let mut makers = sketch.makers(resource);
        makers.retain(|&maker| oracle.needed[maker]);
        makers.iter().any(|&a| makers.iter().any(|&b| a < b && !oracle.before[a][b] && !oracle.before[b][a]))
    });
    let missing = (0..sketch.output.len()).filter(|&resource| !sketch.imported[resource]).any(|resource| {
        let lacks =
            |reader: &usize| oracle.needed[*reader] && !oracle.data[resource].iter().any(|edges| edges[*reader]);
        (sketch.output[resource] && sketch.makers(resource).is_empty())
            || sketch.with_role(resource, &[Role::Reads, Role::Modifies]).iter().any(lacks)
    });
    oracle.has_cycle() || unordered || missing
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2000) })]

    #[test]
    fn any_graph_compiles_or_fails_as_the_rules_say(sketch in any_sketch()) {
        match sketch.graph(|node| node).compile() {
            Ok(schedule) => {
                prop_assert!(!is_wrong(&sketch));
                check_schedule(&sketch, &schedule)?;
            }
            Err(error) => check_problem(&sketch, &error.problem)?,
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

    #[test]
    fn sound_graphs_compile_as_the_rules_say(sketch in sound_sketch()) {
        let schedule = sketch.graph(|node| node).compile().map_err(|error| TestCaseError::fail(error.to_string()))?;
        check_schedule(&sketch, &schedule)?;
    }

    #[test]
    fn the_same_graph_gives_the_same_schedule(sketch in sound_sketch()) {
        let compile = || sketch.graph(|node| node).compile().map_err(|error| TestCaseError::fail(error.to_string()));
        prop_assert_eq!(compile()?.to_dot(), compile()?.to_dot());
    }
}

/// A graph in which all nodes are kept and all resources imported, so that only the order matters.
struct Ordering {
    graph: FrameGraph<()>,
}

impl Ordering {
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
        self.graph.compile().expect("the graph is sound")
    }
}

#[test]
fn writers_come_before_modifiers_and_those_before_readers() {
    let mut ordering = Ordering::new();
    ordering.add("read", &["image"], &[]);
    ordering.add("modify", &["image"], &["image"]);
    ordering.add("write", &[], &["image"]);
    assert_eq!(names(&ordering.compile()), ["write", "modify", "read"]);
}

#[test]
fn a_reader_put_before_a_writer_is_before_its_modifiers_too() {
    let mut ordering = Ordering::new();
    ordering.add("modify", &["image"], &["image"]);
    let write = ordering.add("write", &[], &["image"]);
    let read = ordering.add("read", &["image"], &[]);
    ordering.graph.order(read, write);
    assert_eq!(names(&ordering.compile()), ["read", "write", "modify"]);
}

#[test]
fn a_reader_between_two_writers_sees_the_first() {
    let mut ordering = Ordering::new();
    let late = ordering.add("late", &[], &["image"]);
    let read = ordering.add("read", &["image"], &[]);
    let early = ordering.add("early", &[], &["image"]);
    ordering.graph.order(early, late);
    ordering.graph.order(read, late);
    assert_eq!(names(&ordering.compile()), ["early", "read", "late"]);
}

#[test]
fn what_a_kept_modifier_builds_on_is_kept() {
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
    let schedule = graph.compile().expect("the graph is sound");
    assert_eq!(names(&schedule), ["first", "second"]);
    assert_eq!(schedule.dropped(), ["unrelated"]);
}

#[test]
fn what_was_overwritten_is_not_kept_for_a_modifier() {
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
    let schedule = graph.compile().expect("what lacks a producer is dropped");
    assert_eq!(names(&schedule), ["write", "modify"]);
}

#[test]
fn a_dropped_node_hands_on_the_order() {
    let mut ordering = Ordering::new();
    let last = ordering.add("last", &[], &["image"]);
    let first = ordering.add("first", &[], &["image"]);
    let dropped = ordering.graph.add("dropped", ());
    ordering.graph.order(first, dropped);
    ordering.graph.order(dropped, last);
    let schedule = ordering.compile();
    assert_eq!(names(&schedule), ["first", "last"]);
    assert_eq!(schedule.dependencies(1), [0]);
}

#[test]
fn a_dropped_node_has_no_say_in_ties() {
    let mut ordering = Ordering::new();
    let first = ordering.add("first", &[], &[]);
    ordering.add("second", &[], &[]);
    let dropped = ordering.graph.add("dropped", ());
    ordering.graph.order(dropped, first);
    assert_eq!(names(&ordering.compile()), ["first", "second"]);
}

#[test]
fn only_the_last_maker_is_waited_for() {
    let mut ordering = Ordering::new();
    let makers = ["a", "b", "c"].map(|name| ordering.add(name, &["image"], &["image"]));
    ordering.graph.order(makers[0], makers[1]);
    ordering.graph.order(makers[1], makers[2]);
    ordering.add("read", &["image"], &[]);
    let schedule = ordering.compile();
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
    let mut schedule = graph.compile().expect("the graph is sound");
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
fn an_empty_graph_compiles() {
    assert!(FrameGraph::<()>::new().compile().expect("nothing is wrong with nothing").is_empty());
}
