//! Predicted frame times with other numbers of workers.

use std::error::Error;

use drawloom::report::{Replay, SchedulerCosts};
use drawloom::timeline::Log;
use drawloom_benches::statistics::median;

use crate::bounds::Bounds;

/// More workers than most machines have.
pub const PREDICTED: [usize; 5] = [4, 8, 16, 32, 64];

/// Predicted seconds of each replayed frame, by number of workers. `measured` has the time of a frame before each, of
/// the same content and with equally warm caches: the prediction for the actual number of workers is compared with it.
#[derive(Clone)]
pub struct Prediction {
    costs: SchedulerCosts,
    times: Vec<(usize, Vec<f64>)>,
    measured: Vec<f64>,
    /// What bounds the predictions of frames that are cut for the workers; `None` for others.
    bounds: Option<Bounds>,
}

impl Prediction {
    /// Predicts for `workers` workers, for one, and for [`PREDICTED`].
    pub fn new(costs: SchedulerCosts, workers: usize, is_adaptive: bool) -> Self {
        let mut counts: Vec<_> = [1, workers].into_iter().chain(PREDICTED).collect();
        counts.sort_unstable();
        counts.dedup();
        let times = counts.into_iter().map(|count| (count, Vec::new())).collect();
        Self { costs, times, measured: Vec::new(), bounds: is_adaptive.then(Bounds::default) }
    }

    /// Replays a recorded frame. `measured` is how many seconds one like it took without a timeline.
    ///
    /// # Errors
    /// Returns an error if the frame cannot be replayed.
    pub fn add(&mut self, log: &Log, frame: u64, measured: f64) -> Result<(), Box<dyn Error>> {
        let replay = Replay::of_frame(log, frame, self.costs)?;
        self.measured.push(measured);
        for (workers, times) in &mut self.times {
            times.push(replay.frame_time(*workers).as_secs_f64());
        }
        if let Some(bounds) = &mut self.bounds {
            bounds.add(log, frame, self.costs)?;
        }
        Ok(())
    }

    /// What bounds the predictions; `None` for a fixed granularity.
    pub fn bounds(&self) -> Option<&Bounds> {
        self.bounds.as_ref()
    }

    /// The median time of the frames before the replayed ones.
    pub fn measured(&self) -> f64 {
        median(self.measured.iter().copied())
    }

    /// The median prediction; `None` if there is none for this number of workers.
    pub fn of(&self, workers: usize) -> Option<f64> {
        let found = self.times.iter().find(|(count, _)| *count == workers);
        found.map(|(_, times)| median(times.iter().copied()))
    }
}
