//! What was found, as tables and as JSON.

use std::io;

use drawloom_benches::results;
use drawloom_benches::table::Table;
use drawloom_testing::culling::boxes::{BoxTallies, VOLUMES};
use drawloom_testing::culling::spheres::SphereTallies;
use drawloom_testing::culling::tally::Tallies;
use serde::Serialize;

use crate::speed::Speed;

/// The largest share of what is outside, and touches no plane by construction, that may be kept.
const MOST_FALSE_VISIBLES: f64 = 1e-3;

/// What was found.
#[derive(Serialize)]
pub struct Report {
    extent: &'static str,
    speeds: Vec<Speed>,
    tests: Vec<Line>,
    /// Objects that the table refused.
    rejected: u64,
}

/// What was counted of one test.
#[derive(Serialize)]
struct Line {
    test: String,
    /// Whether it is this crate's.
    is_ours: bool,
    #[serde(flatten)]
    tallies: Tallies,
}

impl Report {
    pub fn new(extent: &'static str, speeds: Vec<Speed>, spheres: &SphereTallies, boxes: &BoxTallies) -> Self {
        let ours = |test: &str, tallies| Line { test: test.to_owned(), is_ours: true, tallies };
        let mut tests = vec![ours("sphere", spheres.ours)];
        for (volume, tallies) in VOLUMES.iter().zip(boxes.volumes) {
            tests.push(ours(&format!("object, {volume:?}"), tallies));
        }
        tests.push(Line { test: "naive sphere, f32".to_owned(), is_ours: false, tallies: spheres.naive });
        Self { extent, speeds, tests, rejected: boxes.rejected }
    }

    pub fn print(&self) {
        let note = if self.extent == "full" { "" } else { ", whose figures mean little" };
        println!("{} run{note}: medians, on one thread\n", self.extent);
        let mut table = Table::new(&["scene", "volume", "objects", "ns an object", "seen"]);
        self.speeds.iter().for_each(|speed| table.line(speed.cells()));
        table.print();
        println!("false visible: of what is outside by the oracle, the share that is kept\n");
        let mut table = Table::new(&["test", "cases", "population", "false culls", "outside", "false visible"]);
        for Line { test, tallies, .. } in &self.tests {
            for (population, tally) in [("tangent", &tallies.tangent), ("anywhere", &tallies.anywhere)] {
                table.line([
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

    /// What is not as it has to be, if anything.
    pub fn problem(&self) -> Option<String> {
        if self.rejected > 0 {
            return Some(format!("{} objects were refused, and so not tried", self.rejected));
        }
        let ours = self.tests.iter().filter(|line| line.is_ours);
        ours.filter_map(|Line { test, tallies, .. }| {
            let share = tallies.anywhere.false_share();
            if tallies.false_culls() > 0 {
                Some(format!("{test}: {} of {} cases falsely culled", tallies.false_culls(), tallies.cases()))
            } else if share > MOST_FALSE_VISIBLES {
                Some(format!("{test}: {share:.1e} of what is outside is kept, and {MOST_FALSE_VISIBLES:.0e} may be"))
            } else {
                None
            }
        })
        .next()
    }

    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self) -> io::Result<()> {
        results::write_json("culling.json", self)
    }
}
