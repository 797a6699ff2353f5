//! A scheduler to an engine's measure.

use std::{fmt, io, iter, mem, sync::mpsc, thread::available_parallelism, time::Duration};

use thiserror::Error;

use crate::{
    sync::{Arc, thread},
    timeline::{Timeline, TimelineSettings},
    unwind::{AbortOnUnwind, JobPanic, catch, emit},
};

use super::{
    affinity::AffinityMask,
    placement::Placement,
    queue::Queues,
    scheduler::{Scheduler, Shared},
    seat,
    shuffle::Shuffle,
    wake_up_cost,
    worker::{Until, Worker},
};

/// How a scheduler is to be: see [`Scheduler::builder`].
///
/// ```
/// use drawloom::task::{AffinityMask, Scheduler};
///
/// let scheduler = Scheduler::builder()
///     .workers(3)
///     .name(|worker| format!("frame {worker}"))
///     .on_start(|worker| println!("worker {worker} is there"))
///     .on_stop(|worker| println!("worker {worker} goes"))
///     .build()?;
/// assert_eq!(scheduler.workers(), 3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Default)]
pub struct SchedulerBuilder {
    workers: Option<usize>,
    name: Option<Box<dyn Fn(usize) -> String>>,
    affinity: Option<Box<dyn Fn(usize) -> AffinityMask>>,
    on_start: Option<Hook>,
    on_stop: Option<Hook>,
    shuffle: Option<u64>,
    wake_up_cost: Option<Duration>,
    timeline: TimelineSettings,
}

/// Not the model checker's `Arc`, which cannot hold what has no size.
type Hook = std::sync::Arc<dyn Fn(usize) + Send + Sync>;

impl SchedulerBuilder {
    /// So many workers, the calling thread included: 1 starts no thread. There may be more workers than the machine has
    /// cores (L 3.3). Without this there are as many as the process may run threads at once.
    pub fn workers(mut self, workers: usize) -> Self {
        self.workers = Some(workers);
        self
    }

    /// What the thread of a worker, 1 or more, is called. Without this they are `drawloom-1`, `drawloom-2` and so on.
    pub fn name(mut self, name: impl Fn(usize) -> String + 'static) -> Self {
        self.name = Some(Box::new(name));
        self
    }

    /// On which processors the thread of a worker, 1 or more, may run. Threads that call the scheduler stay where they
    /// are. Only Linux and Android do this; for other systems there is [`on_start`](Self::on_start).
    ///
    /// Without this they run wherever the system puts them. Where that is the processor of the thread that wakes them, as on
    /// some virtual machines, they are kept off there (on Linux and Android), but for those that
    /// [`on_start`](Self::on_start) has placed.
    pub fn affinity(mut self, affinity: impl Fn(usize) -> AffinityMask + 'static) -> Self {
        self.affinity = Some(Box::new(affinity));
        self
    }

    /// What each thread that the scheduler starts does first, with the index of its worker. The scheduler is built when
    /// all have done so.
    pub fn on_start(mut self, hook: impl Fn(usize) + Send + Sync + 'static) -> Self {
        self.on_start = Some(Hook::from(Box::new(hook) as Box<dyn Fn(usize) + Send + Sync>));
        self
    }

    /// What each thread that the scheduler has started does last, with the index of its worker. Its panic is reported to
    /// [`tracing`] as an error.
    pub fn on_stop(mut self, hook: impl Fn(usize) + Send + Sync + 'static) -> Self {
        self.on_stop = Some(Hook::from(Box::new(hook) as Box<dyn Fn(usize) + Send + Sync>));
        self
    }

    /// Lets jobs that could be next run in a pseudo-random order, and the chunks of loops and graphs too, rather than in
    /// the order that is fastest. Nothing is run one after another only because it is small.
    ///
    /// With one worker all happens in an order that the seed alone decides, so that a failure can be replayed. With
    /// several, results that depend on the order of jobs come to light.
    pub fn shuffle(mut self, seed: u64) -> Self {
        self.shuffle = Some(seed);
        self
    }

