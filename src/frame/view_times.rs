//! The thread time of each view.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Sums up the thread time of each view's stages while jobs run. It keeps its memory from frame to frame.
#[derive(Debug, Default)]
pub(super) struct ViewTimes {
    /// By view index.
    nanoseconds: Vec<AtomicU64>,
}

impl ViewTimes {
    /// Begins a frame of this many views.
    pub(super) fn reset(&mut self, views: usize) {
        self.nanoseconds.clear();
        self.nanoseconds.resize_with(views, AtomicU64::default);
    }

    /// Adds the time of a job of one of a view's stages.
    pub(super) fn add(&self, view: usize, took: Duration) {
        // Relaxed: a sum, read after the run.
        self.nanoseconds[view].fetch_add(took.as_nanos() as u64, Ordering::Relaxed);
    }

    /// Takes away a time that the job of one of the view's stages spends on other views. The job's own time is added
    /// when it ends; until then the sum may be below 0, and wraps.
    pub(super) fn subtract(&self, view: usize, took: Duration) {
        // Relaxed: a sum, read after the run.
        self.nanoseconds[view].fetch_sub(took.as_nanos() as u64, Ordering::Relaxed);
    }

    pub(super) fn times(&self) -> impl Iterator<Item = Duration> {
        self.nanoseconds.iter().map(|view| Duration::from_nanos(view.load(Ordering::Relaxed)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_gives_time_away_before_its_own_is_known() {
        let mut times = ViewTimes::default();
        times.reset(2);
        let nanoseconds = Duration::from_nanos;
        times.subtract(0, nanoseconds(700));
        times.add(0, nanoseconds(300));
        times.add(1, nanoseconds(400));
        times.add(0, nanoseconds(1000));
        assert_eq!(times.times().collect::<Vec<_>>(), [600, 400].map(nanoseconds));
    }
}
