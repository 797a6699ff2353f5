//! The results, as a table, CSV and a chart.

use std::path::Path;

use drawloom_benches::backends::{BackendName, adapter_name};
use drawloom_benches::chart::{self, HorizontalBars, Lines, Panel};
use drawloom_benches::statistics::{median, percentile};
use drawloom_benches::table::Table;
use drawloom_output::{OutputFile, print_line};

use crate::contender::{Contender, Failure, FrameTime, PARTS};
use crate::layout::Layout;
use crate::measure::Extent;

/// A contender in a scene. Times are medians over frames, in microseconds.
#[derive(Clone)]
pub struct Row {
    scene: &'static str,
    objects: usize,
    cameras: usize,
    contender: &'static str,
    color: usize,
    /// [`FrameTime::submitted`], and its first and third quartile.
    submitted_us: f64,
    quartiles_us: [f64; 2],
    /// [`FrameTime::parts`].
    parts_us: Option<[f64; 3]>,
    /// The median divided by Drawloom's.
    submitted_ratio: f64,
    /// [`FrameTime::drawn`].
    drawn_us: f64,
    /// `None` where frames overlap: then `drawn_us` is no latency.
    drawn_ratio: Option<f64>,
}

impl Row {
    pub fn new(layout: &Layout, contender: &dyn Contender, samples: &[FrameTime]) -> Self {
        let submitted = || samples.iter().map(|sample| sample.submitted);
        let parts: Vec<_> = samples.iter().filter_map(|sample| sample.parts).collect();
        let part = |index: usize| median(parts.iter().map(|parts| parts[index])) * 1e6;
        Self {
            scene: layout.name,
            objects: layout.objects,
            cameras: layout.cameras,
            contender: contender.name(),
            color: contender.color(),
            submitted_us: median(submitted()) * 1e6,
            quartiles_us: [25, 75].map(|percent| percentile(percent, submitted()) * 1e6),
            parts_us: (!parts.is_empty()).then(|| [0, 1, 2].map(part)),
            submitted_ratio: 1.0,
            drawn_us: median(samples.iter().map(|sample| sample.drawn)) * 1e6,
            drawn_ratio: None,
        }
    }

    /// Sets the ratios to Drawloom, which was measured beside this contender.
    pub fn compare(&mut self, drawloom: &Self) {
        self.submitted_ratio = self.submitted_us / drawloom.submitted_us;
        self.drawn_ratio = self.parts_us.map(|_| self.drawn_us / drawloom.drawn_us);
    }
}

/// The columns in CSV. Each row says on what it was measured.
const COLUMNS: [&str; 17] = [
    "backend",
    "adapter",
    "threads",
    "is_quick",
    "scene",
    "objects",
    "cameras",
    "contender",
    "submitted_us",
    "first_quartile_us",
    "third_quartile_us",
    "first_part_us",
    "second_part_us",
    "third_part_us",
    "submitted_ratio",
    "drawn_us",
    "drawn_ratio",
];

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
        print_line!("{}{note}: medians of {bursts} × {frames} frames, {threads} threads", self.backend_name());
        print_line!(
            "submitted: µs a frame, from the motion until submit returns, and its quartiles; its parts: {PARTS:?}"
        );
        print_line!("bevy-pipelined: µs from one submit to the next, medians of {bursts} bursts");
        if backend == BackendName::Adapter {
            print_line!("drawn: µs until the device is idle; pipelined, the mean time of the frames of a burst");
        }
        print_line!("÷: the median divided by drawloom's\n");
        let [first, second, third] = PARTS;
        let headings =
            ["scene", "objects", "cameras", "contender", "submitted", "quartiles", first, second, third, "÷"];
        let drawn = ["drawn", "÷ drawn"];
        let columns = headings.len() + backend.of([0, drawn.len()]);
        let mut table = Table::new(&[&headings[..], &drawn].concat()[..columns]);
        for row in &self.rows {
            let [low, high] = row.quartiles_us.map(chart::grouped);
            let parts = row.parts_us.map_or_else(Default::default, |parts| parts.map(chart::grouped));
            let [first, second, third] = parts;
            let cells = [
                row.scene.to_owned(),
                chart::grouped(row.objects as f64),
                row.cameras.to_string(),
                row.contender.to_owned(),
                chart::grouped(row.submitted_us),
                format!("{low}–{high}"),
                first,
                second,
                third,
                format!("{:.2}", row.submitted_ratio),
            ];
            match backend {
                BackendName::Noop => table.row(cells),
                BackendName::Adapter => {
                    let [a, b, c, d, e, f, g, h, i, j] = cells;
                    let ratio = row.drawn_ratio.map_or_else(String::new, |ratio| format!("{ratio:.2}"));
                    table.row([a, b, c, d, e, f, g, h, i, j, chart::grouped(row.drawn_us), ratio]);
                }
            }
        }
        table.print();
    }

    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<(), Failure> {
        let Extent { backend, threads, is_quick, .. } = self.extent;
        let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
        writer.write_record(COLUMNS)?;
        for row in &self.rows {
            let run = (backend.name(), self.backend_name(), threads, is_quick);
            let what = (row.scene, row.objects, row.cameras, row.contender);
            let parts = row.parts_us.map_or([None; 3], |parts| parts.map(Some));
            let submitted = (row.submitted_us, row.quartiles_us, parts, row.submitted_ratio);
            writer.serialize((run, what, submitted, row.drawn_us, row.drawn_ratio))?;
        }
        OutputFile::new(path)?.write_all(writer.into_inner()?)?;
        print_line!("{} written", path.display());
        Ok(())
    }

    /// Draws the scenes of several sizes as lines, and the others as bars.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn draw(&self, path: &Path) -> Result<(), Failure> {
        let panel = |rows: &[Row]| {
            let has_sizes = rows.iter().any(|row| row.objects != rows[0].objects);
            if has_sizes { Panel::Lines(self.lines(rows)) } else { Panel::HorizontalBars(self.bars(rows)) }
        };
        let panels: Vec<_> = self.rows.chunk_by(|one, other| one.scene == other.scene).map(panel).collect();
        chart::draw(path, &panels)
    }

    /// The contenders in a scene of one size.
    fn bars(&self, rows: &[Row]) -> HorizontalBars {
        let Row { scene, objects, cameras, .. } = rows[0];
        let plural = if cameras == 1 { "" } else { "s" };
        let title =
            format!("µs a frame, {scene}: {cameras} camera{plural} × {} objects", chart::grouped(objects as f64));
        let bars = rows.iter().map(|row| (row.contender.to_owned(), self.time(row), row.color));
        HorizontalBars { title, bars: bars.collect() }
    }

    /// A line per contender.
    fn lines(&self, rows: &[Row]) -> Lines {
        let scene = rows[0].scene;
        let mut contenders: Vec<_> = rows.iter().map(|row| (row.color, row.contender)).collect();
        contenders.sort_unstable();
        contenders.dedup();
        let points = |&(color, name): &(usize, &str)| {
            let of = rows.iter().filter(|row| row.color == color);
            (name.to_owned(), of.map(|row| (row.objects as f64, self.time(row))).collect::<Vec<_>>())
        };
        let series: Vec<_> = contenders.iter().map(points).collect();
        let ticks = series[0].1.iter().map(|point| point.0).collect();
        let title = format!("µs a frame, {scene}: one camera, {}", self.backend_name());
        let (x_label, first_color) = ("objects".to_owned(), contenders[0].0);
        Lines { title, x_label, series, first_color, ticks }
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
