//! Bevy's renderer and Drawloom side by side, drawing the same scenes.
//!
//!     cd benches/bevy
//!     cargo run --release --ignore-rust-version
//!     cargo run --release --ignore-rust-version -- --quick
//!     cargo run --release --ignore-rust-version -- --scene still --scene turn --objects 100000,1000000 --workers 2
//!     cargo run --release --ignore-rust-version -- --backend adapter --picture 1024 --pictures pictures
//!
//! A scene is a grid of unit cubes. Each camera sees every cube, and has a picture of its own. There is one directional
//! light, without shadows. A frame is timed from the motion of cubes or cameras until submit returns, and until the
//! device has drawn it. Bevy's time is that of `App::update`: its engine's transforms, visibility and assets are in it,
//! and Drawloom has no engine.
//!
//! | scene | what happens in a frame |
//! | --- | --- |
//! | *objects* | every object moves |
//! | *few* | one object of a hundred moves |
//! | *turn* | the camera turns |
//! | *still* | nothing moves; the frame is drawn all the same |
//! | *record* | every object moves, before four cameras |
//! | *ecs* | every object moves, and Drawloom's are entities of a `bevy_ecs` world |
//!
//! Drawloom is told what moves in *few*, *turn* and *still*, as Bevy knows by itself.
//!
//! On the no-op backend the device does nothing and takes no time. Bevy leaves more to it: compute shaders compute the
//! matrices of its objects, cull them and write their draws. Drawloom culls and makes draws on the CPU. So the ratios
//! of the no-op backend are as good for Bevy as those of a device that is infinitely fast. On the adapter, *drawn* has
//! the device's time, measured alike for all: until it is idle.
//!
//! The contenders are interleaved, in bursts of frames. Before they are measured, each must hand every object of every
//! camera to the device; on the adapter the pictures of a frame must cover the same pixels with the same brightest
//! channel, but for a few.
//!
//! The last line names the scenes in which a mode of Bevy is faster. Files are written at the end of a run, each in one
//! step.

mod bevy_side;
mod contender;
mod drawloom_side;
mod layout;
mod measure;
mod pictures;
mod report;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, value_parser};
use drawloom_benches::arguments::WorkerCountArgument;
use drawloom_benches::backends::BackendName;
use drawloom_benches::chart::grouped;
use drawloom_benches::harness::progress_bar;
use drawloom_output::{OutputFile, create_folder, print_diagnostic};

use contender::Failure;
use layout::Layout;
use measure::Extent;
use report::Report;

/// Compares Bevy's renderer with Drawloom.
#[derive(Parser)]
struct Arguments {
    /// `noop` measures the CPU's work alone, on wgpu's no-op backend; `adapter` is the machine's graphics card, or
    /// lavapipe.
    #[arg(long, default_value = "noop")]
    backend: BackendName,
    /// Measures few frames of small scenes, to see that the comparison works.
    #[arg(long)]
    quick: bool,
    /// Measures this scene only. May be repeated.
    #[arg(long = "scene", value_parser = ["objects", "few", "turn", "still", "record", "ecs"])]
    scenes: Vec<String>,
    /// Measures each scene with these numbers of objects, instead of its own.
    #[arg(
        long,
        value_name = "NUMBER,…",
        value_delimiter = ',',
        value_parser = value_parser!(u32).range(1..=i64::from(layout::MAX_OBJECTS))
    )]
    objects: Vec<u32>,
    /// The number of measured frames of each contender in each scene, rounded up to whole bursts.
    #[arg(long, value_name = "NUMBER", value_parser = value_parser!(u32).range(1..))]
    frames: Option<u32>,
    #[command(flatten)]
    workers: WorkerCountArgument,
    /// Width and height of each picture, in pixels.
    #[arg(
        long,
        value_name = "PIXELS",
        default_value_t = layout::PICTURE,
        value_parser = value_parser!(u32).range(64..=4096)
    )]
    picture: u32,
    /// Writes the results as JSON.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Draws the results as a chart in SVG.
    #[arg(long, value_name = "FILE")]
    chart: Option<PathBuf>,
    /// Saves the pictures of all contenders into this folder, as PNG. The no-op backend has none.
    #[arg(long, value_name = "FOLDER")]
    pictures: Option<PathBuf>,
}

impl Arguments {
    /// The requested scenes, in the order of [`FULL`].
    fn layouts(&self) -> Vec<Layout> {
        let all = if self.quick { QUICK } else { FULL };
        let is_requested =
            |layout: &&Layout| self.scenes.is_empty() || self.scenes.iter().any(|scene| scene == layout.name);
        let requested = all.iter().filter(is_requested).map(|&layout| Layout { picture: self.picture, ..layout });
        let mut layouts: Vec<_> = requested.collect();
        if !self.objects.is_empty() {
            let mut objects = self.objects.clone();
            objects.sort_unstable();
            objects.dedup();
            layouts.dedup_by_key(|layout| layout.name);
            let sizes = |layout| objects.iter().map(move |&objects| Layout { objects: objects as usize, ..layout });
            layouts = layouts.into_iter().flat_map(sizes).collect();
        }
        layouts
    }
}

