//! What can be wrong with a graph, and how a run can fail.

use std::error::Error;

use thiserror::Error;

use crate::task::JobPanic;

/// The error that a [`Node`](super::Node) returns when it fails.
pub type NodeError = Box<dyn Error + Send + Sync>;

/// What is wrong with a graph.
///
/// The variants are declared in the order in which they are checked. Invalid calls come first, because later problems
/// may only follow from them; then names, because all other problems are reported by name; then cycles, because a graph
/// with a cycle has no order; then what the kept nodes lack.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum GraphProblem {
    /// A call was given a node of another graph, or a removed one. The call did nothing, and is reported here once.
    #[error("in `{call}`, `?` stands for a node that does not belong to this graph or was removed from it")]
    UnknownNode {
        /// The call with the names of its arguments, and `?` for the unknown ones.
        call: String,
    },
    /// A call was given a resource of another graph. The call did nothing, and is reported here once.
    #[error("in `{call}`, `?` stands for a resource that does not belong to this graph")]
    UnknownResource {
        /// The call with the names of its arguments, and `?` for the unknown ones.
        call: String,
    },
    /// Two nodes have the same name.
    #[error("two nodes are named {name:?}")]
    DuplicateNode {
        /// The name.
        name: String,
    },
    /// Nodes wait for each other. Some of them may be nodes that would be dropped.
    #[error("nodes wait for each other in a cycle: {}", cycle(nodes))]
    Cycle {
        /// The nodes of one cycle: each must run before the next, and the last before the first. The list starts at the
        /// node that was added first.
        nodes: Vec<String>,
    },
    /// Nothing writes a resource before it is needed, and it is not imported.
    #[error("{}", missing_producer(resource, *output, readers))]
    MissingProducer {
        /// The resource.
        resource: String,
        /// Whether it is needed because it is an output of the graph.
        output: bool,
        /// The nodes that read it before any node has written it, in the order they were added.
        readers: Vec<String>,
    },
    /// Two nodes write or modify a resource, and neither is ordered before the other.
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

fn cycle(nodes: &[String]) -> String {
    let names: Vec<String> = nodes.iter().chain(nodes.first()).map(|name| format!("{name:?}")).collect();
    names.join(" before ")
}

fn missing_producer(resource: &str, output: bool, readers: &[String]) -> String {
    let names: Vec<String> = readers.iter().map(|name| format!("{name:?}")).collect();
    match (output, names.as_slice()) {
        (true, []) => format!("nothing writes {resource:?}, which is an output of the graph"),
        (true, _) => {
            format!("nothing writes {resource:?}, which is an output of the graph and is read by {}", names.join(", "))
        }
        (false, _) => format!("nothing writes {resource:?} before it is read by {}", names.join(", ")),
    }
}

/// Why a run failed.
///
/// If several nodes fail, the run reports the one that comes first in the schedule, and of one node's chunks the one
/// with the lowest items. Which other failures happen can depend on timing, since the first failure cancels the rest.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RunError {
    /// A node returned an error.
    #[error("the node {node:?} failed: {source}")]
    Failed {
        /// The node's name.
        node: String,
        /// What it returned.
        source: NodeError,
    },
    /// A node panicked.
    #[error("the node {node:?} panicked: {message}")]
    Panicked {
        /// The node's name.
        node: String,
        /// The panic's message.
        message: String,
    },
    /// Something panicked outside of every node, such as a subscriber of the run's spans.
    #[error("the run failed outside of its nodes: {0}")]
    Scheduler(JobPanic),
}
