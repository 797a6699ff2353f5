//! Schedules that keep a book of their own on what ran.

use std::hint::black_box;
use std::ops::Range;
use std::sync::Mutex;
use std::thread::{self, ThreadId};
use std::time::Duration;

use drawloom::graph::{FrameGraph, Node, NodeError, Schedule};
use drawloom::task::{Scheduler, SchedulerBuilder, Worker};
use drawloom::timeline::Labels;
use proptest::{collection::vec, prelude::*};

/// A process: its place in the book, how many items it has, and whether it is pinned.
#[derive(Clone, Copy, Debug)]
pub struct Work {
    pub number: usize,
    pub width: usize,
    pub pinned: bool,
}

/// What a run is lent: its book, and what is to go wrong.
#[derive(Default)]
pub struct Call {
    pub book: Mutex<Vec<Entry>>,
    pub trouble: Trouble,
}

/// A chunk that ran.
#[derive(Clone, Debug)]
pub struct Entry {
    pub process: usize,
    pub items: Range<usize>,
    pub thread: ThreadId,
}

/// What goes wrong with the process, at its item 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Trouble {
    #[default]
    None,
    Error(usize),
    Panic(usize),
}

impl Node<Call> for Work {
    fn width(&self, _call: &Call) -> usize {
        self.width
    }

    fn chunk(&self, _call: &Call) -> usize {
        3
    }

    fn pinned(&self) -> bool {
        self.pinned
    }

    fn run(&self, call: &Call, items: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
        let is_first = items.start == 0;
        items.clone().for_each(|item| _ = black_box((0..2_000).fold(item, |sum, step| black_box(sum ^ step))));
        call.book.lock().unwrap().push(Entry { process: self.number, items, thread: thread::current().id() });
        assert!(!is_first || call.trouble != Trouble::Panic(self.number), "as planned");
        if is_first && call.trouble == Trouble::Error(self.number) { Err("as planned".into()) } else { Ok(()) }
    }
}

/// Up to twelve processes, each after some of those before it.
pub fn schedules() -> impl Strategy<Value = Schedule<Work>> {
    vec((0..40_usize, prop::bool::weighted(0.2), any::<u16>()), 1..12).prop_map(|processes| {
        let mut graph = FrameGraph::new();
        let mut added = Vec::new();
        for (number, (width, pinned, after)) in processes.into_iter().enumerate() {
            let process = graph.add(format!("process {number}"), Work { number, width, pinned });
            if let Some(labels) = labels(number) {
                graph.label(process, labels);
            }
            let before = added.iter().enumerate().filter(|(place, _)| after & after >> 1 & 1 << place != 0);
            before.for_each(|(_, &before)| graph.order(before, process));
            graph.keep(process);
            added.push(process);
        }
        graph.compile().expect("each is after some of those before it")
    })
}

/// Every other process has some.
pub fn labels(number: usize) -> Option<Labels> {
    let [process, stage] = [format!("part {number}"), "fill".to_owned()].map(Some);
    number.is_multiple_of(2).then_some(Labels { process, stage, view: (number != 0).then(|| "main".to_owned()) })
}

/// How a schedule that was never run before is to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Way {
    Alone,
    BegunAlone,
    Shared,
}

impl Way {
    pub const ALL: [Self; 3] = [Self::Alone, Self::BegunAlone, Self::Shared];

    /// A scheduler that goes that way, if the schedule is made to.
    pub fn scheduler(self, workers: usize) -> SchedulerBuilder {
        let price = if self == Self::Alone { Duration::from_secs(1_000) } else { Duration::from_nanos(1) };
        Scheduler::builder().workers(workers).wake_up_cost(price)
    }

    pub fn set(self, schedule: &mut Schedule<Work>) {
        schedule.always_parallel(self == Self::Shared);
    }
}
