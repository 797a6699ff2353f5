//! The results: tables on the console, all rows as JSON, and a chart.

use std::error::Error;

use drawloom_benches::backends::{BackendName, adapter_name};
use drawloom_benches::results;
use drawloom_benches::statistics::median;
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use drawloom_output::print_line;
use serde::Serialize;

use crate::block::{Block, Measured, ModeResults};
use crate::bounds::{self, Bounds};
use crate::mode::Mode;
use crate::prediction::PREDICTED;
use crate::scenes::Kind;
use crate::{Extent, charts};

/// A mode on a scene, measured or predicted.
#[derive(Serialize)]
pub struct Row {
    pub kind: Kind,
    pub scene: &'static str,
    pub backend: BackendName,
    pub workers: usize,
    pub mode: &'static str,
    pub ns_per_object_view: f64,
    pub speedup_vs_serial: f64,
    pub ratio_to_best_mode: f64,
    /// The number of jobs in a frame; `None` for a prediction, as the two below.
    pub jobs: Option<f64>,
    /// By worker: milliseconds of a frame, while jobs run, in which it runs none.
    pub idle_ms: Option<Vec<f64>>,
    /// Milliseconds of submission, which is the device thread's.
    pub submit_ms: Option<f64>,
    pub predicted: bool,
}

