//! Charts, as SVG.

use std::error::Error;
use std::ops::Range;
use std::path::Path;

use drawloom_output::{OutputFile, path_text, print_line};
use plotters::coord::Shift;
use plotters::coord::combinators::{BindKeyPoints, IntoLogRange};
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

pub type Failure = Box<dyn Error>;

/// A part of a chart, with axes of its own.
pub enum Panel {
    Bars(Bars),
    Lines(Lines),
    HorizontalBars(HorizontalBars),
}

/// Groups of vertical bars, with one bar per series in each group.
pub struct Bars {
    pub title: String,
    pub series: Vec<String>,
    /// The name of each group, and the value of each series; NaN for no bar.
    pub groups: Vec<(String, Vec<f64>)>,
    /// A mark across the bars of each group; NaN for no mark, and empty for none at all.
    pub marks: Vec<f64>,
    /// The legend of the marks.
    pub mark_name: String,
    /// The value of a horizontal line.
    pub line: f64,
}

/// Lines with logarithmic axes.
pub struct Lines {
    pub title: String,
    /// The label of the horizontal axis.
    pub x_label: String,
    /// Their names, and their points.
    pub series: Vec<(String, Vec<(f64, f64)>)>,
    /// The colour of the first line: 0 is grey, for a baseline.
    pub first_color: usize,
    /// The ticks of the horizontal axis.
    pub ticks: Vec<f64>,
}

/// Horizontal bars, each with its value at its end.
pub struct HorizontalBars {
    pub title: String,
    /// Name, length and colour of each bar.
    pub bars: Vec<(String, f64, usize)>,
}

/// In pixels.
const WIDTH: u32 = 1200;
const PANEL: u32 = 340;
const BAR: u32 = 26;
/// The greatest width of a vertical bar, as a share of its group.
const MAX_BAR_WIDTH: f64 = 0.27;
const HEAD: u32 = 84;

/// Okabe and Ito's colours, which the colour-blind can tell apart too, and a grey.
const COLORS: [RGBColor; 8] = [
    RGBColor(150, 150, 150),
    RGBColor(230, 159, 0),
    RGBColor(213, 94, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 114, 178),
    RGBColor(204, 121, 167),
    RGBColor(0, 158, 115),
    RGBColor(0, 0, 0),
];

const BLACK_INDEX: usize = COLORS.len() - 1;

/// Draws panels below each other.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub fn draw(path: &Path, panels: &[Panel]) -> Result<(), Failure> {
    let heights: Vec<_> = panels.iter().map(Panel::height).collect();
    write_svg(path, (WIDTH, heights.iter().sum()), |root| {
        let mut rest = root.clone();
        for (panel, &height) in panels.iter().zip(&heights) {
            let (area, below) = rest.split_vertically(height);
            panel.draw(&area)?;
            rest = below;
        }
        Ok(())
    })?;
    print_line!("{} written", path_text(path));
    Ok(())
}

/// Writes what `draw` draws on white, of `size` pixels.
///
/// # Errors
/// Returns the error of `draw`, or an error if the file cannot be written.
pub fn write_svg(
    path: &Path,
    size: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let file = OutputFile::new(path)?;
    let mut svg = String::new();
    let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
    root.fill(&WHITE)?;
    draw(&root)?;
    root.present()?;
    drop(root);
    Ok(file.write_all(svg)?)
}

/// A part of a chart, or all of it.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

impl Panel {
    fn height(&self) -> u32 {
        match self {
            Self::Bars(_) | Self::Lines(_) => PANEL,
            Self::HorizontalBars(bars) => HEAD + BAR * bars.bars.len() as u32,
        }
    }

    fn draw(&self, area: &Area) -> Result<(), Failure> {
        match self {
            Self::Bars(bars) => bars.draw(area),
            Self::Lines(lines) => lines.draw(area),
            Self::HorizontalBars(bars) => bars.draw(area),
        }
    }
}

