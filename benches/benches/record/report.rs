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
use crate::own_draws::{self, OwnRow};
use crate::technique::BY_MESH_SCENES;
use crate::textured::{self, TexturedRow};

/// A technique on a number of workers.
#[derive(Serialize)]
pub struct Row {
    pub technique: &'static str,
    pub scene: &'static str,
    pub backend: BackendName,
    pub workers: usize,
    /// How a hand-written technique divides its work among them; empty for one thread.
    #[serde(skip_serializing_if = "str::is_empty")]
    pub threads: &'static str,
    /// Whether equal objects are one draw.
    #[serde(skip)]
    pub is_instanced: bool,
    /// Whether it is a technique of this crate.
    #[serde(skip)]
    pub is_drawloom: bool,
    pub ns_per_object_view: f64,
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
    workers: Vec<usize>,
    pub measured: Vec<Measured>,
    pub extents: Vec<ExtentRow>,
    pub own_draws: Vec<OwnRow>,
    pub textured: Vec<TexturedRow>,
}

impl Report {
    pub fn new(extent: &Extent, workers: &[usize]) -> Self {
        Self {
            extent: extent.name,
            rounds: extent.rounds,
            objects: extent.objects,
            workers: workers.to_vec(),
            measured: Vec::new(),
            extents: Vec::new(),
            own_draws: Vec::new(),
            textured: Vec::new(),
        }
    }

    pub fn print(&self) {
        let [noop, adapter] = self.rounds;
        let note = if self.extent == "full" { "" } else { " (meaningless figures)" };
        print_line!("{} run{note}: medians of {noop} rounds on noop and {adapter} on the adapter", self.extent);
        print_line!("adapter: {}", adapter_name().as_deref().unwrap_or("none"));
        print_line!("4 cameras × {} objects; ns: from visibility to submit, per object and view", self.objects);
        print_line!("requests: for memory, a frame; own: where the backend does nothing");
        print_line!(
            "ratios, also of targets: of these medians; threads: how what is written by hand divides its work\n"
        );
        print_line!("Instanced draws: 64 a camera\n");
        self.print_rows(|row| row.is_instanced);
        print_line!("\nSingle draws: {} a camera\n", self.objects);
        self.print_rows(|row| !row.is_instanced);
        print_line!();
        for Measured { backend, independent, .. } in &self.measured {
            for (threads, nanoseconds) in independent {
                print_line!(
                    "{}: {threads} threads that draw a frame each, and share nothing, take {nanoseconds:.1} ns",
                    backend.name()
                );
            }
        }
        print_line!();
        if !self.extents.is_empty() {
            extents::print(&self.extents);
        }
        if !self.own_draws.is_empty() {
            own_draws::print(&self.own_draws);
        }
        if !self.textured.is_empty() {
            textured::print(&self.textured);
        }
    }

    fn print_rows(&self, is_shown: impl Fn(&Row) -> bool) {
        let headings =
            ["technique", "scene", "backend", "workers", "threads", "ns", "of naive", "requests", "own requests"];
        let mut table = Table::new(&headings);
        for row in self.rows().filter(|row| is_shown(row)) {
            let of_naive = self.nanoseconds(row.backend, "naive", Motion::Everything, 1) / row.ns_per_object_view;
            table.row([
                row.technique.to_owned(),
                row.scene.to_owned(),
                row.backend.name().to_owned(),
                row.workers.to_string(),
                row.threads.to_owned(),
                format!("{:.1}", row.ns_per_object_view),
                format!("1/{of_naive:.1}"),
                row.allocations_per_frame.to_string(),
                row.own_allocations_per_frame.map_or_else(String::new, |own| own.to_string()),
            ]);
        }
        table.print();
    }

    /// Nanoseconds per object and view. NaN if that was not measured.
    fn nanoseconds(&self, backend: BackendName, technique: &str, scene: Motion, workers: usize) -> f64 {
        let wanted = (backend, technique, scene.name(), workers);
        let mut rows = self.rows();
        let row = rows.find(|row| (row.backend, row.technique, row.scene, row.workers) == wanted);
        row.map_or(f64::NAN, |row| row.ns_per_object_view)
    }

    /// The fastest technique that is written by hand, on at most as many threads.
    fn fastest_peer(&self, scene: Motion, threads: usize, is_instanced: bool) -> Option<&Row> {
        let is_peer = |row: &&Row| {
            !row.is_drawloom
                && (row.backend, row.scene, row.is_instanced) == (BackendName::Noop, scene.name(), is_instanced)
                && row.workers <= threads
        };
        self.rows().filter(is_peer).min_by(|one, other| one.ns_per_object_view.total_cmp(&other.ns_per_object_view))
    }