/// What the rows of a table have in common.
type Place = (Kind, &'static str, BackendName);

impl Row {
    fn place(&self) -> Place {
        (self.kind, self.scene, self.backend)
    }
}

/// The results.
pub struct Report {
    extent: &'static str,
    rounds: [usize; 2],
    pub rows: Vec<Row>,
    errors: Vec<ReplayError>,
    /// What bounds the predictions for adaptive.
    bounds: Vec<(Place, Bounds)>,
}

/// A predicted time and the measured one.
struct ReplayError {
    place: Place,
    workers: usize,
    mode: &'static str,
    /// In milliseconds a frame.
    predicted: f64,
    measured: f64,
}

impl ReplayError {
    fn error(&self) -> f64 {
        self.predicted / self.measured - 1.0
    }
}

impl Report {
    pub fn new(extent: &Extent) -> Self {
        Self { extent: extent.name, rounds: extent.rounds, rows: Vec::new(), errors: Vec::new(), bounds: Vec::new() }
    }

    pub fn add(&mut self, block: &Block<'_>, measured: &Measured) {
        let place = (block.case.kind, block.case.name, block.backend);
        let Measured { modes, object_views } = measured;
        let calibrated = |index: &usize| median(modes[*index].calibration.iter().copied());
        let fixed = (0..Mode::ALL.len()).filter(|&index| Mode::is_fixed(index));
        let best = fixed.min_by(|one, other| calibrated(one).total_cmp(&calibrated(other))).unwrap_or(Mode::SERIAL);
        let against = |base: usize, mode: usize| median(ratios(&modes[base], &modes[mode]));
        for (index, (mode, results)) in Mode::ALL.iter().zip(modes).enumerate() {
            let workers = if mode.is_serial { 1 } else { block.workers };
            // The serial mode is measured again for each number of workers; only the first is reported.
            let is_there =
                |row: &Row| !row.predicted && (row.place(), row.workers, row.mode) == (place, workers, mode.name);
            if self.rows.iter().any(is_there) {
                continue;
            }
            self.rows.push(Row {
                kind: place.0,
                scene: place.1,
                backend: place.2,
                workers,
                mode: mode.name,
                ns_per_object_view: median(results.measured.iter().copied()) * 1e9 / object_views,
                speedup_vs_serial: against(Mode::SERIAL, index),
                ratio_to_best_mode: against(best, index),
                jobs: Some(results.occupancy.jobs()),
                idle_ms: Some(results.occupancy.idle_ms()),
                submit_ms: Some(median(results.submit.iter().copied()) * 1e3),
                predicted: false,
            });
        }
        self.add_predictions(block, measured);
    }

    fn add_predictions(&mut self, block: &Block<'_>, Measured { modes, object_views }: &Measured) {
        let place = (block.case.kind, block.case.name, block.backend);
        for workers in PREDICTED {
            let is_there = |row: &Row| row.predicted && (row.place(), row.workers) == (place, workers);
            if self.rows.iter().any(is_there) {
                continue;
            }
            let time = |index: usize| {
                let workers = if Mode::ALL[index].is_serial { 1 } else { workers };
                modes[index].prediction.of(workers).unwrap_or(f64::NAN)
            };
            let fixed = (0..Mode::ALL.len()).filter(|&index| Mode::is_fixed(index));
            let best = fixed.map(time).fold(f64::INFINITY, f64::min);
            for (index, mode) in Mode::ALL.iter().enumerate().filter(|(_, mode)| !mode.is_serial) {
                self.rows.push(Row {
                    kind: place.0,
                    scene: place.1,
                    backend: place.2,
                    workers,
                    mode: mode.name,
                    ns_per_object_view: time(index) * 1e9 / object_views,
                    speedup_vs_serial: time(Mode::SERIAL) / time(index),
                    ratio_to_best_mode: best / time(index),
                    jobs: None,
                    idle_ms: None,
                    submit_ms: None,
                    predicted: true,
                });
            }
        }
        if let Some(bounds) = modes[Mode::ADAPTIVE].prediction.bounds()
            && !self.bounds.iter().any(|known| known.0 == place)
        {
            self.bounds.push((place, bounds.clone()));
        }
        for (mode, ModeResults { prediction, .. }) in Mode::ALL.iter().zip(modes) {
            let workers = if mode.is_serial { 1 } else { block.workers };
            self.errors.push(ReplayError {
                place,
                workers,
                mode: mode.name,
                predicted: prediction.of(workers).unwrap_or(f64::NAN) * 1e3,
                measured: prediction.measured() * 1e3,
            });
        }
    }

    /// Prints the tables.
    pub fn print(&self) {
        let [noop, adapter] = self.rounds;
        let note = if self.extent == "full" { "" } else { " (meaningless figures)" };
        print_line!("{} run{note}: medians of {noop} rounds on noop and {adapter} on the adapter", self.extent);
        print_line!("adapter: {}", adapter_name().as_deref().unwrap_or("none"));
        print_line!("ns: record + submit, per object and view that sees it; best: of the fixed modes, in other rounds");
        print_line!("idle: of each worker, while jobs run; speed-ups are medians of the rounds' own ratios\n");
        for kind in Kind::ALL {
            self.print_measured(kind);
        }
        self.print_predicted();
        self.print_bounds();
        self.print_errors();
        self.targets().print("Targets and results on noop with two workers");
    }

    /// Prints the last line, which names the missed targets.
    pub fn print_missed(&self) {
        self.targets().print_missed();
    }

    fn print_measured(&self, kind: Kind) {
        let rows: Vec<_> = self.rows.iter().filter(|row| !row.predicted && row.kind == kind).collect();
        if rows.is_empty() {
            return;
        }
        let what = match kind {
            Kind::Moving => "all objects move, all cameras turn, and nothing is said of it",
            Kind::Ordered => "the same, and objects are ordered by depth",
            Kind::Still => "nothing moves, and draw lists are kept",
        };
        print_line!("{}: {what}\n", kind.name());
        let mut table = Table::new(&[
            "scene",
            "backend",
            "workers",
            "mode",
            "ns",
            "speed-up on serial",
            "of the best mode",
            "jobs",
            "idle, ms",
            "submit, ms",
        ]);
        for row in rows {
            let idle = row.idle_ms.iter().flatten().map(|idle| format!("{idle:.3}"));
            table.row([
                row.scene.to_owned(),
                row.backend.name().to_owned(),
                row.workers.to_string(),
                row.mode.to_owned(),
                format!("{:.1}", row.ns_per_object_view),
                format!("{:.2}", row.speedup_vs_serial),
                format!("{:.3}", row.ratio_to_best_mode),
                format!("{:.0}", row.jobs.unwrap_or(f64::NAN)),
                idle.collect::<Vec<_>>().join(" "),
                format!("{:.3}", row.submit_ms.unwrap_or(f64::NAN)),
            ]);
        }
        table.print();
    }

    fn print_predicted(&self) {
        print_line!("Predicted speed-up on serial, adaptive and the best fixed mode\n");
        let counts = PREDICTED.map(|workers| format!("{workers} workers"));
        let headings: Vec<_> =
            ["kind", "scene", "backend"].into_iter().chain(counts.iter().map(String::as_str)).collect();
        let mut table = Table::new(&headings);
        for row in self.rows.iter().filter(|row| row.predicted && row.workers == PREDICTED[0] && row.mode == "adaptive")
        {
            let cell = |workers| {
                let of = |other: &&Row| other.predicted && (other.place(), other.workers) == (row.place(), workers);
                let adaptive = self.rows.iter().filter(of).find(|row| row.mode == "adaptive");
                let is_fixed =
                    |row: &&Row| Mode::ALL.iter().position(|mode| mode.name == row.mode).is_some_and(Mode::is_fixed);
                let fixed = self.rows.iter().filter(of).filter(is_fixed);
                let best = fixed.map(|row| row.speedup_vs_serial).fold(1.0, f64::max);
                format!("{:.2} / {best:.2}", adaptive.map_or(f64::NAN, |row| row.speedup_vs_serial))
            };
            let [four, eight, sixteen, thirty_two, sixty_four] = PREDICTED.map(cell);
            let [kind, scene, backend] = [row.kind.name(), row.scene, row.backend.name()].map(str::to_owned);
            table.row([kind, scene, backend, four, eight, sixteen, thirty_two, sixty_four]);
        }
        table.print();
    }

    fn print_bounds(&self) {
        print_line!("What adaptive would save on {} predicted workers without one of its parts\n", bounds::WORKERS);
        let mut table = Table::new(&["kind", "scene", "backend", "part", "µs", "of the frame, %"]);
        for ((kind, scene, backend), bounds) in &self.bounds {
            for (part, seconds, share) in bounds.parts() {
                let [kind, scene, backend, part] = [kind.name(), scene, backend.name(), part].map(str::to_owned);
                table.row([
                    kind,
                    scene,
                    backend,
                    part,
                    format!("{:.1}", seconds * 1e6),
                    format!("{:.0}", share * 100.0),
                ]);
            }
        }
        table.print();
    }

    fn print_errors(&self) {
        print_line!("The replay for the actual number of workers\n");
        let headings = ["kind", "scene", "backend", "workers", "mode", "predicted ms", "measured ms", "error %"];
        let mut table = Table::new(&headings);
        for error in &self.errors {
            let (kind, scene, backend) = error.place;
            let [kind, scene, backend, mode] = [kind.name(), scene, backend.name(), error.mode].map(str::to_owned);
            table.row([
                kind,
                scene,
                backend,
                error.workers.to_string(),
                mode,
                format!("{:.4}", error.predicted),
                format!("{:.4}", error.measured),
                format!("{:.1}", error.error() * 100.0),
            ]);
        }
        table.print();
    }

    /// The targets, on `noop` with two workers, or with those that are predicted.
    fn targets(&self) -> Targets {
        let mut targets = Targets::new();
        let is_of = |row: &&Row, workers, predicted| {
            (row.backend, row.workers, row.mode, row.predicted) == (BackendName::Noop, workers, "adaptive", predicted)
        };
        for row in self.rows.iter().filter(|row| is_of(row, 2, false)) {
            let bound = if ["small", "interrupted"].contains(&row.scene) { 0.90 } else { 0.97 };
            let place = format!("{}, {}", row.scene, row.kind.name());
            targets.at_least(format!("{place}: adaptive, of the best fixed mode"), bound, row.ratio_to_best_mode);
            targets.at_least(format!("{place}: adaptive, of serial"), 0.97, row.speedup_vs_serial);
        }
        let is_large = |row: &&Row| is_of(row, bounds::WORKERS, true) && row.scene.ends_with("-large");
        for row in self.rows.iter().filter(is_large).filter(|row| row.kind == Kind::Moving) {
            let figure = format!("{}, moving: adaptive on 16 predicted workers, of serial", row.scene);
            targets.at_least(figure, 10.0, row.speedup_vs_serial);
        }
        let is_predictable =
            |error: &&ReplayError| error.place.2 == BackendName::Noop && error.place.1 != "interrupted";
        let errors = self.errors.iter().filter(is_predictable).map(|error| error.error().abs());
        if let Some(worst) = errors.max_by(f64::total_cmp) {
            targets.at_most("the replay's worst error, all but interrupted", 0.05, worst);
        }
        targets
    }

    /// # Errors
    /// Returns an error if a file cannot be written.
    pub fn write(&self) -> Result<(), Box<dyn Error>> {
        results::write_json("load_balance.json", &self.rows)?;
        charts::draw(&results::file("load_balance.svg")?, &self.rows)
    }
}

/// The ratio of two modes' times in each round.
fn ratios<'a>(one: &'a ModeResults, other: &'a ModeResults) -> impl Iterator<Item = f64> + 'a {
    one.measured.iter().zip(&other.measured).map(|(one, other)| one / other)
}
