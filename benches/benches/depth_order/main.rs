//! What the depth order of opaque objects is worth, and what it costs.
//!
//!     cargo bench -p drawloom-benches --bench depth_order
//!     cargo bench -p drawloom-benches --bench depth_order -- --quick
//!
//! - *Sorting error*: 10,000 random distances of two distributions between 0.1 m and 10 km are sorted by their depth
//!   codes. Equal codes stay in random order, as equal keys are sorted by object index. The result is compared with the
//!   distances in sorted order.
//! - *Overdraw*: the number of shaded fragments divided by the number of covered pixels, and the instanced draws of a
//!   frame, by `Quality::opaque_order` and scene. The software backend draws opaque objects with a fragment shader that
//!   counts its calls, and does so only for fragments that pass the depth test. The sort key has the mesh above the
//!   depth, so it orders only objects of one mesh. The orders *across meshes* show what an order of all objects of a
//!   draw state would reach; their draws are the runs of objects with the same mesh. Two walls whose overdraw is known
//!   are drawn first, and the benchmark fails if it is another one.
//! - *Cost*: the CPU time of a frame from the hand-over of the scene to the return of submit, on wgpu's noop backend,
//!   per object and camera. 4 cameras look at a cloud of 10,000 objects, of which each moves, and the engine says
//!   nothing about it. In *moving* the same objects are seen in every frame, in *cameras turning* they are not. The
//!   figures are medians of interleaved rounds.
//!
//! Only the cost is timed: the other figures are the same on every machine. `target/drawloom/depth_order.json` has
//! overdraw and cost.

mod across_meshes;
mod cost;
mod fragment_counter;
mod known_overdraw;
mod overdraw;
mod sorting_error;

use std::error::Error;
use std::process::ExitCode;
use std::time::Duration;

use drawloom::quality::{DepthCurve, DepthPrecision};
use drawloom_benches::arguments::ExtentArguments;
use drawloom_benches::harness::{Rounds, progress_bar};
use drawloom_benches::results;
use serde::Serialize;

/// The orders that `Quality::opaque_order` is set to.
const ORDERS: [(&str, DepthPrecision); 5] = [
    ("none", DepthPrecision::UNORDERED),
    ("1 bit", logarithmic(1)),
    ("8 bits", logarithmic(8)),
    ("16 bits", logarithmic(16)),
    ("20 bits, the most", logarithmic(DepthPrecision::MAX_OPAQUE_BITS)),
];

const fn logarithmic(bits: u32) -> DepthPrecision {
    DepthPrecision { bits, curve: DepthCurve::Logarithmic }
}

/// The size of the measurement.
struct Extent {
    /// Width and height in pixels.
    picture: [u32; 2],
    /// Boxes of the city.
    city: usize,
    /// Objects of each cloud whose overdraw is counted.
    clouds: [usize; 2],
    /// Objects of the cloud that is timed.
    timed: usize,
    rounds: Rounds,
    /// Least duration of a sample.
    sample: Duration,
}

impl Extent {
    const FULL: Self = Self {
        picture: [640, 360],
        city: 20_000,
        clouds: [10_000, 100_000],
        timed: 10_000,
        rounds: Rounds { warm_up: 60, measured: 41 },
        sample: Duration::from_millis(4),
    };
    const QUICK: Self = Self {
        picture: [64, 36],
        city: 300,
        clouds: [100, 300],
        timed: 1_000,
        rounds: Rounds { warm_up: 3, measured: 3 },
        sample: Duration::ZERO,
    };
}

#[derive(Serialize)]
struct Results {
    overdraw: Vec<overdraw::Row>,
    cost: Vec<cost::Row>,
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let quick = drawloom_output::parse_arguments::<ExtentArguments>().is_quick();
    let extent = if quick { Extent::QUICK } else { Extent::FULL };
    sorting_error::print()?;

    let progress = progress_bar("frames");
    known_overdraw::check()?;
    let overdraw = overdraw::measure(&extent, &progress)?;
    let cost = cost::measure(&extent, &progress)?;
    progress.finish_and_clear();
    overdraw::print(&overdraw);
    cost::print(&cost);
    if !quick {
        results::write_json("depth_order.json", &Results { overdraw, cost })?;
    }
    Ok(())
}
