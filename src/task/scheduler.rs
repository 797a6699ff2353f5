//! The pool of workers, and the two ways to give it work.

use std::{fmt, io, iter, mem, ops::Range, thread::available_parallelism};

use thiserror::Error;

use crate::sync::{Arc, AtomicBool, Deque, Ordering, Stealer, thread};

use super::{
    job::{Job, JobPanic},
    parallel_for::Pass,
    scope::{self, Scope},
    seat::{self, Seat},
    sleep::Sleep,
    worker::{Until, Worker},
};

/// A pool of workers that run jobs: L's Graphics Manager (3.3), as far as it has to do with threads.
///
/// The thread that calls [`scope`](Self::scope) or [`parallel_for`](Self::parallel_for) is a worker for the length of
/// the call, so a scheduler of four workers starts three threads, which sleep as long as there is no work (L 3.3).
///
/// Any number of threads may share a scheduler, but only one from outside is served at a time: the next one waits until
/// the call of the first has returned. A call from within a job, on whichever worker, waits for nobody. It follows that
/// a call waits for ever if the call it has to let pass waits for it in turn. That happens where a body or a job starts
/// a thread that calls the same scheduler, and waits for this thread; where a job of one scheduler calls a second one,
/// and a job of that calls the first from a thread of the second; or where two threads each call one of two schedulers
/// from within a call of the other.
///
/// Dropping the scheduler ends its threads and waits until they are gone.
///
/// ```
/// # use drawloom::task::Scheduler;
/// let scheduler = Scheduler::with_available_parallelism()?;
/// let mut heights = vec![1.0_f32, 2.0, 3.0, 4.0];
/// let (low, high) = heights.split_at_mut(2);
/// scheduler.scope(|scope| {
///     scope.spawn(|_scope, _worker| low.iter_mut().for_each(|height| *height *= 2.0));
///     scope.spawn(|_scope, _worker| high.iter_mut().for_each(|height| *height *= 3.0));
/// })?;
/// assert_eq!(heights, [2.0, 4.0, 9.0, 12.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Scheduler {
    shared: Arc<Shared>,
    threads: Vec<thread::JoinHandle<()>>,
}

impl Scheduler {
    /// The most workers a scheduler can have.
    pub const MOST_WORKERS: usize = 1024;

    /// A scheduler of that many workers, the calling thread included: 1 starts no thread. There may be more workers
    /// than the machine has cores (L 3.3). The threads are named `drawloom-1`, `drawloom-2` and so on.
    ///
    /// # Errors
    ///
    /// [`SchedulerError::NoWorkers`] for 0 and [`SchedulerError::TooManyWorkers`] beyond
    /// [`MOST_WORKERS`](Self::MOST_WORKERS). [`SchedulerError::Spawn`] if the system starts no more threads; those
    /// started by then have ended when this returns.
    pub fn new(workers: usize) -> Result<Self, SchedulerError> {
        Self::start(workers, |builder, body| builder.spawn(body))
    }

    /// A scheduler of as many workers as the process may run threads at once.
    ///
    /// # Errors
    ///
    /// [`SchedulerError::UnknownParallelism`] if the system does not tell, and [`SchedulerError::Spawn`] as with
    /// [`new`](Self::new).
    pub fn with_available_parallelism() -> Result<Self, SchedulerError> {
        let threads = available_parallelism().map_err(|source| SchedulerError::UnknownParallelism { source })?;
        Self::new(threads.get().min(Self::MOST_WORKERS))
    }

    /// How many threads run jobs, the caller included.
    pub fn workers(&self) -> usize {
        self.shared.workers()
    }

