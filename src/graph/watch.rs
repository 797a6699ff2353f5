//! Who looks on while a run goes on: the scheduler's timeline, and subscribers of spans.
//!
//! Whether anybody does is found out once a run, and is a type from there on: where nobody does, it costs nothing.

use std::{mem, ops::Range, sync::Arc};

use tracing::{
    Level, Span,
    level_filters::{LevelFilter, STATIC_MAX_LEVEL},
    span::EnteredSpan,
};

use crate::{
    sync::{AtomicUsize, Mutex, Ordering},
    task::{Worker, catch},
    timeline::{Ended, Graph, Lap, OpenRun, Process},
};

use super::{node::Node, schedule::Schedule};

/// Where everything that is told of runs goes to.
const TARGET: &str = "drawloom::graph";

/// Whoever looks on at a run.
pub(super) struct Watch<'run> {
    recorded: Option<OpenRun<'run>>,
    traced: Option<Traced<'run>>,
}

/// What subscribers of spans are told.
struct Traced<'run> {
    graph: &'run Graph,
    /// The span in which the run was called for.
    parent: Span,
    /// Whether they are told of chunks and counters, too.
    in_detail: bool,
    /// How many nodes are ready and have not been opened.
    ready: AtomicUsize,
}

impl<P> Schedule<P> {
    /// Makes up what is told of the schedule, if somebody looks on and it was not made up before.
    pub(super) fn describe<C>(&mut self, worker: &Worker)
    where
        C: ?Sized,
        P: Node<C>,
    {
        if self.graph.is_none() && (worker.timeline().is_on() || level() >= Level::DEBUG) {
            self.graph = Some(Arc::new(self.described()));
        }
    }

    /// What is told of the schedule.
    fn described<C>(&self) -> Graph
    where
        C: ?Sized,
        P: Node<C>,
    {
        let node = |index: usize| Process {
            name: self.names[index].clone(),
            labels: self.labels[index].clone(),
            dependencies: self.dependencies(index).to_vec(),
            pinned: catch(|| self.nodes[index].pinned()).unwrap_or(false),
        };
        Graph { processes: (0..self.len()).map(node).collect() }
    }
}

/// What subscribers of spans want to be told, at most.
fn level() -> LevelFilter {
    LevelFilter::current().min(STATIC_MAX_LEVEL)
}

impl<'run> Watch<'run> {
    /// Finds out who looks on at a run that begins, of a schedule of which `graph` tells.
    pub(super) fn new(worker: &'run Worker, graph: Option<&'run Arc<Graph>>) -> Option<Self> {
        let (graph, level) = (graph?, level());
        let traced = (level >= Level::DEBUG).then(|| Traced {
            graph,
            parent: Span::current(),
            in_detail: level >= Level::TRACE,
            ready: AtomicUsize::new(0),
        });
        // Last, as a subscriber may panic, and a run that was opened is to be ended.
        let recorded = worker.timeline().open_run(worker.is_in_background(), || Arc::clone(graph));
        // What it costs is measured against a build that has none.
        let is_wanted = (recorded.is_some() || traced.is_some()) && !cfg!(drawloom_without_timeline);
        is_wanted.then_some(Self { recorded, traced })
    }

    fn traced_in_detail(&self) -> Option<&Traced<'_>> {
        self.traced.as_ref().filter(|traced| traced.in_detail)
    }

    /// The span of a node.
    fn span(&self, node: u32) -> Span {
        let Some(traced) = &self.traced else { return Span::none() };
        let Process { name, labels, .. } = &traced.graph.processes[node as usize];
        let [of, stage, view] = [&labels.process, &labels.stage, &labels.view].map(Option::as_deref);
        tracing::debug_span!(target: TARGET, parent: &traced.parent, "node", name, process = of, stage, view)
    }
}

/// Who looks on at a run: a [`Watch`], or [`Nobody`].
pub(super) trait Watching: Sync {
    /// What looks on while a worker is at a node.
    type Turn<'watch>: Onlooker
    where
        Self: 'watch;

    /// A worker opens a node.
    fn open(&self, worker: &Worker, node: u32) -> Self::Turn<'_>;

    /// A worker joins others at a node that was opened.
    fn join(&self, worker: &Worker, node: u32, opened: &Opened) -> Self::Turn<'_>;

    /// A worker is to go through all nodes by itself.
    fn go_alone(&self, worker: &Worker) -> Self::Turn<'_>;

    /// A node that several have joined is done.
    fn close(&self, opened: &Opened);

    /// A node has become ready, in a run that is shared.
    fn count_ready(&self);

    /// A worker has taken up a node that was ready, in a run that is shared.
    fn count_taken(&self, worker: &Worker);

    /// What the worker's job was stolen for is done, and what it goes on with was not stolen.
    fn forget_stolen(&self, worker: &Worker);

    /// Other workers can take part from now on.
    fn let_others_in(&self);

    /// The run has ended.
    fn end(self, how: Ended);
}