/// The scenes of a full run, and of a quick one.
const FULL: &[Layout] = &[
    Layout::objects(100),
    Layout::objects(1_000),
    Layout::objects(10_000),
    Layout::objects(50_000),
    Layout::objects(100_000),
    Layout::objects(1_000_000),
    Layout::few(50_000),
    Layout::few(100_000),
    Layout::few(1_000_000),
    Layout::turn(50_000),
    Layout::turn(100_000),
    Layout::turn(1_000_000),
    Layout::still(100_000),
    Layout::still(1_000_000),
    Layout::record(10_000),
    Layout::ecs(20_000),
];
const QUICK: &[Layout] = &[
    Layout::objects(100),
    Layout::few(1_000),
    Layout::turn(1_000),
    Layout::still(1_000),
    Layout::record(1_000),
    Layout::ecs(1_000),
];

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Failure> {
    let arguments: Arguments = drawloom_output::parse_arguments();
    let backend = arguments.backend;
    if let Some(folder) = &arguments.pictures {
        if backend == BackendName::Noop {
            return Err("the no-op backend draws no pictures".into());
        }
        create_folder(folder)?;
    }
    let json = arguments.json.as_ref().map(OutputFile::new).transpose()?;
    let chart = arguments.chart.as_ref().map(OutputFile::new).transpose()?;
    let extent = Extent::new(backend, arguments.workers.count(), arguments.quick, arguments.frames);

    let layouts = drawable(arguments.layouts(), backend)?;

    let progress = progress_bar("bursts");
    let mut report = Report::new(extent, arguments.picture);
    for layout in layouts {
        report.rows.extend(measure::measure(&layout, &extent, arguments.pictures.as_deref(), &progress)?);
    }
    progress.finish_and_clear();
    report.print();
    let targets = report.targets();
    targets.print(backend.of(["\nTargets, until submit returns", "\nTargets, until the device is idle"]));
    if let Some(file) = &json {
        report.write_json(file)?;
    }
    if let Some(file) = &chart {
        report.draw(file.path())?;
    }
    targets.print_missed();
    Ok(())
}

/// The scenes that fit into buffers of the backend's device. Says which do not.
///
/// # Errors
/// Returns an error if the machine lacks the backend, or if none fits.
fn drawable(mut layouts: Vec<Layout>, backend: BackendName) -> Result<Vec<Layout>, Failure> {
    // The no-op device has what Bevy needs.
    if backend == BackendName::Noop {
        return Ok(layouts);
    }
    let (device, _) = backend.device().map_err(|error| format!("--backend adapter: {error}"))?;
    let allowed = device.limits().max_storage_buffer_binding_size;
    layouts.retain(|layout| {
        let needed = (layout.objects * layout.cameras) as u64 * bevy_side::bytes_per_object();
        let fits = needed <= allowed;
        if !fits {
            print_diagnostic!(
                "{}, {} objects, is left out: Bevy needs a buffer of {} bytes, and this adapter binds at most {}.",
                layout.name,
                grouped(layout.objects as f64),
                grouped(needed as f64),
                grouped(allowed as f64)
            );
        }
        fits
    });
    if layouts.is_empty() {
        return Err("this adapter can draw none of the scenes with Bevy".into());
    }
    Ok(layouts)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(arguments: &[&str]) -> Result<Vec<Layout>, clap::Error> {
        let arguments = Arguments::try_parse_from(["drawloom-bevy"].iter().chain(arguments))?;
        Ok(arguments.layouts())
    }

    #[test]
    fn a_scene_has_the_requested_numbers_of_objects_once_each_in_order() {
        let picture = |layout| Layout { picture: 64, ..layout };
        for quick in [&[][..], &["--quick"]] {
            let requested = ["--scene=turn", "--scene", "still", "--objects", "1000000,3,3", "--picture=64"];
            let expected = [Layout::turn(3), Layout::turn(1_000_000), Layout::still(3), Layout::still(1_000_000)];
            assert_eq!(parse(&[&requested, quick].concat()).ok(), Some(expected.map(picture).to_vec()));
        }
    }

    #[test]
    fn scenes_have_their_own_numbers_of_objects_by_default() {
        assert_eq!(parse(&[]).ok().as_deref(), Some(FULL));
        assert_eq!(parse(&["--quick"]).ok().as_deref(), Some(QUICK));
        assert_eq!(parse(&["--scene", "ecs"]).ok(), Some(vec![Layout::ecs(20_000)]));
    }

    #[test]
    fn each_scene_can_be_requested_of_both_runs() {
        for layout in FULL {
            for quick in [&[][..], &["--quick"]] {
                let layouts = parse(&[&["--scene", layout.name], quick].concat()).unwrap_or_default();
                assert!(!layouts.is_empty() && layouts.iter().all(|one| one.name == layout.name), "{}", layout.name);
            }
        }
    }

    #[test]
    fn wrong_arguments_are_refused() {
        for wrong in [
            "--objects=0",
            "--objects=1000001",
            "--objects=1,,2",
            "--objects=many",
            "--frames=0",
            "--frames=4294967296",
            "--workers=0",
            "--picture=63",
            "--picture=4097",
            "--scene=none",
            "--backend=cpu",
        ] {
            assert!(parse(&[wrong]).is_err_and(|error| error.exit_code() == 2), "{wrong} is accepted");
        }
    }
}
