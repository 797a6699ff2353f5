//! Aborts a program that hangs, with a list of each thread's activities.
//!
//! Every thread keeps a stack of its current activities in relaxed atomics. These order nothing, so they hide no race
//! from a sanitizer.

use std::cell::OnceCell;
use std::fmt::Write;
use std::io::{self, Write as _};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, Weak};
use std::time::Duration;
use std::{process, thread};

use crate::program::World;

/// The maximum time without progress.
const TIMEOUT: Duration = Duration::from_secs(60);

/// The maximum number of listed activities of a thread.
const MAX_LISTED: usize = 64;

static DONE: AtomicU64 = AtomicU64::new(0);
static THREADS: Mutex<Vec<Arc<Activities>>> = Mutex::new(Vec::new());
static WORLD: Mutex<Weak<World>> = Mutex::new(Weak::new());
static STARTED: OnceLock<()> = OnceLock::new();

/// The kinds of activities of a thread.
#[derive(Clone, Copy, Debug)]
pub enum Activity {
    Scope,
    Loop,
    Graph,
    WaitForBackground,
    Background,
    Lock,
    Locked,
    LentThread,
    RunBackground,
    Job,
    Finish,
}

impl Activity {
    const ALL: [Self; 11] = [
        Self::Scope,
        Self::Loop,
        Self::Graph,
        Self::WaitForBackground,
        Self::Background,
        Self::Lock,
        Self::Locked,
        Self::LentThread,
        Self::RunBackground,
        Self::Job,
        Self::Finish,
    ];
}

struct Activities {
    thread: thread::Thread,
    depth: AtomicUsize,
    /// The kind of each activity, and the seed of its part of the program.
    kinds: [AtomicUsize; MAX_LISTED],
    seeds: [AtomicU64; MAX_LISTED],
}

thread_local! {
    static OWN: OnceCell<Arc<Activities>> = const { OnceCell::new() };
}

/// Counts a step of progress.
pub fn progress() {
    DONE.fetch_add(1, Ordering::Relaxed);
}

/// The number of steps of progress so far.
pub fn done() -> u64 {
    DONE.load(Ordering::Relaxed)
}

/// Calls `body` as an activity of the calling thread.
pub fn during<R>(activity: Activity, seed: u64, body: impl FnOnce() -> R) -> R {
    struct Leave<'activities>(&'activities Activities);
    impl Drop for Leave<'_> {
        fn drop(&mut self) {
            self.0.depth.fetch_sub(1, Ordering::Relaxed);
        }
    }
    let own = OWN.with(|own| Arc::clone(own.get_or_init(register)));
    let depth = own.depth.fetch_add(1, Ordering::Relaxed);
    if depth < MAX_LISTED {
        own.kinds[depth].store(activity as usize, Ordering::Relaxed);
        own.seeds[depth].store(seed, Ordering::Relaxed);
    }
    let _leave = Leave(&own);
    body()
}

fn register() -> Arc<Activities> {
    let activities = Arc::new(Activities {
        thread: thread::current(),
        depth: AtomicUsize::new(0),
        kinds: [const { AtomicUsize::new(0) }; MAX_LISTED],
        seeds: [const { AtomicU64::new(0) }; MAX_LISTED],
    });
    let mut threads = THREADS.lock().unwrap();
    // If a thread has ended, this list holds the only reference.
    threads.retain(|activities| Arc::strong_count(activities) > 1);
    threads.push(Arc::clone(&activities));
    activities
}

/// Sets the world to print after a hang.
pub fn watch(world: &Arc<World>) {
    *WORLD.lock().unwrap() = Arc::downgrade(world);
}

/// Starts the watchdog on a thread of its own.
pub fn start() {
    STARTED.get_or_init(|| {
        thread::Builder::new().name("watchdog".to_owned()).spawn(run_watchdog).expect("a thread can be started");
    });
}

fn run_watchdog() {
    loop {
        let before = done();
        thread::sleep(TIMEOUT);
        if done() == before {
            // Bypasses the test harness, which holds back output until the test ends.
            let _ = io::stderr().write_all(report().as_bytes());
            process::abort();
        }
    }
}

fn report() -> String {
    let mut report = format!("\nNo progress for {TIMEOUT:?}. The activities of each thread, the innermost last:\n");
    for activities in THREADS.lock().unwrap().iter() {
        let depth = activities.depth.load(Ordering::Relaxed);
        let list = (0..depth.min(MAX_LISTED)).map(|at| {
            let kind = Activity::ALL[activities.kinds[at].load(Ordering::Relaxed)];
            format!("{kind:?} {:x}", activities.seeds[at].load(Ordering::Relaxed))
        });
        let list: Vec<String> = list.collect();
        let thread = &activities.thread;
        let _ = writeln!(report, "{:?} {}: {}", thread.id(), thread.name().unwrap_or("?"), list.join(" > "));
    }
    if let Some(world) = WORLD.lock().unwrap().upgrade() {
        let _ = writeln!(report, "{}\n{:#?}", world.name, world.scheduler);
    }
    report
}