    /// What it costs to wake a worker, instead of what is measured when the scheduler is built: see
    /// [`Scheduler::wake_up_cost`]. With a price of 0 every loop is shared from its first chunk on.
    pub fn wake_up_cost(mut self, price: Duration) -> Self {
        self.wake_up_cost = Some(price);
        self
    }

    /// For how many chunks and idle times each worker has room in the [timeline](Scheduler::timeline), 65,536 without this, of
    /// 48 bytes each. It is rounded up to a power of two, to 16,777,216 at most, and memory is asked for when the timeline is
    /// started.
    pub fn timeline_capacity(mut self, events: usize) -> Self {
        self.timeline.capacity = Some(events);
        self
    }

    /// The clock that the [timeline](Scheduler::timeline) reads, instead of the system's: the time since some moment, which
    /// never goes back, whichever thread asks.
    ///
    /// If it panics it is not called again: time stands still at its latest reading, which is reported to [`tracing`] as an
    /// error, and every [log](crate::timeline::Log::clock_panic) from then on says so. Jobs are not affected.
    ///
    /// A worker may call it between taking a job and running it. So it must not wait for anything that a job may hold while
    /// that waits, such as a lock.
    pub fn timeline_clock(mut self, clock: impl Fn() -> Duration + Send + Sync + 'static) -> Self {
        self.timeline.clock = Some(Box::new(clock));
        self
    }

    /// Starts the threads.
    ///
    /// # Errors
    ///
    /// [`SchedulerError`], whose variants say when. Threads that were started by then have ended when this returns.
    pub fn build(self) -> Result<Scheduler, SchedulerError> {
        self.build_with(|builder, body| builder.spawn(body))
    }

