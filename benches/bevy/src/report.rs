//! The results, as a table, JSON and a chart.

use std::path::Path;

use drawloom_benches::backends::{BackendName, adapter_name};
use drawloom_benches::chart::{self, HorizontalBars, Lines, Panel, grouped};
use drawloom_benches::statistics::{median, percentile};
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use drawloom_output::{OutputFile, path_text, print_line};
use serde::Serialize;

use crate::contender::{Contender, Failure, FrameTime, PARTS};
use crate::drawloom_side::Drawloom;
use crate::layout::Layout;
use crate::measure::Extent;

/// A contender in a scene. Times are medians over frames, in microseconds.
#[derive(Clone, Serialize)]
pub struct Row {
    scene: &'static str,
    objects: usize,
    cameras: usize,
    contender: &'static str,
    #[serde(skip)]
    color: usize,
    /// What the medians are of: frames, or bursts of a pipelined contender.
    samples: usize,
    /// [`FrameTime::submitted`], and its first and third quartile.
    submitted_us: f64,
    quartiles_us: [f64; 2],
    /// [`FrameTime::parts`].
    parts_us: Option<[f64; 3]>,
    /// Drawloom's median, measured beside this one.
    drawloom_submitted_us: f64,
    /// The median divided by Drawloom's.
    submitted_ratio: f64,
    /// [`FrameTime::drawn`].
    drawn_us: f64,
    drawloom_drawn_us: f64,
    /// `None` where frames overlap: then `drawn_us` is no latency.
    drawn_ratio: Option<f64>,
}

impl Row {
    pub fn new(layout: &Layout, contender: &dyn Contender, samples: &[FrameTime]) -> Self {
        let submitted = || samples.iter().map(|sample| sample.submitted);
        let parts: Vec<_> = samples.iter().filter_map(|sample| sample.parts).collect();
        let part = |index: usize| median(parts.iter().map(|parts| parts[index])) * 1e6;
        let submitted_us = median(submitted()) * 1e6;
        let drawn_us = median(samples.iter().map(|sample| sample.drawn)) * 1e6;
        Self {
            scene: layout.name,
            objects: layout.objects,
            cameras: layout.cameras,
            contender: contender.name(),
            color: contender.color(),
            samples: samples.len(),
            submitted_us,
            quartiles_us: [25, 75].map(|percent| percentile(percent, submitted()) * 1e6),
            parts_us: (!parts.is_empty()).then(|| [0, 1, 2].map(part)),
            drawloom_submitted_us: submitted_us,
            submitted_ratio: 1.0,
            drawn_us,
            drawloom_drawn_us: drawn_us,
            drawn_ratio: None,
        }
    }

    /// Sets the ratios to Drawloom, which was measured beside this contender.
    pub fn compare(&mut self, drawloom: &Self) {
        self.drawloom_submitted_us = drawloom.submitted_us;
        self.submitted_ratio = self.submitted_us / drawloom.submitted_us;
        self.drawloom_drawn_us = drawloom.drawn_us;
        self.drawn_ratio = self.parts_us.map(|_| self.drawn_us / drawloom.drawn_us);
    }
}

/// The results.
pub struct Report {
    extent: Extent,
    picture: u32,
    pub rows: Vec<Row>,
}

/// The JSON file: the results, and on what they were measured.
#[derive(Serialize)]
struct Json<'a> {
    backend: BackendName,
    adapter: String,
    workers: usize,
    is_quick: bool,
    /// Width and height of each picture, in pixels.
    picture: u32,
    rows: &'a [Row],
}

impl Report {
    /// `picture` is the width and height of each picture, in pixels.
    pub fn new(extent: Extent, picture: u32) -> Self {
        Self { extent, picture, rows: Vec::new() }
    }

    pub fn print(&self) {
        let Extent { backend, workers, is_quick, .. } = self.extent;
        let note = if is_quick { ", a quick run (meaningless figures)" } else { "" };
        let picture = self.picture;
        print_line!("{}{note}: medians, {workers} threads, pictures of {picture} × {picture}", self.backend_name());
        print_line!(
            "submitted: µs a frame, from the motion until submit returns, and its quartiles; its parts: {PARTS:?}"
        );
        print_line!("bevy-pipelined: µs from one submit to the next, a sample is a burst");
        match backend {
            BackendName::Noop => {
                print_line!("the device does nothing: what Bevy leaves to it, such as culling, costs nothing here");
            }
            BackendName::Adapter => {
                print_line!("drawn: µs until the device is idle; pipelined, the mean time of the frames of a burst");
            }
        }
        print_line!("beside: drawloom's median, measured in turns with this one; ÷: the median divided by that\n");
        let [first, second, third] = PARTS;
        let headings = [
            "scene",
            "objects",
            "cameras",
            "contender",
            "samples",
            "submitted",
            "quartiles",
            first,
            second,
            third,
            "beside",
            "÷",
        ];
        let drawn = ["drawn", "beside", "÷ drawn"];
        let columns = headings.len() + backend.of([0, drawn.len()]);
        let mut table = Table::new(&[&headings[..], &drawn].concat()[..columns]);
        for row in &self.rows {
            let [low, high] = row.quartiles_us.map(grouped);
            let [first, second, third] = row.parts_us.map_or_else(Default::default, |parts| parts.map(grouped));
            let cells = [
                row.scene.to_owned(),
                grouped(row.objects as f64),
                row.cameras.to_string(),
                row.contender.to_owned(),
                row.samples.to_string(),
                grouped(row.submitted_us),
                format!("{low}–{high}"),
                first,
                second,
                third,
                grouped(row.drawloom_submitted_us),
                format!("{:.2}", row.submitted_ratio),
            ];
            match backend {
                BackendName::Noop => table.row(cells),
                BackendName::Adapter => {
                    let [a, b, c, d, e, f, g, h, i, j, k, l] = cells;
                    let ratio = row.drawn_ratio.map_or_else(String::new, |ratio| format!("{ratio:.2}"));
                    let [drawn, beside] = [row.drawn_us, row.drawloom_drawn_us].map(grouped);
                    table.row([a, b, c, d, e, f, g, h, i, j, k, l, drawn, beside, ratio]);
                }
            }
        }
        table.print();
    }

