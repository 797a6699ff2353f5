//! A budget of views while the load rises and falls.
//!
//!     cargo bench -p drawloom-benches --bench budget
//!     cargo bench -p drawloom-benches --bench budget -- --quick
//!
//! A main view and six others look at boxes, on wgpu's `noop` device and two workers. All cameras move in every frame.
//! The budget is what frames with few boxes cost, and half as much again. Then there are four times as many boxes, and
//! few again. The table has the mean thread time of a frame from the 30th frame after each step on, and the quality
//! levels after it. `target/drawloom/budget.json` has the same. The last line names the targets that were missed.

use std::error::Error;
use std::process::ExitCode;
use std::sync::Arc;

use drawloom::backend::WgpuBackend;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Changes, Material, Mesh, RenderObject, Scene, SceneRef};
use drawloom::task::Scheduler;
use drawloom::{BudgetedView, QualityLevel, Renderer, Submitter, ViewBudget, ViewVariant};
use drawloom_benches::arguments::ExtentArguments;
use drawloom_benches::harness::progress_bar;
use drawloom_benches::results;
use drawloom_benches::statistics::{median, percentile};
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use drawloom_testing::adapter;
use indicatif::ProgressBar;
use serde::Serialize;

/// The frames after a step in which the controller may be over the budget.
const SETTLES_WITHIN: usize = 30;

/// The frames of a step, and what they cost.
#[derive(Serialize)]
struct Row {
    step: &'static str,
    objects: usize,
    budget_ms: f64,
    /// The mean thread time of a frame from the 30th on, and its median and 95th percentile.
    ms: f64,
    median_ms: f64,
    percentile_95_ms: f64,
    /// The mean divided by the budget.
    share_of_budget: f64,
    /// Of each view after the step, by [`views`].
    levels: Vec<usize>,
    /// How often a quality level changed.
    changes: usize,
    /// The first frame of the step after which all views were at their best until its end.
    back_after: Option<usize>,
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let quick = drawloom_output::parse_arguments::<ExtentArguments>().is_quick();
    let (few, frames) = if quick { (100, 40) } else { (10_000, 600) };
    let progress = progress_bar("frames");
    let rows = measure(few, frames, &progress)?;
    progress.finish_and_clear();

    let headings = [
        "step",
        "objects",
        "budget, ms",
        "mean, ms",
        "95th percentile, ms",
        "mean ÷ budget",
        "levels",
        "changes",
        "back after",
    ];
    let mut table = Table::new(&headings);
    for row in &rows {
        table.row([
            row.step.to_owned(),
            row.objects.to_string(),
            format!("{:.2}", row.budget_ms),
            format!("{:.2}", row.ms),
            format!("{:.2}", row.percentile_95_ms),
            format!("{:.2}", row.share_of_budget),
            format!("{:?}", row.levels),
            row.changes.to_string(),
            row.back_after.map_or_else(|| "-".to_owned(), |frame| frame.to_string()),
        ]);
    }
    table.print();
    let mut targets = Targets::new();
    for row in &rows {
        targets.at_most(format!("{}, mean ÷ budget", row.step), 1.0, row.share_of_budget);
    }
    targets.print("Targets and results");
    if !quick {
        results::write_json("budget.json", &rows)?;
    }
    targets.print_missed();
    Ok(())
}

fn measure(few: usize, frames: usize, progress: &ProgressBar) -> Result<Vec<Row>, Box<dyn Error>> {
    let mut runner = Runner::new(few)?;
    progress.set_length(4 * frames as u64);
    let generous = runner.step("few boxes, no limit", frames, progress)?;
    runner.milliseconds = generous.median_ms * 1.5;
    runner.budget.set_milliseconds(runner.milliseconds)?;
    let mut rows = vec![runner.step("few boxes", frames, progress)?];
    runner.grow(few, 4 * few)?;
    rows.push(runner.step("four times as many", frames, progress)?);
    runner.shrink(few)?;
    rows.push(runner.step("few boxes again", frames, progress)?);
    Ok(rows)
}

/// The main view, two maps, a mirror with four samples, and three screens, in the order of the cameras.
fn views(frame: usize) -> Vec<BudgetedView> {
    let every = |interval| QualityLevel::Drawn(ViewVariant { interval, ..ViewVariant::BEST });
    let fewer = |max_cameras| QualityLevel::Drawn(ViewVariant { max_cameras, ..ViewVariant::BEST });
    let of = |name: &str, priority, cameras: usize, levels: &[QualityLevel]| {
        let camera = |index| overhead(&format!("{name} {index}"), (frame % 2 + index) as f64 * 0.01);
        let cameras = (0..cameras).map(camera).collect();
        BudgetedView { name: name.to_owned(), priority, cameras, levels: levels.to_vec() }
    };
    vec![
        of("main", 9, 1, &[]),
        of("map", 3, 1, &[every(2), every(4)]),
        of("overview", 3, 1, &[every(2), every(4), QualityLevel::LeftOut]),
        of("samples", 2, 4, &[fewer(2), fewer(1)]),
        of("screen", 1, 1, &[every(2), every(4), QualityLevel::LeftOut]),
        of("other screen", 1, 1, &[every(2), QualityLevel::LeftOut]),
        of("preview", 0, 1, &[QualityLevel::LeftOut]),
    ]
}

