//! An engine with drawables, pipelines and bind groups of its own moves to Drawloom, and draws the same bytes.
//!
//!     cargo run --release --example moving_in -- --out moving_in.png
//!     cargo run --release --example moving_in -- --measure
//!     cargo run --release --example moving_in -- --measure adapter --objects 40000 --workers 8
//!
//! The [`engine`] has two renderers: [`on_wgpu`] culls, sorts and records on one thread, as engines do that are written
//! with plain wgpu. [`on_drawloom`] lends the same drawables to Drawloom. No shader, pipeline, bind group or drawable
//! knows of it. The program draws a frame with both, and ends with exit status 1 if their bytes differ.
//!
//! With `--measure` it prints the lines of code of both, and how long a frame takes on the calling thread, from the
//! engine's arrays to submission: medians of frames that both draw in turns. In the column *moving* the camera and
//! every eighth object move; in *at rest* nothing does. The update of what moves is not measured, as it is the same for
//! both. By default wgpu then has no device, so that only the processor's work counts.

mod drawables;
mod engine;
mod on_drawloom;
mod on_wgpu;
mod resources;
mod world;

use std::error::Error;
use std::num::NonZeroUsize;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::{Parser, ValueEnum};
use drawloom::task::Scheduler;
use drawloom::{Granularity, wgpu};
use drawloom_output::{PictureFile, path_text, print_line};
use drawloom_testing::adapter;
use indicatif::{ProgressBar, ProgressStyle};

use engine::{Engine, MAIN, SIZES};
use on_drawloom::OnDrawloom;
use on_wgpu::OnWgpu;

/// Frames before those that are measured: in them Drawloom finds out how it records best.
const WARM_UP: u32 = 60;

/// Draws and measures an engine on plain wgpu and on Drawloom.
#[derive(Parser)]
#[command(name = "moving_in")]
struct Arguments {
    /// About how many drawables the engine has.
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    objects: u32,

    /// Where the picture goes, a .png, .jpg, .tga or .bmp.
    #[arg(long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(PictureFile::new))]
    out: Option<PictureFile>,

    /// Measure frames: `noop` without a device, or `adapter` on the machine's adapter.
    #[arg(long, value_enum, num_args = 0..=1, default_missing_value = "noop", conflicts_with = "out")]
    measure: Option<BackendName>,

    /// The frames that are measured, for each row and column.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,

    /// Threads that run jobs in the last row, the calling thread included. Default: the number of cores.
    #[arg(long, value_name = "N")]
    workers: Option<NonZeroUsize>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum BackendName {
    Adapter,
    Noop,
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run(&drawloom_output::parse_arguments::<Arguments>()))
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let (device, queue) = match arguments.measure {
        None | Some(BackendName::Adapter) => adapter::device()?,
        Some(BackendName::Noop) => adapter::noop_device()?,
    };
    let engine = Engine::new(device, queue, arguments.objects as usize);
    if arguments.measure.is_some() { measure(arguments, engine) } else { compare(&engine, arguments.out.as_ref()) }
}

/// Draws a frame with both.
///
/// # Errors
/// If their bytes differ.
fn compare(engine: &Engine, out: Option<&PictureFile>) -> Result<(), Box<dyn Error>> {
    OnWgpu::default().draw(engine);
    let expected = engine.read_picture()?;
    OnDrawloom::new(engine, Arc::new(Scheduler::with_available_parallelism()?), Granularity::default())?
        .draw(engine)?;
    let picture = engine.read_picture()?;
    if let Some(file) = out {
        file.write_opaque(SIZES[MAIN], &picture)?;
        print_line!("{} written", path_text(file.path()));
    }
    let differing = picture.iter().zip(&expected).filter(|(one, other)| one != other).count();
    if differing > 0 {
        return Err(format!("{differing} of {} bytes differ between the two", picture.len()).into());
    }
    print_line!("both draw the same {} bytes", picture.len());
    Ok(())
}

type Draw = Box<dyn FnMut(&Engine) -> Result<(), Box<dyn Error>>>;

/// Prints the lines of code and the times of both.
fn measure(arguments: &Arguments, mut engine: Engine) -> Result<(), Box<dyn Error>> {
    let mut on_wgpu = OnWgpu::default();
    let mut renderers: Vec<(String, Draw)> = vec![(
        "plain wgpu".into(),
        Box::new(move |engine| {
            on_wgpu.draw(engine);
            Ok(())
        }),
    )];
    let cores = std::thread::available_parallelism()?;
    let mut workers = vec![1, 2, arguments.workers.unwrap_or(cores).get()];
    workers.sort_unstable();
    workers.dedup();
    for workers in workers {
        let noun = if workers == 1 { "worker" } else { "workers" };
        let mut moved = OnDrawloom::new(&engine, Arc::new(Scheduler::new(workers)?), Granularity::default())?;
        renderers.push((format!("Drawloom, {workers} {noun}"), Box::new(move |engine| moved.draw(engine))));
    }

    let progress = ProgressBar::new(2 * u64::from(WARM_UP + arguments.frames));
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} frames, {eta} left")?);
    let moving = median_times(arguments.frames, &mut engine, &mut renderers, true, &progress)?;
    let at_rest = median_times(arguments.frames, &mut engine, &mut renderers, false, &progress)?;
    progress.finish_and_clear();

    let shared = [include_str!("engine.rs"), include_str!("drawables.rs"), include_str!("resources.rs")];
    let [on_wgpu, on_drawloom] = [include_str!("on_wgpu.rs"), include_str!("on_drawloom.rs")].map(lines_of_code);
    let shared: usize = shared.map(lines_of_code).iter().sum();
    print_line!("lines of code: {shared} of the engine, {on_wgpu} on plain wgpu, {on_drawloom} on Drawloom");
    print_line!("{} drawables, 3 views, {}", engine.spheres.len(), engine.device.adapter_info().name);
    print_line!("| µs a frame | moving | at rest |");
    print_line!("| --- | ---: | ---: |");
    for (((name, _), moving), at_rest) in renderers.iter().zip(moving).zip(at_rest) {
        let [moving, at_rest] = [moving, at_rest].map(|time| time.as_secs_f64() * 1e6);
        print_line!("| {name} | {moving:.0} | {at_rest:.0} |");
    }
    Ok(())
}

/// The median time of a frame with each renderer. All draw each frame.
fn median_times(
    frames: u32,
    engine: &mut Engine,
    renderers: &mut [(String, Draw)],
    moves: bool,
    progress: &ProgressBar,
) -> Result<Vec<Duration>, Box<dyn Error>> {
    let count = renderers.len();
    let mut times = vec![Vec::new(); count];
    for frame in 0..WARM_UP + frames {
        if moves {
            engine.update(frame as f32 * 0.02);
        }
        // The first renderer of a frame finds the engine's arrays in no cache, so they take turns.
        for turn in 0..count {
            let index = (turn + frame as usize) % count;
            let began = Instant::now();
            (renderers[index].1)(engine)?;
            if frame >= WARM_UP {
                times[index].push(began.elapsed());
            }
            engine.device.poll(wgpu::PollType::wait_indefinitely())?;
        }
        progress.inc(1);
    }
    Ok(times.into_iter().map(median).collect())
}

fn median(mut times: Vec<Duration>) -> Duration {
    times.sort_unstable();
    times[times.len() / 2]
}

/// Lines that are neither blank nor comments.
fn lines_of_code(source: &str) -> usize {
    source.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("//")).count()
}
