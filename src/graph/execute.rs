//! A run of a schedule on the job system.
//!
//! No job ever waits. A process with work left to wait for is nothing but a counter of dependencies; whoever brings that
//! counter to zero *opens* the process: asks its width and starts on its chunks. Chunks go by ticket. Before it starts on a
//! chunk, a worker sees to it that an *invitation*, a job through which another worker joins in, lies in the deques
//! while more chunks remain. Whoever finishes the last chunk *completes* the process: it counts down those that depend on
//! it, goes on with the first that became ready, and spawns the others.
//!
//! # Memory ordering
//!
//! What one chunk wrote must be seen by all that depends on its process. Each worker counts its chunks off with a release,
//! and the worker that counts the last one off acquires from all others by the same operation (read-modify-writes continue
//! a release sequence). It hands that on by counting down each dependent, again with release and acquire, so that
//! whoever opens the dependent has acquired from everything it depends on. Workers that join later get it with the job,
//! which travels through the deques with release and acquire. Everything else is relaxed, and says why where it stands.

use std::ops::Range;

use crossbeam_utils::CachePadded;

use crate::{
    sync::{AtomicBool, Mutex, Ordering},
    task::{Scheduler, Scope, Worker, catch},
};

use super::{
    error::{NodeError, RunError},
    node::Node,
    progress::Pass,
    schedule::Schedule,
};

impl<P> Schedule<P> {
    /// Runs every process, each after all it depends on, on all workers of the scheduler, and waits for the last.
    ///
    /// The thread that calls it works too, and runs the [pinned](Node::pinned) processes.
    ///
    /// # Errors
    ///
    /// [`RunError`] if a process failed or panicked. The rest was stopped then: what had begun was finished, nothing else was
    /// started. The next run starts over. With `panic = "abort"` a panic ends the program instead.
    pub fn run<C>(&mut self, scheduler: &Scheduler, context: &C) -> Result<(), RunError>
    where
        C: Sync + ?Sized,
        P: Node<C>,
    {
        self.arm(scheduler.workers());
        let run = Run {
            schedule: &*self,
            context,
            alone: scheduler.workers() == 1,
            stopped: AtomicBool::new(false),
            failure: Mutex::new(None),
        };
        let outcome = scheduler.scope(|scope| {
            // Backwards, since a worker takes the last of its own jobs first.
            for &root in run.schedule.roots.iter().rev() {
                run.send(root, scope);
            }
        });
        let failure = run.failure.lock().take();
        let result = match (failure, outcome) {
            (Some(failure), _) => Err(failure.error),
            (None, Err(panic)) => Err(RunError::Scheduler(panic)),
            (None, Ok(())) => Ok(()),
        };
        self.armed = result.is_ok();
        result
    }

    /// Makes ready for a run. After one that came to its end there is nothing to do: each process armed itself again.
    fn arm(&mut self, workers: usize) {
        if self.inside.len() < workers {
            self.inside.resize_with(workers, || CachePadded::new(AtomicBool::new(false)));
        }
        if self.armed {
            return;
        }
        // Relaxed: the jobs that look at these are spawned later, by this thread.
        for inside in &self.inside {
            inside.store(false, Ordering::Relaxed);
        }
        for (index, progress) in self.progress.iter().enumerate() {
            progress.waits_for.store(self.dependencies.of(index).len(), Ordering::Relaxed);
        }
    }
}

/// One run: what all its jobs share.
struct Run<'run, P, C: ?Sized> {
    schedule: &'run Schedule<P>,
    context: &'run C,
    /// Whether there is no other worker to invite.
    alone: bool,
    stopped: AtomicBool,
    failure: Mutex<Option<Failure>>,
}

/// A failure, and where it stands among others: the process' index, then the item at which its chunk starts.
struct Failure {
    place: (usize, usize),
    error: RunError,
}

impl<'run, P: Node<C>, C: Sync + ?Sized> Run<'run, P, C> {
    /// Spawns the job that opens a process which waits for nothing any more.
    fn send(&'run self, index: usize, scope: &Scope<'run>) {
        match self.is_pinned(index) {
            Some(true) => scope.spawn_pinned(move |scope, worker| self.start(index, true, scope, worker)),
            Some(false) => scope.spawn(move |scope, worker| self.start(index, false, scope, worker)),
            None => {}
        }
    }

    /// Opens the process, and goes on from one to the next as long as there is one to go on with.
    ///
    /// It is a loop and no recursion, so that a chain of processes may be as long as memory lasts.
    fn start(&'run self, index: usize, pinned: bool, scope: &Scope<'run>, worker: &Worker) {
        let mut next = Some((index, pinned));
        while let Some((index, pinned)) = next.take() {
            let Some(pass) = self.open(index) else { return };
            if !self.work(index, pass, pinned, scope, worker) {
                return;
            }
            next = self.complete(index, scope).map(|index| (index, false));
            // A worker that only helps while a chunk of its own waits gets back to that chunk.
            if self.is_inside(worker)
                && let Some((index, _)) = next.take()
            {
                self.send(index, scope);
            }
        }
    }

    /// Takes part in a process that another worker has opened.
    fn join(&'run self, index: usize, scope: &Scope<'run>, worker: &Worker) {
        let progress = &self.schedule.progress[index];
        // Relaxed: at worst there is one invitation too many or too few for a moment.
        progress.invited.store(false, Ordering::Relaxed);
        // A chunk that waits for a loop of its own helps others meanwhile. Were it to join a process then, whose chunks might
        // wait in turn, the stack would grow with the number of chunks.
        if self.is_inside(worker) {
            return;
        }
        if self.work(index, progress.pass(), false, scope, worker)
            && let Some(next) = self.complete(index, scope)
        {
            self.start(next, false, scope, worker);
        }
    }

