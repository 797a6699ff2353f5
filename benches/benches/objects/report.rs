//! The results, as tables, JSON and a chart.

use std::error::Error;

use drawloom_benches::backends::{BackendName, adapter_name};
use drawloom_benches::results;
use drawloom_benches::table::Table;
use drawloom_output::print_line;
use serde::Serialize;

use crate::{Extent, charts, growth, scenario};

/// The results.
pub struct Report {
    extent: &'static str,
    rounds: [usize; 2],
    growth_rounds: [usize; 2],
    pub scenarios: Vec<scenario::Row>,
    pub growth: Vec<growth::Row>,
}

/// A row of the JSON file: of either table.
#[derive(Serialize)]
#[serde(untagged)]
enum Row<'a> {
    Scenario(&'a scenario::Row),
    Growth(&'a growth::Row),
}

impl Report {
    pub fn new(extent: &Extent) -> Self {
        let Extent { name, rounds, growth_rounds, .. } = *extent;
        Self { extent: name, rounds, growth_rounds, scenarios: Vec::new(), growth: Vec::new() }
    }

    pub fn print(&self) {
        let ([noop, adapter], [many_noop, many_adapter]) = (self.rounds, self.growth_rounds);
        let note = if self.extent == "full" { "" } else { " (meaningless figures)" };
        print_line!("{} run{note}: medians of {noop} rounds on noop and {adapter} on the adapter", self.extent);
        print_line!("adapter: {}", adapter_name().as_deref().unwrap_or("none"));
        print_line!(
            "fps: frames of record + submit per second, without the device's time; ratios: of fps, to single; held: the time, and the share of the frame, in which the world is borrowed\n"
        );
        let mut table = Table::new(&[
            "objects",
            "backend",
            "instancing",
            "single fps",
            "multi fps",
            "ratio",
            "one worker, cached",
            "two workers, direct",
            "ceiling",
            "single held ms",
            "multi held ms",
            "single held %",
            "multi held %",
        ]);
        for row in &self.scenarios {
            table.row([
                row.objects.to_string(),
                row.backend.name().to_owned(),
                if row.instancing { "on" } else { "off" }.to_owned(),
                format!("{:.1}", row.single_fps),
                format!("{:.1}", row.multi_fps),
                format!("{:.2}", row.ratio),
                row.cached_ratio.map_or_else(String::new, |ratio| format!("{ratio:.2}")),
                row.direct_ratio.map_or_else(String::new, |ratio| format!("{ratio:.2}")),
                format!("{:.2}", row.ceiling),
                format!("{:.4}", row.single_held_ms),
                format!("{:.4}", row.multi_held_ms),
                format!("{:.1}", row.single_held_share * 100.0),
                format!("{:.1}", row.multi_held_share * 100.0),
            ]);
        }
        table.print();
        print_line!("Growth: two workers, no instancing; medians of {many_noop} and {many_adapter} rounds\n");
        let mut table = Table::new(&["objects", "backend", "ns per object and view"]);
        for row in &self.growth {
            let (objects, backend) = (row.objects.to_string(), row.backend.name().to_owned());
            table.row([objects, backend, format!("{:.1}", row.ns_per_object_view)]);
        }
        table.print();
        self.print_targets();
    }

    /// Prints the targets and the results on `noop`.
    fn print_targets(&self) {
        print_line!("Targets and results on noop, without instancing\n");
        let mut table = Table::new(&["figure", "objects", "bound", "reached"]);
        let mut target_row = |what: &str, objects: usize, bound: f64, reached: f64, is_reached: bool| {
            let note = if is_reached { "" } else { ", short" };
            table.row([what.to_owned(), objects.to_string(), format!("{bound:.2}"), format!("{reached:.3}{note}")]);
        };
        for row in self.scenarios.iter().filter(|row| row.backend == BackendName::Noop && !row.instancing) {
            let target = match row.objects {
                7 | 16 | 106 => 0.97,
                1_006 => 1.70,
                2_006 => 1.80,
                10_000 => 1.90,
                _ => continue,
            };
            target_row("ratio", row.objects, target, row.ratio, row.ratio >= target);
            if row.objects >= 1_000 {
                let of_ceiling = row.ratio / row.ceiling;
                target_row("ratio, of its ceiling", row.objects, 0.90, of_ceiling, of_ceiling >= 0.9);
            }
        }
        let growth: Vec<_> = self.growth.iter().filter(|row| row.backend == BackendName::Noop).collect();
        if let [first, .., last] = growth[..] {
            let grown = last.ns_per_object_view / first.ns_per_object_view;
            target_row("growth of the ns, at most", last.objects, 1.5, grown, grown <= 1.5);
        }
        table.print();
    }

    /// # Errors
    /// Returns an error if a file cannot be written.
    pub fn write(&self) -> Result<(), Box<dyn Error>> {
        let scenarios = self.scenarios.iter().map(Row::Scenario);
        let rows: Vec<_> = scenarios.chain(self.growth.iter().map(Row::Growth)).collect();
        results::write_json("objects.json", &rows)?;
        charts::draw(&results::file("objects.svg")?, &self.scenarios)
    }
}
