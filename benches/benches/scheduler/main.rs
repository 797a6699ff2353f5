//! What the job system costs, beside rayon, bevy_tasks, chili and std's threads.
//!
//!     cargo bench -p drawloom-benches --bench scheduler
//!     cargo bench -p drawloom-benches --bench scheduler -- --quick
//!     cargo bench -p drawloom-benches --bench scheduler -- --row frame --row fine
//!
//! In a round all contenders of a row take turns, in an order drawn anew, and then those of the next row, so that whatever
//! else the machine does meets them alike. A turn builds a pool of two workers, warms it up, measures, and drops it, so that
//! pools do not disturb each other. What a contender does is checked before it is measured. Each row's file says what the
//! row is; what is shown are medians. What was measured is written to `drawloom/scheduler.json` in the target folder too.

mod crew;
mod flat;
mod graph;
mod idle;
mod passes;
mod pools;
mod report;
mod tiny;
mod turns;
mod wake;
mod watch;

use std::error::Error;
use std::time::Duration;

use clap::Parser;
use drawloom_testing::random::Random;
use indicatif::{ProgressBar, ProgressStyle};

use report::Report;
use turns::Row;
use watch::Pace;

/// Of everybody who runs jobs: the thread that has them, and one more.
pub const WORKERS: usize = 2;

/// Why a contender failed; from whichever thread.
pub type Failure = Box<dyn Error + Send + Sync>;

/// Compares ways to run jobs.
#[derive(Parser)]
struct Arguments {
    /// Few rounds and small sizes, to see that it works.
    #[arg(long)]
    quick: bool,
    /// Measures this row only; may be given several times.
    #[arg(long = "row", value_parser = ROWS)]
    rows: Vec<String>,
    /// Given by `cargo bench`; without it, as under `cargo test --benches`, the run is a quick one.
    #[arg(long, hide = true)]
    bench: bool,
}

/// In the order they are shown.
const ROWS: [&str; 11] =
    ["graph_1k", "graph_4k", "graph_10k", "frame", "frame_cold", "fine", "flat", "wake", "idle", "asleep", "tiny"];

/// How much is measured.
pub struct Extent {
    name: &'static str,
    rounds: usize,
    /// How long the frames of a turn take together, where they come back to back.
    turn: Duration,
    /// Nodes of the three graphs.
    graphs: [usize; 3],
    /// Frames a turn.
    cold_frames: usize,
    idle_frames: usize,
    /// Jobs of the row of that name, and how many threads start in it.
    flat: usize,
    threads: usize,
    /// Jobs a turn.
    wakes: usize,
    /// How long nothing is to be done.
    asleep: Duration,
}

impl Extent {
    const FULL: Self = Self {
        name: "full",
        rounds: 15,
        turn: Duration::from_millis(15),
        graphs: [1_000, 4_000, 10_000],
        cold_frames: 20,
        idle_frames: 30,
        flat: 10_000,
        threads: 1_000,
        wakes: 20,
        asleep: Duration::from_secs(2),
    };
    const QUICK: Self = Self {
        name: "quick",
        rounds: 3,
        turn: Duration::from_millis(2),
        graphs: [200, 400, 1_000],
        cold_frames: 2,
        idle_frames: 3,
        flat: 1_000,
        threads: 50,
        wakes: 3,
        asleep: Duration::from_millis(50),
    };

    fn hot(&self) -> Pace<'static> {
        Pace::Hot { turn: self.turn }
    }

    fn row(&self, name: &str) -> Result<Row, Failure> {
        match name {
            "graph_1k" => Ok(graph::row("graph_1k", self.graphs[0], self)),
            "graph_4k" => Ok(graph::row("graph_4k", self.graphs[1], self)),
            "graph_10k" => Ok(graph::row("graph_10k", self.graphs[2], self)),
            "frame" => Ok(passes::frame(self)),
            "frame_cold" => Ok(passes::frame_cold(self)),
            "fine" => Ok(passes::fine(self)),
            "flat" => Ok(flat::row(self)),
            "wake" => Ok(wake::row(self)),
            "idle" => Ok(idle::idle(self)),
            "asleep" => Ok(idle::asleep(self)),
            "tiny" => Ok(tiny::row(self)),
            _ => Err(format!("there is no row {name:?}").into()),
        }
    }
}

fn main() -> Result<(), Failure> {
    let arguments = Arguments::parse();
    let quick = arguments.quick || !arguments.bench;
    let extent = if quick { Extent::QUICK } else { Extent::FULL };
    let is_asked = |name: &str| arguments.rows.is_empty() || arguments.rows.iter().any(|row| row == name);
    // Processor time is known there only.
    let is_known = |name: &str| cfg!(target_os = "linux") || !["idle", "asleep"].contains(&name);
    // A cold frame is judged by what a wake takes.
    let is_needed = |name: &str| is_asked(name) || name == "wake" && is_asked("frame_cold");
    let rows = ROWS.into_iter().filter(|name| is_needed(name) && is_known(name));
    let mut rows: Vec<Row> = rows.map(|name| extent.row(name)).collect::<Result<_, _>>()?;

    let turns: usize = rows.iter().map(|row| extent.rounds * row.contenders.len()).sum();
    let progress = ProgressBar::new(turns as u64);
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} turns, {eta} left  {msg}")?);
    rows.iter_mut().try_for_each(Row::check)?;
    let mut random = Random::new();
    // All rows once, and then again: what else the machine does for some seconds spoils a round of each, and no row.
    for _ in 0..extent.rounds {
        rows.iter_mut().try_for_each(|row| row.round(&mut random, &progress))?;
    }
    let mut report = Report::new(&extent);
    rows.iter().for_each(|row| report.add(row));
    progress.finish_and_clear();
    report.print();
    // A trial must not take the place of what was measured.
    if !quick {
        report.write()?;
    }
    Ok(())
}
