//! The results, as a table and as JSON.

use std::error::Error;
use std::path::Path;

use drawloom::scene::Camera;
use drawloom_output::{OutputFile, path_text, print_line};
use serde::{Deserialize, Serialize};

use crate::Failure;
use crate::errors::{self, KnobError};
use crate::measure::Measurements;
use crate::settings::{Knob, Setting};
use crate::subject::Subject;

/// The results on one scene.
pub struct Results {
    scene: String,
    backend: String,
    pub entries: Vec<Entry>,
}

/// The results of one setting of a knob.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Entry {
    pub scene: String,
    pub backend: String,
    pub knob: String,
    pub setting: String,
    /// From the hand-over of the scene to the return of submit, in nanoseconds: the mean frame of the median round.
    pub cpu_ns: u64,
    /// Until the frame is drawn, in nanoseconds: the mean frame of the median round.
    pub frame_ns: u64,
    /// In the unit of the metric; `None` if the knob affects nothing in the scene.
    pub error: Option<f64>,
    pub metric: String,
    /// The bound of the error, if known.
    pub bound: Option<f64>,
    /// The oracle that the error is measured against.
    pub oracle: String,
    /// Distance of the picture from that of `Configuration::exact`: 0 to 1.
    pub rmse: f64,
    /// Similarity of the picture to that of `Configuration::exact`: 1 if they are equal.
    pub mssim: f64,
    /// Distance of the picture from the f64 reference: 0 to 1.
    pub rmse_from_reference: f64,
    /// Similarity of the picture to the f64 reference: 1 if they are equal.
    pub mssim_from_reference: f64,
    /// Visible distance of the picture from the f64 reference; `None` without the feature `flip`.
    pub flip_from_reference: Option<f64>,
    /// Whether it is on the front: see [`mark_front`].
    pub pareto: bool,
}

impl Entry {
    /// Whether the error exceeds its bound.
    pub fn exceeds(&self) -> bool {
        // NaN exceeds every bound.
        self.error.zip(self.bound).is_some_and(|(error, bound)| error > bound || error.is_nan())
    }

    pub fn frame_ms(&self) -> f64 {
        self.frame_ns as f64 * 1e-6
    }
}

impl Results {
    /// # Errors
    /// Returns an error if the error of a knob cannot be computed.
    pub fn new(
        scene_name: String,
        backend: &str,
        subject: &Subject,
        path: &[Camera],
        settings: &[Setting],
        measurements: &Measurements,
    ) -> Result<Self, Failure> {
        let mut entries = Vec::new();
        for (setting, measured) in settings.iter().zip(&measurements.settings) {
            let KnobError { error, metric, bound, oracle } =
                errors::of(setting, subject, path, measurements, measured)?;
            entries.push(Entry {
                scene: scene_name.clone(),
                backend: backend.to_owned(),
                knob: setting.knob.name().to_owned(),
                setting: setting.name.clone(),
                cpu_ns: measured.cpu().as_nanos() as u64,
                frame_ns: measured.frame().as_nanos() as u64,
                error,
                metric: metric.to_owned(),
                bound,
                oracle: oracle.to_owned(),
                rmse: measured.from_exact.rmse,
                mssim: measured.from_exact.mssim,
                rmse_from_reference: measured.from_reference.rmse,
                mssim_from_reference: measured.from_reference.mssim,
                flip_from_reference: measured.from_reference.flip,
                pareto: false,
            });
        }
        mark_front(&mut entries);
        Ok(Self { scene: scene_name, backend: backend.to_owned(), entries })
    }

    pub fn scene(&self) -> &str {
        &self.scene
    }

    pub fn backend(&self) -> &str {
        &self.backend
    }

    /// The entries with errors that exceed their bounds.
    pub fn exceeded(&self) -> impl Iterator<Item = &Entry> {
        self.entries.iter().filter(|entry| entry.exceeds())
    }

    /// The knobs that were measured, in the order of reports.
    pub fn knobs(&self) -> impl Iterator<Item = Knob> {
        Knob::all().filter(|knob| self.entries.iter().any(|entry| entry.knob == knob.name()))
    }

    /// The knobs that change nothing in the scene, whatever their setting, and those that were not measured.
    pub fn without_effect(&self) -> impl Iterator<Item = Knob> {
        let has_error =
            |knob: &Knob| self.entries.iter().any(|entry| entry.knob == knob.name() && entry.error.is_some());
        Knob::all().filter(move |knob| !has_error(knob))
    }

