//! What the size of a job costs: a frame recorded and submitted, at each granularity, by one worker and by several.
//!
//!     cargo bench --bench granularity
//!     cargo bench --bench granularity -- --quick
//!
//! All settings of a table's block take turns, a frame each, so that whatever else the machine does meets them alike. What
//! is shown is the median. Backends are never mixed: each has its own block, and its own setting to compare with.

#[path = "../examples/frame/adapter.rs"]
#[expect(dead_code, reason = "the other half is for the frame example")]
mod adapter;
#[path = "shared/boxes.rs"]
mod boxes;
#[path = "shared/random.rs"]
mod random;
#[path = "shared/stopwatch.rs"]
#[expect(dead_code, reason = "the device's time is for the bench of the deferred pipeline")]
mod stopwatch;

use std::error::Error;
use std::f64::consts::TAU;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use clap::Parser;
use drawloom::backend::{Backend, BackendError, NullBackend, WgpuBackend, WgpuSubmission};
use drawloom::glam::{DVec3, Quat};
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Material, RenderObject, Scene, SceneError};
use drawloom::task::Scheduler;
use drawloom::{Granularity, Renderer, Submitter};
use indicatif::{ProgressBar, ProgressStyle};

use boxes::new_box;
use random::Random;
use stopwatch::{WARM_UP, median, timed_frame};

const MESHES: u32 = 64;
/// So many that a view of a large cloud has 64 × 16 = 1,024 batches, which are four bundles to record.
const MATERIALS: u32 = 16;

const GRANULARITIES: [(&str, Granularity); 6] = [
    ("adaptive", Granularity::Adaptive),
    ("per-camera", Granularity::PerCamera),
    ("per-draw", Granularity::PerDraw),
    ("chunk:64", Granularity::Chunk(64)),
    ("chunk:256", Granularity::Chunk(256)),
    ("chunk:1024", Granularity::Chunk(1024)),
];

/// Compares granularities and numbers of workers.
#[derive(Parser)]
struct Arguments {
    /// Few rounds and small scenes, to see that it works.
    #[arg(long)]
    quick: bool,
    /// Given by `cargo bench`; without it, as under `cargo test --benches`, the run is a quick one.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let quick = arguments.quick || !arguments.bench;
    let (rounds, share) = if quick { (3, 20) } else { (101, 1) };
    let workers = [1, thread::available_parallelism()?.get().max(2)];
    let cases = [Case { name: "even", scene: even_scene(10_000 / share)?, seen: vec![10_000 / share; 4] }, {
        let seen = [20_000, 500, 1_000, 1_500].map(|objects| objects / share);
        Case { name: "uneven", scene: uneven_scene(seen)?, seen: seen.to_vec() }
    }];

    let blocks = cases.len() * 2;
    let progress = ProgressBar::new((blocks * (rounds + WARM_UP) * workers.len() * GRANULARITIES.len()) as u64);
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} frames, {eta} left  {msg}")?);
    let mut table = Vec::new();
    for case in &cases {
        let mut turns = Turns { case, backend: "null", rounds, workers, progress: &progress };
        table.extend(turns.measure(|| Ok(NullBackend), |_| Ok(()))?);
        turns.backend = "noop";
        let open = || {
            let (device, queue) = adapter::noop_device()?;
            Ok(WgpuBackend::new(device, queue)?)
        };
        table.extend(turns.measure(open, WgpuSubmission::wait)?);
    }
    progress.finish_and_clear();
    print_table(&table, rounds, quick);
    Ok(())
}

struct Case {
    name: &'static str,
    scene: Scene,
    /// How many objects each camera is to see.
    seen: Vec<usize>,
}

/// One block of the table: all settings on one scene and one backend.
struct Turns<'a> {
    case: &'a Case,
    backend: &'static str,
    rounds: usize,
    workers: [usize; 2],
    progress: &'a ProgressBar,
}

/// A line of the table.
struct Line {
    scene: &'static str,
    backend: &'static str,
    workers: usize,
    granularity: &'static str,
    median: Duration,
    /// Objects seen, summed over views.
    seen: usize,
    speed_up: f64,
}

/// One setting of a block, with the frames it took.
struct Setting<B: Backend> {
    workers: usize,
    granularity: &'static str,
    renderer: Renderer<B>,
    submitter: Submitter<B>,
    times: Vec<Duration>,
}

