//! Flies through a world that is many times larger than the device's memory for it, without a loading screen.
//!
//!     cargo run --release --example streaming -- --seconds 60 --report report.json --out flight
//!     cargo run --release --example streaming -- --frames 300 --backend noop
//!
//! The engine asks for tiles of land ahead of the camera and drops those behind. An
//! [`AssetLoader`](drawloom::scene::AssetLoader) has background jobs make their meshes and textures, and the backend
//! streams these to the device within a budget. It writes a chart of frame times and bytes, a report, and three
//! pictures.

mod arguments;
mod chart;
mod flight;
mod haze;
mod land;
mod pictures;
mod plants;
mod report;
mod tile;
mod world;

use std::error::Error;
use std::process::ExitCode;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use drawloom::Renderer;
use drawloom::backend::{StreamingBudget, WgpuBackend};
use drawloom::glam::Vec3;
use drawloom::process::{Deferred, ToneMapping, targets};
use drawloom::task::Scheduler;
use drawloom_output::{OutputFile, create_folder, print_diagnostic};
use drawloom_testing::adapter;
use indicatif::{ProgressBar, ProgressStyle};

use arguments::{Arguments, BackendName};
use flight::Flight;
use haze::Haze;
use pictures::Pictures;
use report::{Recorder, Sample};
use world::World;

/// The radiance of the sky at the horizon, into which distant land fades.
const SKY: Vec3 = Vec3::new(0.55, 0.68, 0.86);

fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_ansi(false)
        .with_writer(drawloom_output::diagnostics)
        .without_time()
        .with_target(false)
        .init();
    drawloom_output::exit_code(run(&Arguments::checked()))
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    arguments.out.as_deref().map_or(Ok(()), create_folder)?;
    let scheduler = Arc::new(match arguments.workers {
        Some(workers) => Scheduler::new(workers.get())?,
        None => Scheduler::with_available_parallelism()?,
    });
    let budget = budget(arguments);
    let (device, queue) = match arguments.backend {
        BackendName::Wgpu => adapter::device()?,
        BackendName::Noop => adapter::noop_device()?,
    };
    let backend = WgpuBackend::new(device, queue)?.stream_resources(budget)?;
    let deferred = Deferred::new().post(ToneMapping::new(1.0));
    let (mut renderer, submitter) =
        Renderer::builder(backend).pipeline(deferred).process(Haze::new(SKY)).build(Arc::clone(&scheduler))?;

    let flight = Flight::new(arguments.size.0);
    let mut world = World::new(&scheduler, SKY)?;
    world.scene.cameras = vec![flight.camera(0.0)];
    // The driver compiles what the first frames draw, and allocates for the first picture that is read; the land is not
    // requested yet.
    for _frame in 0..WARM_UP_FRAMES {
        let mut recorded = renderer.record(world.scene.as_scene_ref())?;
        let is_drawn = arguments.backend == BackendName::Wgpu;
        let picture =
            is_drawn.then(|| recorded.read_back(0, targets::PICTURE, [0, 0], arguments.size.0)).transpose()?;
        submitter.submit(recorded)?.submission.wait()?;
        drop(picture);
    }

    let progress = progress_bar(arguments);
    let mut recorder = Recorder::new(budget);
    let mut pictures = Pictures::default();
    let start = Instant::now();
    while let Some(time) = arguments.time_of(recorder.frames(), start.elapsed()) {
        let begin = Instant::now();
        world.scene.cameras = vec![flight.camera(time)];
        let errors = world.update(&flight, time)?;
        errors.iter().for_each(|error| print_diagnostic!("warning: {error}"));
        let mut recorded = renderer.record(world.scene.as_scene_ref())?;
        let share = arguments.share_of(time);
        if arguments.backend == BackendName::Wgpu && pictures.is_due(share) {
            pictures.add(recorded.read_back(0, targets::PICTURE, [0, 0], arguments.size.0)?);
        }
        let submitted = submitter.submit(recorded)?;
        submitted.submission.wait()?;
        let elapsed = begin.elapsed();
        let streaming = renderer.backend().streaming_statistics().ok_or("the backend streams")?;
        // What is in sight and not on the device, and what is near and not even made.
        let missing = streaming.wanted + world.pending_nearby();
        recorder.add(Sample { time, frame: elapsed, streaming, missing, made_bytes: world.made_bytes() });
        progress.set_position((share * 1000.0) as u64);
        progress.set_message(format!("{} MB made", world.made_bytes() / 1_000_000));
        thread::sleep(arguments.frame_time().saturating_sub(elapsed));
    }
    progress.finish_and_clear();

    let report = recorder.report();
    report.print();
    if let Some(folder) = &arguments.out {
        chart::write(&recorder, &OutputFile::new(folder.join("streaming.svg"))?)?;
        pictures.write(folder)?;
    }
    match &arguments.report {
        Some(file) => report.write(file),
        None => Ok(()),
    }
}

const WARM_UP_FRAMES: usize = 12;

/// Two fifths of the memory for meshes, the rest for textures. Uploads keep up with the flight at eight frames a
/// second.
fn budget(arguments: &Arguments) -> StreamingBudget {
    let bytes = u64::from(arguments.budget) << 20;
    StreamingBudget {
        mesh_bytes: bytes * 2 / 5,
        texture_bytes: bytes * 3 / 5,
        upload_bytes_per_frame: 4 << 20,
        upload_time_per_frame: Duration::from_millis(8),
    }
}

fn progress_bar(arguments: &Arguments) -> ProgressBar {
    let style =
        ProgressStyle::with_template("{bar:40} {percent}% {msg}").unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = if arguments.quiet { ProgressBar::hidden() } else { ProgressBar::new(1000) };
    bar.with_style(style)
}
