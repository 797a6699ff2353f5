//! Scheduler.

use std::{io, mem, ops::Range};

use thiserror::Error;

use crate::sync::{Arc, AtomicBool, Condvar, Deque, Mutex, Ordering, Stealer, thread};

use super::{
    job::{Job, JobPanic},
    parallel_for::Pass,
    scope::{self, Scope},
    sleep::Sleep,
    worker::{Until, Worker, occupy},
};

/// Owns the worker threads.
pub struct Scheduler {
    shared: Arc<Shared>,
    threads: Vec<thread::JoinHandle<()>>,
}

impl Scheduler {
    /// The most workers a scheduler can have.
    pub const MOST_WORKERS: usize = 1024;

    /// Starts a scheduler.
    ///
    /// # Errors
    ///
    /// [`SchedulerError`].
    pub fn new(workers: usize) -> Result<Self, SchedulerError> {
        Self::start(workers, |builder, body| builder.spawn(body))
    }

    /// As many workers as the machine runs threads at once.
    ///
    /// # Errors
    ///
    /// [`SchedulerError`].
    pub fn with_available_parallelism() -> Result<Self, SchedulerError> {
        let parallelism =
            std::thread::available_parallelism().map_err(|source| SchedulerError::UnknownParallelism { source })?;
        Self::new(parallelism.get().min(Self::MOST_WORKERS))
    }

    /// Every thread that runs jobs, the caller included.
    pub fn workers(&self) -> usize {
        self.shared.stealers.len()
    }

    /// Opens a scope.
    ///
    /// # Errors
    ///
    /// [`JobPanic`].
    pub fn scope<'scope, R>(&self, body: impl FnOnce(&Scope<'scope>) -> R) -> Result<R, JobPanic> {
        self.seated(|worker| scope::open(worker, body))
    }

    /// Calls `body` with every index.
    ///
    /// # Errors
    ///
    /// [`JobPanic`].
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
        spawn: impl Fn(thread::Builder, Box<dyn FnOnce() + Send>) -> io::Result<thread::JoinHandle<()>>,
    ) -> Result<Self, SchedulerError> {
        if workers == 0 {
            return Err(SchedulerError::NoWorkers);
        }
        if workers > Self::MOST_WORKERS {
            return Err(SchedulerError::TooManyWorkers { workers });
        }
        let seat = Deque::new_lifo();
        let others: Vec<Deque<Job>> = (1..workers).map(|_| Deque::new_lifo()).collect();
        let stealers = std::iter::once(&seat).chain(&others).map(Deque::stealer).collect();
        let shared = Arc::new(Shared {
            stealers,
            sleep: Sleep::new(workers),
            seat: Seat::new(seat),
            shut_down: AtomicBool::new(false),
        });
        // From here on an early return drops the scheduler, which joins the threads that have been started.
        let mut scheduler = Self { shared, threads: Vec::with_capacity(others.len()) };
        for (worker, deque) in (1..).zip(others) {
            let shared = Arc::clone(&scheduler.shared);
            let builder = thread::Builder::new().name(format!("drawloom-{worker}"));
            let body = Box::new(move || {
                occupy(worker, deque, shared, |worker| worker.work(Until::Shutdown));
            });
            let thread = spawn(builder, body).map_err(|source| SchedulerError::Spawn { worker, source })?;
            scheduler.threads.push(thread);
        }
        Ok(scheduler)
    }

    fn seated<R>(&self, body: impl FnOnce(&Worker) -> R) -> R {
        if let Some(worker) = Worker::current(&self.shared) {
            return body(&worker);
        }
        let deque = self.shared.seat.take();
        let (result, deque) = occupy(0, deque, Arc::clone(&self.shared), body);
        self.shared.seat.give_back(deque);
        result
    }
}

impl Drop for Scheduler {
    fn drop(&mut self) {
        self.shared.shut_down.store(true, Ordering::Release);
        self.shared.sleep.wake_all();
        for thread in mem::take(&mut self.threads) {
            // A worker has nothing to say at its end: what panics in a job is caught there.
            let _ = thread.join();
        }
    }
}

/// A scheduler could not be started.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SchedulerError {
    /// Nobody would run the jobs.
    #[error("a scheduler needs at least one worker, the thread that calls it")]
    NoWorkers,
    /// More workers than [`Scheduler::MOST_WORKERS`].
    #[error("{workers} workers were asked for, and a scheduler has {} at most", Scheduler::MOST_WORKERS)]
    TooManyWorkers {
        /// How many were asked for.
        workers: usize,
    },
    /// The system refused to start a thread. Those started before it have ended.
    #[error("the thread of worker {worker} could not be started")]
    Spawn {
        /// The worker whose thread it was.
        worker: usize,
        /// What the system said.
        source: io::Error,
    },
    /// The system did not say how many threads it runs at once.
    #[error("the number of threads that run at once is unknown")]
    UnknownParallelism {
        /// What the system said.
        source: io::Error,
    },
}

/// What all workers see.
pub(super) struct Shared {
    stealers: Box<[Stealer<Job>]>,
    sleep: Sleep,
    seat: Seat,
    shut_down: AtomicBool,
}

impl Shared {
    pub(super) fn stealers(&self) -> &[Stealer<Job>] {
        &self.stealers
    }

    pub(super) fn sleep(&self) -> &Sleep {
        &self.sleep
    }

    pub(super) fn is_shut_down(&self) -> bool {
        self.shut_down.load(Ordering::Acquire)
    }
}

/// Worker 0, who is no thread of the scheduler's own but whoever calls it.
struct Seat {
    /// The seat's deque, while nobody sits there.
    deque: Mutex<Option<Deque<Job>>>,
    freed: Condvar,
}

impl Seat {
    fn new(deque: Deque<Job>) -> Self {
        Self { deque: Mutex::new(Some(deque)), freed: Condvar::new() }
    }

    /// Waits until nobody sits there, and takes the seat.
    fn take(&self) -> Deque<Job> {
        let mut free = self.deque.lock();
        loop {
            if let Some(deque) = free.take() {
                return deque;
            }
            free = self.freed.wait(free);
        }
    }

    fn give_back(&self, deque: Deque<Job>) {
        *self.deque.lock() = Some(deque);
        self.freed.notify_one();
    }
}
