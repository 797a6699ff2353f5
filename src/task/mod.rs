//! The job system: all cores for one call, without the call noticing.
//!
//! It is for whoever produces frames: the graph runs its nodes on it, and an engine can run its own loops on the same
//! workers, before and between frames, rather than keep a second pool that fights for the same cores.
//!
//! ```text
//!   the calling thread = worker 0                worker 1            worker 2
//!   scheduler.scope(|scope| {
//!       scope.spawn(a);           a ─────────────► steals a          sleeps, until
//!       scope.spawn(b);             c ◄─ spawns c  │                 a push wakes it
//!       scope.spawn_pinned(p);    p               ...
//!   })  runs p, b, then what                       steals, sleeps    steals c
//!       there is to steal; sleeps
//!       until a, b, c and p have run
//! ```
//!
//! A [`Scheduler`] owns the threads. In a [`Scope`] jobs are spawned that borrow from the caller, and spawn more.
//! [`Scheduler::parallel_for`] is the loop over a range. Every job is handed the [`Worker`] it runs on, whose index
//! tells apart what an engine keeps per worker. A graph of jobs, with an order between them, is a
//! [`Schedule`](crate::graph::Schedule).
//!
//! # A loop
//!
//! ```
//! use std::sync::atomic::{AtomicU32, Ordering};
//! use drawloom::task::Scheduler;
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
//! use drawloom::task::Scheduler;
//!
//! let scheduler = Scheduler::new(4)?;
//! let (mut sounds, mut shapes) = (vec!["step", "door"], vec![3, 1, 2]);
//! scheduler.scope(|scope| {
//!     scope.spawn(|_scope, _worker| sounds.retain(|&sound| sound != "step"));
//!     scope.spawn(|_scope, _worker| shapes.sort());
//! })?;
//! // All jobs have run, and what they borrowed is back.
//! assert_eq!((sounds, shapes), (vec!["door"], vec![1, 2, 3]));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # A job for one thread
//!
//! What only the thread of the window or the device may touch goes to a pinned job. It may be spawned from any job.
//!
//! ```
//! use std::{cell::Cell, thread};
//! use drawloom::task::Scheduler;
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
//! # A job for the background
//!
//! What may take longer than a frame goes to the [background](Scheduler::background). No thread that calls the scheduler for
//! a frame ever picks it up, so a frame is not late by the length of somebody's loading; it runs on other workers while
//! they have nothing else to do.
//!
//! ```
//! use std::time::Duration;
//! use drawloom::task::Scheduler;
//!
//! let scheduler = Scheduler::with_available_parallelism()?;
//! let mut level = Some(scheduler.background(|| (1..=1_000_u64).map(|tile| tile * tile).collect::<Vec<_>>()));
//! let mut tiles = Vec::new();
//! for _frame in 0..3 {
//!     if let Some(job) = level.take_if(|job| job.is_finished()) {
//!         tiles = job.wait()?;
//!     }
//!     scheduler.parallel_for(100, 10, |_range, _worker| { /* the frame, with or without the tiles */ })?;
//!     // What is left of the frame's time. With a single worker this is where background jobs run.
//!     scheduler.run_background(Duration::from_micros(200));
//! }
//! if let Some(job) = level {
//!     // It cannot be put off any longer: run here and now if nobody has begun it.
//!     tiles = job.wait()?;
//! }
//! assert_eq!(tiles.len(), 1_000);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # A failure, again
//!
//! With one worker and a [seed](SchedulerBuilder::shuffle) all jobs run on one thread in an order that the seed decides, the
//! same every time; with several workers and a seed, results that depend on an order show themselves.
//!
//! # Panics
//!
//! The panic of a job, of a loop's body or of a scope's is caught. It harms no worker, and the call returns it as a
//! [`JobPanic`] when all other jobs have run. In a program built with `panic = "abort"` nothing can be caught: the
//! process ends on the spot, and no error names anything.
//!
//! Everything else that an engine supplies may panic too. Hooks that name, place or start threads fail the
//! [build](SchedulerBuilder::build); the hook that stops a thread is reported to [`tracing`]; a
//! [clock](SchedulerBuilder::timeline_clock) stands still; a subscriber of `tracing` loses the event, or fails the run that it
//! was told of. What panics while another panic unwinds, such as a destructor, ends the process, as in any Rust program.
//!
//! # What waiting means
//!
//! A thread that calls the scheduler from outside runs whatever there is to run of a frame until its call returns. A job that
//! waits, for a scope, a loop or a graph of its own, runs jobs of that meanwhile, on top of its stack, and nothing else: it is
//! late by no work but its own, and finds nothing borrowed that it had not borrowed itself. Jobs that open scopes in which jobs
//! open scopes, without bound, need a stack without bound, as any recursion does.
//!
//! No thread keeps a job to itself that another one waits for: who waits for a scope, a loop or a graph finds each of its jobs
//! that has not begun. So a program waits for ever only if a *running* job waits, by way of other running jobs, for itself. The
//! ways to bring that about:
//!
//! - A job waits for a background job that waits for what the first job is part of.
//! - A job holds a lock, and waits for a scope, or a background job, in which the lock is wanted.
//! - A job waits for a thread that calls the same scheduler from outside, or two threads call two schedulers crosswise
//!   ([`Scheduler`] says when).
//! - Jobs that are ready wait for each other to run at the same time: one thread may have both.
//! - A job calls [`Scheduler::run_background`], which runs whatever is the oldest background job on top of it, and that
//!   waits for what the first job is part of.
//!
//! # Which calls may block
//!
//! | call | blocks until | meanwhile, the thread |
//! | --- | --- | --- |
//! | [`Scheduler::scope`], [`Scheduler::parallel_for`], [`Schedule::run`](crate::graph::Schedule::run), from outside | calls of other threads from outside have returned | sleeps |
//! | | all jobs of the call have run | runs jobs of the frame, sleeps if there is none |
//! | the same in a job | all jobs of the call have run | runs jobs of the call, sleeps if there is none |
//! | [`BackgroundJob::wait`] | the job has run | runs that job if nobody has begun it, and otherwise sleeps |
//! | [`Scheduler::run_background`] | the last job that was begun in time has run | runs background jobs |
//! | dropping a [`Scheduler`] | its threads have ended: until the jobs that they are at have run | sleeps |
//! | building a [`Scheduler`] | its threads have begun, and what waking one costs is measured | sleeps, or looks at the time |
//! | [`Timeline::start`](crate::timeline::Timeline::start), [`now`](crate::timeline::Timeline::now) or [`take`](crate::timeline::Timeline::take) for the first time | the scheduler is 10 ms old | sleeps |
//!
//! [`Scope::spawn`], [`Scope::spawn_pinned`] and [`Scheduler::background`] return at once.
//!
//! # What costs more than linear
//!
//! Jobs of all kinds cost the same however many there are, but for this:
//!
//! - With a [seed](SchedulerBuilder::shuffle), a job is drawn from all that lie in a queue: time grows with their square.
//! - A worker that finds nothing in its own queues looks into those of all others, so an idle moment costs time that grows
//!   with the number of workers.
//! - Where scopes nest deeply, a worker that takes a job for somebody else looks through the levels of who waits for it.
//! - A [graph](crate::graph::FrameGraph::compile) has an edge or two for each access of a resource. But readers that are put
//!   before some of a resource's makers have an edge for each maker before them; and for each resource with makers and readers,
//!   and each modifier of one with several, the orders that lead there are walked back.
//! - [`Schedule::to_dot`](crate::graph::Schedule::to_dot) leaves out what follows from other edges, in time that grows with the
//!   product of nodes and edges.
//!
//! # What it costs
//!
//! A job that captures up to four words is spawned without an allocation, others are one each. A loop allocates nothing.
//! Workers look for work for some microseconds after the end of a frame, and as long as waking them would take within
//! one; then they sleep and take no time from anybody. [What waking one costs](Scheduler::wake_up_cost) is measured when
//! the scheduler is built; a loop should be worth more than that, and a graph that is not is run by its caller alone.

// In layers: each group uses only groups above it, and no two files import each other in a circle.

// Data structures, which know neither workers nor schedulers.
mod affinity;
mod background_job;
mod background_queue;
mod caller_slot;
mod chunks;
mod closure;
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
pub(crate) use priority::Priority;
pub(crate) use tickets::{TicketSize, Tickets};
pub(crate) use tokens::{TokenContext, Tokens, run_tokens};
