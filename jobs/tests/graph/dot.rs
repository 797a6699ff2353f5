//! DOT files: their contents, and that they are well-formed with any names.

use std::collections::BTreeSet;

use drawloom_jobs::graph::FrameGraph;
use proptest::prelude::*;

use crate::oracle::{any_graph, valid_graph};

/// The identifiers of a node or an edge, and its attributes.
type Statement<'a> = (Vec<&'a str>, Vec<(&'a str, String)>);

/// Parses the subset of DOT that is used here: one statement per line, each a node or an edge with attributes.
fn parse(dot: &str) -> Result<Vec<Statement<'_>>, String> {
    let body = dot.strip_prefix("digraph {\n").and_then(|rest| rest.strip_suffix("}\n")).ok_or("not a digraph")?;
    body.lines().map(|line| statement(line).ok_or_else(|| format!("cannot parse {line:?}"))).collect()
}

fn statement(line: &str) -> Option<Statement<'_>> {
    let line = line.trim_start().strip_suffix(';')?;
    let (subject, mut rest) = match line.split_once(" [") {
        Some((subject, attributes)) => (subject, attributes.strip_suffix(']')?),
        None => (line, ""),
    };
    let identifiers: Vec<&str> = subject.split(" -> ").collect();
    if identifiers.iter().any(|identifier| !identifier.chars().all(char::is_alphanumeric)) {
        return None;
    }
    let mut attributes = Vec::new();
    while !rest.is_empty() {
        let (key, tail) = rest.split_once('=')?;
        let value;
        (value, rest) = if let Some(quoted) = tail.strip_prefix('"') { string(quoted)? } else { word(tail) };
        attributes.push((key, value));
        rest = match rest.strip_prefix(", ") {
            Some(next) if !next.is_empty() => next,
            None if rest.is_empty() => rest,
            _ => return None,
        };
    }
    Some((identifiers, attributes))
}

fn word(text: &str) -> (String, &str) {
    let end = text.find(|character: char| !character.is_alphanumeric()).unwrap_or(text.len());
    (text[..end].to_owned(), &text[end..])
}

/// The text that Graphviz draws for a quoted string (without its opening quote), and the rest of the line.
fn string(text: &str) -> Option<(String, &str)> {
    let mut drawn = String::new();
    let mut characters = text.char_indices();
    loop {
        match characters.next()? {
            (end, '"') => return Some((drawn.replace("&amp;", "&"), &text[end + 1..])),
            (_, '\\') => match characters.next()?.1 {
                escaped @ ('"' | '\\') => drawn.push(escaped),
                _ => return None,
            },
            (_, control) if control.is_control() => return None,
            (_, other) => drawn.push(other),
        }
    }
}

/// The identifier and the attributes of the statement with this label.
fn statement_of<'a>(statements: &'a [Statement<'a>], label: &str) -> (String, Vec<(&'a str, &'a str)>) {
    let has_label =
        |(_, attributes): &&Statement<'_>| attributes.iter().any(|(key, value)| *key == "label" && value == label);
    let (identifiers, attributes) = statements.iter().find(has_label).unwrap_or_else(|| panic!("no {label:?}"));
    let attributes = attributes.iter().filter(|(key, _)| *key != "label");
    (identifiers[0].to_owned(), attributes.map(|(key, value)| (*key, value.as_str())).collect())
}

fn small_graph() -> FrameGraph<()> {
    let mut graph = FrameGraph::new();
    let [map, image, overlay, noise] = ["map", "image", "overlay", "noise"].map(|name| graph.resource(name));
    let [shadow, light, lines] = ["shadow", "light", "lines"].map(|name| graph.add(name, ()));
    graph.write(shadow, map);
    graph.read(light, map);
    graph.read(light, image);
    graph.write(light, image);
    graph.write(lines, overlay);
    graph.order(lines, light);
    graph.import(image);
    graph.import(noise);
    graph.output(image);
    graph
}

#[test]
fn a_graph_has_nodes_resources_and_dashed_unneeded_ones() {
    let dot = small_graph().to_dot();
    let statements = parse(&dot).expect("the DOT file is well-formed");
    let (shadow, attributes) = statement_of(&statements, "shadow");
    assert_eq!(attributes, [("shape", "box")]);
    let (light, _) = statement_of(&statements, "light");
    let (lines, attributes) = statement_of(&statements, "lines");
    assert_eq!(attributes, [("shape", "box"), ("style", "dashed")]);
    let (map, attributes) = statement_of(&statements, "map");
    assert_eq!(attributes, [("shape", "ellipse")]);
    let (image, attributes) = statement_of(&statements, "image");
    assert_eq!(attributes, [("shape", "ellipse"), ("style", "filled"), ("peripheries", "2")]);
    let (overlay, attributes) = statement_of(&statements, "overlay");
    assert_eq!(attributes, [("shape", "ellipse"), ("style", "dashed")]);
    let (_, attributes) = statement_of(&statements, "noise");
    assert_eq!(attributes, [("shape", "ellipse"), ("style", "filled,dashed")]);

    let mut edges: Vec<_> = statements.iter().filter(|(ends, _)| ends.len() == 2).cloned().collect();
    edges.sort();
    let dotted = vec![("style", "dotted".to_owned())];
    let mut expected = vec![
        (vec![shadow.as_str(), &map], vec![]),
        (vec![map.as_str(), &light], vec![]),
        (vec![image.as_str(), &light], vec![]),
        (vec![light.as_str(), &image], vec![]),
        (vec![lines.as_str(), &overlay], vec![]),
        (vec![lines.as_str(), &light], dotted),
    ];
    expected.sort();
    assert_eq!(edges, expected);
}

