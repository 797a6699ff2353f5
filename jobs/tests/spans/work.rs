//! Schedules of nodes that log the chunks they run.

use std::hint::black_box;
use std::ops::Range;
use std::sync::Mutex;
use std::thread::{self, ThreadId};
use std::time::Duration;

use drawloom_jobs::graph::{FrameGraph, Node, NodeError, Schedule};
use drawloom_jobs::task::{Scheduler, SchedulerBuilder, Worker};
use drawloom_jobs::timeline::Labels;
use proptest::collection::vec;
use proptest::prelude::*;

/// A node with some work: its number, its width, and whether it is pinned.
#[derive(Clone, Copy, Debug)]
pub struct Work {
    pub number: usize,
    pub width: usize,
    pub pinned: bool,
}

/// The context of a run: the chunks that ran, and the failure.
#[derive(Default)]
pub struct RunContext {
    pub ran_chunks: Mutex<Vec<RanChunk>>,
    pub failure: Failure,
}

/// A chunk that ran.
#[derive(Clone, Debug)]
pub struct RanChunk {
    pub node: usize,
    pub items: Range<usize>,
    pub thread: ThreadId,
}

/// The failure of a node at its item 0, with the node's number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Failure {
    #[default]
    None,
    Error(usize),
    Panic(usize),
}

impl Node<RunContext> for Work {
    fn width(&self, _context: &RunContext) -> usize {
        self.width
    }

    fn chunk(&self, _context: &RunContext) -> usize {
        3
    }

    fn pinned(&self) -> bool {
        self.pinned
    }

    fn run(&self, context: &RunContext, items: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
        let is_first = items.start == 0;
        items.clone().for_each(|item| _ = black_box((0..2_000).fold(item, |sum, step| black_box(sum ^ step))));
        context.ran_chunks.lock().unwrap().push(RanChunk { node: self.number, items, thread: thread::current().id() });
        assert!(!is_first || context.failure != Failure::Panic(self.number), "as planned");
        if is_first && context.failure == Failure::Error(self.number) { Err("as planned".into()) } else { Ok(()) }
    }
}

/// Up to twelve nodes. Each depends on some of those before it.
pub fn schedules() -> impl Strategy<Value = Schedule<Work>> {
    vec((0..40_usize, prop::bool::weighted(0.2), any::<u16>()), 1..12).prop_map(|nodes| {
        let mut graph = FrameGraph::new();
        let mut added = Vec::new();
        for (number, (width, pinned, after)) in nodes.into_iter().enumerate() {
            let node = graph.add(format!("node {number}"), Work { number, width, pinned });
            if let Some(labels) = labels(number) {
                graph.label(node, labels);
            }
            let before = added.iter().enumerate().filter(|(index, _)| after & after >> 1 & 1 << index != 0);
            before.for_each(|(_, &before)| graph.order(before, node));
            graph.keep(node);
            added.push(node);
        }
        graph.compile().expect("dependencies come before their dependents")
    })
}

/// The labels of a node; odd ones have none.
pub fn labels(number: usize) -> Option<Labels> {
    let [process, stage] = [format!("part {number}"), "fill".to_owned()].map(|label| Some(label.into()));
    number.is_multiple_of(2).then_some(Labels { process, stage, view: (number != 0).then(|| "main".into()) })
}

/// How a schedule without measurements is executed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    Serial,
    SerialThenParallel,
    Parallel,
}

impl Mode {
    pub const ALL: [Self; 3] = [Self::Serial, Self::SerialThenParallel, Self::Parallel];

    /// A scheduler with which a schedule is executed in this mode, after [`set`](Self::set).
    pub fn scheduler(self, workers: usize) -> SchedulerBuilder {
        let cost = if self == Self::Serial { Duration::from_secs(1_000) } else { Duration::from_nanos(1) };
        Scheduler::builder().workers(workers).wake_up_cost(cost)
    }

    pub fn set(self, schedule: &mut Schedule<Work>) {
        schedule.always_parallel(self == Self::Parallel);
    }
}
