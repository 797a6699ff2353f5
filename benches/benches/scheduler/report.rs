//! The results, as a table and as JSON.

use std::io;

use drawloom_benches::results;
use drawloom_benches::table::Table;
use drawloom_output::print_line;
use serde::Serialize;

use crate::Extent;
use crate::row::Row;

/// The results.
pub struct Report {
    extent: &'static str,
    rounds: usize,
    lines: Vec<Line>,
}

/// A contender in a row.
#[derive(Serialize)]
struct Line {
    row: &'static str,
    executor: &'static str,
    workers: usize,
    median: f64,
    p95: f64,
    unit: &'static str,
    /// Whether another executor does the same task.
    #[serde(skip)]
    is_peer: bool,
}

impl Line {
    fn is_ours(&self) -> bool {
        self.executor.starts_with("drawloom")
    }
}

impl Report {
    pub fn new(extent: &Extent) -> Self {
        Self { extent: extent.name, rounds: extent.rounds, lines: Vec::new() }
    }

    pub fn add(&mut self, row: &Row) {
        self.lines.extend(row.contenders.iter().map(|contender| {
            let mut line = Line {
                row: row.name,
                executor: contender.name,
                workers: contender.workers,
                median: contender.median(),
                p95: contender.percentile_95(),
                unit: row.unit,
                is_peer: false,
            };
            line.is_peer = !line.is_ours() && !contender.is_easier;
            line
        }));
    }

    pub fn print(&self) {
        let note = if self.extent == "full" { "" } else { " (inaccurate figures)" };
        print_line!("{} run{note}: medians and 95th percentiles of {} rounds", self.extent, self.rounds);
        print_line!(
            "workers: threads that run jobs, the caller's included; ratio: to the best of the peers of as many, or of all"
        );
        print_line!("easier, and so no peers: a graph layer by layer, jobs that need not be spawned, no jobs at all\n");
        let mut table = Table::new(&["row", "executor", "workers", "median", "p95", "unit", "ratio"]);
        for line in &self.lines {
            let Line { row, executor, workers, median, p95, unit, .. } = line;
            let ratio = self.best_peer(row, *workers).map_or(String::new(), |best| format!("{:.2}", median / best));
            let figures = [median, p95].map(|figure| format!("{figure:.decimals$}", decimals = decimals(*figure)));
            let [median, p95] = figures;
            table.row([
                row.to_string(),
                executor.to_string(),
                workers.to_string(),
                median,
                p95,
                unit.to_string(),
                ratio,
            ]);
        }
        table.print();
        self.print_cold_target();
    }

    /// A frame that finds all workers asleep has to wake them. Prints its distance from the ideal plus the time of a wake-up.
    fn print_cold_target(&self) {
        let own_lines = self.lines.iter().filter(|line| line.row == "frame_cold" && line.is_ours());
        for &Line { executor, workers, median, .. } in own_lines {
            let figures = (self.median("wake", "drawloom", workers), self.median("frame_cold", "ideal", workers));
            let (Some(wake), Some(ideal)) = figures else { continue };
            let target = ideal + 1.5 * wake;
            print_line!(
                "frame_cold: {executor} on {workers} workers takes {:+.1} µs against {target:.1}, the ideal + 1.5 wakes of {wake:.1} (row wake, drawloom)",
                median - target
            );
        }
        print_line!();
    }

    fn median(&self, row: &str, executor: &str, workers: usize) -> Option<f64> {
        let is_same = |line: &&Line| (line.row, line.executor, line.workers) == (row, executor, workers);
        self.lines.iter().find(is_same).map(|line| line.median)
    }

    /// The best peer with as many workers, or of all where none has as many.
    fn best_peer(&self, row: &str, workers: usize) -> Option<f64> {
        let peers = self.lines.iter().filter(|line| line.row == row && line.is_peer);
        let equal = peers.clone().filter(|line| line.workers == workers);
        let best = |lines: &mut dyn Iterator<Item = &Line>| lines.map(|line| line.median).min_by(f64::total_cmp);
        best(&mut equal.into_iter()).or_else(|| best(&mut peers.into_iter()))
    }

    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write(&self) -> io::Result<()> {
        results::write_json("scheduler.json", &self.lines)
    }
}

/// Decimals that make three digits of small numbers.
fn decimals(figure: f64) -> usize {
    match figure {
        ..10.0 => 2,
        ..1000.0 => 1,
        _ => 0,
    }
}
