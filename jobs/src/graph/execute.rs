//! Runs a schedule: chooses the run mode, executes the run, and returns its outcome.

use std::mem;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use super::active_instrument::ActiveInstrument;
use super::costs::CostTimer;
use super::error::{NodeError, RunError};
use super::execution_policy::RunMode;
use super::instrument::{Instrument, NoInstrument, NodeSpan};
use super::node::Node;
use super::schedule::Schedule;
use crate::sync::{AtomicBool, Mutex, Ordering};
use crate::task::{Chunks, Scheduler, Worker};
use crate::timeline::{Graph, NodeInfo, RunEnd};
use crate::unwind::{JobPanic, catch, discard};

impl<P> Schedule<P> {
    /// Runs every node after all its dependencies, and waits for the last one.
    ///
    /// The calling thread works too, and runs the [pinned](Node::pinned) nodes. A schedule of little work, judging by
    /// its last runs, is executed serially by the calling thread; any other in parallel by all workers. After the first
    /// few runs, a run allocates no memory.
    ///
    /// # Errors
    /// Returns [`RunError`] if a node failed or panicked. The rest of the run is cancelled: chunks that have begun are
    /// finished, and no others start. The next run starts over. With `panic = "abort"`, a panic ends the program
    /// instead.
    pub fn run<C>(&mut self, scheduler: &Scheduler, context: &C) -> Result<(), RunError>
    where
        C: Sync + ?Sized,
        P: Node<C>,
    {
        scheduler.with_worker(|worker| self.run_on(worker, context))
    }

    fn run_on<C>(&mut self, worker: &Worker, context: &C) -> Result<(), RunError>
    where
        C: Sync + ?Sized,
        P: Node<C>,
    {
        let mode = if worker.is_shuffled() {
            RunMode::Parallel { is_measured: false }
        } else if worker.workers() == 1 {
            RunMode::Serial { limit: None }
        } else if self.always_parallel {
            self.policy.parallel()
        } else {
            self.policy.choose(worker.wake_up_cost())
        };
        self.describe(worker, context);
        // Code of the engine's is caught where it is called. Should a call have been forgotten, the run fails.
        let execution = catch(|| match ActiveInstrument::new(worker, self.description.as_ref()) {
            Some(instrument) => self.execute(mode, worker, context, instrument),
            None => self.execute(mode, worker, context, NoInstrument),
        });
        let Execution { took, is_parallel, failure, outcome } = execution.unwrap_or_else(Execution::panicked);
        // The duration of a failed run says nothing about its cost.
        if failure.is_some() || outcome.is_err() {
            self.costs.clear_work();
        } else {
            match mode {
                RunMode::Serial { .. } if is_parallel => self.policy.report_exceeded(),
                RunMode::Serial { .. } => self.policy.report_serial(took),
                RunMode::Parallel { is_measured } => {
                    let work = is_measured.then(|| self.update_costs());
                    self.policy.report_parallel(took, work);
                }
            }
        }
        if outcome.is_err() {
            self.reset();
        }
        match (failure, outcome) {
            (Some(failure), _) => Err(failure.error),
            (None, Err(panic)) => Err(RunError::Scheduler(panic)),
            (None, Ok(())) => Ok(()),
        }
    }

    fn execute<C, I>(&self, mode: RunMode, worker: &Worker, context: &C, instrument: I) -> Execution
    where
        C: Sync + ?Sized,
        P: Node<C>,
        I: Instrument,
    {
        let start = worker.timeline().stopwatch();
        let run = Run {
            schedule: self,
            context,
            timer: CostTimer::new(start, (mode == RunMode::Parallel { is_measured: true }).then_some(&self.costs)),
            instrument,
            is_stopped: AtomicBool::new(false),
            failure: Mutex::new(None),
        };
        let (is_parallel, outcome) = match mode {
            RunMode::Serial { limit } => match run.run_serial(worker, limit.map(|limit| (start, limit))) {
                Some(suspended) => (true, run.resume_parallel(suspended, worker)),
                None => (false, Ok(())),
            },
            RunMode::Parallel { .. } => (true, run.run_parallel(worker)),
        };
        let took = start.elapsed();
        let failure = run.failure.lock().take();
        let failed = failure.is_some() || outcome.is_err();
        run.instrument.end(RunEnd { always_parallel: self.always_parallel, failed });
        Execution { took, is_parallel, failure, outcome }
    }

    /// Builds the description of the schedule, if the run is to be instrumented and there is none yet.
    fn describe<C>(&mut self, worker: &Worker, context: &C)
    where
        C: ?Sized,
        P: Node<C>,
    {
        if self.description.is_none() && ActiveInstrument::is_wanted(worker) {
            let node = |index: usize| NodeInfo {
                name: self.graph.names[index].clone(),
                labels: self.graph.labels[index].clone(),
                dependencies: self.dependencies(index).to_vec(),
                pinned: catch(|| self.nodes[index].pinned()).unwrap_or(false),
                chunked_by_cost: catch(|| self.nodes[index].chunked_by_cost(context)).unwrap_or(false),
            };
            self.description = Some(Arc::new(Graph { nodes: (0..self.len()).map(node).collect() }));
        }
    }