impl Bars {
    fn draw(&self, area: &Area) -> Result<(), Failure> {
        let values = self.groups.iter().flat_map(|(_, values)| values).chain(&self.marks).copied();
        let top = values.filter(|value| value.is_finite()).fold(self.line, f64::max) * 1.1;
        let black = (!self.marks.is_empty()).then_some((BLACK_INDEX, self.mark_name.as_str()));
        let legend = self.series.iter().map(String::as_str).enumerate().chain(black);
        let area = with_heading(area, &self.title, legend)?;
        let count = self.groups.len();
        let mut chart = ChartBuilder::on(&area)
            .margin_right(16)
            .x_label_area_size(28)
            .y_label_area_size(56)
            .build_cartesian_2d(Slots(count), 0.0..top)?;
        let name = |middle: &f64| self.groups.get(*middle as usize).map_or_else(String::new, |(name, _)| name.clone());
        chart
            .configure_mesh()
            .disable_x_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.15))
            .y_labels(8)
            .x_labels(count)
            .x_label_formatter(&name)
            .y_label_formatter(&|value: &f64| short(*value))
            .label_style(text(15))
            .draw()?;
        let line = vec![(0.0, self.line), (count as f64, self.line)];
        chart.plotting_area().draw(&PathElement::new(line, BLACK.mix(0.6).stroke_width(1)))?;
        let width = (0.92 / self.series.len() as f64).min(MAX_BAR_WIDTH);
        let margin = (1.0 - width * self.series.len() as f64) / 2.0;
        for (group, (_, values)) in self.groups.iter().enumerate() {
            for (series, &value) in values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
                let left = group as f64 + margin + width * series as f64;
                let corners = [(left, 0.0), (left + width * 0.94, value)];
                chart.plotting_area().draw(&Rectangle::new(corners, color(series).filled()))?;
                let label = Text::new(format!("{value:.2}"), (left + width * 0.47, value), centered(11, VPos::Bottom));
                chart.plotting_area().draw(&label)?;
            }
        }
        for (group, &mark) in self.marks.iter().enumerate().filter(|(_, mark)| mark.is_finite()) {
            let (left, right) = (group as f64 + margin - 0.04, (group + 1) as f64 - margin + 0.04);
            let line = PathElement::new(vec![(left, mark), (right, mark)], BLACK.stroke_width(2));
            chart.plotting_area().draw(&line)?;
            let style = text(12).pos(Pos::new(HPos::Left, VPos::Center));
            chart.plotting_area().draw(&Text::new(format!(" {mark:.2}"), (right, mark), style))?;
        }
        Ok(())
    }
}

impl Lines {
    fn draw(&self, area: &Area) -> Result<(), Failure> {
        let points = || self.series.iter().flat_map(|(_, points)| points.iter().copied());
        let low = points().map(|point| point.1).fold(f64::INFINITY, f64::min).max(1e-9);
        let high = points().map(|point| point.1).fold(low, f64::max);
        let legend = (self.first_color..).zip(self.series.iter().map(|(name, _)| name.as_str()));
        let area = with_heading(area, &self.title, legend)?;
        let ends = |ticks: &[f64]| {
            let (first, last) =
                (ticks.iter().copied().fold(f64::INFINITY, f64::min), ticks.iter().copied().fold(0.0, f64::max));
            first / 1.15..last * 1.15
        };
        let mut builder = ChartBuilder::on(&area);
        builder.margin_right(24).x_label_area_size(44).y_label_area_size(64);
        let horizontal = ends(&self.ticks).log_scale().with_key_points(self.ticks.clone());
        let vertical = low / 1.3..high * 1.3;
        let decades = decades(&vertical);
        let vertical = vertical.log_scale().with_key_points(decades);
        let mut chart = builder.build_cartesian_2d(horizontal, vertical)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.15))
            .x_labels(self.ticks.len())
            .y_labels(10)
            .x_desc(&self.x_label)
            .x_label_formatter(&|value: &f64| grouped(*value))
            .y_label_formatter(&|value: &f64| if *value >= 100.0 { grouped(*value) } else { short(*value) })
            .label_style(text(15))
            .axis_desc_style(text(15))
            .draw()?;
        for (index, (_, points)) in (self.first_color..).zip(&self.series) {
            chart.draw_series(LineSeries::new(points.iter().copied(), color(index).stroke_width(2)))?;
            chart.draw_series(points.iter().map(|&point| Circle::new(point, 4, color(index).filled())))?;
        }
        Ok(())
    }
}

