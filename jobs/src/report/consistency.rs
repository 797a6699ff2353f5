//! Checks whether a timeline can have recorded a log: whether every node, worker and thread that it refers to exists.

use std::fmt::Display;

use crate::timeline::{Log, Run};

/// # Errors
/// Returns a message if one of the log's runs or spans refers to something that does not exist.
pub(super) fn check_log(log: &Log) -> Result<(), String> {
    for (index, run) in log.runs.iter().enumerate() {
        check_run(run, format_args!("run {index}"), log.workers.len())?;
    }
    match log.spans.iter().find(|span| span.thread >= log.threads.len()) {
        Some(span) => Err(format!("there is a span of thread {} of {}", span.thread, log.threads.len())),
        None => Ok(()),
    }
}

/// Checks a run on this many workers. Messages call it `name`.
///
/// # Errors
/// Returns a message if the run refers to something that does not exist.
pub(super) fn check_run(run: &Run, name: impl Display, workers: usize) -> Result<(), String> {
    let nodes = run.graph.nodes.len();
    for chunk in run.chunks.iter().chain(&run.empty) {
        if chunk.node >= nodes {
            return Err(format!("{name} has a chunk of node {} of {nodes}", chunk.node));
        }
        if chunk.worker >= workers {
            return Err(format!("{name} has a chunk of worker {} of {workers}", chunk.worker));
        }
    }
    let items = run.chunks.iter().try_fold(0_usize, |sum, chunk| sum.checked_add(chunk.items.len()));
    if items.is_none() {
        return Err(format!("{name} has more items than a `usize` can count"));
    }
    for (index, node) in run.graph.nodes.iter().enumerate() {
        match node.dependencies.iter().find(|&&other| other >= index) {
            Some(other) if *other < nodes => {
                return Err(format!("node {index} of {name} waits for node {other}, which is not before it"));
            }
            Some(other) => return Err(format!("node {index} of {name} waits for node {other} of {nodes}")),
            None => {}
        }
    }
    Ok(())
}
