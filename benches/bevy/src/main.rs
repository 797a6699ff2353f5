//! Bevy's renderer and Drawloom side by side, drawing the same scenes.
//!
//!     cd benches/bevy
//!     cargo run --release --ignore-rust-version
//!     cargo run --release --ignore-rust-version -- --quick
//!     cargo run --release --ignore-rust-version -- --backend adapter --pictures pictures
//!
//! A scene is a grid of unit cubes. Each camera sees every cube, and has a picture of its own. There is one directional light, without
//! shadows. A frame is timed from the motion of cubes or cameras until submit returns, and until the device has drawn it. Bevy's time is
//! that of `App::update`: its engine's transforms, visibility and assets are in it, and Drawloom has no engine.
//!
//! The contenders are interleaved, in bursts of frames. Before they are measured, each must hand every object of every camera to the
//! device; on the adapter the pictures of a frame must cover the same pixels with the same brightest channel, but for a few.

mod bevy_side;
mod contender;
mod drawloom_side;
mod layout;
mod measure;
mod pictures;
mod report;

use std::fs;
use std::process::ExitCode;
use std::path::PathBuf;
use std::thread;

use clap::Parser;
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::progress_bar;

use contender::Failure;
use layout::Layout;
use measure::Extent;
use report::Report;

/// Compares Bevy's renderer with Drawloom.
#[derive(Parser)]
struct Arguments {
    /// `noop` measures the CPU's work alone, on wgpu's no-op backend; `adapter` is the machine's graphics card, or lavapipe.
    #[arg(long, value_parser = ["noop", "adapter"], default_value = "noop")]
    backend: String,
    /// Measures few frames of small scenes, to see that the comparison works.
    #[arg(long)]
    quick: bool,
    /// Measures this scene only.
    #[arg(long, value_parser = ["objects", "few", "turn", "record", "ecs"])]
    scene: Option<String>,
    /// The number of measured frames of each contender in each scene, rounded up to whole bursts.
    #[arg(long)]
    frames: Option<usize>,
    /// The number of threads of each contender; by default, that of the machine's cores.
    #[arg(long)]
    threads: Option<usize>,
    /// Writes the results as a table in CSV.
    #[arg(long)]
    csv: Option<PathBuf>,
    /// Draws the results as a chart in SVG.
    #[arg(long)]
    chart: Option<PathBuf>,
    /// Saves the pictures of all contenders into this folder, as PNG. The no-op backend has none.
    #[arg(long)]
    pictures: Option<PathBuf>,
}

/// The scenes of a full run, and of a quick one.
const FULL: &[Layout] = &[
    Layout::objects(100),
    Layout::objects(1_000),
    Layout::objects(10_000),
    Layout::objects(50_000),
    Layout::few(50_000),
    Layout::turn(50_000),
    Layout::record(10_000),
    Layout::ecs(20_000),
];
const QUICK: &[Layout] =
    &[Layout::objects(100), Layout::few(1_000), Layout::turn(1_000), Layout::record(1_000), Layout::ecs(1_000)];

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Failure> {
    let arguments: Arguments = drawloom_output::parse_arguments();
    let backend = if arguments.backend == "noop" { BackendName::Noop } else { BackendName::Adapter };
    let threads = match arguments.threads {
        Some(threads) => threads.max(1),
        None => thread::available_parallelism()?.get(),
    };
    if let Some(folder) = &arguments.pictures {
        if backend == BackendName::Noop {
            return Err("the no-op backend draws no pictures".into());
        }
        fs::create_dir_all(folder)?;
    }
    let extent = Extent::new(backend, threads, arguments.quick, arguments.frames);
    let layouts = if arguments.quick { QUICK } else { FULL };
    let is_requested = |layout: &&Layout| arguments.scene.as_deref().is_none_or(|scene| scene == layout.name);

    let progress = progress_bar("bursts");
    let mut report = Report::new(extent);
    for layout in layouts.iter().filter(is_requested) {
        progress.set_message(format!("{}, {} objects", layout.name, layout.objects));
        report.rows.extend(measure::measure(layout, &extent, arguments.pictures.as_deref(), &progress)?);
    }
    progress.finish_and_clear();
    report.print();
    if let Some(path) = &arguments.csv {
        report.write_csv(path)?;
    }
    if let Some(path) = &arguments.chart {
        report.draw(path)?;
    }
    Ok(())
}
