//! Coarse occlusion in a city: what it finds, what it must not, and what it costs.
//!
//!     cargo bench -p drawloom-benches --bench occlusion
//!     cargo bench -p drawloom-benches --bench occlusion -- --quick
//!
//! A city of 20,000 boxes of all heights along streets, some turned, is seen from its streets, its roofs and from above. What is
//! truly hidden there is found by drawing every triangle in f64 with 4 × 4 samples a pixel: of the objects that would show in a
//! sample if nothing else were there, those that show in none. *False* are those left out that show in one. There must be none,
//! or the bench fails.
//!
//! *Naive* is what is usually done: occluders are drawn with one sample in the middle of each square, and objects are tested by a
//! rectangle of squares. Written to `drawloom/occlusion.json` in the target folder too.

mod city;
mod measured;
mod naive;

use std::error::Error;

use clap::Parser;
use drawloom::quality::Quality;
use drawloom_benches::quick::Quick;
use drawloom_benches::results;
use indicatif::{ProgressBar, ProgressStyle};

use measured::{Row, Sight};

fn main() -> Result<(), Box<dyn Error>> {
    let quick = Quick::parse().is_quick();
    let (boxes, picture, rounds) = if quick { (1_500, [240, 136], 3) } else { (20_000, [960, 540], 31) };
    let city = city::new(boxes, picture)?;
    let scene = city.as_scene_ref();
    let progress = ProgressBar::new((scene.cameras.len() * (1 + Quality::OCCLUSION_TILE_SIZES.len())) as u64);
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} pictures, {eta} left  {msg}")?);
    let mut rows = Vec::new();
    for camera in scene.cameras {
        progress.set_message(camera.name.clone());
        let sight = Sight::new(&scene, camera);
        progress.inc(1);
        for side in Quality::OCCLUSION_TILE_SIZES {
            rows.push(sight.measure(side, rounds));
            progress.inc(1);
        }
    }
    progress.finish_and_clear();
    let rows = [Row::totals(&rows), rows].concat();
    let note = if quick { "; a quick run, whose figures mean little" } else { "" };
    println!(
        "a city of {boxes} boxes, {} x {} pixels; times are medians of {rounds} rounds{note}\n",
        picture[0], picture[1]
    );
    measured::print(&rows);
    // A trial must not take the place of what was measured.
    if !quick {
        results::write_json("occlusion.json", &rows)?;
    }
    match rows.iter().map(|row| row.false_hidden).sum() {
        0_usize => Ok(()),
        count => Err(format!("{count} objects that show were left out").into()),
    }
}
