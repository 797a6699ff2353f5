//! What was measured, as a table and as JSON.

use std::io;

use drawloom_benches::results;
use drawloom_benches::table::Table;
use serde::Serialize;

use crate::shape::Shape;

/// What was measured.
#[derive(Serialize)]
pub struct Figures {
    pub rounds: u64,
    pub timed: Vec<TimedFigures>,
    /// Nanoseconds a span without a subscriber.
    pub span: f64,
    /// Instructions a chunk; none in a quick run.
    pub counted: Vec<Counted>,
    /// What the rings take, a worker.
    pub ring_bytes: usize,
}

/// A row that was timed with the recorder off and on: medians, in nanoseconds.
#[derive(Serialize)]
pub struct TimedFigures {
    pub row: &'static str,
    /// In a frame.
    pub chunks: usize,
    /// A frame with the recorder off.
    pub frame: f64,
    /// What recording adds to a chunk: what the frame is longer by, times the workers, divided by the chunks.
    pub a_chunk: f64,
    /// What it adds to the frame.
    pub share: f64,
}

/// Instructions a chunk.
#[derive(Serialize)]
pub struct Counted {
    pub shape: Shape,
    /// With the recorder off.
    pub off: f64,
    /// Without one.
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
        let note = if quick { "; a quick run, whose figures mean little" } else { "" };
        println!("recording, median of {rounds} rounds{note}\n");
        let mut table = Table::new(&["row", "chunks", "frame, µs", "on: ns a chunk", "on: % of the frame"]);
        for row in timed {
            let (frame, share) = (row.frame / 1e3, row.share * 100.0);
            let figures = [format!("{frame:.1}"), format!("{:.1}", row.a_chunk), format!("{share:.2}")];
            let [frame, a_chunk, share] = figures;
            table.line([row.row.to_owned(), row.chunks.to_string(), frame, a_chunk, share]);
        }
        table.print();
        if !counted.is_empty() {
            let mut table = Table::new(&["instructions a chunk", "without a recorder", "off", "more"]);
            for Counted { shape, off, without } in counted {
                let figures = [*without, *off, off - without].map(|figure| format!("{figure:.2}"));
                let [without, off, more] = figures;
                table.line([shape.name().to_owned(), without, off, more]);
            }
            table.print();
        }
        println!(
            "a span without a subscriber: {span:.1} ns; rings: {:.1} MiB a worker",
            *ring_bytes as f64 / 1048576.0
        );
    }

    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self) -> io::Result<()> {
        results::write_json("timeline.json", &self.figures)
    }
}
