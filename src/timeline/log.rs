//! What has been recorded, as plain data.

use std::{ops::Range, sync::Arc, time::Duration};

/// What has been recorded since the timeline was started, or since the last log was taken. Times are since the scheduler was
/// built.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Log {
    /// One for each worker. Number 0 is whichever thread called the scheduler.
    pub workers: Vec<WorkerLog>,
    /// The names of the threads that have [spans](Self::spans).
    pub threads: Vec<String>,
    /// The frames, ascending by number.
    pub frames: Vec<Frame>,
    /// Runs of schedules, by when they ended.
    pub runs: Vec<Run>,
    /// What threads did outside of all runs, by when it ended.
    pub spans: Vec<Span>,
    /// Readings of counters, oldest first.
    pub counters: Vec<Counter>,
    /// What the device did, if it was asked.
    pub device: Option<DeviceLog>,
    /// How many frames, runs, spans and readings there was no room for.
    pub dropped: u64,
    /// What the engine's [clock](crate::task::SchedulerBuilder::timeline_clock) said when it panicked, if it did. All times after
    /// that are its latest reading.
    pub clock_panic: Option<String>,
}

/// What has been recorded of a worker, beside the chunks it ran.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WorkerLog {
    /// The name of its thread; of worker 0, that it is whoever calls.
    pub name: String,
    /// When it had nothing to do, oldest first.
    pub idle: Vec<Idle>,
    /// How many chunks and idle times there was no room for.
    pub dropped: u64,
}

/// A frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Frame {
    /// Its number, counted from 0 since the scheduler was built.
    pub number: u64,
    /// When it began.
    pub began: Duration,
    /// When the last of what was recorded of it ended.
    pub ended: Duration,
}

/// A run of a schedule.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// The number of the frame that it belongs to.
    pub frame: u64,
    /// What was run.
    pub graph: Arc<Graph>,
    /// How many workers there were.
    pub workers: usize,
    /// When it began.
    pub began: Duration,
    /// When it ended.
    pub ended: Duration,
    /// From when on others than the calling thread could take part. `None` if it ran all by itself.
    pub shared_from: Option<Duration>,
    /// Whether it was to be shared however little work it is.
    pub always_parallel: bool,
    /// Whether a background job called for it, which no frame waits for. Its frame is the one in which it began.
    pub in_background: bool,
    /// Whether a node failed, so that the rest was cancelled. What panicked is not among the chunks.
    pub failed: bool,
    /// Whether every chunk that ran is here: there was room for all of them, and none was taken out before the run had ended.
    pub complete: bool,
    /// All chunks, by node, and those of one node by their items.
    pub chunks: Vec<Chunk>,
    /// For every node that turned out to have no items a chunk without any: who found that, and when. By node.
    pub empty: Vec<Chunk>,
}

/// The nodes of a schedule.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Graph {
    /// In an order in which each comes after all it waits for.
    pub nodes: Vec<NodeInfo>,
}

/// A node of a schedule: one stage of a render process in one view, say.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NodeInfo {
    /// What the graph calls it.
    pub name: String,
    /// What it is a part of.
    pub labels: Labels,
    /// The indices of what it waits for, ascending, and all less than its own.
    pub dependencies: Vec<usize>,
    /// Whether it has to run on the calling thread.
    pub pinned: bool,
}

/// What a node of a schedule is a part of, so that all that belongs together can be told from its names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Labels {
    /// The render process: `geometry buffer`.
    pub process: Option<String>,
    /// Which part of the work: `visibility`, `record`.
    pub stage: Option<String>,
    /// The view that it is for.
    pub view: Option<String>,
}

/// Some items of a node, done by one worker without a break.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Chunk {
    /// The index of its node in the [`Graph`].
    pub node: usize,
    /// Its items.
    pub items: Range<usize>,
    /// The worker that ran it.
    pub worker: usize,
    /// When its node was opened: all that it waits for was done, and a worker had taken it up.
    pub opened: Duration,
    /// When it began: where a worker ran one chunk of a node after another, when the one before ended.
    pub started: Duration,
    /// When it ended.
    pub ended: Duration,
    /// Whether the worker had come by it through a job that another worker had queued.
    pub stolen: bool,
}

/// A time in which a worker had nothing to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Idle {
    /// How it passed it.
    pub kind: IdleKind,
    /// When it began.
    pub began: Duration,
    /// When it ended: when the log was taken, if it had not yet.
    pub ended: Duration,
}

/// How a worker passes the time in which it has nothing to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IdleKind {
    /// It looks for work.
    Searching,
    /// It sleeps until somebody wakes it.
    Asleep,
}

/// What a thread did by itself, outside of all runs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Span {
    /// What it was.
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

/// What a counter stood at.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Counter {
    /// What is counted, and in which unit.
    pub name: String,
    /// When it was read.
    pub at: Duration,
    /// What it stood at.
    pub value: f64,
}

/// What the device did, on the same axis of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeviceLog {
    /// The device's name.
    pub name: String,
    /// By how much its times may be off from those of the workers, earlier or later.
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
    /// The view it was for.
    pub view: String,
    /// When it began.
    pub began: Duration,
    /// When it ended.
    pub ended: Duration,
}

impl Log {
    /// The runs of the frame of that number, by when they ended.
    pub fn runs_of(&self, frame: u64) -> impl Iterator<Item = &Run> {
        self.runs.iter().filter(move |run| run.frame == frame)
    }

    /// The spans of the frame of that number, by when they ended.
    pub fn spans_of(&self, frame: u64) -> impl Iterator<Item = &Span> {
        self.spans.iter().filter(move |span| span.frame == frame)
    }

    /// How much of all there was to record was dropped, of whatever kind, as there was no room.
    pub fn all_dropped(&self) -> u64 {
        self.dropped + self.workers.iter().map(|worker| worker.dropped).sum::<u64>()
    }
}

impl Run {
    /// How long it took.
    pub fn duration(&self) -> Duration {
        self.ended.saturating_sub(self.began)
    }

    /// The chunks of the node of that index, by their items; none if there is no such node.
    pub fn chunks_of(&self, node: usize) -> &[Chunk] {
        let start = self.chunks.partition_point(|chunk| chunk.node < node);
        let rest = &self.chunks[start..];
        &rest[..rest.partition_point(|chunk| chunk.node == node)]
    }

    /// How many items the node of that index had.
    pub fn width(&self, node: usize) -> usize {
        self.chunks_of(node).iter().map(|chunk| chunk.items.len()).sum()
    }

    /// All workers' time in chunks, together.
    pub fn work(&self) -> Duration {
        self.chunks.iter().map(Chunk::duration).sum()
    }
}

impl NodeInfo {
    /// What it counts as where all stages and views of a render process are taken together: the render process, or the stage
    /// where it is none's, or its own name.
    pub fn group(&self) -> &str {
        self.labels.process.as_ref().or(self.labels.stage.as_ref()).unwrap_or(&self.name)
    }
}

impl Chunk {
    /// How long it took.
    pub fn duration(&self) -> Duration {
        self.ended.saturating_sub(self.started)
    }
}
