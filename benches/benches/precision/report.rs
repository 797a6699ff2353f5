//! The results, as a table, JSON and a chart.

use std::error::Error;

use drawloom_benches::chart::{self, Lines, Panel};
use drawloom_benches::results;
use drawloom_benches::table::Table;
use drawloom_output::print_line;
use drawloom_testing::precision::cases::Kind;
use drawloom_testing::precision::measure::{BOUND, Errors, UNIT_ROUNDOFF, WORST_ANGLE};
use serde::Serialize;

/// The results.
#[derive(Default)]
pub struct Report {
    pub rows: Vec<Row>,
}

/// One view.
#[derive(Serialize)]
pub struct Row {
    view: String,
    /// In metres from the world's origin; `None` for random distances up to 10⁹ m.
    distance: Option<f64>,
    cases: usize,
    relative_max_px: f64,
    relative_mean_px: f64,
    /// What the shader computes on the adapter; `None` without one.
    shader_max_px: Option<f64>,
    shader_mean_px: Option<f64>,
    absolute_max_px: f64,
    absolute_mean_px: f64,
    /// The greatest error as an angle.
    relative_max_radians: f64,
    shader_max_radians: Option<f64>,
    /// The bound of the relative error: pixels, or else an angle.
    bound_px: Option<f64>,
    bound_radians: Option<f64>,
}

impl Row {
    pub fn new(kind: Kind, distance: Option<f64>, is_held: bool, found: Errors, by_shader: Option<Errors>) -> Self {
        Self {
            view: kind.name(),
            distance,
            cases: found.cases,
            relative_max_px: found.greatest,
            relative_mean_px: found.mean,
            shader_max_px: by_shader.map(|errors| errors.greatest),
            shader_mean_px: by_shader.map(|errors| errors.mean),
            absolute_max_px: found.absolute_greatest,
            absolute_mean_px: found.absolute_mean,
            relative_max_radians: found.greatest_angle * UNIT_ROUNDOFF,
            shader_max_radians: by_shader.map(|errors| errors.greatest_angle * UNIT_ROUNDOFF),
            bound_px: is_held.then_some(BOUND),
            bound_radians: (!is_held).then_some(WORST_ANGLE * UNIT_ROUNDOFF),
        }
    }

    /// The greatest error, in Rust or on the adapter.
    fn worst_px(&self) -> f64 {
        self.shader_max_px.map_or(self.relative_max_px, |of_shader| of_shader.max(self.relative_max_px))
    }

    fn worst_radians(&self) -> f64 {
        self.shader_max_radians.map_or(self.relative_max_radians, |of_shader| of_shader.max(self.relative_max_radians))
    }

    fn is_within(&self) -> bool {
        let [pixels, radians] = [self.worst_px(), self.worst_radians()];
        self.bound_px.is_none_or(|bound| pixels <= bound) && self.bound_radians.is_none_or(|bound| radians <= bound)
    }
}

impl Report {
    pub fn print(&self) {
        print_line!("{} vertices; pixels of error\n", self.rows.iter().map(|row| row.cases).sum::<usize>());
        let optional = |pixels: Option<f64>| pixels.map_or_else(|| "-".to_owned(), |pixels| format!("{pixels:.2e}"));
        let mut table = Table::new(&[
            "view",
            "m",
            "relative max",
            "mean",
            "shader max",
            "mean",
            "absolute max",
            "mean",
            "bound",
            "held",
        ]);
        for row in &self.rows {
            table.row([
                row.view.clone(),
                row.distance.map_or_else(|| "..1e9".to_owned(), |distance| format!("{distance:.0e}")),
                format!("{:.2e}", row.relative_max_px),
                format!("{:.2e}", row.relative_mean_px),
                optional(row.shader_max_px),
                optional(row.shader_mean_px),
                format!("{:.2e}", row.absolute_max_px),
                format!("{:.2e}", row.absolute_mean_px),
                match row.bound_px {
                    Some(bound) => format!("{bound:.0e} px"),
                    None => format!("{:.1} of {WORST_ANGLE} u", row.worst_radians() / UNIT_ROUNDOFF),
                },
                if row.is_within() { "yes" } else { "NO" }.to_owned(),
            ]);
        }
        table.print();
    }

    /// # Errors
    /// Returns an error if a file cannot be written.
    pub fn write(&self) -> Result<(), Box<dyn Error>> {
        results::write_json("precision.json", &self.rows)?;
        let by_distance = || self.rows.iter().filter_map(|row| Some((row.distance?, row)));
        let line = |name: &str, error: fn(&Row) -> f64| {
            let points = by_distance().map(|(distance, row)| (distance, error(row)));
            (name.to_owned(), points.collect::<Vec<_>>())
        };
        let lines = Lines {
            title: "Pixels that vertices are off by, 1920 x 1080, 60°".to_owned(),
            x_label: "metres from the world's origin".to_owned(),
            series: vec![
                line("absolute f32, greatest", |row| row.absolute_max_px),
                line("absolute f32, mean", |row| row.absolute_mean_px),
                line("camera-relative, greatest", |row| row.relative_max_px),
                line("camera-relative, mean", |row| row.relative_mean_px),
            ],
            first_color: 0,
            ticks: by_distance().map(|(distance, _)| distance).collect(),
        };
        chart::draw(&results::file("precision.svg")?, &[Panel::Lines(lines)])
    }

    /// # Errors
    /// Returns an error if a view exceeds its bound.
    pub fn check(&self) -> Result<(), Box<dyn Error>> {
        let beyond: Vec<_> = self.rows.iter().filter(|row| !row.is_within()).map(|row| row.view.as_str()).collect();
        if beyond.is_empty() { Ok(()) } else { Err(format!("beyond their bound: {}", beyond.join("; ")).into()) }
    }
}
