//! The chart of the Pareto front: frame time against distance from the reference.

use std::path::Path;

use drawloom_benches::chart::{Area, write_svg};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::Failure;
use crate::charts::{label, text};
use crate::results::{Entry, Results};
use crate::settings::Knob;

/// Writes `front.svg` into the folder: a dot for each setting, and a line through the Pareto front.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub fn draw(folder: &Path, results: &Results) -> Result<(), Failure> {
    write_svg(&folder.join("front.svg"), (WIDTH, 420), |root| draw_front(root, results))
}

fn draw_front(root: &Area<'_>, results: &Results) -> Result<(), Failure> {
    let points = || results.entries.iter().map(point);
    let slowest = points().map(|(time, _)| time).fold(f64::MIN_POSITIVE, f64::max);
    let nearest = points().map(|(_, distance)| distance).fold(f64::MAX, f64::min);
    let farthest = points().map(|(_, distance)| distance).fold(nearest, f64::max);
    let mut chart = ChartBuilder::on(root)
        .caption(format!("{}, {}", results.scene(), results.backend()), text(17))
        .margin(12)
        .margin_right(NAMES + 12)
        .x_label_area_size(42)
        .y_label_area_size(62)
        .build_cartesian_2d(0.0..slowest * 1.1, (nearest * 0.6..farthest * 1.6).log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .label_style(text(13))
        .axis_desc_style(text(14))
        .x_desc("a frame, ms")
        .y_desc("RMSE of 255 from the reference in f64")
        .draw()?;
    let others = results.entries.iter().filter(|entry| !entry.pareto);
    chart.draw_series(others.map(|entry| Circle::new(point(entry), 4, OTHERS.filled())))?;
    let front = results.front();
    chart.draw_series(LineSeries::new(front.iter().map(|entry| point(entry)), FRONT.stroke_width(2)))?;
    chart.draw_series(front.iter().map(|entry| Circle::new(point(entry), 5, FRONT.filled())))?;
    let numbered = || front.iter().enumerate().map(|(index, entry)| (index + 1, entry));
    chart.draw_series(numbered().map(|(number, entry)| {
        let style = text(13).color(&FRONT).pos(Pos::new(HPos::Center, VPos::Center));
        EmptyElement::at(point(entry)) + Text::new(number.to_string(), (0, -14), style)
    }))?;
    for (number, entry) in numbered() {
        let name = format!("{number}  {}", label(entry, Knob::Preset.name()));
        let row = (WIDTH as i32 - NAMES, 40 + 20 * number as i32);
        root.draw(&Text::new(name, row, text(13).color(&FRONT)))?;
    }
    Ok(())
}

/// In pixels: the chart, and the names to its right.
const WIDTH: u32 = 960;
const NAMES: i32 = 210;

const FRONT: RGBColor = RGBColor(213, 94, 0);
const OTHERS: RGBAColor = RGBAColor(0, 114, 178, 0.45);

/// The frame time in milliseconds, and the distance of 255. The logarithmic scale has no 0.
fn point(entry: &Entry) -> (f64, f64) {
    (entry.frame_ms(), (entry.rmse_from_reference * 255.0).max(1e-3))
}
