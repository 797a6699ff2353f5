//! The cost of an object in scenes of many objects.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use drawloom::task::Scheduler;
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::statistics::median;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::runner::{Division, Runner, Sample};
use crate::{Extent, world};

/// Each is a view, beside the camera's.
const LIGHTS: usize = 1;

/// A row of the table.
#[derive(Serialize)]
pub struct Row {
    pub objects: usize,
    pub backend: BackendName,
    pub workers: usize,
    pub ns_per_object_view: f64,
}

/// Measures these numbers of objects with all numbers of workers, interleaved.
///
/// # Errors
/// Returns an error if a frame cannot be drawn.
pub fn measure(
    extent: &Extent,
    objects: &[usize],
    backend: BackendName,
    workers: &[usize],
    progress: &ProgressBar,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let rounds = Rounds { warm_up: backend.of(extent.growth_warm_up), measured: backend.of(extent.growth_rounds) };
    progress.set_message(format!("growth, {}", backend.name()));
    let (mut sizes, mut runners) = (Vec::new(), Vec::new());
    for &workers in workers {
        let scheduler = Arc::new(Scheduler::new(workers)?);
        for &objects in objects {
            sizes.push((objects, workers));
            runners.push((world::new(objects, LIGHTS)?, Runner::new(backend.open()?, &scheduler, Division::OWN)?));
        }
    }
    let samples = Harness::new(rounds, progress)
        .measure(&mut runners, |(world, runner), _round| runner.sample(world, Duration::ZERO))?;
    let row = |((objects, workers), samples): ((usize, usize), Vec<Sample>)| {
        let object_views = (objects * (1 + LIGHTS)) as f64;
        let frame = median(samples.iter().map(|sample| sample.frame));
        Row { objects, backend, workers, ns_per_object_view: frame * 1e9 / object_views }
    };
    Ok(sizes.into_iter().zip(samples).map(row).collect())
}
