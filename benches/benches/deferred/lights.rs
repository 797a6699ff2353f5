//! By the number of lights: N + L, and N × L.

use std::error::Error;
use std::rc::Rc;

use drawloom::backend::Picture;
use drawloom::process::Deferred;
use drawloom_benches::backends::BackendName;
use drawloom_benches::table::Table;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::Extent;
use crate::field::Field;
use crate::forward::{a_loop_over_lights, a_pass_a_light};
use crate::report::milliseconds;
use crate::turns::{Setting, Turns};

/// A line of the table.
#[derive(Serialize)]
pub struct Line {
    backend: BackendName,
    pipeline: Pipeline,
    lights: usize,
    processes: usize,
    draws: usize,
    /// Objects drawn, over all processes.
    commands: usize,
    processor_ms: f64,
    device_ms: Option<f64>,
    /// Of the processor, for each light more than in the line above.
    ns_a_light: Option<f64>,
}

/// How lights are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Pipeline {
    /// Drawloom's.
    Deferred,
    /// See [`a_pass_a_light`].
    PassALight,
    /// See [`a_loop_over_lights`].
    LoopOverLights,
}

impl Pipeline {
    const ALL: [Self; 3] = [Self::Deferred, Self::PassALight, Self::LoopOverLights];

    fn name(self) -> &'static str {
        match self {
            Self::Deferred => "deferred",
            Self::PassALight => "a pass a light",
            Self::LoopOverLights => "a loop a pixel",
        }
    }
}

/// One worker, so that it is the sum of the work that is compared.
const WORKERS: usize = 1;

/// # Errors
/// If a frame cannot be drawn, not all that there is is seen, or pipelines draw different pictures.
pub fn measure(extent: &Extent, backend: BackendName, progress: &ProgressBar) -> Result<Vec<Line>, Box<dyn Error>> {
    let most_passes = backend.of(extent.most_passes);
    let mut turns = Turns::new(backend, progress);
    let mut drawn = Vec::new();
    for &lights in extent.lights {
        for pipeline in Pipeline::ALL {
            if pipeline == Pipeline::PassALight && lights > most_passes {
                continue;
            }
            let field = Field { lights, twice: pipeline == Pipeline::PassALight, ..Field::default() };
            let scene = Rc::new(field.scene(extent)?);
            turns.add(scene, WORKERS, |builder| match pipeline {
                Pipeline::Deferred => builder.deferred(Deferred::to_picture()),
                Pipeline::PassALight => a_pass_a_light(builder, lights),
                Pipeline::LoopOverLights => a_loop_over_lights(builder),
            })?;
            drawn.push((pipeline, field));
        }
    }
    let settings = turns.take(extent, "lights")?;

    let mut lines: Vec<Line> = Vec::new();
    for pipeline in Pipeline::ALL {
        for (setting, (_, field)) in settings.iter().zip(&drawn).filter(|(_, (own, _))| *own == pipeline) {
            check_sight(setting, *field, extent)?;
            let processor_ms = milliseconds(setting.processor());
            let above = lines.last().filter(|line| line.pipeline == pipeline);
            lines.push(Line {
                backend,
                pipeline,
                lights: field.lights,
                processes: setting.processes(),
                draws: setting.draws(),
                commands: setting.commands(),
                processor_ms,
                device_ms: (backend == BackendName::Adapter).then(|| milliseconds(setting.device())),
                ns_a_light: above
                    .map(|above| (processor_ms - above.processor_ms) * 1e6 / (field.lights - above.lights) as f64),
            });
        }
    }
    if backend == BackendName::Adapter {
        for &lights in extent.lights {
            let of_these = settings.iter().zip(&drawn).filter(|(_, (_, field))| field.lights == lights);
            check_pictures(lights, of_these.map(|(setting, (pipeline, _))| (*pipeline, setting)))?;
        }
    }
    Ok(lines)
}

/// All there is must be seen, or lines would not be of as many lights as they say.
fn check_sight(setting: &Setting, field: Field, extent: &Extent) -> Result<(), Box<dyn Error>> {
    let view = &setting.statistics().views[0];
    let (seen, there) = ([view.visible, view.lights], [field.objects(extent), field.lights]);
    if seen != there {
        return Err(format!("the camera sees {seen:?} objects and lights of {there:?}").into());
    }
    Ok(())
}

/// Who draws something else has other work to do, and proves nothing.
fn check_pictures<'a>(
    lights: usize,
    settings: impl Iterator<Item = (Pipeline, &'a Setting)>,
) -> Result<(), Box<dyn Error>> {
    let mut first: Option<Picture> = None;
    for (pipeline, setting) in settings {
        let picture = setting.picture()?;
        let Some(first) = &first else {
            first = Some(picture);
            continue;
        };
        let share = share_apart(first, &picture);
        if share > MOST_APART {
            let name = pipeline.name();
            return Err(
                format!("{lights} lights: {share:.4} of what {name:?} draws is not the deferred picture").into()
            );
        }
    }
    Ok(())
}

/// The share of bytes that are further apart than rounding puts them: the geometry buffer keeps a byte of each channel of the
/// diffuse colour, and half floats are added up in another order.
fn share_apart(one: &Picture, other: &Picture) -> f64 {
    const ROUNDING: u8 = 3;
    let apart = one.bytes.iter().zip(&other.bytes).filter(|(one, other)| one.abs_diff(**other) > ROUNDING);
    apart.count() as f64 / one.bytes.len() as f64
}

/// A few pixels on edges may go either way.
const MOST_APART: f64 = 2e-4;

pub fn print(lines: &[Line]) {
    println!(
        "Lights over a field of boxes, 1 worker. Draws: batches of objects, and one for each process that draws lights."
    );
    println!(
        "Objects: as often as they are drawn. ns a light: of CPU time, for each light more than in the line above.\n"
    );
    let mut table = Table::new(&[
        "backend",
        "pipeline",
        "lights",
        "processes",
        "draws",
        "objects",
        "CPU ms",
        "device ms",
        "ns a light",
    ]);
    for line in lines {
        table.line([
            line.backend.name().to_owned(),
            line.pipeline.name().to_owned(),
            line.lights.to_string(),
            line.processes.to_string(),
            line.draws.to_string(),
            line.commands.to_string(),
            format!("{:.3}", line.processor_ms),
            line.device_ms.map_or_else(String::new, |device| format!("{device:.2}")),
            line.ns_a_light.map_or_else(String::new, |share| format!("{share:.0}")),
        ]);
    }
    table.print();
}