    /// Calls `body` with a scope, and returns what it returns when every job spawned in the scope has run and has been
    /// dropped. Jobs may borrow all that outlives the call. While it waits, the thread runs jobs, not all of them its
    /// own.
    ///
    /// # Errors
    ///
    /// The first [`JobPanic`] if `body` or a job panicked. The other jobs have run nevertheless, and the scheduler is
    /// as good as new.
    pub fn scope<'scope, R>(&self, body: impl FnOnce(&Scope<'scope>) -> R) -> Result<R, JobPanic> {
        self.seated(|worker| scope::open(worker, body))
    }

    /// Calls `body` with ranges that cover `0..length`, each index in exactly one, on as many workers as there is work
    /// for, and returns when all calls have.
    ///
    /// The ranges are `chunk` indices long, the last one may be shorter. A chunk of 0 is taken for 1, and a `length`
    /// beyond any slice, more than `isize::MAX`, may get chunks of up to 3. With a single worker or a single chunk
    /// everything happens on the calling thread. `body` is not entered on a worker that is in the midst of it for this
    /// loop, even where it waits for a scope or a loop of its own; and until it has waited, no further worker may join.
    ///
    /// # Errors
    ///
    /// The first [`JobPanic`] if `body` panicked. Chunks that had not been begun by then are skipped.
    pub fn parallel_for(
        &self,
        length: usize,
        chunk: usize,
        body: impl Fn(Range<usize>, &Worker) + Sync,
    ) -> Result<(), JobPanic> {
        if length == 0 {
            return Ok(());
        }
        let pass = Pass::new(length, chunk, body);
        self.seated(|worker| pass.run(worker))
    }

    fn start(
        workers: usize,
        mut spawn: impl FnMut(thread::Builder, Box<dyn FnOnce() + Send>) -> io::Result<thread::JoinHandle<()>>,
    ) -> Result<Self, SchedulerError> {
        if workers == 0 {
            return Err(SchedulerError::NoWorkers);
        }
        if workers > Self::MOST_WORKERS {
            return Err(SchedulerError::TooManyWorkers { workers });
        }
        let first = Deque::new_lifo();
        let others: Vec<Deque<Job>> = (1..workers).map(|_| Deque::new_lifo()).collect();
        let shared = Arc::new(Shared {
            stealers: iter::once(&first).chain(&others).map(Deque::stealer).collect(),
            sleep: Sleep::new(workers),
            seat: Seat::new(first),
            shut_down: AtomicBool::new(false),
        });
        // Where a thread cannot be started, the scheduler is dropped with those it has, and joins them.
        let mut scheduler = Self { shared, threads: Vec::with_capacity(others.len()) };
        for (index, deque) in (1..).zip(others) {
            let shared = Arc::clone(&scheduler.shared);
            let body = Box::new(move || {
                seat::occupy(Worker::new(index, deque, shared), |worker| worker.work(Until::Shutdown));
            });
            let thread = spawn(thread::Builder::new().name(format!("drawloom-{index}")), body)
                .map_err(|source| SchedulerError::Spawn { worker: index, source })?;
            scheduler.threads.push(thread);
        }
        Ok(scheduler)
    }

    /// Calls `body` as the worker this thread is already, or else from the seat. `body` must not unwind.
    fn seated<R>(&self, body: impl FnOnce(&Worker) -> R) -> R {
        if let Some(worker) = seat::current(&self.shared) {
            return body(&worker);
        }
        let deque = self.shared.seat.take();
        let (result, deque) = seat::occupy(Worker::new(0, deque, Arc::clone(&self.shared)), body);
        self.shared.seat.give_back(deque);
        result
    }
}

impl Drop for Scheduler {
    fn drop(&mut self) {
        // Relaxed is enough, as the flag hands nothing over; that sleepers see it is up to the fences of `Sleep`.
        self.shared.shut_down.store(true, Ordering::Relaxed);
        self.shared.sleep.wake_all();
        for thread in mem::take(&mut self.threads) {
            // A worker's thread has nothing to report: the panic of a job was caught with the job.
            let _ = thread.join();
        }
    }
}

impl fmt::Debug for Scheduler {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Scheduler").field("workers", &self.workers()).finish_non_exhaustive()
    }
}

/// A scheduler could not be started.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SchedulerError {
    /// 0 workers were asked for.
    #[error("a scheduler needs at least 1 worker, which is the thread that calls it")]
    NoWorkers,
    /// More than [`Scheduler::MOST_WORKERS`] were asked for.
    #[error("a scheduler has at most {} workers, and {workers} were asked for", Scheduler::MOST_WORKERS)]
    TooManyWorkers {
        /// How many were asked for.
        workers: usize,
    },
    /// The system refused to start a thread.
    #[error("the thread of worker {worker} could not be started")]
    Spawn {
        /// The [index](Worker::index) of the worker it was for.
        worker: usize,
        /// The system's reason.
        source: io::Error,
    },
    /// The system does not tell how many threads run at once.
    #[error("how many threads run at once is unknown")]
    UnknownParallelism {
        /// The system's reason.
        source: io::Error,
    },
}

/// What all workers see of each other.
pub(super) struct Shared {
    /// The way into the deque of each worker.
    stealers: Box<[Stealer<Job>]>,
    sleep: Sleep,
    seat: Seat,
    shut_down: AtomicBool,
}

