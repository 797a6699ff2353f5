//! What ran where and when: the recorder of a scheduler's workers, and what it has recorded.
//!
//! A [`Timeline`] belongs to a [`Scheduler`](crate::task::Scheduler), and is switched on and off while that runs. Each
//! worker writes into a ring of its own, so that nobody waits for anybody; what has been written is taken out as a [`Log`],
//! which is plain data: frames, runs of schedules, and every chunk of them.
//!
//! ```
//! use drawloom::{
//!     graph::{Closure, FrameGraph},
//!     task::Scheduler,
//! };
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
//!     println!("{:?} on worker {}, {:?} after it could have", chunk.items, chunk.worker, chunk.started - chunk.opened);
//! }
//! assert_eq!(log.runs[0].chunks.len(), 10);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What it costs
//!
//! While it is off, a look at a flag for every run and every worker that falls asleep. While it is on, a reading of the clock
//! for every chunk and another for every process (of the processor's counter, on x86-64), and 48 bytes a chunk out of a ring
//! whose size is [set](crate::task::SchedulerBuilder::timeline_capacity) beforehand. What does not fit is dropped and
//! counted.

mod book;
mod clock;
mod lane;
mod log;
mod recorder;
mod ring;
mod ticks;

pub(crate) use self::{
    lane::Lap,
    recorder::{Ended, OpenRun, Setup},
};

pub use self::{
    log::{
        Chunk, Counter, DeviceLog, DevicePass, Frame, Graph, Idle, IdleKind, Labels, Log, Process, Run, Span, WorkerLog,
    },
    recorder::{OpenSpan, Timeline},
};
