//! The pool of workers, and the ways to give it work.

use std::{
    fmt, mem,
    ops::Range,
    panic::{self, AssertUnwindSafe},
    time::Duration,
};

use crossbeam_utils::CachePadded;

use crate::{
    sync::{Arc, AtomicBool, AtomicUsize, Instant, Ordering, thread},
    timeline::Timeline,
    unwind::{JobPanic, catch, discard},
};

use super::{
    background::BackgroundJob,
    background_queue::BackgroundQueue,
    builder::{SchedulerBuilder, SchedulerError},
    mailbox::Mailbox,
    parallel_for::Pass,
    placement::Placement,
    priority::Priority,
    queue::{Loot, Queues},
    scope::{self, Scope},
    seat::{self, Seat},
    sleep::{Sleep, WakeFor},
    worker::Worker,
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
/// Dropping the scheduler ends its threads and waits until they are gone; so who drops it must not be waited for by one of
/// its jobs. A background job that drops the last share of its own scheduler is no such case.
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
    pub const MAX_WORKERS: usize = 1000;

    /// A scheduler of that many workers, the calling thread included: 1 starts no thread. There may be more workers
    /// than the machine has cores (L 3.3). The threads are named `drawloom-1`, `drawloom-2` and so on.
    ///
    /// # Errors
    ///
    /// [`SchedulerError::NoWorkers`] for 0 and [`SchedulerError::TooManyWorkers`] beyond
    /// [`MAX_WORKERS`](Self::MAX_WORKERS). [`SchedulerError::Spawn`] if the system starts no more threads; those
    /// started by then have ended when this returns.
    pub fn new(workers: usize) -> Result<Self, SchedulerError> {
        Self::builder().workers(workers).build()
    }

    /// A scheduler of as many workers as the process may run threads at once.
    ///
    /// # Errors
    ///
    /// [`SchedulerError::UnknownParallelism`] if the system does not tell, and [`SchedulerError::Spawn`] as with
    /// [`new`](Self::new).
    pub fn with_available_parallelism() -> Result<Self, SchedulerError> {
        Self::builder().build()
    }

    /// A scheduler whose threads have names, places and hooks of the engine's choice.
    pub fn builder() -> SchedulerBuilder {
        SchedulerBuilder::default()
    }

    /// How many threads run jobs, the caller included.
    pub fn workers(&self) -> usize {
        self.shared.workers()
    }

    /// How long it takes from a call of [`Scope::spawn`] until a worker that slept begins on the job, as found in a few tries
    /// while the scheduler was built; 0 with a single worker. A graph whose work takes no longer than this is not shared.
    pub fn wake_up_cost(&self) -> Duration {
        self.shared.wake_up_cost()
    }

    /// What records which worker does what, once it is [started](Timeline::start).
    pub fn timeline(&self) -> &std::sync::Arc<Timeline> {
        self.shared.timeline()
    }

    /// Calls `body` with a scope, and returns what it returns when every job spawned in the scope has run and has been
    /// dropped. Jobs may borrow all that outlives the call.
    ///
    /// While it waits, the thread runs jobs. Called from within a job, those are the jobs of this scope and of what is
    /// opened inside of them, and no others.
    ///
    /// # Errors
    ///
    /// The first [`JobPanic`] if `body` or a job panicked. The other jobs have run nevertheless, and the scheduler is
    /// as good as new.
    pub fn scope<'scope, R>(&self, body: impl FnOnce(&Scope<'scope>) -> R) -> Result<R, JobPanic> {
        self.with_worker(|worker| scope::open(worker, body))
    }

    /// Calls `body` with ranges that cover `0..length`, each index in exactly one, on as many workers as there is work
    /// for, and returns when all calls have.
    ///
    /// The ranges are `chunk` indices long, the last one may be shorter. A chunk of 0 is taken for 1, and a `length`
    /// beyond any slice, more than `isize::MAX`, may get chunks of up to 3. With a single worker or a single chunk
    /// everything happens on the calling thread, and so it does where the first chunks show that the loop is not worth waking
    /// a worker for. `body` is not entered on a worker that is in the midst of it for this
    /// loop, even where it waits for a scope or a loop of its own.
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
            return catch(|| drop(body));
        }
        let pass = Pass::new(length, chunk, body);
        self.with_worker(|worker| pass.run(worker))
    }

    /// Queues a job that no frame waits for. It may take longer than a frame, and is not interrupted. It runs on a worker
    /// other than 0 when that has nothing else to do; or wherever [`run_background`](Self::run_background) is called, which
    /// with a single worker is the only place; or where its end is [waited for](BackgroundJob::wait).
    ///
    /// What it spawns itself, in scopes and loops on this scheduler, is background work as well, unless it is run by who waits
    /// for it: then it is part of that. Jobs that have not begun when the scheduler is dropped run only if they are waited
    /// for.
    pub fn background<T: Send + 'static>(&self, job: impl FnOnce() -> T + Send + 'static) -> BackgroundJob<T> {
        let job = BackgroundJob::queued(self.shared.background(), job);
        self.shared.sleep().wake_beside(Priority::Background);
        job
    }

    /// Runs background jobs on the calling thread, the oldest first, and says how many. It begins none when `budget` has
    /// passed, so it returns late by the length of a job at most. While another thread from outside is being served it
    /// runs none.
    ///
    /// The place for it is between two frames. In a job it runs background jobs on top of that job, as if that had called
    /// them: they must not wait for what that job is part of.
    pub fn run_background(&self, budget: Duration) -> usize {
        let start = Instant::now();
        let work = |worker: &Worker| worker.work_in_background(|| start.elapsed() >= budget);
        seat::with_current(&self.shared, |current| match current {
            Some(worker) => work(worker),
            None => self.shared.seat.try_take().map_or(0, |queues| self.work_seated(queues, work)),
        })
    }

    pub(super) fn without_threads(shared: Arc<Shared>) -> Self {
        Self { shared, threads: Vec::new() }
    }

    pub(super) fn add_thread(&mut self, thread: thread::JoinHandle<()>) {
        self.threads.push(thread);
    }

    pub(super) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    /// Calls `body` as the worker this thread is already, or else from the seat. `body` must not unwind.
    pub(crate) fn with_worker<R>(&self, body: impl FnOnce(&Worker) -> R) -> R {
        seat::with_current(&self.shared, |current| match current {
            Some(worker) => body(worker),
            None => self.work_seated(self.shared.seat.take(), body),
        })
    }

    /// Calls `body` as worker 0, whose queues these are, and gives them back.
    fn work_seated<R>(&self, queues: Box<Queues>, body: impl FnOnce(&Worker) -> R) -> R {
        let worker = Worker::new(0, queues, Arc::clone(&self.shared));
        // `body` catches what is the engine's, and the caller slot must be free again whatever was forgotten.
        let result = panic::catch_unwind(AssertUnwindSafe(|| seat::occupy(&worker, || body(&worker))));
        self.shared.seat.give_back(worker.into_queues());
        result.unwrap_or_else(|payload| panic::resume_unwind(payload))
    }
}

