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
//! tells apart what an engine keeps per worker.
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
//! # Panics in jobs
//!
//! The panic of a job, of a loop's body or of a scope's is caught. It harms no worker, and the call returns it as a
//! [`JobPanic`] when all other jobs have run. In a program built with `panic = "abort"` nothing can be caught: the
//! process ends on the spot, and no error names anything.
//!
//! # What it costs
//!
//! A spawned job is one allocation. A loop allocates per worker that joins it, not per chunk. Idle workers sleep and
//! take no time from anybody; waking one costs the waker some microseconds, so a chunk should be worth more than that.
//! A thread that waits for a scope runs other jobs meanwhile, on top of its stack. Jobs that open scopes in which jobs
//! open scopes, without bound, need a stack without bound, as any recursion does.

mod affinity;
mod background;
mod builder;
mod chunks;
mod closure;
mod idle;
mod job;
mod latch;
mod mailbox;
mod parallel_for;
mod placement;
mod queue;
mod region;
mod scheduler;
mod scope;
mod seat;
mod shuffle;
mod sleep;
mod wake_price;
mod worker;

pub use affinity::AffinityMask;
pub use background::BackgroundJob;
pub use builder::{SchedulerBuilder, SchedulerError};
pub use job::{JobPanic, catch};
pub use scheduler::Scheduler;
pub use scope::Scope;
pub use worker::Worker;

pub(crate) use chunks::{Chunks, Pace, Tickets};
pub(crate) use job::discard;
pub(crate) use queue::Band;
pub(crate) use region::{Crew, Tokens, run_tokens};
