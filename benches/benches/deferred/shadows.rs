//! By the number of shadow maps, each of which is a view of its own.

use std::error::Error;
use std::rc::Rc;
use std::thread;

use drawloom::process::Deferred;
use drawloom_benches::backends::BackendName;
use drawloom_benches::table::Table;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::Extent;
use crate::field::Field;
use crate::report::milliseconds;
use crate::turns::Turns;

/// A line of the table.
#[derive(Serialize)]
pub struct Line {
    backend: BackendName,
    shadow_maps: usize,
    workers: usize,
    views: usize,
    /// Objects drawn, over all views.
    commands: usize,
    processor_ms: f64,
    device_ms: Option<f64>,
    /// Of the processor's part, against one worker.
    speed_up: f64,
}

/// # Errors
/// If a frame cannot be drawn.
pub fn measure(extent: &Extent, backend: BackendName, progress: &ProgressBar) -> Result<Vec<Line>, Box<dyn Error>> {
    let workers = [1, thread::available_parallelism()?.get().max(2)];
    let mut turns = Turns::new(backend, progress);
    for &shadow_maps in extent.shadow_maps {
        let scene = Rc::new(Field { shadow_maps, ..Field::default() }.scene(extent)?);
        for workers in workers {
            turns.add(Rc::clone(&scene), workers, |builder| builder.deferred(Deferred::to_picture()))?;
        }
    }
    let settings = turns.take(extent, "shadows")?;
    let mut lines = Vec::new();
    for (settings, &shadow_maps) in settings.chunks(workers.len()).zip(extent.shadow_maps) {
        for (setting, workers) in settings.iter().zip(workers) {
            lines.push(Line {
                backend,
                shadow_maps,
                workers,
                views: setting.statistics().views.len(),
                commands: setting.commands(),
                processor_ms: milliseconds(setting.processor()),
                device_ms: (backend == BackendName::Adapter).then(|| milliseconds(setting.device())),
                speed_up: settings[0].processor().as_secs_f64() / setting.processor().as_secs_f64(),
            });
        }
    }
    Ok(lines)
}

pub fn print(lines: &[Line]) {
    println!(
        "Spot lights that cast shadows over the same field. Objects: as often as they are drawn, over all views.\n"
    );
    let mut table =
        Table::new(&["backend", "shadow maps", "workers", "views", "objects", "CPU ms", "device ms", "speed-up"]);
    for line in lines {
        table.line([
            line.backend.name().to_owned(),
            line.shadow_maps.to_string(),
            line.workers.to_string(),
            line.views.to_string(),
            line.commands.to_string(),
            format!("{:.3}", line.processor_ms),
            line.device_ms.map_or_else(String::new, |device| format!("{device:.2}")),
            format!("{:.2}x", line.speed_up),
        ]);
    }
    table.print();
}
