//! Measures all techniques on one backend, interleaved.

use std::time::{Duration, Instant};

use drawloom_benches::backends::BackendName;
use drawloom_benches::clouds::around_one;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::moving::{Motion, Moving};
use drawloom_benches::statistics::median;
use drawloom_benches::stopwatch::mean_frame;
use indicatif::ProgressBar;

use crate::allocations::requests_in;
use crate::independent_threads::IndependentThreads;
use crate::noop_backend::NoopBackend;
use crate::renderer::renderer;
use crate::report::Row;
use crate::technique::{Contender, Failure};
use crate::{CAMERAS, Extent, pictures};

/// The number of frames with counted allocations.
const COUNTED: usize = 8;

/// The results on one backend.
pub struct Measured {
    pub backend: BackendName,
    pub rows: Vec<Row>,
    /// Nanoseconds per object and view of two independent threads.
    pub independent: f64,
    /// The speed-up of two workers over one, and of two independent threads over one worker.
    pub speed_ups: [f64; 2],
    /// The time of one worker as a share of by-mesh on one thread, and of two workers of two threads.
    pub of_by_mesh: [f64; 2],
    /// The time of two workers without instancing as a share of the fastest peer with an encoder a camera.
    pub of_encoders: f64,
    /// The time of each scene, with one worker, as a share of the scene in which everything moves.
    pub of_moving: Vec<(&'static str, f64)>,
}

/// # Errors
/// Returns an error if a frame cannot be drawn, or if a technique draws another picture.
pub fn measure(
    extent: &Extent,
    backend: BackendName,
    workers: &[usize],
    progress: &ProgressBar,
) -> Result<Measured, Failure> {
    let rounds = Rounds { warm_up: backend.of(extent.warm_up), measured: backend.of(extent.rounds) };
    let mut contenders = Contender::all(backend, extent.objects, workers)?;
    progress.set_message(backend.name());
    pictures::compare(&mut contenders, backend == BackendName::Adapter)?;

    let independent = IndependentThreads::new(backend, extent.objects);
    let mut independent_times = Vec::new();
    let mut times = vec![Vec::new(); contenders.len()];
    let mut harness = Harness::new(rounds, progress);
    for round in harness.rounds(contenders.len()) {
        let at_least = if round.is_warm_up() { Duration::ZERO } else { backend.of(extent.sample) };
        let samples = harness.round(&mut contenders, |contender| sample(contender, at_least))?;
        let independent_time = independent.sample()?;
        if !round.is_warm_up() {
            times.iter_mut().zip(samples).for_each(|(times, sample)| times.push(sample));
            independent_times.push(independent_time);
        }
    }
    let nanoseconds = |seconds: f64| seconds * 1e9 / (CAMERAS * extent.objects) as f64;
    let mut rows = Vec::new();
    let find_in = |name, workers, motion| {
        contenders.iter().position(|one| (one.name, one.workers, one.motion) == (name, workers, motion))
    };
    let find = |name, workers| find_in(name, workers, Motion::Everything);
    let [naive, one, two] = [("naive", 1), ("drawloom", 1), ("drawloom", 2)].map(|(name, workers)| find(name, workers));
    // The ratio of two samples of the same round, so that a disturbance meets both; NaN if one of them is not measured.
    let speed_up = |slow: Option<usize>, fast: &[f64]| {
        let slow = slow.map_or(&[][..], |index| &times[index]);
        let ratios: Vec<_> = slow.iter().zip(fast).map(|(slow, fast)| slow / fast).collect();
        if ratios.is_empty() { f64::NAN } else { median(ratios) }
    };
    let speed_ups = [speed_up(one, two.map_or(&[][..], |two| &times[two])), speed_up(one, &independent_times)];
    let share = |drawloom: Option<usize>, peer: Option<usize>| {
        1.0 / speed_up(peer, drawloom.map_or(&[][..], |index| &times[index]))
    };
    let of_by_mesh = [(1, one), (2, two)].map(|(threads, drawloom)| share(drawloom, find("by-mesh", threads)));
    let of_encoders = share(find("drawloom-not-instanced", 2), find("encoder-per-thread", CAMERAS));
    let of_moving = Motion::ALL[1..].iter().map(|&motion| (motion.name(), share(find_in("drawloom", 1, motion), one)));
    let of_moving = of_moving.collect();
    for (contender, times) in contenders.iter_mut().zip(&times) {
        let own = contender.is_drawloom().then(|| own_requests(contender, rounds.warm_up, extent.objects));
        rows.push(Row {
            technique: contender.name,
            scene: contender.motion.name(),
            backend,
            workers: contender.workers,
            is_instanced: contender.is_instanced(),
            ns_per_object_view: nanoseconds(median(times.iter().copied())),
            speed_up_over_naive: speed_up(naive, times),
            own_allocations_per_frame: own.transpose()?,
            allocations_per_frame: requests(&mut contender.world, |world| {
                let (result, requests) = requests_in(|| contender.technique.frame(world.as_scene_ref()));
                result?;
                contender.technique.wait()?;
                Ok(requests)
            })?,
        });
    }
    Ok(Measured {
        backend,
        rows,
        independent: nanoseconds(median(independent_times)),
        speed_ups,
        of_by_mesh,
        of_encoders,
        of_moving,
    })
}

/// Draws one frame, and more until they have taken `at_least`; returns seconds per frame.
pub fn sample(contender: &mut Contender, at_least: Duration) -> Result<f64, Failure> {
    let Contender { technique, world, .. } = contender;
    mean_frame(at_least, || {
        world.step();
        let start = Instant::now();
        technique.frame(world.as_scene_ref())?;
        let elapsed = start.elapsed();
        technique.wait()?;
        Ok(elapsed)
    })
}

/// The median number of allocations of some frames.
fn requests(world: &mut Moving, mut frame: impl FnMut(&Moving) -> Result<usize, Failure>) -> Result<usize, Failure> {
    let mut counts = Vec::new();
    for _ in 0..COUNTED {
        world.step();
        counts.push(frame(world)?);
    }
    counts.sort_unstable();
    Ok(counts[COUNTED / 2])
}

/// The number of allocations of a frame of this crate on the no-op backend.
fn own_requests(contender: &Contender, warm_up: usize, objects: usize) -> Result<usize, Failure> {
    let world = &mut Moving::new(around_one(CAMERAS, objects)?, contender.motion);
    let (mut renderer, submitter) = renderer(NoopBackend, contender.workers, contender.is_instanced())?;
    for _ in 0..warm_up {
        world.step();
        submitter.submit(renderer.record(world.as_scene_ref())?)?;
    }
    requests(world, |world| {
        let draw = || Ok::<_, Failure>(submitter.submit(renderer.record(world.as_scene_ref())?)?);
        let (result, requests) = requests_in(draw);
        result?;
        Ok(requests)
    })
}
