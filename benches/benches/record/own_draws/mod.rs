//! Draws of an engine's own, recorded by its own code: items, each an indexed draw with a transform, of 16 pipelines
//! and 256 bind groups.

mod by_hand;
mod commands;
mod drawloom_items;
mod world;

use std::time::{Duration, Instant};

use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::statistics::median;
use drawloom_benches::stopwatch::mean_frame;
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use drawloom_output::print_line;
use indicatif::ProgressBar;
use serde::Serialize;

use by_hand::{Bundles, Encoders};
use commands::Commands;
use drawloom_items::DrawloomItems;
use world::{MATERIALS, OwnScene, PIPELINES, World};

use crate::fixture::Fixture;
use crate::report::count;
use crate::technique::Failure;
use crate::threads::Threads;
use crate::{CAMERAS, Extent};

/// A technique on a number of threads, in a scene.
#[derive(Serialize)]
pub struct OwnRow {
    pub technique: &'static str,
    pub scene: &'static str,
    pub workers: usize,
    /// How a hand-written technique divides its work among them; empty for one thread.
    #[serde(skip_serializing_if = "str::is_empty")]
    pub threads: &'static str,
    /// In all views.
    pub draws_per_frame: f64,
    pub microseconds_per_frame: f64,
    /// What ratios are of: where cameras turn, techniques are measured in different frames.
    pub ns_per_draw: f64,
}

/// A way to draw the items of a world.
trait OwnTechnique {
    /// Draws a frame, from visibility to submit, and returns the number of its draws.
    fn frame(&mut self, world: &World) -> Result<usize, Failure>;

    /// Waits until the device is idle.
    fn wait(&self) -> Result<(), Failure>;

    fn commands(&self) -> &Commands;
}

/// A technique on a number of threads, in a world of its own.
struct OwnContender {
    name: &'static str,
    workers: usize,
    runner: OwnRunner,
    world: World,
}

/// A technique, and what runs its frames.
enum OwnRunner {
    Drawloom(Box<DrawloomItems>),
    ByHand(Box<dyn OwnTechnique + Send>, Threads),
}

impl OwnContender {
    /// All contenders in a scene. The first is the plain loop.
    fn all(kind: OwnScene, items: usize, workers: &[usize]) -> Result<Vec<Self>, Failure> {
        let begin = || {
            let (backend, world) = (BackendName::Noop.open()?, World::new(kind, items)?);
            let commands = Commands::new(Fixture::new(&backend, &world.as_scene_ref())?, &world)?;
            Ok::<_, Failure>((backend, world, commands))
        };
        let encoders = |name, threads: &Threads| {
            let (_, world, commands) = begin()?;
            let technique = Box::new(Encoders::new(commands, &world, threads));
            let runner = OwnRunner::ByHand(technique, threads.clone());
            Ok::<_, Failure>(Self { name, workers: threads.count(), runner, world })
        };
        let bundles = |name, threads: &Threads, keeps_bundles| {
            let (_, world, commands) = begin()?;
            let technique = Box::new(Bundles::new(commands, &world, threads, keeps_bundles));
            let runner = OwnRunner::ByHand(technique, threads.clone());
            Ok::<_, Failure>(Self { name, workers: threads.count(), runner, world })
        };
        let drawloom = |name, workers, has_versions| {
            let (backend, world, commands) = begin()?;
            let technique = DrawloomItems::new(backend, commands, workers, has_versions)?;
            Ok::<_, Failure>(Self { name, workers, runner: OwnRunner::Drawloom(Box::new(technique)), world })
        };
        let mut all = vec![encoders(PLAIN_LOOP, &Threads::One)?];
        for threads in &Threads::all(workers)? {
            match threads {
                Threads::Spinning(_) => all.push(encoders("encoders", threads)?),
                Threads::Rayon(_) => {
                    all.push(bundles("bundles", threads, false)?);
                    all.push(bundles("kept bundles", threads, true)?);
                }
                Threads::One => all.push(bundles("kept bundles", threads, true)?),
                Threads::CameraEach(_) => {}
            }
        }
        for &workers in workers {
            all.push(drawloom(DRAWLOOM, workers, true)?);
            if kind.moves_items() {
                all.push(drawloom(WITHOUT_VERSIONS, workers, false)?);
            }
        }
        Ok(all)
    }

