//! The cost of the deferred pipeline: by the number of lights, beside three forward pipelines that draw the same picture; by the
//! number of shadow maps; and with and without a depth pre-pass.
//!
//!     cargo bench -p drawloom-benches --bench deferred
//!     cargo bench -p drawloom-benches --bench deferred -- --quick
//!
//! A block is one table on one backend: wgpu's `noop`, which measures the CPU alone, or the machine's adapter. The settings of a block
//! are interleaved, one frame each per round. The tables show medians. Without an adapter its blocks are left out.
//! The forward pipelines:
//!
//! - *loop per pixel* is a process of this crate, whose shader loops over all lights that reach the view.
//! - *draw per light* is written in plain wgpu: it draws all objects, and then adds each light to the objects that it reaches.
//! - *clustered* is too: it sorts lights into clusters of the view on the CPU, and a pixel loops over those of its cluster.
//!
//! `target/drawloom/deferred.json` has the same.

mod block;
mod contender;
mod drawloom_pipeline;
mod field;
mod lights;
mod loop_over_lights;
mod plain_forward;
mod pre_pass;
mod report;
mod shadows;

use std::error::Error;

use clap::Parser;
use drawloom_benches::backends;
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::progress_bar;
use drawloom_output::print_diagnostic;
use std::process::ExitCode;

use report::Report;

/// Measures the deferred pipeline.
#[derive(Parser)]
struct Arguments {
    /// Runs few rounds, for a first impression.
    #[arg(long)]
    quick: bool,
    /// Cargo passes it under `cargo bench`; without it, as under `cargo test --benches`, each setting is only tried.
    #[arg(long, hide = true)]
    bench: bool,
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
    shadow_maps: &'static [usize],
}

impl Extent {
    const FULL: Self = Self {
        name: "full",
        rounds: [101, 21],
        picture: [640, 360],
        boxes: 1_000,
        lights: &[0, 1, 3, 10, 30, 100, 300, 1_000],
        shadow_maps: &[0, 1, 2, 4, 8, 16],
    };
    const QUICK: Self = Self {
        name: "quick",
        rounds: [3, 1],
        picture: [192, 108],
        boxes: 100,
        lights: &[0, 1, 30, 1_000],
        shadow_maps: &[0, 1, 16],
    };
    const TRIAL: Self =
        Self { name: "trial", rounds: [1, 1], picture: [64, 36], boxes: 50, lights: &[0, 1, 4], shadow_maps: &[0, 2] };

    fn new(arguments: &Arguments) -> Self {
        match (arguments.bench, arguments.quick) {
            (false, _) => Self::TRIAL,
            (true, true) => Self::QUICK,
            (true, false) => Self::FULL,
        }
    }
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: Arguments = drawloom_output::parse_arguments();
    let extent = Extent::new(&arguments);
    let adapter = backends::adapter_name();
    if adapter.is_none() {
        print_diagnostic!("no graphics adapter found: device times are left out");
    }

    let progress = progress_bar("frames");
    let mut report = Report::new(&extent, adapter);
    for &backend in BackendName::available() {
        report.lights.extend(lights::measure(&extent, backend, &progress)?);
        report.shadows.extend(shadows::measure(&extent, backend, &progress)?);
        report.depth_pre_pass.extend(pre_pass::measure(&extent, backend, &progress)?);
    }
    progress.finish_and_clear();
    report.print();
    if arguments.bench && !arguments.quick {
        report.write()?;
    }
    Ok(())
}
