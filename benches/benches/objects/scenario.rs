//! L's two scenarios, by the number of objects, and two between them.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::RecordingStrategy;
use drawloom::task::Scheduler;
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::statistics::median;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::ceiling::ceiling;
use crate::runner::{Division, InFlight, Profile, Runner, Sample};
use crate::{Extent, world};

/// A row of L's table.
#[derive(Serialize)]
pub struct Row {
    pub objects: usize,
    pub backend: BackendName,
    /// Of *multi*.
    pub workers: usize,
    pub instancing: bool,
    pub single_fps: f64,
    pub multi_fps: f64,
    /// Frames per second with the device's time, of which two are in flight: on the adapter only, like the next two.
    pub single_drawn_fps: Option<f64>,
    pub multi_drawn_fps: Option<f64>,
    /// The ratio of those.
    pub drawn_ratio: Option<f64>,
    pub ratio: f64,
    /// The ratio of one worker that replays cached bundles. Without instancing only, like the next.
    pub cached_ratio: Option<f64>,
    /// The ratio of as many workers that record directly.
    pub direct_ratio: Option<f64>,
    pub ceiling: f64,
    /// The time in which the world is borrowed.
    pub single_held_ms: f64,
    pub multi_held_ms: f64,
    /// The same as a share of the frame.
    pub single_held_share: f64,
    pub multi_held_share: f64,
    /// How busy each worker of *multi* is, as a share of the frame. The first is the calling thread.
    pub multi_loads: Vec<f64>,
    /// The share of all cores' time that the process uses with two frames in flight, its driver included; `None` where
    /// that cannot be measured.
    pub single_cpu_use: Option<f64>,
    pub multi_cpu_use: Option<f64>,
    /// The share of the work that is calls of wgpu.
    pub single_api_share: f64,
    pub multi_api_share: f64,
}

/// A scenario, and what was measured of it.
struct Scenario {
    runner: Runner,
    samples: Vec<Sample>,
    in_flight: Vec<InFlight>,
    profiles: Vec<Profile>,
}

/// The scenarios with some number of workers.
struct Parallel {
    scheduler: Arc<Scheduler>,
    /// The index of the one that records directly, and of *multi* without instancing and with it.
    direct: usize,
    multi: [usize; 2],
}

