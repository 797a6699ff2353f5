//! Random programs: the value of a seed and a height, computed by a plain recursion and by jobs.
//!
//! A program adds numbers, so its value does not depend on their order. A part of one height consists of parts of lower
//! heights. A part waits for a background job, or holds a lock, only for parts of lower height, which take only the
//! locks of lower heights. So no program can deadlock.

use std::ops::Range;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;

use drawloom_jobs::task::{BackgroundJob, JobPanic, Scheduler, Scope, Worker};
use fastrand::Rng;

use crate::graphs;
use crate::watchdog::{Activity, during, progress};

/// The maximum height of a program. Miri is some thousand times slower.
pub const MAX_HEIGHT: usize = if cfg!(miri) { 2 } else { 5 };

/// The maximum length of a loop.
const MAX_LOOP: usize = if cfg!(miri) { 6 } else { 60 };

/// The state that all parts of all programs share.
pub struct World {
    pub name: String,
    pub scheduler: Scheduler,
    /// One lock for each height.
    locks: [Mutex<()>; MAX_HEIGHT + 1],
}

impl World {
    pub fn new(name: String, scheduler: Scheduler) -> Arc<Self> {
        Arc::new(Self { name, scheduler, locks: Default::default() })
    }
}

/// A piece of a part, with the seed of a part of lower height.
enum Piece {
    Leaf(u64),
    Spawn(u64),
    SpawnPinned(u64),
    /// Spawns a job into the scope outside of this one.
    SpawnOutside(u64),
    Scope {
        seed: u64,
        panics: bool,
    },
    Loop {
        seed: u64,
        length: usize,
        chunk: usize,
        panics: bool,
    },
    Graph(u64),
    Background {
        seed: u64,
        wait: Wait,
        panics: bool,
    },
    /// Holds a lock while it waits for a part.
    Lock(u64),
    /// Lends the scope to a thread that is not a worker, which spawns jobs.
    LentThread(u64),
}

/// When and where a part waits for a background job.
enum Wait {
    AtOnce,
    AfterAScope(u64),
    InAJob,
    InAPinnedJob,
    Never,
}

fn pieces(seed: u64, height: usize) -> Vec<Piece> {
    let mut random = Rng::with_seed(seed ^ (height as u64) << 56);
    let max = [1, 2, 3, 4, 5, 6][height.min(5)];
    (0..1 + random.usize(..max))
        .map(|_| {
            let panics = random.u8(..12) == 0;
            let seed = random.u64(..);
            match random.usize(..16) {
                0 => Piece::Leaf(seed),
                1..4 => Piece::Spawn(seed),
                4 => Piece::SpawnPinned(seed),
                5 => Piece::SpawnOutside(seed),
                6..8 => Piece::Scope { seed, panics },
                8..10 => Piece::Loop { seed, length: random.usize(..MAX_LOOP), chunk: random.usize(..6), panics },
                10 => Piece::Graph(seed),
                11..14 => {
                    let wait = match random.usize(..6) {
                        0 => Wait::AtOnce,
                        1 | 2 => Wait::AfterAScope(random.u64(..)),
                        3 => Wait::InAJob,
                        4 => Wait::InAPinnedJob,
                        _ => Wait::Never,
                    };
                    Piece::Background { seed, wait, panics }
                }
                14 => Piece::Lock(seed),
                _ => Piece::LentThread(seed),
            }
        })
        .collect()
}

/// The value of a seed at the end of a branch.
pub fn leaf(seed: u64) -> u64 {
    Rng::with_seed(seed).u64(..) >> 8
}

/// Whether an index of a loop, or an item of a graph, is a part of its own.
pub fn branches(seed: u64, index: usize) -> bool {
    Rng::with_seed(seed ^ index as u64).u8(..23) == 0
}

/// The number of jobs that a thread that is not a worker spawns.
const LENT_JOBS: u64 = 3;

