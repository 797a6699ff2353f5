//! The splits of L 5, for more cores than there are processes: of the geometry buffer by material, and of the shadow
//! maps by light; beside this crate's, by draws.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use drawloom::Granularity;
use drawloom::backend::RecordingStrategy;
use drawloom::task::Scheduler;
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::statistics::median;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::runner::{Division, Runner, Sample};
use crate::{Extent, world};

/// Lights, each with a shadow map: one as in L 6, and as many as four cores can share.
const SHADOW_MAPS: [usize; 2] = [1, 4];

/// A row of the table.
#[derive(Serialize)]
pub struct Row {
    pub objects: usize,
    pub shadow_maps: usize,
    pub backend: BackendName,
    pub workers: usize,
    /// Frames per second of one thread, without the device's time.
    pub single_fps: f64,
    /// To that: a job for the geometry buffer and for each shadow map.
    pub by_process_ratio: f64,
    /// The same with the geometry buffer as a process for each worker, at most as many as there are materials, which
    /// they share.
    pub by_material_ratio: f64,
    /// As many jobs for each as its draws are worth.
    pub by_draws_ratio: f64,
    /// What the device takes longer for a geometry buffer of several passes: how many times as many frames there are
    /// *by material* as *by process*, if each waits until the device has drawn the one before. On the adapter only.
    pub by_material_drawn_ratio: Option<f64>,
}

/// What is one job. Each frame records everything anew: with draws straight into the pass, as L's command buffers are,
/// or into bundles, which several workers can record for one pass.
#[derive(Clone, Copy)]
enum Split {
    Process,
    Material,
    Draws,
}

impl Split {
    const ALL: [Self; 3] = [Self::Process, Self::Material, Self::Draws];

    fn runner(self, backend: BackendName, scheduler: &Arc<Scheduler>) -> Result<Runner, Box<dyn Error>> {
        let whole = Division { granularity: Granularity::PerCamera, ..Division::OWN };
        let (strategy, division) = match self {
            Self::Process => (RecordingStrategy::Direct, whole),
            Self::Material => (
                RecordingStrategy::Direct,
                Division { geometry_shares: scheduler.workers().min(world::ORIGINALS), ..whole },
            ),
            Self::Draws => (RecordingStrategy::Bundles, Division::OWN),
        };
        Runner::new(backend.open()?.recording_strategy(strategy), scheduler, division)
    }
}

/// Measures all splits with each of these numbers of workers, and one thread, interleaved.
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
    progress.set_message(format!("{objects} objects, split, {}", backend.name()));
    let mut rows = Vec::new();
    for shadow_maps in SHADOW_MAPS {
        let mut runners = vec![Split::Process.runner(backend, &Arc::new(Scheduler::new(1)?))?];
        for &workers in workers {
            let scheduler = Arc::new(Scheduler::new(workers)?);
            for split in Split::ALL {
                runners.push(split.runner(backend, &scheduler)?);
            }
        }
        let mut world = world::new(objects, shadow_maps)?;
        let samples = Harness::new(rounds, progress).measure(&mut runners, |runner, round| {
            let at_least = if round.is_warm_up() { Duration::ZERO } else { backend.of(extent.sample) };
            runner.sample(&mut world, at_least)
        })?;
        let [single, several @ ..] = &samples[..] else { continue };
        for (splits, &workers) in several.chunks(Split::ALL.len()).zip(workers) {
            let [by_process, by_material, by_draws] = splits else { continue };
            let to_single = |samples: &[Sample]| ratio(single, samples, |sample| sample.frame);
            let drawn_ratio = || ratio(by_process, by_material, |sample| sample.until_drawn);
            rows.push(Row {
                objects,
                shadow_maps,
                backend,
                workers,
                single_fps: median(single.iter().map(|sample| sample.frame)).recip(),
                by_process_ratio: to_single(by_process),
                by_material_ratio: to_single(by_material),
                by_draws_ratio: to_single(by_draws),
                by_material_drawn_ratio: (backend == BackendName::Adapter).then(drawn_ratio),
            });
        }
    }
    Ok(rows)
}

/// How many times as fast `samples` are: the ratio of the medians.
fn ratio(base: &[Sample], samples: &[Sample], time: impl Fn(&Sample) -> f64) -> f64 {
    median(base.iter().map(&time)) / median(samples.iter().map(&time))
}
