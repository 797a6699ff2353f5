//! The cost of accuracy on a scene: measures the frame time and the error of every knob alone, and of the presets.
//!
//! Most knobs are fields of `Quality`. The pipeline's `ShadowMaps` have the number of cascades and how far they reach,
//! a `Camera` how often it is drawn and the angle of an impostor that is kept, and a view of a `ViewBudget` the forms
//! in which it is drawn.
//!
//!     cargo run --release -p drawloom-benches --example tradeoff
//!     cargo run --release -p drawloom-benches --example tradeoff -- scene.obj --camera-path orbit --budget-ms 8

mod arguments;
mod backend;
mod budget;
mod camera_path;
mod charts;
mod comparison;
mod configuration;
mod errors;
mod every_knob;
mod front;
mod impostor;
mod levels;
mod measure;
mod page;
mod paraboloid;
mod results;
mod settings;
mod shown_views;
mod subject;
mod targets;
mod vertices;

use std::error::Error;
use std::process::ExitCode;
use std::time::Instant;

use drawloom::raster::CulledTriangles;
use drawloom::scene::{Camera, Scene};
use drawloom::view::RenderView;
use drawloom_output::{print_diagnostic, print_line};

use arguments::Arguments;
use measure::Measurements;
use results::Results;

type Failure = Box<dyn Error>;

fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_ansi(false)
        .with_writer(drawloom_output::diagnostics)
        .without_time()
        .with_target(false)
        .init();
    let outcome = run(&Arguments::checked());
    drawloom_output::exit_code(outcome.and_then(|is_within| {
        is_within.then_some(()).ok_or_else(|| "an error is above its bound, or a knob has no effect".into())
    }))
}

/// Prints the number of invisible triangles, which CPU culling would save the device (S 9.6).
fn print_culled_triangles(scene: &Scene, path: &[Camera]) {
    let Some(view) = path.first().map(RenderView::new) else { return };
    let (scene, mut kept) = (scene.as_scene_ref(), Vec::new());
    let mut culled = CulledTriangles::default();
    let start = Instant::now();
    for object in 0..scene.object_count() {
        kept.clear();
        culled += view.cull_triangles(&scene, object, &mut kept);
    }
    let each = start.elapsed().as_nanos() as f64 / culled.triangles.max(1) as f64;
    print_line!(
        "triangles: {}; the CPU could cull {:.1}% of them: {} face away, {} are off screen, {} cover no pixel, {} \
         are degenerate; {each:.0} ns each\n",
        culled.triangles,
        culled.share() * 100.0,
        culled.back_facing,
        culled.off_screen,
        culled.zero_size,
        culled.degenerate,
    );
}

/// Returns whether every measured error is within its bound, and every knob has an effect in the scene that should have
/// one for each.
fn run(arguments: &Arguments) -> Result<bool, Failure> {
    let mut subject = arguments.load_subject()?;
    let path = camera_path::of(&subject.scene, arguments)?;
    let settings = settings::all(&subject);
    let mut backend = backend::open(arguments, &subject)?;
    print_line!("drawn by {}", backend.name());

    let measurements = Measurements::take(&mut *backend, &mut subject, &path, &settings, arguments)?;
    let results = Results::new(arguments.scene_name(), backend.name(), &subject, &path, &settings, &measurements)?;
    results.print();
    print_culled_triangles(&subject.scene, &path);

    let folder = drawloom_benches::results::folder()?;
    let pictures = folder.join("tradeoff").join(format!("{}-{}", results.scene(), backend.kind()));
    std::fs::create_dir_all(&pictures)?;
    results.write(&folder.join("tradeoff.json"))?;
    charts::draw(&pictures, &results)?;
    front::draw(&pictures, &results)?;
    page::write(&pictures, &results, &measurements)?;

    if let Some(budget) = arguments.budget_ms {
        budget::search(budget, &mut *backend, &mut subject, &path, &settings, &results)?;
    }
    let exceeded: Vec<_> = results.exceeded().collect();
    for entry in &exceeded {
        let (error, bound) = (entry.error.unwrap_or_default(), entry.bound.unwrap_or_default());
        print_diagnostic!(
            "{}, {}: an error of {error} {}, above the bound {bound}",
            entry.knob,
            entry.setting,
            entry.metric
        );
    }
    let without_effect: Vec<_> = results.without_effect().filter(|_| arguments.has_every_knob()).collect();
    for knob in &without_effect {
        print_diagnostic!("{} changes nothing in a scene for every knob", knob.name());
    }
    Ok(exceeded.is_empty() && without_effect.is_empty())
}
