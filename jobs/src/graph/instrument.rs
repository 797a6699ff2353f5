//! Instrumentation of a run as a type parameter, so that a run without it compiles to code without it.

use std::ops::Range;

use super::shared_span::SharedSpan;
use crate::task::Worker;
use crate::timeline::RunEnd;

/// What observes a run.
pub(super) trait Instrument: Sync {
    /// One worker's span of one node.
    type Span<'run>: NodeSpan
    where
        Self: 'run;

    /// A worker opens a node.
    fn open(&self, worker: &Worker, node: u32) -> Self::Span<'_>;

    /// A worker joins the workers that run the chunks of an open node.
    fn join(&self, worker: &Worker, node: u32, shared: &SharedSpan) -> Self::Span<'_>;

    /// A worker starts to run nodes serially. The span is switched to each of them.
    fn start_serial(&self, worker: &Worker) -> Self::Span<'_>;

    /// A node that several workers may have run is complete.
    fn close(&self, shared: &SharedSpan);

    /// A node of a parallel run has become ready.
    fn count_ready(&self);

    /// A worker has started a ready node of a parallel run.
    fn count_taken(&self, worker: &Worker);

    /// The worker has finished the job that it stole. What it does next is not stolen.
    fn clear_stolen(&self, worker: &Worker);

    /// The run is parallel from now on.
    fn start_parallel(&self);

    /// The run has ended.
    fn end(self, end: RunEnd);
}

/// One worker's span of one node: from when it opens or joins the node until the span is dropped.
pub(super) trait NodeSpan {
    /// Runs a chunk.
    fn chunk<R>(&mut self, items: Range<usize>, run: impl FnOnce(Range<usize>) -> R) -> R;

    /// The node has no items.
    fn end_empty(&mut self);

    /// The worker opens another node right after this one.
    fn switch_to(&mut self, node: u32);

    /// The worker leaves the node open for others to join.
    fn share(self, shared: &SharedSpan);
}

/// No instrumentation.
pub(super) struct NoInstrument;

impl Instrument for NoInstrument {
    type Span<'run> = Self;

    fn open(&self, _worker: &Worker, _node: u32) -> Self {
        Self
    }

    fn join(&self, _worker: &Worker, _node: u32, _shared: &SharedSpan) -> Self {
        Self
    }

    fn start_serial(&self, _worker: &Worker) -> Self {
        Self
    }

    fn close(&self, _shared: &SharedSpan) {}

    fn count_ready(&self) {}

    fn count_taken(&self, _worker: &Worker) {}

    fn clear_stolen(&self, _worker: &Worker) {}

    fn start_parallel(&self) {}

    fn end(self, _end: RunEnd) {}
}

impl NodeSpan for NoInstrument {
    fn chunk<R>(&mut self, items: Range<usize>, run: impl FnOnce(Range<usize>) -> R) -> R {
        run(items)
    }

    fn end_empty(&mut self) {}

    fn switch_to(&mut self, _node: u32) {}

    fn share(self, _shared: &SharedSpan) {}
}