    /// The targets on `noop`, and what was reached.
    pub fn targets(&self) -> Targets {
        let mut targets = Targets::new();
        let Some(noop) = self.measured.iter().find(|measured| measured.backend == BackendName::Noop) else {
            return targets;
        };
        let nanoseconds = |technique, scene, workers| self.nanoseconds(BackendName::Noop, technique, scene, workers);
        for &workers in &self.workers {
            for scene in BY_MESH_SCENES {
                self.add_peer(&mut targets, "drawloom", scene, workers, 0.6);
            }
        }
        for &workers in &self.workers {
            self.add_peer(&mut targets, "drawloom-not-instanced", Motion::Everything, workers, 0.5);
        }
        for &(threads, independent) in &noop.independent {
            let several = threads as f64;
            for scene in BY_MESH_SCENES {
                let figure = format!("drawloom, 1 worker ÷ {threads} workers, {}", scene.name());
                let speed_up = nanoseconds("drawloom", scene, 1) / nanoseconds("drawloom", scene, threads);
                targets.at_least(figure, 0.9 * several, speed_up);
            }
            let figure = format!("{threads} independent threads ÷ drawloom, {threads} workers, moving");
            targets.at_least(figure, 0.9, independent / nanoseconds("drawloom", Motion::Everything, threads));
        }
        let [Some(&few), Some(&many)] = [self.workers.first(), self.workers.last()] else { return targets };
        let of_moving = |scene| nanoseconds("drawloom", scene, few) / nanoseconds("drawloom", Motion::Everything, few);
        let extent = |scene, workers| self.extents.iter().find(|row| (row.scene, row.workers) == (scene, workers));
        let microseconds = |scene| extent(scene, few).map_or(f64::NAN, |row| row.microseconds_per_frame);
        let per_object = |scene| {
            let row = extent(scene, many);
            row.map_or(f64::NAN, |row| row.microseconds_per_frame / (row.objects * row.cameras) as f64)
        };
        targets.at_most("one percent moving ÷ moving", 0.2, of_moving(Motion::OnePercent));
        targets.at_most("still, cameras moving ÷ moving", 0.5, of_moving(Motion::Cameras));
        targets.at_most("still, 100,000 objects in one view, µs a frame", 30.0, microseconds(extents::STILL));
        targets.at_most(
            "64 cameras, 50 of 100,000 ÷ 50 of 3,200 objects",
            1.5,
            microseconds(extents::FEW_OF_MANY) / microseconds(extents::FEW_OF_FEW),
        );
        targets.at_most(
            format!("1,000,000 ÷ 10,000 objects, an object and view, {}", count(many, "worker")),
            1.3,
            per_object(extents::MOVING_MANY) / per_object(extents::MOVING_FEW),
        );
        own_draws::add_targets(&self.own_draws, &self.workers, &mut targets);
        textured::add_targets(&self.textured, &mut targets);
        targets
    }

    /// Adds the target that a technique takes at most a share of the time of its fastest peer.
    fn add_peer(&self, targets: &mut Targets, technique: &str, scene: Motion, workers: usize, bound: f64) {
        let Some(peer) = self.fastest_peer(scene, workers, technique == "drawloom") else { return };
        let peer_name = [peer.technique, &count(peer.workers, "thread"), peer.threads].join(" ");
        let (peer_name, ours) = (peer_name.trim_end(), self.nanoseconds(BackendName::Noop, technique, scene, workers));
        let figure = format!("{technique}, {} ÷ {peer_name}, {}", count(workers, "worker"), scene.name());
        targets.at_most(figure, bound, ours / peer.ns_per_object_view);
    }

    fn rows(&self) -> impl Iterator<Item = &Row> {
        self.measured.iter().flat_map(|measured| &measured.rows)
    }

    /// # Errors
    /// Returns an error if a file cannot be written.
    pub fn write(&self) -> Result<(), Box<dyn Error>> {
        results::write_json("record.json", &self.rows().collect::<Vec<_>>())?;
        results::write_json("record_extents.json", &self.extents)?;
        results::write_json("record_own_draws.json", &self.own_draws)?;
        results::write_json("record_textured.json", &self.textured)?;
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
    let Row { technique, scene, workers, threads, .. } = row;
    let color = match *technique {
        "drawloom" => 6,
        name if name.starts_with("drawloom") => 3,
        _ => 0,
    };
    let threads = [&count(*workers, "thread"), *threads].join(" ");
    (format!("{technique}, {scene}, {}", threads.trim_end()), row.ns_per_object_view, color)
}

pub fn count(number: usize, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}
