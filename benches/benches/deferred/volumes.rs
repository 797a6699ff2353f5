//! Light volumes against scissor rectangles (L 4.2.1).

use std::error::Error;
use std::rc::Rc;

use drawloom::process::Deferred;
use drawloom_benches::backends::BackendName;
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use drawloom_output::print_line;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::Extent;
use crate::block::{Block, Setting};
use crate::field::{Field, Sight};
use crate::lights::check_same;
use crate::report::milliseconds;
use crate::scissors::{Rectangles, Rejection, ScissorPipeline, scissors};

/// A row of the table.
#[derive(Serialize)]
pub struct Row {
    backend: BackendName,
    sight: &'static str,
    /// Those that reach the view.
    lights: usize,
    technique: Technique,
    draws: usize,
    #[serde(rename = "processor_ms")]
    cpu_ms: f64,
    device_ms: Option<f64>,
}

/// How the pixels that a light reaches are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Technique {
    /// Drawloom's.
    Volumes,
    /// See [`Rejection::Rectangle`].
    Scissors,
    /// See [`Rejection::RectangleAndDepth`].
    ScissorsAndDepth,
}

impl Technique {
    const ALL: [Self; 3] = [Self::Volumes, Self::Scissors, Self::ScissorsAndDepth];

    fn name(self) -> &'static str {
        match self {
            Self::Volumes => "light volumes",
            Self::Scissors => "scissors",
            Self::ScissorsAndDepth => "scissors and depth",
        }
    }

    /// `None` for light volumes.
    fn rejection(self) -> Option<Rejection> {
        match self {
            Self::Volumes => None,
            Self::Scissors => Some(Rejection::Rectangle),
            Self::ScissorsAndDepth => Some(Rejection::RectangleAndDepth),
        }
    }
}

/// # Errors
/// Returns an error if a frame cannot be drawn, or if the techniques draw different pictures.
pub fn measure(extent: &Extent, backend: BackendName, progress: &ProgressBar) -> Result<Vec<Row>, Box<dyn Error>> {
    const WORKERS: usize = 1;
    let mut block = Block::new(backend, progress);
    let mut drawn = Vec::new();
    for sight in Sight::ALL {
        for &lights in extent.volumes {
            let scene = Rc::new(Field { lights, sight, ..Field::default() }.scene(extent)?);
            for technique in Technique::ALL {
                let scene = Rc::clone(&scene);
                match technique.rejection() {
                    None => block.add(scene, WORKERS, |builder| builder.pipeline(Deferred::to_picture()))?,
                    Some(rejection) => {
                        let rectangles = Rectangles::default();
                        let pipeline = block.pipeline(WORKERS, |builder| scissors(builder, &rectangles, rejection))?;
                        block.add_contender(scene, Box::new(ScissorPipeline::new(pipeline, rectangles)));
                    }
                }
                drawn.push((sight, technique));
            }
        }
    }
    let settings = block.measure(extent, "light volumes and scissors")?;
    if backend == BackendName::Adapter {
        for (settings, drawn) in settings.chunks(Technique::ALL.len()).zip(drawn.chunks(Technique::ALL.len())) {
            let pictures = settings.iter().zip(drawn).map(|(setting, (_, technique))| (technique.name(), setting));
            check_same(&format!("{} lights {}", settings[0].counts().lights, drawn[0].0.name()), pictures)?;
        }
    }
    let row = |(setting, (sight, technique)): (&Setting, (Sight, Technique))| Row {
        backend,
        sight: sight.name(),
        lights: setting.counts().lights,
        technique,
        draws: setting.counts().draws,
        cpu_ms: milliseconds(setting.cpu()),
        device_ms: (backend == BackendName::Adapter).then(|| milliseconds(setting.device())),
    };
    Ok(settings.iter().zip(drawn).map(row).collect())
}

/// The targets: light volumes take no longer than the faster kind of scissors (L 4.2.1).
pub fn add_targets(rows: &[Row], targets: &mut Targets) {
    // The processor's time is compared on noop: a driver in software takes some of it on the adapter.
    let time = |row: &Row| row.device_ms.unwrap_or(row.cpu_ms);
    for rows in rows.chunks(Technique::ALL.len()) {
        let [volumes, scissors @ ..] = rows else { continue };
        if let Some(peer) = scissors.iter().min_by(|one, other| time(one).total_cmp(&time(other))) {
            let what = volumes.backend.of(["CPU", "device"]);
            let figure = format!(
                "{what}, {} lights {}, light volumes ÷ {}",
                volumes.lights,
                volumes.sight,
                peer.technique.name()
            );
            targets.at_most(figure, 1.0, time(volumes) / time(peer));
        }
    }
}

pub fn print(rows: &[Row]) {
    print_line!("Light volumes, and rectangles in their place, on one worker. Lights: those that reach the view.\n");
    let mut table = Table::new(&["backend", "camera", "lights", "technique", "draws", "CPU ms", "device ms"]);
    for row in rows {
        table.row([
            row.backend.name().to_owned(),
            row.sight.to_owned(),
            row.lights.to_string(),
            row.technique.name().to_owned(),
            row.draws.to_string(),
            format!("{:.3}", row.cpu_ms),
            row.device_ms.map_or_else(String::new, |device| format!("{device:.2}")),
        ]);
    }
    table.print();
}
