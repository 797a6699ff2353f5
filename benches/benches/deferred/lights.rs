//! Cost by the number of lights, beside other ways to light the same picture.

use std::error::Error;
use std::rc::Rc;

use drawloom::backend::Picture;
use drawloom::process::Deferred;
use drawloom_benches::backends::BackendName;
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use drawloom_output::print_line;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::Extent;
use crate::block::{Block, Setting};
use crate::field::Field;
use crate::loop_over_lights::loop_over_lights;
use crate::plain_forward::{Clusters, DrawPerLight, PlainForward};
use crate::report::milliseconds;

/// A row of the table.
#[derive(Serialize)]
pub struct Row {
    backend: BackendName,
    pipeline: Pipeline,
    workers: usize,
    lights: usize,
    processes: usize,
    draws: usize,
    /// Objects drawn by all processes.
    commands: usize,
    #[serde(rename = "processor_ms")]
    cpu_ms: f64,
    device_ms: Option<f64>,
    /// Additional CPU time per additional light, against the row above, of the same pipeline and number of workers.
    #[serde(rename = "ns_a_light")]
    ns_per_light: Option<f64>,
}

/// A pipeline that draws lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Pipeline {
    /// Drawloom's pipeline.
    Deferred,
    /// See [`DrawPerLight`].
    DrawPerLight,
    /// See [`loop_over_lights`].
    LoopOverLights,
    /// See [`Clusters`].
    Clustered,
}

impl Pipeline {
    fn name(self) -> &'static str {
        match self {
            Self::Deferred => "deferred",
            Self::DrawPerLight => "draw per light",
            Self::LoopOverLights => "loop per pixel",
            Self::Clustered => "clustered",
        }
    }
}

/// # Errors
/// Returns an error if a frame cannot be drawn, an object or light is not visible, or pipelines draw different
/// pictures.
pub fn measure(
    extent: &Extent,
    backend: BackendName,
    workers: &[usize],
    progress: &ProgressBar,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let mut block = Block::new(backend, progress);
    let of_this_crate = [Pipeline::Deferred, Pipeline::LoopOverLights];
    let parallel =
        of_this_crate.into_iter().flat_map(|pipeline| workers.iter().map(move |&workers| (pipeline, workers)));
    let pipelines: Vec<_> = parallel.chain([(Pipeline::DrawPerLight, 1), (Pipeline::Clustered, 1)]).collect();
    let mut drawn = Vec::new();
    for &lights in extent.lights {
        let field = Field { lights, ..Field::default() };
        let scene = Rc::new(field.scene(extent)?);
        for &(pipeline, workers) in &pipelines {
            let scene = Rc::clone(&scene);
            match pipeline {
                Pipeline::Deferred => block.add(scene, workers, |builder| builder.pipeline(Deferred::to_picture()))?,
                Pipeline::LoopOverLights => block.add(scene, workers, loop_over_lights)?,
                Pipeline::DrawPerLight => {
                    let contender = PlainForward::new(&backend.open()?, &scene.as_scene_ref(), DrawPerLight::new)?;
                    block.add_contender(scene, Box::new(contender));
                }
                Pipeline::Clustered => {
                    let contender = PlainForward::new(&backend.open()?, &scene.as_scene_ref(), Clusters::new)?;
                    block.add_contender(scene, Box::new(contender));
                }
            }
            drawn.push(((pipeline, workers), field));
        }
    }
    let settings = block.measure(extent, "lights")?;

    let mut rows: Vec<Row> = Vec::new();
    for &(pipeline, workers) in &pipelines {
        for (setting, (_, field)) in settings.iter().zip(&drawn).filter(|(_, (own, _))| *own == (pipeline, workers)) {
            check_visible(setting, *field, extent)?;
            let cpu_ms = milliseconds(setting.cpu());
            let above = rows.last().filter(|row| (row.pipeline, row.workers) == (pipeline, workers));
            rows.push(Row {
                backend,
                pipeline,
                workers,
                lights: field.lights,
                processes: setting.counts().processes,
                draws: setting.counts().draws,
                commands: setting.counts().commands,
                cpu_ms,
                device_ms: (backend == BackendName::Adapter).then(|| milliseconds(setting.device())),
                ns_per_light: above.map(|above| (cpu_ms - above.cpu_ms) * 1e6 / (field.lights - above.lights) as f64),
            });
        }
    }
    if backend == BackendName::Adapter {
        for &lights in extent.lights {
            let of_these = settings.iter().zip(&drawn).filter(|(_, (_, field))| field.lights == lights);
            let pictures = of_these.map(|(setting, ((pipeline, _), _))| (pipeline.name(), setting));
            check_same(&format!("{lights} lights"), pictures)?;
        }
    }
    Ok(rows)
}

