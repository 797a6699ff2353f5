//! What it costs to record timelines, and to have the recorder there while it is off.
//!
//!     cargo bench -p drawloom-benches --bench timeline
//!     cargo bench -p drawloom-benches --bench timeline -- --quick
//!
//! *Off* is counted rather than timed: instructions a chunk, under callgrind, of this build and of one that is built with
//! `--cfg drawloom_without_timeline`, so without a recorder. That wants valgrind and builds the crate twice more. *On* is timed: frames
//! with the recorder off and on take turns, in the scheduler benchmark's row `frame` and with chunks that do nothing. A *span*
//! is what a process gives subscribers of `tracing`, where there is none. What was measured is written to
//! `drawloom/timeline.json` in the target folder too.

mod count;
mod report;
mod shape;
mod spans;
mod turns;

use std::error::Error;

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};

use report::{Figures, Report};
use shape::Shape;
use turns::Timed;

/// Measures what timelines cost.
#[derive(Parser)]
struct Arguments {
    /// Few rounds, and nothing is counted, to see that it works.
    #[arg(long)]
    quick: bool,
    /// Runs frames of this shape and nothing else: what is counted.
    #[arg(long, value_enum, requires = "frames", hide = true)]
    shape: Option<Shape>,
    #[arg(long, requires = "shape", hide = true)]
    frames: Option<usize>,
    /// Given by `cargo bench`; without it, as under `cargo test --benches`, the run is a quick one.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<(), Box<dyn Error + Send + Sync>> {
    let arguments = Arguments::parse();
    if let (Some(shape), Some(frames)) = (arguments.shape, arguments.frames) {
        return shape.run(frames);
    }
    let quick = arguments.quick || !arguments.bench;
    let rounds = if quick { 5 } else { 101 };
    let progress = ProgressBar::new(rounds);
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} rounds, {eta} left  {msg}")?);
    let mut timed = Timed::all()?;
    for _ in 0..rounds {
        timed.iter_mut().try_for_each(Timed::round)?;
        progress.inc(1);
    }
    let span = spans::measure(if quick { 3 } else { 31 });
    let counted = if quick { Ok(Vec::new()) } else { count::count(&progress) };
    progress.finish_and_clear();

    let ring_bytes = timed.iter().map(Timed::ring_bytes).max().unwrap_or_default();
    let timed = timed.iter().map(Timed::figures).collect();
    let report = Report::new(Figures { rounds, timed, span, counted: counted?, ring_bytes });
    report.print(quick);
    // A trial must not take the place of what was measured.
    if !quick {
        report.write()?;
    }
    Ok(())
}
