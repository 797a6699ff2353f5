//! How much later each node could have ended.

use std::time::Duration;

use super::run_spans::RunSpans;

/// How much later a node could have ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Slack {
    /// The index of the run in the log, and of the node in its graph.
    pub node: (usize, usize),
    /// The name of the node.
    pub name: String,
    /// How much later all worker spans of the node could have ended without delaying the run's last span. Every span
    /// that waited for them, directly or not, keeps its time from ready to end: the spans of its dependents, and later
    /// spans of the same workers. Zero on the critical path. It is the total float of the critical path method (Kelley
    /// and Walker, "Critical-Path Planning and Scheduling", 1959), on a graph of [worker spans](super::Step).
    pub time: Duration,
}

/// The slack of each node of a run: the backward pass of the critical path method.
pub(super) fn slack(run: &RunSpans<'_>) -> Vec<Slack> {
    let (nodes, spans) = (&run.run.graph.nodes, run.worker_spans.as_slice());
    let end = spans.last().map_or(run.run.began, |span| span.ended);
    // Every span of a node has to end before any span of its dependents is ready. One time for each node says the same
    // as an edge for each pair of spans.
    let mut latest_ends_of_nodes = vec![end; nodes.len()];
    let mut latest_ready = vec![end; nodes.len()];
    let mut latest_ends_of_spans = vec![end; spans.len()];
    let mut times = vec![Duration::MAX; nodes.len()];
    let mut spans_left = vec![0_usize; nodes.len()];
    spans.iter().for_each(|span| spans_left[span.node] += 1);
    for (index, span) in spans.iter().enumerate().rev() {
        let node = span.node;
        let latest_end = latest_ends_of_spans[index].min(latest_ends_of_nodes[node]);
        times[node] = times[node].min(latest_end.saturating_sub(span.ended));
        let ready = latest_end.saturating_sub(span.duration());
        latest_ready[node] = latest_ready[node].min(ready);
        if let Some(previous) = span.previous {
            latest_ends_of_spans[previous] = latest_ends_of_spans[previous].min(ready);
        }
        spans_left[node] -= 1;
        if spans_left[node] == 0 {
            for &dependency in &nodes[node].dependencies {
                let latest_end = &mut latest_ends_of_nodes[dependency];
                *latest_end = (*latest_end).min(latest_ready[node]);
            }
        }
    }
    let slack = |(index, time)| Slack { node: (run.index, index), name: nodes[index].name.clone(), time };
    times.into_iter().enumerate().map(slack).collect()
}
