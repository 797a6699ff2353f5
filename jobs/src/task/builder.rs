//! Builds schedulers.

use std::sync::mpsc;
use std::thread::available_parallelism;
use std::time::Duration;
use std::{fmt, io, iter, mem};

use super::affinity::AffinityMask;
use super::queues::Queues;
use super::scheduler::Scheduler;
use super::scheduler_error::SchedulerError;
use super::shared::Shared;
use super::shuffle::Shuffle;
use super::wake_up_cost;
use super::worker_thread::{Hook, WorkerThread};
use crate::sync::{Arc, thread};
use crate::timeline::{Timeline, TimelineSettings};
use crate::unwind::{Contained, catch};

/// A function of the engine's that says something of each worker's thread.
type PerWorker<T> = Contained<Box<dyn Fn(usize) -> T>>;

/// The settings of a scheduler: see [`Scheduler::builder`].
///
/// ```
/// use drawloom_jobs::task::{AffinityMask, Scheduler};
///
/// let scheduler = Scheduler::builder()
///     .workers(3)
///     .name(|worker| format!("frame {worker}"))
///     .on_start(|worker| println!("worker {worker} starts"))
///     .on_stop(|worker| println!("worker {worker} stops"))
///     .build()?;
/// assert_eq!(scheduler.workers(), 3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Default)]
pub struct SchedulerBuilder {
    workers: Option<usize>,
    name: Option<PerWorker<String>>,
    stack_size: Option<usize>,
    affinity: Option<PerWorker<AffinityMask>>,
    on_start: Option<Hook>,
    on_stop: Option<Hook>,
    shuffle: Option<u64>,
    wake_up_cost: Option<Duration>,
    timeline: TimelineSettings,
}

impl Scheduler {
    /// A scheduler with this number of workers, including the calling thread: 1 starts no thread. There may be more
    /// workers than the machine has cores (L 3.3). The threads are named `drawloom-1`, `drawloom-2` and so on.
    ///
    /// # Errors
    /// Returns [`SchedulerError::NoWorkers`] if `workers` is 0, and [`SchedulerError::TooManyWorkers`] if it exceeds
    /// [`MAX_WORKERS`](Self::MAX_WORKERS). Returns [`SchedulerError::Spawn`] if the system does not start a thread;
    /// threads that were started by then have ended.
    pub fn new(workers: usize) -> Result<Self, SchedulerError> {
        Self::builder().workers(workers).build()
    }

    /// A scheduler with as many workers as the process can run threads at once.
    ///
    /// # Errors
    /// Returns [`SchedulerError::UnknownParallelism`] if the system does not report that number, and
    /// [`SchedulerError::Spawn`] as [`new`](Self::new) does.
    pub fn with_available_parallelism() -> Result<Self, SchedulerError> {
        Self::builder().build()
    }

    /// A builder, with which an engine chooses names, processors and hooks of the threads.
    pub fn builder() -> SchedulerBuilder {
        SchedulerBuilder::default()
    }
}

impl SchedulerBuilder {
    /// The size of a thread's stack in bytes if [nothing else](Self::stack_size) is set: 16 MiB, room for 2,000 nested
    /// scopes even without optimisations.
    pub const DEFAULT_STACK_SIZE: usize = 16 << 20;
    /// The smallest stack of a thread in bytes: 256 KiB, which the scheduler's own code and a few nested scopes need.
    pub const MIN_STACK_SIZE: usize = 256 << 10;

    /// Sets the number of workers, including the calling thread: 1 starts no thread. There may be more workers than the
    /// machine has cores (L 3.3). The default is the number of threads that the process can run at once.
    pub fn workers(mut self, workers: usize) -> Self {
        self.workers = Some(workers);
        self
    }

    /// Sets the names of the threads, by the index of the worker, 1 or more. The default is `drawloom-1`, `drawloom-2`
    /// and so on.
    pub fn name(mut self, name: impl Fn(usize) -> String + 'static) -> Self {
        self.name = Some(Contained::new(Box::new(name)));
        self
    }

