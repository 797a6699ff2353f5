//! Predicted frame times with other numbers of workers.

use std::error::Error;
use std::sync::Arc;

use drawloom::backend::{WgpuBackend, WgpuSubmission};
use drawloom::report::{Replay, SchedulerCosts};
use drawloom::scene::SceneRef;
use drawloom::{Renderer, Submitter};
use drawloom_benches::statistics::median;
use drawloom_benches::stopwatch::timed_frame;

use crate::bounds::Bounds;

/// More workers than most machines have.
pub const PREDICTED: [usize; 5] = [4, 8, 16, 32, 64];

/// Predicted seconds of each replayed frame, by number of workers. `measured` has the time of a frame shortly before each, with equally
/// warm caches: the prediction for the actual number of workers is compared with it.
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

    /// Draws three frames, one after another, and replays the last.
    ///
    /// # Errors
    /// Returns an error if a frame cannot be drawn or replayed.
    pub fn replay(
        &mut self,
        renderer: &mut Renderer<WgpuBackend>,
        submitter: &Submitter<WgpuBackend>,
        scene: SceneRef<'_>,
    ) -> Result<(), Box<dyn Error>> {
        let (_, time) = timed_frame(renderer, submitter, scene, WgpuSubmission::wait)?;
        self.measured.push(time.cpu.as_secs_f64());
        let timeline = Arc::clone(renderer.scheduler().timeline());
        timeline.start();
        for _ in 0..2 {
            let recorded = renderer.record(scene)?;
            submitter.submit(recorded)?.submission.wait()?;
        }
        timeline.stop();
        let log = timeline.take();
        let frame = log.frames.last().ok_or("no frame was recorded")?.number;
        let replay = Replay::of_frame(&log, frame, self.costs)?;
        for (workers, times) in &mut self.times {
            times.push(replay.frame_time(*workers).as_secs_f64());
        }
        if let Some(bounds) = &mut self.bounds {
            bounds.add(&log, frame, self.costs)?;
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