/// Measures the scenarios on one thread, and those with each of these numbers of workers, interleaved.
///
/// # Errors
/// Returns an error if a frame cannot be drawn.
pub fn measure(
    extent: &Extent,
    backend: BackendName,
    objects: usize,
    workers: &[usize],
    progress: &ProgressBar,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let rounds = Rounds { warm_up: backend.of(extent.warm_up), measured: backend.of(extent.rounds) };
    progress.set_message(format!("{objects} objects, {}", backend.name()));
    let mut scenarios = Vec::new();
    let mut add = |strategy: Option<RecordingStrategy>, scheduler: &Arc<Scheduler>, instancing| {
        let mut opened = backend.open()?;
        if let Some(strategy) = strategy {
            opened = opened.recording_strategy(strategy);
        }
        let runner = Runner::new(opened, scheduler, Division { instancing, ..Division::OWN })?;
        scenarios.push(Scenario { runner, samples: Vec::new(), in_flight: Vec::new(), profiles: Vec::new() });
        Ok::<_, Box<dyn Error>>(scenarios.len() - 1)
    };
    let one = Arc::new(Scheduler::new(1)?);
    let single = add(Some(RecordingStrategy::Direct), &one, false)?;
    let cached = add(Some(RecordingStrategy::CachedBundles), &one, false)?;
    let mut parallel = Vec::new();
    for &workers in workers {
        let scheduler = Arc::new(Scheduler::new(workers)?);
        let direct = add(Some(RecordingStrategy::Direct), &scheduler, false)?;
        let multi = [add(None, &scheduler, false)?, add(None, &scheduler, true)?];
        parallel.push(Parallel { scheduler, direct, multi });
    }
    let mut world = world::new(objects, 1)?;
    let mut harness = Harness::new(rounds, progress);
    for round in harness.rounds(scenarios.len()) {
        let at_least = if round.is_warm_up() { Duration::ZERO } else { backend.of(extent.sample) };
        harness.round(&mut scenarios, |Scenario { runner, samples, in_flight, profiles }| {
            let sample = runner.sample(&mut world, at_least)?;
            if !round.is_warm_up() {
                samples.push(sample);
                in_flight.push(runner.in_flight(&mut world, at_least)?);
                profiles.push(runner.profile(&mut world)?);
            }
            Ok::<_, Box<dyn Error>>(())
        })?;
    }
    let single = &scenarios[single];
    let row = |parallel: &Parallel, instancing: bool| {
        let multi = &scenarios[parallel.multi[usize::from(instancing)]];
        let workers = parallel.scheduler.workers();
        let wake = parallel.scheduler.wake_up_cost().as_secs_f64();
        let on_adapter = backend == BackendName::Adapter;
        let drawn_fps =
            |scenario: &Scenario| on_adapter.then(|| scenario.median_in_flight(|in_flight| in_flight.frame).recip());
        let cpu_use = |scenario: &Scenario| {
            Some(scenario.median_in_flight(|in_flight| in_flight.cpu_use)).filter(|used| !used.is_nan())
        };
        let held_share = |scenario: &Scenario| scenario.median(|sample| sample.borrowed / sample.frame);
        Row {
            objects,
            backend,
            workers,
            instancing,
            single_fps: single.median(|sample| sample.frame).recip(),
            multi_fps: multi.median(|sample| sample.frame).recip(),
            single_drawn_fps: drawn_fps(single),
            multi_drawn_fps: drawn_fps(multi),
            drawn_ratio: on_adapter.then(|| multi.drawn_ratio_to(single)),
            ratio: multi.ratio_to(single),
            cached_ratio: (!instancing).then(|| scenarios[cached].ratio_to(single)),
            direct_ratio: (!instancing).then(|| scenarios[parallel.direct].ratio_to(single)),
            ceiling: ceiling(
                single.median(|sample| sample.frame),
                single.median_of_profiles(|profile| profile.serial),
                wake,
                workers,
            ),
            single_held_ms: single.median(|sample| sample.borrowed) * 1e3,
            multi_held_ms: multi.median(|sample| sample.borrowed) * 1e3,
            single_held_share: held_share(single),
            multi_held_share: held_share(multi),
            multi_loads: (0..workers).map(|worker| multi.median_of_profiles(|profile| profile.loads[worker])).collect(),
            single_cpu_use: cpu_use(single),
            multi_cpu_use: cpu_use(multi),
            single_api_share: single.median_of_profiles(|profile| profile.api_share),
            multi_api_share: multi.median_of_profiles(|profile| profile.api_share),
        }
    };
    Ok(parallel.iter().flat_map(|parallel| [row(parallel, false), row(parallel, true)]).collect())
}

impl Scenario {
    fn median(&self, value: impl Fn(&Sample) -> f64) -> f64 {
        median(self.samples.iter().map(value))
    }

    fn median_in_flight(&self, value: impl Fn(&InFlight) -> f64) -> f64 {
        median(self.in_flight.iter().map(value))
    }

    fn median_of_profiles(&self, value: impl Fn(&Profile) -> f64) -> f64 {
        median(self.profiles.iter().map(value))
    }

    /// How many times as fast it is: the ratio of the medians.
    fn ratio_to(&self, base: &Self) -> f64 {
        base.median(|sample| sample.frame) / self.median(|sample| sample.frame)
    }

    /// The same with the device's time.
    fn drawn_ratio_to(&self, base: &Self) -> f64 {
        base.median_in_flight(|in_flight| in_flight.frame) / self.median_in_flight(|in_flight| in_flight.frame)
    }
}
