//! The CPU time that an order costs.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{WgpuBackend, WgpuSubmission};
use drawloom::quality::Quality;
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use drawloom_benches::backends::BackendName;
use drawloom_benches::clouds::around_one;
use drawloom_benches::harness::Harness;
use drawloom_benches::moving::{Motion, Moving};
use drawloom_benches::statistics::median;
use drawloom_benches::stopwatch::{mean_frame, timed_frame};
use drawloom_benches::table::Table;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::fragment_counter::{COVERAGE, Surfaces};
use crate::{Extent, ORDERS};

/// Cameras around the cloud.
const CAMERAS: usize = 4;

/// Scenes and numbers of workers, each of which is a column.
const SETTINGS: [(Motion, usize); 4] = [
    (Motion::Everything, 1),
    (Motion::Everything, 2),
    (Motion::EverythingInTurningViews, 1),
    (Motion::EverythingInTurningViews, 2),
];

/// The time of an order in a scene.
#[derive(Serialize)]
pub struct Row {
    order: &'static str,
    scene: &'static str,
    workers: usize,
    ns_per_object_view: f64,
}

/// A renderer with an order, and its scene.
struct Contender {
    order: &'static str,
    motion: Motion,
    workers: usize,
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    world: Moving,
}

/// Measures all orders, interleaved. The rows of an order follow each other, one for each of the settings.
///
/// # Errors
/// Returns an error if a frame cannot be drawn.
pub fn measure(extent: &Extent, progress: &ProgressBar) -> Result<Vec<Row>, Box<dyn Error>> {
    progress.set_message("cost");
    let mut contenders = Vec::new();
    for (order, key) in ORDERS {
        for (motion, workers) in SETTINGS {
            let quality = Quality { opaque_order: key, ..Quality::default() };
            let builder = Renderer::builder(BackendName::Noop.open()?).process(Surfaces::default()).output(COVERAGE);
            let (renderer, submitter) = builder.quality(quality).build(Arc::new(Scheduler::new(workers)?))?;
            let world = Moving::new(around_one(CAMERAS, extent.timed)?, motion);
            contenders.push(Contender { order, motion, workers, renderer, submitter, world });
        }
    }
    let times = Harness::new(extent.rounds, progress).measure(&mut contenders, |contender, round| {
        let at_least = if round.is_warm_up() { Duration::ZERO } else { extent.sample };
        let Contender { renderer, submitter, world, .. } = contender;
        mean_frame(at_least, || {
            world.step();
            let (_, time) = timed_frame(renderer, submitter, world.as_scene_ref(), WgpuSubmission::wait)?;
            Ok::<_, Box<dyn Error>>(time.cpu)
        })
    })?;
    let rows = contenders.iter().zip(times).map(|(contender, times)| Row {
        order: contender.order,
        scene: contender.motion.name(),
        workers: contender.workers,
        ns_per_object_view: median(times) * 1e9 / (CAMERAS * extent.timed) as f64,
    });
    Ok(rows.collect())
}

/// Prints a line for each order, and a column for each of the settings.
pub fn print(rows: &[Row]) {
    let heading = |(motion, workers): (Motion, usize)| {
        let plural = if workers == 1 { "" } else { "s" };
        format!("{}, {workers} worker{plural}, ns", motion.name())
    };
    let headings = SETTINGS.map(heading);
    let [first, second, third, fourth] = &headings;
    let mut table = Table::new(&["opaque order", first, second, third, fourth]);
    for of_order in rows.chunks_exact(SETTINGS.len()) {
        let figure = |setting: usize| format!("{:.1}", of_order[setting].ns_per_object_view);
        table.row([of_order[0].order.to_owned(), figure(0), figure(1), figure(2), figure(3)]);
    }
    table.print();
}