    /// Adds a measured run to the nodes' costs, ranks the nodes by them, and returns the run's work.
    fn update_costs(&mut self) -> Duration {
        let work = self.costs.update();
        self.graph.adjacency.rank(&|node| self.costs.nanoseconds(node));
        work
    }

    /// Prepares the schedule for the next run after a panic outside of every node.
    fn reset(&mut self) {
        for node in 0..self.graph.adjacency.len() as u32 {
            self.progress.set_pending_dependencies(node, self.graph.adjacency.dependency_count(node));
            drop(self.progress.open_node(node).span.take());
        }
    }
}

/// An ended run.
struct Execution {
    took: Duration,
    /// Whether the run was parallel at its end.
    is_parallel: bool,
    failure: Option<Failure>,
    outcome: Result<(), JobPanic>,
}

impl Execution {
    /// The run ended by a panic outside of every node and every job.
    fn panicked(panic: JobPanic) -> Self {
        Self { took: Duration::ZERO, is_parallel: false, failure: None, outcome: Err(panic) }
    }
}

/// The state of one run that all its jobs share.
pub(super) struct Run<'run, P, C: ?Sized, I> {
    pub(super) schedule: &'run Schedule<P>,
    pub(super) context: &'run C,
    pub(super) timer: CostTimer<'run>,
    pub(super) instrument: I,
    is_stopped: AtomicBool,
    failure: Mutex<Option<Failure>>,
}

/// The first failure of a run, by location.
struct Failure {
    location: Location,
    error: RunError,
}

/// Which user code is running: the node, and the first item of its chunk.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Location {
    pub(super) node: u32,
    pub(super) item: usize,
}

impl<P: Node<C>, C: Sync + ?Sized, I: Instrument> Run<'_, P, C, I> {
    /// Calls user code, starting at this node. Returns `None` and stops the run if it fails. `call` keeps the location
    /// up to date.
    #[inline]
    pub(super) fn attempt<R>(&self, node: u32, call: impl FnOnce(&mut Location) -> Result<R, NodeError>) -> Option<R> {
        let mut location = Location { node, item: 0 };
        match catch(|| call(&mut location)) {
            Ok(Ok(result)) => return Some(result),
            Ok(Err(error)) => self.fail_with_error(location, error),
            Err(panic) => self.fail_with_panic(location, panic),
        }
        None
    }

    /// The chunks of a node.
    #[inline]
    pub(super) fn chunks(&self, node: u32, worker: &Worker) -> Chunks {
        let node = self.node(node);
        let width = node.width(self.context);
        let chunk = if width == 0 { 1 } else { node.chunk(self.context) };
        let chunks = Chunks::new(width, chunk);
        if worker.is_shuffled() { chunks.shuffled(|count| worker.draw(count)) } else { chunks }
    }

    /// Runs some chunks of the node at the location, unless the run is stopped.
    #[inline]
    pub(super) fn run_chunks(
        &self,
        location: &mut Location,
        chunks: &Chunks,
        indices: Range<usize>,
        worker: &Worker,
        span: &mut impl NodeSpan,
    ) -> Result<(), NodeError> {
        for index in indices {
            if self.is_stopped() {
                break;
            }
            let range = chunks.range(index);
            location.item = range.start;
            let run = |range| self.node(location.node).run(self.context, range, worker);
            span.chunk(range, run)?;
        }
        Ok(())
    }

    #[inline]
    pub(super) fn node(&self, node: u32) -> &P {
        &self.schedule.nodes[node as usize]
    }

    /// Whether a node has failed, so that nothing more may begin.
    pub(super) fn is_stopped(&self) -> bool {
        // Relaxed: the flag hands nothing over; the failure itself is behind the lock.
        self.is_stopped.load(Ordering::Relaxed)
    }

    #[cold]
    fn fail_with_error(&self, location: Location, source: NodeError) {
        self.fail(location, RunError::Failed { node: self.name(location), source });
    }

    #[cold]
    fn fail_with_panic(&self, location: Location, panic: JobPanic) {
        self.fail(location, RunError::Panicked { node: self.name(location), message: panic.message });
    }

    fn name(&self, location: Location) -> String {
        self.schedule.graph.names[location.node as usize].clone()
    }

    /// Stops the run, and keeps the failure with the lowest location.
    fn fail(&self, location: Location, error: RunError) {
        self.is_stopped.store(true, Ordering::Relaxed);
        let mut failure = Some(Failure { location, error });
        let mut first = self.failure.lock();
        if first.as_ref().is_none_or(|first| location < first.location) {
            mem::swap(&mut *first, &mut failure);
        }
        drop(first);
        // The error is the engine's, and may panic when it is dropped.
        discard(failure);
    }
}
