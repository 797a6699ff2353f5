//! The cost of the job system, beside rayon, bevy_tasks, chili, and std's threads that sleep and that spin.
//!
//!     cargo bench -p drawloom-benches --bench scheduler
//!     cargo bench -p drawloom-benches --bench scheduler -- --quick
//!     cargo bench -p drawloom-benches --bench scheduler -- --row frame --row fine
//!     cargo bench -p drawloom-benches --bench scheduler -- --workers 2,8
//!
//! Contenders are interleaved: in each round those of one row run once in random order, then those of the next row. A
//! run builds a pool, warms it up, measures, and drops it, so that pools do not disturb each other. Each contender is
//! checked before it is measured. All contenders run on each number of workers, the calling thread included, and are
//! compared with peers of at most as many. Each row's file explains the row. The table shows medians;
//! `target/drawloom/scheduler.json` has the same. The last line names the targets that were missed.

mod chains;
mod flat;
mod graph;
mod idle;
mod pools;
mod report;
mod row;
mod thread_team;
mod timer;
mod tiny;
mod wake;

use std::error::Error;
use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;
use drawloom_benches::arguments::{ExtentArguments, WorkersArguments};
use drawloom_benches::harness::{Harness, Rounds, progress_bar};
use drawloom_output::print_diagnostic;

use report::Report;
use row::Row;
use timer::Pace;

/// Why a contender failed.
pub type Failure = Box<dyn Error + Send + Sync>;

/// Compares executors.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    extent: ExtentArguments,
    #[command(flatten)]
    workers: WorkersArguments,
    /// Measures this row only. May be repeated.
    #[arg(long = "row", value_parser = ROWS)]
    rows: Vec<String>,
}

/// In the order they are shown.
const ROWS: [&str; 11] =
    ["graph_1k", "graph_4k", "graph_10k", "frame", "frame_cold", "fine", "flat", "wake", "idle", "asleep", "tiny"];

/// The size of the measurement.
pub struct Extent {
    name: &'static str,
    rounds: usize,
    /// Duration of a sample of frames back to back.
    sample: Duration,
    /// Nodes of each of the three graphs.
    graphs: [usize; 3],
    /// Frames per run.
    cold_frames: usize,
    idle_frames: usize,
    /// Jobs and threads of the row of that name.
    flat: usize,
    threads: usize,
    /// Jobs per run.
    wakes: usize,
    /// Duration of the idle phase.
    asleep: Duration,
}

impl Extent {
    const FULL: Self = Self {
        name: "full",
        rounds: 15,
        sample: Duration::from_millis(15),
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
        sample: Duration::from_millis(2),
        graphs: [200, 400, 1_000],
        cold_frames: 2,
        idle_frames: 3,
        flat: 1_000,
        threads: 50,
        wakes: 3,
        asleep: Duration::from_millis(50),
    };

    fn back_to_back(&self) -> Pace<'static> {
        Pace::BackToBack { duration: self.sample }
    }

    /// The row of that name, with contenders of each of these numbers of workers.
    fn row(&self, name: &str, workers: &[usize]) -> Result<Row, Failure> {
        match name {
            "graph_1k" => Ok(graph::row("graph_1k", self.graphs[0], self, workers)),
            "graph_4k" => Ok(graph::row("graph_4k", self.graphs[1], self, workers)),
            "graph_10k" => Ok(graph::row("graph_10k", self.graphs[2], self, workers)),
            "frame" => Ok(chains::frame(self, workers)),
            "frame_cold" => Ok(chains::frame_cold(self, workers)),
            "fine" => Ok(chains::fine(self, workers)),
            "flat" => Ok(flat::row(self, workers)),
            "wake" => Ok(wake::row(self, workers)),
            "idle" => Ok(idle::idle(self, workers)),
            "asleep" => Ok(idle::asleep(self, workers)),
            "tiny" => Ok(tiny::row(self, workers)),
            _ => Err(format!("there is no row {name:?}").into()),
        }
    }
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Failure> {
    let arguments: Arguments = drawloom_output::parse_arguments();
    let quick = arguments.extent.is_quick();
    let extent = if quick { Extent::QUICK } else { Extent::FULL };
    let is_requested = |name: &str| arguments.rows.is_empty() || arguments.rows.iter().any(|row| row == name);
    // CPU time is read on Linux only.
    let is_available = |name: &str| cfg!(target_os = "linux") || !["idle", "asleep"].contains(&name);
    // The report compares a cold frame with the time of a wake-up.
    let is_needed = |name: &str| is_requested(name) || name == "wake" && is_requested("frame_cold");
    let rows = ROWS.into_iter().filter(|name| is_needed(name) && is_available(name));
    let workers = arguments.workers.parallel_counts();
    let mut rows: Vec<Row> = rows.map(|name| extent.row(name, &workers)).collect::<Result<_, _>>()?;
    for row in rows.extract_if(.., |row| row.contenders.is_empty()) {
        print_diagnostic!("The row {} is left out: it takes two workers or more", row.name);
    }
    if rows.is_empty() {
        return Err("there is nothing to measure".into());
    }

    let progress = progress_bar("runs");
    rows.iter_mut().try_for_each(Row::check)?;
    let contenders = rows.iter().map(|row| row.contenders.len()).sum();
    let mut harness = Harness::new(Rounds { warm_up: 0, measured: extent.rounds }, &progress);
    // Rounds are the outer loop: a disturbance of some seconds spoils one round of each row, rather than all of one
    // row.
    for _ in harness.rounds(contenders) {
        rows.iter_mut().try_for_each(|row| row.round(&mut harness, &progress))?;
    }
    let mut report = Report::new(&extent);
    rows.iter().for_each(|row| report.add(row));
    progress.finish_and_clear();
    report.print();
    let targets = report.targets();
    targets.print("Targets and results: the best of this crate ÷ the best of its peers");
    if !quick {
        report.write()?;
    }
    targets.print_missed();
    Ok(())
}
