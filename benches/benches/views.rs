//! What views cost the processor: one more, and many on several workers.
//!
//!     cargo bench -p drawloom-benches --bench views
//!     cargo bench -p drawloom-benches --bench views -- --quick
//!     cargo bench -p drawloom-benches --bench views -- --workers 1,4
//!
//! Measured is one frame on wgpu's `noop` device, from the hand-over of the scene to the return of submit. What is
//! compared in a row is drawn in turn, and the table has the medians. All cameras move in every frame.
//! `target/drawloom/views.json` has the same.
//!
//! The second table has the memory of many small views with transient targets, each number of views in a process of its
//! own. The last line names the targets that were missed.

use std::env;
use std::error::Error;
use std::fs;
use std::process::Command;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use clap::Parser;
use drawloom::backend::WgpuBackend;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::{
    Camera, Changes, ClipPlane, LayerMask, Material, Mesh, Projection, RenderObject, Scene, SceneRef, ViewKind,
};
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use drawloom_benches::arguments::{ExtentArguments, WorkersArguments};
use drawloom_benches::harness::{Harness, Rounds, WARM_UP, progress_bar};
use drawloom_benches::mirror::{self, Mirror};
use drawloom_benches::results;
use drawloom_benches::statistics::median_duration;
use drawloom_benches::stopwatch::timed_frame;
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use drawloom_output::print_line;
use drawloom_testing::adapter;
use drawloom_testing::scenes::field;
use indicatif::ProgressBar;
use serde::Serialize;

#[derive(Parser)]
struct ViewsArguments {
    #[command(flatten)]
    extent: ExtentArguments,
    #[command(flatten)]
    workers: WorkersArguments,
    /// Draw this number of views, and print the memory that they need in KiB.
    #[arg(long)]
    views: Option<usize>,
}

/// Two ways to draw a frame.
#[derive(Serialize)]
struct Row {
    compared: &'static str,
    /// Of the second; the first has as many, or one, if the numbers of workers are compared.
    workers: usize,
    /// Whether the second is the first on more workers.
    #[serde(skip)]
    is_speed_up: bool,
    /// Objects that the views see, summed over those of the first frame, and of the second.
    seen: [usize; 2],
    microseconds: [f64; 2],
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: ViewsArguments = drawloom_output::parse_arguments();
    if let Some(views) = arguments.views {
        return print_memory(views);
    }
    let quick = arguments.extent.is_quick();
    let (rounds, side) = if quick { (3, 20) } else { (1001, 100) };
    let progress = progress_bar("frames");
    let workers = arguments.workers.counts();
    let mut rows = Vec::new();
    for &workers in &workers {
        rows.push(mirror(side, workers, rounds, &progress)?);
    }
    for &workers in workers.iter().filter(|&&workers| workers > 1) {
        rows.push(many_views(side, workers, rounds, &progress)?);
    }
    progress.finish_and_clear();

    let mut table =
        Table::new(&["compared", "workers", "objects seen", "first, µs", "second, µs", "difference, µs", "ratio"]);
    for Row { compared, workers, seen, microseconds: [first, second], .. } in &rows {
        let seen = format!("{} and {}", seen[0], seen[1]);
        let [difference, ratio] = [format!("{:.1}", second - first), format!("{:.2}", first / second)];
        let [first, second] = [first, second].map(|time| format!("{time:.1}"));
        table.row([(*compared).to_owned(), workers.to_string(), seen, first, second, difference, ratio]);
    }
    table.print();

    let counts = if quick { [5, 20] } else { [500, 2_000] };
    let memory = counts.map(|views| memory_of(views).map(|mebibytes| Memory { views, mebibytes }));
    let [few, many] = memory;
    let memory = [few?, many?];
    let mut table = Table::new(&["views", "MiB", "ratio"]);
    for Memory { views, mebibytes } in &memory {
        let ratio = mebibytes / memory[0].mebibytes;
        table.row([views.to_string(), format!("{mebibytes:.1}"), format!("{ratio:.2}")]);
    }
    table.print();
    let targets = targets(&rows, &memory);
    targets.print("Targets and results");
    if !quick {
        results::write_json("views.json", &(rows, memory))?;
    }
    targets.print_missed();
    Ok(())
}

