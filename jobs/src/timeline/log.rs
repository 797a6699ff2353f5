//! A recording, as plain data.

use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use super::frame_tuning::FrameTuning;
use super::labels::Labels;

/// Everything recorded since the timeline was started, or since the last log was taken. All times are measured from
/// the construction of the scheduler, or are those of the engine's clock.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Log {
    /// One for each worker. Worker 0 is whichever thread called the scheduler.
    pub workers: Vec<WorkerLog>,
    /// The names of the threads that have [spans](Self::spans).
    pub threads: Vec<String>,
    /// The frames, ascending by number.
    pub frames: Vec<Frame>,
    /// The runs of schedules, by when they ended.
    pub runs: Vec<Run>,
    /// The named stretches of threads' work, by when they ended.
    pub spans: Vec<Span>,
    /// The readings of counters, oldest first.
    pub counters: Vec<Counter>,
    /// What was chosen by measurement, by number of the frame that a `Renderer` recorded, oldest first.
    pub tuning: Vec<(u64, FrameTuning)>,
    /// What the device did, if the engine added it.
    pub device: Option<DeviceLog>,
    /// How many frames, runs, spans, readings and entries of [tuning](Self::tuning) were dropped because there was no
    /// room.
    pub dropped: u64,
    /// The message with which the engine's [clock](crate::task::SchedulerBuilder::timeline_clock) panicked, if it did.
    /// All later times are its last reading.
    pub clock_panic: Option<String>,
}

/// What is recorded of a worker, besides the chunks it ran.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WorkerLog {
    /// The name of its thread; for worker 0 `caller`, as any thread may call the scheduler.
    pub name: String,
    /// The intervals in which it had nothing to do, oldest first.
    pub idle: Vec<Idle>,
    /// How many chunks and idle intervals were dropped because there was no room.
    pub dropped: u64,
}

/// A frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Frame {
    /// Its number. Only frames that the timeline records are counted, from 0 since the scheduler was built.
    pub number: u64,
    /// When it began.
    pub began: Duration,
    /// When the last of its recorded runs and spans ended.
    pub ended: Duration,
}

/// A run of a schedule.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// The number of the frame that it belongs to.
    pub frame: u64,
    /// The schedule's graph.
    pub graph: Arc<Graph>,
    /// How many workers there were.
    pub workers: usize,
    /// When it began.
    pub began: Duration,
    /// When it ended.
    pub ended: Duration,
    /// From when on other workers than the calling thread could take part. `None` if the run was serial.
    pub parallel_from: Option<Duration>,
    /// Whether the schedule is [always parallel](crate::graph::Schedule::always_parallel), however little work it is.
    pub always_parallel: bool,
    /// Whether it was started by a background job, which no frame waits for. Then its frame is the one in which it
    /// began.
    pub in_background: bool,
    /// Whether a node failed, so that the rest was cancelled. A chunk that panicked is not among the chunks.
    pub failed: bool,
    /// Whether every chunk that ran is here: there was room for all of them, and none was taken out before the run had
    /// ended.
    pub complete: bool,
    /// All chunks, by node, and those of one node by their items.
    pub chunks: Vec<Chunk>,
    /// An empty chunk for each node of width zero: which worker found that, and when. By node.
    pub empty: Vec<Chunk>,
}

/// The nodes of a schedule.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Graph {
    /// In topological order: each node comes after all of its dependencies.
    pub nodes: Vec<NodeInfo>,
}

/// A node of a schedule: for example one stage of a render process in one view.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NodeInfo {
    /// Its name in the graph.
    pub name: String,
    /// What it belongs to.
    pub labels: Labels,
    /// The indices of its dependencies, ascending. All are less than its own.
    pub dependencies: Vec<usize>,
    /// Whether it has to run on the calling thread.
    pub pinned: bool,
    /// Whether its chunk size follows from the cost of its items and the number of workers: see
    /// [`Node::chunked_by_cost`](crate::graph::Node::chunked_by_cost).
    pub chunked_by_cost: bool,
}

