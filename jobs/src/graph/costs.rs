//! What the nodes of a schedule cost, measured in some of its runs.

use std::time::Duration;

use crate::sync::{AtomicU32, AtomicUsize, Ordering};
use crate::timeline::Stopwatch;
use crate::tuning::{Estimate, Filter};

/// The measured costs, in nanoseconds.
pub(super) struct NodeCosts {
    /// Per node, from its start to its end.
    estimates: Box<[Estimate]>,
    /// Per node, in the current run: when it started, by the run's clock, and how long it took.
    started: Box<[AtomicU32]>,
    took: Box<[AtomicU32]>,
    /// The current run's work: the time of all workers together.
    work: AtomicUsize,
}

const MEASURED_RUNS: Filter = Filter::unlimited(4.0);

impl NodeCosts {
    pub(super) fn new(nodes: usize) -> Self {
        let zeros = || (0..nodes).map(|_| AtomicU32::new(0)).collect();
        Self {
            estimates: vec![Estimate::default(); nodes].into(),
            started: zeros(),
            took: zeros(),
            work: AtomicUsize::new(0),
        }
    }

    /// Nanoseconds of a node; 0 before the first measured run.
    pub(super) fn nanoseconds(&self, node: usize) -> u64 {
        self.estimates[node].get().unwrap_or(0.0) as u64
    }

    /// The node's estimated cost; `None` if there is no such node or no run was measured.
    pub(super) fn of(&self, node: usize) -> Option<Duration> {
        let nanoseconds = self.estimates.get(node)?.get()?;
        Some(Duration::from_nanos(nanoseconds as u64))
    }

    /// Clears the work of a cancelled run.
    pub(super) fn clear_work(&self) {
        self.work.store(0, Ordering::Relaxed);
    }

    /// Adds the measured run that has just ended to the estimates, and returns how much work it was.
    pub(super) fn update(&mut self) -> Duration {
        for (estimate, took) in self.estimates.iter_mut().zip(&self.took) {
            // Relaxed: the run is over.
            estimate.add(took.load(Ordering::Relaxed) as f32, MEASURED_RUNS);
        }
        let work = self.work.load(Ordering::Relaxed);
        self.work.store(0, Ordering::Relaxed);
        Duration::from_nanos(work as u64)
    }
}

/// Measures the nodes of one run; does nothing in a run that is not measured.
#[derive(Clone, Copy)]
pub(super) struct CostTimer<'run> {
    start: Option<(Stopwatch<'run>, &'run NodeCosts)>,
}

impl<'run> CostTimer<'run> {
    /// With a stopwatch that started with the run.
    pub(super) fn new(start: Stopwatch<'run>, costs: Option<&'run NodeCosts>) -> Self {
        Self { start: costs.map(|costs| (start, costs)) }
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
        let Some((start, costs)) = self.start else { return call() };
        let start = start.restarted();
        let result = call();
        costs.work.fetch_add(start.elapsed().as_nanos() as usize, Ordering::Relaxed);
        result
    }
}

/// Saturates after about four seconds.
fn nanoseconds(since: Stopwatch<'_>) -> u32 {
    since.elapsed().as_nanos().try_into().unwrap_or(u32::MAX)
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use drawloom_signal::{ControllerBounds, check_controller};

    use super::*;

    #[test]
    #[cfg_attr(miri, ignore = "long, and calls no unsafe code")]
    fn it_settles_and_recovers_and_an_outlier_changes_the_order_briefly() {
        let bounds = ControllerBounds { settles_within: [40; 3], max_wrong: 150, max_changes: 60 };
        check_controller(
            &bounds,
            || NodeCosts::new(2),
            |costs, is_after, signal| {
                for (took, cost) in costs.took.iter().zip([2000.0, if is_after { 9000.0 } else { 500.0 }]) {
                    took.store(signal.sample(cost) as u32, Ordering::Relaxed);
                }
                costs.update();
                costs.nanoseconds(1) > costs.nanoseconds(0)
            },
            |&is_costlier, is_after| is_costlier == is_after,
        );
    }
}
