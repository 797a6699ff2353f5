//! The results, as a table, JSON and a chart.

use std::error::Error;

use drawloom_benches::backends::{BackendName, adapter_name};
use drawloom_benches::chart::{self, HorizontalBars, Panel};
use drawloom_benches::results;
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use serde::Serialize;

use drawloom_benches::moving::Motion;
use drawloom_output::print_line;

use crate::Extent;
use crate::extents::{self, ExtentRow};
use crate::measure::Measured;

/// A technique on a number of workers.
#[derive(Serialize)]
pub struct Row {
    pub technique: &'static str,
    pub scene: &'static str,
    pub backend: BackendName,
    pub workers: usize,
    /// Whether equal objects are one draw.
    #[serde(skip)]
    pub is_instanced: bool,
    pub ns_per_object_view: f64,
    /// Speed-up over naive.
    #[serde(skip)]
    pub speed_up_over_naive: f64,
    pub allocations_per_frame: usize,
    /// The renderer's own, without those of the wgpu backend: measured on the no-op backend.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own_allocations_per_frame: Option<usize>,
}

/// The results.
pub struct Report {
    extent: &'static str,
    rounds: [usize; 2],
    objects: usize,
    pub measured: Vec<Measured>,
    pub extents: Vec<ExtentRow>,
}

impl Report {
    pub fn new(extent: &Extent) -> Self {
        Self {
            extent: extent.name,
            rounds: extent.rounds,
            objects: extent.objects,
            measured: Vec::new(),
            extents: Vec::new(),
        }
    }

    pub fn print(&self) {
        let [noop, adapter] = self.rounds;
        let note = if self.extent == "full" { "" } else { " (meaningless figures)" };
        print_line!("{} run{note}: medians of {noop} rounds on noop and {adapter} on the adapter", self.extent);
        print_line!("adapter: {}", adapter_name().as_deref().unwrap_or("none"));
        print_line!("4 cameras × {} objects; ns: from visibility to submit, per object and view", self.objects);
        print_line!("requests: for memory, a frame; own: where the backend does nothing");
        print_line!("of naive: the median of rounds, of two turns of one round each\n");
        print_line!("Instanced draws: 64 a camera\n");
        self.print_rows(|row| row.is_instanced);
        print_line!("\nSingle draws: {} a camera\n", self.objects);
        self.print_rows(|row| !row.is_instanced);
        print_line!();
        for Measured { backend, independent, speed_ups, .. } in &self.measured {
            print_line!(
                "{}: two threads that draw a frame each, and share nothing, take {independent:.1} ns: {:.2} times as fast as one",
                backend.name(),
                speed_ups[1]
            );
        }
        print_line!();
        if !self.extents.is_empty() {
            extents::print(&self.extents);
        }
    }

    fn print_rows(&self, is_shown: impl Fn(&Row) -> bool) {
        let headings = ["technique", "scene", "backend", "workers", "ns", "of naive", "requests", "own requests"];
        let mut table = Table::new(&headings);
        for row in self.rows().filter(|row| is_shown(row)) {
            table.row([
                row.technique.to_owned(),
                row.scene.to_owned(),
                row.backend.name().to_owned(),
                row.workers.to_string(),
                format!("{:.1}", row.ns_per_object_view),
                format!("1/{:.1}", row.speed_up_over_naive),
                row.allocations_per_frame.to_string(),
                row.own_allocations_per_frame.map_or_else(String::new, |own| own.to_string()),
            ]);
        }
        table.print();
    }

    /// The targets on `noop`, and what was reached.
    pub fn targets(&self) -> Targets {
        let mut targets = Targets::new();
        let Some(noop) = self.measured.iter().find(|measured| measured.backend == BackendName::Noop) else {
            return targets;
        };
        let of_moving =
            |name| noop.of_moving.iter().find(|(scene, _)| *scene == name).map_or(f64::NAN, |(_, share)| *share);
        let microseconds = |scene, workers| {
            let row = self.extents.iter().find(|row| (row.scene, row.workers) == (scene, workers));
            row.map_or(f64::NAN, |row| row.microseconds_per_frame)
        };
        let per_object = |scene| {
            let row = self.extents.iter().find(|row| (row.scene, row.workers) == (scene, 2));
            row.map_or(f64::NAN, |row| row.microseconds_per_frame / (row.objects * row.cameras) as f64)
        };
        let [two, independent] = noop.speed_ups;
        targets.at_most("drawloom with 1 worker ÷ by-mesh on 1 thread", 0.6, noop.of_by_mesh[0]);
        targets.at_most("drawloom with 2 workers ÷ by-mesh on 2 threads", 0.6, noop.of_by_mesh[1]);
        targets.at_least("drawloom with 1 worker ÷ 2 workers", 1.8, two);
        targets.at_least("the same ÷ that of two independent threads", 0.9, two / independent);
        targets.at_most("not instanced with 2 workers ÷ encoder-per-thread", 0.5, noop.of_encoders);
        targets.at_most("one percent moving ÷ moving", 0.2, of_moving(Motion::OnePercent.name()));
        targets.at_most("still, cameras moving ÷ moving", 0.5, of_moving(Motion::Cameras.name()));
        targets.at_most("still, 100,000 objects in one view, µs a frame", 30.0, microseconds(extents::STILL, 1));
        targets.at_most(
            "64 cameras, 50 of 100,000 ÷ 50 of 3,200 objects",
            1.5,
            microseconds(extents::FEW_OF_MANY, 1) / microseconds(extents::FEW_OF_FEW, 1),
        );
        targets.at_most(
            "1,000,000 ÷ 10,000 objects, an object and view, 2 workers",
            1.3,
            per_object(extents::MOVING_MANY) / per_object(extents::MOVING_FEW),
        );
        targets
    }

    fn rows(&self) -> impl Iterator<Item = &Row> {
        self.measured.iter().flat_map(|measured| &measured.rows)
    }

    /// # Errors
    /// Returns an error if a file cannot be written.
    pub fn write(&self) -> Result<(), Box<dyn Error>> {
        results::write_json("record.json", &self.rows().collect::<Vec<_>>())?;
        results::write_json("record_extents.json", &self.extents)?;
        let panel = |&backend: &BackendName| {
            let rows = self.rows().filter(|row| row.backend == backend);
            let mut bars: Vec<_> = rows.map(bar).collect();
            bars.sort_by(|one, other| other.1.total_cmp(&one.1));
            let title = format!("ns an object and view, from visibility to submit, {}", backend.name());
            (!bars.is_empty()).then_some(Panel::HorizontalBars(HorizontalBars { title, bars }))
        };
        let panels: Vec<_> = BackendName::ALL.iter().filter_map(panel).collect();
        chart::draw(&results::file("record.svg")?, &panels)
    }
}

/// Hand-written techniques are grey; this crate's are blue, and its default is green.
fn bar(row: &Row) -> (String, f64, usize) {
    let Row { technique, scene, workers, .. } = row;
    let plural = if *workers == 1 { "" } else { "s" };
    let color = match *technique {
        "drawloom" => 6,
        name if name.starts_with("drawloom") => 3,
        _ => 0,
    };
    (format!("{technique}, {scene}, {workers} thread{plural}"), row.ns_per_object_view, color)
}
