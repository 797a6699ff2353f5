//! Draws a glTF 2.0 scene into a picture.
//!
//!     cargo run --release -p gltf_scene -- scene.glb --picture scene.png --time 1.5

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::Parser;
use clap::builder::{PathBufValueParser, TypedValueParser};
use drawloom::task::Scheduler;
use drawloom_output::{PictureFile, path_text, print_diagnostic, print_line};
use gltf_scene::{LoadOptions, draw, load, open_device};
use indicatif::{ProgressBar, ProgressStyle};
use tracing_subscriber::filter::LevelFilter;

/// Draws a glTF 2.0 scene into a picture.
#[derive(Debug, Parser)]
struct Arguments {
    /// A .gltf or a .glb.
    file: PathBuf,
    /// Where the picture goes.
    #[arg(long, value_name = "FILE.png", value_parser = PathBufValueParser::new().try_map(PictureFile::new))]
    picture: PictureFile,
    /// The time in seconds at which the animation is.
    #[arg(long, value_name = "SECONDS", value_parser = parse_time)]
    time: Option<f64>,
    /// The number of the animation, from 0.
    #[arg(long, value_name = "N", default_value_t = 0)]
    animation: usize,
    /// The number of the camera among those of the scene, from 0.
    #[arg(long, value_name = "N")]
    camera: Option<usize>,
    /// Width and height of the picture in pixels.
    #[arg(long, num_args = 2, value_names = ["WIDTH", "HEIGHT"], default_values_t = [960, 540], value_parser = clap::value_parser!(u32).range(1..=8192))]
    size: Vec<u32>,
    /// What radiance is multiplied by.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    exposure: f32,
}

fn main() -> ExitCode {
    // What Drawloom and wgpu warn of.
    tracing_subscriber::fmt().with_max_level(LevelFilter::WARN).with_writer(drawloom_output::diagnostics).init();
    drawloom_output::exit_code(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
    let options = LoadOptions {
        time: arguments.time,
        animation: arguments.animation,
        camera: arguments.camera,
        size: [arguments.size[0], arguments.size[1]],
    };
    let progress = ProgressBar::new(0).with_style(ProgressStyle::with_template("{bar:40} {pos}/{len} images")?);
    let world = load(&arguments.file, &options, &scheduler, &progress)?;
    progress.finish_and_clear();
    for warning in &world.warnings {
        print_diagnostic!("warning: {warning}");
    }
    let picture = draw(open_device()?, scheduler, &world, arguments.exposure)?;
    arguments.picture.write([picture.width, picture.height], &picture.bytes)?;
    print_line!("{}", describe(&world, arguments));
    Ok(())
}

fn describe(world: &gltf_scene::World, arguments: &Arguments) -> String {
    let objects = world.object_count();
    let animations = match (world.animations.get(arguments.animation), arguments.time) {
        (Some(name), Some(time)) => format!(", {name:?} at {time} s"),
        _ if world.animations.is_empty() => String::new(),
        _ => format!(", animations {:?} at rest", world.animations),
    };
    format!("{objects} objects, {} cameras{animations}; {}", world.cameras, path_text(arguments.picture.path()))
}

fn parse_time(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(time) if f64::is_finite(time) => Ok(time),
        _ => Err(format!("{text:?} is not a number of seconds")),
    }
}
