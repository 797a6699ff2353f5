//! The results, as a table and as JSON.

use std::collections::BTreeSet;
use std::io;

use drawloom_benches::results;
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use drawloom_output::print_line;
use serde::Serialize;

use crate::row::Row;
use crate::{Extent, ROWS};

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
            "workers: threads that run jobs, the caller's included; ratio: to the best of the peers of at most as many, or of all"
        );
        print_line!(
            "easier, and so no peers: a graph layer by layer, jobs that need not be spawned, no jobs at all, threads that never sleep where others do\n"
        );
        let mut table = Table::new(&["row", "executor", "workers", "median", "p95", "unit", "ratio"]);
        for line in &self.lines {
            let Line { row, executor, workers, median, p95, unit, .. } = line;
            let ratio =
                self.best_peer(row, *workers).map_or(String::new(), |best| format!("{:.2}", median / best.median));
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
    }

    /// What was reached of the targets.
    pub fn targets(&self) -> Targets {
        let mut targets = Targets::new();
        // A pool that sleeps takes next to no time, and the ratio of two such times says nothing.
        for row in ROWS.into_iter().filter(|&row| row != "asleep") {
            let own_lines = || self.lines.iter().filter(|line| line.row == row && line.is_ours());
            for workers in own_lines().map(|line| line.workers).collect::<BTreeSet<_>>() {
                let own = own_lines().filter(|line| line.workers <= workers);
                let own = own.min_by(|one, other| one.median.total_cmp(&other.median));
                let peer = self.best_peer(row, workers).filter(|peer| peer.workers <= workers);
                if let (Some(own), Some(peer)) = (own, peer) {
                    let figure = format!("{row}, {workers} workers, {} ÷ {}", own.executor, peer.executor);
                    targets.at_most(figure, 1.0, own.median / peer.median);
                }
            }
        }
        // A frame that finds all workers asleep has to wake them.
        for &Line { executor, workers, median, .. } in
            self.lines.iter().filter(|line| line.row == "frame_cold" && line.is_ours())
        {
            let figures = (self.median("wake", "drawloom", workers), self.median("frame_cold", "ideal", workers));
            let (Some(wake), Some(ideal)) = figures else { continue };
            let bound = ideal + 1.5 * wake;
            let figure = format!("frame_cold, {workers} workers, {executor} ÷ (ideal + 1.5 × wake = {bound:.1} µs)");
            targets.at_most(figure, 1.0, median / bound);
        }
        targets
    }

    fn median(&self, row: &str, executor: &str, workers: usize) -> Option<f64> {
        let is_same = |line: &&Line| (line.row, line.executor, line.workers) == (row, executor, workers);
        self.lines.iter().find(is_same).map(|line| line.median)
    }

    /// The best peer with at most as many workers, or of all where none has so few.
    fn best_peer(&self, row: &str, workers: usize) -> Option<&Line> {
        let best = |most: usize| {
            let peers = self.lines.iter().filter(|line| line.row == row && line.is_peer && line.workers <= most);
            peers.min_by(|one, other| one.median.total_cmp(&other.median))
        };
        best(workers).or_else(|| best(usize::MAX))
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