impl Shared {
    pub(super) fn workers(&self) -> usize {
        self.stealers.len()
    }

    pub(super) fn stealers(&self) -> &[Stealer<Job>] {
        &self.stealers
    }

    pub(super) fn sleep(&self) -> &Sleep {
        &self.sleep
    }

    pub(super) fn is_shut_down(&self) -> bool {
        self.shut_down.load(Ordering::Relaxed)
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use std::{io, sync::mpsc, thread, time::Duration};

    use super::{Scheduler, SchedulerError};

    /// Waits until so many workers sleep, for as long as the slowest machine may take, and says how many do.
    fn sleepers(scheduler: &Scheduler, expected: usize) -> usize {
        for _look in 0..10_000 {
            if scheduler.shared.sleep.sleepers() == expected {
                break;
            }
            thread::sleep(Duration::from_millis(1));
        }
        scheduler.shared.sleep.sleepers()
    }

    #[test]
    fn idle_workers_sleep() {
        let scheduler = Scheduler::new(5).unwrap();
        for _frame in 0..20 {
            assert_eq!(sleepers(&scheduler, 4), 4);
            scheduler.parallel_for(100, 1, |_range, _worker| thread::yield_now()).unwrap();
        }
    }

    #[test]
    fn the_owner_of_a_scope_sleeps_while_its_last_job_runs() {
        let scheduler = Scheduler::new(2).unwrap();
        let (started, has_started) = mpsc::channel();
        let scheduler = &scheduler;
        let outcome = scheduler.scope(|scope| {
            scope.spawn(move |_scope, _worker| {
                started.send(()).unwrap();
                assert_eq!(sleepers(scheduler, 1), 1);
            });
            // The other worker has the job now, so the owner is left with nothing.
            has_started.recv().unwrap();
        });
        assert_eq!(outcome, Ok(()));
    }

    #[test]
    fn a_thread_that_cannot_be_started_is_an_error_and_the_others_end() {
        let (ended, has_ended) = mpsc::channel();
        let mut started = 0;
        let outcome = Scheduler::start(5, |builder, body| {
            if started == 2 {
                return Err(io::Error::other("no more threads"));
            }
            started += 1;
            let ended = ended.clone();
            builder.spawn(move || {
                body();
                ended.send(()).unwrap();
            })
        });
        let Err(SchedulerError::Spawn { worker, source }) = outcome else { panic!("the third thread was refused") };
        assert_eq!((worker, source.to_string().as_str()), (3, "no more threads"));
        assert_eq!(has_ended.try_iter().count(), 2, "the threads have been joined");
    }

    #[test]
    fn a_scheduler_can_be_shared_and_sent() {
        fn is_shared_and_sent<T: Send + Sync>() {}
        is_shared_and_sent::<Scheduler>();
    }
}

#[cfg(all(test, drawloom_loom))]
mod loom_tests {
    use loom::model::Builder;

    use super::Scheduler;
    use crate::sync::{AtomicUsize, Ordering};

    fn bounded(preemptions: usize, run: impl Fn() + Sync + Send + 'static) {
        let mut builder = Builder::new();
        builder.preemption_bound = Some(preemptions);
        builder.check(run);
    }

    #[test]
    fn a_scope_ends_with_its_jobs_wherever_they_run() {
        bounded(2, || {
            let ran = AtomicUsize::new(0);
            let scheduler = Scheduler::new(2).unwrap();
            let outcome = scheduler.scope(|scope| {
                scope.spawn(|scope, _worker| {
                    scope.spawn_pinned(|_scope, worker| {
                        assert_eq!(worker.index(), 0);
                        ran.fetch_add(1, Ordering::Relaxed);
                    });
                });
            });
            assert_eq!(outcome, Ok(()));
            assert_eq!(ran.load(Ordering::Relaxed), 1);
        });
    }

    #[test]
    fn a_loop_gives_each_chunk_once() {
        bounded(2, || {
            let ran = [AtomicUsize::new(0), AtomicUsize::new(0)];
            let scheduler = Scheduler::new(2).unwrap();
            let outcome = scheduler.parallel_for(2, 1, |range, _worker| {
                ran[range.start].fetch_add(1, Ordering::Relaxed);
            });
            assert_eq!(outcome, Ok(()));
            assert_eq!(ran.map(|count| count.load(Ordering::Relaxed)), [1, 1]);
        });
    }
}
