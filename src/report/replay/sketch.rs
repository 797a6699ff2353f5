//! Runs made by hand, for tests.

use std::{sync::Arc, time::Duration};

use proptest::{collection::vec, prelude::*};

use super::Prices;
use crate::timeline::{Chunk, Graph, Process, Run};

/// A graph as plain data.
#[derive(Clone, Debug, Default)]
pub(super) struct Sketch {
    pub(super) processes: Vec<ProcessSketch>,
}

#[derive(Clone, Debug)]
pub(super) struct ProcessSketch {
    pub(super) dependencies: Vec<usize>,
    pub(super) pinned: bool,
    /// What each chunk costs, in microseconds.
    pub(super) chunks: Vec<u64>,
}

impl Sketch {
    pub(super) fn new() -> Self {
        Self::default()
    }

    pub(super) fn add(mut self, dependencies: &[usize], chunks: &[u64]) -> Self {
        let (dependencies, chunks) = (dependencies.to_vec(), chunks.to_vec());
        self.processes.push(ProcessSketch { dependencies, pinned: false, chunks });
        self
    }

    pub(super) fn add_pinned(self, dependencies: &[usize], chunks: &[u64]) -> Self {
        let mut sketch = self.add(dependencies, chunks);
        sketch.processes.last_mut().expect("one was added").pinned = true;
        sketch
    }

    /// A run on one thread, in which notes took what they do at these prices. Chunks are of three items.
    pub(super) fn run(&self, prices: &Prices) -> Run {
        let mut now = Duration::ZERO;
        let (mut processes, mut chunks) = (Vec::new(), Vec::new());
        for (index, process) in self.processes.iter().enumerate() {
            processes.push(Process {
                name: format!("p{index}"),
                dependencies: process.dependencies.clone(),
                pinned: process.pinned,
                ..Process::default()
            });
            let opened = now;
            for (place, &cost) in process.chunks.iter().enumerate() {
                let ended = now + Duration::from_micros(cost) + prices.note;
                let items = place * 3..place * 3 + 3;
                chunks.push(Chunk { process: index, items, opened, started: now, ended, ..Chunk::default() });
                now = ended;
            }
        }
        let graph = Arc::new(Graph { processes });
        Run { graph, workers: 1, ended: now, complete: true, chunks, ..Run::default() }
    }
}

/// Any graph, with pinned processes or without.
pub(super) fn any_sketch(may_be_pinned: bool) -> impl Strategy<Value = Sketch> {
    let chunks = prop_oneof![
        vec(0..200_u64, 0..3),
        vec(0..30_u64, 0..40),
        vec(0..3_u64, 0..200),
        (0..100_usize, 0..20_u64).prop_map(|(count, cost)| vec![cost; count]),
    ];
    let process = (vec(any::<prop::sample::Index>(), 0..4), prop::bool::weighted(0.2), chunks);
    vec(process, 0..16).prop_map(move |picks| {
        let mut processes = Vec::new();
        for (index, (picks, pinned, chunks)) in picks.into_iter().enumerate() {
            let mut dependencies: Vec<usize> =
                picks.iter().filter(|_| index > 0).map(|pick| pick.index(index)).collect();
            dependencies.sort_unstable();
            dependencies.dedup();
            processes.push(ProcessSketch { dependencies, pinned: pinned && may_be_pinned, chunks });
        }
        Sketch { processes }
    })
}
