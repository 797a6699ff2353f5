//! The results, as a table, CSV and a chart.

use std::path::Path;

use drawloom_benches::backends::{BackendName, adapter_name};
use drawloom_benches::chart::{self, HorizontalBars, Lines, Panel};
use drawloom_benches::table::Table;
use serde::Serialize;

use crate::contender::Failure;
use crate::measure::Extent;

/// A contender in a scene. Times are medians, in microseconds a frame; ratios are to Drawloom.
#[derive(Serialize)]
pub struct Row {
    pub scene: &'static str,
    pub objects: usize,
    pub cameras: usize,
    pub contender: &'static str,
    /// Objects drawn in a frame, over all cameras.
    pub drawn_objects: usize,
    /// Until submit returns.
    pub submitted_us: f64,
    pub submitted_ratio: f64,
    /// Until the device is idle.
    pub drawn_us: f64,
    pub drawn_ratio: f64,
}

/// The results.
pub struct Report {
    extent: Extent,
    pub rows: Vec<Row>,
}

impl Report {
    pub fn new(extent: Extent) -> Self {
        Self { extent, rows: Vec::new() }
    }

    pub fn print(&self) {
        let Extent { backend, threads, is_quick, bursts, frames } = self.extent;
        let note = if is_quick { ", a quick run (meaningless figures)" } else { "" };
        println!("{}{note}: medians of {bursts} bursts of {frames} frames, {threads} threads", self.backend_name());
        println!("submitted: µs a frame, from the motion of the objects until submit returns");
        println!("drawn: the same until the device is idle");
        println!("÷: the median of the rounds' ratios to drawloom\n");
        let headings =
            ["scene", "objects", "cameras", "contender", "drawn objects", "submitted", "÷", "drawn", "÷ drawn"];
        let mut table = Table::new(&headings[..if backend == BackendName::Noop { 7 } else { 9 }]);
        for row in &self.rows {
            let cells = [
                row.scene.to_owned(),
                chart::grouped(row.objects as f64),
                row.cameras.to_string(),
                row.contender.to_owned(),
                chart::grouped(row.drawn_objects as f64),
                chart::grouped(row.submitted_us),
                format!("{:.2}", row.submitted_ratio),
            ];
            match backend {
                BackendName::Noop => table.row(cells),
                BackendName::Adapter => {
                    let [scene, objects, cameras, contender, drawn, submitted, ratio] = cells;
                    let (time, drawn_ratio) = (chart::grouped(row.drawn_us), format!("{:.2}", row.drawn_ratio));
                    table.row([scene, objects, cameras, contender, drawn, submitted, ratio, time, drawn_ratio]);
                }
            }
        }
        table.print();
    }

    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<(), Failure> {
        let mut writer = csv::Writer::from_path(path)?;
        self.rows.iter().try_for_each(|row| writer.serialize(row))?;
        writer.flush()?;
        println!("{} written", path.display());
        Ok(())
    }

    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn draw(&self, path: &Path) -> Result<(), Failure> {
        let mut panels = Vec::new();
        let objects: Vec<_> = self.rows.iter().filter(|row| row.scene == "objects").collect();
        if let Some(lines) = self.lines(&objects) {
            panels.push(Panel::Lines(lines));
        }
        for scene in ["record", "ecs"] {
            let rows: Vec<_> = self.rows.iter().filter(|row| row.scene == scene).collect();
            let Some(&first) = rows.first() else { continue };
            let (objects, cameras) = (chart::grouped(first.objects as f64), first.cameras);
            let plural = if cameras == 1 { "" } else { "s" };
            let title = format!("µs a frame, {scene}: {cameras} camera{plural} × {objects} objects");
            let bars = rows.iter().map(|row| (row.contender.to_owned(), self.time(row), color(row.contender)));
            panels.push(Panel::HorizontalBars(HorizontalBars { title, bars: bars.collect() }));
        }
        chart::draw(path, &panels)
    }

    /// A line per contender, if there are several numbers of objects.
    fn lines(&self, rows: &[&Row]) -> Option<Lines> {
        let mut names: Vec<_> = rows.iter().map(|row| row.contender).collect();
        names.sort_by_key(|name| color(name));
        names.dedup();
        let points = |name: &str| {
            let of = rows.iter().filter(|row| row.contender == name);
            (name.to_owned(), of.map(|row| (row.objects as f64, self.time(row))).collect::<Vec<_>>())
        };
        let series: Vec<_> = names.into_iter().map(points).collect();
        let ticks: Vec<_> = series.first()?.1.iter().map(|point| point.0).collect();
        let title = format!("µs a frame, objects: one camera, {}", self.backend_name());
        let (x_label, first_color) = ("objects".to_owned(), 1);
        (ticks.len() > 1).then_some(Lines { title, x_label, series, first_color, ticks })
    }

    /// The time that the chart shows.
    fn time(&self, row: &Row) -> f64 {
        self.extent.backend.of([row.submitted_us, row.drawn_us])
    }

    fn backend_name(&self) -> String {
        match self.extent.backend {
            BackendName::Noop => "wgpu's no-op backend".to_owned(),
            BackendName::Adapter => adapter_name().unwrap_or_else(|| "no adapter".to_owned()),
        }
    }
}

/// The colour of a contender's bars, and the order of the lines, which have the same colours.
fn color(contender: &str) -> usize {
    match contender {
        "bevy" => 1,
        "bevy, device culling" => 2,
        "bevy, pipelined" => 3,
        _ => 4,
    }
}
