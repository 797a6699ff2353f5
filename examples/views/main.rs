//! Everything is a camera (M 10.1): draws a scene with mirrors, portals, a screen, an impostor, two players and tiles,
//! each as views that other views sample, and puts all of them on one contact sheet. Prints what each view costs the
//! processor, and what leaving it out would save. Without a graphics adapter the software backend draws it.
//!
//!     cargo run --release --example views
//!     cargo run --release --example views -- --frames 100 --report views.json --out sheet.png
//!     cargo run --release --example views -- --budget-ms 4

mod budget;
mod contact_sheet;
mod costs;
mod gallery;
mod impostor;
mod mirror_ball;
mod processes;
mod smoke;
mod surface;

use std::error::Error;
use std::process::ExitCode;
use std::sync::Arc;

use clap::Parser;
use clap::builder::{PathBufValueParser, TypedValueParser};
use drawloom::backend::{Backend, SoftwareBackend, WgpuBackend};
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter, ViewBudget};
use drawloom_output::{OutputFile, PictureFile, path_text, print_line};
use drawloom_testing::adapter;
use indicatif::{ProgressBar, ProgressStyle};

use gallery::Gallery;

/// Draws every kind of view on one contact sheet.
#[derive(Parser)]
#[command(name = "views")]
struct Arguments {
    /// Where the contact sheet goes, a .png, .jpg, .tga or .bmp.
    #[arg(long, value_name = "FILE", default_value = "sheet.png", value_parser = PathBufValueParser::new().try_map(PictureFile::new))]
    out: PictureFile,

    /// Also writes the table of views, as JSON.
    #[arg(long, value_name = "JSON", value_parser = PathBufValueParser::new().try_map(OutputFile::new))]
    report: Option<OutputFile>,

    /// The frames that are measured of the whole gallery, and without each view.
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,

    /// Sheds views until a frame takes this much thread time, in milliseconds, and draws the sheet with those that are
    /// left. The table still has what they cost at their best, and the quality level that each ends on.
    #[arg(long, value_name = "MS")]
    budget_ms: Option<f64>,

    /// Draws in software although there is an adapter.
    #[arg(long)]
    software: bool,
}

fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_ansi(false)
        .with_writer(drawloom_output::diagnostics)
        .without_time()
        .with_target(false)
        .init();
    drawloom_output::exit_code(run(&drawloom_output::parse_arguments::<Arguments>()))
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    // Nothing is drawn for a budget that is no time.
    arguments.budget_ms.map(ViewBudget::new).transpose()?;
    let mut gallery = Gallery::new()?;
    let (mut renderer, submitter) = measured_renderer()?;
    let (mut views, targets) = {
        let progress = ProgressBar::new(costs::frames_to_draw(&gallery, arguments.frames));
        progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} frames, {eta} left")?);
        let measured = costs::measure(&gallery, &mut renderer, &submitter, arguments.frames, || progress.inc(1))?;
        progress.finish_and_clear();
        measured
    };
    if let Some(milliseconds) = arguments.budget_ms {
        let chosen = budget::choose(milliseconds, &gallery, &mut renderer, &submitter)?;
        costs::set_levels(&mut views, &chosen.levels);
        gallery.scene.cameras = chosen.cameras;
    }
    costs::print(&views, targets);
    if let Some(file) = &arguments.report {
        costs::write(&views, file)?;
    }
    draw(arguments, &gallery)
}

/// A renderer on a device that draws nothing, so that only the processor's work counts.
fn measured_renderer() -> Result<(Renderer<WgpuBackend>, Submitter<WgpuBackend>), Box<dyn Error>> {
    let (device, queue) = adapter::noop_device()?;
    let scheduler = Arc::new(Scheduler::builder().timeline_capacity(1 << 16).build()?);
    let builder = processes::add_to(Renderer::builder(WgpuBackend::new(device, queue)?.transient_targets()));
    Ok(builder.build(scheduler)?)
}

/// Draws the gallery, and writes the contact sheet.
fn draw(arguments: &Arguments, gallery: &Gallery) -> Result<(), Box<dyn Error>> {
    let scheduler = Arc::new(Scheduler::builder().build()?);
    let device = if arguments.software { Err("it is asked for".into()) } else { adapter::device() };
    let mut sheet = match device {
        Ok((device, queue)) => {
            let backend = WgpuBackend::new(device, queue)?;
            print_line!("drawn by {}", backend.adapter_name());
            let (mut renderer, submitter) = processes::add_to(Renderer::builder(backend)).build(scheduler)?;
            let submitted = submitter.submit(renderer.record(gallery.scene.as_scene_ref())?)?;
            submitted.submission.read(gallery.sheet_view(), contact_sheet::TARGET)?
        }
        Err(reason) => {
            print_line!("drawn in software: {reason}");
            let backend = SoftwareBackend::new(Arc::clone(&scheduler));
            let (mut renderer, submitter) = processes::add_to(Renderer::builder(backend)).build(scheduler)?;
            let submitted = submitter.submit(renderer.record(gallery.scene.as_scene_ref())?)?;
            submitted.submission.read(gallery.sheet_view(), contact_sheet::TARGET)?
        }
    };
    contact_sheet::draw_labels(&mut sheet);
    arguments.out.write([sheet.width, sheet.height], &sheet.bytes)?;
    print_line!("{} written", path_text(arguments.out.path()));
    Ok(())
}
