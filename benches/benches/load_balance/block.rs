//! A block of modes, which are measured interleaved.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{EncodingStrategy, WgpuBackend, WgpuSubmission};
use drawloom::process::Deferred;
use drawloom::report::SchedulerCosts;
use drawloom::task::Scheduler;
use drawloom::{Granularity, Renderer, Submitter};
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::stopwatch::{FrameTime, timed_frame};
use indicatif::ProgressBar;

use crate::Extent;
use crate::interruption::Interruption;
use crate::mode::Mode;
use crate::occupancy::Occupancy;
use crate::prediction::Prediction;
use crate::scenes::Case;
use crate::world::{PERIOD, World};

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

/// A mode at work.
struct Runner<'a> {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    world: World<'a>,
    results: ModeResults,
    /// The objects that all cameras saw in samples, and the number of frames in those.
    seen: [u64; 2],
}

/// The results of a mode.
pub struct ModeResults {
    /// Seconds a frame, by round.
    pub calibration: Vec<f64>,
    pub measured: Vec<f64>,
    /// Seconds of submission, of the measured rounds.
    pub submit: Vec<f64>,
    pub occupancy: Occupancy,
    pub prediction: Prediction,
}

/// The results of all modes, in their order.
pub struct Measured {
    pub modes: Vec<ModeResults>,
    /// Visible objects, summed over all views: the mean of all frames.
    pub object_views: f64,
}

impl Block<'_> {
    /// # Errors
    /// Returns an error if a frame cannot be drawn, or if a camera does not see the objects it should.
    pub fn measure(&self) -> Result<Measured, Box<dyn Error>> {
        let (warm_up, half) = (self.backend.of(self.extent.warm_up), self.backend.of(self.extent.rounds));
        self.progress.set_message(format!("{}, {}, {}", self.case.name, self.case.kind.name(), self.backend.name()));
        // With room for every draw as a job of its own.
        let scheduler = |workers| Scheduler::builder().workers(workers).timeline_capacity(1 << 20).build();
        let (one, all) = (Arc::new(scheduler(1)?), Arc::new(scheduler(self.workers)?));
        let mut modes = Vec::new();
        for mode in &Mode::ALL {
            modes.push(self.open(mode, if mode.is_serial { &one } else { &all })?);
        }
        let mut interruption = None;
        let replayed = half..half + self.extent.replays;
        let mut harness = Harness::new(Rounds { warm_up, measured: 2 * half }, self.progress);
        for round in harness.rounds(modes.len()) {
            let Some(round) = round.measured() else {
                harness.round(&mut modes, |runner| self.frame(runner))?;
                continue;
            };
            if self.case.is_interrupted {
                interruption.get_or_insert_with(Interruption::begin);
            }
            harness.round(&mut modes, |runner| {
                let [cpu, submit] = self.sample(runner)?;
                let results = &mut runner.results;
                if round < half {
                    results.calibration.push(cpu);
                } else {
                    results.measured.push(cpu);
                    results.submit.push(submit);
                }
                if replayed.contains(&round) { self.recorded_frames(runner) } else { Ok(()) }
            })?;
        }
        drop(interruption);
        let [objects, frames] = modes[Mode::SERIAL].seen;
        // Whole periods, or equal numbers of frames: all modes draw the same.
        if let Some(index) = modes.iter().position(|mode| mode.seen[0] * frames != objects * mode.seen[1]) {
            let (scene, mode) = (self.case.name, Mode::ALL[index].name);
            return Err(format!("{scene}: {mode} draws other objects than serial").into());
        }
        let object_views = objects as f64 / frames as f64;
        Ok(Measured { modes: modes.into_iter().map(|runner| runner.results).collect(), object_views })
    }

    fn open(&self, mode: &Mode, scheduler: &Arc<Scheduler>) -> Result<Runner<'_>, Box<dyn Error>> {
        let mut backend = self.backend.open()?;
        if mode.translates_on_submit {
            backend = backend.encoding_strategy(EncodingStrategy::OnSubmit);
        }
        let builder = Renderer::builder(backend).pipeline(Deferred::to_picture()).quality(self.case.quality);
        let builder = builder.granularity(mode.granularity).instancing(self.case.instancing);
        let (renderer, submitter) = builder.build(Arc::clone(scheduler))?;
        let is_cut_by_cost = mode.granularity == Granularity::Adaptive;
        let results = ModeResults {
            calibration: Vec::new(),
            measured: Vec::new(),
            submit: Vec::new(),
            occupancy: Occupancy::default(),
            prediction: Prediction::new(self.costs, self.workers, is_cut_by_cost),
        };
        Ok(Runner { renderer, submitter, world: World::new(self.case), results, seen: [0; 2] })
    }

    /// Draws as many frames as a sample takes, in whole periods, or one. Returns the mean seconds of a frame, and those
    /// of its submission.
    fn sample(&self, runner: &mut Runner<'_>) -> Result<[f64; 2], Box<dyn Error>> {
        let sample = self.backend.of(self.extent.sample);
        // A sample of a single frame stays one.
        let (at_least, period) = match sample.is_zero() {
            true => (sample, 1),
            false if self.case.is_interrupted => (sample.max(Interruption::MIN_SAMPLE), PERIOD),
            false => (sample, PERIOD),
        };
        let (mut cpu, mut submit, mut frames) = (Duration::ZERO, Duration::ZERO, 0);
        while frames == 0 || cpu < at_least {
            for _ in 0..period {
                let (time, visible) = self.frame(runner)?;
                cpu += time.cpu;
                submit += time.cpu - time.borrowed;
                runner.seen[0] += visible as u64;
            }
            frames += period;
            runner.seen[1] += period as u64;
        }
        Ok([cpu, submit].map(|time| time.as_secs_f64() / frames as f64))
    }

    /// Draws a frame. Returns its time, and the number of objects that all cameras see.
    fn frame(&self, runner: &mut Runner<'_>) -> Result<(FrameTime, usize), Box<dyn Error>> {
        let Runner { renderer, submitter, world, .. } = runner;
        world.step();
        let (submitted, time) = timed_frame(renderer, submitter, world.as_scene_ref(), WgpuSubmission::wait)?;
        let visible = submitted.statistics.views.iter().map(|view| view.visible);
        if !world.may_see(visible.clone()) {
            let (name, visible) = (self.case.name, visible.collect::<Vec<_>>());
            return Err(format!("{name}: cameras see {visible:?} objects, not about {:?}", self.case.visible).into());
        }
        Ok((time, visible.sum()))
    }

    /// Draws frames, one after another. The last is recorded and replayed, and the frame of the same content, a period
    /// before, is timed.
    fn recorded_frames(&self, runner: &mut Runner<'_>) -> Result<(), Box<dyn Error>> {
        let timeline = Arc::clone(runner.renderer.scheduler().timeline());
        let mut timed = 0.0;
        // Whole periods, so that all modes go on with the same frame.
        for left in (0..2 * PERIOD).rev() {
            match left {
                PERIOD => timed = self.frame(runner)?.0.cpu.as_secs_f64(),
                1 => {
                    timeline.start();
                    self.frame(runner)?;
                }
                _ => {
                    self.frame(runner)?;
                }
            }
        }
        timeline.stop();
        let log = timeline.take();
        let frame = log.frames.last().ok_or("no frame was recorded")?.number;
        let run = log.runs_of(frame).next().ok_or("no run was recorded")?;
        runner.results.occupancy.add(run);
        runner.results.prediction.add(&log, frame, timed)
    }
}
