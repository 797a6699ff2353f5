//! Instrumentation that records a run in the scheduler's timeline and sends it to subscribers of tracing spans.

use std::ops::Range;
use std::sync::Arc;

use tracing::level_filters::{LevelFilter, STATIC_MAX_LEVEL};
use tracing::{Level, Span};

use super::instrument::{Instrument, NodeSpan};
use super::shared_span::{Opened, SharedSpan};
use crate::sync::{AtomicUsize, Ordering};
use crate::task::Worker;
use crate::timeline::{ChunkTimer, Graph, NodeInfo, OpenRun, RunEnd};
use crate::unwind::{CaughtSpan, EnteredSpan, emit};

/// The target of all spans and events of runs.
const TARGET: &str = "drawloom::graph";

/// Records one run in the timeline, sends it to tracing, or both.
pub(super) struct ActiveInstrument<'run> {
    timeline: Option<OpenRun<'run>>,
    tracing: Option<Tracing<'run>>,
}

/// The run's output to tracing.
struct Tracing<'run> {
    graph: &'run Graph,
    /// The span in which the run was started.
    parent: CaughtSpan,
    /// Whether subscribers want chunks and counters, too.
    is_detailed: bool,
    /// How many nodes are ready and not yet open.
    ready: AtomicUsize,
}

/// The most verbose level that a subscriber wants.
fn level() -> LevelFilter {
    LevelFilter::current().min(STATIC_MAX_LEVEL)
}

impl<'run> ActiveInstrument<'run> {
    /// Whether a run on this worker is to be instrumented, so that its schedule needs a description.
    pub(super) fn is_wanted(worker: &Worker) -> bool {
        worker.timeline().is_on() || level() >= Level::DEBUG
    }

    /// The instrument for a run that begins, if the run is to be instrumented. `graph` describes the schedule.
    pub(super) fn new(worker: &'run Worker, graph: Option<&'run Arc<Graph>>) -> Option<Self> {
        let (graph, level) = (graph?, level());
        let tracing = (level >= Level::DEBUG).then(|| Tracing {
            graph,
            parent: CaughtSpan::new(Span::current),
            is_detailed: level >= Level::TRACE,
            ready: AtomicUsize::new(0),
        });
        let timeline = worker.timeline().open_run(worker.is_in_background(), || Arc::clone(graph));
        // Builds with this flag have no instrumentation; the cost of instrumentation is measured against them.
        let is_active = (timeline.is_some() || tracing.is_some()) && !cfg!(drawloom_without_timeline);
        is_active.then_some(Self { timeline, tracing })
    }

    fn detailed_tracing(&self) -> Option<&Tracing<'_>> {
        self.tracing.as_ref().filter(|tracing| tracing.is_detailed)
    }

    /// The tracing span of a node.
    fn tracing_span(&self, node: u32) -> CaughtSpan {
        let Some(tracing) = &self.tracing else { return CaughtSpan::none() };
        let NodeInfo { name, labels, .. } = &tracing.graph.nodes[node as usize];
        let [process, stage, view] = [&labels.process, &labels.stage, &labels.view].map(Option::as_deref);
        CaughtSpan::new(
            || tracing::debug_span!(target: TARGET, parent: tracing.parent.id(), "node", name, process, stage, view),
        )
    }
}

impl Instrument for ActiveInstrument<'_> {
    type Span<'run>
        = ActiveSpan<'run>
    where
        Self: 'run;

    fn open(&self, worker: &Worker, node: u32) -> ActiveSpan<'_> {
        let timer = self.timeline.as_ref().map(|run| run.open(worker.index(), node, worker.has_stolen()));
        ActiveSpan { instrument: self, timer, tracing: self.tracing_span(node).enter() }
    }

    fn join(&self, worker: &Worker, node: u32, shared: &SharedSpan) -> ActiveSpan<'_> {
        let Opened { at, span } = shared.get();
        let timer = self.timeline.as_ref().map(|run| run.join(worker.index(), node, worker.has_stolen(), at));
        ActiveSpan { instrument: self, timer, tracing: span.enter() }
    }

    fn start_serial(&self, worker: &Worker) -> ActiveSpan<'_> {
        let timer = self.timeline.as_ref().map(|run| run.open(worker.index(), 0, false));
        ActiveSpan { instrument: self, timer, tracing: CaughtSpan::none().enter() }
    }

    fn close(&self, shared: &SharedSpan) {
        drop(shared.take());
    }

    fn count_ready(&self) {
        if let Some(tracing) = self.detailed_tracing() {
            // Relaxed, here and below: the count is only reported.
            tracing.ready.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn count_taken(&self, worker: &Worker) {
        if let Some(tracing) = self.detailed_tracing() {
            let ready = tracing.ready.fetch_sub(1, Ordering::Relaxed).saturating_sub(1);
            emit(|| tracing::trace!(name: "taken", target: TARGET, ready, queued = worker.queued()));
        }
    }

    fn clear_stolen(&self, worker: &Worker) {
        worker.clear_stolen();
    }

    fn start_parallel(&self) {
        if let Some(run) = &self.timeline {
            run.start_parallel();
        }
    }

    fn end(self, end: RunEnd) {
        if let Some(run) = self.timeline {
            run.end(end);
        }
    }
}

/// One worker's span of one node, in the timeline and in tracing.
pub(super) struct ActiveSpan<'run> {
    instrument: &'run ActiveInstrument<'run>,
    timer: Option<ChunkTimer<'run>>,
    tracing: EnteredSpan,
}

impl NodeSpan for ActiveSpan<'_> {
    fn chunk<R>(&mut self, items: Range<usize>, run: impl FnOnce(Range<usize>) -> R) -> R {
        let span = self.instrument.detailed_tracing().map(|_| {
            let (start, end) = (items.start, items.end);
            CaughtSpan::new(|| tracing::trace_span!(target: TARGET, "chunk", start, end)).enter()
        });
        let result = run(items.clone());
        drop(span);
        if let Some(timer) = &mut self.timer {
            timer.end_chunk(&items);
        }
        result
    }

    fn end_empty(&mut self) {
        if let Some(timer) = &mut self.timer {
            timer.end_empty();
        }
    }

    fn switch_to(&mut self, node: u32) {
        if self.instrument.tracing.is_some() {
            // Exit the old span before entering the new one.
            self.tracing = CaughtSpan::none().enter();
            self.tracing = self.instrument.tracing_span(node).enter();
        }
        if let Some(timer) = &mut self.timer {
            timer.switch_to(node);
        }
    }

    fn share(self, shared: &SharedSpan) {
        let at = self.timer.as_ref().map_or(0, ChunkTimer::opened);
        shared.set(Opened { at, span: self.tracing.exit() });
    }
}
