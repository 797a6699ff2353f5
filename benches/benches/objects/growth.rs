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

use crate::runner::{Runner, Sample};
use crate::scenario::WORKERS;
use crate::{Extent, world};

/// A row of the table.
#[derive(Serialize)]
pub struct Row {
    pub objects: usize,
    pub backend: BackendName,
    pub ns_per_object_view: f64,
}

/// Measures all numbers of objects, interleaved.
///
/// # Errors
/// Returns an error if a frame cannot be drawn.
pub fn measure(extent: &Extent, backend: BackendName, progress: &ProgressBar) -> Result<Vec<Row>, Box<dyn Error>> {
    let rounds = Rounds { warm_up: backend.of(extent.growth_warm_up), measured: backend.of(extent.growth_rounds) };
    progress.set_message(format!("growth, {}", backend.name()));
    let scheduler = Arc::new(Scheduler::new(WORKERS)?);
    let open = |&objects: &usize| {
        let runner = Runner::new(backend.open()?, &scheduler, false)?;
        Ok::<_, Box<dyn Error>>((world::new(objects)?, runner))
    };
    let mut sizes = extent.growth.iter().map(open).collect::<Result<Vec<_>, _>>()?;
    let samples = Harness::new(rounds, progress)
        .measure(&mut sizes, |(world, runner), _round| runner.sample(world, Duration::ZERO))?;
    let row = |(&objects, samples): (&usize, Vec<Sample>)| {
        let object_views = (objects * world::VIEWS) as f64;
        let frame = median(samples.iter().map(|sample| sample.frame));
        Row { objects, backend, ns_per_object_view: frame * 1e9 / object_views }
    };
    Ok(extent.growth.iter().zip(samples).map(row).collect())
}
