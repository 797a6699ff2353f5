//! Modes that take turns.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{WgpuBackend, WgpuSubmission};
use drawloom::process::Deferred;
use drawloom::report::Prices;
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use drawloom_benches::backends::BackendName;
use drawloom_benches::stopwatch::timed_frame;
use drawloom_testing::random::Random;
use indicatif::ProgressBar;

use crate::Extent;
use crate::interruption::Interruption;
use crate::mode::Mode;
use crate::prediction::Prediction;
use crate::scenes::Case;

/// All modes on one scene, one backend and so many workers.
pub struct Block<'a> {
    pub case: &'a Case,
    pub backend: BackendName,
    pub workers: usize,
    /// What a wake, a steal and the like take on this machine.
    pub prices: Prices,
    pub extent: &'a Extent,
    pub progress: &'a ProgressBar,
}

/// A mode's renderer.
struct Setting {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
}

/// What a mode's turns took: seconds a frame, by round.
#[derive(Default)]
pub struct Times {
    pub calibration: Vec<f64>,
    pub measured: Vec<f64>,
}

/// Of each mode.
pub struct Measured {
    pub times: Vec<Times>,
    pub predictions: Vec<Prediction>,
}

impl Block<'_> {
    /// # Errors
    /// If a frame cannot be drawn, or a camera does not see what it should.
    pub fn measure(&self) -> Result<Measured, Box<dyn Error>> {
        let (warm_up, rounds) = (self.backend.of(self.extent.warm_up), self.backend.of(self.extent.rounds));
        self.progress.set_message(format!("{}, {}", self.case.name, self.backend.name()));
        self.progress.inc_length((2 * rounds * Mode::ALL.len()) as u64);
        // With room for every draw as a job of its own.
        let scheduler = |workers| Scheduler::builder().workers(workers).timeline_capacity(1 << 20).build();
        let (one, all) = (Arc::new(scheduler(1)?), Arc::new(scheduler(self.workers)?));
        let open = |mode: &Mode| {
            let scheduler = if mode.is_serial { &one } else { &all };
            let builder = Renderer::builder(self.backend.open()?).deferred(Deferred::to_picture());
            let (renderer, submitter) = builder.granularity(mode.granularity).build(Arc::clone(scheduler))?;
            Ok::<_, Box<dyn Error>>(Setting { renderer, submitter })
        };
        let mut settings = Mode::ALL.iter().map(open).collect::<Result<Vec<_>, _>>()?;
        for _ in 0..warm_up {
            settings.iter_mut().try_for_each(|setting| self.frame(setting).map(drop))?;
        }
        let _interruption = self.case.is_interrupted.then(Interruption::begin);
        let mut times: Vec<Times> = settings.iter().map(|_| Times::default()).collect();
        let mut predictions = vec![Prediction::new(self.prices, self.workers); settings.len()];
        let replayed = rounds..rounds + self.extent.replays;
        let mut random = Random::new();
        for round in 0..2 * rounds {
            for index in random.order(settings.len()) {
                let time = self.turn(&mut settings[index])?;
                let Times { calibration, measured } = &mut times[index];
                if round < rounds {
                    calibration.push(time)
                } else {
                    measured.push(time)
                }
                if replayed.contains(&round) {
                    let Setting { renderer, submitter } = &mut settings[index];
                    predictions[index].replay(renderer, submitter, self.case.scene.as_scene_ref())?;
                }
                self.progress.inc(1);
            }
        }
        Ok(Measured { times, predictions })
    }

    /// As many frames as a turn takes; returns seconds a frame.
    fn turn(&self, setting: &mut Setting) -> Result<f64, Box<dyn Error>> {
        let turn = self.backend.of(self.extent.turn);
        // Where a turn is a single frame it stays one.
        let is_longer = self.case.is_interrupted && !turn.is_zero();
        let least = if is_longer { turn.max(Interruption::TURN) } else { turn };
        let (mut elapsed, mut frames) = (Duration::ZERO, 0);
        while frames == 0 || elapsed < least {
            elapsed += self.frame(setting)?;
            frames += 1;
        }
        Ok(elapsed.as_secs_f64() / f64::from(frames))
    }

    /// From the scene's hand-over to the return of submit.
    fn frame(&self, setting: &mut Setting) -> Result<Duration, Box<dyn Error>> {
        let Setting { renderer, submitter } = setting;
        let scene = self.case.scene.as_scene_ref();
        let (submitted, time) = timed_frame(renderer, submitter, scene, WgpuSubmission::wait)?;
        let seen = submitted.statistics.views.iter().map(|view| view.visible);
        if !seen.clone().eq(self.case.seen.iter().copied()) {
            let seen: Vec<_> = seen.collect();
            return Err(format!("{}: cameras see {seen:?} objects, not {:?}", self.case.name, self.case.seen).into());
        }
        Ok(time.processor)
    }
}
