//! The chart: the speed-up of each mode on each scene, and the predicted speed-up with more workers.

use std::error::Error;
use std::path::Path;

use drawloom_benches::backends::BackendName;
use drawloom_benches::chart::{self, Bars, Lines, Panel};

use crate::mode::Mode;
use crate::prediction::PREDICTED;
use crate::report::Row;
use crate::scenes::{self, Kind};

/// # Errors
/// Returns an error if the file cannot be written.
pub fn draw(path: &Path, rows: &[Row]) -> Result<(), Box<dyn Error>> {
    let mut panels = Vec::new();
    for (&backend, kind) in BackendName::ALL.iter().flat_map(|backend| Kind::ALL.map(|kind| (backend, kind))) {
        let rows: Vec<_> = rows.iter().filter(|row| (row.backend, row.kind) == (backend, kind)).collect();
        if rows.is_empty() {
            continue;
        }
        let max_workers = rows.iter().filter(|row| !row.predicted).map(|row| row.workers).max().unwrap_or(1);
        panels.push(Panel::Bars(measured(&rows, (kind, backend), max_workers)));
        panels.push(Panel::Lines(predicted(&rows, (kind, backend), max_workers)));
    }
    chart::draw(path, &panels)
}

fn names(rows: &[&Row]) -> impl Iterator<Item = &'static str> {
    scenes::NAMES.into_iter().filter(|&name| rows.iter().any(|row| row.scene == name))
}

fn measured(rows: &[&Row], (kind, backend): (Kind, BackendName), workers: usize) -> Bars {
    let modes = &Mode::ALL;
    let speed_up = |scene: &str, mode: &Mode| {
        let workers = if mode.is_serial { 1 } else { workers };
        let matches =
            |row: &&&Row| (row.scene, row.mode, row.workers, row.predicted) == (scene, mode.name, workers, false);
        rows.iter().find(matches).map_or(f64::NAN, |row| row.speedup_vs_serial)
    };
    let group = |scene: &'static str| (scene.to_owned(), modes.iter().map(|mode| speed_up(scene, mode)).collect());
    Bars {
        title: format!("{}: speed-up on one thread, {workers} workers, {}", kind.name(), backend.name()),
        series: modes.iter().map(|mode| mode.name.to_owned()).collect(),
        groups: names(rows).map(group).collect(),
        marks: Vec::new(),
        mark_name: String::new(),
        line: 1.0,
    }
}

fn predicted(rows: &[&Row], (kind, backend): (Kind, BackendName), workers: usize) -> Lines {
    let line = |scene: &'static str| {
        let adaptive = |workers: usize, predicted| {
            let matches = |row: &&&Row| {
                (row.scene, row.mode, row.workers, row.predicted) == (scene, "adaptive", workers, predicted)
            };
            rows.iter().find(matches).map(|row| (workers as f64, row.speedup_vs_serial))
        };
        let measured = (2..=workers).filter_map(|count| adaptive(count, false));
        let beyond = PREDICTED.into_iter().filter(|&count| count > workers).filter_map(|count| adaptive(count, true));
        (scene.to_owned(), [(1.0, 1.0)].into_iter().chain(measured).chain(beyond).collect())
    };
    Lines {
        title: format!(
            "{}: the same for adaptive by number of workers, {}; more than {workers} predicted",
            kind.name(),
            backend.name()
        ),
        x_label: "workers".to_owned(),
        series: names(rows).map(line).collect(),
        first_color: 1,
        ticks: [1, 2].into_iter().chain(PREDICTED).map(|workers| workers as f64).collect(),
    }
}
