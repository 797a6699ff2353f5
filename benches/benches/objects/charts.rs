//! The chart: the speed-up of two workers, and frames per second.

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
        let of = |instancing| rows.iter().filter(move |row| row.backend == backend && row.instancing == instancing);
        let (off, on): (Vec<_>, Vec<_>) = (of(false).collect(), of(true).collect());
        if !off.is_empty() {
            panels.push(Panel::Bars(ratios(backend, &off)));
            panels.push(Panel::Lines(frames(backend, &off, &on)));
        }
    }
    chart::draw(path, &panels)
}

/// Without instancing: the ratios with it are far greater.
fn ratios(backend: BackendName, off: &[&Row]) -> Bars {
    Bars {
        title: format!("Multi against single by objects, instancing off, {}", backend.name()),
        series: ["L 6, on two cores of 2009", "1 worker, cached", "2 workers, direct", "2 workers"]
            .map(str::to_owned)
            .into(),
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

fn frames(backend: BackendName, off: &[&Row], on: &[&Row]) -> Lines {
    let line = |name: &str, rows: &[&Row], frames: fn(&Row) -> f64| {
        (name.to_owned(), rows.iter().map(|row| (row.objects as f64, frames(row))).collect())
    };
    Lines {
        title: format!("Frames a second, {}, without what the device takes", backend.name()),
        x_label: "objects".to_owned(),
        series: vec![
            line("single", off, |row| row.single_fps),
            line("multi", off, |row| row.multi_fps),
            line("multi, instanced", on, |row| row.multi_fps),
        ],
        first_color: 0,
        ticks: off.iter().map(|row| row.objects as f64).collect(),
    }
}
