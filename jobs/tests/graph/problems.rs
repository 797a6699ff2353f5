//! Every problem has a message that names its cause, and returns the graph so that it can be corrected.

use drawloom_jobs::graph::{FrameGraph, GraphProblem, NodeId, ResourceId, Schedule};

/// A graph of kept nodes.
fn graph<const N: usize>(names: [&str; N]) -> (FrameGraph<usize>, [NodeId; N]) {
    let mut graph = FrameGraph::new();
    let nodes = names.map(|name| graph.add(name, name.len()));
    for node in nodes {
        graph.keep(node);
    }
    (graph, nodes)
}

/// Compiles an invalid graph. Returns the graph, the problem, and the problem's text.
fn problem(graph: FrameGraph<usize>) -> (FrameGraph<usize>, GraphProblem, String) {
    let error = graph.compile().expect_err("the graph is invalid");
    let text = error.to_string();
    (*error.graph, error.problem, text)
}

fn names(schedule: &Schedule<usize>) -> Vec<&str> {
    schedule.nodes().map(|(name, _)| name).collect()
}

fn strings(names: &[&str]) -> Vec<String> {
    names.iter().map(ToString::to_string).collect()
}

#[test]
fn a_cycle_is_reported_from_its_first_node_on() {
    let (mut graph, [behind, a, b, c]) = graph(["behind", "a", "b", "c"]);
    graph.order(c, a);
    graph.order(a, b);
    graph.order(b, c);
    graph.order(c, behind);
    let (mut graph, problem, text) = problem(graph);
    assert_eq!(problem, GraphProblem::Cycle { nodes: strings(&["a", "b", "c"]) });
    assert_eq!(text, r#"nodes wait for each other in a cycle: "a" before "b" before "c" before "a""#);
    assert_eq!(graph.remove(b), Some(1));
    assert_eq!(names(&graph.compile().expect("the cycle is broken")), ["c", "behind", "a"]);
}

#[test]
fn a_node_before_itself_is_a_cycle() {
    let (mut graph, [alone]) = graph(["alone"]);
    graph.order(alone, alone);
    let (_, problem, text) = problem(graph);
    assert_eq!(problem, GraphProblem::Cycle { nodes: strings(&["alone"]) });
    assert!(text.ends_with(r#""alone" before "alone""#), "{text}");
}

#[test]
fn a_cycle_of_dropped_nodes_is_reported() {
    let mut graph = FrameGraph::new();
    let [a, b] = ["a", "b"].map(|name| graph.add(name, 0));
    graph.order(a, b);
    graph.order(b, a);
    assert_eq!(problem(graph).1, GraphProblem::Cycle { nodes: strings(&["a", "b"]) });
}

#[test]
fn an_order_breaks_a_cycle_through_resources() {
    let (mut graph, [history, image]) = graph(["history", "image"]);
    let [old, new] = ["old", "new"].map(|name| graph.resource(name));
    graph.import(new);
    graph.read(history, new);
    graph.write(history, old);
    graph.read(image, old);
    graph.write(image, new);
    let (mut graph, problem, _) = problem(graph);
    assert_eq!(problem, GraphProblem::Cycle { nodes: strings(&["history", "image"]) });
    graph.order(history, image);
    assert_eq!(names(&graph.compile().expect("it reads the earlier version")), ["history", "image"]);
}

#[test]
fn a_missing_producer_is_reported_with_its_readers() {
    let (mut graph, [reader, modifier]) = graph(["reader", "modifier"]);
    let [depth, shadow] = ["depth", "shadow"].map(|name| graph.resource(name));
    graph.read(reader, depth);
    graph.read(modifier, shadow);
    graph.write(modifier, shadow);
    graph.read(reader, shadow);
    let missing = |resource: &str, readers: &[&str]| GraphProblem::MissingProducer {
        resource: resource.to_owned(),
        output: false,
        readers: strings(readers),
    };
    let (mut graph, first, text) = problem(graph);
    assert_eq!(first, missing("depth", &["reader"]));
    assert_eq!(text, r#"nothing writes "depth" before it is read by "reader""#);
    graph.import(depth);
    let (mut graph, second, _) = problem(graph);
    assert_eq!(second, missing("shadow", &["modifier"]));
    let clear = graph.add("clear", 0);
    graph.write(clear, shadow);
    assert_eq!(names(&graph.compile().expect("all resources are written")), ["clear", "modifier", "reader"]);
}

#[test]
fn a_reader_before_every_writer_lacks_a_producer() {
    let (mut graph, [writer, reader]) = graph(["writer", "reader"]);
    let image = graph.resource("image");
    graph.write(writer, image);
    graph.read(reader, image);
    graph.order(reader, writer);
    let (mut graph, problem, _) = problem(graph);
    let readers = strings(&["reader"]);
    assert_eq!(problem, GraphProblem::MissingProducer { resource: "image".to_owned(), output: false, readers });
    graph.import(image);
    assert_eq!(names(&graph.compile().expect("it is imported")), ["reader", "writer"]);
}

#[test]
fn an_unwritten_output_is_reported() {
    let (mut graph, [reader]) = graph(["reader"]);
    let [screen, other] = ["screen", "other"].map(|name| graph.resource(name));
    graph.output(screen);
    graph.output(other);
    graph.read(reader, other);
    let (mut graph, first, text) = problem(graph);
    assert_eq!(first, GraphProblem::MissingProducer { resource: "screen".to_owned(), output: true, readers: vec![] });
    assert_eq!(text, r#"nothing writes "screen", which is an output of the graph"#);
    graph.import(screen);
    let (mut graph, second, text) = problem(graph);
    let readers = strings(&["reader"]);
    assert_eq!(second, GraphProblem::MissingProducer { resource: "other".to_owned(), output: true, readers });
    assert_eq!(text, r#"nothing writes "other", which is an output of the graph and is read by "reader""#);
    graph.import(other);
    assert!(graph.compile().is_ok());
}

#[test]
fn a_missing_producer_of_a_dropped_node_is_not_reported() {
    let (mut graph, [kept]) = graph(["kept"]);
    let resource = graph.resource("nowhere");
    let [first, second] = ["first", "second"].map(|name| graph.add(name, 0));
    for node in [first, second] {
        graph.read(node, resource);
        graph.write(node, resource);
    }
    let schedule = graph.compile().expect("dropped nodes are not checked");
    assert_eq!(schedule.index(kept), Some(0));
    assert_eq!(schedule.dropped(), ["first", "second"]);
}

#[test]
fn unordered_writers_and_modifiers_are_reported() {
    for modify in [false, true] {
        let (mut graph, [one, other]) = graph(["one", "other"]);
        let image = graph.resource("image");
        graph.import(image);
        for node in [one, other] {
            graph.write(node, image);
            if modify {
                graph.read(node, image);
            }
        }
        let (mut graph, problem, text) = problem(graph);
        let [resource, first, second] = ["image", "one", "other"].map(str::to_owned);
        assert_eq!(problem, GraphProblem::UnorderedWriters { resource, first, second });
        assert!(text.contains(r#""one" and "other" both write "image""#), "{text}");
        graph.order(other, one);
        assert_eq!(names(&graph.compile().expect("they have an order")), ["other", "one"]);
    }
}

#[test]
fn two_nodes_with_the_same_name_are_reported() {
    let (graph, [_, _, duplicate]) = graph(["shadow", "light", "shadow"]);
    let (mut graph, problem, text) = problem(graph);
    assert_eq!(problem, GraphProblem::DuplicateNode { name: "shadow".to_owned() });
    assert_eq!(text, r#"two nodes are named "shadow""#);
    assert_eq!(graph.remove(duplicate), Some(6));
    assert_eq!(graph.remove(duplicate), None);
    assert_eq!(names(&graph.compile().expect("only one is left")), ["shadow", "light"]);
}

#[test]
fn calls_with_ids_of_another_graph_are_reported() {
    let (mut other, [foreign]) = graph(["foreign"]);
    let foreign_resource: ResourceId = other.resource("foreign resource");
    let (mut graph, [own, removed]) = graph(["own", "removed"]);
    let resource = graph.resource("depth");
    graph.remove(removed);
    graph.read(foreign, resource);
    graph.write(own, foreign_resource);
    graph.order(own, foreign);
    graph.order(removed, own);
    graph.keep(foreign);
    graph.import(foreign_resource);
    graph.output(foreign_resource);
    let node = |call: &str| GraphProblem::UnknownNode { call: call.to_owned() };
    let resource = |call: &str| GraphProblem::UnknownResource { call: call.to_owned() };
    let expected = [
        node(r#"read(?, "depth")"#),
        resource(r#"write("own", ?)"#),
        node(r#"order("own", ?)"#),
        node(r#"order(?, "own")"#),
        node("keep(?)"),
        resource("import(?)"),
        resource("output(?)"),
    ];
    for expected in expected {
        let text;
        let found;
        (graph, found, text) = problem(graph);
        assert_eq!(found, expected);
        assert!(text.contains('?'), "{text}");
    }
    assert_eq!(names(&graph.compile().expect("each is reported once")), ["own"]);
}

#[test]
fn removing_a_node_keeps_the_accesses_and_orders_of_the_others() {
    let (mut graph, [a, b, c, d]) = graph(["a", "b", "c", "d"]);
    let [image, other] = ["image", "other"].map(|name| graph.resource(name));
    graph.write(d, image);
    graph.read(b, image);
    graph.write(a, other);
    graph.order(b, c);
    graph.order(a, d);
    assert_eq!(graph.remove(a), Some(1));
    let schedule = graph.compile().expect("the graph is valid");
    assert_eq!(names(&schedule), ["d", "b", "c"]);
    assert_eq!((schedule.dependencies(1), schedule.dependencies(2)), (&[0][..], &[1][..]));
    assert_eq!([a, b, c, d].map(|node| schedule.index(node)), [None, Some(1), Some(2), Some(0)]);
}

#[test]
fn errors_can_be_returned_and_printed_with_any_payload() {
    struct Opaque;
    let compile = || -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
        let mut graph = FrameGraph::new();
        graph.add("duplicate", Opaque);
        graph.add("duplicate", Opaque);
        graph.compile()?;
        Ok(())
    };
    let error = compile().expect_err("two nodes have the same name");
    assert_eq!(error.to_string(), r#"two nodes are named "duplicate""#);
    assert!(format!("{error:?}").contains("DuplicateNode"), "{error:?}");
}
