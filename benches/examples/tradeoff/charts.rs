//! A chart per knob, and one of all knobs: frame times, errors with their bounds, and the distances of pictures.

use std::path::Path;

use drawloom_benches::chart::{Area, write_svg};
use drawloom_output::{path_text, print_line};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::Failure;
use crate::results::{Entry, Results, of_knob, short};
use crate::settings::Knob;

/// Writes `KNOB.svg` into the folder for each knob, and `knobs.svg` with all of them.
///
/// # Errors
/// Returns an error if a file cannot be written.
pub fn draw(folder: &Path, results: &Results) -> Result<(), Failure> {
    for knob in results.knobs() {
        let entries = of_knob(&results.entries, knob);
        // The entry of exact has another metric.
        let metric = entries.iter().find(|entry| entry.knob == knob.name()).map_or("", |entry| &entry.metric);
        let own = Column {
            title: metric.to_owned(),
            value: &|entry| entry.error.filter(|_| entry.metric == metric),
            bound: &|entry| entry.bound.filter(|_| entry.metric == metric),
            longest: None,
            color: RGBColor(213, 94, 0),
        };
        draw_one(&folder.join(file_name(knob)), knob.name(), results, &entries, own)?;
    }
    // Units differ, so errors are shown relative to their bounds.
    let of_bound = Column {
        title: String::from("error, % of its bound"),
        value: &|entry| entry.error.zip(entry.bound).map(|(error, bound)| share(error, bound) * 100.0),
        bound: &none,
        longest: Some(100.0),
        color: RGBColor(213, 94, 0),
    };
    draw_one(
        &folder.join("knobs.svg"),
        "each knob alone",
        results,
        &results.entries.iter().collect::<Vec<_>>(),
        of_bound,
    )?;
    print_line!("charts written to {}", path_text(folder));
    Ok(())
}

/// The error as a share of its bound; 0 of 0 is 0.
fn share(error: f64, bound: f64) -> f64 {
    if error == 0.0 { 0.0 } else { error / bound }
}

fn none(_: &Entry) -> Option<f64> {
    None
}

/// The file name of a knob's chart.
pub fn file_name(knob: Knob) -> String {
    format!("{}.svg", knob.name())
}

/// In pixels.
const HEAD: i32 = 66;
const ROW: i32 = 26;
const NAMES: i32 = 250;
const COLUMN: i32 = 220;
/// Space for values between columns.
const FIGURE: i32 = 90;

/// Bars longer than this multiple of the median bar are cut.
const MAX_LENGTH: f64 = 6.0;

/// A column of bars.
struct Column<'a> {
    title: String,
    value: &'a dyn Fn(&Entry) -> Option<f64>,
    /// The bound of the value.
    bound: &'a dyn Fn(&Entry) -> Option<f64>,
    /// The value of the longest bar. Default: from the values.
    longest: Option<f64>,
    color: RGBColor,
}

fn draw_one(
    path: &Path,
    name: &str,
    results: &Results,
    entries: &[&Entry],
    of_knobs: Column<'_>,
) -> Result<(), Failure> {
    let size = (NAMES + 3 * (COLUMN + FIGURE), HEAD + ROW * entries.len() as i32 + 12);
    write_svg(path, (size.0 as u32, size.1 as u32), |root| {
        let title = format!("{}, {}: {name}", results.scene(), results.backend());
        root.draw(&Text::new(title, (12, 10), text(17)))?;
        for (row, entry) in (0..).zip(entries) {
            let middle = HEAD + ROW * row + ROW / 2;
            let style = text(14).pos(Pos::new(HPos::Right, VPos::Center));
            root.draw(&Text::new(label(entry, name), (NAMES - 10, middle), style))?;
        }
        let columns = [
            Column {
                title: String::from("a frame, ms"),
                value: &|entry| Some(entry.frame_ms()),
                bound: &none,
                longest: None,
                color: RGBColor(0, 114, 178),
            },
            Column {
                title: String::from("picture: RMSE from f64, of 255"),
                value: &|entry| Some(entry.rmse_from_reference * 255.0),
                bound: &none,
                longest: None,
                color: RGBColor(230, 159, 0),
            },
            of_knobs,
        ];
        for (index, column) in (0..).zip(&columns) {
            draw_column(root, NAMES + index * (COLUMN + FIGURE), column, entries)?;
        }
        Ok(())
    })
}

/// Draws bars with their values, and a mark at the bound. Values of cut bars begin with dots.
fn draw_column(root: &Area<'_>, left: i32, column: &Column<'_>, entries: &[&Entry]) -> Result<(), Failure> {
    root.draw(&Text::new(column.title.clone(), (left, HEAD - 22), text(14)))?;
    let longest = column.longest.unwrap_or_else(|| longest(entries.iter().filter_map(|entry| (column.value)(entry))));
    for (row, entry) in (0..).zip(entries) {
        let Some(value) = (column.value)(entry) else { continue };
        let top = HEAD + ROW * row;
        let end = left + (value.min(longest) / longest * f64::from(COLUMN)) as i32;
        root.draw(&Rectangle::new([(left, top + 5), (end.max(left + 1), top + ROW - 5)], column.color.filled()))?;
        let bound = (column.bound)(entry);
        let cut = if value > longest { "… " } else { "" };
        let bound_text = bound.map_or_else(String::new, |bound| format!(" ≤ {}", short(bound)));
        let figure = format!("{cut}{}{bound_text}", short(value));
        let style = text(13).pos(Pos::new(HPos::Left, VPos::Center));
        root.draw(&Text::new(figure, (end + 6, top + ROW / 2), style))?;
        if let Some(bound) = bound.filter(|bound| *bound <= longest) {
            let x = left + (bound / longest * f64::from(COLUMN)) as i32;
            root.draw(&PathElement::new([(x, top + 2), (x, top + ROW - 2)], BLACK.stroke_width(2)))?;
        }
    }
    Ok(())
}

/// The longest bar. It is limited, as an outlier would hide the others.
fn longest(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<_> = values.collect();
    values.sort_by(f64::total_cmp);
    let middle = values.get(values.len() / 2).copied().unwrap_or_default();
    let longest = values.last().copied().unwrap_or_default();
    if middle > 0.0 { longest.min(middle * MAX_LENGTH) } else { longest.max(f64::MIN_POSITIVE) }
}

pub fn text(size: i32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&BLACK)
}

/// The label of a setting in a chart of this knob.
pub fn label(entry: &Entry, knob: &str) -> String {
    if entry.knob == knob || entry.knob == Knob::Preset.name() {
        entry.setting.clone()
    } else {
        format!("{}: {}", entry.knob, entry.setting)
    }
}
