//! Renders frames to inspect in Tracy. It waits for a viewer first.
//!
//!     cargo run --release -p drawloom-tracy --example frame_tracy
//!     cargo run --release -p drawloom-tracy --example frame_tracy -- --frames 60 --no-wait

use std::error::Error;
use std::num::NonZeroUsize;
use std::process::ExitCode;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use clap::Parser;
use drawloom::backend::{Backend, WgpuBackend};
use drawloom::process::{Deferred, Fxaa, ToneMapping};
use drawloom::task::Scheduler;
use drawloom::{Renderer, wgpu};
use drawloom_output::{print_diagnostic, print_line};
use drawloom_testing::adapter;
use drawloom_testing::demo;
use drawloom_tracy::Zones;
use indicatif::{ProgressBar, ProgressStyle};

/// Renders frames to inspect in Tracy.
#[derive(Parser)]
struct Arguments {
    /// The number of frames. Ctrl-C ends it sooner.
    #[arg(long, default_value_t = 600)]
    frames: u64,
    /// The number of workers. The default is the number of threads that the machine runs at once.
    #[arg(long)]
    workers: Option<NonZeroUsize>,
    /// Begin at once, with or without a viewer.
    #[arg(long)]
    no_wait: bool,
    /// Show every chunk of every node.
    #[arg(long)]
    chunks: bool,
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: Arguments = drawloom_output::parse_arguments();
    drawloom_tracy::install(if arguments.chunks { Zones::Chunks } else { Zones::Nodes })?;
    drawloom_tracy::name_worker(0);
    let builder = Scheduler::builder().on_start(drawloom_tracy::name_worker);
    let scheduler = match arguments.workers {
        Some(workers) => builder.workers(workers.get()),
        None => builder,
    };
    let scheduler = Arc::new(scheduler.build()?);
    let (device, queue) = device()?;
    let backend = WgpuBackend::new(device, queue)?;
    print_line!("Rendering on {} with {} workers.", backend.adapter_name(), scheduler.workers());
    let deferred = Deferred::new().post(ToneMapping::default()).post(Fxaa::default());
    let (mut renderer, submitter) = Renderer::builder(backend).pipeline(deferred).build(scheduler)?;
    let scene = demo::colonnade()?;

    if !arguments.no_wait {
        wait_for_viewer()?;
    }
    let progress = ProgressBar::new(arguments.frames);
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} frames, {per_sec}")?);
    for _frame in 0..arguments.frames {
        let submitted = submitter.submit(renderer.record(scene.as_scene_ref())?)?;
        // Waits, so that the device is never more than a frame behind.
        submitted.submission.wait()?;
        drawloom_tracy::mark_frame();
        progress.inc(1);
    }
    progress.finish_and_clear();
    print_line!("{} frames rendered.", arguments.frames);
    Ok(())
}

/// The machine's adapter, or one that draws nothing: the workers do the same in both cases.
fn device() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    adapter::device().or_else(|error| {
        print_diagnostic!("{error}; going on with a device that draws nothing");
        adapter::noop_device()
    })
}

fn wait_for_viewer() -> Result<(), Box<dyn Error>> {
    let spinner = ProgressBar::new_spinner();
    spinner.set_style(ProgressStyle::with_template("{spinner} {msg}")?);
    if spinner.is_hidden() {
        print_diagnostic!("Waiting for a viewer: start Tracy 0.14 on this machine and press Connect.");
    }
    spinner.set_message("Waiting for a viewer: start Tracy 0.14 on this machine and press Connect.");
    while !drawloom_tracy::is_connected() {
        spinner.tick();
        thread::sleep(Duration::from_millis(100));
    }
    spinner.finish_and_clear();
    Ok(())
}
