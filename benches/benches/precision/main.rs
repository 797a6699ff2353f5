//! How far off vertices are in pictures of 1080 rows, by how far the camera is from the world's origin.
//!
//!     cargo bench -p drawloom-benches --bench precision
//!     cargo bench -p drawloom-benches --bench precision -- --quick
//!
//! Two ways to a place in the picture are measured against f64: *relative* is this crate's, which takes the camera's place from
//! the object's in fixed point and does in f32 just what its shaders do; *absolute* is what most engines do, f32 places in the
//! world and a matrix for each step. Vertices are drawn at random, seeded: of turned and scaled objects at least as far from the
//! camera as they are large, anywhere in the picture. A vertex that is lost altogether counts as the picture's diagonal.
//!
//! Ends with an error if a view that is to hold 1e-3 pixels does not, or if another loses more of an angle than f32 can at worst.
//! Written to `drawloom/precision.json` and `.svg` in the target folder too.

mod report;

use std::error::Error;

use clap::Parser;
use drawloom_benches::quick::Quick;
use drawloom_testing::precision::cases::Kind;
use drawloom_testing::precision::measure::{HELD, MAGNIFYING, Origin, measure};
use drawloom_testing::random::Random;
use indicatif::{ProgressBar, ProgressStyle};

use report::{Report, Row};

/// What most cameras are.
const USUAL: Kind = Kind::Perspective { degrees: 60.0, size: Kind::FULL_HD };

fn main() -> Result<(), Box<dyn Error>> {
    let quick = Quick::parse().is_quick();
    let [by_distance, by_view] = if quick { [500, 1_000] } else { [200_000, 100_000] };
    let distances: Vec<_> = (0..10).map(|power| 10_f64.powi(power)).collect();
    let steps = distances.len() + HELD.len() + MAGNIFYING.len();
    let progress = ProgressBar::new(steps as u64);
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} views, {eta} left  {msg}")?);
    let mut random = Random::new();
    let mut report = Report::default();
    for distance in distances {
        progress.set_message(format!("{distance:.0e} m"));
        let found = measure(USUAL, Origin::At(distance), by_distance, &mut random)?;
        report.rows.push(Row::new(USUAL, Some(distance), true, found));
        progress.inc(1);
    }
    for (kind, is_held) in HELD.map(|kind| (kind, true)).into_iter().chain(MAGNIFYING.map(|kind| (kind, false))) {
        progress.set_message(kind.name());
        report.rows.push(Row::new(kind, None, is_held, measure(kind, Origin::Anywhere, by_view, &mut random)?));
        progress.inc(1);
    }
    progress.finish_and_clear();
    report.print();
    if !quick {
        report.write()?;
    }
    report.check()
}
