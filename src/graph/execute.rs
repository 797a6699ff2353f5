//! A run of a schedule: chooses the way it goes, and says how it ended.

use std::{mem, ops::Range, time::Duration};

use crate::{
    sync::{AtomicBool, Instant, Mutex, Ordering},
    task::{Chunks, Scheduler, Worker},
    timeline::Ended,
    unwind::{JobPanic, catch, discard},
};

use super::{
    costs::Clock,
    error::{NodeError, RunError},
    node::Node,
    schedule::Schedule,
    sharing::Way,
    watch::{Nobody, Onlooker, Watch, Watching},
};

impl<P> Schedule<P> {
    /// Runs every node, each after all it depends on, and waits for the last.
    ///
    /// The thread that calls it works too, and runs the [pinned](Node::pinned) nodes. The other workers join in where
    /// that pays: a schedule of little work, as far as its last runs tell, is run by the calling thread alone, one node
    /// after another. Once it has been run a few times a run takes no memory of its own.
    ///
    /// # Errors
    ///
    /// [`RunError`] if a node failed or panicked. The rest was cancelled then: what had begun was finished, nothing else
    /// was started. The next run starts over. With `panic = "abort"` a panic ends the program instead.
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
        let way = if worker.is_shuffled() {
            Way::Shared { is_measured: false }
        } else if worker.workers() == 1 {
            Way::Alone { at_most: None }
        } else if self.always_parallel {
            self.sharing.share()
        } else {
            self.sharing.choose(worker.wake_up_cost())
        };
        self.describe(worker);
        // Subscribers of spans are the engine's, and may panic between two nodes too.
        let ran = catch(|| match Watch::new(worker, self.graph.as_ref()) {
            Some(watch) => self.go(way, worker, context, watch),
            None => self.go(way, worker, context, Nobody),
        });
        let Ran { took, is_shared, failure, outcome } = ran.unwrap_or_else(Ran::panicked);
        // The time of a failed run says nothing about its cost.
        if failure.is_some() || outcome.is_err() {
            self.costs.forget_work();
        } else {
            match way {
                Way::Alone { .. } if is_shared => self.sharing.gave_up(),
                Way::Alone { .. } => self.sharing.went_alone(took),
                Way::Shared { is_measured } => {
                    let work = is_measured.then(|| self.learn());
                    self.sharing.was_shared(took, work);
                }
            }
        }
        if outcome.is_err() {
            self.rearm();
        }
        match (failure, outcome) {
            (Some(failure), _) => Err(failure.error),
            (None, Err(panic)) => Err(RunError::Scheduler(panic)),
            (None, Ok(())) => Ok(()),
        }
    }

    fn go<C, W>(&self, way: Way, worker: &Worker, context: &C, watch: W) -> Ran
    where
        C: Sync + ?Sized,
        P: Node<C>,
        W: Watching,
    {
        let start = Instant::now();
        let run = Run {
            schedule: self,
            context,
            clock: Clock::new((way == Way::Shared { is_measured: true }).then_some(&self.costs)),
            watch,
            is_stopped: AtomicBool::new(false),
            failure: Mutex::new(None),
        };
        let (is_shared, outcome) = match way {
            Way::Alone { at_most } => match run.go_alone(worker, at_most.map(|at_most| (start, at_most))) {
                Some(left) => (true, run.share_rest(left, worker)),
                None => (false, Ok(())),
            },
            Way::Shared { .. } => (true, run.share(worker)),
        };
        let took = start.elapsed();
        let failure = run.failure.lock().take();
        let failed = failure.is_some() || outcome.is_err();
        run.watch.end(Ended { always_parallel: self.always_parallel, failed });
        Ran { took, is_shared, failure, outcome }
    }

    /// Takes in what the nodes cost in a measured run, and says how much work they were.
    fn learn(&mut self) -> Duration {
        let work = self.costs.learn();
        self.flow.rank(self.costs.averages());
        work
    }

    /// Makes the schedule ready for the next run after one that failed outside of every node.
    fn rearm(&mut self) {
        for node in 0..self.flow.len() as u32 {
            self.progress.arm(node, self.flow.dependency_count(node));
            // Where a subscriber of spans panicked, one may have been left behind.
            discard(self.progress.pass(node).opened.close());
        }
    }
}

