//! Random work of every kind on one scheduler at once, for as long as one likes: scopes in scopes, loops, graphs, background
//! jobs and those who wait for them, locks held over waits, panics, threads that are no workers, a timeline that is switched on
//! and off. Whatever is computed is compared with a plain recursion, and a hang ends with a list of who waits for what.
//!
//! `cargo test` runs a second of it. An hour, with progress, and with what to do again if something fails:
//!
//! ```sh
//! DRAWLOOM_SOAK_SECONDS=3600 DRAWLOOM_SOAK_SEED=7 cargo test --release --no-default-features --test soak -- --nocapture
//! ```
//!
//! `.ci/run` runs it under Miri and under the thread sanitizer too.

mod graphs;
mod program;
mod race;
mod random;
mod rounds;
mod watchdog;

use std::{
    env, panic,
    sync::atomic::{AtomicUsize, Ordering},
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressStyle};

/// A setting out of the environment.
fn setting(name: &str, otherwise: u64) -> u64 {
    env::var(name).map_or(otherwise, |text| text.parse().unwrap_or_else(|_| panic!("{name} is no number: {text}")))
}

/// Miri's clock is its own, so seconds say little there.
const SEEDS_UNDER_MIRI: u64 = 6;

/// How many panics there were that no program had planned: planned ones pass the hook by.
static PANICS: AtomicUsize = AtomicUsize::new(0);

/// A job's panic is caught, and need not reach anybody: of a background job that nobody waits for, it does not.
fn count_panics() {
    let hook = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        PANICS.fetch_add(1, Ordering::Relaxed);
        hook(info);
    }));
}

#[test]
fn whatever_runs_at_once_does_what_a_plain_recursion_does() {
    let length = Duration::from_secs(setting("DRAWLOOM_SOAK_SECONDS", 1));
    let first = setting("DRAWLOOM_SOAK_SEED", 1);
    // Miri finds threads that wait for each other by itself.
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
        assert_eq!(PANICS.load(Ordering::Relaxed), 0, "seed {seed}: something panicked, see above");
        let elapsed = start.elapsed();
        bar.set_message(format!("seed {seed}"));
        bar.set_position(elapsed.as_secs().min(length.as_secs()));
        let is_over = if cfg!(miri) { seed - first + 1 >= SEEDS_UNDER_MIRI } else { elapsed >= length };
        if is_over {
            break;
        }
    }
    bar.finish();
    assert!(cfg!(miri) || totals.complete_runs > 0, "no log had a complete run to be checked");
    println!("{:.0?}: {totals}", start.elapsed());
}
