//! The results, as tables, JSON and a chart.

use std::error::Error;

use drawloom_benches::backends::{BackendName, adapter_name};
use drawloom_benches::results;
use drawloom_benches::statistics::median;
use drawloom_benches::table::Table;
use drawloom_output::print_line;
use serde::Serialize;

use crate::block::{Block, Measured, Times};
use crate::bounds::{self, Bounds};
use crate::mode::Mode;
use crate::prediction::{PREDICTED, Prediction};
use crate::{Extent, charts};

/// A mode on a scene, measured or predicted.
#[derive(Serialize)]
pub struct Row {
    pub scene: &'static str,
    pub backend: BackendName,
    pub workers: usize,
    pub mode: &'static str,
    pub ns_per_object_view: f64,
    pub speedup_vs_serial: f64,
    pub ratio_to_best_mode: f64,
    pub predicted: bool,
}

/// The results.
pub struct Report {
    extent: &'static str,
    rounds: [usize; 2],
    pub rows: Vec<Row>,
    errors: Vec<ReplayError>,
    /// What bounds the predictions for adaptive, by scene and backend.
    bounds: Vec<(&'static str, BackendName, Bounds)>,
    /// On `uneven`, adaptive against per-camera.
    against_per_camera: Vec<(BackendName, usize, f64)>,
}

/// A predicted time and the measured one.
struct ReplayError {
    scene: &'static str,
    backend: BackendName,
    workers: usize,
    mode: &'static str,
    /// In milliseconds a frame.
    predicted: f64,
    measured: f64,
}

impl Report {
    pub fn new(extent: &Extent) -> Self {
        Self {
            extent: extent.name,
            rounds: extent.rounds,
            rows: Vec::new(),
            errors: Vec::new(),
            bounds: Vec::new(),
            against_per_camera: Vec::new(),
        }
    }

    pub fn add(&mut self, block: &Block<'_>, measured: Measured) {
        let Measured { times, predictions } = measured;
        let calibrated = |index: &usize| median(times[*index].calibration.iter().copied());
        let fixed = (0..Mode::ALL.len()).filter(|&index| Mode::is_fixed(index));
        let best = fixed.min_by(|one, other| calibrated(one).total_cmp(&calibrated(other))).unwrap_or(Mode::SERIAL);
        let against = |base: usize, mode: usize| median(ratios(&times[base], &times[mode]));
        let row = |mode: usize, workers| Row {
            scene: block.case.name,
            backend: block.backend,
            workers,
            mode: Mode::ALL[mode].name,
            ns_per_object_view: median(times[mode].measured.iter().copied()) * 1e9 / block.case.object_views() as f64,
            speedup_vs_serial: against(Mode::SERIAL, mode),
            ratio_to_best_mode: against(best, mode),
            predicted: false,
        };
        for (index, mode) in Mode::ALL.iter().enumerate() {
            let workers = if mode.is_serial { 1 } else { block.workers };
            // The serial mode is measured again for each number of workers; only the first is reported.
            let is_there = |row: &Row| {
                !row.predicted
                    && (row.scene, row.backend, row.workers, row.mode)
                        == (block.case.name, block.backend, workers, mode.name)
            };
            if !self.rows.iter().any(is_there) {
                self.rows.push(row(index, workers));
            }
        }
        if block.case.name == "uneven" {
            let ratio = against(Mode::PER_CAMERA, Mode::ADAPTIVE);
            self.against_per_camera.push((block.backend, block.workers, ratio));
        }
        self.add_predictions(block, &predictions);
    }