    /// Draws frames until they have taken `at_least`, and at least one.
    fn sample(&mut self, at_least: Duration) -> Result<Sample, Failure> {
        let world = &mut self.world;
        match &mut self.runner {
            OwnRunner::Drawloom(technique) => sample(&mut **technique, world, at_least),
            OwnRunner::ByHand(technique, threads) => {
                let sample = || sample(&mut **technique, world, at_least).map_err(|failure| failure.to_string());
                // Errors of wgpu cannot be sent from thread to thread.
                Ok(threads.run(sample)?)
            }
        }
    }

    fn technique(&self) -> &dyn OwnTechnique {
        match &self.runner {
            OwnRunner::Drawloom(technique) => &**technique,
            OwnRunner::ByHand(technique, _) => &**technique,
        }
    }

    /// How a hand-written technique divides its work among threads; empty for one thread.
    fn threads(&self) -> &'static str {
        match &self.runner {
            OwnRunner::Drawloom(_) => "",
            OwnRunner::ByHand(_, threads) => threads.name(),
        }
    }
}

/// The means of some frames.
struct Sample {
    seconds: f64,
    draws: f64,
}

fn sample(technique: &mut dyn OwnTechnique, world: &mut World, at_least: Duration) -> Result<Sample, Failure> {
    let (mut draws, mut frames) = (0, 0);
    let seconds = mean_frame(at_least, || {
        world.step();
        let start = Instant::now();
        draws += technique.frame(world)?;
        let elapsed = start.elapsed();
        frames += 1;
        technique.wait()?;
        Ok::<_, Failure>(elapsed)
    })?;
    Ok(Sample { seconds, draws: draws as f64 / f64::from(frames) })
}

/// How much longer a sample is than elsewhere: so long that it has several of the longest frames, and that tuners have
/// settled before samples count.
const SAMPLES: u32 = 3;

const PLAIN_LOOP: &str = "plain loop";
const DRAWLOOM: &str = "drawloom";
/// The engine does not say which commands are those of the frame before, so all are recorded.
const WITHOUT_VERSIONS: &str = "drawloom, without versions";

/// # Errors
/// Returns an error if a frame cannot be drawn, or if techniques do not draw the same number of items.
pub fn measure(extent: &Extent, workers: &[usize], progress: &ProgressBar) -> Result<Vec<OwnRow>, Failure> {
    let mut contenders = Vec::new();
    for kind in OwnScene::ALL {
        let mut of_scene = OwnContender::all(kind, extent.objects, workers)?;
        compare(&mut of_scene, extent.objects)?;
        contenders.append(&mut of_scene);
    }
    progress.set_message("own draws");
    let rounds = Rounds { warm_up: extent.warm_up[0], measured: extent.rounds[0] };
    let samples = Harness::new(rounds, progress)
        .measure(&mut contenders, |contender, _| contender.sample(SAMPLES * extent.sample[0]))?;
    let row = |(contender, samples): (&OwnContender, Vec<Sample>)| OwnRow {
        technique: contender.name,
        scene: contender.world.kind().name(),
        workers: contender.workers,
        threads: contender.threads(),
        draws_per_frame: median(samples.iter().map(|sample| sample.draws)),
        microseconds_per_frame: median(samples.iter().map(|sample| sample.seconds)) * 1e6,
        ns_per_draw: median(samples.iter().map(|sample| sample.seconds / sample.draws)) * 1e9,
    };
    Ok(contenders.iter().zip(samples).map(row).collect())
}

