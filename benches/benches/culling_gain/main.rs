//! What culling behind objects and culling triangles save, and what they cost: S 9.6 against what the device offers.
//!
//!     cargo bench -p drawloom-benches --bench culling_gain
//!     cargo bench -p drawloom-benches --bench culling_gain -- --quick
//!     cargo bench -p drawloom-benches --bench culling_gain -- --backend noop --workers 1,2
//!
//! One process draws all objects in one colour. The scene stands still and the camera moves, so each frame culls anew.
//! Renderers are interleaved, one frame each in a round; times are medians. *CPU* is from the hand-over of the scene to
//! the return of submit, *device* from the call of submit until the frame is drawn.
//!
//! **Occlusion**: a city of boxes, in whose streets there are boxes, or balls of many triangles, seen from a street,
//! where most objects are hidden, and from above the roofs. Three renderers are written by hand in plain wgpu, on one
//! thread, and differ in their culling alone:
//!
//! - *none* draws all objects in the frustum;
//! - *coarse depth* draws those that this crate's coarse depth buffer leaves, which is called directly;
//! - *queries* draws those that are not known to be hidden, and asks the device whether bounding boxes are:
//!   `queries.rs`. On noop, whose queries find nothing, a depth buffer whose tiles are pixels answers outside of the
//!   measured time.
//!
//! Those of this crate decide by the CPU time that they measure whether a frame tests for occlusion: *tested in* is the
//! share of frames that do. A reference in f64 tells which objects cover a pixel. *Left* are the hidden objects that
//! are drawn, and *missing* the visible ones that are not drawn, because a result is late. The benchmark fails if one
//! is missing although the camera stands still.
//!
//! **Triangles**: spheres with triangle culling on and off, and with levels of detail.
//!
//! `target/drawloom/culling_gain.json` has the same. The last line names the targets that were missed.

mod by_hand;
mod coarse_depth;
mod device;
mod drawloom_renderer;
mod occlusion;
mod queries;
mod triangles;
mod walk;

use std::error::Error;
use std::process::ExitCode;

use clap::Parser;
use drawloom_benches::arguments::{BackendArguments, WorkersArguments};
use drawloom_benches::backends::adapter_name;
use drawloom_benches::harness::progress_bar;
use drawloom_benches::results;
use drawloom_benches::targets::Targets;
use drawloom_output::print_line;
use serde::Serialize;

/// Measures occlusion culling and triangle culling.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    backend: BackendArguments,
    #[command(flatten)]
    workers: WorkersArguments,
}

/// The size of the measurement.
pub struct Extent {
    name: &'static str,
    picture: [u32; 2],
    /// Rounds in which tests are tried, and queries find out what is hidden.
    warm_up: usize,
    /// The rounds on `noop`, where frames are short, and on the adapter.
    rounds: [usize; 2],
    /// Frames after the measured ones, in which objects are counted.
    counted: u32,
    boxes: usize,
    /// The rings of balls in streets, and of the largest sphere.
    street_rings: u32,
    rings: u32,
}

impl Extent {
    const FULL: Self = Self {
        name: "full",
        picture: [640, 360],
        warm_up: 40,
        rounds: [101, 31],
        counted: 24,
        boxes: 20_000,
        street_rings: 16,
        rings: 192,
    };
    const QUICK: Self = Self {
        name: "quick",
        picture: [160, 90],
        warm_up: 12,
        rounds: [3, 2],
        counted: 6,
        boxes: 1_500,
        street_rings: 8,
        rings: 64,
    };
}

#[derive(Serialize)]
struct Report {
    extent: &'static str,
    adapter: Option<String>,
    occlusion: Vec<occlusion::Row>,
    triangles: Vec<triangles::Row>,
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: Arguments = drawloom_output::parse_arguments();
    let extent = if arguments.backend.is_quick() { Extent::QUICK } else { Extent::FULL };
    let (backends, workers) = (arguments.backend.backends()?, arguments.workers.counts());
    let progress = progress_bar("frames");
    let (mut occlusion, mut triangles) = (Vec::new(), Vec::new());
    for backend in backends {
        occlusion.extend(occlusion::measure(&extent, backend, &workers, &progress)?);
        triangles.extend(triangles::measure(&extent, backend, &workers, &progress)?);
    }
    progress.finish_and_clear();
    let report = Report { extent: extent.name, adapter: adapter_name(), occlusion, triangles };
    let note = if arguments.backend.is_quick() { "; a quick run with inaccurate figures" } else { "" };
    let adapter = report.adapter.as_deref().unwrap_or("none");
    print_line!(
        "{} boxes, {} x {} pixels, adapter: {adapter}{note}\n",
        extent.boxes,
        extent.picture[0],
        extent.picture[1]
    );
    occlusion::print(&report.occlusion);
    triangles::print(&report.triangles);
    let mut targets = Targets::new();
    occlusion::add_targets(&report.occlusion, &mut targets);
    triangles::add_targets(&report.triangles, &mut targets);
    targets.print("Targets and results");
    if !arguments.backend.is_quick() {
        results::write_json("culling_gain.json", &report)?;
    }
    targets.print_missed();
    Ok(())
}