    /// Sets the size of each thread's stack in bytes. The system rounds it up to whole pages, reserves it as address
    /// space, and gives it memory only where it is used. The default is
    /// [`DEFAULT_STACK_SIZE`](Self::DEFAULT_STACK_SIZE); less than [`MIN_STACK_SIZE`](Self::MIN_STACK_SIZE) counts as
    /// that. The stack of the thread that calls the scheduler is the engine's own choice.
    ///
    /// A scope, loop or graph that a job opens runs on top of that job, so scopes that nest need a stack in proportion
    /// to their depth: some 4 KiB each, beside what the jobs hold.
    pub fn stack_size(mut self, bytes: usize) -> Self {
        self.stack_size = Some(bytes);
        self
    }

    /// Sets the processors that each thread may run on, by the index of the worker, 1 or more. Threads that call the
    /// scheduler are not affected. This needs the feature `affinity`, which is on by default, and Linux or Android.
    /// Elsewhere [`build`](Self::build) returns [`SchedulerError::Affinity`], and [`on_start`](Self::on_start) can
    /// restrict threads.
    ///
    /// Without this the system chooses the processors. If it puts them on the processor of the thread that wakes them,
    /// as on some virtual machines, they are kept off there (with that feature, on Linux and Android), except threads
    /// that [`on_start`](Self::on_start) has placed.
    pub fn affinity(mut self, affinity: impl Fn(usize) -> AffinityMask + 'static) -> Self {
        self.affinity = Some(Contained::new(Box::new(affinity)));
        self
    }

    /// Sets a hook that runs first on each thread that the scheduler starts, with the index of its worker. The
    /// scheduler is built when all hooks have returned.
    pub fn on_start(mut self, hook: impl Fn(usize) + Send + Sync + 'static) -> Self {
        self.on_start = Some(Hook::new(Contained::new(Box::new(hook))));
        self
    }

    /// Sets a hook that runs last on each thread that the scheduler has started, with the index of its worker. Its
    /// panic is reported to [`tracing`] as an error.
    pub fn on_stop(mut self, hook: impl Fn(usize) + Send + Sync + 'static) -> Self {
        self.on_stop = Some(Hook::new(Contained::new(Box::new(hook))));
        self
    }

    /// Runs jobs, and the chunks of loops and graphs, in a pseudo-random order instead of the fastest one. Small work
    /// is not run serially then.
    ///
    /// With one worker the seed alone decides the order of everything, so a failure can be repeated. With several
    /// workers, results that depend on the order of jobs show up.
    pub fn shuffle(mut self, seed: u64) -> Self {
        self.shuffle = Some(seed);
        self
    }

    /// Sets the cost of waking a worker, which is measured otherwise: see [`Scheduler::wake_up_cost`]. With a cost of 0
    /// every loop is parallel from its first chunk on.
    pub fn wake_up_cost(mut self, cost: Duration) -> Self {
        self.wake_up_cost = Some(cost);
        self
    }

    /// Sets how many chunks and idle times the [timeline](Scheduler::timeline) stores for each worker, at 48 bytes
    /// each. The default is 65,536. The number is rounded up to a power of two, up to 16,777,216. The memory is
    /// allocated when the timeline is started.
    pub fn timeline_capacity(mut self, events: usize) -> Self {
        self.timeline.capacity = Some(events);
        self
    }

    /// Sets the clock that the [timeline](Scheduler::timeline) reads instead of the system's: the time since some
    /// moment, which never decreases, on whichever thread it is read. What nodes and stages cost is measured by it too,
    /// so a simulated clock makes what is chosen by these costs the same in each run, if the
    /// [wake-up cost](Self::wake_up_cost) is set. Backends measure what recording costs by the system's clock.
    ///
    /// If the clock panics, it is not called again: time stands still at its latest reading. That is reported to
    /// [`tracing`] as an error, and in [`clock_panic`](crate::timeline::Log::clock_panic) of every log from then on.
    /// Jobs are not affected.
    ///
    /// A worker may call the clock between taking a job and running it. So the clock must not wait for anything that a
    /// job may hold while it waits, such as a lock.
    pub fn timeline_clock(mut self, clock: impl Fn() -> Duration + Send + Sync + 'static) -> Self {
        self.timeline.clock = Some(Contained::new(Box::new(clock)));
        self
    }

    /// Starts the threads.
    ///
    /// # Errors
    /// Returns the [`SchedulerError`] whose condition holds. Threads that were started by then have ended.
    pub fn build(self) -> Result<Scheduler, SchedulerError> {
        self.build_with(|builder, body| builder.spawn(body))
    }

