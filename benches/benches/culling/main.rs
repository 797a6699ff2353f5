//! What it costs to find out what a camera sees, and that nothing of it is ever left out.
//!
//!     cargo bench -p drawloom-benches --no-default-features --bench culling
//!     cargo bench -p drawloom-benches --no-default-features --bench culling -- --quick
//!
//! First the time: what each volume takes an object, beside spheres asked for one by one, and beside how it is commonly done.
//! They take turns, in an order drawn anew each round.
//!
//! Then the proof: cameras at all extremes (`culling/cameras.rs`), a new one every 256 objects, and f64 as the judge
//! (`culling/oracle.rs`). Three in four spheres, and as many objects, touch a plane, an edge or a corner of what the camera sees to
//! within four steps of f32 (*tangent*); the others are *anywhere*. Spheres are asked for as they are; objects go all the way
//! from the scene through the table of objects, with scales from 0 to 1e20. A false cull ends the run with an error, and so do
//! too many objects kept that are outside.
//!
//! Written to `drawloom/culling.json` in the target folder too.

mod report;
mod speed;

use std::error::Error;
use std::sync::{Mutex, PoisonError};

use clap::Parser;
use drawloom::task::Scheduler;
use drawloom_benches::quick::Quick;
use drawloom_testing::culling::boxes::{BoxTallies, Shapes};
use drawloom_testing::culling::spheres::SphereTallies;
use drawloom_testing::culling::{boxes, spheres};
use indicatif::{ProgressBar, ProgressStyle};

use report::Report;

/// How much is measured and tried.
struct Extent {
    name: &'static str,
    objects: usize,
    rounds: usize,
    /// Of 256 each.
    sphere_batches: usize,
    box_batches: usize,
}

impl Extent {
    const FULL: Self =
        Self { name: "full", objects: 100_000, rounds: 301, sphere_batches: 400_000, box_batches: 40_000 };
    const QUICK: Self = Self { name: "quick", objects: 10_000, rounds: 5, sphere_batches: 400, box_batches: 100 };
}

/// Batches that a job tries.
const AT_A_TIME: usize = 50;

fn main() -> Result<(), Box<dyn Error>> {
    let quick = Quick::parse().is_quick();
    let extent = if quick { Extent::QUICK } else { Extent::FULL };
    let progress = ProgressBar::new(2 * extent.rounds as u64);
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} {msg}, {eta} left")?);
    progress.set_message("rounds");
    let speeds = speed::measure(extent.objects, extent.rounds, &progress)?;

    progress.reset();
    progress.set_length((extent.sphere_batches + extent.box_batches) as u64);
    progress.set_message("cameras");
    let scheduler = Scheduler::new(std::thread::available_parallelism()?.get())?;
    let spheres = Mutex::new(SphereTallies::default());
    scheduler.parallel_for(extent.sphere_batches, AT_A_TIME, |batches, _| {
        progress.inc(batches.len() as u64);
        let found = spheres::try_batches(batches);
        spheres.lock().unwrap_or_else(PoisonError::into_inner).add(&found);
    })?;
    let shapes = Shapes::new()?;
    let boxes = Mutex::new(BoxTallies::default());
    scheduler.parallel_for(extent.box_batches, AT_A_TIME, |batches, _| {
        progress.inc(batches.len() as u64);
        let found = boxes::try_batches(&shapes, batches);
        boxes.lock().unwrap_or_else(PoisonError::into_inner).add(&found);
    })?;
    progress.finish_and_clear();

    let spheres = spheres.into_inner().unwrap_or_else(PoisonError::into_inner);
    let boxes = boxes.into_inner().unwrap_or_else(PoisonError::into_inner);
    let report = Report::new(extent.name, speeds, &spheres, &boxes);
    report.print();
    // A trial must not take the place of what was measured.
    if !quick {
        report.write()?;
    }
    report.problem().map_or(Ok(()), |problem| Err(problem.into()))
}
