//! How finely should a frame be cut, and where should its commands be translated for the device? Compares a job a
//! camera, a job a draw, jobs of fixed numbers of draws, the adaptive granularity, and translation on the device thread
//! with one worker (M 10.2 and 10.5, "Better Load Balancing").
//!
//!     cargo bench -p drawloom-benches --bench load_balance
//!     cargo bench -p drawloom-benches --bench load_balance -- --quick
//!     cargo bench -p drawloom-benches --bench load_balance -- --backend noop --scene uneven --scene interrupted
//!     cargo bench -p drawloom-benches --bench load_balance -- --kind ordered --workers 4,8
//!
//! There are three kinds of scenes. In *moving* all objects move and all cameras turn, and nothing is said of it, so
//! each frame makes its draw lists. In *ordered* the lists are also sorted by depth, and in one scene each object is a
//! draw. In *still* nothing moves: lists are kept, and there is next to nothing to divide.
//!
//! A block is one scene on one backend and one number of workers. Its modes are interleaved, and draw the same frames;
//! a sample is as many frames as fill some milliseconds, from hand-over to the return of submit. The first half of the
//! rounds determines the best fixed mode, and the second half gives the results: in the rounds that select it, the best
//! of several modes is also the luckiest. A ratio is the median of the rounds' own ratios. Large scenes are measured on
//! `noop` alone.
//!
//! A timeline of frames between the samples gives the number of jobs, and the time in which each worker has none while
//! jobs run.
//!
//! Results for more workers are predicted: measured frames are replayed. A replay for the actual number of workers
//! shows the error of predictions. Frames of *adaptive* are cut for the predicted workers, and a table shows what
//! bounds them. A replay does not model the other thread of `interrupted`.
//!
//! `target/drawloom/load_balance.json` and `.svg` have the same.

mod block;
mod bounds;
mod charts;
mod interruption;
mod mode;
mod occupancy;
mod prediction;
mod report;
mod scenes;
mod world;

use std::error::Error;
use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;
use drawloom::report::SchedulerCosts;
use drawloom_benches::arguments::{BackendArguments, WorkersArguments};
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::progress_bar;

use block::Block;
use report::Report;
use scenes::{Case, Kind};

/// Compares granularities.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    backend: BackendArguments,
    #[command(flatten)]
    workers: WorkersArguments,
    /// Measures this scene only. May be repeated.
    #[arg(long = "scene", value_parser = scenes::NAMES)]
    scenes: Vec<String>,
    /// Measures this kind of scenes only. May be repeated.
    #[arg(long = "kind")]
    kinds: Vec<Kind>,
}

/// The size of the measurement. Of two values the first is for `noop`, where frames are short, the second for the
/// adapter.
pub struct Extent {
    name: &'static str,
    /// Warm-up frames of each mode: tables grow, pipelines are created, and tuners measure costs in them.
    warm_up: [usize; 2],
    /// Rounds of each half.
    rounds: [usize; 2],
    /// Least duration of a sample.
    sample: [Duration; 2],
    /// In this many rounds of the second half a frame that is replayed follows each sample.
    replays: usize,
    /// The scenes' objects are divided by this.
    divisor: usize,
}

impl Extent {
    const FULL: Self = Self {
        name: "full",
        warm_up: [60, 40],
        rounds: [41, 15],
        sample: [Duration::from_millis(4), Duration::ZERO],
        replays: 15,
        divisor: 1,
    };
    const QUICK: Self =
        Self { name: "quick", warm_up: [1, 1], rounds: [1, 1], sample: [Duration::ZERO; 2], replays: 1, divisor: 20 };
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: Arguments = drawloom_output::parse_arguments();
    let extent = if arguments.backend.is_quick() { Extent::QUICK } else { Extent::FULL };
    let is_requested = |case: &Case| {
        (arguments.scenes.is_empty() || arguments.scenes.iter().any(|scene| scene == case.name))
            && (arguments.kinds.is_empty() || arguments.kinds.contains(&case.kind))
    };
    let cases: Vec<_> = scenes::all(extent.divisor)?.into_iter().filter(is_requested).collect();
    if cases.is_empty() {
        return Err("none of the scenes is of a kind that was asked for".into());
    }

    let costs = SchedulerCosts::measure()?;
    let progress = progress_bar("samples");
    let mut report = Report::new(&extent);
    for backend in arguments.backend.backends()? {
        let is_measured = |case: &&Case| backend == BackendName::Noop || !case.is_large;
        for case in cases.iter().filter(is_measured) {
            for workers in arguments.workers.parallel_counts() {
                let block = Block { case, backend, workers, costs, extent: &extent, progress: &progress };
                report.add(&block, &block.measure()?);
            }
        }
    }
    progress.finish_and_clear();
    report.print();
    if !arguments.backend.is_quick() {
        report.write()?;
    }
    report.print_missed();
    Ok(())
}
