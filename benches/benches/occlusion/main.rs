//! Coarse occlusion culling in a city: the number of culled objects, the number of falsely culled ones, and its cost.
//!
//!     cargo bench -p drawloom-benches --bench occlusion
//!     cargo bench -p drawloom-benches --bench occlusion -- --quick
//!
//! Cameras in the streets, above the roofs and high above see a city of 20,000 boxes of all heights, some of them
//! rotated. An oracle draws every triangle in f64 with 4 × 4 samples per pixel. An object is *hidden* if it would cover
//! a sample alone, and covers none in the scene. A culled object that covers a sample is *false*: the benchmark fails
//! if there is one.
//!
//! *Naive* is the usual method: occluders are drawn with one sample in the centre of each tile, and objects are tested
//! by a rectangle of tiles. `target/drawloom/occlusion.json` has the same.

mod measure;
mod naive;

use std::error::Error;

use drawloom::quality::Quality;
use drawloom_benches::arguments::ExtentArguments;
use drawloom_benches::city;
use drawloom_benches::harness::progress_bar;
use drawloom_benches::results;
use drawloom_output::print_line;
use std::process::ExitCode;

use measure::{CameraCase, Row};

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let quick = drawloom_output::parse_arguments::<ExtentArguments>().is_quick();
    let (boxes, picture, rounds) = if quick { (1_500, [240, 136], 3) } else { (20_000, [960, 540], 31) };
    let city = city::new(boxes, picture)?;
    let scene = city.as_scene_ref();
    let progress = progress_bar("pictures");
    progress.set_length((scene.cameras.len() * (1 + Quality::OCCLUSION_TILE_SIZES.len())) as u64);
    let mut rows = Vec::new();
    for camera in scene.cameras {
        progress.set_message(camera.name.clone());
        let case = CameraCase::new(&scene, camera);
        progress.inc(1);
        for side in Quality::OCCLUSION_TILE_SIZES {
            rows.push(case.measure(side, rounds));
            progress.inc(1);
        }
    }
    progress.finish_and_clear();
    let rows = [Row::totals(&rows), rows].concat();
    let note = if quick { "; a quick run with inaccurate figures" } else { "" };
    print_line!(
        "a city of {boxes} boxes, {} x {} pixels; times are medians of {rounds} rounds{note}\n",
        picture[0],
        picture[1]
    );
    measure::print(&rows);
    if !quick {
        results::write_json("occlusion.json", &rows)?;
    }
    match rows.iter().map(|row| row.false_hidden).sum() {
        0_usize => Ok(()),
        count => Err(format!("{count} visible objects were culled").into()),
    }
}
