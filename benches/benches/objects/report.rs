//! The results, as tables, JSON and a chart.

use std::error::Error;

use drawloom_benches::backends::{BackendName, adapter_name};
use drawloom_benches::results;
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use drawloom_output::print_line;
use serde::Serialize;

use crate::{Extent, charts, growth, scenario, splits, update};

/// The results.
pub struct Report {
    extent: &'static str,
    rounds: [usize; 2],
    growth_rounds: [usize; 2],
    pub scenarios: Vec<scenario::Row>,
    pub updates: Vec<update::Row>,
    pub splits: Vec<splits::Row>,
    pub growth: Vec<growth::Row>,
}

/// A row of the JSON file: of any table.
#[derive(Serialize)]
#[serde(untagged)]
enum Row<'a> {
    Scenario(&'a scenario::Row),
    Update(&'a update::Row),
    Split(&'a splits::Row),
    Growth(&'a growth::Row),
}

impl Report {
    pub fn new(extent: &Extent) -> Self {
        let Extent { name, rounds, growth_rounds, .. } = *extent;
        let (scenarios, updates, splits, growth) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { extent: name, rounds, growth_rounds, scenarios, updates, splits, growth }
    }

    pub fn print(&self) {
        let ([noop, adapter], [many_noop, many_adapter]) = (self.rounds, self.growth_rounds);
        let note = if self.extent == "full" { "" } else { " (meaningless figures)" };
        print_line!("{} run{note}: medians of {noop} rounds on noop and {adapter} on the adapter", self.extent);
        print_line!("adapter: {}", adapter_name().as_deref().unwrap_or("none"));
        print_line!(
            "fps: frames of record + submit per second; drawn: with the device's time, two in flight; ratios: of fps, to single\n"
        );
        self.print_rates();
        print_line!(
            "Held: the time, and the share of the frame, in which the world is borrowed; load: of the calling thread, and the mean of the other workers; CPU use: the share of all cores' time with two frames in flight; API: the share of the work in calls of wgpu\n"
        );
        self.print_shares();
        self.print_updates();
        self.print_splits();
        print_line!("Growth: no instancing; medians of {many_noop} and {many_adapter} rounds\n");
        let mut table = Table::new(&["objects", "backend", "workers", "ns per object and view"]);
        for row in &self.growth {
            let (objects, backend) = (row.objects.to_string(), row.backend.name().to_owned());
            table.row([objects, backend, row.workers.to_string(), format!("{:.1}", row.ns_per_object_view)]);
        }
        table.print();
    }

    fn print_updates(&self) {
        print_line!(
            "An engine's update on all workers, frames per second with the device's time; ratios: to before record\n"
        );
        let mut table = Table::new(&[
            "objects",
            "backend",
            "workers",
            "before record",
            "beside submit",
            "in a loop",
            "ratio, beside",
            "in a loop",
        ]);
        for row in &self.updates {
            table.row([
                row.objects.to_string(),
                row.backend.name().to_owned(),
                row.workers.to_string(),
                format!("{:.1}", row.update_before_fps),
                format!("{:.1}", row.update_beside_fps),
                format!("{:.1}", row.update_in_loop_fps),
                format!("{:.2}", row.beside_ratio),
                format!("{:.2}", row.in_loop_ratio),
            ]);
        }
        table.print();
    }

    fn print_splits(&self) {
        print_line!(
            "Splits: ratios of fps, to single; until drawn: by material to by process, with the device's time\n"
        );
        let mut table = Table::new(&[
            "objects",
            "shadow maps",
            "backend",
            "workers",
            "single fps",
            "by process",
            "by material",
            "by draws",
            "until drawn",
        ]);
        for row in &self.splits {
            table.row([
                row.objects.to_string(),
                row.shadow_maps.to_string(),
                row.backend.name().to_owned(),
                row.workers.to_string(),
                format!("{:.1}", row.single_fps),
                format!("{:.2}", row.by_process_ratio),
                format!("{:.2}", row.by_material_ratio),
                format!("{:.2}", row.by_draws_ratio),
                optional(row.by_material_drawn_ratio, 2),
            ]);
        }
        table.print();
    }

    fn print_rates(&self) {
        let mut table = Table::new(&[
            "objects",
            "backend",
            "workers",
            "instancing",
            "single fps",
            "multi fps",
            "ratio",
            "one worker, cached",
            "direct",
            "ceiling",
            "single, drawn",
            "multi, drawn",
            "ratio, drawn",
        ]);
        for row in &self.scenarios {
            let [objects, backend, workers, instancing] = configuration(row);
            table.row([
                objects,
                backend,
                workers,
                instancing,
                format!("{:.1}", row.single_fps),
                format!("{:.1}", row.multi_fps),
                format!("{:.2}", row.ratio),
                optional(row.cached_ratio, 2),
                optional(row.direct_ratio, 2),
                format!("{:.2}", row.ceiling),
                optional(row.single_drawn_fps, 1),
                optional(row.multi_drawn_fps, 1),
                optional(row.drawn_ratio, 2),
            ]);
        }
        table.print();
    }

    fn print_shares(&self) {
        let mut table = Table::new(&[
            "objects",
            "backend",
            "workers",
            "instancing",
            "single held ms",
            "multi held ms",
            "single held %",
            "multi held %",
            "load of the caller %",
            "of the others %",
            "single CPU use %",
            "multi CPU use %",
            "single API %",
            "multi API %",
        ]);
        let percent = |share: f64| format!("{:.0}", share * 100.0);
        for row in &self.scenarios {
            let [objects, backend, workers, instancing] = configuration(row);
            let (caller, others) =
                row.multi_loads.split_first().map_or((f64::NAN, &[][..]), |(caller, others)| (*caller, others));
            let mean = others.iter().sum::<f64>() / others.len() as f64;
            table.row([
                objects,
                backend,
                workers,
                instancing,
                format!("{:.4}", row.single_held_ms),
                format!("{:.4}", row.multi_held_ms),
                percent(row.single_held_share),
                percent(row.multi_held_share),
                percent(caller),
                if others.is_empty() { String::new() } else { percent(mean) },
                optional(row.single_cpu_use.map(|share| share * 100.0), 0),
                optional(row.multi_cpu_use.map(|share| share * 100.0), 0),
                percent(row.single_api_share),
                percent(row.multi_api_share),
            ]);
        }
        table.print();
    }

    /// The targets on `noop`: frames and growth with two workers and without instancing, splits with more workers than
    /// processes.
    pub fn targets(&self) -> Targets {
        let mut targets = Targets::new();
        let has_target = |row: &&scenario::Row| row.backend == BackendName::Noop && row.workers == 2 && !row.instancing;
        for row in self.scenarios.iter().filter(has_target) {
            let bound = match row.objects {
                7 | 16 | 106 => 0.97,
                1_006 => 1.70,
                2_006 => 1.80,
                10_000 => 1.90,
                _ => continue,
            };
            targets.at_least(format!("{} objects, ratio", row.objects), bound, row.ratio);
            if row.objects >= 1_000 {
                let figure = format!("{} objects, ratio ÷ ceiling", row.objects);
                targets.at_least(figure, 0.9, row.ratio / row.ceiling);
            }
        }
        // With a process for each worker, L's split by process suffices. By material there is always one for each, so
        // with more workers the best split is still a peer.
        let has_target = |row: &&splits::Row| row.backend == BackendName::Noop && row.workers > 1 + row.shadow_maps;
        for row in self.splits.iter().filter(has_target) {
            let figure = format!(
                "{} objects, {} shadow maps, {} workers, by draws ÷ best split of L 5",
                row.objects, row.shadow_maps, row.workers
            );
            targets.at_least(figure, 1.0, row.by_draws_ratio / row.by_process_ratio.max(row.by_material_ratio));
        }
        let has_target = |row: &&growth::Row| row.backend == BackendName::Noop && row.workers == 2;
        let growth: Vec<_> = self.growth.iter().filter(has_target).collect();
        if let [first, .., last] = growth[..] {
            let figure = format!("{} ÷ {} objects, ns an object and view", last.objects, first.objects);
            targets.at_most(figure, 1.5, last.ns_per_object_view / first.ns_per_object_view);
        }
        targets
    }

    /// # Errors
    /// Returns an error if a file cannot be written.
    pub fn write(&self) -> Result<(), Box<dyn Error>> {
        let scenarios = self.scenarios.iter().map(Row::Scenario);
        let updates = self.updates.iter().map(Row::Update);
        let splits = self.splits.iter().map(Row::Split);
        let rows: Vec<_> = scenarios.chain(updates).chain(splits).chain(self.growth.iter().map(Row::Growth)).collect();
        results::write_json("objects.json", &rows)?;
        charts::draw(&results::file("objects.svg")?, &self.scenarios)
    }
}

/// The first cells of a row.
fn configuration(row: &scenario::Row) -> [String; 4] {
    let instancing = if row.instancing { "on" } else { "off" };
    [row.objects.to_string(), row.backend.name().to_owned(), row.workers.to_string(), instancing.to_owned()]
}

/// A cell, which is empty without a figure.
fn optional(figure: Option<f64>, decimals: usize) -> String {
    figure.map_or(String::new(), |figure| format!("{figure:.decimals$}"))
}
