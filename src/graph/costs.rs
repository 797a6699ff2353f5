//! What the nodes of a schedule cost, measured in some of the runs.

use std::time::Duration;

use crate::sync::{AtomicU32, AtomicUsize, Instant, Ordering};

/// What has been measured so far. Durations are in nanoseconds.
pub(super) struct Costs {
    /// Per node, from its start to its end: an average of the latest measured runs, the latest counting most.
    average: Box<[u64]>,
    has_learnt: bool,
    /// Per node, in the current run.
    started: Box<[AtomicU32]>,
    took: Box<[AtomicU32]>,
    /// Of the current run, all workers' time together.
    work: AtomicUsize,
}

/// The part of the latest run in the average.
const WEIGHT: u64 = 4;

impl Costs {
    pub(super) fn new(nodes: usize) -> Self {
        let zeros = || (0..nodes).map(|_| AtomicU32::new(0)).collect();
        Self {
            average: vec![0; nodes].into(),
            has_learnt: false,
            started: zeros(),
            took: zeros(),
            work: AtomicUsize::new(0),
        }
    }

    /// Nanoseconds per node; all are 0 before the first measured run.
    pub(super) fn averages(&self) -> &[u64] {
        &self.average
    }

    /// What the node costs, if that has been measured.
    pub(super) fn of(&self, node: usize) -> Option<Duration> {
        let average = self.average.get(node)?;
        self.has_learnt.then(|| Duration::from_nanos(*average))
    }

    /// Forgets the work of a run that was cancelled.
    pub(super) fn forget_work(&self) {
        self.work.store(0, Ordering::Relaxed);
    }

    /// Takes in what the run that has ended cost, and says how much work it was.
    pub(super) fn learn(&mut self) -> Duration {
        for (average, took) in self.average.iter_mut().zip(&self.took) {
            // Relaxed: the run is over.
            let took = u64::from(took.load(Ordering::Relaxed));
            *average = if self.has_learnt { (*average * (WEIGHT - 1) + took) / WEIGHT } else { took };
        }
        self.has_learnt = true;
        let work = self.work.load(Ordering::Relaxed);
        self.work.store(0, Ordering::Relaxed);
        Duration::from_nanos(work as u64)
    }
}

/// The clock of a run, which stands still in one that is not measured.
#[derive(Clone, Copy)]
pub(super) struct Clock<'run> {
    start: Option<(Instant, &'run Costs)>,
}

impl<'run> Clock<'run> {
    pub(super) fn new(costs: Option<&'run Costs>) -> Self {
        Self { start: costs.map(|costs| (Instant::now(), costs)) }
    }

    /// A node starts.
    pub(super) fn start(self, node: u32) {
        if let Some((start, costs)) = self.start {
            // Relaxed, here and below: who reads it has come after, as those do who depend on the node.
            costs.started[node as usize].store(nanoseconds(start), Ordering::Relaxed);
        }
    }

    /// A node ends.
    pub(super) fn end(self, node: u32) {
        if let Some((start, costs)) = self.start {
            let node = node as usize;
            let took = nanoseconds(start).saturating_sub(costs.started[node].load(Ordering::Relaxed));
            costs.took[node].store(took, Ordering::Relaxed);
        }
    }

    /// Calls what is work of the run.
    pub(super) fn work<R>(self, call: impl FnOnce() -> R) -> R {
        let Some((_, costs)) = self.start else { return call() };
        let start = Instant::now();
        let result = call();
        costs.work.fetch_add(start.elapsed().as_nanos() as usize, Ordering::Relaxed);
        result
    }
}

/// Runs of more than four seconds are not told from those of four.
fn nanoseconds(since: Instant) -> u32 {
    since.elapsed().as_nanos().try_into().unwrap_or(u32::MAX)
}
