//! Why a frame took as long as it did, and how long it would take on a machine with more workers.
//!
//! The [timeline](crate::timeline) records how long each chunk of a frame took. A [`FrameReport`] computes from these
//! times which nodes are to blame for the frame's time. A [`Replay`] simulates the same work on any number of workers,
//! by the rules of the scheduler and of `drawloom`'s renderer: into which chunks it is cut, which worker takes what,
//! who is woken when, and what each of these operations [costs](SchedulerCosts). [`write_page`] and
//! [`write_chrome_trace`] show all frames, for a browser and for Perfetto.
//!
//! ```
//! use std::hint::black_box;
//!
//! use drawloom_jobs::graph::{Closure, FrameGraph};
//! use drawloom_jobs::report::{Replay, SchedulerCosts};
//! use drawloom_jobs::task::Scheduler;
//!
//! let mut graph = FrameGraph::new();
//! let cull = Closure::new(|_: &(), range, _worker| {
//!     range.for_each(|item| _ = black_box((0..1_000).fold(item, |sum, step| black_box(sum ^ step))));
//!     Ok(())
//! });
//! let cull = graph.add("cull", cull.with_width(|_| 2_000).with_chunk(16));
//! graph.keep(cull);
//! let mut schedule = graph.compile()?;
//!
//! let scheduler = Scheduler::new(1)?;
//! scheduler.timeline().start();
//! schedule.run(&scheduler, &())?;
//! let log = scheduler.timeline().take();
//! let replay = Replay::new(&log.runs[0], SchedulerCosts::measure()?)?;
//! for workers in [1, 2, 4, 8, 16] {
//!     println!("on {workers} workers: {:?}", replay.frame_time(workers));
//! }
//! assert!(replay.frame_time(4) < replay.frame_time(1));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What a replay leaves out
//!
//! Workers share caches, memory bandwidth and clock rate, and nodes wait for each other's locks and counters. A replay
//! knows none of that, so the more workers, the more its prediction is a lower bound.

mod chrome_trace;
mod consistency;
mod error;
mod frame_report;
mod intervals;
mod page;
mod simulation;

pub use chrome_trace::write_chrome_trace;
pub use error::ReportError;
pub use frame_report::{FrameReport, HeldBy, PathShare, QueueWait, Slack, Step, WhatIf, WorkerReport};
pub use page::write_page;
pub use simulation::{Replay, ReplayedFrame, SchedulerCosts};
