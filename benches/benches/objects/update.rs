//! An engine's update beside submission (L 3): the world is given back when recording ends, so all workers may update
//! it for the next frame, while the calling thread or that of a `FrameLoop` submits this one.

use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::backend::{WgpuBackend, WgpuSubmission};
use drawloom::task::{Scheduler, Scope};
use drawloom::{Buffering, FinishedFrame, FrameLoop};
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::moving::Moving;
use drawloom_benches::statistics::median;
use drawloom_benches::stopwatch::mean_frame;
use drawloom_benches::work::Work;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::runner::{Division, Runner};
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
    /// Frames per second, with the device's time, of update, record and submit one after another.
    pub update_before_fps: f64,
    /// The same with the update while the frame is submitted.
    pub update_beside_fps: f64,
    /// The same with two frames in flight, which a thread of their own submits.
    pub update_in_loop_fps: f64,
    /// Of the two to the first.
    pub beside_ratio: f64,
    pub in_loop_ratio: f64,
}

/// When the engine updates its world.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Update {
    BeforeRecord,
    BesideSubmit,
}

struct Contender {
    world: Moving,
    frames: Frames,
}

enum Frames {
    /// One at a time.
    Plain {
        runner: Runner,
        update: Update,
    },
    InFlight(FrameLoop<WgpuBackend>),
}

/// Frames in flight of [`Buffering::Double`].
const IN_FLIGHT: usize = 2;
/// A sample of frames in flight has at least as many.
const LEAST: usize = 8;

/// Measures the three orders with all numbers of workers, interleaved.
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
        let runner = || Runner::new(backend.open()?, &scheduler, Division::OWN);
        for update in [Update::BeforeRecord, Update::BesideSubmit] {
            let frames = Frames::Plain { runner: runner()?, update };
            contenders.push(Contender { world: world::new(objects, 1)?, frames });
        }
        let Runner { renderer, submitter } = runner()?;
        let frames = Frames::InFlight(FrameLoop::new(renderer, submitter, Buffering::Double)?);
        contenders.push(Contender { world: world::new(objects, 1)?, frames });
    }
    let times = Harness::new(rounds, progress).measure(&mut contenders, |contender, round| {
        let at_least = if round.is_warm_up() { Duration::ZERO } else { backend.of(extent.sample) };
        contender.sample(at_least, &work)
    })?;
    let fps = |times: &[f64]| median(times.iter().copied()).recip();
    let row = |(&workers, times): (&usize, &[Vec<f64>])| {
        let [update_before_fps, update_beside_fps, update_in_loop_fps] = [0, 1, 2].map(|order| fps(&times[order]));
        Row {
            objects,
            backend,
            workers,
            update_before_fps,
            update_beside_fps,
            update_in_loop_fps,
            beside_ratio: update_beside_fps / update_before_fps,
            in_loop_ratio: update_in_loop_fps / update_before_fps,
        }
    };
    Ok(workers.iter().zip(times.chunks(3)).map(row).collect())
}

impl Contender {
    /// The mean time of frames, in seconds, of one or more until they have taken `at_least`.
    fn sample(&mut self, at_least: Duration, work: &Work) -> Result<f64, Box<dyn Error>> {
        let Self { world, frames } = self;
        match frames {
            Frames::Plain { runner, update } => {
                let scheduler = Arc::clone(runner.renderer.scheduler());
                mean_frame(at_least, || frame(runner, &scheduler, world, *update, work))
            }
            Frames::InFlight(frames) => in_flight(frames, world, at_least, work),
        }
    }
}

/// Draws a frame, and waits until the device is idle again.
fn frame(
    Runner { renderer, submitter }: &mut Runner,
    scheduler: &Scheduler,
    world: &mut Moving,
    update: Update,
    work: &Work,
) -> Result<Duration, Box<dyn Error>> {
    let start = Instant::now();
    if update == Update::BeforeRecord {
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
    WgpuSubmission::wait(&submitted.submission)?;
    Ok(start.elapsed())
}

/// Draws frames, of which two are in flight, and waits for the last. The first two are not counted.
fn in_flight(
    frames: &mut FrameLoop<WgpuBackend>,
    world: &mut Moving,
    at_least: Duration,
    work: &Work,
) -> Result<f64, Box<dyn Error>> {
    let scheduler = Arc::clone(frames.renderer().scheduler());
    let (mut begun, mut start) = (0, Instant::now());
    let elapsed = loop {
        let (slot, finished) = frames.begin();
        check(finished)?;
        if begun == IN_FLIGHT {
            start = Instant::now();
        }
        if begun >= IN_FLIGHT + LEAST && start.elapsed() >= at_least {
            break start.elapsed();
        }
        scheduler.scope(|scope| spawn_update(scope, world, work))?;
        slot.submit(frames.renderer().record(world.as_scene_ref())?);
        begun += 1;
    };
    // Whoever holds all slots has waited for all frames.
    let slots = [(); IN_FLIGHT].map(|()| frames.begin());
    slots.into_iter().try_for_each(|(_, finished)| check(finished))?;
    Ok(elapsed.as_secs_f64() / (begun - IN_FLIGHT) as f64)
}

fn check(finished: Vec<FinishedFrame<WgpuBackend>>) -> Result<(), Box<dyn Error>> {
    finished.into_iter().try_for_each(|frame| frame.outcome.map(drop)).map_err(Into::into)
}

/// Spawns the jobs of an update: one moves the objects, the others have the remaining work of [`CHUNK`] objects each.
fn spawn_update<'scope>(scope: &Scope<'scope>, world: &'scope mut Moving, work: &'scope Work) {
    let objects = world.as_scene_ref().object_count();
    scope.spawn(|_scope, _worker| world.step());
    for first in (0..objects).step_by(CHUNK) {
        scope.spawn(move |_scope, _worker| (first..objects.min(first + CHUNK)).for_each(|object| work.job(object)));
    }
}