    fn add_predictions(&mut self, block: &Block<'_>, predictions: &[Prediction]) {
        let (scene, backend, object_views) = (block.case.name, block.backend, block.case.object_views() as f64);
        for workers in PREDICTED {
            if self
                .rows
                .iter()
                .any(|row| row.predicted && (row.scene, row.backend, row.workers) == (scene, backend, workers))
            {
                continue;
            }
            let time = |index: usize| {
                let workers = if Mode::ALL[index].is_serial { 1 } else { workers };
                predictions[index].of(workers).unwrap_or(f64::NAN)
            };
            let fixed = (0..Mode::ALL.len()).filter(|&index| Mode::is_fixed(index));
            let best = fixed.map(time).fold(f64::INFINITY, f64::min);
            for (index, mode) in Mode::ALL.iter().enumerate().filter(|(_, mode)| !mode.is_serial) {
                self.rows.push(Row {
                    scene,
                    backend,
                    workers,
                    mode: mode.name,
                    ns_per_object_view: time(index) * 1e9 / object_views,
                    speedup_vs_serial: time(Mode::SERIAL) / time(index),
                    ratio_to_best_mode: best / time(index),
                    predicted: true,
                });
            }
        }
        if let Some(bounds) = predictions[Mode::ADAPTIVE].bounds()
            && !self.bounds.iter().any(|known| (known.0, known.1) == (scene, backend))
        {
            self.bounds.push((scene, backend, bounds.clone()));
        }
        for (mode, prediction) in Mode::ALL.iter().zip(predictions) {
            let workers = if mode.is_serial { 1 } else { block.workers };
            self.errors.push(ReplayError {
                scene,
                backend,
                workers,
                mode: mode.name,
                predicted: prediction.of(workers).unwrap_or(f64::NAN) * 1e3,
                measured: prediction.measured() * 1e3,
            });
        }
    }

    pub fn print(&self) {
        let [noop, adapter] = self.rounds;
        let note = if self.extent == "full" { "" } else { " (meaningless figures)" };
        print_line!("{} run{note}: medians of {noop} rounds on noop and {adapter} on the adapter", self.extent);
        print_line!("adapter: {}", adapter_name().as_deref().unwrap_or("none"));
        print_line!(
            "ns: record + submit, per object and view that sees it; best: of the fixed modes, in other rounds\n"
        );
        self.print_measured();
        self.print_predicted();
        self.print_bounds();
        self.print_errors();
        self.print_targets();
    }

    fn print_measured(&self) {
        let mut table =
            Table::new(&["scene", "backend", "workers", "mode", "ns", "speed-up on serial", "of the best mode"]);
        for row in self.rows.iter().filter(|row| !row.predicted) {
            table.row([
                row.scene.to_owned(),
                row.backend.name().to_owned(),
                row.workers.to_string(),
                row.mode.to_owned(),
                format!("{:.1}", row.ns_per_object_view),
                format!("{:.2}", row.speedup_vs_serial),
                format!("{:.3}", row.ratio_to_best_mode),
            ]);
        }
        table.print();
    }

    fn print_predicted(&self) {
        print_line!("Predicted speed-up on serial, adaptive and the best fixed mode\n");
        let counts = PREDICTED.map(|workers| format!("{workers} workers"));
        let headings: Vec<_> = ["scene", "backend"].into_iter().chain(counts.iter().map(String::as_str)).collect();
        let mut table = Table::new(&headings);
        for row in self.rows.iter().filter(|row| row.predicted && row.workers == PREDICTED[0] && row.mode == "adaptive")
        {
            let cell = |workers| {
                let of = |other: &&Row| {
                    other.predicted && (other.scene, other.backend, other.workers) == (row.scene, row.backend, workers)
                };
                let adaptive = self.rows.iter().filter(of).find(|row| row.mode == "adaptive");
                let fixed = self.rows.iter().filter(of).filter(|row| row.mode != "adaptive");
                let best = fixed.map(|row| row.speedup_vs_serial).fold(1.0, f64::max);
                format!("{:.2} / {best:.2}", adaptive.map_or(f64::NAN, |row| row.speedup_vs_serial))
            };
            let [four, eight, sixteen, thirty_two, sixty_four] = PREDICTED.map(cell);
            let (scene, backend) = (row.scene.to_owned(), row.backend.name().to_owned());
            table.row([scene, backend, four, eight, sixteen, thirty_two, sixty_four]);
        }
        table.print();
    }

