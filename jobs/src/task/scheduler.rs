//! The pool of workers, and the ways to give it work.

use std::ops::Range;
use std::panic::{self, AssertUnwindSafe};
use std::time::Duration;
use std::{fmt, mem};

use super::background_job::BackgroundJob;
use super::current_worker;
use super::mailbox::Mailbox;
use super::parallel_loop::ParallelLoop;
use super::queues::Queues;
use super::scope::{self, Scope};
use super::shared::Shared;
use super::sleep::{self, WakeFor};
use super::worker::Worker;
use crate::sync::{Arc, Instant, Mutex, thread};
use crate::timeline::Timeline;
use crate::unwind::{Contained, JobPanic, catch, discard};

/// A pool of workers that run jobs: the thread management of the Graphics Manager in L 3.3.
///
/// The thread that calls [`scope`](Self::scope) or [`parallel_for`](Self::parallel_for) is a worker for the length of
/// the call, so a scheduler of four workers starts three threads. They sleep while there is no work (L 3.3).
///
/// Any number of threads may share a scheduler, but it serves only one thread from outside at a time: the next one
/// waits until the call of the first has returned. A call inside a job, on any worker, does not wait for other calls.
/// So a call waits for ever if the call before it waits for it in turn. That happens in three cases:
///
/// - A body or a job starts a thread that calls the same scheduler, and waits for this thread.
/// - A job of one scheduler calls a second one, and a job of the second calls the first from a thread of the second.
/// - Two threads each call one of two schedulers inside a call of the other.
///
/// Dropping the scheduler ends its threads and waits for them, so none of its jobs may wait for the thread that drops
/// it. A background job may drop the last reference to its own scheduler.
///
/// ```
/// # use drawloom_jobs::task::Scheduler;
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
    shared: Arc<Shared<Worker>>,
    threads: Vec<thread::JoinHandle<()>>,
}

impl Scheduler {
    /// The most workers of a scheduler.
    pub const MAX_WORKERS: usize = sleep::MAX_WORKERS;

    /// How many workers the scheduler has, including the caller.
    pub fn workers(&self) -> usize {
        self.shared.workers()
    }

    /// The time from a call of [`Scope::spawn`] until a worker that slept begins the job. It is measured in a few tries
    /// while the scheduler is built, and is 0 with a single worker. A graph with less work than this runs on the
    /// calling thread alone.
    pub fn wake_up_cost(&self) -> Duration {
        self.shared.wake_up_cost()
    }

    /// Records which worker does what, once it is [started](Timeline::start).
    pub fn timeline(&self) -> &std::sync::Arc<Timeline> {
        self.shared.timeline()
    }

