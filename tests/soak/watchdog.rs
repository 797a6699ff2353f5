//! Turns a hang into a list of who waits for what.
//!
//! Every thread keeps a stack of what it is in the midst of, in relaxed atomics: they order nothing, so a race that a sanitizer
//! could see is not hidden by its being watched.

use std::{
    cell::OnceCell,
    fmt::Write,
    io::{self, Write as _},
    process,
    sync::{
        Arc, Mutex, OnceLock, Weak,
        atomic::{AtomicU64, AtomicUsize, Ordering},
    },
    thread,
    time::Duration,
};

use crate::program::World;

/// How long nothing at all may be done.
const PATIENCE: Duration = Duration::from_secs(60);

/// How many activities of a thread are listed.
const LISTED: usize = 64;

static DONE: AtomicU64 = AtomicU64::new(0);
static THREADS: Mutex<Vec<Arc<Activities>>> = Mutex::new(Vec::new());
static WORLD: Mutex<Weak<World>> = Mutex::new(Weak::new());
static STARTED: OnceLock<()> = OnceLock::new();

/// What a thread can be in the midst of.
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
    /// Each with the seed of its part of the program.
    kinds: [AtomicUsize; LISTED],
    seeds: [AtomicU64; LISTED],
}

thread_local! {
    static OWN: OnceCell<Arc<Activities>> = const { OnceCell::new() };
}

/// Something has been done.
pub fn progress() {
    DONE.fetch_add(1, Ordering::Relaxed);
}

/// How much has been done.
pub fn done() -> u64 {
    DONE.load(Ordering::Relaxed)
}

/// Calls `body` while the calling thread is said to be in the midst of this.
pub fn during<R>(activity: Activity, seed: u64, body: impl FnOnce() -> R) -> R {
    struct Leave<'activities>(&'activities Activities);
    impl Drop for Leave<'_> {
        fn drop(&mut self) {
            self.0.depth.fetch_sub(1, Ordering::Relaxed);
        }
    }
    let own = OWN.with(|own| Arc::clone(own.get_or_init(register)));
    let depth = own.depth.fetch_add(1, Ordering::Relaxed);
    if depth < LISTED {
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
        kinds: [const { AtomicUsize::new(0) }; LISTED],
        seeds: [const { AtomicU64::new(0) }; LISTED],
    });
    let mut threads = THREADS.lock().unwrap();
    // Those whose threads have ended are held by nobody else.
    threads.retain(|activities| Arc::strong_count(activities) > 1);
    threads.push(Arc::clone(&activities));
    activities
}

/// Shows this world's scheduler after a hang.
pub fn watch(world: &Arc<World>) {
    *WORLD.lock().unwrap() = Arc::downgrade(world);
}

/// Watches from now on, on a thread of its own.
pub fn start() {
    STARTED.get_or_init(|| {
        thread::Builder::new().name("watchdog".to_owned()).spawn(watch_for_ever).expect("a thread can be started");
    });
}

fn watch_for_ever() {
    loop {
        let before = done();
        thread::sleep(PATIENCE);
        if done() == before {
            // Past the test harness, which keeps what a test prints until it ends.
            let _ = io::stderr().write_all(report().as_bytes());
            process::abort();
        }
    }
}

fn report() -> String {
    let mut report =
        format!("\nNothing has been done for {PATIENCE:?}. Who is in the midst of what, the innermost last:\n");
    for activities in THREADS.lock().unwrap().iter() {
        let depth = activities.depth.load(Ordering::Relaxed);
        let list = (0..depth.min(LISTED)).map(|at| {
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