impl Drop for Scheduler {
    fn drop(&mut self) {
        self.shared.shut_down.store(true, Ordering::Relaxed);
        self.shared.sleep.wake_all();
        for thread in mem::take(&mut self.threads) {
            // A background job may own the last share of its own scheduler. Its thread cannot wait for itself, and ends
            // after the job.
            if thread.thread().id() == thread::current().id() {
                continue;
            }
            // A worker's thread has nothing to report: the panic of a job was caught with the job. What is left is that of a
            // destructor of the engine's, such as a thread-local's.
            if let Err(payload) = thread.join() {
                discard(payload);
            }
        }
    }
}

/// Each worker's queued jobs, its mailbox, and what it sleeps for: for looking into a hang. It may be printed at any time, from
/// any thread, and waits for no job.
impl fmt::Debug for Scheduler {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shared = &self.shared;
        let asleep = shared.sleep.asleep();
        let workers = shared.loot.iter().zip(shared.mailboxes()).enumerate().map(|(worker, (loot, mailbox))| {
            let sleeps_until = asleep.iter().find(|(sleeper, _)| *sleeper == worker).map(|(_, wake_for)| wake_for);
            WorkerState { queued: loot.len(), mailbox, sleeps_until }
        });
        formatter
            .debug_struct("Scheduler")
            .field("workers", &workers.collect::<Vec<_>>())
            .field("background_jobs", &shared.background.len())
            .field("serves_a_thread", &!shared.seat.is_free())
            .finish_non_exhaustive()
    }
}

