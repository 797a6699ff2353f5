//! What it costs to wake a worker, measured where it will be paid.

use std::{sync::OnceLock, time::Duration};

use crate::sync::{Instant, spin_loop, thread};

use super::{placement::Placement, scheduler::Scheduler};

/// How often it is tried. What else the machine does makes tries longer, never shorter, so the second shortest counts.
const TRIES: usize = 5;

/// How long a try may take: one that takes longer says that the machine is busy, and nothing about a wake-up.
const PATIENCE: Duration = Duration::from_micros(200);

/// How long it may take until all workers have started, or have gone back to sleep.
const START: Duration = Duration::from_millis(5);

/// What is assumed where no try succeeded.
const ASSUMED: Duration = Duration::from_micros(50);

/// How long a worker stays asleep before each try, so that its processor sleeps too.
const NAP: Duration = Duration::from_micros(20);

/// The time from the spawning of a job until a worker that slept begins on it. If one ever begins where the spawning
/// thread runs, workers are kept off there from then on, if they `may_move`.
pub(super) fn measure(scheduler: &Scheduler, may_move: bool) -> Duration {
    // Where threads are modelled or interpreted, time does not pass as usual.
    if scheduler.workers() == 1 || cfg!(any(drawloom_loom, drawloom_shuttle, miri)) {
        return Duration::ZERO;
    }
    let mut tries = try_often(scheduler);
    let is_in_the_way = tries.iter().any(|wake| !wake.is_beside);
    if may_move && is_in_the_way && scheduler.shared().placement().enable() {
        tries = try_often(scheduler);
    }
    tries.sort_unstable_by_key(|wake| wake.took);
    tries.get(1).map_or(ASSUMED, |wake| wake.took)
}

/// One worker, woken.
struct Wake {
    took: Duration,
    /// Whether it ran on another processor than its waker, as far as is known.
    is_beside: bool,
}

fn try_often(scheduler: &Scheduler) -> Vec<Wake> {
    (0..TRIES).filter_map(|_| try_once(scheduler)).collect()
}

fn try_once(scheduler: &Scheduler) -> Option<Wake> {
    let sleep = scheduler.shared().sleep();
    if !wait_until(START, || sleep.sleepers() == scheduler.workers() - 1) {
        return None;
    }
    let nap = Instant::now();
    while nap.elapsed() < NAP {
        spin_loop();
    }
    let begun = OnceLock::new();
    let spawned = scheduler.scope(|scope| {
        let here = Placement::processor();
        let spawned = Instant::now();
        scope.spawn(|_scope, _worker| {
            // There is one job, so nobody has set this before.
            let _ = begun.set((Instant::now(), Placement::processor()));
        });
        wait_until(PATIENCE, || begun.get().is_some()).then_some((spawned, here))
    });
    let (spawned, here) = spawned.ok()??;
    let &(begun, there) = begun.get()?;
    let took = begun.duration_since(spawned);
    (took <= PATIENCE).then_some(Wake { took, is_beside: here.is_none() || here != there })
}

/// Waits for that, as long as there is patience, and says whether it came.
fn wait_until(patience: Duration, mut condition: impl FnMut() -> bool) -> bool {
    let start = Instant::now();
    while !condition() {
        if start.elapsed() >= patience {
            return false;
        }
        // The other thread may have to share this processor.
        if patience > PATIENCE {
            thread::yield_now();
        }
        spin_loop();
    }
    true
}
