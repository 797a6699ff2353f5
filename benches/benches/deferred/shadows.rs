//! Cost by the number of shadow maps. Each is a view.

use std::error::Error;
use std::rc::Rc;

use drawloom::process::Deferred;
use drawloom_benches::backends::BackendName;
use drawloom_benches::table::Table;
use drawloom_output::print_line;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::Extent;
use crate::block::Block;
use crate::field::Field;
use crate::report::milliseconds;

/// A row of the table.
#[derive(Serialize)]
pub struct Row {
    backend: BackendName,
    shadow_maps: usize,
    workers: usize,
    views: usize,
    /// Objects drawn in all views.
    commands: usize,
    #[serde(rename = "processor_ms")]
    cpu_ms: f64,
    device_ms: Option<f64>,
    /// Speed-up of the CPU time over the fewest workers.
    speed_up: f64,
}

/// # Errors
/// Returns an error if a frame cannot be drawn.
pub fn measure(
    extent: &Extent,
    backend: BackendName,
    workers: &[usize],
    progress: &ProgressBar,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let mut block = Block::new(backend, progress);
    for &shadow_maps in extent.shadow_maps {
        let scene = Rc::new(Field { shadow_maps, ..Field::default() }.scene(extent)?);
        for &workers in workers {
            block.add(Rc::clone(&scene), workers, |builder| builder.pipeline(Deferred::to_picture()))?;
        }
    }
    let settings = block.measure(extent, "shadows")?;
    let mut rows = Vec::new();
    for (settings, &shadow_maps) in settings.chunks(workers.len()).zip(extent.shadow_maps) {
        for (setting, &workers) in settings.iter().zip(workers) {
            rows.push(Row {
                backend,
                shadow_maps,
                workers,
                views: setting.counts().views,
                commands: setting.counts().commands,
                cpu_ms: milliseconds(setting.cpu()),
                device_ms: (backend == BackendName::Adapter).then(|| milliseconds(setting.device())),
                speed_up: settings[0].cpu().as_secs_f64() / setting.cpu().as_secs_f64(),
            });
        }
    }
    Ok(rows)
}

pub fn print(rows: &[Row]) {
    print_line!(
        "Spot lights that cast shadows over the same field. Objects: the number of drawn objects over all views. Speed-up: over the fewest workers.\n"
    );
    let mut table =
        Table::new(&["backend", "shadow maps", "workers", "views", "objects", "CPU ms", "device ms", "speed-up"]);
    for row in rows {
        table.row([
            row.backend.name().to_owned(),
            row.shadow_maps.to_string(),
            row.workers.to_string(),
            row.views.to_string(),
            row.commands.to_string(),
            format!("{:.3}", row.cpu_ms),
            row.device_ms.map_or_else(String::new, |device| format!("{device:.2}")),
            format!("{:.2}x", row.speed_up),
        ]);
    }
    table.print();
}
