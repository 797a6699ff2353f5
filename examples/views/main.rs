//! Everything is a camera (M 10.1): draws a scene with a mirror, portals, a screen, two players and tiles, each as views that other views
//! sample, and puts all of them on one contact sheet. Prints what each view costs the processor, and what leaving it out would save. Without
//! a graphics adapter the software backend draws it.
//!
//!     cargo run --release --example views
//!     cargo run --release --example views -- --frames 100 --report views.json --out sheet.png

mod contact_sheet;
mod costs;
mod gallery;
mod surface;

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::Parser;
use drawloom::backend::{Backend, BackendError, Picture, SoftwareBackend, TargetMemory, WgpuBackend};
use drawloom::process::{Deferred, ToneMapping};
use drawloom::task::Scheduler;
use drawloom::{Renderer, RendererBuilder, Submitter};
use drawloom_testing::adapter;
use indicatif::{ProgressBar, ProgressStyle};

use contact_sheet::ContactSheet;
use gallery::Gallery;
use surface::Surface;

/// Draws every kind of view on one contact sheet.
#[derive(Parser)]
#[command(name = "views")]
struct Arguments {
    /// Where the contact sheet goes.
    #[arg(long, value_name = "PNG", default_value = "sheet.png")]
    out: PathBuf,

    /// Also writes what is printed, as JSON.
    #[arg(long, value_name = "JSON")]
    report: Option<PathBuf>,

    /// The frames that are measured of the whole gallery, and without each view.
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,

    /// Draws in software although there is an adapter.
    #[arg(long)]
    software: bool,
}

fn main() -> ExitCode {
    tracing_subscriber::fmt().with_writer(std::io::stderr).without_time().with_target(false).init();
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let scheduler = Arc::new(Scheduler::builder().build()?);
    let device = if arguments.software { Err("it is asked for".into()) } else { adapter::device() };
    match device {
        Ok((device, queue)) => {
            let backend = WgpuBackend::new(device, queue)?;
            println!("drawn by {}", backend.adapter_name());
            let (renderer, submitter) = with_processes(Renderer::builder(backend)).build(scheduler)?;
            draw(arguments, renderer, submitter, |submission, view| submission.read(view, contact_sheet::TARGET))?;
        }
        Err(reason) => {
            println!("drawn in software: {reason}");
            let backend = SoftwareBackend::new(Arc::clone(&scheduler));
            let (renderer, submitter) = with_processes(Renderer::builder(backend)).build(scheduler)?;
            draw(arguments, renderer, submitter, |submission, view| submission.read(view, contact_sheet::TARGET))?;
        }
    }
    let (views, targets) = measured_costs(arguments)?;
    costs::print(&views, targets);
    match &arguments.report {
        Some(path) => costs::write(&views, path),
        None => Ok(()),
    }
}

fn with_processes<B: Backend>(builder: RendererBuilder<B>) -> RendererBuilder<B> {
    let deferred = Deferred::new().post(ToneMapping::default());
    let builder = Surface::all().into_iter().fold(builder.deferred(deferred), RendererBuilder::process);
    builder.process(ContactSheet::new()).output(contact_sheet::TARGET)
}

/// Draws the gallery once, and writes the contact sheet.
fn draw<B: Backend>(
    arguments: &Arguments,
    mut renderer: Renderer<B>,
    submitter: Submitter<B>,
    read: impl Fn(&B::Submission, usize) -> Result<Picture, BackendError>,
) -> Result<(), Box<dyn Error>> {
    let gallery = Gallery::new()?;
    let submitted = submitter.submit(renderer.record(gallery.scene.as_scene_ref())?)?;
    let mut sheet = read(&submitted.submission, gallery.sheet_view())?;
    contact_sheet::draw_labels(&mut sheet);
    image::save_buffer(&arguments.out, &sheet.bytes, sheet.width, sheet.height, image::ColorType::Rgba8)
        .map_err(|error| format!("{} could not be written: {error}", arguments.out.display()))?;
    println!("{} written", arguments.out.display());
    Ok(())
}

/// Measures on a device that draws nothing, so that only the processor's work counts.
fn measured_costs(arguments: &Arguments) -> Result<(Vec<costs::ViewCost>, TargetMemory), Box<dyn Error>> {
    let gallery = Gallery::new()?;
    let (device, queue) = adapter::noop_device()?;
    let scheduler = Arc::new(Scheduler::builder().timeline_capacity(1 << 16).build()?);
    let builder = with_processes(Renderer::builder(WgpuBackend::new(device, queue)?.transient_targets()));
    let (mut renderer, submitter) = builder.build(scheduler)?;
    let progress = ProgressBar::new(costs::frames_to_draw(&gallery, arguments.frames));
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} frames, {eta} left")?);
    let measured = costs::measure(&gallery, &mut renderer, &submitter, arguments.frames, || progress.inc(1))?;
    progress.finish_and_clear();
    Ok(measured)
}