/// Has each contender draw some frames, of which the first records all commands.
///
/// # Errors
/// Returns an error if one does not draw as many items as the first contender, or records others than it draws.
fn compare(contenders: &mut [OwnContender], items: usize) -> Result<(), Failure> {
    let mut expected = Vec::new();
    for contender in contenders {
        let (name, scene) = ([contender.name, contender.threads()].join(" "), contender.world.kind());
        for frame in 0..COMPARED {
            let drawn = contender.sample(Duration::ZERO)?.draws as usize;
            let recorded = contender.technique().commands().take_recorded();
            if frame == 0 && recorded != drawn {
                return Err(format!("{name}, {}: records {recorded} draws of {drawn}", scene.name()).into());
            }
            let all = items * CAMERAS;
            let wanted = match expected.get(frame) {
                None if scene.moves_cameras() => drawn,
                None => all,
                Some(wanted) => *wanted,
            };
            if drawn.abs_diff(wanted) > all / ITEMS_PER_DIFFERENCE {
                return Err(format!("{name}, {}: draws {drawn} items instead of {wanted}", scene.name()).into());
            }
            if expected.len() == frame {
                expected.push(wanted);
            }
        }
    }
    Ok(())
}

const COMPARED: usize = 4;
/// What is written by hand culls in f32, so one item in so many may differ: one that touches the border of a picture.
const ITEMS_PER_DIFFERENCE: usize = 10_000;

pub fn print(rows: &[OwnRow]) {
    print_line!("Draws of an engine's own, {PIPELINES} pipelines and {MATERIALS} bind groups, noop\n");
    let mut table =
        Table::new(&["technique", "scene", "workers", "threads", "draws", "µs a frame", "ns a draw", "÷ plain loop"]);
    for row in rows {
        table.row([
            row.technique.to_owned(),
            row.scene.to_owned(),
            row.workers.to_string(),
            row.threads.to_owned(),
            format!("{:.0}", row.draws_per_frame),
            format!("{:.1}", row.microseconds_per_frame),
            format!("{:.1}", row.ns_per_draw),
            format!("{:.2}", row.ns_per_draw / nanoseconds(rows, PLAIN_LOOP, row.scene, 1)),
        ]);
    }
    table.print();
    print_line!();
}

/// Adds the targets, and what was reached.
pub fn add_targets(rows: &[OwnRow], workers: &[usize], targets: &mut Targets) {
    let [Some(&few), Some(&many)] = [workers.first(), workers.last()] else { return };
    let ns = |technique, scene: OwnScene, workers| nanoseconds(rows, technique, scene.name(), workers);
    for (scene, bound) in
        [(OwnScene::Moving, 1.0), (OwnScene::Turning, 1.0), (OwnScene::AtRest, 0.1), (OwnScene::TenthInView, 0.7)]
    {
        let figure = format!("own draws, {} ÷ plain loop, {}", count(few, "worker"), scene.name());
        targets.at_most(figure, bound, ns(DRAWLOOM, scene, few) / ns(PLAIN_LOOP, scene, 1));
    }
    if many > few {
        let several = many as f64 / few as f64;
        for technique in [DRAWLOOM, WITHOUT_VERSIONS] {
            let figure = format!("own draws, {technique}, {} ÷ {many}, moving", count(few, "worker"));
            let speed_up = ns(technique, OwnScene::Moving, few) / ns(technique, OwnScene::Moving, many);
            targets.at_least(figure, 0.9 * several, speed_up);
        }
    }
}

/// Nanoseconds per draw. NaN if that was not measured.
fn nanoseconds(rows: &[OwnRow], technique: &str, scene: &str, workers: usize) -> f64 {
    let row = rows.iter().find(|row| (row.technique, row.scene, row.workers) == (technique, scene, workers));
    row.map_or(f64::NAN, |row| row.ns_per_draw)
}