    fn print_bounds(&self) {
        print_line!("What adaptive would save on {} predicted workers without one of its parts\n", bounds::WORKERS);
        let mut table = Table::new(&["scene", "backend", "part", "µs", "of the frame, %"]);
        for (scene, backend, bounds) in &self.bounds {
            for (part, seconds, share) in bounds.parts() {
                let (scene, backend, part) = ((*scene).to_owned(), backend.name().to_owned(), part.to_owned());
                table.row([scene, backend, part, format!("{:.1}", seconds * 1e6), format!("{:.0}", share * 100.0)]);
            }
        }
        table.print();
    }

    fn print_errors(&self) {
        print_line!("The replay for the actual number of workers\n");
        let mut table = Table::new(&["scene", "backend", "workers", "mode", "predicted ms", "measured ms", "error %"]);
        for error in &self.errors {
            table.row([
                error.scene.to_owned(),
                error.backend.name().to_owned(),
                error.workers.to_string(),
                error.mode.to_owned(),
                format!("{:.4}", error.predicted),
                format!("{:.4}", error.measured),
                format!("{:.1}", (error.predicted / error.measured - 1.0) * 100.0),
            ]);
        }
        table.print();
    }

    /// Prints the targets and the results on `noop` with two workers, or with those that are predicted.
    fn print_targets(&self) {
        print_line!("Targets and results on noop with two workers\n");
        let mut table = Table::new(&["figure", "scene", "target", "reached"]);
        let mut target_row = |what: &str, scene: &str, target: f64, reached: f64| {
            let note = if reached >= target { "" } else { ", short" };
            table.row([what.to_owned(), scene.to_owned(), format!("{target:.2}"), format!("{reached:.3}{note}")]);
        };
        let has_target = |row: &&Row| {
            row.backend == BackendName::Noop && row.workers == 2 && row.mode == "adaptive" && !row.predicted
        };
        for row in self.rows.iter().filter(has_target) {
            let target = if ["small", "interrupted"].contains(&row.scene) { 0.90 } else { 0.97 };
            target_row("adaptive, of the best fixed mode", row.scene, target, row.ratio_to_best_mode);
            target_row("adaptive, of serial", row.scene, 0.97, row.speedup_vs_serial);
        }
        for &(_, _, ratio) in
            self.against_per_camera.iter().filter(|block| (block.0, block.1) == (BackendName::Noop, 2))
        {
            target_row("adaptive, of per-camera", "uneven", 1.5, ratio);
        }
        let has_target = |row: &&Row| {
            row.backend == BackendName::Noop
                && row.workers == bounds::WORKERS
                && row.mode == "adaptive"
                && row.predicted
        };
        for row in self.rows.iter().filter(has_target).filter(|row| row.scene.ends_with("-large")) {
            target_row("adaptive on 16 predicted workers, of serial", row.scene, 10.0, row.speedup_vs_serial);
        }
        let has_target = |error: &&ReplayError| error.backend == BackendName::Noop && error.scene != "interrupted";
        let worst = self.errors.iter().filter(has_target).map(|error| (error.predicted / error.measured - 1.0).abs());
        let worst = worst.fold(0.0, f64::max);
        target_row("the replay's worst, 1 − error", "all but interrupted", 0.95, 1.0 - worst);
        table.print();
    }

    /// # Errors
    /// Returns an error if a file cannot be written.
    pub fn write(&self) -> Result<(), Box<dyn Error>> {
        results::write_json("load_balance.json", &self.rows)?;
        charts::draw(&results::file("load_balance.svg")?, &self.rows)
    }
}

/// The ratio of two modes' times in each round.
fn ratios<'a>(one: &'a Times, other: &'a Times) -> impl Iterator<Item = f64> + 'a {
    one.measured.iter().zip(&other.measured).map(|(one, other)| one / other)
}
