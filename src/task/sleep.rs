//! Sleep.

use crossbeam_utils::CachePadded;

use crate::sync::{AtomicUsize, Condvar, Mutex, Ordering, fence};

/// Where idle workers sleep, and how they are woken.
pub(super) struct Sleep {
    /// The length of `sleepers`, readable without its lock.
    count: CachePadded<AtomicUsize>,
    /// Who sleeps, or is about to; the last to lie down is the first to be called.
    sleepers: Mutex<Vec<usize>>,
    beds: Box<[Bed]>,
}

impl Sleep {
    /// Beds for `workers` workers.
    pub(super) fn new(workers: usize) -> Self {
        Self {
            count: CachePadded::new(AtomicUsize::new(0)),
            sleepers: Mutex::new(Vec::with_capacity(workers)),
            beds: (0..workers).map(|_| Bed::new()).collect(),
        }
    }

    /// Sleeps until woken, unless `stay_awake` is true once the worker can be seen on the list.
    pub(super) fn sleep(&self, worker: usize, stay_awake: impl FnOnce() -> bool) {
        self.lie_down(worker);
        fence(Ordering::SeqCst);
        if stay_awake() && self.get_up(|sleepers| position(sleepers, worker)).is_some() {
            return;
        }
        self.beds[worker].wait();
    }

    /// Wakes the worker that fell asleep last, if anyone sleeps. Call after the work is visible.
    pub(super) fn wake_any(&self) {
        self.wake(|sleepers| sleepers.len().checked_sub(1));
    }

    /// Wakes this worker if it sleeps. Call after what it waits for is visible.
    pub(super) fn wake_worker(&self, worker: usize) {
        self.wake(|sleepers| position(sleepers, worker));
    }

    /// Wakes everyone.
    pub(super) fn wake_all(&self) {
        fence(Ordering::SeqCst);
        while let Some(sleeper) = self.get_up(|sleepers| sleepers.len().checked_sub(1)) {
            self.beds[sleeper].call();
        }
    }

    fn wake(&self, choose: impl FnOnce(&[usize]) -> Option<usize>) {
        fence(Ordering::SeqCst);
        if self.count.load(Ordering::Relaxed) == 0 {
            return;
        }
        if let Some(sleeper) = self.get_up(choose) {
            self.beds[sleeper].call();
        }
    }

    fn lie_down(&self, worker: usize) {
        let mut sleepers = self.sleepers.lock();
        sleepers.push(worker);
        self.count.store(sleepers.len(), Ordering::Relaxed);
    }

    /// Takes the chosen sleeper off the list.
    fn get_up(&self, choose: impl FnOnce(&[usize]) -> Option<usize>) -> Option<usize> {
        let mut sleepers = self.sleepers.lock();
        let chosen = choose(&sleepers)?;
        let sleeper = sleepers.remove(chosen);
        self.count.store(sleepers.len(), Ordering::Relaxed);
        Some(sleeper)
    }
}

fn position(sleepers: &[usize], worker: usize) -> Option<usize> {
    sleepers.iter().position(|&sleeper| sleeper == worker)
}

/// Where one worker sleeps.
struct Bed {
    called: Mutex<bool>,
    bell: Condvar,
}

impl Bed {
    fn new() -> Self {
        Self { called: Mutex::new(false), bell: Condvar::new() }
    }

    fn wait(&self) {
        let mut called = self.called.lock();
        while !*called {
            called = self.bell.wait(called);
        }
        *called = false;
    }

    fn call(&self) {
        *self.called.lock() = true;
        self.bell.notify_one();
    }
}