impl Watching for Watch<'_> {
    type Turn<'watch>
        = Turn<'watch>
    where
        Self: 'watch;

    fn open(&self, worker: &Worker, node: u32) -> Turn<'_> {
        let lap = self.recorded.as_ref().map(|run| run.open(worker.index(), node, worker.has_stolen()));
        Turn { watch: self, lap, span: self.span(node).entered() }
    }

    fn join(&self, worker: &Worker, node: u32, opened: &Opened) -> Turn<'_> {
        let Opening { at, span } = opened.0.lock().clone();
        let lap = self.recorded.as_ref().map(|run| run.join(worker.index(), node, worker.has_stolen(), at));
        Turn { watch: self, lap, span: span.entered() }
    }

    fn go_alone(&self, worker: &Worker) -> Turn<'_> {
        let lap = self.recorded.as_ref().map(|run| run.open(worker.index(), 0, false));
        Turn { watch: self, lap, span: Span::none().entered() }
    }

    fn close(&self, opened: &Opened) {
        drop(opened.close());
    }

    fn count_ready(&self) {
        if let Some(traced) = self.traced_in_detail() {
            // Relaxed, here and below: it is a count that somebody looks at.
            traced.ready.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn count_taken(&self, worker: &Worker) {
        if let Some(traced) = self.traced_in_detail() {
            let ready = traced.ready.fetch_sub(1, Ordering::Relaxed).saturating_sub(1);
            tracing::trace!(name: "taken", target: TARGET, ready, queued = worker.queued());
        }
    }

    fn forget_stolen(&self, worker: &Worker) {
        worker.clear_stolen();
    }

    fn let_others_in(&self) {
        if let Some(run) = &self.recorded {
            run.let_others_in();
        }
    }

    fn end(self, how: Ended) {
        if let Some(run) = self.recorded {
            run.end(how);
        }
    }
}

/// Who looks on while a worker is at a node: somebody, or [`Nobody`], and then it costs nothing.
pub(super) trait Onlooker {
    /// Runs a chunk.
    fn chunk<R>(&mut self, items: Range<usize>, run: impl FnOnce(Range<usize>) -> R) -> R;

    /// The node has no items.
    fn end_empty(&mut self);

    /// The worker goes on with another node without a break, and opens it.
    fn go_on(&mut self, node: u32);

    /// The worker leaves the node open for others.
    fn leave(self, opened: &Opened);
}

/// Nobody looks on.
pub(super) struct Nobody;

impl Watching for Nobody {
    type Turn<'watch> = Self;

    fn open(&self, _worker: &Worker, _node: u32) -> Self {
        Self
    }

    fn join(&self, _worker: &Worker, _node: u32, _opened: &Opened) -> Self {
        Self
    }

    fn go_alone(&self, _worker: &Worker) -> Self {
        Self
    }

    fn close(&self, _opened: &Opened) {}

    fn count_ready(&self) {}

    fn count_taken(&self, _worker: &Worker) {}

    fn forget_stolen(&self, _worker: &Worker) {}

    fn let_others_in(&self) {}

    fn end(self, _how: Ended) {}
}

impl Onlooker for Nobody {
    fn chunk<R>(&mut self, items: Range<usize>, run: impl FnOnce(Range<usize>) -> R) -> R {
        run(items)
    }

    fn end_empty(&mut self) {}

    fn go_on(&mut self, _node: u32) {}

    fn leave(self, _opened: &Opened) {}
}

/// A worker at a node while somebody looks on.
pub(super) struct Turn<'run> {
    watch: &'run Watch<'run>,
    lap: Option<Lap<'run>>,
    span: EnteredSpan,
}

impl Onlooker for Turn<'_> {
    fn chunk<R>(&mut self, items: Range<usize>, run: impl FnOnce(Range<usize>) -> R) -> R {
        let span = self.watch.traced_in_detail().map(|_| {
            let (start, end) = (items.start, items.end);
            tracing::trace_span!(target: TARGET, "chunk", start, end).entered()
        });
        let result = run(items.clone());
        drop(span);
        if let Some(lap) = &mut self.lap {
            lap.end_chunk(&items);
        }
        result
    }

    fn end_empty(&mut self) {
        if let Some(lap) = &mut self.lap {
            lap.end_empty();
        }
    }

    fn go_on(&mut self, node: u32) {
        if self.watch.traced.is_some() {
            // Out of the old one first.
            self.span = Span::none().entered();
            self.span = self.watch.span(node).entered();
        }
        if let Some(lap) = &mut self.lap {
            lap.go_on(node);
        }
    }

    fn leave(self, opened: &Opened) {
        let at = self.lap.as_ref().map_or(0, Lap::opened);
        let span = self.span.exit();
        *opened.0.lock() = Opening { at, span };
    }
}

/// What those who join others at a node have to know of its beginning.
pub(super) struct Opened(Mutex<Opening>);

#[derive(Clone)]
struct Opening {
    /// By the timeline's clock.
    at: u64,
    span: Span,
}

impl Opened {
    pub(super) fn new() -> Self {
        Self(Mutex::new(Opening { at: 0, span: Span::none() }))
    }

    /// Gives the node's span away, which ends when it is dropped: all who took part are done.
    pub(super) fn close(&self) -> Span {
        mem::replace(&mut self.0.lock().span, Span::none())
    }
}
