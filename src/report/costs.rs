//! What the chunks of a measured run cost.

use std::{ops::Range, time::Duration};

use crate::{
    graph::{ChunkMeasure, RunMeasure},
    task::Chunks,
};

use super::prices::Prices;

/// The processes of a run and what their chunks cost, in nanoseconds.
#[derive(Clone, Debug)]
pub(super) struct Costs {
    pub(super) dependencies: Vec<Vec<usize>>,
    pub(super) processes: Vec<ProcessCosts>,
}

/// A process, and what its chunks cost, in nanoseconds.
#[derive(Clone, Debug)]
pub(super) struct ProcessCosts {
    pub(super) pinned: bool,
    pub(super) chunks: Chunks,
    /// What the first so many chunks cost together.
    sums: Vec<u64>,
}

impl Costs {
    pub(super) fn new(measure: &RunMeasure, prices: &Prices) -> Self {
        let processes = measure.processes().iter().enumerate().map(|(index, process)| {
            let chunks = measure.chunks_of(index);
            let sums = chunks.iter().scan(0, |sum, chunk| {
                *sum += nanoseconds(ChunkMeasure::took(chunk).saturating_sub(prices.note));
                Some(*sum)
            });
            ProcessCosts {
                pinned: process.pinned,
                chunks: Chunks::new(process.width, process.chunk),
                sums: std::iter::once(0).chain(sums).collect(),
            }
        });
        let dependencies = measure.processes().iter().map(|process| process.dependencies.clone());
        Self { dependencies: dependencies.collect(), processes: processes.collect() }
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
