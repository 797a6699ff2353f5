//! The job system: a call runs on all cores and returns like any other call.
//!
//! The graph runs its nodes on it. An engine can run its own loops on the same workers, before and between frames, so
//! it needs no second pool that competes for the same cores.
//!
//! ```text
//!   the calling thread = worker 0                worker 1            worker 2
//!   scheduler.scope(|scope| {
//!       scope.spawn(a);           a ─────────────► steals a          sleeps, until
//!       scope.spawn(b);             c ◄─ spawns c  │                 a push wakes it
//!       scope.spawn_pinned(p);    p               ...
//!   })  runs p, b, steals jobs,                    steals, sleeps    steals c
//!       and sleeps until a, b, c
//!       and p have run
//! ```
//!
//! A [`Scheduler`] owns the threads. Jobs in a [`Scope`] borrow from the caller, and can spawn more jobs.
//! [`Scheduler::parallel_for`] runs a loop over a range, and [`Scheduler::parallel_for_each`] one over chunks that it
//! may change. Every job gets the [`Worker`] that it runs on, whose index an engine can use for data that it keeps for
//! each worker. A graph of jobs with an order between them is a [`Schedule`](crate::graph::Schedule).
//!
//! # A loop
//!
//! ```
//! use std::sync::atomic::{AtomicU32, Ordering};
//! use drawloom_jobs::task::Scheduler;
//!
//! struct Particle { position: f32, velocity: f32 }
//!
//! let scheduler = Scheduler::with_available_parallelism()?;
//! let particles: Vec<_> = (0..10_000).map(|n| Particle { position: n as f32, velocity: 1.0 }).collect();
//! let escaped = AtomicU32::new(0);
//! scheduler.parallel_for(particles.len(), 512, |range, _worker| {
//!     let outside = particles[range].iter().filter(|particle| particle.position + particle.velocity > 9_000.0);
//!     escaped.fetch_add(outside.count() as u32, Ordering::Relaxed);
//! })?;
//! assert_eq!(escaped.into_inner(), 1_000);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Jobs that borrow
//!
//! ```
//! use drawloom_jobs::task::Scheduler;
//!
//! let scheduler = Scheduler::new(4)?;
//! let (mut sounds, mut shapes) = (vec!["step", "door"], vec![3, 1, 2]);
//! scheduler.scope(|scope| {
//!     scope.spawn(|_scope, _worker| sounds.retain(|&sound| sound != "step"));
//!     scope.spawn(|_scope, _worker| shapes.sort());
//! })?;
//! // All jobs have run, so nothing is borrowed any more.
//! assert_eq!((sounds, shapes), (vec!["door"], vec![1, 2, 3]));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # A job for one thread
//!
//! Work that only the thread of the window or the device may do goes into a pinned job. Any job can spawn one.
//!
//! ```
//! use std::cell::Cell;
//! use std::thread;
//! use drawloom_jobs::task::Scheduler;
//!
//! thread_local! { static SUBMITTED: Cell<usize> = const { Cell::new(0) }; }
//!
//! Scheduler::new(4)?.scope(|scope| {
//!     for commands in [10, 20, 30] {
//!         scope.spawn(move |scope, _worker| {
//!             let recorded = commands * 2;
//!             scope.spawn_pinned(move |_scope, _worker| SUBMITTED.set(SUBMITTED.get() + recorded));
//!         });
//!     }
//! })?;
//! assert_eq!(SUBMITTED.get(), 120);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # A job in the background
//!
//! Work that may take longer than a frame goes into the [background](Scheduler::background). A thread that calls the
//! scheduler for a frame never takes a background job. Other workers run it while they have nothing else to do, a
//! quarter of all workers [at once](Scheduler::set_background_workers), so that frames have the rest, however long the
//! jobs are.
//!
//! ```
//! use std::time::Duration;
//! use drawloom_jobs::task::Scheduler;
//!
//! let scheduler = Scheduler::with_available_parallelism()?;
//! let mut level = Some(scheduler.background(|| (1..=1_000_u64).map(|tile| tile * tile).collect::<Vec<_>>()));
//! let mut tiles = Vec::new();
//! for _frame in 0..3 {
//!     if let Some(job) = level.take_if(|job| job.is_finished()) {
//!         tiles = job.wait()?;
//!     }
//!     scheduler.parallel_for(100, 10, |_range, _worker| { /* the frame, with or without the tiles */ })?;
//!     // Uses the rest of the frame's time. With a single worker, background jobs run only here.
//!     scheduler.run_background(Duration::from_micros(200));
//! }
//! if let Some(job) = level {
//!     // The tiles are needed now: runs the job here if no worker has begun it.
//!     tiles = job.wait()?;
//! }
//! assert_eq!(tiles.len(), 1_000);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Repeating a failure
//!
//! With one worker and a [seed](SchedulerBuilder::shuffle), all jobs run on one thread in an order that the seed
//! decides, the same every time. With several workers and a seed, results that depend on the order of jobs show up.
//!
//! # Panics
//!
//! The panic of a job, of a loop's body or of a scope's body is caught. All workers go on, and the call returns the
//! panic as a [`JobPanic`] when all other jobs have run. In a program built with `panic = "abort"` nothing can be
//! caught: the program ends at once, without an error.
//!
//! Other code of the engine may panic too. The hooks that name, place or start threads fail the
//! [build](SchedulerBuilder::build). The panic of the hook that stops a thread is reported to [`tracing`]. A
//! [clock](SchedulerBuilder::timeline_clock) that panics stands still. If a subscriber of `tracing` panics, its event
//! or span is lost. A panic during the unwinding of another panic, such as that of a destructor, ends the process, as
//! in any Rust program.
//!
//! # What a thread does while it waits
//!
//! A thread that calls the scheduler from outside runs all jobs of the frame until its call returns. A job that waits
//! for a scope, a loop or a graph of its own runs only jobs of that, on top of its stack. So no foreign job delays it,
//! and no job on top of it finds a value borrowed that the waiting job did not borrow itself. If scopes nest without
//! bound, the stack grows without bound, as with any recursion: [`SchedulerBuilder::stack_size`] says how deep they
//! may.
//!
//! No thread keeps a job that another thread waits for: a thread that waits for a scope, a loop or a graph finds all of
//! its jobs that have not begun. So a program waits for ever only if a *running* job waits for itself, by way of other
//! running jobs. These programs do:
//!
//! - A job waits for a background job that waits for something that the first job is part of.
//! - A job holds a lock while it waits for a scope or a background job that needs the lock.
//! - A job waits for a thread that calls the same scheduler from outside, or two threads call two schedulers crosswise
//!   (see [`Scheduler`]).
//! - Jobs that are ready wait for each other to run at the same time: one thread may have both, and background jobs
//!   beyond the [limit](Scheduler::set_background_workers) wait until others have run.
//! - A job calls [`Scheduler::run_background`], which runs the oldest background job on top of it, and that waits for
//!   something that the first job is part of.
//!
//! # Which calls may block
//!
//! | call | blocks until | meanwhile, the thread |
//! | --- | --- | --- |
//! | [`Scheduler::scope`], [`Scheduler::parallel_for`], [`Scheduler::parallel_for_each`], [`Schedule::run`](crate::graph::Schedule::run), from outside | calls of other threads from outside have returned | sleeps |
//! | | all jobs of the call have run | runs jobs of the frame, sleeps if there are none |
//! | the same in a job | all jobs of the call have run | runs jobs of the call, sleeps if there are none |
//! | [`BackgroundJob::wait`] | the job has run | runs that job if no thread has begun it, and otherwise sleeps |
//! | [`Scheduler::run_background`] | the last job that was begun in time has run | runs background jobs |
//! | dropping a [`Scheduler`] | its threads have ended: their current jobs have run | sleeps |
//! | building a [`Scheduler`] | its threads have begun, and the cost of waking one is measured | sleeps, or reads the clock |
//! | [`Timeline::start`](crate::timeline::Timeline::start), [`now`](crate::timeline::Timeline::now) or [`take`](crate::timeline::Timeline::take) for the first time | the scheduler is 10 ms old | sleeps |
//!
//! [`Scope::spawn`], [`Scope::spawn_pinned`] and [`Scheduler::background`] return at once.
//!
//! # What costs more than linear
//!
//! A job costs the same however many there are, with these exceptions:
//!
//! - With a [seed](SchedulerBuilder::shuffle), a job is drawn from all jobs of a queue, so time grows with their
//!   square.
//! - A worker that finds nothing in its own queues looks into those of all others, so the cost of being idle grows with
//!   the number of workers.
//! - Where scopes nest deeply, a worker that takes a job from another worker's mailbox searches the levels of that
//!   worker.
//! - A [graph](crate::graph::FrameGraph::compile) has an edge or two for each access of a resource. But readers that
//!   are ordered before some of a resource's makers have an edge from each maker before them. And for each resource
//!   with makers and readers, and each modifier of one with several, compiling walks back the orders that lead there.
//! - [`Schedule::to_dot`](crate::graph::Schedule::to_dot) leaves out edges that follow from others, in time that grows
//!   with the product of nodes and edges.
//!
//! # What it costs
//!
//! A job that captures up to four words is spawned without an allocation; others need one each. A loop allocates
//! nothing. Within a frame, workers look for work for as long as a wake-up takes. After it they look for up to two
//! wake-ups for each worker of the scheduler, and half a millisecond at most, if recent frames followed each other that
//! soon, and not at all otherwise. Then they sleep and use no processor time. [The cost of a
//! wake-up](Scheduler::wake_up_cost) is measured when the scheduler is built. A loop should be worth more than that,
//! and a graph that is not runs on the calling thread alone.

