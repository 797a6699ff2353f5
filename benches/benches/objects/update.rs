//! An engine's update beside submission (L 3): the world is given back when recording ends, so all workers may update it for the next
//! frame, while the calling thread submits this one.

use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::backend::WgpuSubmission;
use drawloom::task::{Scheduler, Scope};
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::moving::Moving;
use drawloom_benches::statistics::median;
use drawloom_benches::stopwatch::mean_frame;
use drawloom_benches::work::Work;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::runner::Runner;
use crate::{Extent, world};

/// What the update of an object takes, and the objects of a job.
const PER_OBJECT: Duration = Duration::from_nanos(100);
const CHUNK: usize = 256;

/// A row of the table.
#[derive(Serialize)]
pub struct Row {
    pub objects: usize,
    pub backend: BackendName,
    pub workers: usize,
    /// Frames per second, without the device's time, of update, record and submit one after another.
    pub update_before_fps: f64,
    /// The same with the update while the frame is submitted.
    pub update_beside_fps: f64,
    pub ratio: f64,
}

/// When the engine updates its world.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Update {
    BeforeRecord,
    BesideSubmit,
}

struct Contender {
    runner: Runner,
    world: Moving,
    update: Update,
}

/// Measures both orders with all numbers of workers, interleaved.
///
/// # Errors
/// Returns an error if a frame cannot be drawn.
pub fn measure(
    extent: &Extent,
    backend: BackendName,
    objects: usize,
    workers: &[usize],
    progress: &ProgressBar,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let rounds = Rounds { warm_up: backend.of(extent.warm_up), measured: backend.of(extent.rounds) };
    progress.set_message(format!("{objects} objects and an update, {}", backend.name()));
    let work = Work::busy(PER_OBJECT);
    let mut contenders = Vec::new();
    for &workers in workers {
        let scheduler = Arc::new(Scheduler::new(workers)?);
        for update in [Update::BeforeRecord, Update::BesideSubmit] {
            let runner = Runner::new(backend.open()?, &scheduler, false)?;
            contenders.push(Contender { runner, world: world::new(objects)?, update });
        }
    }
    let times = Harness::new(rounds, progress).measure(&mut contenders, |contender, round| {
        let at_least = if round.is_warm_up() { Duration::ZERO } else { backend.of(extent.sample) };
        mean_frame(at_least, || contender.frame(&work))
    })?;
    let fps = |times: &[f64]| median(times.iter().copied()).recip();
    let row = |(&workers, times): (&usize, &[Vec<f64>])| {
        let [update_before_fps, update_beside_fps] = [fps(&times[0]), fps(&times[1])];
        let ratio = update_beside_fps / update_before_fps;
        Row { objects, backend, workers, update_before_fps, update_beside_fps, ratio }
    };
    Ok(workers.iter().zip(times.chunks(2)).map(row).collect())
}

impl Contender {
    /// Draws a frame, and waits until the device is idle again. Returns the time without that.
    fn frame(&mut self, work: &Work) -> Result<Duration, Box<dyn Error>> {
        let Self { runner: Runner { renderer, submitter }, world, update } = self;
        let scheduler = Arc::clone(renderer.scheduler());
        let start = Instant::now();
        if *update == Update::BeforeRecord {
            scheduler.scope(|scope| spawn_update(scope, world, work))?;
        }
        let recorded = renderer.record(world.as_scene_ref())?;
        let submitted = match update {
            Update::BeforeRecord => submitter.submit(recorded)?,
            Update::BesideSubmit => scheduler.scope(|scope| {
                spawn_update(scope, world, work);
                submitter.submit(recorded)
            })??,
        };
        let elapsed = start.elapsed();
        WgpuSubmission::wait(&submitted.submission)?;
        Ok(elapsed)
    }
}

/// Spawns the jobs of an update: one moves the objects, the others have the remaining work of [`CHUNK`] objects each.
fn spawn_update<'scope>(scope: &Scope<'scope>, world: &'scope mut Moving, work: &'scope Work) {
    let objects = world.as_scene_ref().object_count();
    scope.spawn(|_scope, _worker| world.step());
    for first in (0..objects).step_by(CHUNK) {
        scope.spawn(move |_scope, _worker| (first..objects.min(first + CHUNK)).for_each(|object| work.job(object)));
    }
}