/// The targets: several workers divide the time of many views, and memory grows no faster than the number of views.
fn targets(rows: &[Row], [few, many]: &[Memory; 2]) -> Targets {
    let mut targets = Targets::new();
    for Row { compared, workers, microseconds: [first, second], .. } in rows.iter().filter(|row| row.is_speed_up) {
        targets.at_least(format!("{compared}, {workers} workers"), 0.9 * *workers as f64, first / second);
    }
    let figure = format!("memory of {} ÷ {} views", many.views, few.views);
    targets.at_most(figure, many.views as f64 / few.views as f64, many.mebibytes / few.mebibytes);
    targets
}

/// What a process with many views needs.
#[derive(Serialize)]
struct Memory {
    views: usize,
    /// Of the process, in RAM, without what it has before it draws.
    mebibytes: f64,
}

/// Measures the memory of this number of views in another process.
fn memory_of(views: usize) -> Result<f64, Box<dyn Error>> {
    let output = Command::new(env::current_exe()?).arg("--views").arg(views.to_string()).output()?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into());
    }
    let kibibytes: f64 = String::from_utf8(output.stdout)?.trim().parse()?;
    Ok(kibibytes / 1024.0)
}

/// Draws this number of views of 8 × 8 pixels of 500 objects, and prints by how many KiB the process has grown.
fn print_memory(views: usize) -> Result<(), Box<dyn Error>> {
    let (device, queue) = adapter::noop_device()?;
    let builder = Renderer::builder(WgpuBackend::new(device, queue)?.transient_targets());
    let (mut renderer, submitter) = builder.pipeline(Deferred::to_picture()).build(Arc::new(Scheduler::new(2)?))?;
    let mut scene = field(500);
    let camera = Camera { size: [8, 8], ..scene.cameras[0].clone() };
    scene.cameras = (0..views).map(|view| Camera { name: format!("view {view}"), ..camera.clone() }).collect();
    let before = resident_kib()?;
    for _ in 0..3 {
        submitter.submit(renderer.record(scene.as_scene_ref())?)?;
    }
    print_line!("{}", resident_kib()?.saturating_sub(before));
    Ok(())
}

/// The memory of this process that is in RAM, in KiB, on Linux.
fn resident_kib() -> Result<usize, Box<dyn Error>> {
    let status = fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let number = line.and_then(|line| line.split_whitespace().next());
    Ok(number.ok_or("the system does not tell how much memory a process has")?.parse()?)
}

/// A frame without a mirror and with one.
fn mirror(side: usize, workers: usize, rounds: usize, progress: &ProgressBar) -> Result<Row, Box<dyn Error>> {
    let scene = grid(side)?;
    let runners = [Runner::new(workers, false)?, Runner::new(workers, true)?];
    measure("without and with a small mirror", scene, runners, rounds, progress)
}

/// The same 64 views on one worker and on several.
fn many_views(side: usize, workers: usize, rounds: usize, progress: &ProgressBar) -> Result<Row, Box<dyn Error>> {
    let scene = grid(side)?;
    let mut runners = [Runner::new(1, false)?, Runner::new(workers, false)?];
    for runner in &mut runners {
        runner.cameras = (0..64).map(|index| overhead(&format!("view {index}"), index as f64 * 5.0, 7)).collect();
    }
    measure("64 views, on 1 worker and on all", scene, runners, rounds, progress)
}

