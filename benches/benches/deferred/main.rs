//! What the deferred pipeline costs: by the number of lights, beside two pipelines that draw the same picture forward; by
//! the number of shadow maps; and with a depth pre-pass and without.
//!
//!     cargo bench -p drawloom-benches --bench deferred
//!     cargo bench -p drawloom-benches --bench deferred -- --quick
//!
//! All settings of a block take turns, a frame each and in an order drawn anew each round, so that whatever else the
//! machine does meets them alike. What is shown is the median. A block is one table on one backend: wgpu's `noop`,
//! which is the processor alone, or the machine's adapter. Where there is no adapter its blocks are left out. What was
//! measured is written to `drawloom/deferred.json` in the target folder too.

mod field;
mod forward;
mod lights;
mod pre_pass;
mod report;
mod shadows;
mod turns;

use std::error::Error;

use clap::Parser;
use drawloom_benches::backends;
use drawloom_benches::backends::BackendName;
use indicatif::{ProgressBar, ProgressStyle};

use report::Report;

/// Compares the deferred pipeline with others, and with itself.
#[derive(Parser)]
struct Arguments {
    /// Few rounds, to see where things stand.
    #[arg(long)]
    quick: bool,
    /// Given by `cargo bench`; without it, as under `cargo test --benches`, the run is a trial of each setting.
    #[arg(long, hide = true)]
    bench: bool,
}

/// How much is measured.
pub struct Extent {
    name: &'static str,
    /// On `noop`, where frames are short, and on the adapter.
    rounds: [usize; 2],
    /// Width and height of the pictures.
    picture: [u32; 2],
    boxes: usize,
    lights: &'static [usize],
    /// With how many lights at most everything is drawn once for each; likewise.
    most_passes: [usize; 2],
    shadow_maps: &'static [usize],
}

impl Extent {
    const FULL: Self = Self {
        name: "full",
        rounds: [101, 21],
        picture: [640, 360],
        boxes: 1_000,
        lights: &[0, 1, 3, 10, 30, 100, 300, 1_000],
        most_passes: [300, 100],
        shadow_maps: &[0, 1, 2, 4, 8, 16],
    };
    const QUICK: Self = Self { name: "quick", rounds: [15, 5], most_passes: [100, 30], ..Self::FULL };
    const TRIAL: Self = Self {
        name: "trial",
        rounds: [1, 1],
        picture: [64, 36],
        boxes: 50,
        lights: &[0, 1, 4],
        most_passes: [4, 4],
        shadow_maps: &[0, 2],
    };

    fn new(arguments: &Arguments) -> Self {
        match (arguments.bench, arguments.quick) {
            (false, _) => Self::TRIAL,
            (true, true) => Self::QUICK,
            (true, false) => Self::FULL,
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let extent = Extent::new(&arguments);
    let adapter = backends::adapter_name();
    if adapter.is_none() {
        eprintln!("no graphics adapter found: what a device takes is left out");
    }

    let progress = ProgressBar::new(0);
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} frames, {eta} left  {msg}")?);
    let mut report = Report::new(&extent, adapter);
    for &backend in BackendName::available() {
        report.lights.extend(lights::measure(&extent, backend, &progress)?);
        report.shadows.extend(shadows::measure(&extent, backend, &progress)?);
        report.depth_pre_pass.extend(pre_pass::measure(&extent, backend, &progress)?);
    }
    progress.finish_and_clear();
    report.print();
    // A trial must not take the place of what was measured.
    if arguments.bench && !arguments.quick {
        report.write()?;
    }
    Ok(())
}