    /// Asks how much there is to do: `None` if the run has been stopped, or is now.
    fn open(&self, index: usize) -> Option<Pass> {
        if self.is_stopped() {
            return None;
        }
        let process = &self.schedule.processes[index];
        let shape = catch(|| match process.width(self.context) {
            0 => Pass::new(0, 1),
            width => Pass::new(width, process.chunk(self.context)),
        });
        match shape {
            Ok(pass) => {
                self.schedule.progress[index].open(pass, self.schedule.dependencies(index).len());
                Some(pass)
            }
            Err(panic) => {
                self.fail((index, 0), self.panicked(index, panic.message));
                None
            }
        }
    }

    /// Takes chunks until none is left. True for the one call that finished the last.
    fn work(&'run self, index: usize, pass: Pass, pinned: bool, scope: &Scope<'run>, worker: &Worker) -> bool {
        let chunks = pass.chunks();
        if chunks == 0 {
            return true;
        }
        let progress = &self.schedule.progress[index];
        let was_inside = self.set_inside(worker, true);
        let mut finished = 0;
        while !self.is_stopped() {
            // Relaxed: a ticket only says whose the chunk is; what the chunk needs came with the job.
            let ticket = progress.ticket.fetch_add(1, Ordering::Relaxed);
            if ticket >= chunks {
                break;
            }
            if !pinned && ticket + 1 < chunks {
                self.invite(index, scope);
            }
            if !self.run_chunk(index, pass.range(ticket), worker) {
                break;
            }
            finished += 1;
        }
        self.set_inside(worker, was_inside);
        // Release for what these chunks wrote, acquire for what all others did. A chunk that failed, or was not started
        // because the run was stopped, is never counted, so its process is never complete.
        finished > 0 && progress.done.fetch_add(finished, Ordering::AcqRel) + finished == chunks
    }

    /// Sees to it that an invitation lies in the deques.
    fn invite(&'run self, index: usize, scope: &Scope<'run>) {
        let invited = &self.schedule.progress[index].invited;
        // Relaxed: it only settles who spawns. The look before the swap spares the others the cache line.
        if !self.alone && !invited.load(Ordering::Relaxed) && !invited.swap(true, Ordering::Relaxed) {
            scope.spawn(move |scope, worker| self.join(index, scope, worker));
        }
    }

    /// False if the chunk failed.
    fn run_chunk(&self, index: usize, range: Range<usize>, worker: &Worker) -> bool {
        let place = (index, range.start);
        match catch(|| self.schedule.processes[index].run(self.context, range, worker)) {
            Ok(Ok(())) => return true,
            Ok(Err(error)) => self.fail(place, self.failed(index, error)),
            Err(panic) => self.fail(place, self.panicked(index, panic.message)),
        }
        false
    }

    /// Counts down all that depend on the process. Those that became ready are spawned, but for the first of them that can
    /// run anywhere: it is given back, to be gone on with at once.
    fn complete(&'run self, index: usize, scope: &Scope<'run>) -> Option<usize> {
        let mut next = None;
        // Backwards, since a worker takes the last of its own jobs first.
        for &dependent in self.schedule.dependents(index).iter().rev() {
            // Release for what this process and those before it wrote, acquire for what the other dependencies did.
            if self.schedule.progress[dependent].waits_for.fetch_sub(1, Ordering::AcqRel) != 1 {
                continue;
            }
            match self.is_pinned(dependent) {
                Some(false) => {
                    if let Some(later) = next.replace(dependent) {
                        scope.spawn(move |scope, worker| self.start(later, false, scope, worker));
                    }
                }
                Some(true) => scope.spawn_pinned(move |scope, worker| self.start(dependent, true, scope, worker)),
                None => {}
            }
        }
        next
    }

    /// `None` if even that question panicked.
    fn is_pinned(&self, index: usize) -> Option<bool> {
        let answer = catch(|| self.schedule.processes[index].pinned());
        answer.map_err(|panic| self.fail((index, 0), self.panicked(index, panic.message))).ok()
    }

    fn failed(&self, index: usize, source: NodeError) -> RunError {
        RunError::Failed { process: self.schedule.names[index].clone(), source }
    }

    fn panicked(&self, index: usize, message: String) -> RunError {
        RunError::Panicked { process: self.schedule.names[index].clone(), message }
    }

    /// Stops the run, and keeps the failure unless one is kept that stands before it.
    fn fail(&self, place: (usize, usize), error: RunError) {
        // Relaxed: nothing is read on the strength of this flag; the failure itself goes through the lock.
        self.stopped.store(true, Ordering::Relaxed);
        let mut kept = self.failure.lock();
        if kept.as_ref().is_none_or(|failure| place < failure.place) {
            *kept = Some(Failure { place, error });
        }
    }

    fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }

    /// Whether the worker is inside a chunk of this run already.
    fn is_inside(&self, worker: &Worker) -> bool {
        // Relaxed, here and below: a worker only looks at its own.
        self.schedule.inside[worker.index()].load(Ordering::Relaxed)
    }

    /// Gives back what it was.
    fn set_inside(&self, worker: &Worker, inside: bool) -> bool {
        let was_inside = self.is_inside(worker);
        self.schedule.inside[worker.index()].store(inside, Ordering::Relaxed);
        was_inside
    }
}
