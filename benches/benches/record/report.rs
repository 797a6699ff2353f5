//! The results, as a table, JSON and a chart.

use std::error::Error;

use drawloom_benches::backends::{BackendName, adapter_name};
use drawloom_benches::chart::{self, HorizontalBars, Panel};
use drawloom_benches::results;
use drawloom_benches::table::Table;
use serde::Serialize;

use crate::Extent;
use crate::measure::Measured;

/// A technique on a number of workers.
#[derive(Serialize)]
pub struct Row {
    pub technique: &'static str,
    pub backend: BackendName,
    pub workers: usize,
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
}

impl Report {
    pub fn new(extent: &Extent) -> Self {
        Self { extent: extent.name, rounds: extent.rounds, objects: extent.objects, measured: Vec::new() }
    }

    pub fn print(&self) {
        let [noop, adapter] = self.rounds;
        let note = if self.extent == "full" { "" } else { " (meaningless figures)" };
        println!("{} run{note}: medians of {noop} rounds on noop and {adapter} on the adapter", self.extent);
        println!("adapter: {}", adapter_name().as_deref().unwrap_or("none"));
        println!("4 cameras × {} moving objects; ns: from visibility to submit, per object and view", self.objects);
        println!("requests: for memory, a frame; own: where the backend does nothing");
        println!("of naive: the median of rounds, of two turns of one round each\n");
        let headings = ["technique", "backend", "workers", "ns", "of naive", "requests", "own requests"];
        let mut table = Table::new(&headings);
        for row in self.rows() {
            table.row([
                row.technique.to_owned(),
                row.backend.name().to_owned(),
                row.workers.to_string(),
                format!("{:.1}", row.ns_per_object_view),
                format!("1/{:.1}", row.speed_up_over_naive),
                row.allocations_per_frame.to_string(),
                row.own_allocations_per_frame.map_or_else(String::new, |own| own.to_string()),
            ]);
        }
        table.print();
        for Measured { backend, independent, speed_ups, .. } in &self.measured {
            println!(
                "{}: two threads that draw a frame each, and share nothing, take {independent:.1} ns: {:.2} times as fast as one",
                backend.name(),
                speed_ups[1]
            );
        }
        println!();
        self.print_targets();
    }

    /// Prints the targets on `noop`, and what was reached.
    fn print_targets(&self) {
        let Some(noop) = self.measured.iter().find(|measured| measured.backend == BackendName::Noop) else { return };
        let two = noop.rows.iter().find(|row| (row.technique, row.workers) == ("drawloom", 2));
        let of_naive = two.map_or(f64::NAN, |two| two.speed_up_over_naive);
        println!("Targets and results on noop\n");
        let mut table = Table::new(&["figure", "target", "reached"]);
        for (figure, target, reached) in [
            ("naive, of drawloom with 2 workers", 20.0, of_naive),
            ("by-mesh on 1 thread, of drawloom with 1 worker", 1.67, noop.speed_ups_over_by_mesh[0]),
            ("by-mesh on 2 threads, of drawloom with 2 workers", 1.67, noop.speed_ups_over_by_mesh[1]),
            ("drawloom with 1 worker, of 2", 1.8, noop.speed_ups[0]),
        ] {
            let note = if reached >= target { "" } else { ", short" };
            table.row([figure.to_owned(), format!("{target:.2}"), format!("{reached:.2}{note}")]);
        }
        table.print();
    }

    fn rows(&self) -> impl Iterator<Item = &Row> {
        self.measured.iter().flat_map(|measured| &measured.rows)
    }

    /// # Errors
    /// Returns an error if a file cannot be written.
    pub fn write(&self) -> Result<(), Box<dyn Error>> {
        results::write_json("record.json", &self.rows().collect::<Vec<_>>())?;
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
    let Row { technique, workers, .. } = row;
    let plural = if *workers == 1 { "" } else { "s" };
    let color = match *technique {
        "drawloom" => 6,
        name if name.starts_with("drawloom") => 3,
        _ => 0,
    };
    (format!("{technique}, {workers} thread{plural}"), row.ns_per_object_view, color)
}
