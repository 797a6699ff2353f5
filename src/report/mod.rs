//! What a frame was, and what it could be: why it took as long as it did, and its time on a machine of more workers than
//! this one has.
//!
//! A frame is recorded by the [timeline](crate::timeline): what every chunk took. A [`FrameReport`] tells from that which
//! processes are to blame for its time. A [`Replay`] runs those chunks again on a clock of its own, on as many workers as are
//! asked for, by the rules of this crate's own scheduler: who takes what, who is woken when, and what each of that
//! [costs](Prices). [`write_page`] and [`write_chrome_trace`] show all frames, for a browser and for Perfetto.
//!
//! ```
//! use drawloom::{
//!     graph::{Closure, FrameGraph},
//!     report::{Prices, Replay},
//!     task::Scheduler,
//! };
//! use std::hint::black_box;
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
//! let replay = Replay::new(&log.runs[0], Prices::measure()?)?;
//! for workers in [1, 2, 4, 8, 16] {
//!     println!("on {workers} workers: {:?}", replay.frame_time(workers));
//! }
//! assert!(replay.frame_time(4) < replay.frame_time(1));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What it leaves out
//!
//! That all workers share caches, memory and clock rate, and what a process itself makes them wait for: locks, counters.
//! The more workers, the more a prediction is what could be at best.

mod chrome_trace;
mod consistency;
mod error;
mod frame_report;
mod moments;
mod page;
mod replay;

pub use self::{
    chrome_trace::write_chrome_trace,
    error::ReportError,
    frame_report::{FrameReport, HeldBy, QueueWait, Share, Slack, Step, WhatIf, WorkerReport},
    page::write_page,
    replay::{Prices, Replay, Replayed},
};