#[test]
fn a_schedule_has_its_order_and_the_dropped_nodes() {
    let dot = small_graph().compile().expect("the graph is valid").to_dot();
    let statements = parse(&dot).expect("the DOT file is well-formed");
    let (shadow, attributes) = statement_of(&statements, "shadow");
    assert_eq!(attributes, [("shape", "box")]);
    let (light, _) = statement_of(&statements, "light");
    let (_, attributes) = statement_of(&statements, "lines");
    assert_eq!(attributes, [("shape", "box"), ("style", "dashed")]);
    let edges: Vec<_> = statements.iter().map(|(ends, _)| ends.clone()).filter(|ends| ends.len() == 2).collect();
    assert_eq!(edges, [[shadow.as_str(), &light]]);
}

#[test]
fn entities_and_control_characters_are_escaped() {
    let mut graph = FrameGraph::new();
    graph.add("a &lt; b", ());
    assert!(graph.to_dot().contains(r#"label="a &amp;lt; b""#), "{}", graph.to_dot());
    graph.add("a\nb\r\u{0}\t", ());
    assert!(graph.to_dot().contains(r#"label="a\\nb\\r\\u{0}\\t""#), "{}", graph.to_dot());
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(500) })]

    #[test]
    fn any_name_is_drawn_unchanged(name in "\\PC*|[\"\\\\&;a>\\[\\]{}=, -]{0,12}") {
        let mut graph = FrameGraph::new();
        let node = graph.add(name.clone(), ());
        graph.keep(node);
        let other = format!("other {name}");
        graph.resource(other.clone());
        graph.add("dropped".to_owned() + &name, ());
        let dot = graph.to_dot();
        let statements = parse(&dot).map_err(TestCaseError::fail)?;
        prop_assert_eq!(statements.len(), 3);
        prop_assert_eq!(statement_of(&statements, &name).1, [("shape", "box")]);
        prop_assert_eq!(statement_of(&statements, &other).1[0], ("shape", "ellipse"));
        let dot = graph.compile().map_err(|error| TestCaseError::fail(error.to_string()))?.to_dot();
        prop_assert_eq!(parse(&dot).map_err(TestCaseError::fail)?.len(), 2);
    }

    #[test]
    fn any_graph_can_be_drawn_even_if_it_does_not_compile(model in any_graph()) {
        let graph = model.graph(|node| node);
        let dot = graph.to_dot();
        let statements = parse(&dot).map_err(TestCaseError::fail)?;
        let dashed = |attributes: &[(&str, String)]| attributes.contains(&("style", "dashed".to_owned()));
        let dropped = statements.iter().filter(|(ends, attributes)| ends[0].starts_with("node") && dashed(attributes));
        let drawn = dropped.count();
        if let Ok(schedule) = graph.compile() {
            prop_assert_eq!(drawn, schedule.dropped().len());
        }
    }

    #[test]
    fn a_schedule_has_the_transitive_reduction_of_its_dependencies(model in valid_graph()) {
        let schedule = model.graph(|node| node).compile().map_err(|error| TestCaseError::fail(error.to_string()))?;
        let dot = schedule.to_dot();
        let statements = parse(&dot).map_err(TestCaseError::fail)?;
        let index = |end: &str| end.trim_start_matches("node").parse::<usize>().expect("nodes are numbered");
        let arrows = statements.iter().filter(|(ends, _)| ends.len() == 2);
        let drawn: Vec<_> = arrows.map(|(ends, _)| (index(ends[0]), index(ends[1]))).collect();
        let all = (0..schedule.len()).flat_map(|index| schedule.dependents(index).iter().map(move |&other| (index, other)));
        let all: Vec<_> = all.collect();
        prop_assert_eq!(reachable(&drawn, schedule.len()), reachable(&all, schedule.len()));
        for left_out in 0..drawn.len() {
            let mut fewer = drawn.clone();
            fewer.remove(left_out);
            prop_assert_ne!(reachable(&fewer, schedule.len()), reachable(&drawn, schedule.len()));
        }
    }
}

/// For each index, the indices that the arrows lead to, directly or through others. Arrows lead to higher indices.
fn reachable(arrows: &[(usize, usize)], count: usize) -> Vec<BTreeSet<usize>> {
    let mut after = vec![BTreeSet::new(); count];
    for index in (0..count).rev() {
        for &(_, next) in arrows.iter().filter(|(from, _)| *from == index) {
            let further = after[next].clone();
            after[index].insert(next);
            after[index].extend(further);
        }
    }
    after
}
