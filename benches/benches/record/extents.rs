//! How frames of this crate grow with the scene, and with the number of cameras, on `noop`.

use drawloom::scene::Scene;
use drawloom_benches::backends::BackendName;
use drawloom_benches::clouds::{around_one, row};
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::moving::{Motion, Moving};
use drawloom_benches::statistics::median;
use drawloom_benches::table::Table;
use drawloom_output::print_line;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::measure::sample;
use crate::renderer::Drawloom;
use crate::technique::{Contender, Failure, Runner};
use crate::{CAMERAS, Extent};

/// A scene of some extent, drawn by some workers.
#[derive(Serialize)]
pub struct ExtentRow {
    pub scene: &'static str,
    pub workers: usize,
    pub objects: usize,
    pub cameras: usize,
    pub microseconds_per_frame: f64,
}

/// A scene by name: what moves in it, the number of its objects as a share of the full one, and how it is made.
type SceneKind = (&'static str, Motion, usize, fn(usize) -> Result<Scene, Failure>);

pub const STILL: &str = "still, one camera";
pub const FEW_OF_FEW: &str = "64 cameras moving, each sees 50 of few objects";
pub const FEW_OF_MANY: &str = "64 cameras moving, each sees 50 of many objects";
pub const MOVING_FEW: &str = "moving, few";
pub const MOVING_MANY: &str = "moving, many";

const SCENES: [SceneKind; 5] = [
    (STILL, Motion::Nothing, 100_000, |objects| Ok(around_one(1, objects)?)),
    (FEW_OF_FEW, Motion::Cameras, 3_200, |objects| clouds_of_fifty(objects)),
    (FEW_OF_MANY, Motion::Cameras, 100_000, |objects| clouds_of_fifty(objects)),
    (MOVING_FEW, Motion::Everything, 10_000, |objects| Ok(around_one(CAMERAS, objects)?)),
    (MOVING_MANY, Motion::Everything, 1_000_000, |objects| Ok(around_one(CAMERAS, objects)?)),
];

fn clouds_of_fifty(objects: usize) -> Result<Scene, Failure> {
    let clouds = objects / 50;
    Ok(row(clouds, 50, clouds.min(64))?)
}

/// # Errors
/// Returns an error if a frame cannot be drawn.
pub fn measure(extent: &Extent, workers: &[usize], progress: &ProgressBar) -> Result<Vec<ExtentRow>, Failure> {
    let mut contenders = Vec::new();
    for (name, motion, objects, make) in SCENES {
        for &workers in workers {
            let runner = Runner::Drawloom(Box::new(Drawloom::new(BackendName::Noop.open()?, workers, true)?));
            let world = Moving::new(make(objects * extent.objects / Extent::FULL.objects)?, motion);
            contenders.push(Contender { name, workers, motion, runner, world });
        }
    }
    progress.set_message("extents");
    let rounds = Rounds { warm_up: extent.warm_up[0], measured: extent.rounds[0] };
    let times =
        Harness::new(rounds, progress).measure(&mut contenders, |contender, _| sample(contender, extent.sample[0]))?;
    let row = |(contender, times): (&Contender, Vec<f64>)| ExtentRow {
        scene: contender.name,
        workers: contender.workers,
        objects: contender.world.as_scene_ref().positions.len(),
        cameras: contender.world.as_scene_ref().cameras.len(),
        microseconds_per_frame: median(times) * 1e6,
    };
    Ok(contenders.iter().zip(times).map(row).collect())
}

pub fn print(rows: &[ExtentRow]) {
    let mut table = Table::new(&["scene", "objects", "cameras", "workers", "µs a frame"]);
    for row in rows {
        table.row([
            row.scene.to_owned(),
            row.objects.to_string(),
            row.cameras.to_string(),
            row.workers.to_string(),
            format!("{:.1}", row.microseconds_per_frame),
        ]);
    }
    table.print();
    print_line!();
}
