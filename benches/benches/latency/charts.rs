//! The first table as a chart.

use std::path::Path;

use drawloom_benches::chart::{self, Bars, Failure, Panel};

use crate::contender::Kind;
use crate::schemes::Row;

/// Draws a panel for the time of a frame, and one for its latency.
pub fn draw(path: &Path, rows: &[Row]) -> Result<(), Failure> {
    let panel = |title: &str, value: fn(&Row) -> f64| {
        let groups = rows.chunks(Kind::ALL.len());
        let groups: Vec<_> =
            groups.map(|rows| (rows[0].device.clone(), rows.iter().map(value).collect::<Vec<_>>())).collect();
        Panel::Bars(Bars {
            title: title.to_owned(),
            series: Kind::ALL.map(|kind| kind.name().to_owned()).to_vec(),
            marks: Vec::new(),
            groups,
            mark_name: String::new(),
            line: 0.0,
        })
    };
    let frame = panel(
        "The time of a frame in ms, by the time that the device takes for it; the engine's update takes 2 ms",
        |row| row.frame_ms,
    );
    let latency = panel("The time in ms from the input to the picture", |row| row.latency_ms);
    chart::draw(path, &[frame, latency])
}
