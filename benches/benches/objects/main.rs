//! What a second core gains, by the number of objects: the table of L 6 again, on this machine.
//!
//!     cargo bench -p drawloom-benches --bench objects
//!     cargo bench -p drawloom-benches --bench objects -- --quick
//!     cargo bench -p drawloom-benches --bench objects -- --backend noop
//!
//! L's scene holds 7 to 2,006 objects; those that are added stand where others stand already, so that the device has
//! little to do with them. All of them move a little in every frame, and are drawn through the deferred pipeline with one
//! hemispherical light that casts shadows, so each is drawn in two views.
//!
//! - *single* is L's first scenario: the same processes on one thread, recorded straight into the passes, a draw an object.
//! - *multi* is what this crate does on two workers, with instancing and without.
//!
//! They take turns, in an order drawn anew each round; a turn is as many frames as fill some milliseconds, each from
//! hand-over to the return of submit. Frames a second are those of the median round, and a ratio is the median of the
//! rounds' own. What the device takes is waited for, and not counted. The ceiling is explained in `objects/ceiling.rs`. The
//! stall is how long the engine's world is held (L 3): until recording ends, of the whole frame.
//!
//! Growth is what an object costs where there are many: two workers, no instancing.
//!
//! Written to `drawloom/objects.json` and `.svg` in the target folder too.

mod ceiling;
mod charts;
mod growth;
mod report;
mod scenario;
mod turns;
mod world;

use std::error::Error;
use std::time::Duration;

use clap::Parser;
use drawloom_benches::trial::Trial;
use indicatif::{ProgressBar, ProgressStyle};

use report::Report;

/// Compares one thread with two workers.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    trial: Trial,
}

/// How much is measured. Of two figures the first is for `noop`, where frames are short, the second for the adapter.
pub struct Extent {
    name: &'static str,
    /// Frames of each scenario that are not counted: tables grow, pipelines are made, and prices are learnt in them.
    warm_up: [usize; 2],
    rounds: [usize; 2],
    /// How long a turn takes at least.
    turn: [Duration; 2],
    objects: &'static [usize],
    /// Frames and rounds where there are more objects than in the table above.
    growth_warm_up: [usize; 2],
    growth_rounds: [usize; 2],
    growth: &'static [usize],
}

impl Extent {
    const FULL: Self = Self {
        name: "full",
        warm_up: [60, 40],
        rounds: [41, 15],
        turn: [Duration::from_millis(4), Duration::ZERO],
        objects: &[7, 16, 106, 1_006, 2_006, 10_000, 100_000],
        growth_warm_up: [40, 5],
        growth_rounds: [15, 5],
        growth: &[10_000, 100_000, 1_000_000],
    };
    const QUICK: Self = Self {
        name: "quick",
        warm_up: [3, 1],
        rounds: [3, 1],
        turn: [Duration::ZERO; 2],
        objects: &[7, 106, 1_006],
        growth_warm_up: [1, 1],
        growth_rounds: [3, 1],
        growth: &[1_000, 10_000],
    };
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let extent = if arguments.trial.is_quick() { Extent::QUICK } else { Extent::FULL };
    let progress = ProgressBar::new(0);
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} turns, {eta} left  {msg}")?);
    let mut report = Report::new(&extent);
    for backend in arguments.trial.backends() {
        for &objects in extent.objects {
            report.scenarios.extend(scenario::measure(&extent, backend, objects, &progress)?);
        }
        report.growth.extend(growth::measure(&extent, backend, &progress)?);
    }
    progress.finish_and_clear();
    report.print();
    if !arguments.trial.is_quick() {
        report.write()?;
    }
    Ok(())
}