// Each group uses only the groups above it, and no two files import each other in a circle.

// Data structures, which know neither workers nor schedulers.
mod affinity;
mod background_job;
mod background_queue;
mod background_slots;
mod caller_slot;
mod chunks;
mod closure;
mod frame_gaps;
mod job;
mod latch;
mod locked_queue;
mod mailbox;
mod parker;
mod placement;
mod prepaid_count;
mod priority;
mod queues;
mod region;
mod shared;
mod shuffle;
mod sleep;
mod tickets;

// Workers, and which one a thread is.
mod current_worker;
mod idle;
mod worker;

// What workers run.
mod parallel_loop;
mod scope;
mod tokens;

// The scheduler, and how it is built.
mod builder;
mod scheduler;
mod scheduler_error;
mod wake_up_cost;
mod worker_thread;

#[cfg(all(test, drawloom_shuttle))]
mod shuttle_tests;

pub use affinity::AffinityMask;
pub use background_job::BackgroundJob;
pub use builder::SchedulerBuilder;
pub use scheduler::Scheduler;
pub use scheduler_error::SchedulerError;
pub use scope::Scope;
pub use worker::Worker;

pub use crate::unwind::{JobPanic, catch};

pub(crate) use chunks::Chunks;
#[cfg(feature = "report")]
pub(crate) use frame_gaps::{MAX_SPIN_BETWEEN_FRAMES, are_awake_after};
#[cfg(feature = "report")]
pub(crate) use idle::{MAX_SPIN, uncounted_pauses};
pub(crate) use priority::Priority;
pub(crate) use tickets::{TicketSize, Tickets};
pub(crate) use tokens::{TokenContext, Tokens, run_tokens};
