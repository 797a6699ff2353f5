//! The results, as tables and as JSON.

use std::io;

use drawloom_benches::results;
use drawloom_benches::table::Table;
use drawloom_output::print_line;
use drawloom_testing::culling::boxes::{BoxTallies, VOLUMES};
use drawloom_testing::culling::spheres::SphereTallies;
use drawloom_testing::culling::tally::Tallies;
use serde::Serialize;

use crate::speed::Speed;

/// The maximum share of kept objects among those outside, for objects anywhere.
const MAX_FALSE_VISIBLES: f64 = 1e-3;

/// The results.
#[derive(Serialize)]
pub struct Report {
    extent: &'static str,
    speeds: Vec<Speed>,
    tests: Vec<Line>,
    /// Objects that the table rejected.
    rejected: u64,
}

/// The counts of one test.
#[derive(Serialize)]
struct Line {
    test: String,
    /// Whether it is a test of this crate.
    #[serde(rename = "is_ours")]
    is_drawloom: bool,
    #[serde(flatten)]
    tallies: Tallies,
}

impl Report {
    pub fn new(extent: &'static str, speeds: Vec<Speed>, spheres: &SphereTallies, boxes: &BoxTallies) -> Self {
        let drawloom = |test: &str, tallies| Line { test: test.to_owned(), is_drawloom: true, tallies };
        let mut tests = vec![drawloom("sphere", spheres.drawloom)];
        for (volume, tallies) in VOLUMES.iter().zip(boxes.volumes) {
            tests.push(drawloom(&format!("object, {volume:?}"), tallies));
        }
        let peer = |test: &str, tallies| Line { test: test.to_owned(), is_drawloom: false, tallies };
        tests.push(peer("naive sphere, f32", spheres.naive));
        tests.push(peer("naive sphere, SIMD, f32", spheres.lanes));
        Self { extent, speeds, tests, rejected: boxes.rejected }
    }

    pub fn print(&self) {
        let note = if self.extent == "full" { "" } else { " (inaccurate figures)" };
        print_line!("{} run{note}: medians, on one thread\n", self.extent);
        let mut table = Table::new(&["scene", "volume", "objects", "ns per object", "visible"]);
        self.speeds.iter().for_each(|speed| table.row(speed.cells()));
        table.print();
        print_line!("false visible: the share of the objects outside according to the oracle that is kept\n");
        let mut table = Table::new(&["test", "cases", "population", "false culls", "outside", "false visible"]);
        for Line { test, tallies, .. } in &self.tests {
            for (population, tally) in [("tangent", &tallies.tangent), ("anywhere", &tallies.anywhere)] {
                table.row([
                    test.clone(),
                    tally.cases.to_string(),
                    population.to_owned(),
                    tally.false_culls.to_string(),
                    tally.outside.to_string(),
                    format!("{:.1e}", tally.false_share()),
                ]);
            }
        }
        table.print();
    }

    /// The first rule that is broken, if any.
    pub fn problem(&self) -> Option<String> {
        if self.rejected > 0 {
            return Some(format!("{} objects were rejected and not tested", self.rejected));
        }
        let own = self.tests.iter().filter(|line| line.is_drawloom);
        own.filter_map(|Line { test, tallies, .. }| {
            let share = tallies.anywhere.false_share();
            if tallies.false_culls() > 0 {
                Some(format!("{test}: {} of {} cases falsely culled", tallies.false_culls(), tallies.cases()))
            } else if share > MAX_FALSE_VISIBLES {
                Some(format!(
                    "{test}: {share:.1e} of the objects outside are kept, and at most {MAX_FALSE_VISIBLES:.0e} may be"
                ))
            } else {
                None
            }
        })
        .next()
    }

    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write(&self) -> io::Result<()> {
        results::write_json("culling.json", self)
    }
}