/// A camera above all boxes.
fn overhead(name: &str, along: f64) -> Camera {
    let position = DVec3::new(100.0 + along, 300.0, 100.0);
    let camera = Camera::looking_at(name, position, position - DVec3::new(0.0, 300.0, 1e-3));
    Camera { size: [8, 8], ..camera }
}

struct Runner {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    budget: ViewBudget,
    milliseconds: f64,
    scene: Scene,
    is_changed: bool,
    frames: usize,
}

impl Runner {
    fn new(objects: usize) -> Result<Self, Box<dyn Error>> {
        let (device, queue) = adapter::noop_device()?;
        let scheduler = Arc::new(Scheduler::new(2)?);
        let builder = Renderer::builder(WgpuBackend::new(device, queue)?).pipeline(Deferred::to_picture());
        let (renderer, submitter) = builder.build(scheduler)?;
        let mut scene = Scene::new();
        let mesh = scene.add(Mesh::cuboid("box", Vec3::ONE)?)?;
        let material = scene.add(Material::default())?;
        // Beyond all costs.
        let milliseconds = 1e6;
        let budget = ViewBudget::new(milliseconds)?;
        let mut runner = Self { renderer, submitter, budget, milliseconds, scene, is_changed: true, frames: 0 };
        for index in 0..objects {
            runner.scene.add_object(RenderObject::new(mesh, material, position(index)))?;
        }
        Ok(runner)
    }

    /// Adds boxes like the first one.
    fn grow(&mut self, from: usize, to: usize) -> Result<(), Box<dyn Error>> {
        let first = self.scene.objects().next().ok_or("there is no box")?;
        let first = self.scene.object(first)?;
        for index in from..to {
            self.scene.add_object(RenderObject { position: position(index), ..first })?;
        }
        self.is_changed = true;
        Ok(())
    }

    fn shrink(&mut self, to: usize) -> Result<(), Box<dyn Error>> {
        for object in self.scene.objects().skip(to).collect::<Vec<_>>() {
            self.scene.remove_object(object)?;
        }
        self.is_changed = true;
        Ok(())
    }

    fn step(&mut self, step: &'static str, frames: usize, progress: &ProgressBar) -> Result<Row, Box<dyn Error>> {
        let (mut times, mut changes, mut back_after) = (Vec::new(), 0, None);
        for frame in 0..frames {
            let before = self.levels();
            times.push(self.frame()?);
            let levels = self.levels();
            changes += before.iter().zip(&levels).filter(|(before, after)| before != after).count();
            let is_back = levels.iter().all(|level| *level == 0);
            back_after = is_back.then(|| back_after.unwrap_or(frame));
            progress.inc(1);
        }
        let settled = &times[SETTLES_WITHIN..];
        let ms = settled.iter().sum::<f64>() / settled.len() as f64;
        Ok(Row {
            step,
            objects: self.scene.objects().count(),
            budget_ms: self.milliseconds,
            ms,
            median_ms: median(settled.iter().copied()),
            percentile_95_ms: percentile(95, settled.iter().copied()),
            share_of_budget: ms / self.milliseconds,
            levels: self.levels(),
            changes,
            back_after,
        })
    }

    /// The thread time of a frame, in milliseconds.
    fn frame(&mut self) -> Result<f64, Box<dyn Error>> {
        let cameras = self.budget.cameras(&views(self.frames))?;
        self.frames += 1;
        self.renderer.add_choices(self.budget.choices());
        let changes = if std::mem::take(&mut self.is_changed) { Changes::Unknown } else { Changes::NONE };
        let scene = SceneRef { cameras: &cameras, changes, ..self.scene.as_scene_ref() };
        let submitted = self.submitter.submit(self.renderer.record(scene)?)?;
        self.budget.update(&submitted.statistics);
        Ok(submitted.statistics.stages.total().as_secs_f64() * 1e3)
    }

    fn levels(&self) -> Vec<usize> {
        views(0).iter().map(|view| self.budget.level(&view.name).unwrap_or(0)).collect()
    }
}

/// In layers of 100 × 100, all of them in sight.
fn position(index: usize) -> DVec3 {
    let [x, z] = [index % 100, index / 100 % 100].map(|place| 2.0 * place as f64);
    DVec3::new(x, (index / 10_000) as f64 * 2.0, z)
}