    /// The Pareto front, from the fastest to the most accurate.
    pub fn front(&self) -> Vec<&Entry> {
        let mut front: Vec<_> = self.entries.iter().filter(|entry| entry.pareto).collect();
        front.sort_by_key(|entry| entry.frame_ns);
        front
    }

    /// Prints the table, in Markdown, and the front.
    pub fn print(&self) {
        print_line!("{}, {}; each knob alone, all else as in exact\n", self.scene, self.backend);
        print_line!(
            "| knob | setting | CPU, ms | frame, ms | of exact | error | bound | metric | RMSE × 255 | MSSIM |"
        );
        print_line!("| --- | --- | --: | --: | --: | --: | --: | --- | --: | --: |");
        let exact = self.entries.first().map_or(1.0, Entry::frame_ms);
        for entry in &self.entries {
            let number = |value: Option<f64>| value.map_or_else(|| String::from("–"), short);
            print_line!(
                "| {} | {} | {:.2} | {:.2} | {:.2} | {} | {} | {} | {:.3} | {:.4} |",
                entry.knob,
                entry.setting,
                entry.cpu_ns as f64 * 1e-6,
                entry.frame_ms(),
                entry.frame_ms() / exact,
                number(entry.error),
                number(entry.bound),
                entry.metric,
                entry.rmse * 255.0,
                entry.mssim,
            );
        }
        print_line!("\nPareto front, by the frame's time and RMSE from the reference in f64:\n");
        for entry in self.front() {
            print_line!(
                "{:>8.2} ms  RMSE {:.3}/255  MSSIM {:.4}  {}: {}",
                entry.frame_ms(),
                entry.rmse_from_reference * 255.0,
                entry.mssim_from_reference,
                entry.knob,
                entry.setting
            );
        }
        print_line!();
    }

    /// Writes the entries, and keeps those of other scenes and backends in the file.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, parsed or written.
    pub fn write(&self, path: &Path) -> Result<(), Failure> {
        let mut all: Vec<Entry> = match std::fs::read(path) {
            Ok(bytes) => serde_json::from_slice(&bytes).map_err(|error| with_path(path, &error))?,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Vec::new(),
            Err(error) => return Err(with_path(path, &error)),
        };
        all.retain(|entry| entry.scene != self.scene || entry.backend != self.backend);
        all.extend(self.entries.iter().cloned());
        OutputFile::new(path)?.write_all(serde_json::to_string_pretty(&all)? + "\n")?;
        print_line!("{} written", path_text(path));
        Ok(())
    }
}

fn with_path(path: &Path, error: &dyn Error) -> Failure {
    format!("{}: {error}", path_text(path)).into()
}

/// Marks the Pareto front: `exact`, and then, by increasing distance from the reference, each entry that is at least an
/// eighth faster than all marked before it. Smaller differences of times are noise.
fn mark_front(entries: &mut [Entry]) {
    let mut order: Vec<_> = (0..entries.len()).collect();
    let distance = |entry: usize| entries[entry].rmse_from_reference;
    // `exact`, which is the first entry, comes first: another entry can be nearer by rounding only.
    order.sort_by(|&one, &other| (one > 0).cmp(&(other > 0)).then(distance(one).total_cmp(&distance(other))));
    let mut fastest: Option<u64> = None;
    for index in order {
        let entry = &mut entries[index];
        entry.pareto = fastest.is_none_or(|fastest| entry.frame_ns * 8 < fastest * 7);
        if entry.pareto {
            fastest = Some(entry.frame_ns);
        }
    }
}

/// A number with three digits.
pub fn short(value: f64) -> String {
    match value.abs() {
        0.0 => String::from("0"),
        size if !(1e-3..1e4).contains(&size) => format!("{value:.1e}"),
        size if size >= 100.0 => format!("{value:.0}"),
        size if size >= 1.0 => format!("{value:.2}"),
        _ => format!("{value:.4}"),
    }
}

/// The entries of one knob, followed by `exact`.
pub fn of_knob(entries: &[Entry], knob: Knob) -> Vec<&Entry> {
    let own = entries.iter().filter(|entry| entry.knob == knob.name() && entry.setting != "exact");
    own.chain(entries.first()).collect()
}
