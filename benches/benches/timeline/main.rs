//! The cost of recording timelines, and of a recorder that is off.
//!
//!     cargo bench -p drawloom-benches --bench timeline
//!     cargo bench -p drawloom-benches --bench timeline -- --quick
//!
//! *Off* is counted rather than timed: instructions per chunk, under callgrind, of this build and of one without a
//! recorder, built with `--cfg drawloom_without_timeline`. It requires valgrind and builds the crate twice more. *On*
//! is timed: frames with the recorder off and on are interleaved, for the scheduler benchmark's row `frame` and for
//! empty chunks. A *span* is the cost of a node's `tracing` span without a subscriber. `target/drawloom/timeline.json`
//! has the same. The last line names the targets that were missed.

mod count;
mod recording;
mod report;
mod shape;
mod spans;

use std::error::Error;

use clap::Parser;
use drawloom_benches::arguments::ExtentArguments;
use drawloom_benches::harness::{Harness, Rounds, progress_bar};
use std::process::ExitCode;

use recording::Timed;
use report::{Figures, Report};
use shape::Shape;

/// Measures the cost of timelines.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    extent: ExtentArguments,
    /// Runs frames of this shape and nothing else, to be counted.
    #[arg(long, value_enum, requires = "frames", hide = true)]
    shape: Option<Shape>,
    #[arg(long, requires = "shape", hide = true)]
    frames: Option<usize>,
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error + Send + Sync>> {
    let arguments: Arguments = drawloom_output::parse_arguments();
    if let (Some(shape), Some(frames)) = (arguments.shape, arguments.frames) {
        return shape.run(frames);
    }
    let quick = arguments.extent.is_quick();
    let rounds = if quick { 5 } else { 101 };
    let progress = progress_bar("runs");
    let mut timed = Timed::all()?;
    let mut harness = Harness::new(Rounds { warm_up: 0, measured: rounds }, &progress);
    for _ in harness.rounds(2 * timed.len()) {
        timed.iter_mut().try_for_each(|timed| timed.round(&mut harness))?;
    }
    let span = spans::measure(if quick { 3 } else { 31 });
    let counted = if quick { Ok(Vec::new()) } else { count::count(&progress) };
    progress.finish_and_clear();

    let ring_bytes = timed.iter().map(Timed::ring_bytes).max().unwrap_or_default();
    let timed = timed.iter().map(Timed::figures).collect();
    let report = Report::new(Figures { rounds, timed, span, counted: counted?, ring_bytes });
    report.print(quick);
    if !quick {
        report.write()?;
    }
    report.targets().print_missed();
    Ok(())
}
