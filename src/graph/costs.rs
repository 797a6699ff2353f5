//! What the nodes of a schedule cost, measured in some of its runs.

use std::time::Duration;

use crate::sync::{AtomicU32, AtomicUsize, Instant, Ordering};

/// The measured costs, in nanoseconds.
pub(super) struct NodeCosts {
    /// Per node, from its start to its end: a moving average over the measured runs.
    average: Box<[u64]>,
    is_measured: bool,
    /// Per node, in the current run: when it started, by the run's clock, and how long it took.
    started: Box<[AtomicU32]>,
    took: Box<[AtomicU32]>,
    /// The current run's work: the time of all workers together.
    work: AtomicUsize,
}

/// The latest run's weight in the average is one part in this many.
const AVERAGE_PARTS: u64 = 4;

impl NodeCosts {
    pub(super) fn new(nodes: usize) -> Self {
        let zeros = || (0..nodes).map(|_| AtomicU32::new(0)).collect();
        Self {
            average: vec![0; nodes].into(),
            is_measured: false,
            started: zeros(),
            took: zeros(),
            work: AtomicUsize::new(0),
        }
    }

    /// Nanoseconds per node; all are 0 before the first measured run.
    pub(super) fn averages(&self) -> &[u64] {
        &self.average
    }

    /// The node's average cost, if any run was measured.
    pub(super) fn of(&self, node: usize) -> Option<Duration> {
        let average = self.average.get(node)?;
        self.is_measured.then(|| Duration::from_nanos(*average))
    }

    /// Clears the work of a cancelled run.
    pub(super) fn clear_work(&self) {
        self.work.store(0, Ordering::Relaxed);
    }

    /// Adds the measured run that has just ended to the averages, and returns how much work it was.
    pub(super) fn update(&mut self) -> Duration {
        for (average, took) in self.average.iter_mut().zip(&self.took) {
            // Relaxed: the run is over.
            let took = u64::from(took.load(Ordering::Relaxed));
            *average = if self.is_measured { (*average * (AVERAGE_PARTS - 1) + took) / AVERAGE_PARTS } else { took };
        }
        self.is_measured = true;
        let work = self.work.load(Ordering::Relaxed);
        self.work.store(0, Ordering::Relaxed);
        Duration::from_nanos(work as u64)
    }
}

/// Measures the nodes of one run; does nothing in a run that is not measured.
#[derive(Clone, Copy)]
pub(super) struct CostTimer<'run> {
    start: Option<(Instant, &'run NodeCosts)>,
}

impl<'run> CostTimer<'run> {
    pub(super) fn new(costs: Option<&'run NodeCosts>) -> Self {
        Self { start: costs.map(|costs| (Instant::now(), costs)) }
    }

    /// A node starts.
    pub(super) fn start(self, node: u32) {
        if let Some((start, costs)) = self.start {
            // Relaxed, here and below: the reader is ordered after the write as a dependent is after the node.
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

    /// Makes a call that counts as work of the run.
    pub(super) fn work<R>(self, call: impl FnOnce() -> R) -> R {
        let Some((_, costs)) = self.start else { return call() };
        let start = Instant::now();
        let result = call();
        costs.work.fetch_add(start.elapsed().as_nanos() as usize, Ordering::Relaxed);
        result
    }
}

/// Saturates after about four seconds.
fn nanoseconds(since: Instant) -> u32 {
    since.elapsed().as_nanos().try_into().unwrap_or(u32::MAX)
}
