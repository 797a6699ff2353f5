//! Graphs and schedules in DOT, the language of Graphviz.

use std::fmt::Write;

use petgraph::adj::UnweightedList;
use petgraph::algo::tred::dag_transitive_reduction_closure;
use petgraph::visit::{EdgeRef, IntoEdgeReferences};

use super::adjacency::Adjacency;
use super::builder::FrameGraph;
use super::declarations::Declarations;
use super::edges::{self, Roles};
use super::order::{positions, topological_order};
use super::schedule::Schedule;

impl<P> FrameGraph<P> {
    /// The graph in DOT: nodes as boxes, resources as ellipses, an arrow for each read and write, a dotted arrow for
    /// each explicit order.
    ///
    /// Outputs have a double border, imported resources are filled. What leads to no output is dashed. A graph that
    /// does not compile can be drawn, too.
    pub fn to_dot(&self) -> String {
        self.declarations.to_dot()
    }
}

impl Declarations {
    fn to_dot(&self) -> String {
        let roles = Roles::of_all(self);
        let mut edges = edges::derive(self, &roles);
        let position = positions(edges.node_count(), &topological_order(&edges, self.nodes.len()));
        edges::add_versions(&mut edges, &roles, &position);
        let needed = edges::needed(self, &roles, &edges, &|_| Vec::new());

        let mut dot = Dot::new();
        for (index, node) in self.nodes.iter().enumerate() {
            let style = if needed[index] { "" } else { ", style=dashed" };
            dot.line(format_args!("node{index} [shape=box, label={}{style}];", Quoted(&node.name)));
        }
        for (index, (resource, roles)) in self.resources.iter().zip(&roles).enumerate() {
            let is_accessed = roles.makers().chain(roles.readers.iter().copied()).any(|node| needed[node.index()]);
            let style = match (resource.imported, resource.output || is_accessed) {
                (false, true) => "",
                (false, false) => ", style=dashed",
                (true, true) => ", style=filled",
                (true, false) => ", style=\"filled,dashed\"",
            };
            let border = if resource.output { ", peripheries=2" } else { "" };
            dot.line(format_args!("resource{index} [shape=ellipse, label={}{style}{border}];", Quoted(&resource.name)));
        }
        for (index, roles) in roles.iter().enumerate() {
            for reader in roles.modifiers.iter().chain(&roles.readers) {
                dot.line(format_args!("resource{index} -> node{};", reader.index()));
            }
            for maker in roles.makers() {
                dot.line(format_args!("node{} -> resource{index};", maker.index()));
            }
        }
        for (before, after) in &self.orders {
            dot.line(format_args!("node{before} -> node{after} [style=dotted];"));
        }
        dot.finish()
    }
}

impl<P> Schedule<P> {
    /// The schedule in DOT: a box for each node, an arrow from each node to its direct dependents (those that do not
    /// also depend on it through another node), and the dropped nodes as dashed boxes without arrows.
    pub fn to_dot(&self) -> String {
        self.to_labelled_dot(|_, _| String::new())
    }

    /// As [`to_dot`](Self::to_dot), with `label(from, to)` on each arrow unless it is empty. `from` and `to` are
    /// indices of nodes.
    #[doc(hidden)]
    pub fn to_labelled_dot(&self, label: impl Fn(usize, usize) -> String) -> String {
        let mut dot = Dot::new();
        for (index, name) in self.graph.names.iter().enumerate() {
            dot.line(format_args!("node{index} [shape=box, label={}];", Quoted(name)));
        }
        for (index, name) in self.dropped().iter().enumerate() {
            dot.line(format_args!("dropped{index} [shape=box, label={}, style=dashed];", Quoted(name)));
        }
        for (index, dependent) in direct_dependencies(self.len(), &self.graph.dependents) {
            let label = label(index, dependent);
            if label.is_empty() {
                dot.line(format_args!("node{index} -> node{dependent};"));
            } else {
                dot.line(format_args!("node{index} -> node{dependent} [label={}];", Quoted(&label)));
            }
        }
        dot.finish()
    }
}

/// The edges of the transitive reduction, from dependency to dependent.
fn direct_dependencies(nodes: usize, dependents: &Adjacency) -> Vec<(usize, usize)> {
    let mut all = UnweightedList::<usize>::with_capacity(nodes);
    for _ in 0..nodes {
        all.add_node();
    }
    for index in 0..nodes {
        for &dependent in dependents.of(index) {
            all.add_edge(index, dependent, ());
        }
    }
    // The indices are a topological order, which this function requires.
    let (direct, _) = dag_transitive_reduction_closure(&all);
    direct.edge_references().map(|edge| (edge.source(), edge.target())).collect()
}

/// A DOT file while it is written.
struct Dot(String);

impl Dot {
    fn new() -> Self {
        Self("digraph {\n".to_owned())
    }

    fn line(&mut self, line: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.0, "    {line}");
    }

    fn finish(mut self) -> String {
        self.0.push_str("}\n");
        self.0
    }
}

/// A name as a DOT string, escaped so that Graphviz draws the name itself on one line.
struct Quoted<'a>(&'a str);

impl std::fmt::Display for Quoted<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_char('"')?;
        for character in self.0.chars() {
            match character {
                '"' => formatter.write_str("\\\"")?,
                '\\' => formatter.write_str("\\\\")?,
                // Graphviz replaces HTML entities in labels.
                '&' => formatter.write_str("&amp;")?,
                // Drawn as its escape sequence, so the backslash is escaped.
                control if control.is_control() => {
                    write!(formatter, "\\\\{}", &control.escape_default().to_string()[1..])?
                }
                other => formatter.write_char(other)?,
            }
        }
        formatter.write_char('"')
    }
}
