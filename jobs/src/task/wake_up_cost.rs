//! Measures how long it takes to wake a worker, on the machine and with the scheduler that will pay it.

use std::sync::OnceLock;
use std::time::Duration;

use super::placement::Placement;
use super::scheduler::Scheduler;
use crate::sync::{Instant, spin_loop, thread};

/// How many wake-ups are measured. Other work on the machine makes some longer, never shorter, so a short one counts:
/// the second shortest, because a single one may be short by chance.
const TRIES: usize = 5;

/// A wake-up that takes longer is not counted: the machine is busy, and it says nothing about the cost.
const MAX_WAKE_UP: Duration = Duration::from_micros(200);

/// How long all workers may take to start, or to go back to sleep.
const START_TIMEOUT: Duration = Duration::from_millis(5);

/// The cost if no wake-up was measured.
const DEFAULT: Duration = Duration::from_micros(50);

/// How long a worker sleeps before it is woken, so that its processor sleeps too.
const SLEEP_BEFORE: Duration = Duration::from_micros(20);

/// Measures the time from the spawning of a job until a worker that slept begins it. If a worker begins on the
/// processor of the spawning thread even once, workers are kept off there from then on, if they `may_move`.
pub(super) fn measure(scheduler: &Scheduler, may_move: bool) -> Duration {
    // Under a model checker or an interpreter, time does not pass as usual.
    if scheduler.workers() == 1 || cfg!(any(drawloom_model_check, miri)) {
        return Duration::ZERO;
    }
    let mut wake_ups = measure_all(scheduler);
    let shared_processor = wake_ups.iter().any(|wake_up| !wake_up.is_on_other_processor);
    if may_move && shared_processor && scheduler.shared().placement().enable() {
        wake_ups = measure_all(scheduler);
    }
    wake_ups.sort_unstable_by_key(|wake_up| wake_up.took);
    wake_ups.get(1).map_or(DEFAULT, |wake_up| wake_up.took)
}

struct WakeUp {
    took: Duration,
    /// Whether the worker ran on another processor than its waker, as far as is known.
    is_on_other_processor: bool,
}

fn measure_all(scheduler: &Scheduler) -> Vec<WakeUp> {
    (0..TRIES).filter_map(|_| measure_one(scheduler)).collect()
}

fn measure_one(scheduler: &Scheduler) -> Option<WakeUp> {
    let sleep = scheduler.shared().sleep();
    if !wait_until(START_TIMEOUT, || sleep.sleepers() == scheduler.workers() - 1) {
        return None;
    }
    let asleep_since = Instant::now();
    while asleep_since.elapsed() < SLEEP_BEFORE {
        spin_loop();
    }
    let begun = OnceLock::new();
    let spawned = scheduler.scope(|scope| {
        let here = Placement::current_processor();
        let spawned = Instant::now();
        scope.spawn(|_scope, _worker| {
            // There is only one job, so the lock is empty.
            let _ = begun.set((Instant::now(), Placement::current_processor()));
        });
        wait_until(MAX_WAKE_UP, || begun.get().is_some()).then_some((spawned, here))
    });
    let (spawned, here) = spawned.ok()??;
    let &(begun, there) = begun.get()?;
    let took = begun.duration_since(spawned);
    (took <= MAX_WAKE_UP).then_some(WakeUp { took, is_on_other_processor: here.is_none() || here != there })
}

/// Waits until the condition holds, or the timeout has passed. Returns whether it holds.
fn wait_until(timeout: Duration, mut condition: impl FnMut() -> bool) -> bool {
    let start = Instant::now();
    while !condition() {
        if start.elapsed() >= timeout {
            return false;
        }
        // During a long wait the other thread may need this processor.
        if timeout > MAX_WAKE_UP {
            thread::yield_now();
        }
        spin_loop();
    }
    true
}
