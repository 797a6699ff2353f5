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
use crate::runner::{Runner, Sample};
use crate::{Extent, world};

pub const WORKERS: usize = 2;

/// A row of L's table.
#[derive(Serialize)]
pub struct Row {
    pub objects: usize,
    pub backend: BackendName,
    pub instancing: bool,
    pub single_fps: f64,
    pub multi_fps: f64,
    pub ratio: f64,
    /// The ratio of one worker that replays cached bundles. Without instancing only, like the next.
    pub cached_ratio: Option<f64>,
    /// The ratio of two workers that record directly.
    pub direct_ratio: Option<f64>,
    pub ceiling: f64,
    /// The time in which the world is borrowed.
    pub single_held_ms: f64,
    pub multi_held_ms: f64,
    /// The same as a share of the frame.
    pub single_held_share: f64,
    pub multi_held_share: f64,
}

/// # Errors
/// Returns an error if a frame cannot be drawn.
pub fn measure(
    extent: &Extent,
    backend: BackendName,
    objects: usize,
    progress: &ProgressBar,
) -> Result<[Row; 2], Box<dyn Error>> {
    let rounds = Rounds { warm_up: backend.of(extent.warm_up), measured: backend.of(extent.rounds) };
    progress.set_message(format!("{objects} objects, {}", backend.name()));
    let (one, two) = (Arc::new(Scheduler::new(1)?), Arc::new(Scheduler::new(WORKERS)?));
    let with = |strategy| Ok::<_, Box<dyn Error>>(backend.open()?.recording_strategy(strategy)?);
    let mut runners = [
        Runner::new(with(RecordingStrategy::Direct)?, &one, false)?,
        Runner::new(with(RecordingStrategy::CachedBundles)?, &one, false)?,
        Runner::new(with(RecordingStrategy::Direct)?, &two, false)?,
        Runner::new(backend.open()?, &two, false)?,
        Runner::new(backend.open()?, &two, true)?,
    ];
    let mut world = world::new(objects)?;
    let mut samples: [Vec<Sample>; 5] = Default::default();
    let mut serial = Vec::new();
    let mut harness = Harness::new(rounds, progress);
    for round in harness.rounds(runners.len()) {
        let at_least = if round.is_warm_up() { Duration::ZERO } else { backend.of(extent.sample) };
        let results = harness.round(&mut runners, |runner| runner.sample(&mut world, at_least))?;
        if !round.is_warm_up() {
            samples.iter_mut().zip(results).for_each(|(samples, result)| samples.push(result));
            serial.push(runners[0].serial_part(&mut world)?);
        }
    }
    let frame = |samples: &[Sample]| median(samples.iter().map(|sample| sample.frame));
    let borrowed = |samples: &[Sample]| median(samples.iter().map(|sample| sample.borrowed));
    let borrowed_share = |samples: &[Sample]| median(samples.iter().map(|sample| sample.borrowed / sample.frame));
    let [single, cached, direct, multi @ ..] = &samples;
    let ratio = |to: &[Sample]| median(single.iter().zip(to).map(|(single, sample)| single.frame / sample.frame));
    let ceiling = ceiling(frame(single), median(serial), two.wake_up_cost().as_secs_f64());
    let row = |instancing: bool| {
        let multi = &multi[usize::from(instancing)];
        Row {
            objects,
            backend,
            instancing,
            single_fps: frame(single).recip(),
            multi_fps: frame(multi).recip(),
            ratio: ratio(multi),
            cached_ratio: (!instancing).then(|| ratio(cached)),
            direct_ratio: (!instancing).then(|| ratio(direct)),
            ceiling,
            single_held_ms: borrowed(single) * 1e3,
            multi_held_ms: borrowed(multi) * 1e3,
            single_held_share: borrowed_share(single),
            multi_held_share: borrowed_share(multi),
        }
    };
    Ok([row(false), row(true)])
}