    /// `spawn` starts a thread, or fails to.
    pub(super) fn build_with(
        mut self,
        mut spawn: impl FnMut(thread::Builder, Box<dyn FnOnce() + Send>) -> io::Result<thread::JoinHandle<()>>,
    ) -> Result<Scheduler, SchedulerError> {
        let workers = self.checked_workers()?;
        let queues_of = |worker| Box::new(Queues::new(self.shuffle.map(|seed| Shuffle::new(seed, worker))));
        let first = queues_of(0);
        let others: Vec<Box<Queues>> = (1..workers).map(queues_of).collect();
        let loot = iter::once(&first).chain(&others).map(|queues| queues.loot()).collect();
        let names = (1..workers).map(|worker| self.checked_name(worker)).collect::<Result<Vec<_>, _>>()?;
        let lanes = iter::once("caller".to_owned()).chain(names.iter().cloned()).collect();
        let timeline = Timeline::new(lanes, mem::take(&mut self.timeline));
        let shared = Arc::new(Shared::new(loot, first, timeline, self.shuffle.is_some()));
        // Where a thread cannot be started, the scheduler is dropped with those it has, and joins them.
        let mut scheduler = Scheduler::without_threads(Arc::clone(&shared));
        let (ready, is_ready) = mpsc::channel();
        for ((index, queues), name) in (1..).zip(others).zip(names) {
            let builder = thread::Builder::new().name(name);
            let affinity = self.checked_affinity(index)?;
            let hooks = [&self.on_start, &self.on_stop].map(Clone::clone);
            let life = Life { index, affinity, hooks, ready: ready.clone(), shared: Arc::clone(&shared) };
            let thread = spawn(builder, Box::new(move || life.run(queues)));
            scheduler.add_thread(thread.map_err(|source| SchedulerError::Spawn { worker: index, source })?);
        }
        drop(ready);
        let may_move = self.affinity.is_none();
        if self.affinity.is_some() || self.on_start.is_some() {
            is_ready.into_iter().collect::<Result<(), SchedulerError>>()?;
        }
        shared.set_wake_price(self.wake_up_cost.unwrap_or_else(|| wake_up_cost::measure(&scheduler, may_move)));
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

/// What the thread of a worker does from its first moment to its last.
struct Life {
    index: usize,
    affinity: Option<AffinityMask>,
    /// What to do first, and what last.
    hooks: [Option<Hook>; 2],
    ready: mpsc::Sender<Result<(), SchedulerError>>,
    shared: Arc<Shared>,
}

impl Life {
    fn run(self, queues: Box<Queues>) {
        let outcome = self.prepare();
        let is_ready = outcome.is_ok();
        let Self { index, hooks: [_, on_stop], ready, shared, .. } = self;
        // Nobody may be waiting for this.
        let _ = ready.send(outcome);
        drop(ready);
        if !is_ready {
            return;
        }
        let worker = Worker::new(index, queues, shared);
        // A lost worker would keep whoever waits for its jobs waiting for ever.
        let guard = AbortOnUnwind::new("a worker's thread");
        seat::occupy(&worker, || worker.work(Until::Shutdown));
        guard.disarm();
        if let Some(on_stop) = on_stop
            && let Err(panic) = catch(|| on_stop(index))
        {
            emit(|| tracing::error!(worker = index, message = %panic, "the hook at the end of a worker's thread"));
        }
    }

    fn prepare(&self) -> Result<(), SchedulerError> {
        let worker = self.index;
        let at_first = Placement::of_this_thread();
        if let Some(affinity) = &self.affinity {
            affinity.apply().map_err(|source| SchedulerError::Affinity {
                worker,
                affinity: affinity.clone(),
                source,
            })?;
        }
        let [on_start, _] = &self.hooks;
        if let Some(on_start) = on_start {
            catch(|| on_start(worker)).map_err(|panic| SchedulerError::StartHook { worker, panic })?;
        }
        self.shared.placement().add_this_thread(at_first);
        Ok(())
    }
}

/// A scheduler could not be started.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SchedulerError {
    /// 0 workers were asked for.
    #[error("a scheduler needs at least 1 worker, which is the thread that calls it")]
    NoWorkers,
    /// More than [`Scheduler::MAX_WORKERS`] were asked for.
    #[error("a scheduler has at most {} workers, and {workers} were asked for", Scheduler::MAX_WORKERS)]
    TooManyWorkers {
        /// How many were asked for.
        workers: usize,
    },
    /// The system does not tell how many threads run at once.
    #[error("how many threads run at once is unknown")]
    UnknownParallelism {
        /// The system's reason.
        source: io::Error,
    },
    /// A thread's name has a null character in it.
    #[error("the thread of worker {worker} cannot be named {name:?}, as that has a null character in it")]
    Name {
        /// The [index](Worker::index) of the worker it was for.
        worker: usize,
        /// The name.
        name: String,
    },
    /// What was to name a thread panicked.
    #[error("the hook that names the thread of worker {worker} failed: {}", panic.message)]
    NameHook {
        /// The [index](Worker::index) of the worker.
        worker: usize,
        /// The panic.
        panic: JobPanic,
    },
    /// What was to place a thread panicked.
    #[error("the hook that places the thread of worker {worker} failed: {}", panic.message)]
    AffinityHook {
        /// The [index](Worker::index) of the worker.
        worker: usize,
        /// The panic.
        panic: JobPanic,
    },
    /// The system refused to start a thread.
    #[error("the thread of worker {worker} could not be started")]
    Spawn {
        /// The [index](Worker::index) of the worker it was for.
        worker: usize,
        /// The system's reason.
        source: io::Error,
    },
    /// The system refused to keep a thread to its processors.
    #[error("the thread of worker {worker} could not be kept to the processors {:?}", affinity.processors())]
    Affinity {
        /// The [index](Worker::index) of the worker.
        worker: usize,
        /// The processors.
        affinity: AffinityMask,
        /// The system's reason.
        source: io::Error,
    },
    /// What a thread was to do first panicked.
    #[error("the hook at the start of worker {worker}'s thread failed: {}", panic.message)]
    StartHook {
        /// The [index](Worker::index) of the worker.
        worker: usize,
        /// The panic.
        panic: JobPanic,
    },
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use std::{io, sync::mpsc};

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
