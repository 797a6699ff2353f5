//! How finely should a frame be cut? Each granularity on each of six scenes, beside one thread and beside the granularity
//! that the renderer chooses for itself (M 10.5, "Better Load Balancing").
//!
//!     cargo bench -p drawloom-benches --bench load_balance
//!     cargo bench -p drawloom-benches --bench load_balance -- --quick
//!     cargo bench -p drawloom-benches --bench load_balance -- --backend noop --scene uneven --scene interrupted
//!
//! A block is one scene on one backend. All its modes take turns in an order drawn anew each round, so that whatever else
//! the machine does meets them alike; a turn is as many frames as fill some milliseconds, from hand-over to the return of
//! submit. Before that all of them have as many frames to warm up and to learn in. Which fixed mode is the best is found
//! in a first half of the rounds, and what is shown is from the second: the best of seven in the very rounds it is judged
//! by would be the luckiest too. Ratios are medians of rounds, of two turns of one round each.
//!
//! What more workers would do is predicted: the jobs of frames that were measured are replayed. The same is done for the
//! workers that there are, which says how far off predictions are. A replay keeps the jobs as they were cut, so adaptive is
//! shown as it is for the workers that there are; and it knows nothing of the foreign thread of `interrupted`.
//!
//! Written to `drawloom/load_balance.json` and `.svg` in the target folder too.

mod charts;
mod interruption;
mod mode;
mod prediction;
mod report;
mod scenes;
mod turns;

use std::error::Error;
use std::thread;
use std::time::Duration;

use clap::Parser;
use drawloom::report::Prices;
use drawloom_benches::trial::Trial;
use indicatif::{ProgressBar, ProgressStyle};

use report::Report;
use turns::Block;

/// Compares granularities.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    trial: Trial,
    /// Measures this scene only; may be given several times.
    #[arg(long = "scene", value_parser = scenes::NAMES)]
    scenes: Vec<String>,
}

/// How much is measured. Of two figures the first is for `noop`, where frames are short, the second for the adapter.
pub struct Extent {
    name: &'static str,
    /// Frames of each mode that are not counted: tables grow, pipelines are made, and prices are learnt in them.
    warm_up: [usize; 2],
    /// Of each half.
    rounds: [usize; 2],
    /// How long a turn takes at least.
    turn: [Duration; 2],
    /// Of the second half, in so many rounds each turn is followed by a frame that predictions are made from.
    replays: usize,
    /// Objects are divided by this.
    share: usize,
}

impl Extent {
    const FULL: Self = Self {
        name: "full",
        warm_up: [60, 40],
        rounds: [41, 15],
        turn: [Duration::from_millis(4), Duration::ZERO],
        replays: 15,
        share: 1,
    };
    const QUICK: Self =
        Self { name: "quick", warm_up: [3, 1], rounds: [3, 1], turn: [Duration::ZERO; 2], replays: 1, share: 20 };
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let extent = if arguments.trial.is_quick() { Extent::QUICK } else { Extent::FULL };
    let is_asked = |name: &str| arguments.scenes.is_empty() || arguments.scenes.iter().any(|scene| scene == name);
    let cases: Vec<_> = scenes::all(extent.share)?.into_iter().filter(|case| is_asked(case.name)).collect();

    let prices = Prices::measure()?;
    let progress = ProgressBar::new(0);
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} turns, {eta} left  {msg}")?);
    let mut report = Report::new(&extent);
    for backend in arguments.trial.backends() {
        for case in &cases {
            for workers in worker_counts()? {
                let block = Block { case, backend, workers, prices, extent: &extent, progress: &progress };
                report.add(&block, block.measure()?);
            }
        }
    }
    progress.finish_and_clear();
    report.print();
    if !arguments.trial.is_quick() {
        report.write()?;
    }
    Ok(())
}

/// Two, and twice as many as long as the machine has them.
fn worker_counts() -> Result<Vec<usize>, Box<dyn Error>> {
    let available = thread::available_parallelism()?.get().max(2);
    Ok((1..=available.ilog2()).map(|power| 1 << power).collect())
}