/// The value of a part, computed without jobs, and what the part adds to the value of the scope outside of its own.
fn values(seed: u64, height: usize, has_outside: bool) -> (u64, u64) {
    if height == 0 {
        return (leaf(seed), 0);
    }
    let (mut own, mut outside) = (0_u64, 0_u64);
    let mut add = |value: u64| own = own.wrapping_add(value);
    for piece in pieces(seed, height) {
        match piece {
            Piece::Leaf(seed) => add(leaf(seed)),
            Piece::Spawn(seed) | Piece::SpawnPinned(seed) => {
                let (value, further_out) = values(seed, height - 1, has_outside);
                add(value);
                outside = outside.wrapping_add(further_out);
            }
            Piece::SpawnOutside(seed) if has_outside => outside = outside.wrapping_add(leaf(seed)),
            Piece::SpawnOutside(seed) => add(leaf(seed)),
            Piece::Scope { seed, .. } => {
                let (value, further_out) = values(seed, height - 1, true);
                add(value.wrapping_add(further_out));
            }
            Piece::Loop { panics: true, .. } => {}
            Piece::Loop { seed, length, .. } => add(items(seed, 0..length, height - 1)),
            Piece::Graph(seed) => add(graphs::value(seed, height - 1)),
            Piece::Background { wait: Wait::Never, .. } => {}
            Piece::Background { seed, wait, panics } => {
                add(if panics { 0 } else { value(seed, height - 1) });
                if let Wait::AfterAScope(seed) = wait {
                    add(value(seed, height - 1));
                }
            }
            Piece::Lock(seed) => add(value(seed, height - 1)),
            Piece::LentThread(seed) => (0..LENT_JOBS).for_each(|job| add(leaf(seed ^ job))),
        }
    }
    (own, outside)
}

/// The value of a part in a scope of its own, computed without jobs.
pub fn value(seed: u64, height: usize) -> u64 {
    values(seed, height, false).0
}

/// The value of some items of a loop or a graph, computed without jobs.
pub fn items(seed: u64, range: Range<usize>, height: usize) -> u64 {
    range.fold(0, |sum, index| {
        let of_item =
            if branches(seed, index) { value(seed ^ index as u64, height.min(1)) } else { leaf(index as u64) };
        sum.wrapping_add(of_item)
    })
}

/// The same value, computed with parts that run as jobs.
pub fn run_items(world: &Arc<World>, seed: u64, range: Range<usize>, height: usize) -> u64 {
    range.fold(0, |sum, index| {
        let of_item =
            if branches(seed, index) { run(world, seed ^ index as u64, height.min(1)) } else { leaf(index as u64) };
        sum.wrapping_add(of_item)
    })
}

/// Runs a part in a scope of its own, and returns its value.
pub fn run(world: &Arc<World>, seed: u64, height: usize) -> u64 {
    let total = AtomicU64::new(0);
    let outcome = during(Activity::Scope, seed, || {
        world.scheduler.scope(|scope| spawn_part(world, scope, &total, None, seed, height))
    });
    assert_eq!(outcome, Ok(()), "{}: part {seed:x}", world.name);
    check(world, seed, total.into_inner(), value(seed, height))
}

fn check(world: &World, seed: u64, found: u64, expected: u64) -> u64 {
    assert_eq!(found, expected, "{}: part {seed:x}", world.name);
    progress();
    found
}

/// Panics without a message on the console.
pub fn panic_as_planned() -> ! {
    resume_unwind(Box::new("as planned"))
}

pub fn assert_planned(outcome: Result<(), JobPanic>, panics: bool) {
    let message = outcome.err().map(|panic| panic.message);
    assert_eq!(message.as_deref(), panics.then_some("as planned"));
}

/// The scope outside of the one that a part runs in, and its total.
#[derive(Clone, Copy)]
struct Outside<'scope, 'outer> {
    scope: &'scope Scope<'outer>,
    total: &'outer AtomicU64,
}

fn add(total: &AtomicU64, value: u64) {
    // Relaxed, so that only the scheduler makes the value visible.
    total.fetch_add(value, Ordering::Relaxed);
    progress();
}

