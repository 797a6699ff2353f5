//! The tables as charts.

use std::path::Path;

use drawloom_benches::chart::{self, Bars, Failure, Panel};

use crate::contender::Variant;
use crate::{errors, rates};

/// Draws a panel for the time of a frame, one for its latency, and one for the errors of each layer.
pub fn draw(path: &Path, rates: &[rates::Row], errors: &[errors::Row]) -> Result<(), Failure> {
    let bars = |title: &str, series: Vec<String>, groups: Vec<(String, Vec<f64>)>| {
        let (title, marks, mark_name, line) = (title.to_owned(), Vec::new(), String::new(), 0.0);
        Panel::Bars(Bars { title, series, groups, marks, mark_name, line })
    };
    let of_rates = |title: &str, value: fn(&rates::Row) -> f64| {
        let groups = rates.chunks(Variant::ALL.len());
        let groups = groups.map(|rows| (rows[0].device.clone(), rows.iter().map(value).collect())).collect();
        bars(
            title,
            Variant::ALL.map(|variant| format!("{}, {}", variant.kind.name(), variant.buffering_name())).to_vec(),
            groups,
        )
    };
    let mut panels = vec![
        of_rates("The time of a frame in ms, by the time that the device takes for it", |row| row.frame_ms),
        of_rates("The time in ms from the input to its picture", |row| row.latency_ms),
    ];
    let distinct = |value: fn(&errors::Row) -> &'static str| {
        let mut values: Vec<_> = errors.iter().map(value).collect();
        let mut seen = Vec::new();
        values.retain(|value| {
            !seen.contains(value) && {
                seen.push(*value);
                true
            }
        });
        values
    };
    for layer in distinct(|row| row.layer) {
        let lookups = distinct(|row| row.lookup);
        let mean = |motion: &str, lookup: &str| {
            let row = errors.iter().find(|row| row.layer == layer && row.motion == motion && row.lookup == lookup);
            row.map_or(f64::NAN, |row| row.mean)
        };
        let groups = distinct(|row| row.motion)
            .into_iter()
            .map(|motion| (motion.to_owned(), lookups.iter().map(|lookup| mean(motion, lookup)).collect()));
        let title = format!("The mean error of a layer of {layer} that is a frame late, in units of 255");
        panels.push(bars(&title, lookups.iter().map(|lookup| (*lookup).to_owned()).collect(), groups.collect()));
    }
    chart::draw(path, &panels)
}