    /// Calls `body` with a scope, and returns its result when all jobs of the scope have run and have been dropped.
    /// Jobs may borrow anything that outlives the call.
    ///
    /// While the thread waits, it runs jobs. If it was called inside a job, it runs only jobs of this scope and of
    /// scopes, loops and graphs inside of it.
    ///
    /// # Errors
    /// Returns the first [`JobPanic`] if `body` or a job panicked. The other jobs have run nevertheless, and the
    /// scheduler works as before.
    pub fn scope<'scope, R>(&self, body: impl FnOnce(&Scope<'scope>) -> R) -> Result<R, JobPanic> {
        self.with_worker(|worker| scope::open(worker, body))
    }

    /// Calls `body` with ranges that cover each index of `0..length` once, on as many workers as there is work for.
    /// Returns when all calls have returned.
    ///
    /// The ranges are `chunk` indices long; the last one may be shorter. A chunk of 0 counts as 1, and a `length` of
    /// more than `isize::MAX` may get chunks of up to 3. With a single worker or a single chunk all calls happen on the
    /// calling thread. The same happens if the first chunks show that the loop is not worth waking a worker. A worker
    /// that waits inside `body`, for a scope or a loop of its own, does not enter `body` again for this loop.
    ///
    /// # Errors
    /// Returns the first [`JobPanic`] if `body` panicked. Chunks that had not begun by then are skipped.
    pub fn parallel_for(
        &self,
        length: usize,
        chunk: usize,
        body: impl Fn(Range<usize>, &Worker) + Sync,
    ) -> Result<(), JobPanic> {
        if length == 0 {
            return catch(|| drop(body));
        }
        let parallel_loop = ParallelLoop::new(length, chunk, body);
        self.with_worker(|worker| parallel_loop.run(worker))
    }

    /// Calls `body` with each item of an iterator once, on as many workers as there is work for: with chunks of a slice
    /// that it may change, or with those of several slices at once. Returns when all calls have returned.
    ///
    /// Workers take the items one after the other, in the iterator's order, and one at a time takes: give an item some
    /// microseconds of work. Apart from that it is as [`parallel_for`](Self::parallel_for) with a chunk of 1.
    ///
    /// ```
    /// # use drawloom_jobs::task::Scheduler;
    /// let scheduler = Scheduler::with_available_parallelism()?;
    /// let (mut heights, speeds) = (vec![9.0_f32; 10_000], vec![0.5_f32; 10_000]);
    /// let chunks = heights.chunks_mut(1_000).zip(speeds.chunks(1_000));
    /// scheduler.parallel_for_each(chunks, |(heights, speeds), _worker| {
    ///     heights.iter_mut().zip(speeds).for_each(|(height, speed)| *height -= speed);
    /// })?;
    /// assert!(heights.iter().all(|height| *height == 8.5));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Returns the first [`JobPanic`] if `body` or the iterator panicked. Items that had not been taken by then are
    /// skipped.
    pub fn parallel_for_each<I: ExactSizeIterator + Send>(
        &self,
        items: I,
        body: impl Fn(I::Item, &Worker) + Sync,
    ) -> Result<(), JobPanic> {
        // If the iterator panics, both are dropped here.
        let (items, body) = (Contained::new(items), Contained::new(body));
        let length = catch(|| items.len())?;
        let (items, body) = (Mutex::new(items.into_inner()), body.into_inner());
        // It moves in, so that a panic of what it drops is caught too.
        self.parallel_for(length, 1, move |_, worker| {
            let taken = items.lock().next();
            if let Some(item) = taken {
                body(item, worker);
            }
        })
    }

    /// Queues a job that no frame waits for. It may take longer than a frame, and is not interrupted. It runs on a
    /// worker other than 0 that has nothing else to do, of which [a few](Self::set_background_workers) do so at once,
    /// in [`run_background`](Self::run_background), or in [`BackgroundJob::wait`]. With a single worker only the last
    /// two run it.
    ///
    /// The scopes and loops that it opens on this scheduler are background work as well. If a thread runs the job by
    /// waiting for it, they are part of that thread's work instead. Jobs that have not begun when the scheduler is
    /// dropped run only if a thread waits for them. A job that owns its scheduler keeps both in memory until it has
    /// run: with a single worker for ever, if nobody runs it.
    pub fn background<T: Send + 'static>(&self, job: impl FnOnce() -> T + Send + 'static) -> BackgroundJob<T> {
        let job = BackgroundJob::queued(self.shared.background(), job);
        self.shared.wake_for_background();
        job
    }

    /// Sets how many workers run background jobs at once, so that long ones leave the others to frames: at first a
    /// quarter of the workers, and at least one. With 0 they run only in [`run_background`](Self::run_background) and
    /// [`BackgroundJob::wait`], which this does not limit. A scheduler of two workers has one thread beside its caller,
    /// which a background job occupies as long as it runs.
    ///
    /// What Drawloom does in the background is among them: streaming, asynchronous post-processing, and pipelines that
    /// are prepared. So a load of ten seconds, on a scheduler with one such worker, holds them up for as long.
    ///
    /// An engine that shows a loading screen raises it to [`workers`](Self::workers), and lowers it again when frames
    /// count. Jobs that have begun then go on.
    pub fn set_background_workers(&self, workers: usize) {
        self.shared.background_slots().set_limit(workers);
        self.shared.wake_for_background();
    }

    /// Runs background jobs on the calling thread, the oldest first, and returns how many. It begins no job after
    /// `budget` has passed, so it returns late by the length of one job at most. While the scheduler serves another
    /// thread from outside, it runs none.
    ///
    /// Call it between two frames. Inside a job it runs background jobs on top of that job, as if the job had called
    /// them: they must not wait for anything that the job is part of.
    pub fn run_background(&self, budget: Duration) -> usize {
        let start = Instant::now();
        let work = |worker: &Worker| worker.work_in_background(|| start.elapsed() >= budget);
        current_worker::with_current(&self.shared, |current| match current {
            Some(worker) => work(worker),
            None => self.shared.caller_slot().try_take().map_or(0, |queues| self.work_as_caller(queues, work)),
        })
    }

    pub(super) fn without_threads(shared: Arc<Shared<Worker>>) -> Self {
        Self { shared, threads: Vec::new() }
    }

    pub(super) fn add_thread(&mut self, thread: thread::JoinHandle<()>) {
        self.threads.push(thread);
    }

    pub(super) fn shared(&self) -> &Arc<Shared<Worker>> {
        &self.shared
    }

    /// Calls `body` with the worker that this thread is. If it is none, the thread takes the caller slot for the length
    /// of the call. `body` must not unwind.
    pub(crate) fn with_worker<R>(&self, body: impl FnOnce(&Worker) -> R) -> R {
        current_worker::with_current(&self.shared, |current| match current {
            Some(worker) => body(worker),
            None => self.work_as_caller(self.shared.caller_slot().take(), body),
        })
    }

    /// Calls `body` with worker 0, to which these queues belong, and frees the caller slot.
    fn work_as_caller<R>(&self, queues: Box<Queues<Worker>>, body: impl FnOnce(&Worker) -> R) -> R {
        let worker = Worker::new(0, queues, Arc::clone(&self.shared));
        // `body` catches the panics of the engine's code. If it missed one, the caller slot must be freed nevertheless.
        let result = panic::catch_unwind(AssertUnwindSafe(|| current_worker::enter(&worker, || body(&worker))));
        self.shared.caller_slot().release(worker.into_queues());
        result.unwrap_or_else(|payload| panic::resume_unwind(payload))
    }
}

