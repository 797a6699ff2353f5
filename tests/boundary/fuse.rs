//! Makes one call of the engine's code panic: the n-th of a kind.

use std::collections::BTreeSet;
use std::panic::panic_any;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Whose code it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Backend,
    Node,
    Process,
    /// Predicates of materials.
    Predicate,
    /// Steps of asynchronous post-processing, and what reads a target back.
    Step,
    /// What follows a submission, callbacks of fences, devices that set fences, hooks of threads, jobs, and
    /// loads.
    Hook,
    Clock,
    Destructor,
    Subscriber,
}

struct Fuse {
    kind: Kind,
    /// How many calls are to come until one panics.
    left: usize,
    /// Whether each call panics from then on.
    each: bool,
    has_text: bool,
}

static FUSE: Mutex<Option<Fuse>> = Mutex::new(None);
/// The calls of the kind since it was armed.
static CALLS: Mutex<Vec<&str>> = Mutex::new(Vec::new());
static BLOWN: Mutex<Option<&'static str>> = Mutex::new(None);
/// How many values of the engine's are alive.
static ALIVE: AtomicUsize = AtomicUsize::new(0);

/// Makes a call panic: of those of a kind from now on, that of this index. Its payload is a text, or else something
/// that panics when it is dropped.
pub fn arm(kind: Kind, index: usize, has_text: bool) {
    set(Fuse { kind, left: index, each: false, has_text });
}

/// Makes each call of a kind panic, with a text.
pub fn arm_each(kind: Kind) {
    set(Fuse { kind, left: 0, each: true, has_text: true });
}

fn set(fuse: Fuse) {
    CALLS.lock().unwrap().clear();
    *BLOWN.lock().unwrap() = None;
    *FUSE.lock().unwrap() = Some(fuse);
}

/// Takes back a panic that has not come, and returns the name of the call that panicked.
pub fn disarm() -> Option<&'static str> {
    *FUSE.lock().unwrap() = None;
    BLOWN.lock().unwrap().take()
}

/// The calls of the kind since it was armed.
pub fn calls() -> Vec<&'static str> {
    CALLS.lock().unwrap().clone()
}

/// Calls `work`, and returns which of its calls of a kind to try: of those of each name the first two, the last one,
/// and one between.
pub fn calls_to_try(kind: Kind, work: impl FnOnce()) -> Vec<usize> {
    arm(kind, usize::MAX, true);
    work();
    disarm();
    let calls = calls();
    let mut chosen = BTreeSet::new();
    for name in calls.iter().collect::<BTreeSet<_>>() {
        let of_name: Vec<_> = (0..calls.len()).filter(|index| calls[*index] == *name).collect();
        let last = of_name.len() - 1;
        chosen.extend([0, 1.min(last), last / 2, last].map(|index| of_name[index]));
    }
    chosen.into_iter().collect()
}

/// The engine's code is called. Panics if it is to.
pub fn call(kind: Kind, name: &'static str) {
    let mut fuse = FUSE.lock().unwrap();
    let Some(armed) = fuse.as_mut().filter(|fuse| fuse.kind == kind) else { return };
    CALLS.lock().unwrap().push(name);
    if armed.left > 0 {
        armed.left -= 1;
        return;
    }
    let has_text = armed.has_text;
    if !armed.each {
        *fuse = None;
    }
    drop(fuse);
    *BLOWN.lock().unwrap() = Some(name);
    panic_as_planned(has_text);
}

/// Panics with a text, or else with something that panics when it is dropped.
pub fn panic_as_planned(has_text: bool) -> ! {
    if has_text {
        panic!("{PLANNED}");
    }
    panic_any(PanicsWhenDropped);
}

/// What planned panics say.
pub const PLANNED: &str = "as planned";

/// The payload of a panic that panics when it is dropped.
pub struct PanicsWhenDropped;

impl Drop for PanicsWhenDropped {
    fn drop(&mut self) {
        if !thread::panicking() {
            panic!("{PLANNED}");
        }
    }
}

/// Something of the engine's whose destructor is code of the engine's.
pub struct Owned<T> {
    pub value: Option<T>,
    what: &'static str,
    /// Whether the engine takes it apart itself.
    is_taken: bool,
}

impl<T> Owned<T> {
    pub fn new(what: &'static str, value: T) -> Self {
        ALIVE.fetch_add(1, Ordering::SeqCst);
        Self { value: Some(value), what, is_taken: false }
    }

    pub fn get(&self) -> &T {
        self.value.as_ref().expect("it is taken with what holds it")
    }

    pub fn get_mut(&mut self) -> &mut T {
        self.value.as_mut().expect("it is taken with what holds it")
    }

    pub fn take(mut self) -> T {
        self.is_taken = true;
        self.value.take().expect("it is taken with what holds it")
    }
}

impl<T> Drop for Owned<T> {
    fn drop(&mut self) {
        ALIVE.fetch_sub(1, Ordering::SeqCst);
        // A second panic would end the process, as in any Rust program.
        if !thread::panicking() && !self.is_taken {
            call(Kind::Destructor, self.what);
        }
    }
}

/// How many values of the engine's are alive.
pub fn alive() -> usize {
    ALIVE.load(Ordering::SeqCst)
}