impl Turns<'_> {
    /// Lets all settings take turns. `wait` is for the device to be idle before the next turn; it is not measured.
    fn measure<B: Backend>(
        &self,
        open: impl Fn() -> Result<B, Box<dyn Error>>,
        wait: impl Fn(&B::Submission) -> Result<(), BackendError>,
    ) -> Result<Vec<Line>, Box<dyn Error>> {
        self.progress.set_message(format!("{}, {}", self.case.name, self.backend));
        let mut settings = Vec::new();
        for workers in self.workers {
            let scheduler = Arc::new(Scheduler::new(workers)?);
            for (name, granularity) in GRANULARITIES {
                let builder = Renderer::builder(open()?).deferred(Deferred::to_picture()).granularity(granularity);
                let (renderer, submitter) = builder.build(Arc::clone(&scheduler))?;
                settings.push(Setting { workers, granularity: name, renderer, submitter, times: Vec::new() });
            }
        }
        for round in 0..WARM_UP + self.rounds {
            for setting in &mut settings {
                let time = self.frame(setting, &wait)?;
                if round >= WARM_UP {
                    setting.times.push(time);
                }
                self.progress.inc(1);
            }
        }
        let medians: Vec<_> = settings.iter().map(|setting| median(setting.times.iter().copied())).collect();
        let line = |(setting, &median): (&Setting<B>, &Duration)| Line {
            scene: self.case.name,
            backend: self.backend,
            workers: setting.workers,
            granularity: setting.granularity,
            median,
            seen: self.case.seen.iter().sum(),
            // The first setting is one worker, per camera.
            speed_up: medians[0].as_secs_f64() / median.as_secs_f64(),
        };
        Ok(settings.iter().zip(&medians).map(line).collect())
    }

    /// From the scene's hand-over to the return of submit.
    fn frame<B: Backend>(
        &self,
        setting: &mut Setting<B>,
        wait: impl Fn(&B::Submission) -> Result<(), BackendError>,
    ) -> Result<Duration, Box<dyn Error>> {
        let Setting { renderer, submitter, .. } = setting;
        let (submitted, time) = timed_frame(renderer, submitter, &self.case.scene, wait)?;
        let seen: Vec<_> = submitted.statistics.views.iter().map(|view| view.visible).collect();
        if seen != self.case.seen {
            return Err(format!("{}: cameras see {seen:?} objects, not {:?}", self.case.name, self.case.seen).into());
        }
        Ok(time.processor)
    }
}

fn print_table(table: &[Line], rounds: usize, quick: bool) {
    let note = if quick { "; a quick run, whose figures mean nothing" } else { "" };
    println!("record + submit, median of {rounds} frames{note}");
    println!("ns: per object and view that sees it; speed-up: against 1 worker, per-camera, in the same block\n");
    println!("| scene  | backend | workers | granularity | median ms |       ns | speed-up |");
    println!("| ------ | ------- | ------: | ----------- | --------: | -------: | -------: |");
    for Line { scene, backend, workers, granularity, median, seen, speed_up } in table {
        let (milliseconds, share) = (median.as_secs_f64() * 1e3, median.as_secs_f64() * 1e9 / *seen as f64);
        println!(
            "| {scene:<6} | {backend:<7} | {workers:>7} | {granularity:<11} | {milliseconds:>9.3} | {share:>8.1} | \
             {speed_up:>7.2}x |"
        );
    }
}

/// Four cameras around one cloud of objects: each sees all of it.
fn even_scene(objects: usize) -> Result<Scene, SceneError> {
    let mut scene = scene_of_clouds([(DVec3::ZERO, objects)])?;
    scene.cameras = directions().map(|(name, direction)| camera(name, direction * DISTANCE, DVec3::ZERO)).into();
    Ok(scene)
}

/// Four cameras back to back, each with a cloud of its own.
fn uneven_scene(objects: [usize; 4]) -> Result<Scene, SceneError> {
    let centers = directions().map(|(_, direction)| direction * DISTANCE);
    let mut scene = scene_of_clouds(centers.into_iter().zip(objects))?;
    scene.cameras = directions().map(|(name, direction)| camera(name, DVec3::ZERO, direction * DISTANCE)).into();
    Ok(scene)
}

/// In metres. A cloud fills 20° to each side of where its camera looks. A camera sees 30° up and down, and with its square
/// picture as far to the left and right; so it sees all of its cloud, and nothing of those a quarter turn away.
const DISTANCE: f64 = 150.0;
const CLOUD_RADIUS: f64 = 50.0;

fn directions() -> [(&'static str, DVec3); 4] {
    let toward = |turn: f64| DVec3::new((TAU * turn).cos(), 0.0, (TAU * turn).sin());
    [("east", toward(0.0)), ("south", toward(0.25)), ("west", toward(0.5)), ("north", toward(0.75))]
}

fn camera(name: &str, position: DVec3, target: DVec3) -> Camera {
    Camera { size: [512, 512], ..Camera::looking_at(name, position, target) }
}

/// Boxes scattered in clouds, given by centre and number of boxes.
fn scene_of_clouds(clouds: impl IntoIterator<Item = (DVec3, usize)>) -> Result<Scene, SceneError> {
    let mut random = Random::new();
    let mut scene = Scene::new();
    let (mut meshes, mut materials) = (Vec::new(), Vec::new());
    for index in 0..MESHES {
        meshes.push(scene.add(new_box(format!("box {index}"), random.vector(0.1, 0.6))?)?);
    }
    for index in 0..MATERIALS {
        let (name, diffuse) = (format!("paint {index}"), random.vector(0.2, 0.9));
        materials.push(scene.add(Material { name, diffuse, ..Material::default() })?);
    }
    for (center, objects) in clouds {
        for _ in 0..objects {
            let position = center + random.direction() * (CLOUD_RADIUS * random.between(0.0, 1.0).cbrt());
            let orientation = Quat::from_axis_angle(random.direction().as_vec3(), random.between(0.0, TAU) as f32);
            let mesh = meshes[random.below(meshes.len())];
            let material = materials[random.below(materials.len())];
            scene.add_object(RenderObject { orientation, ..RenderObject::new(mesh, material, position) })?;
        }
    }
    Ok(scene)
}