    /// In no scene is a frame of Bevy's fastest mode shorter: on noop until submit returns, on the adapter until the
    /// device is idle.
    pub fn targets(&self) -> Targets {
        let mut targets = Targets::new();
        for rows in self.scenes() {
            let Row { scene, objects, .. } = rows[0];
            let ratio = |row: &Row| self.extent.backend.of([Some(row.submitted_ratio), row.drawn_ratio]);
            let peers = rows.iter().filter(|row| row.contender != Drawloom::NAME);
            let fastest = peers.filter_map(ratio).min_by(f64::total_cmp).unwrap_or(f64::NAN);
            let figure = format!("bevy's fastest ÷ drawloom, {scene}, {} objects", grouped(objects as f64));
            targets.at_least(figure, 1.0, fastest);
        }
        targets
    }

    /// The rows of each scene and number of objects.
    fn scenes(&self) -> impl Iterator<Item = &[Row]> {
        self.rows.chunk_by(|one, other| (one.scene, one.objects) == (other.scene, other.objects))
    }

    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write_json(&self, file: &OutputFile) -> Result<(), Failure> {
        let Extent { backend, workers, is_quick, .. } = self.extent;
        let (adapter, picture, rows) = (self.backend_name(), self.picture, &self.rows[..]);
        let json = Json { backend, adapter, workers, is_quick, picture, rows };
        file.write_all(serde_json::to_string_pretty(&json)? + "\n")?;
        print_line!("{} written", path_text(file.path()));
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
        let title = format!("µs a frame, {scene}: {} × {} objects", camera_count(cameras), grouped(objects as f64));
        let bars = rows.iter().map(|row| (row.contender.to_owned(), self.time(row), row.color));
        HorizontalBars { title, bars: bars.collect() }
    }

    /// A line per contender.
    fn lines(&self, rows: &[Row]) -> Lines {
        let Row { scene, cameras, .. } = rows[0];
        let mut contenders: Vec<_> = rows.iter().map(|row| (row.color, row.contender)).collect();
        contenders.sort_unstable();
        contenders.dedup();
        let points = |&(color, name): &(usize, &str)| {
            let of = rows.iter().filter(|row| row.color == color);
            (name.to_owned(), of.map(|row| (row.objects as f64, self.time(row))).collect::<Vec<_>>())
        };
        let series: Vec<_> = contenders.iter().map(points).collect();
        let ticks = series[0].1.iter().map(|point| point.0).collect();
        let title = format!("µs a frame, {scene}: {}, {}", camera_count(cameras), self.backend_name());
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

fn camera_count(cameras: usize) -> String {
    if cameras == 1 { "one camera".to_owned() } else { format!("{cameras} cameras") }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of a scene, relative to a microsecond of Drawloom's. Its frames overlap if it has no `drawn_ratio`.
    fn row(contender: &'static str, submitted_ratio: f64, drawn_ratio: Option<f64>) -> Row {
        Row {
            scene: "still",
            objects: 1_000,
            cameras: 1,
            contender,
            color: 0,
            samples: 1,
            submitted_us: submitted_ratio,
            quartiles_us: [submitted_ratio; 2],
            parts_us: drawn_ratio.map(|_| [0.0; 3]),
            drawloom_submitted_us: 1.0,
            submitted_ratio,
            drawn_us: 1.0,
            drawloom_drawn_us: 1.0,
            drawn_ratio,
        }
    }

    fn report(backend: BackendName) -> Report {
        let mut report = Report::new(Extent::new(backend, 1, true, None), 64);
        report.rows = vec![
            row(Drawloom::NAME, 1.0, Some(1.0)),
            row("slow", 3.0, Some(0.75)),
            row("fast", 2.0, Some(1.5)),
            row("overlapping", 2.5, None),
        ];
        report
    }

    #[test]
    fn the_target_is_that_of_the_fastest_peer_by_the_time_of_the_backend() {
        let outcome = |backend| format!("{:?}", report(backend).targets());
        assert!(outcome(BackendName::Noop).contains("reached: 2.0"), "{}", outcome(BackendName::Noop));
        assert!(outcome(BackendName::Adapter).contains("reached: 0.75"), "{}", outcome(BackendName::Adapter));
    }

    #[test]
    fn scenes_of_other_sizes_have_targets_of_their_own() {
        let mut report = report(BackendName::Noop);
        report.rows.push(Row { objects: 2_000, ..row(Drawloom::NAME, 1.0, Some(1.0)) });
        report.rows.push(Row { objects: 2_000, ..row("slow", 0.5, Some(1.0)) });
        let targets = format!("{:?}", report.targets());
        assert!(targets.contains("reached: 2.0") && targets.contains("reached: 0.5"), "{targets}");
    }
}
