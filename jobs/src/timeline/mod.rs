//! Records what ran when on which worker.
//!
//! A [`Timeline`] belongs to a [`Scheduler`](crate::task::Scheduler), and can be switched on and off while the
//! scheduler runs. Each worker writes to its own ring buffer, so no worker waits for another. [`Timeline::take`] takes
//! out what was recorded, as a [`Log`]: plain data: frames, runs of schedules, every chunk of each run, and what was
//! chosen by measurement.
//!
//! ```
//! use drawloom_jobs::graph::{Closure, FrameGraph};
//! use drawloom_jobs::task::Scheduler;
//!
//! let mut graph = FrameGraph::new();
//! let cull = graph.add("cull", Closure::new(|_: &(), _range, _worker| Ok(())).with_width(|_| 100).with_chunk(10));
//! graph.keep(cull);
//! let mut schedule = graph.compile()?;
//!
//! let scheduler = Scheduler::new(2)?;
//! scheduler.timeline().start();
//! schedule.run(&scheduler, &())?;
//! let log = scheduler.timeline().take();
//! for chunk in &log.runs[0].chunks {
//!     println!("{:?} on worker {}, {:?} after its node was opened", chunk.items, chunk.worker, chunk.started - chunk.opened);
//! }
//! assert_eq!(log.runs[0].chunks.len(), 10);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What it costs
//!
//! While the timeline is off: one read of a flag for each run, and for each worker that falls asleep. While it is on:
//! one reading of the clock for each chunk and one for each node (on x86-64, of the processor's counter), and 48 bytes
//! per chunk in a ring buffer of [fixed size](crate::task::SchedulerBuilder::timeline_capacity). Events that do not fit
//! are dropped and counted. A `Renderer` adds what it chose by measurement: some kilobytes a frame, for 1,024
//! frames at most between two logs.

mod chunk_timer;
mod clock;
mod event_store;
mod frame_tuning;
mod labels;
mod log;
mod recorder;
mod ring;
pub(crate) mod stopwatch;
mod ticks;
mod track;

pub(crate) use chunk_timer::ChunkTimer;
pub(crate) use recorder::{OpenRun, RunEnd, TimelineSettings};
pub(crate) use stopwatch::Stopwatch;

pub use frame_tuning::{FrameTuning, JobSize, TuningAlternative, TuningChoice, TuningSubject};
pub use labels::Labels;
pub use log::{
    Chunk, Counter, DeviceLog, DevicePass, Frame, Graph, Idle, IdleKind, Log, NodeInfo, Run, Span, WorkerLog,
};
pub use recorder::{OpenSpan, Timeline};
