//! A chart for each knob: what its settings take, how far off they are and can be, and how far their pictures are. And one of all.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::Failure;
use crate::results::{Entry, Results, of_knob, short};
use crate::settings::Knob;

/// Writes `KNOB.svg` into the folder for each knob, and `knobs.svg` with all of them.
///
/// # Errors
/// If a file cannot be written.
pub fn draw(folder: &Path, results: &Results) -> Result<(), Failure> {
    for knob in Knob::ALL {
        let entries = of_knob(&results.entries, knob);
        // That of exact's entry is another's.
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
    // Each has a unit of its own, so they have their bounds in common.
    let of_bound = Column {
        title: String::from("error, % of its bound"),
        value: &|entry| entry.error.zip(entry.bound).map(|(error, bound)| share(error, bound) * 100.0),
        bound: &nothing,
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
    println!("charts written to {}", folder.display());
    Ok(())
}

/// How much of its bound an error is; nothing is all right where nothing may be wrong.
fn share(error: f64, bound: f64) -> f64 {
    if error == 0.0 { 0.0 } else { error / bound }
}

fn nothing(_: &Entry) -> Option<f64> {
    None
}

/// The file of a knob's chart.
pub fn file_name(knob: Knob) -> String {
    format!("{}.svg", knob.name())
}

/// In pixels.
const HEAD: i32 = 66;
const ROW: i32 = 26;
const NAMES: i32 = 250;
const COLUMN: i32 = 220;
/// Between a bar's longest and the next column: room for its figure.
const FIGURE: i32 = 90;

/// Times the bar in the middle: longer ones are cut.
const MOST: f64 = 6.0;

/// What a column of bars shows.
struct Column<'a> {
    title: String,
    value: &'a dyn Fn(&Entry) -> Option<f64>,
    /// What it can be at most.
    bound: &'a dyn Fn(&Entry) -> Option<f64>,
    /// How long a bar can be; from what there is, if not given.
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
    let root = SVGBackend::new(path, (size.0 as u32, size.1 as u32)).into_drawing_area();
    root.fill(&WHITE)?;
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
            bound: &nothing,
            longest: None,
            color: RGBColor(0, 114, 178),
        },
        Column {
            title: String::from("picture: RMSE from f64, of 255"),
            value: &|entry| Some(entry.rmse_from_reference * 255.0),
            bound: &nothing,
            longest: None,
            color: RGBColor(230, 159, 0),
        },
        of_knobs,
    ];
    for (place, column) in (0..).zip(&columns) {
        draw_column(&root, NAMES + place * (COLUMN + FIGURE), column, entries)?;
    }
    root.present()?;
    Ok(())
}

/// Bars from 0 on, each with its figure, and a mark where it can end at most. Those that are cut have dots before it.
fn draw_column(
    root: &DrawingArea<SVGBackend<'_>, Shift>,
    left: i32,
    column: &Column<'_>,
    entries: &[&Entry],
) -> Result<(), Failure> {
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
            let place = left + (bound / longest * f64::from(COLUMN)) as i32;
            root.draw(&PathElement::new([(place, top + 2), (place, top + ROW - 2)], BLACK.stroke_width(2)))?;
        }
    }
    Ok(())
}

/// The longest bar. What is many times as long as most would leave nothing to see of these.
fn longest(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<_> = values.collect();
    values.sort_by(f64::total_cmp);
    let middle = values.get(values.len() / 2).copied().unwrap_or_default();
    let longest = values.last().copied().unwrap_or_default();
    if middle > 0.0 { longest.min(middle * MOST) } else { longest.max(f64::MIN_POSITIVE) }
}

pub fn text(size: i32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&BLACK)
}

/// What a setting is called in a chart of this knob.
pub fn label(entry: &Entry, knob: &str) -> String {
    if entry.knob == knob || entry.knob == Knob::Preset.name() {
        entry.setting.clone()
    } else {
        format!("{}: {}", entry.knob, entry.setting)
    }
}
