//! The cost of frustum culling, and a check that it never culls a visible object.
//!
//!     cargo bench -p drawloom-benches --no-default-features --bench culling
//!     cargo bench -p drawloom-benches --no-default-features --bench culling -- --quick
//!
//! First the time per object: all volumes, spheres tested one by one, and the usual planes in f32, in a plain loop and
//! written for SIMD, interleaved. All write a bit for each object.
//!
//! Then the check: cameras at all extremes (`drawloom_testing::culling::cameras`), a new one every 256 objects, against
//! an f64 oracle (`drawloom_testing::culling::oracle`). Three in four spheres, and as many objects, touch a plane, an
//! edge or a corner of the frustum to within four steps of f32 (*tangent*); the others are *anywhere*. Spheres are
//! tested directly; objects pass from the scene through the object table, with scales from 0 to 1e20. A false cull
//! fails the run, and so do too many kept objects that are outside.
//!
//! `target/drawloom/culling.json` has the same.

mod report;
mod speed;

use std::error::Error;
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

use drawloom::task::Scheduler;
use drawloom_benches::arguments::ExtentArguments;
use drawloom_benches::harness::progress_bar;
use drawloom_testing::culling::boxes::{BoxTallies, Shapes};
use drawloom_testing::culling::spheres::SphereTallies;
use drawloom_testing::culling::{boxes, spheres};

use report::Report;

/// The size of the measurement and the check.
struct Extent {
    name: &'static str,
    /// A table of the first fits into a core's own cache.
    objects: &'static [usize],
    rounds: usize,
    /// Batches of 256.
    sphere_batches: usize,
    box_batches: usize,
}

impl Extent {
    const FULL: Self =
        Self { name: "full", objects: &[10_000, 100_000], rounds: 301, sphere_batches: 400_000, box_batches: 40_000 };
    const QUICK: Self = Self { name: "quick", objects: &[10_000], rounds: 5, sphere_batches: 400, box_batches: 100 };
}

/// Batches per job.
const BATCHES_PER_JOB: usize = 50;

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let quick = drawloom_output::parse_arguments::<ExtentArguments>().is_quick();
    let extent = if quick { Extent::QUICK } else { Extent::FULL };
    let progress = progress_bar("runs");
    let mut speeds = Vec::new();
    for &objects in extent.objects {
        speeds.extend(speed::measure(objects, extent.rounds, &progress)?);
    }

    progress.reset();
    progress.set_length((extent.sphere_batches + extent.box_batches) as u64);
    progress.set_prefix("cameras");
    let scheduler = Scheduler::new(std::thread::available_parallelism()?.get())?;
    let spheres = Mutex::new(SphereTallies::default());
    scheduler.parallel_for(extent.sphere_batches, BATCHES_PER_JOB, |batches, _| {
        progress.inc(batches.len() as u64);
        let found = spheres::try_batches(batches);
        spheres.lock().unwrap_or_else(PoisonError::into_inner).add(&found);
    })?;
    let shapes = Shapes::new()?;
    let boxes = Mutex::new(BoxTallies::default());
    scheduler.parallel_for(extent.box_batches, BATCHES_PER_JOB, |batches, _| {
        progress.inc(batches.len() as u64);
        let found = boxes::try_batches(&shapes, batches);
        boxes.lock().unwrap_or_else(PoisonError::into_inner).add(&found);
    })?;
    progress.finish_and_clear();

    let spheres = spheres.into_inner().unwrap_or_else(PoisonError::into_inner);
    let boxes = boxes.into_inner().unwrap_or_else(PoisonError::into_inner);
    let report = Report::new(extent.name, speeds, &spheres, &boxes);
    report.print();
    if !quick {
        report.write()?;
    }
    report.problem().map_or(Ok(()), |problem| Err(problem.into()))
}
