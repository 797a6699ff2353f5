//! Renders a scene through the whole frame, and says what that took.
//!
//!     cargo run --release --example frame
//!     cargo run --release --example frame -- scene.obj --workers 4 --granularity chunk:64 --record kept --frames 100

#[path = "frame/adapter.rs"]
mod adapter;
#[path = "frame/arguments.rs"]
mod arguments;
#[path = "frame/report.rs"]
mod report;

use std::error::Error;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::backend::{Backend, NullBackend, WgpuBackend, WgpuSubmission};
use drawloom::process::{Deferred, Fxaa, ToneMapping};
use drawloom::scene::{Scene, obj, sample};
use drawloom::task::Scheduler;
use drawloom::{FrameStatistics, Renderer, Submitted, wgpu};
use indicatif::{ProgressBar, ProgressStyle};

use arguments::{Arguments, BackendName};
use report::Report;

fn main() -> ExitCode {
    tracing_subscriber::fmt().with_writer(std::io::stderr).without_time().with_target(false).init();
    match run(&Arguments::checked()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}", with_causes(error.as_ref()));
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let scene = load_scene(arguments)?;
    let report = match arguments.backend {
        BackendName::Null => draw(arguments, &scene, NullBackend, |_| Ok(()))?.1,
        BackendName::Noop => {
            let backend = wgpu_backend(arguments, adapter::noop_device()?)?;
            draw(arguments, &scene, backend, WgpuSubmission::wait)?.1
        }
        BackendName::Wgpu => {
            let backend = wgpu_backend(arguments, adapter::device()?)?;
            let (last, report) = draw(arguments, &scene, backend, WgpuSubmission::wait)?;
            save(arguments, &last.submission)?;
            report
        }
    };
    report.print();
    match &arguments.report {
        Some(path) => report.write(path),
        None => Ok(()),
    }
}

fn wgpu_backend(
    arguments: &Arguments,
    (device, queue): (wgpu::Device, wgpu::Queue),
) -> Result<WgpuBackend, Box<dyn Error>> {
    let backend = WgpuBackend::new(device, queue)?;
    Ok(match arguments.record {
        None => backend,
        Some(record) => backend.record(record.way())?,
    })
}

fn load_scene(arguments: &Arguments) -> Result<Scene, Box<dyn Error>> {
    let mut scene = match &arguments.scene {
        None => sample::colonnade()?,
        Some(path) => {
            let imported = obj::load(path)?;
            for warning in &imported.warnings {
                eprintln!("warning: {warning}");
            }
            println!(
                "{}: {} triangles, and {} degenerate ones left out",
                path.display(),
                imported.triangles,
                imported.degenerate_triangles
            );
            imported.scene
        }
    };
    for camera in &mut scene.cameras {
        if let Some(placed) = &arguments.camera {
            placed.apply(camera);
        }
        camera.size = arguments.size.0;
    }
    scene.duplicate_objects(arguments.copies as usize);
    Ok(scene)
}

/// Draws all frames, and returns the last, and the report on all of them.
fn draw<B: Backend>(
    arguments: &Arguments,
    scene: &Scene,
    backend: B,
    wait: impl Fn(&B::Submission) -> Result<(), drawloom::backend::BackendError>,
) -> Result<(Submitted<B>, Report), Box<dyn Error>> {
    let scheduler = Arc::new(match arguments.workers {
        Some(workers) => Scheduler::new(workers.get())?,
        None => Scheduler::with_available_parallelism()?,
    });
    let workers = scheduler.workers();
    let deferred =
        Deferred::new().depth_pre_pass(arguments.depth_pre_pass).post(ToneMapping::default()).post(Fxaa::default());
    let (mut renderer, submitter) =
        Renderer::builder(backend).deferred(deferred).granularity(arguments.granularity.0).build(scheduler)?;

    let frames = arguments.frames;
    let progress = ProgressBar::new(u64::from(frames));
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} frames, {per_sec}, {eta} left")?);
    let mut measured: Vec<(Duration, FrameStatistics)> = Vec::new();
    let mut last = None;
    for _ in 0..frames {
        let start = Instant::now();
        let recorded = renderer.record(scene.as_scene_ref())?;
        let submitted = submitter.submit(recorded)?;
        let cpu = start.elapsed();
        // The next frame is not to be measured against a device that is still busy with this one.
        wait(&submitted.submission)?;
        measured.push((cpu, submitted.statistics.clone()));
        last = Some(submitted);
        progress.inc(1);
    }
    progress.finish_and_clear();
    if let Some(path) = &arguments.graph {
        std::fs::write(path, renderer.plan().to_dot())
            .map_err(|error| format!("{} could not be written: {error}", path.display()))?;
    }

    let report = Report::new(renderer.backend().adapter(), arguments, workers, &measured);
    Ok((last.ok_or("no frame was drawn")?, report))
}

fn save(arguments: &Arguments, submission: &WgpuSubmission) -> Result<(), Box<dyn Error>> {
    let path = arguments.out.clone().unwrap_or_else(|| "frame.png".into());
    let picture = submission.read(0, "picture")?;
    image::save_buffer(&path, &picture.bytes, picture.width, picture.height, image::ColorType::Rgba8)
        .map_err(|error| format!("{} could not be written: {error}", path.display()))?;
    println!("{} written", path.display());
    Ok(())
}

fn with_causes(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        let inner_text = inner.to_string();
        // Some errors end with what caused them already.
        if !text.ends_with(&inner_text) {
            text = format!("{text}: {inner_text}");
        }
        cause = inner.source();
    }
    text
}