/// A range of a node's items, which one worker ran without interruption.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Chunk {
    /// The index of its node in the [`Graph`].
    pub node: usize,
    /// Its items.
    pub items: Range<usize>,
    /// The worker that ran it.
    pub worker: usize,
    /// When its node was opened: all dependencies were done, and a worker had taken it up.
    pub opened: Duration,
    /// When it began. If the worker ran the node's previous chunk just before, this is when that one ended.
    pub started: Duration,
    /// When it ended.
    pub ended: Duration,
    /// Whether the worker got it through a job that another worker had queued.
    pub stolen: bool,
}

/// An interval in which a worker had nothing to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Idle {
    /// What the worker did instead.
    pub kind: IdleKind,
    /// When it began.
    pub began: Duration,
    /// When it ended: when the log was taken, if it had not ended by then.
    pub ended: Duration,
}

/// What a worker does while it has no work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IdleKind {
    /// It searches for work.
    Searching,
    /// It sleeps until another thread wakes it.
    Asleep,
}

/// A named stretch of a thread's work. It may contain runs, as `record` does; reports count what is outside of them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Span {
    /// The name of the work.
    pub name: String,
    /// The index of the thread's name among [`Log::threads`].
    pub thread: usize,
    /// The number of the frame that it belongs to.
    pub frame: u64,
    /// When it began.
    pub began: Duration,
    /// When it ended.
    pub ended: Duration,
}

/// A reading of a counter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Counter {
    /// What is counted, and in which unit.
    pub name: String,
    /// When it was read.
    pub at: Duration,
    /// The counter's value.
    pub value: f64,
}

/// What the device did, on the same time axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeviceLog {
    /// The device's name.
    pub name: String,
    /// How far its times may be off from those of the workers, in either direction.
    pub error: Duration,
    /// Its passes, by when they began.
    pub passes: Vec<DevicePass>,
}

/// A pass on the device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DevicePass {
    /// The number of the frame that it belongs to.
    pub frame: u64,
    /// The render process.
    pub process: String,
    /// The view that it is for.
    pub view: String,
    /// When it began.
    pub began: Duration,
    /// When it ended.
    pub ended: Duration,
}

impl Log {
    /// The runs of a frame, by when they ended.
    pub fn runs_of(&self, frame: u64) -> impl Iterator<Item = &Run> {
        self.runs.iter().filter(move |run| run.frame == frame)
    }

    /// The spans of a frame, by when they ended.
    pub fn spans_of(&self, frame: u64) -> impl Iterator<Item = &Span> {
        self.spans.iter().filter(move |span| span.frame == frame)
    }

    /// How many events of any kind were dropped because there was no room, by workers and by the log itself.
    pub fn all_dropped(&self) -> u64 {
        self.workers.iter().map(|worker| worker.dropped).fold(self.dropped, u64::saturating_add)
    }
}

impl Run {
    /// How long it took.
    pub fn duration(&self) -> Duration {
        self.ended.saturating_sub(self.began)
    }

    /// The chunks of a node, by their items. There are none if there is no such node.
    pub fn chunks_of(&self, node: usize) -> &[Chunk] {
        let start = self.chunks.partition_point(|chunk| chunk.node < node);
        let rest = &self.chunks[start..];
        &rest[..rest.partition_point(|chunk| chunk.node == node)]
    }

    /// How many items a node had.
    pub fn width(&self, node: usize) -> usize {
        self.chunks_of(node).iter().map(|chunk| chunk.items.len()).sum()
    }

    /// The time of all workers in chunks, together.
    pub fn work(&self) -> Duration {
        self.chunks.iter().map(Chunk::duration).sum()
    }
}

impl NodeInfo {
    /// The group in which reports count the node: its render process, or its stage if it has none, or else its own
    /// name.
    pub fn group(&self) -> &str {
        self.labels.process.as_deref().or(self.labels.stage.as_deref()).unwrap_or(&self.name)
    }
}

impl Chunk {
    /// How long it took.
    pub fn duration(&self) -> Duration {
        self.ended.saturating_sub(self.started)
    }
}
