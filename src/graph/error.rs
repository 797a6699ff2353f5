//! What can be wrong with a graph, and what can go wrong in a run.

use std::{error::Error, fmt};

use thiserror::Error;

use crate::task::JobPanic;

use super::builder::FrameGraph;

/// What a [`Node`](super::Node) reports when it fails.
pub type NodeError = Box<dyn Error + Send + Sync>;

/// A graph that does not compile, and why.
#[derive(Error)]
#[error("{problem}")]
#[non_exhaustive]
pub struct CompileError<P> {
    /// The graph as it was, so that it can be put right and compiled again.
    pub graph: Box<FrameGraph<P>>,
    /// The first thing that is wrong with it, in the order of [`GraphProblem`]'s variants.
    pub problem: GraphProblem,
}

impl<P> fmt::Debug for CompileError<P> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("CompileError").field("problem", &self.problem).field("graph", &self.graph).finish()
    }
}

/// What is wrong with a graph.
///
/// The variants stand in the order in which they are looked for. Calls that meant nothing come first, since what follows may
/// only follow from them; then names, which all other problems speak in; then cycles, since nothing has an order before
/// they are gone; then what the kept nodes lack.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum GraphProblem {
    /// A call was given a node of another graph, or one that had been removed. The call did nothing and, once reported
    /// here, is forgotten.
    #[error("the node that stands as `?` in `{call}` does not belong to this graph")]
    UnknownNode {
        /// The call, with the names of what it was given, and `?` for what is unknown.
        call: String,
    },
    /// A call was given a resource of another graph. The call did nothing and, once reported here, is forgotten.
    #[error("the resource that stands as `?` in `{call}` does not belong to this graph")]
    UnknownResource {
        /// The call, with the names of what it was given, and `?` for what is unknown.
        call: String,
    },
    /// Two nodes have one name.
    #[error("two nodes are named {name:?}")]
    DuplicateNode {
        /// The name.
        name: String,
    },
    /// Nodes wait for each other, dropped ones among them or not.
    #[error("nodes wait for each other in a circle: {}", circle(nodes))]
    Cycle {
        /// The nodes of one circle: each must run before the next, and the last before the first. The one that was
        /// added first stands first.
        nodes: Vec<String>,
    },
    /// Nothing makes a resource before it is needed, and it is not imported.
    #[error("{}", missing(resource, *output, readers))]
    MissingProducer {
        /// The resource.
        resource: String,
        /// Whether it is missed because it is an output of the graph.
        output: bool,
        /// The nodes that read it before anything has written it, in the order they were added.
        readers: Vec<String>,
    },
    /// Two nodes write a resource, or modify it, and it is open which is first.
    #[error("{first:?} and {second:?} both write {resource:?}, and nothing says which is first: put them in order")]
    UnorderedWriters {
        /// The resource.
        resource: String,
        /// One of the two.
        first: String,
        /// The other.
        second: String,
    },
}

fn circle(nodes: &[String]) -> String {
    let names: Vec<String> = nodes.iter().chain(nodes.first()).map(|name| format!("{name:?}")).collect();
    names.join(" before ")
}

fn missing(resource: &str, output: bool, readers: &[String]) -> String {
    let names: Vec<String> = readers.iter().map(|name| format!("{name:?}")).collect();
    match (output, names.as_slice()) {
        (true, []) => format!("nothing writes {resource:?}, which is an output of the graph"),
        (true, _) => {
            format!("nothing writes {resource:?}, which is an output of the graph and is read by {}", names.join(", "))
        }
        (false, _) => format!("nothing writes {resource:?} before it is read by {}", names.join(", ")),
    }
}

/// A run that did not come to its end.
///
/// Of several failures the one is reported whose node stands first in the schedule, and of one node's chunks the one
/// that starts first. Which failures there are besides the first can depend on timing, since the first one stops the rest.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RunError {
    /// A node reported an error.
    #[error("the node {node:?} failed: {source}")]
    Failed {
        /// The node's name.
        node: String,
        /// What it reported.
        source: NodeError,
    },
    /// A node panicked.
    #[error("the node {node:?} panicked: {message}")]
    Panicked {
        /// The node's name.
        node: String,
        /// What the panic said.
        message: String,
    },
    /// Something panicked outside of every node, such as a subscriber of the run's spans.
    #[error("the run failed outside of its nodes: {0}")]
    Scheduler(JobPanic),
}