impl HorizontalBars {
    fn draw(&self, area: &Area) -> Result<(), Failure> {
        let longest = self.bars.iter().map(|(_, length, _)| *length).fold(0.0, f64::max);
        let area = with_heading(area, &self.title, [])?;
        let count = self.bars.len();
        let mut chart = ChartBuilder::on(&area)
            .margin_right(16)
            .x_label_area_size(28)
            .y_label_area_size(230)
            .build_cartesian_2d(0.0..longest * 1.08, Slots(count))?;
        // Slots are counted from the bottom, bars from the top.
        let name = |middle: &f64| {
            let bar = self.bars.iter().rev().nth(*middle as usize);
            bar.map_or_else(String::new, |(name, ..)| name.clone())
        };
        chart
            .configure_mesh()
            .disable_y_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.15))
            .x_labels(10)
            .y_labels(count)
            .x_label_formatter(&|value: &f64| short(*value))
            .y_label_formatter(&name)
            .label_style(text(15))
            .draw()?;
        for (bar, &(_, length, series)) in self.bars.iter().rev().enumerate() {
            let (upper, middle, lower) = (bar as f64 + 0.12, bar as f64 + 0.5, bar as f64 + 0.88);
            chart.plotting_area().draw(&Rectangle::new([(0.0, upper), (length, lower)], color(series).filled()))?;
            let style = text(14).pos(Pos::new(HPos::Left, VPos::Center));
            chart.plotting_area().draw(&Text::new(format!(" {}", short(length)), (length, middle), style))?;
        }
        Ok(())
    }
}

/// An axis of slots side by side, each of width 1 and labelled at its centre.
struct Slots(usize);

impl Ranged for Slots {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        limit.0 + (value / self.0 as f64 * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _hint: Hint) -> Vec<f64> {
        (0..self.0).map(|slot| slot as f64 + 0.5).collect()
    }

    fn range(&self) -> Range<f64> {
        0.0..self.0 as f64
    }
}

/// 1, 2 and 5 times each power of 10 in a range.
fn decades(range: &Range<f64>) -> Vec<f64> {
    let all = (-9..13).flat_map(|power| [1.0, 2.0, 5.0].map(|step| step * 10_f64.powi(power)));
    all.filter(|value| range.contains(value)).collect()
}

/// Draws the title and the legend, and returns the area below.
fn with_heading<'a, 'b>(
    area: &Area<'a>,
    title: &str,
    legend: impl IntoIterator<Item = (usize, &'b str)>,
) -> Result<Area<'a>, Failure> {
    area.draw(&Text::new(title.to_owned(), (16, 12), text(20)))?;
    let mut left = 16;
    for (index, name) in legend {
        area.draw(&Rectangle::new([(left, 41), (left + 12, 53)], color(index).filled()))?;
        area.draw(&Text::new(name.to_owned(), (left + 18, 40), text(15)))?;
        left += 40 + 8 * name.chars().count() as i32;
    }
    Ok(area.margin(64, 8, 8, 8))
}

fn color(series: usize) -> RGBColor {
    COLORS[series % COLORS.len()]
}

fn text(size: u32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().into()
}

fn centered(size: u32, vertical: VPos) -> TextStyle<'static> {
    text(size).pos(Pos::new(HPos::Center, vertical))
}

/// With three digits, or all digits before the point.
fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        ..9.995 => format!("{value:.2}").trim_end_matches('0').trim_end_matches('.').to_owned(),
        ..99.95 => format!("{value:.1}").trim_end_matches(".0").to_owned(),
        _ => grouped(value),
    }
}

/// As a whole number, with commas between thousands.
pub fn grouped(value: f64) -> String {
    let digits = format!("{value:.0}");
    let (first, rest) = digits.split_at((digits.len() - 1) % 3 + 1);
    rest.as_bytes().chunks(3).fold(first.to_owned(), |whole, three| whole + "," + &String::from_utf8_lossy(three))
}