/// What others see of a worker: how many jobs lie in its queues and its mailbox, and for what it sleeps, if it does.
struct WorkerState<'state> {
    queued: usize,
    mailbox: &'state Mailbox,
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

/// What all workers see of each other.
pub(super) struct Shared {
    /// The way into the queues of each worker.
    loot: Box<[Loot]>,
    mailboxes: Box<[CachePadded<Mailbox>]>,
    /// Not the model checker's `Arc`, which has no weak form: whoever waits for a job may outlive the scheduler.
    background: std::sync::Arc<BackgroundQueue>,
    sleep: Sleep,
    placement: Placement,
    seat: Seat,
    /// Not the model checker's `Arc`: who submits frames has a share as well.
    timeline: std::sync::Arc<Timeline>,
    is_shuffled: bool,
    /// In nanoseconds.
    wake_up_cost: AtomicUsize,
    is_live: AtomicBool,
    shut_down: AtomicBool,
}

impl Shared {
    pub(super) fn new(loot: Box<[Loot]>, first: Box<Queues>, timeline: Timeline, is_shuffled: bool) -> Self {
        Self {
            mailboxes: loot.iter().map(|_| CachePadded::new(Mailbox::new())).collect(),
            background: std::sync::Arc::new(BackgroundQueue::new()),
            sleep: Sleep::new(loot.len()),
            placement: Placement::new(),
            seat: Seat::new(first),
            timeline: std::sync::Arc::new(timeline),
            loot,
            is_shuffled,
            wake_up_cost: AtomicUsize::new(0),
            is_live: AtomicBool::new(false),
            shut_down: AtomicBool::new(false),
        }
    }

    #[inline]
    pub(super) fn workers(&self) -> usize {
        self.loot.len()
    }

    pub(super) fn loot(&self) -> &[Loot] {
        &self.loot
    }

    pub(super) fn mailbox(&self, worker: usize) -> &Mailbox {
        &self.mailboxes[worker]
    }

    pub(super) fn mailboxes(&self) -> impl Iterator<Item = &Mailbox> {
        self.mailboxes.iter().map(|mailbox| &**mailbox)
    }

    pub(super) fn background(&self) -> &std::sync::Arc<BackgroundQueue> {
        &self.background
    }

    pub(super) fn sleep(&self) -> &Sleep {
        &self.sleep
    }

    pub(super) fn placement(&self) -> &Placement {
        &self.placement
    }

    #[inline]
    pub(super) fn timeline(&self) -> &std::sync::Arc<Timeline> {
        &self.timeline
    }

    #[inline]
    pub(super) fn is_shuffled(&self) -> bool {
        self.is_shuffled
    }

    // The rest are hints and a flag that hand nothing over, so relaxed is enough. That sleepers see the flag is up to the lock
    // that `Sleep::wake_all` takes.

    pub(super) fn wake_up_cost(&self) -> Duration {
        Duration::from_nanos(self.wake_up_cost.load(Ordering::Relaxed) as u64)
    }

    pub(super) fn set_wake_price(&self, price: Duration) {
        self.wake_up_cost.store(price.as_nanos().try_into().unwrap_or(usize::MAX), Ordering::Relaxed);
    }

    /// Whether a frame, or whatever a thread from outside has called for, is being worked on.
    pub(super) fn is_live(&self) -> bool {
        self.is_live.load(Ordering::Relaxed)
    }

    pub(super) fn set_live(&self, is_live: bool) {
        self.is_live.store(is_live, Ordering::Relaxed);
    }

    pub(super) fn is_shut_down(&self) -> bool {
        self.shut_down.load(Ordering::Relaxed)
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use std::{sync::mpsc, thread, time::Duration};

    use super::Scheduler;

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
