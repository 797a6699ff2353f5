//! Graphs and schedules in the language of Graphviz.

use std::fmt::Write;

use petgraph::adj::UnweightedList;
use petgraph::algo::tred::dag_transitive_reduction_closure;
use petgraph::visit::{EdgeRef, IntoEdgeReferences};

use super::{
    builder::FrameGraph,
    edges::{self, Roles},
    order::{in_order, places},
    schedule::Schedule,
};

impl<P> FrameGraph<P> {
    /// The graph as Graphviz draws it: nodes as boxes, resources as ellipses, an arrow along each read and write, a
    /// dotted one for each explicit order.
    ///
    /// Outputs have a double rim, imported resources are filled. What leads to no output is dashed. A graph that
    /// does not compile can be drawn as well.
    pub fn to_dot(&self) -> String {
        let roles = Roles::of_all(self);
        let mut edges = edges::derive(self, &roles);
        let place = places(edges.node_count(), &in_order(&edges, self.nodes.len()));
        edges::add_versions(&mut edges, &roles, &place);
        let needed = edges::needed(self, &roles, &edges);

        let mut dot = Dot::new();
        for (position, node) in self.nodes.iter().enumerate() {
            let style = if needed[position] { "" } else { ", style=dashed" };
            dot.line(format_args!("node{position} [shape=box, label={}{style}];", Quoted(&node.name)));
        }
        for (position, (resource, roles)) in self.resources.iter().zip(&roles).enumerate() {
            let touched = roles.makers().chain(roles.readers.iter().copied()).any(|node| needed[node.index()]);
            let style = match (resource.imported, resource.output || touched) {
                (false, true) => "",
                (false, false) => ", style=dashed",
                (true, true) => ", style=filled",
                (true, false) => ", style=\"filled,dashed\"",
            };
            let rim = if resource.output { ", peripheries=2" } else { "" };
            dot.line(format_args!("resource{position} [shape=ellipse, label={}{style}{rim}];", Quoted(&resource.name)));
        }
        for (position, roles) in roles.iter().enumerate() {
            for reader in roles.modifiers.iter().chain(&roles.readers) {
                dot.line(format_args!("resource{position} -> node{};", reader.index()));
            }
            for maker in roles.makers() {
                dot.line(format_args!("node{} -> resource{position};", maker.index()));
            }
        }
        for (before, after) in &self.orders {
            dot.line(format_args!("node{before} -> node{after} [style=dotted];"));
        }
        dot.finish()
    }
}

impl<P> Schedule<P> {
    /// The schedule as Graphviz draws it: a box for each node, an arrow from each to what waits for it and for nothing that
    /// waits for it too, and what was dropped, dashed and apart.
    pub fn to_dot(&self) -> String {
        self.to_labelled_dot(|_, _| String::new())
    }

    /// The same, with a label for each arrow that `label` finds one for: from the index of one node to that of another.
    pub(crate) fn to_labelled_dot(&self, label: impl Fn(usize, usize) -> String) -> String {
        let mut dot = Dot::new();
        for (index, name) in self.names.iter().enumerate() {
            dot.line(format_args!("node{index} [shape=box, label={}];", Quoted(name)));
        }
        for (index, name) in self.dropped().iter().enumerate() {
            dot.line(format_args!("dropped{index} [shape=box, label={}, style=dashed];", Quoted(name)));
        }
        for (index, dependent) in self.direct_dependencies() {
            let label = label(index, dependent);
            if label.is_empty() {
                dot.line(format_args!("node{index} -> node{dependent};"));
            } else {
                dot.line(format_args!("node{index} -> node{dependent} [label={}];", Quoted(&label)));
            }
        }
        dot.finish()
    }

    /// Who waits for whom, without what follows from others.
    fn direct_dependencies(&self) -> Vec<(usize, usize)> {
        let mut all = UnweightedList::<usize>::with_capacity(self.len());
        for _ in 0..self.len() {
            all.add_node();
        }
        for index in 0..self.len() {
            for &dependent in self.dependents(index) {
                all.add_edge(index, dependent, ());
            }
        }
        // Indices are in an order in which each comes after all it depends on, as this wants them.
        let (direct, _) = dag_transitive_reduction_closure(&all);
        direct.edge_references().map(|edge| (edge.source(), edge.target())).collect()
    }
}

/// A drawing in the making.
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

/// A name as a quoted string that is drawn as the name itself, on one line, whatever is in it.
struct Quoted<'a>(&'a str);

impl std::fmt::Display for Quoted<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_char('"')?;
        for character in self.0.chars() {
            match character {
                '"' => formatter.write_str("\\\"")?,
                '\\' => formatter.write_str("\\\\")?,
                // Graphviz replaces HTML's entities in labels.
                '&' => formatter.write_str("&amp;")?,
                // Drawn as its escape, with a backslash of its own.
                control if control.is_control() => {
                    write!(formatter, "\\\\{}", &control.escape_default().to_string()[1..])?
                }
                other => formatter.write_char(other)?,
            }
        }
        formatter.write_char('"')
    }
}
