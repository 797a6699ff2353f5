//! The chart: the speed-up of each number of workers, and frames per second.

use std::error::Error;
use std::path::Path;

use drawloom_benches::backends::BackendName;
use drawloom_benches::chart::{self, Bars, Lines, Panel};

use crate::scenario::Row;

/// # Errors
/// Returns an error if the file cannot be written.
pub fn draw(path: &Path, rows: &[Row]) -> Result<(), Box<dyn Error>> {
    let mut panels = Vec::new();
    for &backend in BackendName::ALL {
        let of_backend: Vec<_> = rows.iter().filter(|row| row.backend == backend).collect();
        let mut workers: Vec<_> = of_backend.iter().map(|row| row.workers).collect();
        workers.sort_unstable();
        workers.dedup();
        for &workers in &workers {
            panels.push(Panel::Bars(ratios(backend, workers, &of_backend)));
        }
        if !workers.is_empty() {
            panels.push(Panel::Lines(frames(backend, &workers, &of_backend)));
        }
    }
    chart::draw(path, &panels)
}

/// Without instancing: the ratios with it are far greater.
fn ratios(backend: BackendName, workers: usize, rows: &[&Row]) -> Bars {
    let off: Vec<_> = rows.iter().filter(|row| row.workers == workers && !row.instancing).collect();
    Bars {
        title: format!("Multi against single by objects, instancing off, {}", backend.name()),
        series: vec![
            "L 6, on two cores of 2009".to_owned(),
            "1 worker, cached".to_owned(),
            format!("{workers} workers, direct"),
            format!("{workers} workers"),
        ],
        groups: off.iter().map(|row| (chart::grouped(row.objects as f64), bars(row))).collect(),
        marks: off.iter().map(|row| row.ceiling).collect(),
        mark_name: "ceiling".to_owned(),
        line: 1.0,
    }
}

/// In the order of the series.
fn bars(row: &Row) -> Vec<f64> {
    let [cached, direct] = [row.cached_ratio, row.direct_ratio].map(|ratio| ratio.unwrap_or(f64::NAN));
    vec![paper_ratio(row.objects), cached, direct, row.ratio]
}

/// The ratio that L reports. For fewer objects L says that two cores were slightly worse than one.
fn paper_ratio(objects: usize) -> f64 {
    match objects {
        1_006 => 119.0 / 71.0,
        2_006 => 1.71,
        _ => f64::NAN,
    }
}

fn frames(backend: BackendName, workers: &[usize], rows: &[&Row]) -> Lines {
    let line = |name: String, workers: usize, instancing: bool, frames: fn(&Row) -> f64| {
        let rows = rows.iter().filter(|row| (row.workers, row.instancing) == (workers, instancing));
        (name, rows.map(|row| (row.objects as f64, frames(row))).collect::<Vec<_>>())
    };
    let mut series = vec![line("single".to_owned(), workers[0], false, |row| row.single_fps)];
    for &workers in workers {
        series.push(line(format!("{workers} workers"), workers, false, |row| row.multi_fps));
    }
    let most = workers[workers.len() - 1];
    series.push(line(format!("{most} workers, instanced"), most, true, |row| row.multi_fps));
    Lines {
        title: format!("Frames a second, {}, without what the device takes", backend.name()),
        x_label: "objects".to_owned(),
        ticks: series[0].1.iter().map(|point| point.0).collect(),
        series,
        first_color: 0,
    }
}
