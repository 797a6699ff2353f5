//! The thread time of each group of stages.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use drawloom_jobs::internal::Stopwatch;

use super::statistics::StageTimes;
use crate::timeline::Timeline;

/// A group of stages in [`StageTimes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StageGroup {
    Visibility,
    Fill,
    Sort,
    Instance,
    Record,
    Nodes,
}

/// Sums up thread time by group while jobs run.
pub(super) struct StageClock<'a> {
    nanoseconds: [AtomicU64; 6],
    timeline: &'a Timeline,
}

impl<'a> StageClock<'a> {
    /// A clock that measures as this timeline does.
    pub(super) fn new(timeline: &'a Timeline) -> Self {
        Self { nanoseconds: Default::default(), timeline }
    }

    /// A stopwatch that starts now.
    pub(super) fn stopwatch(&self) -> Stopwatch<'a> {
        self.timeline.stopwatch()
    }

    /// Runs `work`, adds its time to `group`, and returns its result and its time.
    pub(super) fn measure<R>(&self, group: StageGroup, work: impl FnOnce() -> R) -> (R, Duration) {
        let start = self.stopwatch();
        let result = work();
        let took = start.elapsed();
        // Relaxed: a sum, read after the run.
        self.nanoseconds[group as usize].fetch_add(took.as_nanos() as u64, Ordering::Relaxed);
        (result, took)
    }

    pub(super) fn times(&self) -> StageTimes {
        let of = |group: StageGroup| Duration::from_nanos(self.nanoseconds[group as usize].load(Ordering::Relaxed));
        StageTimes {
            visibility: of(StageGroup::Visibility),
            fill: of(StageGroup::Fill),
            sort: of(StageGroup::Sort),
            instance: of(StageGroup::Instance),
            record: of(StageGroup::Record),
            nodes: of(StageGroup::Nodes),
            submit: Duration::ZERO,
        }
    }
}
