//! The cost of recording by technique: 4 cameras × 10,000 objects of 64 meshes and 16 materials, from visibility to
//! submit.
//!
//!     cargo bench -p drawloom-benches --bench record
//!     cargo bench -p drawloom-benches --bench record -- --quick
//!     cargo bench -p drawloom-benches --bench record -- --backend noop
//!     cargo bench -p drawloom-benches --bench record -- --workers 1,4
//!
//! In the scene *moving*, every object moves, and the engine says nothing about it. In *one percent moving*, *still*
//! and *still, cameras moving* it says what moved. Techniques that issue 64 instanced draws a camera have a table of
//! their own:
//!
//! - *by-mesh* instances by hand: threads cull cameras, count and scatter their objects by mesh, and record one draw a
//!   mesh. It is the best plain code there is here.
//! - *drawloom* is this crate by default, and *drawloom-…* are its recording strategies, each alone.
//!
//! Techniques that issue 10,000 single draws a camera have another:
//!
//! - *naive* is a plain engine: the same culling, and then all state for each object, in the order of the scene, on one
//!   thread, directly into the pass.
//! - *bundles* splits the objects of each camera into chunks, and threads cull them and record a bundle of each; all
//!   meshes are in one buffer and all objects in another, so no state is set between draws.
//! - *encoders* has an encoder per camera, into which a thread culls and records directly, in the same form.
//! - *drawloom-not-instanced* is this crate without instancing.
//!
//! What is written by hand runs on as many threads as this crate has workers, in three ways, and on one thread. The
//! fastest of these is what targets compare with, in each scene:
//!
//! - *rayon*: a pool of rayon's, which sleeps between frames, and splits work as it sees fit.
//! - *spinning*: threads that spin between frames, as this crate's workers do, and claim one piece of work after the
//!   other.
//! - *camera a thread*: such threads, each with its own cameras and its own share of the objects.
//!
//! All draw the same picture, which is checked first, upload what moved in every frame, and use wgpu alike. They are
//! interleaved; a sample is as many frames as fill some milliseconds. The table shows medians, and how often a frame
//! allocates memory, counted over the whole process in frames that are not timed. For Drawloom it also shows the
//! renderer's own allocations, counted on a backend that does nothing. Ratios are those of the medians that the tables
//! show.
//!
//! On noop a third table shows how frames of this crate grow with the number of objects and of cameras, and a fourth
//! one has draws of an engine's own: 10,000 items, each one indexed draw with a transform in a buffer of instances, of 16
//! pipelines and 256 bind groups. In *moving* and *at rest* each camera sees all of them, in *moving, cameras turning*
//! most of them, and other ones in each frame, and in *a tenth in view* a tenth of them, while the cameras turn slowly.
//!
//! - *plain loop* is one thread, which culls the items of each camera in draw order, eight at a time, and records them
//!   directly into an encoder, in every frame. It sets pipelines and bind groups where they change, and it knows when
//!   nothing moves, and copies nothing then.
//! - *encoders* is the same on spinning threads, with a camera each.
//! - *bundles* records a bundle of 256 draws after the other on a pool of rayon's, and *kept bundles* executes those
//!   again whose items are the same.
//! - *drawloom* has a process that draws items, and *without versions* it is not told that their commands are those of
//!   the frame before, so that it records all.
//!
//! A fifth one has 1,000 materials with three textures each, all in view, on one thread. The textures of a kind have one
//! size, or eight:
//!
//! - *a bind group a material* is by hand: objects in the order of materials and meshes, culled eight at a time; it sets
//!   a bind group where the material changes, and draws neighbours of one mesh together.
//! - *drawloom* has the textures in arrays, and materials in sets of arrays.
//!
//! The last line names the targets that were missed.
//!
//! `target/drawloom/record.json` and `.svg`, `record_extents.json`, `record_own_draws.json` and `record_textured.json`
//! have the same.

mod allocations;
mod bundles;
mod by_mesh;
mod draw_only;
mod encoders;
mod extents;
mod fixture;
mod geometry;
mod independent_threads;
mod measure;
mod naive;
mod noop_backend;
mod objects;
mod own_draws;
mod pictures;
mod renderer;
mod report;
mod spheres;
mod technique;
mod textured;
mod threads;

use std::error::Error;
use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;
use drawloom_benches::arguments::{BackendArguments, WorkersArguments};
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::progress_bar;

use allocations::Counting;
use report::Report;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Each sees every object.
pub const CAMERAS: usize = 4;

/// Compares recording techniques.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    backend: BackendArguments,
    #[command(flatten)]
    workers: WorkersArguments,
}

/// The size of the measurement. Of two values the first is for `noop`, where frames are short, the second for the
/// adapter.
pub struct Extent {
    name: &'static str,
    /// Warm-up frames of each technique: tables grow, pipelines are created, and tuners measure costs in them.
    warm_up: [usize; 2],
    rounds: [usize; 2],
    /// Least duration of a sample.
    sample: [Duration; 2],
    /// Objects that each camera sees.
    objects: usize,
}

impl Extent {
    const FULL: Self = Self {
        name: "full",
        warm_up: [60, 40],
        rounds: [41, 15],
        sample: [Duration::from_millis(4), Duration::ZERO],
        objects: 10_000,
    };
    const QUICK: Self =
        Self { name: "quick", warm_up: [1, 1], rounds: [1, 1], sample: [Duration::ZERO; 2], objects: 1_000 };
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: Arguments = drawloom_output::parse_arguments();
    let extent = if arguments.backend.is_quick() { Extent::QUICK } else { Extent::FULL };
    let progress = progress_bar("samples");
    let (backends, workers) = (arguments.backend.backends()?, arguments.workers.counts());
    let mut report = Report::new(&extent, &workers);
    for &backend in &backends {
        report.measured.push(measure::measure(&extent, backend, &workers, &progress)?);
    }
    if backends.contains(&BackendName::Noop) {
        report.extents = extents::measure(&extent, &workers, &progress)?;
        report.own_draws = own_draws::measure(&extent, &workers, &progress)?;
        report.textured = textured::measure(&extent, &progress)?;
    }
    progress.finish_and_clear();
    report.print();
    let targets = report.targets();
    targets.print("Targets and results on noop");
    if !arguments.backend.is_quick() {
        report.write()?;
    }
    targets.print_missed();
    Ok(())
}
