//! The cost of the deferred pipeline: by the number of lights, beside three forward pipelines that draw the same
//! picture; with light volumes and with scissor rectangles (L 4.2.1); by the number of shadow maps; and with and
//! without a depth pre-pass.
//!
//!     cargo bench -p drawloom-benches --bench deferred
//!     cargo bench -p drawloom-benches --bench deferred -- --quick
//!     cargo bench -p drawloom-benches --bench deferred -- --backend noop --workers 1,4
//!
//! A block is one table on one backend: wgpu's `noop`, which measures the CPU alone, or the machine's adapter. The
//! settings of a block are interleaved, one frame each per round. The tables show medians. Without an adapter its
//! blocks are left out. Pipelines of this crate run on each number of workers. The forward pipelines:
//!
//! - *loop per pixel* is a process of this crate, whose shader loops over all lights that reach the view.
//! - *draw per light* is written in plain wgpu, on one thread: it draws all objects, and then adds each light to the
//!   objects that it reaches.
//! - *clustered* is too: it sorts lights into clusters of the view on the CPU, and a pixel loops over those of its
//!   cluster.
//!
//! Scissor rectangles take the place of light volumes in the deferred pipeline: a raw pass draws a triangle that covers
//! the picture for each light, within the rectangle of what the light reaches. With the depth test, the triangle is as
//! far away as that.
//!
//! `target/drawloom/deferred.json` has the same. The last line names the targets that were missed.

mod block;
mod contender;
mod drawloom_pipeline;
mod field;
mod lights;
mod loop_over_lights;
mod plain_forward;
mod pre_pass;
mod report;
mod scissors;
mod shadows;
mod volumes;

use std::error::Error;
use std::process::ExitCode;

use clap::Parser;
use drawloom_benches::arguments::{BackendArguments, WorkersArguments};
use drawloom_benches::backends::adapter_name;
use drawloom_benches::harness::progress_bar;

use report::Report;

/// Measures the deferred pipeline.
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
    /// The rounds on `noop`, where frames are short, and on the adapter.
    rounds: [usize; 2],
    /// Width and height of the pictures.
    picture: [u32; 2],
    boxes: usize,
    lights: &'static [usize],
    /// The numbers of lights of light volumes and scissors.
    volumes: &'static [usize],
    shadow_maps: &'static [usize],
}

impl Extent {
    const FULL: Self = Self {
        name: "full",
        rounds: [101, 21],
        picture: [640, 360],
        boxes: 1_000,
        lights: &[0, 1, 3, 10, 30, 100, 300, 1_000],
        volumes: &[10, 100, 1_000],
        shadow_maps: &[0, 1, 2, 4, 8, 16],
    };
    const QUICK: Self = Self {
        name: "quick",
        rounds: [3, 1],
        picture: [192, 108],
        boxes: 100,
        lights: &[0, 1, 30, 1_000],
        volumes: &[30, 1_000],
        shadow_maps: &[0, 1, 16],
    };
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: Arguments = drawloom_output::parse_arguments();
    let extent = if arguments.backend.is_quick() { Extent::QUICK } else { Extent::FULL };
    let (backends, workers) = (arguments.backend.backends()?, arguments.workers.counts());

    let progress = progress_bar("frames");
    let mut report = Report::new(&extent, adapter_name());
    for backend in backends {
        report.lights.extend(lights::measure(&extent, backend, &workers, &progress)?);
        report.volumes.extend(volumes::measure(&extent, backend, &progress)?);
        report.shadows.extend(shadows::measure(&extent, backend, &workers, &progress)?);
        report.depth_pre_pass.extend(pre_pass::measure(&extent, backend, &workers, &progress)?);
    }
    progress.finish_and_clear();
    report.print();
    let mut targets = lights::targets(&report.lights);
    volumes::add_targets(&report.volumes, &mut targets);
    targets.print("Targets and results, on one worker, beside what is written by hand");
    if !arguments.backend.is_quick() {
        report.write()?;
    }
    targets.print_missed();
    Ok(())
}
