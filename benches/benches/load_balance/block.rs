//! A block of granularity modes, which are measured interleaved.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{WgpuBackend, WgpuSubmission};
use drawloom::process::Deferred;
use drawloom::report::SchedulerCosts;
use drawloom::task::Scheduler;
use drawloom::{Granularity, Renderer, Submitter};
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::stopwatch::{mean_frame, timed_frame};
use indicatif::ProgressBar;

use crate::Extent;
use crate::interruption::Interruption;
use crate::mode::Mode;
use crate::prediction::Prediction;
use crate::scenes::Case;

/// All modes on one scene, one backend and one number of workers.
pub struct Block<'a> {
    pub case: &'a Case,
    pub backend: BackendName,
    pub workers: usize,
    /// The scheduler costs of this machine.
    pub costs: SchedulerCosts,
    pub extent: &'a Extent,
    pub progress: &'a ProgressBar,
}

/// A mode's renderer.
struct Runner {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
}

/// A mode's samples: seconds per frame, by round.
#[derive(Default)]
pub struct Times {
    pub calibration: Vec<f64>,
    pub measured: Vec<f64>,
}

/// The results of all modes, in their order.
pub struct Measured {
    pub times: Vec<Times>,
    pub predictions: Vec<Prediction>,
}

impl Block<'_> {
    /// # Errors
    /// Returns an error if a frame cannot be drawn, or if a camera does not see the objects it should.
    pub fn measure(&self) -> Result<Measured, Box<dyn Error>> {
        let (warm_up, half) = (self.backend.of(self.extent.warm_up), self.backend.of(self.extent.rounds));
        self.progress.set_message(format!("{}, {}", self.case.name, self.backend.name()));
        // With room for every draw as a job of its own.
        let scheduler = |workers| Scheduler::builder().workers(workers).timeline_capacity(1 << 20).build();
        let (one, all) = (Arc::new(scheduler(1)?), Arc::new(scheduler(self.workers)?));
        let open = |mode: &Mode| {
            let scheduler = if mode.is_serial { &one } else { &all };
            let builder = Renderer::builder(self.backend.open()?).deferred(Deferred::to_picture());
            let (renderer, submitter) = builder.granularity(mode.granularity).build(Arc::clone(scheduler))?;
            let prediction = Prediction::new(self.costs, self.workers, mode.granularity == Granularity::Adaptive);
            Ok::<_, Box<dyn Error>>((Runner { renderer, submitter }, prediction))
        };
        let mut modes = Mode::ALL.iter().map(open).collect::<Result<Vec<_>, _>>()?;
        let mut interruption = None;
        let replayed = half..half + self.extent.replays;
        let mut harness = Harness::new(Rounds { warm_up, measured: 2 * half }, self.progress);
        let mut times: Vec<Times> = modes.iter().map(|_| Times::default()).collect();
        for round in harness.rounds(modes.len()) {
            let Some(round) = round.measured() else {
                harness.round(&mut modes, |(runner, _)| self.frame(runner))?;
                continue;
            };
            if self.case.is_interrupted {
                interruption.get_or_insert_with(Interruption::begin);
            }
            let samples = harness.round(&mut modes, |(runner, prediction)| {
                let sample = self.sample(runner)?;
                if replayed.contains(&round) {
                    let Runner { renderer, submitter } = runner;
                    prediction.replay(renderer, submitter, self.case.scene.as_scene_ref())?;
                }
                Ok::<_, Box<dyn Error>>(sample)
            })?;
            for (Times { calibration, measured }, sample) in times.iter_mut().zip(samples) {
                if round < half { calibration } else { measured }.push(sample);
            }
        }
        drop(interruption);
        Ok(Measured { times, predictions: modes.into_iter().map(|(_, prediction)| prediction).collect() })
    }

    /// Draws as many frames as a sample takes; returns seconds per frame.
    fn sample(&self, runner: &mut Runner) -> Result<f64, Box<dyn Error>> {
        let sample = self.backend.of(self.extent.sample);
        // A sample of a single frame stays one.
        let is_longer = self.case.is_interrupted && !sample.is_zero();
        mean_frame(if is_longer { sample.max(Interruption::MIN_SAMPLE) } else { sample }, || self.frame(runner))
    }

    /// Draws a frame; returns the time from the hand-over of the scene to the return of submit.
    fn frame(&self, runner: &mut Runner) -> Result<Duration, Box<dyn Error>> {
        let Runner { renderer, submitter } = runner;
        let scene = self.case.scene.as_scene_ref();
        let (submitted, time) = timed_frame(renderer, submitter, scene, WgpuSubmission::wait)?;
        let visible = submitted.statistics.views.iter().map(|view| view.visible);
        if !visible.clone().eq(self.case.visible.iter().copied()) {
            let (name, visible) = (self.case.name, visible.collect::<Vec<_>>());
            return Err(format!("{name}: cameras see {visible:?} objects, not {:?}", self.case.visible).into());
        }
        Ok(time.cpu)
    }
}
