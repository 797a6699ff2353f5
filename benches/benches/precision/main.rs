//! The error of vertex positions in pictures of 1080 rows, by the distance of the camera from the world's origin.
//!
//!     cargo bench -p drawloom-benches --bench precision
//!     cargo bench -p drawloom-benches --bench precision -- --quick
//!
//! Compares two transforms with f64. *Relative* is this crate's: it subtracts the camera's position from the object's in fixed point,
//! and then computes in f32 exactly what its shaders do. *Absolute* is that of most engines: f32 world positions and a matrix per
//! step. Vertices are random, with a fixed seed: they belong to rotated and scaled objects at least as far from the camera as they are
//! large, anywhere in the picture. A vertex that is lost counts as the picture's diagonal.
//!
//! Fails if a view exceeds its bound of 1e-3 pixels, or, of the views that magnify angles, the worst angle that f32 can lose.
//! `target/drawloom/precision.json` and `.svg` have the same.

mod report;

use std::error::Error;

use clap::Parser;
use drawloom_benches::arguments::ExtentArguments;
use drawloom_benches::harness::progress_bar;
use drawloom_testing::precision::cases::Kind;
use drawloom_testing::precision::measure::{BOUNDED, MAGNIFYING, Origin, measure};
use drawloom_testing::random::Random;

use report::{Report, Row};

/// A typical camera.
const TYPICAL: Kind = Kind::Perspective { degrees: 60.0, size: Kind::FULL_HD };

fn main() -> Result<(), Box<dyn Error>> {
    let quick = ExtentArguments::parse().is_quick();
    let [by_distance, by_view] = if quick { [500, 1_000] } else { [200_000, 100_000] };
    let distances: Vec<_> = (0..10).map(|power| 10_f64.powi(power)).collect();
    let steps = distances.len() + BOUNDED.len() + MAGNIFYING.len();
    let progress = progress_bar("views");
    progress.set_length(steps as u64);
    let mut random = Random::new();
    let mut report = Report::default();
    for distance in distances {
        progress.set_message(format!("{distance:.0e} m"));
        let found = measure(TYPICAL, Origin::At(distance), by_distance, &mut random)?;
        report.rows.push(Row::new(TYPICAL, Some(distance), true, found));
        progress.inc(1);
    }
    for (kind, is_held) in BOUNDED.map(|kind| (kind, true)).into_iter().chain(MAGNIFYING.map(|kind| (kind, false))) {
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
