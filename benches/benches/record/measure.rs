//! Measures all techniques on one backend, interleaved.

use std::time::{Duration, Instant};

use drawloom_benches::backends::BackendName;
use drawloom_benches::clouds::around_one;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::moving::Moving;
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
    /// By number of threads: nanoseconds per object and view of as many independent threads.
    pub independent: Vec<(usize, f64)>,
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

    let several = workers.iter().filter(|&&workers| workers > 1);
    let independent: Vec<_> =
        several.map(|&threads| IndependentThreads::new(threads, backend, extent.objects)).collect();
    let mut independent_times = vec![Vec::new(); independent.len()];
    let mut times = vec![Vec::new(); contenders.len()];
    let mut harness = Harness::new(rounds, progress);
    for round in harness.rounds(contenders.len()) {
        let at_least = if round.is_warm_up() { Duration::ZERO } else { backend.of(extent.sample) };
        let samples = harness.round(&mut contenders, |contender| sample(contender, at_least))?;
        let independent = independent.iter().map(IndependentThreads::sample).collect::<Result<Vec<_>, _>>()?;
        if !round.is_warm_up() {
            times.iter_mut().zip(samples).for_each(|(times, sample)| times.push(sample));
            independent_times.iter_mut().zip(independent).for_each(|(times, sample)| times.push(sample));
        }
    }
    let nanoseconds = |times: Vec<f64>| median(times) * 1e9 / (CAMERAS * extent.objects) as f64;
    let mut rows = Vec::new();
    for (contender, times) in contenders.iter_mut().zip(times) {
        let own = contender.is_drawloom().then(|| own_requests(contender, rounds.warm_up, extent.objects));
        rows.push(Row {
            technique: contender.name,
            scene: contender.motion.name(),
            backend,
            workers: contender.workers,
            threads: contender.threads(),
            is_instanced: contender.is_instanced(),
            is_drawloom: contender.is_drawloom(),
            ns_per_object_view: nanoseconds(times),
            own_allocations_per_frame: own.transpose()?,
            allocations_per_frame: contender.run(|technique, world| {
                requests(world, |world| {
                    let (result, requests) = requests_in(|| technique.frame(world.as_scene_ref()));
                    result?;
                    technique.wait()?;
                    Ok(requests)
                })
            })?,
        });
    }
    let independent = independent.iter().zip(independent_times);
    let independent = independent.map(|(threads, times)| (threads.count(), nanoseconds(times))).collect();
    Ok(Measured { backend, rows, independent })
}

/// Draws one frame, and more until they have taken `at_least`; returns seconds per frame.
pub fn sample(contender: &mut Contender, at_least: Duration) -> Result<f64, Failure> {
    contender.run(|technique, world| {
        mean_frame(at_least, || {
            world.step();
            let start = Instant::now();
            technique.frame(world.as_scene_ref())?;
            let elapsed = start.elapsed();
            technique.wait()?;
            Ok(elapsed)
        })
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
