//! What it costs to record, by technique: 4 cameras × 10,000 moving objects of 64 meshes and 16 materials, from visibility to
//! submit.
//!
//!     cargo bench -p drawloom-benches --bench record
//!     cargo bench -p drawloom-benches --bench record -- --quick
//!     cargo bench -p drawloom-benches --bench record -- --backend noop
//!
//! - *naive* does what a plain engine does: the same culling, and then for each object all state, in the order of the scene,
//!   on one thread, straight into the pass.
//! - *rayon* cuts the objects of each camera into chunks, culls them and records a bundle of each in parallel; meshes lie in
//!   one buffer and objects in another, so that nothing is set between draws.
//! - *encoder-per-thread* has a thread for each camera, which culls and records straight into an encoder of its own, in the
//!   same form.
//! - *drawloom* is this crate as it comes, and the others of the name are its ways to record, each by itself.
//!
//! All draw the same picture, which is looked at first; upload what moves in every frame, and use wgpu alike. They take turns,
//! in an order drawn anew each round; a turn is as many frames as fill some milliseconds. What is shown are medians, beside
//! how often a frame asks for memory: the whole process, in frames that are not timed; and of that, for Drawloom, what is
//! its own, which is what it asks for where the backend does nothing.
//!
//! Written to `drawloom/record.json` and `.svg` in the target folder too.

mod allocations;
mod apart;
mod draw_only;
mod encoders;
mod naive;
mod nobody;
mod objects;
mod ours;
mod parallel;
mod pictures;
mod report;
mod studio;
mod technique;
mod turns;

use std::error::Error;
use std::time::Duration;

use clap::Parser;
use drawloom_benches::trial::Trial;
use indicatif::{ProgressBar, ProgressStyle};

use allocations::Counting;
use report::Report;

/// Those of the whole process.
#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Each of which sees every object.
pub const CAMERAS: usize = 4;

/// Compares ways to record.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    trial: Trial,
}

/// How much is measured. Of two figures the first is for `noop`, where frames are short, the second for the adapter.
pub struct Extent {
    name: &'static str,
    /// Frames of each technique that are not counted: tables grow, pipelines are made, and prices are learnt in them.
    warm_up: [usize; 2],
    rounds: [usize; 2],
    /// How long a turn takes at least.
    turn: [Duration; 2],
    /// That each camera sees.
    objects: usize,
}

impl Extent {
    const FULL: Self = Self {
        name: "full",
        warm_up: [60, 40],
        rounds: [41, 15],
        turn: [Duration::from_millis(4), Duration::ZERO],
        objects: 10_000,
    };
    const QUICK: Self =
        Self { name: "quick", warm_up: [3, 1], rounds: [3, 1], turn: [Duration::ZERO; 2], objects: 1_000 };
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let extent = if arguments.trial.is_quick() { Extent::QUICK } else { Extent::FULL };
    let progress = ProgressBar::new(0);
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} turns, {eta} left  {msg}")?);
    let mut report = Report::new(&extent);
    for backend in arguments.trial.backends() {
        report.measured.push(turns::measure(&extent, backend, &progress)?);
    }
    progress.finish_and_clear();
    report.print();
    if !arguments.trial.is_quick() {
        report.write()?;
    }
    Ok(())
}
