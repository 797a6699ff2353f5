//! A run with the spans of its nodes and workers.

use super::worker_spans::{NodeSpan, WorkerSpan, node_and_worker_spans};
use crate::timeline::{Log, Run};

/// A run with the spans of its nodes and workers.
pub(super) struct RunSpans<'log> {
    /// The run's index in the log.
    pub(super) index: usize,
    pub(super) run: &'log Run,
    pub(super) node_spans: Vec<NodeSpan>,
    pub(super) worker_spans: Vec<WorkerSpan>,
}

impl<'log> RunSpans<'log> {
    /// The spans of a run of that log.
    pub(super) fn new(log: &Log, run: &'log Run) -> Self {
        let index = log.runs.iter().position(|other| std::ptr::eq(other, run)).unwrap_or(0);
        let (node_spans, worker_spans) = node_and_worker_spans(run);
        Self { index, run, node_spans, worker_spans }
    }

    /// The chain of worker spans that each held up the next, from the first to the one that ended last.
    pub(super) fn critical_path(&self) -> Vec<&WorkerSpan> {
        let holder = |span: &&WorkerSpan| span.holder.map(|holder| &self.worker_spans[holder]);
        let mut path: Vec<_> = std::iter::successors(self.worker_spans.last(), holder).collect();
        path.reverse();
        path
    }
}
