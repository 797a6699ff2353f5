//! The speed-up of more cores by the number of objects: the table of L 6, on this machine.
//!
//!     cargo bench -p drawloom-benches --bench objects
//!     cargo bench -p drawloom-benches --bench objects -- --quick
//!     cargo bench -p drawloom-benches --bench objects -- --backend noop --workers 2,8
//!     cargo bench -p drawloom-benches --bench objects -- --backend adapter --max-objects 10000
//!
//! L's scene holds 7 to 2,006 objects; further objects have the positions of existing ones, so that they cost the
//! device little. All of them move a little in every frame. The deferred pipeline draws them with one hemispherical
//! light that casts shadows, so each is drawn in two views.
//!
//! - *single* is L's first scenario: the same processes on one thread, recorded directly into the passes, one draw per
//!   object.
//! - *multi* is this crate on each number of workers, with instancing and without.
//! - Two scenarios in between separate the effect of threads from that of bundles that are kept: *one worker, cached*
//!   is single with cached bundles, and *direct* is single on as many workers as *multi*.
//!
//! They are interleaved; a sample is as many frames as fill some milliseconds, each from hand-over to the return of
//! submit, without the device's time. Frames per second are those of the median round, and a ratio is that of two
//! medians. `ceiling.rs` explains the ceiling. On the adapter there are also frames per second that are *drawn*: with
//! two in flight, so that the longer of the CPU's part and the device's says how many there are, as in L 6.
//!
//! The second table says where the time of a frame goes. *Held* is how long the engine's world is borrowed (L 3): until
//! recording ends. *Load* is how busy the calling thread is, and the mean of the other workers. *API* is the share of
//! the work in calls of wgpu. Loads and shares are those of a frame after each sample that the timeline records. *CPU
//! use* is the share of all cores' time that the process uses with two frames in flight: where it is small, the device
//! says how many frames there are, and threads win nothing (L 6).
//!
//! The third table has an engine's update, which takes 0.1 µs an object in all and runs on all workers: before
//! recording; beside submission, when the world is no longer borrowed; or in a `FrameLoop`, where another thread
//! submits, and two frames are in flight. These times have the device's in them.
//!
//! The fourth table has the splits of L 5. *By process* is a job for the geometry buffer and for each shadow map, each
//! of which is recorded straight into its pass; *by material* also splits the geometry buffer, into as many processes
//! as there are workers; *by draws* is this crate's division, into bundles that are not kept.
//!
//! Growth is the cost of an object in scenes of many objects, without instancing.
//!
//! `target/drawloom/objects.json` and `.svg` have the same. The last line names the targets that were missed.

mod ceiling;
mod charts;
mod growth;
mod report;
mod runner;
mod scenario;
mod splits;
mod update;
mod world;

use std::error::Error;
use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;
use drawloom_benches::arguments::{BackendArguments, WorkersArguments};
use drawloom_benches::harness::progress_bar;

use report::Report;

/// Compares one thread with several workers.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    backend: BackendArguments,
    #[command(flatten)]
    workers: WorkersArguments,
    /// Leaves out scenes of more objects, which take minutes on an adapter that is a CPU.
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u64).range(7..))]
    max_objects: Option<u64>,
}

impl Arguments {
    /// Those of the numbers of objects that are to be measured.
    fn within_limit(&self, objects: &'static [usize]) -> Vec<usize> {
        let max_objects = self.max_objects.unwrap_or(u64::MAX);
        objects.iter().copied().filter(|&objects| objects as u64 <= max_objects).collect()
    }
}

/// The size of the measurement. Of two values the first is for `noop`, where frames are short, the second for the
/// adapter.
pub struct Extent {
    name: &'static str,
    /// Warm-up frames of each scenario: tables grow, pipelines are created, and tuners measure costs in them.
    warm_up: [usize; 2],
    rounds: [usize; 2],
    /// Least duration of a sample.
    sample: [Duration; 2],
    objects: &'static [usize],
    /// The objects of the table of splits.
    splits: &'static [usize],
    /// The same for the table of growth.
    growth_warm_up: [usize; 2],
    growth_rounds: [usize; 2],
    growth: &'static [usize],
}

impl Extent {
    const FULL: Self = Self {
        name: "full",
        warm_up: [60, 40],
        rounds: [41, 15],
        sample: [Duration::from_millis(4), Duration::ZERO],
        objects: &[7, 16, 106, 1_006, 2_006, 10_000, 100_000],
        splits: &[1_006, 2_006, 10_000],
        growth_warm_up: [40, 5],
        growth_rounds: [15, 5],
        growth: &[10_000, 100_000, 1_000_000],
    };
    const QUICK: Self = Self {
        name: "quick",
        warm_up: [3, 1],
        rounds: [3, 1],
        sample: [Duration::ZERO; 2],
        objects: &[7, 106, 1_006],
        splits: &[1_006],
        growth_warm_up: [1, 1],
        growth_rounds: [3, 1],
        growth: &[1_000, 10_000],
    };
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: Arguments = drawloom_output::parse_arguments();
    let extent = if arguments.backend.is_quick() { Extent::QUICK } else { Extent::FULL };
    let progress = progress_bar("samples");
    let mut report = Report::new(&extent);
    let workers = arguments.workers.parallel_counts();
    for backend in arguments.backend.backends()? {
        for objects in arguments.within_limit(extent.objects) {
            report.scenarios.extend(scenario::measure(&extent, backend, objects, &workers, &progress)?);
            report.updates.extend(update::measure(&extent, backend, objects, &workers, &progress)?);
        }
        for objects in arguments.within_limit(extent.splits) {
            report.splits.extend(splits::measure(&extent, backend, objects, &workers, &progress)?);
        }
        let objects = arguments.within_limit(extent.growth);
        report.growth.extend(growth::measure(&extent, &objects, backend, &workers, &progress)?);
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
