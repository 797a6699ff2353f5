//! Techniques that take turns.

use std::time::{Duration, Instant};

use drawloom_benches::backends::BackendName;
use drawloom_benches::clouds::around_one;
use drawloom_benches::moving::Moving;
use drawloom_benches::stopwatch::middle;
use drawloom_testing::random::Random;
use indicatif::ProgressBar;

use crate::allocations::requests_in;
use crate::apart::Apart;
use crate::nobody::Nobody;
use crate::ours::renderer;
use crate::report::Row;
use crate::technique::{Contender, Failure};
use crate::{CAMERAS, Extent, pictures};

/// Frames in which requests for memory are counted.
const COUNTED: usize = 8;

/// What was measured on one backend.
pub struct Measured {
    pub backend: BackendName,
    pub rows: Vec<Row>,
    /// Nanoseconds an object and view of two threads that draw a frame each at the same time.
    pub apart: f64,
    /// How many times as fast two workers are as one; and the two threads that share nothing.
    pub speed_ups: [f64; 2],
}

/// # Errors
/// If a frame cannot be drawn, or is not the others'.
pub fn measure(extent: &Extent, backend: BackendName, progress: &ProgressBar) -> Result<Measured, Failure> {
    let (warm_up, rounds, turn) = (backend.of(extent.warm_up), backend.of(extent.rounds), backend.of(extent.turn));
    let mut world = Moving::new(around_one(CAMERAS, extent.objects)?);
    let mut contenders = Contender::all(backend, &world.as_scene_ref())?;
    progress.set_message(backend.name());
    progress.inc_length(((warm_up + rounds) * contenders.len()) as u64);
    pictures::compare(&mut contenders, world.as_scene_ref(), backend == BackendName::Adapter)?;

    let apart = Apart::new(backend, extent.objects);
    let mut times_apart = Vec::new();
    let mut times = vec![Vec::new(); contenders.len()];
    let mut random = Random::new();
    for round in 0..warm_up + rounds {
        for index in random.order(contenders.len()) {
            let is_counted = round >= warm_up;
            let least = if is_counted { turn } else { Duration::ZERO };
            let time = take_turn(&mut contenders[index], &mut world, least)?;
            if is_counted {
                times[index].push(time);
            }
            progress.inc(1);
        }
        let time = apart.take_turn()?;
        if round >= warm_up {
            times_apart.push(time);
        }
    }
    let nanoseconds = |seconds: f64| seconds * 1e9 / (CAMERAS * extent.objects) as f64;
    let mut rows = Vec::new();
    let find = |name, workers| contenders.iter().position(|one| (one.name, one.workers) == (name, workers));
    let [naive, one, two] = [("naive", 1), ("drawloom", 1), ("drawloom", 2)].map(|(name, workers)| find(name, workers));
    // Of the same round each: what the machine does meanwhile meets both.
    let faster = |slow: Option<usize>, fast: &[f64]| {
        let slow = slow.map_or(&[][..], |index| &times[index]);
        middle(slow.iter().zip(fast).map(|(slow, fast)| slow / fast))
    };
    let speed_ups = [faster(one, two.map_or(&[][..], |two| &times[two])), faster(one, &times_apart)];
    for (contender, times) in contenders.iter_mut().zip(&times) {
        let own = contender.is_ours().then(|| own_requests(contender.workers, warm_up, &mut world)).transpose()?;
        rows.push(Row {
            technique: contender.name,
            backend,
            workers: contender.workers,
            ns_per_object_view: nanoseconds(middle(times.iter().copied())),
            of_naive: faster(naive, times),
            allocations_per_frame: requests(&mut world, |world| {
                let (result, requests) = requests_in(|| contender.technique.frame(world.as_scene_ref()));
                result?;
                contender.technique.wait()?;
                Ok(requests)
            })?,
            own_allocations_per_frame: own,
        });
    }
    Ok(Measured { backend, rows, apart: nanoseconds(middle(times_apart)), speed_ups })
}

/// As many frames as take so long, and one at least; returns seconds a frame.
fn take_turn(contender: &mut Contender, world: &mut Moving, least: Duration) -> Result<f64, Failure> {
    let (mut elapsed, mut frames) = (Duration::ZERO, 0);
    while frames == 0 || elapsed < least {
        world.step();
        let start = Instant::now();
        contender.technique.frame(world.as_scene_ref())?;
        elapsed += start.elapsed();
        contender.technique.wait()?;
        frames += 1;
    }
    Ok(elapsed.as_secs_f64() / f64::from(frames))
}

/// The median of some frames.
fn requests(world: &mut Moving, mut frame: impl FnMut(&Moving) -> Result<usize, Failure>) -> Result<usize, Failure> {
    let mut counts = Vec::new();
    for _ in 0..COUNTED {
        world.step();
        counts.push(frame(world)?);
    }
    counts.sort_unstable();
    Ok(counts[COUNTED / 2])
}

/// How often a frame of this crate asks for memory where no device does.
fn own_requests(workers: usize, warm_up: usize, world: &mut Moving) -> Result<usize, Failure> {
    let (mut renderer, submitter) = renderer(Nobody, workers)?;
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
