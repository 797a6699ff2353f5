//! Random programs on one scheduler, for a given time: scopes in scopes, loops, graphs, background jobs and jobs that
//! wait for them, locks held over waits, panics, threads that are not workers, and a timeline that is started and
//! stopped. Their results are compared with a plain recursion. A hang aborts with a list of what each thread is doing.
//!
//! `cargo test` runs it for a second. This runs it for an hour, and shows the progress and the seed that repeats a
//! failure:
//!
//! ```sh
//! DRAWLOOM_SOAK_SECONDS=3600 DRAWLOOM_SOAK_SEED=7 cargo test --release -p drawloom-jobs --test soak -- --nocapture
//! ```
//!
//! `.ci/run` runs it under Miri and under the thread sanitizer too.

mod graphs;
mod program;
mod race;
mod rounds;
mod watchdog;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use std::{env, panic};

use indicatif::{ProgressBar, ProgressStyle};

/// A setting from the environment.
fn setting(name: &str, default: u64) -> u64 {
    env::var(name).map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{name} is not a number: {text}")))
}

/// The number of seeds that run under Miri, which has a virtual clock.
const SEEDS_UNDER_MIRI: u64 = 6;

/// The number of unplanned panics. Planned panics do not call the panic hook.
static PANICS: AtomicUsize = AtomicUsize::new(0);

/// Counts unplanned panics. Without this some would be missed: a panic of a job is caught, and no thread may wait for
/// the job.
fn count_panics() {
    let hook = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        PANICS.fetch_add(1, Ordering::Relaxed);
        hook(info);
    }));
}

#[test]
fn concurrent_random_programs_compute_the_same_as_a_plain_recursion() {
    let length = Duration::from_secs(setting("DRAWLOOM_SOAK_SECONDS", 1));
    let first = setting("DRAWLOOM_SOAK_SEED", 1);
    // Miri detects deadlocks itself.
    if !cfg!(miri) {
        watchdog::start();
    }
    count_panics();
    let style = "{elapsed_precise} [{wide_bar}] {eta_precise} left, {msg}";
    let bar = if cfg!(miri) { ProgressBar::hidden() } else { ProgressBar::new(length.as_secs()) };
    let bar = bar.with_style(ProgressStyle::with_template(style).unwrap());
    let start = Instant::now();
    let mut totals = rounds::Totals::default();
    for seed in first.. {
        totals += rounds::run(seed);
        assert_eq!(PANICS.load(Ordering::Relaxed), 0, "seed {seed}: an unplanned panic, see above");
        let elapsed = start.elapsed();
        bar.set_message(format!("seed {seed}"));
        bar.set_position(elapsed.as_secs().min(length.as_secs()));
        let is_over = if cfg!(miri) { seed - first + 1 >= SEEDS_UNDER_MIRI } else { elapsed >= length };
        if is_over {
            break;
        }
    }
    bar.finish();
    assert!(cfg!(miri) || totals.complete_runs > 0, "no log had a complete run to check");
    println!("{:.0?}: {totals}", start.elapsed());
}
