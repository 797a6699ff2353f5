//! The results, as a table and as JSON.

use std::io;

use drawloom_benches::results;
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use drawloom_output::print_line;
use serde::Serialize;

use crate::shape::Shape;

/// The results.
#[derive(Serialize)]
pub struct Figures {
    pub rounds: usize,
    pub timed: Vec<TimedFigures>,
    /// Nanoseconds per span without a subscriber.
    pub span: f64,
    /// Empty in a quick run.
    pub counted: Vec<Counted>,
    /// Memory of the rings per worker.
    pub ring_bytes: usize,
}

/// A row that was timed with the recorder off and on: medians, in nanoseconds.
#[derive(Serialize)]
pub struct TimedFigures {
    pub row: &'static str,
    /// Chunks in a frame.
    pub chunks: usize,
    /// A frame with the recorder off.
    pub frame: f64,
    /// The cost of recording per chunk: the difference of the frame times, times the workers, divided by the chunks.
    pub a_chunk: f64,
    /// The share of the frame time that recording adds.
    pub share: f64,
}

/// Instructions per chunk.
#[derive(Serialize)]
pub struct Counted {
    pub shape: Shape,
    /// With the recorder off.
    pub off: f64,
    /// Without a recorder.
    pub without: f64,
}

pub struct Report {
    figures: Figures,
}

impl Report {
    pub fn new(figures: Figures) -> Self {
        Self { figures }
    }

    pub fn print(&self, quick: bool) {
        let Figures { rounds, timed, span, counted, ring_bytes } = &self.figures;
        let note = if quick { "; a quick run with inaccurate figures" } else { "" };
        print_line!("recording, median of {rounds} rounds{note}\n");
        let mut table = Table::new(&["row", "chunks", "frame, µs", "on: ns per chunk", "on: % of the frame"]);
        for row in timed {
            let (frame, share) = (row.frame / 1e3, row.share * 100.0);
            let figures = [format!("{frame:.1}"), format!("{:.1}", row.a_chunk), format!("{share:.2}")];
            let [frame, a_chunk, share] = figures;
            table.row([row.row.to_owned(), row.chunks.to_string(), frame, a_chunk, share]);
        }
        table.print();
        if !counted.is_empty() {
            let mut table = Table::new(&["instructions per chunk", "without a recorder", "off", "more"]);
            for Counted { shape, off, without } in counted {
                let figures = [*without, *off, off - without].map(|figure| format!("{figure:.2}"));
                let [without, off, more] = figures;
                table.row([shape.name().to_owned(), without, off, more]);
            }
            table.print();
        }
        print_line!(
            "a span without a subscriber: {span:.1} ns; rings: {:.1} MiB a worker",
            *ring_bytes as f64 / 1048576.0
        );
    }

    /// The targets: a timeline that is off costs at most a quarter of an instruction a chunk. A quick run counts none.
    pub fn targets(&self) -> Targets {
        let mut targets = Targets::new();
        for Counted { shape, off, without } in &self.figures.counted {
            targets.at_most(format!("{}, off, more instructions a chunk", shape.name()), 0.25, off - without);
        }
        targets
    }

    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write(&self) -> io::Result<()> {
        results::write_json("timeline.json", &self.figures)
    }
}
