//! Draws a glTF 2.0 scene into a picture.
//!
//!     cargo run --release -p gltf_scene -- scene.glb --picture scene.png --time 1.5
//!
//! Its exit status is 0 if the picture is written; 1 if drawing or writing failed, or there are no threads or no
//! adapter, which may go well another time or on another machine; and 2 if the arguments or the file are wrong, which
//! fails again.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;
use std::sync::Arc;

use clap::Parser;
use clap::builder::{PathBufValueParser, TypedValueParser};
use drawloom::Renderer;
use drawloom::backend::WgpuBackend;
use drawloom::process::{Deferred, Fxaa, ToneMapping, targets};
use drawloom::task::Scheduler;
use drawloom_gltf::{GltfLimits, LoadOptions, World, draw, load};
use drawloom_output::{PictureFile, path_text, print_diagnostic, print_line};
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
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = parse_exposure)]
    exposure: f32,
    /// What the file may take, as in `--limit geometry_bytes=4000000000`: a field of `GltfLimits`, whose documentation
    /// describes them.
    #[arg(long = "limit", value_name = "NAME=VALUE")]
    limits: Vec<FileLimit>,
}

fn main() -> ExitCode {
    // What Drawloom and wgpu warn of.
    tracing_subscriber::fmt()
        .with_ansi(false)
        .with_max_level(LevelFilter::WARN)
        .with_writer(drawloom_output::diagnostics)
        .init();
    let arguments: Arguments = drawloom_output::parse_arguments();
    // That threads cannot be started is no fault of the arguments.
    let scheduler = match Scheduler::with_available_parallelism() {
        Ok(scheduler) => Arc::new(scheduler),
        Err(error) => return drawloom_output::exit_code(Err(error)),
    };
    match read(&arguments, &scheduler) {
        Ok(world) => drawloom_output::exit_code(run(&arguments, &world, scheduler)),
        Err(error) => {
            print_diagnostic!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Loads the file, and prints what is left out of it.
fn read(arguments: &Arguments, scheduler: &Scheduler) -> Result<World, Box<dyn Error>> {
    let mut limits = GltfLimits::default();
    for limit in &arguments.limits {
        limits.set(&limit.name, limit.value)?;
    }
    let options = LoadOptions {
        time: arguments.time,
        animation: arguments.animation,
        camera: arguments.camera,
        size: [arguments.size[0], arguments.size[1]],
        limits,
    };
    let bar = ProgressBar::new(0).with_style(ProgressStyle::with_template("{bar:40} {pos}/{len} images")?);
    let loaded = load(&arguments.file, &options, scheduler, &mut |progress| {
        bar.set_length(progress.total as u64);
        bar.set_position(progress.done as u64);
    });
    bar.finish_and_clear();
    let (warnings, unlisted) = match &loaded {
        Ok(world) => (&world.warnings, world.unlisted_warnings),
        Err(error) => (&error.warnings, error.unlisted_warnings),
    };
    for warning in warnings {
        print_diagnostic!("warning: {warning}");
    }
    if unlisted > 0 {
        print_diagnostic!("warning: {unlisted} more warnings are not listed");
    }
    Ok(loaded?)
}

/// Draws the world, and writes the picture.
fn run(arguments: &Arguments, world: &World, scheduler: Arc<Scheduler>) -> Result<(), Box<dyn Error>> {
    let (device, queue) = draw::open_device()?;
    let deferred = Deferred::new().shadow_maps(Some(draw::shadow_maps(world)));
    let deferred = deferred.post(ToneMapping::new(arguments.exposure)).post(Fxaa::default());
    let builder = Renderer::builder(WgpuBackend::new(device, queue)?);
    let builder = draw::add_world(builder, deferred, world);
    let (mut renderer, submitter) = builder.build(scheduler)?;
    let recorded = renderer.record(world.as_scene_ref(&world.columns()))?;
    let picture = submitter.submit(recorded)?.submission.read(0, targets::PICTURE)?;
    arguments.picture.write([picture.width, picture.height], &picture.bytes)?;
    print_line!("{}", describe(world, arguments));
    Ok(())
}

fn describe(world: &World, arguments: &Arguments) -> String {
    let objects = world.object_count();
    let animations = match (world.animations.get(arguments.animation), arguments.time) {
        (Some(name), Some(time)) => format!(", \"{name}\" at {time} s"),
        _ if world.animations.is_empty() => String::new(),
        _ => format!(", {} animations at rest: {}", world.animations.len(), shown(&world.animations)),
    };
    format!("{objects} objects, {} cameras{animations}; {}", world.cameras, path_text(arguments.picture.path()))
}

/// The first names of a list.
fn shown(names: &[String]) -> String {
    const MAX_NAMES: usize = 10;
    let mut shown = names.iter().take(MAX_NAMES).map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    if names.len() > MAX_NAMES {
        shown += ", …";
    }
    shown
}

fn parse_time(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(time) if f64::is_finite(time) => Ok(time),
        _ => Err(format!("{text:?} is not a number of seconds")),
    }
}

fn parse_exposure(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(factor) if f32::is_finite(factor) && factor >= 0.0 => Ok(factor),
        _ => Err(format!("{text:?} is not a factor from 0 on")),
    }
}

/// `NAME=VALUE`: a limit of [`GltfLimits`].
#[derive(Clone, Debug)]
struct FileLimit {
    name: String,
    value: u64,
}

impl FromStr for FileLimit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE, as in geometry_bytes=4000000000")?;
        let value = value.parse().map_err(|error| format!("{value:?}: {error}"))?;
        GltfLimits::default().set(name, value).map_err(|error| error.to_string())?;
        Ok(Self { name: name.to_owned(), value })
    }
}