fn measure(
    compared: &'static str,
    scene: Scene,
    mut runners: [Runner; 2],
    rounds: usize,
    progress: &ProgressBar,
) -> Result<Row, Box<dyn Error>> {
    let [first_workers, workers] = [0, 1].map(|index: usize| runners[index].renderer.scheduler().workers());
    let is_speed_up = workers > first_workers;
    let mut seen = Vec::new();
    for runner in &mut runners {
        seen.push(runner.frame(&scene)?.0);
    }
    let times = Harness::new(Rounds { warm_up: WARM_UP, measured: rounds }, progress)
        .measure(&mut runners, |runner, _round| Ok::<_, Box<dyn Error>>(runner.frame(&scene)?.1))?;
    let microseconds = |times: &Vec<Duration>| median_duration(times.iter().copied()).as_secs_f64() * 1e6;
    Ok(Row {
        compared,
        workers,
        is_speed_up,
        seen: [seen[0], seen[1]],
        microseconds: [microseconds(&times[0]), microseconds(&times[1])],
    })
}

/// A square of boxes, 2 m apart, with a mirror in the middle.
fn grid(side: usize) -> Result<Scene, Box<dyn Error>> {
    let mut scene = Scene::new();
    let mesh = scene.add(Mesh::cuboid("box", Vec3::ONE)?)?;
    let material = scene.add(Material::default())?;
    for index in 0..side * side {
        let [x, z] = [index % side, index / side].map(|place| 2.0 * place as f64);
        let object = RenderObject::new(mesh, material, DVec3::new(x, 0.0, z));
        scene.add_object(RenderObject { layers: WORLD, ..object })?;
    }
    let mirror = RenderObject::new(mesh, material, DVec3::new(side as f64, 1.0, side as f64));
    scene.add_object(RenderObject { layers: mirror::LAYER, ..mirror })?;
    Ok(scene)
}

/// A camera above the boxes that sees some `across` × `across` of them.
fn overhead(name: &str, along: f64, across: u32) -> Camera {
    let position = DVec3::new(30.0 + along % 140.0, 20.0, 40.0 + along / 8.0);
    let camera = Camera::looking_at(name, position, position - DVec3::new(0.0, 20.0, 1e-3));
    let field_of_view = 2.0 * (across as f32 / 20.0).atan();
    Camera { projection: Projection::Perspective { field_of_view }, size: [8, 8], ..camera }
}

const WORLD: LayerMask = LayerMask::layer(0);

struct Runner {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    cameras: Vec<Camera>,
    frames: usize,
}

impl Runner {
    /// With a camera above the middle of the boxes and, if `mirrors`, one for the mirror, which sees some 200 of them.
    fn new(workers: usize, mirrors: bool) -> Result<Self, Box<dyn Error>> {
        let (device, queue) = adapter::noop_device()?;
        let scheduler = Arc::new(Scheduler::new(workers)?);
        let builder =
            Renderer::builder(WgpuBackend::new(device, queue)?).pipeline(Deferred::to_picture()).process(Mirror);
        let (renderer, submitter) = builder.build(scheduler)?;
        let main = overhead("main", 70.0, 40);
        let mut cameras = vec![main.clone()];
        if mirrors {
            let plane = ClipPlane { point: DVec3::Y, normal: Vec3::Y };
            let mirrored = Camera { name: main.child_name(mirror::VIEW), ..overhead("", 70.0, 14) };
            cameras.push(Camera { clip_plane: Some(plane), kind: ViewKind::Reflection, layers: WORLD, ..mirrored });
        }
        Ok(Self { renderer, submitter, cameras, frames: 0 })
    }

    /// The number of objects that all views see, and the time.
    fn frame(&mut self, scene: &Scene) -> Result<(usize, Duration), Box<dyn Error>> {
        for camera in &mut self.cameras {
            camera.position.x += if self.frames.is_multiple_of(2) { 0.01 } else { -0.01 };
        }
        let changes = if self.frames == 0 { Changes::Unknown } else { Changes::NONE };
        self.frames += 1;
        let scene = SceneRef { cameras: &self.cameras, changes, ..scene.as_scene_ref() };
        let (submitted, time) = timed_frame(&mut self.renderer, &self.submitter, scene, |_| Ok(()))?;
        Ok((submitted.statistics.views.iter().map(|view| view.visible).sum(), time.cpu))
    }
}
