//! The results, as a table and as JSON.

use std::io;

use drawloom::command::RenderCommand;
use drawloom_benches::results;
use drawloom_benches::table::Table;
use drawloom_output::print_line;
use serde::Serialize;

/// A scene, with times in nanoseconds per command.
#[derive(Serialize)]
pub struct Row {
    pub scene: &'static str,
    /// Number of commands of all processes and views.
    pub commands: usize,
    /// Mean bytes per delta command.
    pub bytes: f64,
    /// Time to encode the commands.
    pub encode: f64,
    /// Time to validate bytes from another source.
    pub check: f64,
    /// Time to decode them to the fixed form.
    pub decode: f64,
    /// Time to copy the fixed form.
    pub copy: f64,
    /// Time to compare the fixed form with an equal one.
    pub compare: f64,
}

impl Row {
    /// The bandwidth in GB/s at which transferring the saved bytes takes as long as delta commands cost: encoding,
    /// validating and decoding, against a copy at either end.
    fn break_even(&self) -> f64 {
        let saved = size_of::<RenderCommand>() as f64 - self.bytes;
        saved / (self.encode + self.check + self.decode - 2.0 * self.copy)
    }
}

pub struct Report {
    rounds: usize,
    quick: bool,
    rows: Vec<Row>,
}

impl Report {
    pub fn new(rounds: usize, quick: bool) -> Self {
        Self { rounds, quick, rows: Vec::new() }
    }

    pub fn add(&mut self, row: Row) {
        self.rows.push(row);
    }

    pub fn print(&self) {
        let note = if self.quick { "; a quick run with inaccurate figures" } else { "" };
        print_line!("ns per command, median of {} rounds{note}", self.rounds);
        print_line!("fixed form: {} bytes per command; copy, compare: of the fixed form", size_of::<RenderCommand>());
        print_line!(
            "wins below: the bandwidth in GB/s of a memory or link below which fewer bytes save more time than they cost\n"
        );
        let headings = ["scene", "commands", "bytes", "encode", "check", "decode", "copy", "compare", "wins below"];
        let mut table = Table::new(&headings);
        for row in &self.rows {
            let figures = [row.bytes, row.encode, row.check, row.decode, row.copy, row.compare, row.break_even()];
            let [bytes, encode, check, decode, copy, compare, even] = figures.map(|figure| format!("{figure:.2}"));
            let scene = row.scene.to_owned();
            table.row([scene, row.commands.to_string(), bytes, encode, check, decode, copy, compare, even]);
        }
        table.print();
    }

    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write(&self) -> io::Result<()> {
        results::write_json("delta.json", &self.rows)
    }
}