/// Runs a part in this scope. Its jobs have run when the scope ends.
fn spawn_part<'outer, 'scope>(
    world: &'scope Arc<World>,
    scope: &Scope<'scope>,
    total: &'scope AtomicU64,
    outside: Option<Outside<'scope, 'outer>>,
    seed: u64,
    height: usize,
) {
    if height == 0 {
        add(total, leaf(seed));
        return;
    }
    for piece in pieces(seed, height) {
        let lower = height - 1;
        match piece {
            Piece::Leaf(seed) => add(total, leaf(seed)),
            Piece::Spawn(seed) => scope.spawn(move |scope, _worker| {
                during(Activity::Job, seed, || spawn_part(world, scope, total, outside, seed, lower));
            }),
            Piece::SpawnPinned(seed) => scope.spawn_pinned(move |scope, _worker| {
                during(Activity::Job, seed, || spawn_part(world, scope, total, outside, seed, lower));
            }),
            Piece::SpawnOutside(seed) => match outside {
                Some(Outside { scope, total }) => scope.spawn(move |_scope, _worker| add(total, leaf(seed))),
                None => add(total, leaf(seed)),
            },
            Piece::Scope { seed, panics } => add(total, run_inner_scope(world, seed, panics, lower)),
            Piece::Loop { seed, length, chunk, panics } => {
                add(total, run_loop(world, seed, length, chunk, panics, lower));
            }
            Piece::Graph(seed) => add(total, graphs::run(world, seed, lower)),
            Piece::Background { seed, wait, panics } => {
                let job = queue_background(world, seed, panics, lower);
                let finish = move || during(Activity::WaitForBackground, seed, || wait_for(job, panics));
                match wait {
                    Wait::AtOnce => add(total, finish()),
                    Wait::AfterAScope(seed) => {
                        add(total, run(world, seed, lower));
                        add(total, finish());
                    }
                    Wait::InAJob => scope.spawn(move |_scope, _worker| add(total, finish())),
                    Wait::InAPinnedJob => scope.spawn_pinned(move |_scope, _worker| add(total, finish())),
                    Wait::Never => {}
                }
            }
            Piece::Lock(seed) => {
                let guard = during(Activity::Lock, seed, || world.locks[height].lock().expect("no holder panics"));
                add(total, during(Activity::Locked, seed, || run(world, seed, lower)));
                drop(guard);
            }
            Piece::LentThread(seed) => during(Activity::LentThread, seed, || {
                let spawn = |job: u64| scope.spawn(move |_scope, _worker| add(total, leaf(seed ^ job)));
                thread::scope(|threads| {
                    threads.spawn(|| (0..LENT_JOBS).for_each(spawn)).join().expect("the thread only spawns jobs")
                });
            }),
        }
    }
}

/// Runs a part in a scope inside of another one, into which it spawns some of its jobs.
fn run_inner_scope(world: &Arc<World>, seed: u64, panics: bool, height: usize) -> u64 {
    let [inner_total, outer_total] = [const { AtomicU64::new(0) }; 2];
    // The middle scope is outside of the inner one, so its jobs have run when this function returns.
    let outcome = during(Activity::Scope, seed, || {
        world.scheduler.scope(|middle| {
            let outside = Outside { scope: middle, total: &outer_total };
            let outcome = world.scheduler.scope(|inner| {
                if panics {
                    inner.spawn(|_scope, _worker| panic_as_planned());
                }
                spawn_part(world, inner, &inner_total, Some(outside), seed, height);
            });
            assert_planned(outcome, panics);
        })
    });
    assert_eq!(outcome, Ok(()));
    let (inner, outer) = values(seed, height, true);
    let found = inner_total.into_inner();
    check(world, seed, found, inner).wrapping_add(check(world, seed, outer_total.into_inner(), outer))
}

fn run_loop(world: &Arc<World>, seed: u64, length: usize, chunk: usize, panics: bool, height: usize) -> u64 {
    let total = AtomicU64::new(0);
    let body = |range: Range<usize>, _: &Worker| {
        if panics && range.contains(&(length / 2)) {
            panic_as_planned();
        }
        add(&total, run_items(world, seed, range, height));
    };
    let outcome = during(Activity::Loop, seed, || world.scheduler.parallel_for(length, chunk, body));
    assert_planned(outcome, panics && length > 0);
    if panics { 0 } else { check(world, seed, total.into_inner(), items(seed, 0..length, height)) }
}

fn queue_background(world: &Arc<World>, seed: u64, panics: bool, height: usize) -> BackgroundJob<u64> {
    let shared = Arc::clone(world);
    world.scheduler.background(move || {
        during(Activity::Background, seed, || {
            let value = run(&shared, seed, height);
            if panics { panic_as_planned() } else { value }
        })
    })
}

fn wait_for(job: BackgroundJob<u64>, panics: bool) -> u64 {
    let outcome = job.wait();
    assert_planned(outcome.as_ref().map(|_| ()).map_err(JobPanic::clone), panics);
    outcome.unwrap_or(0)
}