    /// Builds a scheduler with threads that `spawn` starts.
    fn build_with(
        mut self,
        mut spawn: impl FnMut(thread::Builder, Box<dyn FnOnce() + Send>) -> io::Result<thread::JoinHandle<()>>,
    ) -> Result<Scheduler, SchedulerError> {
        let workers = self.checked_workers()?;
        let stack_size = self.stack_size.map_or(Self::DEFAULT_STACK_SIZE, |bytes| bytes.max(Self::MIN_STACK_SIZE));
        let queues_of = |worker| Box::new(Queues::new(self.shuffle.map(|seed| Shuffle::new(seed, worker))));
        let first = queues_of(0);
        let others: Vec<Box<Queues<_>>> = (1..workers).map(queues_of).collect();
        let stealers = iter::once(&first).chain(&others).map(|queues| queues.stealers()).collect();
        let names = (1..workers).map(|worker| self.checked_name(worker)).collect::<Result<Vec<_>, _>>()?;
        let tracks = iter::once("caller".to_owned()).chain(names.iter().cloned()).collect();
        let timeline = Timeline::new(tracks, mem::take(&mut self.timeline));
        let shared = Arc::new(Shared::new(stealers, first, timeline, self.shuffle.is_some()));
        // If a thread cannot be started, the scheduler is dropped and joins those that it has.
        let mut scheduler = Scheduler::without_threads(Arc::clone(&shared));
        let (ready, is_ready) = mpsc::channel();
        for ((index, queues), name) in (1..).zip(others).zip(names) {
            let builder = thread::Builder::new().name(name).stack_size(stack_size);
            let worker_thread = WorkerThread {
                index,
                affinity: self.checked_affinity(index)?,
                on_start: self.on_start.clone(),
                on_stop: self.on_stop.clone(),
                ready: ready.clone(),
                shared: Arc::clone(&shared),
            };
            let thread = spawn(builder, Box::new(move || worker_thread.run(queues)));
            scheduler.add_thread(thread.map_err(|source| SchedulerError::Spawn { worker: index, source })?);
        }
        drop(ready);
        let may_move = self.affinity.is_none();
        if self.affinity.is_some() || self.on_start.is_some() {
            is_ready.into_iter().collect::<Result<(), SchedulerError>>()?;
        }
        shared.set_wake_up_cost(self.wake_up_cost.unwrap_or_else(|| wake_up_cost::measure(&scheduler, may_move)));
        Ok(scheduler)
    }

    fn checked_workers(&self) -> Result<usize, SchedulerError> {
        match self.workers {
            Some(0) => Err(SchedulerError::NoWorkers),
            Some(workers) if workers > Scheduler::MAX_WORKERS => Err(SchedulerError::TooManyWorkers { workers }),
            Some(workers) => Ok(workers),
            None => {
                let threads =
                    available_parallelism().map_err(|source| SchedulerError::UnknownParallelism { source })?;
                Ok(threads.get().min(Scheduler::MAX_WORKERS))
            }
        }
    }

    fn checked_name(&self, worker: usize) -> Result<String, SchedulerError> {
        let name = match &self.name {
            Some(name) => catch(|| name(worker)).map_err(|panic| SchedulerError::NameHook { worker, panic })?,
            None => format!("drawloom-{worker}"),
        };
        if name.contains('\0') { Err(SchedulerError::Name { worker, name }) } else { Ok(name) }
    }

    fn checked_affinity(&self, worker: usize) -> Result<Option<AffinityMask>, SchedulerError> {
        let affinity = self.affinity.as_ref().map(|affinity| catch(|| affinity(worker)));
        affinity.transpose().map_err(|panic| SchedulerError::AffinityHook { worker, panic })
    }
}

impl fmt::Debug for SchedulerBuilder {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("SchedulerBuilder")
            .field("workers", &self.workers)
            .field("shuffle", &self.shuffle)
            .finish_non_exhaustive()
    }
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use std::io;
    use std::sync::mpsc;

    use super::SchedulerError;
    use crate::task::Scheduler;

    #[test]
    fn a_thread_that_cannot_be_started_is_an_error_and_the_others_end() {
        let (ended, has_ended) = mpsc::channel();
        let mut started = 0;
        let outcome = Scheduler::builder().workers(5).build_with(|builder, body| {
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
}
