//! What each worker did in a run, span by span: which node it ran, from when to when, and what held it up.

use std::collections::HashMap;
use std::time::Duration;

use super::step::HeldBy;
use crate::timeline::{Chunk, Run};

/// The time in which a worker runs chunks of one node, and of no other node of the run in between.
pub(super) struct WorkerSpan {
    pub(super) node: usize,
    /// `None` if no chunk of the node is in the log.
    pub(super) worker: Option<usize>,
    /// The worker's previous span, unless this is its first.
    pub(super) previous: Option<usize>,
    pub(super) held_by: HeldBy,
    /// The span whose end it waited for last, unless that is the start of the run.
    pub(super) holder: Option<usize>,
    /// When `holder` ended, or the run began.
    pub(super) ready: Duration,
    /// When its first chunk began: no earlier than `ready`.
    pub(super) started: Duration,
    /// When its last chunk ended: no earlier than `started`.
    pub(super) ended: Duration,
}

/// When a node ran, from its first chunk to its last. Each of the three times is no earlier than the one before.
#[derive(Clone, Copy)]
pub(super) struct NodeSpan {
    /// When the last of its dependencies had ended.
    pub(super) ready: Duration,
    /// When its first chunk began.
    pub(super) started: Duration,
    /// When its last chunk ended.
    pub(super) ended: Duration,
}

impl WorkerSpan {
    /// From ready to end. The wait for a worker is part of it, so that the critical path has no gaps.
    pub(super) fn duration(&self) -> Duration {
        self.ended - self.ready
    }
}

impl NodeSpan {
    pub(super) fn waited(&self) -> Duration {
        self.started - self.ready
    }
}

/// The spans of all nodes, and of all workers. Worker spans are in topological order: each comes after those that had
/// to end before it, and the last is the one that ended last. Every node has at least one.
pub(super) fn node_and_worker_spans(run: &Run) -> (Vec<NodeSpan>, Vec<WorkerSpan>) {
    let mut worker_spans = worker_spans_by_node(run);
    let node_spans = enforce_dependencies(run, &mut worker_spans);
    // Spans of zero length may begin and end at the same time as others. Then the order of nodes decides.
    worker_spans.sort_by_key(|span| (span.ended, span.started, span.node));
    find_holders(run, &mut worker_spans);
    (node_spans, worker_spans)
}

/// The worker spans as the log has them, by node, without their holders.
fn worker_spans_by_node(run: &Run) -> Vec<WorkerSpan> {
    let mut has_chunks = vec![false; run.graph.nodes.len()];
    let mut chunks: Vec<&Chunk> = run.chunks.iter().chain(&run.empty).collect();
    chunks.retain(|chunk| chunk.node < has_chunks.len());
    chunks.iter().for_each(|chunk| has_chunks[chunk.node] = true);
    chunks.sort_by_key(|chunk| (chunk.worker, chunk.ended, chunk.started, chunk.node));
    let are_one_span = |one: &&Chunk, next: &&Chunk| (one.worker, one.node) == (next.worker, next.node);
    let span = |node, worker, started, ended| WorkerSpan {
        node,
        worker,
        previous: None,
        held_by: HeldBy::Start,
        holder: None,
        ready: run.began,
        started,
        ended,
    };
    let recorded = chunks.chunk_by(are_one_span).map(|chunks| {
        let (first, last) = (chunks[0], chunks[chunks.len() - 1]);
        let started = chunks.iter().map(|chunk| chunk.started).min().unwrap_or(first.started);
        span(first.node, Some(first.worker), started, last.ended)
    });
    // A node without chunks takes no time, and ends as soon as it can.
    let missing = has_chunks.iter().enumerate().filter(|(_node, has_chunks)| !**has_chunks);
    let missing = missing.map(|(node, _)| span(node, None, Duration::ZERO, Duration::ZERO));
    let mut spans: Vec<_> = recorded.chain(missing).collect();
    spans.sort_by_key(|span| span.node);
    spans
}

/// Moves worker spans so that none begins before the dependencies of its node have ended, whatever the log says.
fn enforce_dependencies(run: &Run, by_node: &mut [WorkerSpan]) -> Vec<NodeSpan> {
    let mut node_spans: Vec<NodeSpan> = Vec::new();
    let of_nodes = by_node.chunk_by_mut(|one, next| one.node == next.node);
    for (node, spans) in run.graph.nodes.iter().zip(of_nodes) {
        let ready = node.dependencies.iter().map(|&dependency| node_spans[dependency].ended).max().unwrap_or(run.began);
        for span in spans.iter_mut() {
            span.started = span.started.max(ready);
            span.ended = span.ended.max(span.started);
        }
        let started = spans.iter().map(|span| span.started).min().unwrap_or(ready);
        let ended = spans.iter().map(|span| span.ended).max().unwrap_or(started);
        node_spans.push(NodeSpan { ready, started, ended });
    }
    node_spans
}

/// Finds what held up each of the spans, which ascend by their ends.
fn find_holders(run: &Run, spans: &mut [WorkerSpan]) {
    let nodes = &run.graph.nodes;
    let mut last_span_of = vec![0; nodes.len()];
    spans.iter().enumerate().for_each(|(index, span)| last_span_of[span.node] = index);
    let last_dependencies = nodes.iter().map(|node| {
        let dependencies = node.dependencies.iter();
        dependencies.map(|&dependency| last_span_of[dependency]).max()
    });
    let last_dependencies: Vec<Option<usize>> = last_dependencies.collect();
    let mut of_workers = HashMap::<usize, Vec<usize>>::new();
    for index in 0..spans.len() {
        let previous = spans[index].worker.and_then(|worker| {
            let earlier = of_workers.entry(worker).or_default();
            // A worker that waits for another run inside a chunk helps with this run meanwhile. Then one span lies
            // inside another that began before it, and was not held up by that one.
            let count = earlier.partition_point(|&earlier| spans[earlier].ended <= spans[index].started);
            let previous = earlier[..count].last().copied();
            earlier.push(index);
            previous
        });
        let dependency = last_dependencies[spans[index].node];
        let end_of = |span: Option<usize>| span.map_or(run.began, |span| spans[span].ended);
        let (held_by, holder) = if end_of(previous) > end_of(dependency) {
            (HeldBy::Worker, previous)
        } else {
            (dependency.map_or(HeldBy::Start, |_| HeldBy::Dependency), dependency)
        };
        let ready = end_of(holder);
        spans[index] = WorkerSpan { previous, held_by, holder, ready, ..spans[index] };
    }
}