/// All objects and lights must be visible, so that a row measures the stated number of lights.
fn check_visible(setting: &Setting, field: Field, extent: &Extent) -> Result<(), Box<dyn Error>> {
    let counts = setting.counts();
    let (visible, expected) = ([counts.visible, counts.lights], [field.objects(extent), field.lights]);
    if visible != expected {
        return Err(format!("the camera sees {visible:?} objects and lights instead of {expected:?}").into());
    }
    Ok(())
}

/// All of these must draw the same picture, so that their work is comparable.
///
/// # Errors
/// Returns an error that names the first one whose picture differs from that of the first of all.
pub fn check_same<'a>(
    what: &str,
    settings: impl Iterator<Item = (&'static str, &'a Setting)>,
) -> Result<(), Box<dyn Error>> {
    let mut first: Option<(&str, Picture)> = None;
    for (name, setting) in settings {
        let picture = setting.picture()?;
        let Some((first_name, first)) = &first else {
            first = Some((name, picture));
            continue;
        };
        let share = share_that_differs(first, &picture);
        if share > MAX_DIFFERENT {
            return Err(format!("{what}: {share:.4} of the picture of {name:?} differs from {first_name:?}").into());
        }
    }
    Ok(())
}

/// The share of bytes that differ by more than rounding: the geometry buffer stores a byte per channel of the diffuse
/// colour, and half floats are added in another order.
fn share_that_differs(one: &Picture, other: &Picture) -> f64 {
    const ROUNDING: u8 = 3;
    let differing = one.bytes.iter().zip(&other.bytes).filter(|(one, other)| one.abs_diff(**other) > ROUNDING);
    differing.count() as f64 / one.bytes.len() as f64
}

/// A few pixels on edges may differ.
const MAX_DIFFERENT: f64 = 2e-4;

/// The targets: with one worker, the deferred pipeline takes no longer than the faster of the renderers written by
/// hand.
pub fn targets(rows: &[Row]) -> Targets {
    let mut targets = Targets::new();
    for row in rows.iter().filter(|row| (row.pipeline, row.workers) == (Pipeline::Deferred, 1)) {
        let is_peer = |other: &&Row| {
            (other.backend, other.lights) == (row.backend, row.lights)
                && matches!(other.pipeline, Pipeline::DrawPerLight | Pipeline::Clustered)
        };
        // The processor's time is compared on noop: a driver in software takes some of it on the adapter.
        let time = |row: &Row| row.device_ms.unwrap_or(row.cpu_ms);
        let fastest = rows.iter().filter(is_peer).min_by(|one, other| time(one).total_cmp(&time(other)));
        if let Some(peer) = fastest {
            let what = row.backend.of(["CPU", "device"]);
            let figure = format!("{what}, lights: {}, deferred ÷ {}", row.lights, peer.pipeline.name());
            targets.at_most(figure, 1.0, time(row) / time(peer));
        }
    }
    targets
}

pub fn print(rows: &[Row]) {
    print_line!("Lights over a field of boxes. Draws: batches of objects, and one for each process that draws lights.");
    print_line!(
        "Objects: the number of drawn objects. ns per light: additional CPU time per additional light, against the row above.\n"
    );
    let mut table = Table::new(&[
        "backend",
        "pipeline",
        "workers",
        "lights",
        "processes",
        "draws",
        "objects",
        "CPU ms",
        "device ms",
        "ns per light",
    ]);
    for row in rows {
        table.row([
            row.backend.name().to_owned(),
            row.pipeline.name().to_owned(),
            row.workers.to_string(),
            row.lights.to_string(),
            row.processes.to_string(),
            row.draws.to_string(),
            row.commands.to_string(),
            format!("{:.3}", row.cpu_ms),
            row.device_ms.map_or_else(String::new, |device| format!("{device:.2}")),
            row.ns_per_light.map_or_else(String::new, |share| format!("{share:.0}")),
        ]);
    }
    table.print();
}
