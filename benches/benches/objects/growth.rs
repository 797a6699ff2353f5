//! What an object costs where there are many.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use drawloom::task::Scheduler;
use drawloom_benches::backends::BackendName;
use drawloom_benches::stopwatch::middle;
use drawloom_testing::random::Random;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::scenario::WORKERS;
use crate::turns::Painter;
use crate::{Extent, world};

/// A number of objects.
#[derive(Serialize)]
pub struct Row {
    pub objects: usize,
    pub backend: BackendName,
    pub ns_per_object_view: f64,
}

/// Lets all numbers of objects take turns.
///
/// # Errors
/// If a frame cannot be drawn.
pub fn measure(extent: &Extent, backend: BackendName, progress: &ProgressBar) -> Result<Vec<Row>, Box<dyn Error>> {
    let (warm_up, rounds) = (backend.of(extent.growth_warm_up), backend.of(extent.growth_rounds));
    progress.set_message(format!("growth, {}", backend.name()));
    progress.inc_length(((warm_up + rounds) * extent.growth.len()) as u64);
    let scheduler = Arc::new(Scheduler::new(WORKERS)?);
    let open = |&objects: &usize| {
        let painter = Painter::new(backend.open()?, &scheduler, false)?;
        Ok::<_, Box<dyn Error>>((objects, world::new(objects)?, painter, Vec::new()))
    };
    let mut sizes = extent.growth.iter().map(open).collect::<Result<Vec<_>, _>>()?;
    let mut random = Random::new();
    for round in 0..warm_up + rounds {
        for index in random.order(sizes.len()) {
            let (_, world, painter, frames) = &mut sizes[index];
            let turn = painter.turn(world, Duration::ZERO)?;
            if round >= warm_up {
                frames.push(turn.frame);
            }
            progress.inc(1);
        }
    }
    let row = |(objects, _, _, frames): (usize, _, _, Vec<f64>)| {
        let object_views = (objects * world::VIEWS) as f64;
        Row { objects, backend, ns_per_object_view: middle(frames) * 1e9 / object_views }
    };
    Ok(sizes.into_iter().map(row).collect())
}