/// A run that has come to its end.
struct Ran {
    took: Duration,
    /// Whether others than the calling thread were let in.
    is_shared: bool,
    failure: Option<Failure>,
    outcome: Result<(), JobPanic>,
}

impl Ran {
    /// A panic outside of every node and every job ended it.
    fn panicked(panic: JobPanic) -> Self {
        Self { took: Duration::ZERO, is_shared: false, failure: None, outcome: Err(panic) }
    }
}

/// One run: what all its jobs share. `W` is who looks on.
pub(super) struct Run<'run, P, C: ?Sized, W> {
    pub(super) schedule: &'run Schedule<P>,
    pub(super) context: &'run C,
    pub(super) clock: Clock<'run>,
    pub(super) watch: W,
    is_stopped: AtomicBool,
    failure: Mutex<Option<Failure>>,
}

/// A failure, and where it stands among others.
struct Failure {
    position: Position,
    error: RunError,
}

/// Where a run is that does what is a user's: at a node, and the item at which a chunk of it starts.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Position {
    pub(super) node: u32,
    pub(super) item: usize,
}

impl<P: Node<C>, C: Sync + ?Sized, W: Watching> Run<'_, P, C, W> {
    /// Calls what is a user's, beginning with this node, and stops the run if it fails: then there is no result. `call`
    /// keeps its position up to date.
    #[inline]
    pub(super) fn attempt<R>(&self, node: u32, call: impl FnOnce(&mut Position) -> Result<R, NodeError>) -> Option<R> {
        let mut position = Position { node, item: 0 };
        match catch(|| call(&mut position)) {
            Ok(Ok(result)) => return Some(result),
            Ok(Err(error)) => self.fail_with_error(position, error),
            Err(panic) => self.fail_with_panic(position, panic),
        }
        None
    }

    /// How much there is to do of a node.
    #[inline]
    pub(super) fn chunks(&self, node: u32, worker: &Worker) -> Chunks {
        let node = self.node(node);
        let width = node.width(self.context);
        let chunk = if width == 0 { 1 } else { node.chunk(self.context) };
        let chunks = Chunks::new(width, chunk);
        if worker.is_shuffled() { chunks.shuffled(|count| worker.draw(count)) } else { chunks }
    }

    /// Runs these chunks of the node at the position, as long as nothing fails.
    #[inline]
    pub(super) fn run_chunks(
        &self,
        position: &mut Position,
        chunks: &Chunks,
        places: Range<usize>,
        worker: &Worker,
        onlooker: &mut impl Onlooker,
    ) -> Result<(), NodeError> {
        for place in places {
            if self.is_stopped() {
                break;
            }
            let range = chunks.range(place);
            position.item = range.start;
            let run = |range| self.node(position.node).run(self.context, range, worker);
            onlooker.chunk(range, run)?;
        }
        Ok(())
    }

    #[inline]
    pub(super) fn node(&self, node: u32) -> &P {
        &self.schedule.nodes[node as usize]
    }

    /// Whether something failed, so that nothing more is to begin.
    pub(super) fn is_stopped(&self) -> bool {
        // Relaxed: nothing is read on the strength of this flag; the failure itself goes through the lock.
        self.is_stopped.load(Ordering::Relaxed)
    }

    #[cold]
    fn fail_with_error(&self, position: Position, source: NodeError) {
        self.fail(position, RunError::Failed { node: self.name(position), source });
    }

    #[cold]
    fn fail_with_panic(&self, position: Position, panic: JobPanic) {
        self.fail(position, RunError::Panicked { node: self.name(position), message: panic.message });
    }

    fn name(&self, position: Position) -> String {
        self.schedule.names[position.node as usize].clone()
    }

    /// Stops the run, and keeps the failure unless one is kept that stands before it.
    fn fail(&self, position: Position, error: RunError) {
        self.is_stopped.store(true, Ordering::Relaxed);
        let mut failure = Some(Failure { position, error });
        let mut kept = self.failure.lock();
        if kept.as_ref().is_none_or(|kept| position < kept.position) {
            mem::swap(&mut *kept, &mut failure);
        }
        drop(kept);
        // An error is a user's, and may panic when it is dropped.
        discard(failure);
    }
}
