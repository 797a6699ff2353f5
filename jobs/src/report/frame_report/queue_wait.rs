//! Which nodes waited longest for a worker, and what workers did meanwhile.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::time::Duration;

use super::run_spans::RunSpans;

/// A node that waited for a worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct QueueWait {
    /// The index of the run in the log, and of the node in its graph.
    pub node: (usize, usize),
    /// The name of the node.
    pub name: String,
    /// When all its dependencies were done.
    pub ready: Duration,
    /// When its first chunk began.
    pub started: Duration,
    /// What workers ran meanwhile: groups, and the time of all workers in their chunks together, the longest first.
    pub meanwhile: Vec<(String, Duration)>,
}

/// How many waits are listed.
const MAX_WAITS: usize = 10;

impl QueueWait {
    /// How long it waited.
    pub fn waited(&self) -> Duration {
        self.started.saturating_sub(self.ready)
    }
}

/// The longest waits of all nodes of these runs, the longest first.
pub(super) fn queue_waits(runs: &[RunSpans<'_>]) -> Vec<QueueWait> {
    let mut waits: Vec<_> =
        runs.iter().flat_map(|run| (0..run.node_spans.len()).map(move |node| (run, node))).collect();
    waits.retain(|&(run, node)| !run.node_spans[node].waited().is_zero());
    waits.sort_by_key(|&(run, node)| Reverse(run.node_spans[node].waited()));
    waits.truncate(MAX_WAITS);
    waits.into_iter().map(|(run, node)| queue_wait(run, node)).collect()
}

fn queue_wait(run: &RunSpans<'_>, node: usize) -> QueueWait {
    let nodes = &run.run.graph.nodes;
    let span = run.node_spans[node];
    let mut by_group = BTreeMap::<&str, Duration>::new();
    for chunk in &run.run.chunks {
        let overlap = chunk.ended.min(span.started).saturating_sub(chunk.started.max(span.ready));
        if let Some(other) = nodes.get(chunk.node).filter(|_| !overlap.is_zero()) {
            *by_group.entry(other.group()).or_default() += overlap;
        }
    }
    let mut meanwhile: Vec<_> = by_group.into_iter().map(|(group, time)| (group.to_owned(), time)).collect();
    meanwhile.sort_by_key(|&(_, time)| Reverse(time));
    let name = nodes[node].name.clone();
    QueueWait { node: (run.index, node), name, ready: span.ready, started: span.started, meanwhile }
}
