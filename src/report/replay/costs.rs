//! What the chunks of a measured run cost.

use std::{ops::Range, time::Duration};

use crate::{
    task::Chunks,
    timeline::{Chunk, Run},
};

use super::prices::Prices;

/// The processes of a run and what their chunks cost, in nanoseconds.
#[derive(Clone, Debug)]
pub(super) struct Costs {
    pub(super) dependencies: Vec<Vec<usize>>,
    pub(super) processes: Vec<ProcessCosts>,
    /// Whether it is to be shared however little work it is.
    pub(super) always_parallel: bool,
}

/// A process, and what its chunks cost, in nanoseconds.
#[derive(Clone, Debug)]
pub(super) struct ProcessCosts {
    /// What it counts as where several are taken together.
    group: String,
    pub(super) pinned: bool,
    pub(super) chunks: Chunks,
    /// What the first so many chunks cost together.
    sums: Vec<u64>,
}

impl Costs {
    /// Of a run that is complete.
    pub(super) fn new(run: &Run, prices: &Prices) -> Self {
        let processes = run.graph.processes.iter().enumerate().map(|(index, process)| {
            let chunks = run.chunks_of(index);
            let size = chunks.iter().map(|chunk| chunk.items.len()).max().unwrap_or(0);
            let sums = chunks.iter().scan(0, |sum, chunk| {
                *sum += nanoseconds(Chunk::took(chunk).saturating_sub(prices.note));
                Some(*sum)
            });
            ProcessCosts {
                group: process.group().to_owned(),
                pinned: process.pinned,
                chunks: Chunks::new(run.width(index), size),
                sums: std::iter::once(0).chain(sums).collect(),
            }
        });
        let dependencies = run.graph.processes.iter().map(|process| process.dependencies.clone());
        Self {
            dependencies: dependencies.collect(),
            processes: processes.collect(),
            always_parallel: run.always_parallel,
        }
    }

    /// Takes all items off the processes of a group.
    pub(super) fn empty(&mut self, group: &str) {
        for process in self.processes.iter_mut().filter(|process| process.group == group) {
            (process.chunks, process.sums) = (Chunks::new(0, 1), vec![0]);
        }
    }

    /// What all chunks cost.
    pub(super) fn work(&self) -> u64 {
        self.processes.iter().map(|process| process.of(0..process.chunks.count())).sum()
    }

    /// What a run takes on one thread.
    pub(super) fn alone(&self, prices: &Prices) -> u64 {
        let chunks: u64 = self.processes.iter().map(|process| process.chunks.count() as u64).sum();
        let processes = self.processes.len() as u64;
        self.work() + chunks * nanoseconds(prices.chunk) + processes * nanoseconds(prices.process_alone)
    }
}

impl ProcessCosts {
    /// What these chunks cost.
    pub(super) fn of(&self, places: Range<usize>) -> u64 {
        self.sums[places.end] - self.sums[places.start]
    }
}

/// Nothing counts for longer than that, so that sums of prices without end, by which nobody is to be woken, still fit.
const LONGEST: Duration = Duration::from_secs(3_600);

pub(super) fn nanoseconds(time: Duration) -> u64 {
    time.min(LONGEST).as_nanos() as u64
}
