//! A round runs programs of a few threads on one scheduler.

use std::ops::AddAssign;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use std::{fmt, thread};

use drawloom_jobs::task::{Scheduler, SchedulerBuilder};
use drawloom_jobs::timeline::Log;
use fastrand::Rng;

use crate::program::{MAX_HEIGHT, World, panic_as_planned, run as run_program, value};
use crate::watchdog::{self, Activity, during};

/// Counts of what has run.
#[derive(Default)]
pub struct Totals {
    schedulers: u64,
    programs: u64,
    /// Jobs and other parts.
    parts: u64,
    recorded_runs: u64,
    /// Recorded runs that are complete and did not fail.
    pub complete_runs: u64,
}

impl AddAssign for Totals {
    fn add_assign(&mut self, other: Self) {
        self.schedulers += other.schedulers;
        self.programs += other.programs;
        self.parts += other.parts;
        self.recorded_runs += other.recorded_runs;
        self.complete_runs += other.complete_runs;
    }
}

impl fmt::Display for Totals {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { schedulers, programs, parts, recorded_runs, complete_runs } = self;
        write!(formatter, "{schedulers} schedulers, {programs} programs, {parts} parts, ")?;
        write!(formatter, "{recorded_runs} recorded runs, {complete_runs} of them complete")
    }
}

/// The maximum number of programs of a thread in a round.
const MAX_PROGRAMS: usize = if cfg!(miri) { 3 } else { 40 };

/// A small capacity of the timeline, which drops events, and a larger one.
const CAPACITIES: [usize; 2] = if cfg!(miri) { [8, 32] } else { [64, 1 << 14] };

/// The maximum number of workers.
const MAX_WORKERS: usize = if cfg!(miri) { 3 } else { 8 };

/// Runs the round of a seed.
pub fn run(seed: u64) -> Totals {
    let mut random = Rng::with_seed(seed);
    let workers = 1 + random.usize(..MAX_WORKERS);
    let builder = Scheduler::builder().workers(workers).timeline_capacity(CAPACITIES[random.usize(..2)]);
    let shuffle = (random.u8(..4) == 0).then(|| random.u64(..));
    let builder = shuffle.into_iter().fold(builder, SchedulerBuilder::shuffle);
    // Measuring the cost would take longer than the programs, and different costs lead to different decisions.
    let cost = Duration::from_micros([0, 1, 20, 1_000][random.usize(..4)]);
    let builder = match random.usize(..6) {
        0..3 => builder,
        3..5 => builder.timeline_clock(clock(u64::MAX)),
        _ => builder.timeline_clock(clock(random.u64(..500))),
    };
    let scheduler = builder.wake_up_cost(cost).build().expect("threads can be started");
    let world = World::new(format!("seed {seed}, {workers} workers, shuffled by {shuffle:?}"), scheduler);
    watchdog::watch(&world);
    let done_before = watchdog::done();
    let seeds: Vec<u64> = (0..1 + random.usize(..3)).map(|_| random.u64(..)).collect();
    let totals = thread::scope(|threads| {
        let threads: Vec<_> = seeds
            .iter()
            .map(|&seed| {
                threads.spawn({
                    let world = &world;
                    move || run_thread(world, seed)
                })
            })
            .collect();
        threads.into_iter().map(|thread| thread.join().expect("a thread panicked, see above")).fold(
            Totals { schedulers: 1, ..Totals::default() },
            |mut sum, totals| {
                sum += totals;
                sum
            },
        )
    });
    finish(world);
    Totals { parts: watchdog::done() - done_before, ..totals }
}

/// Runs the background jobs that no part has waited for, and drops the scheduler. The jobs hold references to the
/// world, so it is not dropped before they have run.
fn finish(mut world: Arc<World>) {
    during(Activity::Finish, 0, || {
        while let Err(shared) = Arc::try_unwrap(world) {
            shared.scheduler.run_background(Duration::MAX);
            thread::yield_now();
            world = shared;
        }
    });
}

/// An engine's clock that panics after this number of readings.
fn clock(readings: u64) -> impl Fn() -> Duration + Send + Sync {
    let (start, left) = (Instant::now(), AtomicU64::new(readings));
    move || {
        let left = left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1));
        if left.is_err() { panic_as_planned() } else { start.elapsed() }
    }
}

/// Runs programs one after another, as an engine runs frames, and uses the timeline and runs background jobs in
/// between.
fn run_thread(world: &Arc<World>, seed: u64) -> Totals {
    let mut random = Rng::with_seed(seed);
    let mut totals = Totals::default();
    let timeline = world.scheduler.timeline();
    for _program in 0..1 + random.usize(..MAX_PROGRAMS) {
        match random.usize(..5) {
            0 => timeline.start(),
            1 => timeline.stop(),
            2 => check_log(&timeline.take(), &mut totals),
            3 => timeline.mark_frame(),
            _ => {}
        }
        let (seed, height) = (random.u64(..), 1 + random.usize(..MAX_HEIGHT));
        assert_eq!(run_program(world, seed, height), value(seed, height), "{}: program {seed:x}", world.name);
        totals.programs += 1;
        if random.bool() {
            let budget = Duration::from_micros(random.u64(..200));
            during(Activity::RunBackground, seed, || world.scheduler.run_background(budget));
        }
    }
    totals
}

/// Checks that each run that is marked as complete contains every item once, and counts the runs.
fn check_log(log: &Log, totals: &mut Totals) {
    totals.recorded_runs += log.runs.len() as u64;
    for run in log.runs.iter().filter(|run| run.complete && !run.failed) {
        for (index, node) in run.graph.nodes.iter().enumerate() {
            let width = node.name.rsplit(' ').next().and_then(|width| width.parse().ok());
            assert_eq!(Some(run.width(index)), width, "{:?} of a complete run", node.name);
            let mut ends = 0;
            for chunk in run.chunks_of(index) {
                assert_eq!(chunk.items.start, ends, "{:?} has a gap, or an item twice", node.name);
                ends = chunk.items.end;
            }
        }
        totals.complete_runs += 1;
    }
}