impl Drop for Scheduler {
    fn drop(&mut self) {
        self.shared.shut_down();
        for thread in mem::take(&mut self.threads) {
            // A background job may drop the last reference to its own scheduler. Its thread cannot wait for itself, and
            // ends after the job.
            if thread.thread().id() == thread::current().id() {
                continue;
            }
            // Panics of jobs have been caught. What remains is the panic of a destructor of the engine's, such as that
            // of a thread-local.
            if let Err(payload) = thread.join() {
                discard(payload);
            }
        }
    }
}

/// Shows the queued jobs of each worker, its mailbox, and what it sleeps for, to investigate a hang. Any thread may
/// print it at any time; it waits for no job.
impl fmt::Debug for Scheduler {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shared = &self.shared;
        let sleeping = shared.sleep().sleeping();
        let workers = shared.stealers().iter().zip(shared.mailboxes()).enumerate();
        let workers = workers.map(|(worker, (stealers, mailbox))| {
            let sleeps_until = sleeping.iter().find(|(sleeper, _)| *sleeper == worker).map(|(_, wake_for)| wake_for);
            WorkerState { queued: stealers.len(), mailbox, sleeps_until }
        });
        formatter
            .debug_struct("Scheduler")
            .field("workers", &workers.collect::<Vec<_>>())
            .field("background_jobs", &shared.background().len())
            .field("serves_a_thread", &!shared.caller_slot().is_free())
            .finish_non_exhaustive()
    }
}

/// How many jobs are in a worker's queues and mailbox, and what the worker sleeps for, if it sleeps.
struct WorkerState<'state> {
    queued: usize,
    mailbox: &'state Mailbox<Worker>,
    sleeps_until: Option<&'state WakeFor>,
}

impl fmt::Debug for WorkerState<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Worker")
            .field("queued", &self.queued)
            .field("mailbox", self.mailbox)
            .field("sleeps_until", &self.sleeps_until)
            .finish()
    }
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use std::sync::mpsc;
    use std::thread;
    use std::time::Duration;

    use super::Scheduler;

    /// Waits until this many workers sleep, for as long as the slowest machine may take, and returns how many do.
    fn sleepers(scheduler: &Scheduler, expected: usize) -> usize {
        let sleep = scheduler.shared.sleep();
        for _look in 0..10_000 {
            if sleep.sleepers() == expected {
                break;
            }
            thread::sleep(Duration::from_millis(1));
        }
        sleep.sleepers()
    }

    #[test]
    fn idle_workers_sleep() {
        let scheduler = Scheduler::new(5).unwrap();
        for _frame in 0..if cfg!(miri) { 5 } else { 20 } {
            assert_eq!(sleepers(&scheduler, 4), 4);
            scheduler.parallel_for(100, 1, |_range, _worker| thread::yield_now()).unwrap();
        }
    }

    #[test]
    #[cfg_attr(miri, ignore = "time does not pass as usual")]
    fn a_worker_that_was_awake_between_frames_sleeps_in_the_end() {
        let builder = Scheduler::builder().workers(2).wake_up_cost(Duration::from_millis(1));
        let scheduler = builder.build().unwrap();
        let spin = || scheduler.shared.frame_gaps().spin();
        let frame = || scheduler.scope(|scope| scope.spawn(|_scope, _worker| thread::yield_now())).unwrap();
        let is_awake_after_a_frame = |_attempt| {
            frame();
            spin() == Duration::from_micros(500)
        };
        // On a busy machine some gaps are long.
        assert!((0..1000).any(is_awake_after_a_frame));
        assert_eq!(sleepers(&scheduler, 1), 1);
        for _frame in 0..40 {
            thread::sleep(Duration::from_millis(1));
            frame();
        }
        assert_eq!(spin(), Duration::ZERO);
        assert_eq!(sleepers(&scheduler, 1), 1);
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
            // The other worker runs the job now, so the owner has nothing to do.
            has_started.recv().unwrap();
        });
        assert_eq!(outcome, Ok(()));
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
    fn a_loop_runs_each_chunk_once() {
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
