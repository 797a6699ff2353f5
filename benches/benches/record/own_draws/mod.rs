//! Draws of an engine's own, recorded by its own code: items, each an indexed draw with a transform, of 16 pipelines and
//! 256 bind groups.

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

use by_hand::Encoders;
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
    pub draws: usize,
    pub microseconds_per_frame: f64,
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
        let drawloom = |name, workers, has_versions| {
            let (backend, world, commands) = begin()?;
            let technique = DrawloomItems::new(backend, commands, workers, has_versions)?;
            Ok::<_, Failure>(Self { name, workers, runner: OwnRunner::Drawloom(Box::new(technique)), world })
        };
        let mut all = vec![encoders(PLAIN_LOOP, &Threads::One)?];
        for &workers in workers {
            all.push(drawloom(DRAWLOOM, workers, true)?);
            if kind.moves_items() {
                all.push(drawloom(WITHOUT_VERSIONS, workers, false)?);
            }
        }
        Ok(all)
    }

    /// Draws frames until they have taken `at_least`, and at least one. Returns the seconds and the draws of a frame.
    fn sample(&mut self, at_least: Duration) -> Result<(f64, usize), Failure> {
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

fn sample(technique: &mut dyn OwnTechnique, world: &mut World, at_least: Duration) -> Result<(f64, usize), Failure> {
    let mut draws = 0;
    let seconds = mean_frame(at_least, || {
        world.step();
        let start = Instant::now();
        draws = technique.frame(world)?;
        let elapsed = start.elapsed();
        technique.wait()?;
        Ok::<_, Failure>(elapsed)
    })?;
    Ok((seconds, draws))
}

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
    let samples =
        Harness::new(rounds, progress).measure(&mut contenders, |contender, _| contender.sample(extent.sample[0]))?;
    let row = |(contender, samples): (&OwnContender, Vec<(f64, usize)>)| OwnRow {
        technique: contender.name,
        scene: contender.world.kind().name(),
        workers: contender.workers,
        threads: contender.threads(),
        draws: median(samples.iter().map(|(_, draws)| *draws as f64)) as usize,
        microseconds_per_frame: median(samples.iter().map(|(seconds, _)| *seconds)) * 1e6,
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
            let (_, drawn) = contender.sample(Duration::ZERO)?;
            let recorded = contender.technique().commands().take_recorded();
            if frame == 0 && recorded != drawn {
                return Err(format!("{name}, {}: records {recorded} draws of {drawn}", scene.name()).into());
            }
            if expected.len() == frame {
                expected.push(drawn);
            }
            let is_partial = scene.moves_cameras();
            let all = items * CAMERAS;
            if drawn.abs_diff(expected[frame]) > drawn / ITEMS_PER_DIFFERENCE || !is_partial && drawn != all {
                let expected = expected[frame];
                return Err(format!("{name}, {}: draws {drawn} items instead of {expected}", scene.name()).into());
            }
        }
    }
    Ok(())
}

const COMPARED: usize = 4;
/// What is written by hand culls in f32, so one item in so many, which touches the border of a picture, may differ.
const ITEMS_PER_DIFFERENCE: usize = 2_000;

pub fn print(rows: &[OwnRow]) {
    print_line!("Draws of an engine's own, {PIPELINES} pipelines and {MATERIALS} bind groups, noop\n");
    let mut table =
        Table::new(&["technique", "scene", "workers", "threads", "draws", "µs a frame", "ns a draw", "÷ plain loop"]);
    for row in rows {
        let plain_loop = microseconds(rows, PLAIN_LOOP, row.scene, 1);
        table.row([
            row.technique.to_owned(),
            row.scene.to_owned(),
            row.workers.to_string(),
            row.threads.to_owned(),
            row.draws.to_string(),
            format!("{:.1}", row.microseconds_per_frame),
            format!("{:.1}", row.microseconds_per_frame * 1e3 / row.draws as f64),
            format!("{:.2}", row.microseconds_per_frame / plain_loop),
        ]);
    }
    table.print();
    print_line!();
}

/// Adds the targets, and what was reached.
pub fn add_targets(rows: &[OwnRow], workers: &[usize], targets: &mut Targets) {
    let [Some(&few), Some(&many)] = [workers.first(), workers.last()] else { return };
    let of_plain_loop = |scene: OwnScene| {
        microseconds(rows, DRAWLOOM, scene.name(), few) / microseconds(rows, PLAIN_LOOP, scene.name(), 1)
    };
    for (scene, bound) in
        [(OwnScene::Moving, 1.0), (OwnScene::Turning, 1.0), (OwnScene::AtRest, 0.1), (OwnScene::TenthInView, 0.7)]
    {
        let figure = format!("own draws, {} ÷ plain loop, {}", count(few, "worker"), scene.name());
        targets.at_most(figure, bound, of_plain_loop(scene));
    }
    if many > few {
        for technique in [DRAWLOOM, WITHOUT_VERSIONS] {
            let own = |workers| microseconds(rows, technique, OwnScene::Moving.name(), workers);
            let figure =
                format!("own draws, {technique}, {} ÷ {}, moving", count(few, "worker"), count(many, "worker"));
            targets.at_least(figure, 0.9 * many as f64 / few as f64, own(few) / own(many));
        }
    }
}

/// Microseconds per frame. NaN if that was not measured.
fn microseconds(rows: &[OwnRow], technique: &str, scene: &str, workers: usize) -> f64 {
    let row = rows.iter().find(|row| (row.technique, row.scene, row.workers) == (technique, scene, workers));
    row.map_or(f64::NAN, |row| row.microseconds_per_frame)
}
