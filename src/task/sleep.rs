//! Where workers sleep that find nothing to do, so that an idle scheduler costs no time, and how they are woken, so
//! that no work waits for a worker that sleeps through it. Nobody pays a system call while nobody sleeps, and one more
//! worker is woken at a time: it wakes the next if there is more to do.
//!
//! # Protocol
//!
//! *Work* is whatever a worker may wait for: a job in somebody's queue or mailbox, a released latch, the shutdown flag. A
//! *sleeper* takes any work or, if it waits in the midst of a job, only that of the region it waits for. A *searcher* is
//! awake, has nothing to do, and is going to look at everybody's queues and mailboxes once more before it ceases to be one.
//!
//! ```text
//!  sleeper                                        waker
//!  S1  lock: add itself to the list, count        W1  publish the work
//!      itself in, and out as a searcher           W2  fence
//!  S2  fence                                      W3  read counts; no sleeper, or, where anyone
//!  S3  look for work once more                        will do, a searcher: done
//!  S4  work seen: lock, take itself off           W4  lock: take one sleeper off, and, if it
//!      as at W4; it was still there: go on            takes any work, count it in as a searcher
//!  S5  otherwise wait until called                W5  call it
//!
//!  searcher that has found something to do
//!  F1  count itself out                           F3  it was the last searcher: look for more work,
//!  F2  fence                                          and wake one sleeper if there is some
//!                                                 F4  look for background jobs, and wake one sleeper
//!                                                     that takes them if there are some
//! ```
//!
//! # Proof
//!
//! **No wake-up is lost.** All fences are sequentially consistent, so of any two one comes first.
//!
//! *Where W3 meets a sleeper.* Is W2 before S2, then S3 comes after W1 and sees the work. Is S2 before W2, then W3 comes
//! after S1 and reads a count that has the sleeper in it, unless the sleeper has been taken off since. If it was taken
//! off by itself, it is awake. If another waker took it off, it has been called or will be, and is going to look for
//! work, with a fence of its own, before it can wait again. In either case it passes S2 again *after* W2, and S3 sees
//! the work. If it is still on the list, W4 finds it, or, where any sleeper will do, another one that takes any work.
//!
//! *Where W3 meets a searcher.* All changes of the counts are read-modify-writes of one variable, so they have one order,
//! and W3 reads one of the values in it. Let X be the last of the searchers in that value to be counted out, at S1 or
//! F1. That is later in the order than what W3 read. Were the fence that X passes next, S2 or F2, before W2, then W3 would
//! have to read what X wrote or something later. So W2 comes first, and the look that follows X's fence, S3 or F3, sees
//! the work. At S3 it becomes a searcher once more, and finds that work or some other, and comes to F3 in the end. At F3 it
//! wakes a sleeper, unless there is none, or a searcher again, for whom the same holds. A searcher called at W4 is one like
//! any other, whatever it was called for. X skips F3 only where another searcher is still counted in. That one is
//! counted out later than X, so the fence that it passes next comes after W2 as well, and the same holds for it; the last of
//! them skips nothing.
//!
//! *Where work is for the background*, W3 passes over searchers: one of them may be worker 0, who does not look for it. The
//! sleeper that is called looks for work of a frame first, and may find some. So it looks for background jobs at F4, as every
//! searcher does that has found something, and passes the call on.
//!
//! *Where work has an owner*, it lies in the owner's mailbox, and W3 and W4 come twice: for the owner, then for others. An
//! owner that sleeps until this region has work is met as any sleeper is, and called. Any other owner passes S2, after W2,
//! before it next sleeps for this region, and S3 sees the work. So an owner never sleeps while its mailbox has work for it, even if
//! nobody else is free to take that. If the owner is called, others are not: it runs the work.
//!
//! *Where work moves.* A thief that takes several jobs at once, or puts one back that it had taken out, hides them for a
//! moment from S3 and F3. When they can be seen again it passes W2 and W4 anew, without asking for searchers
//! (`wake_beside`).
//!
//! **A call is neither lost nor left over.** Under the lock exactly one thread takes a sleeper off the list. Is that a
//! waker, it calls once, and the sleeper waits for this one call even if it has seen work meanwhile. Is it the sleeper,
//! nobody calls. So between two sleeps no call is pending.
//!
//! **Nothing deadlocks.** The lock of the list and that of a bed are never held together, and no code of a user runs
//! under either.
//!
//! # Memory ordering
//!
//! The fences carry the argument, so the counts are changed and read relaxed, and W1 and S3 may be relaxed too. Reading
//! a stale count of sleepers costs a lock; a stale zero is excluded by the fences. What the work itself makes visible is
//! for the queues, the mailbox's lock and the latch to order: to be woken is only a reason to look.

use crossbeam_utils::CachePadded;

use crate::sync::{AtomicUsize, Condvar, Mutex, Ordering, fence};

use super::{priority::Priority, scheduler::Scheduler};

/// What work a sleeper is to be woken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WakeFor {
    /// Any that lies in a queue or a mailbox, and its own.
    Any,
    /// What belongs to the region that it has open at this level: the end of the region, or a job in the mailbox.
    Region { level: usize },
}

/// The beds of all workers, the list of those that sleep, and the counts of sleepers and searchers.
pub(super) struct Sleep {
    /// A sum of [`SLEEPER`], [`ANY_SLEEPER`] and [`SEARCHER`], read without the lock.
    counts: CachePadded<AtomicUsize>,
    /// Who sleeps or is about to. The last to lie down is called first, as its caches are the warmest.
    sleepers: Mutex<Vec<(usize, WakeFor)>>,
    beds: Box<[CachePadded<Bed>]>,
}

/// Each count has bits of its own, more than there can be workers, so that one read tells all.
const SLEEPER: usize = 1;
const ANY_SLEEPER: usize = 1 << BITS;
const SEARCHER: usize = 1 << (2 * BITS);
const BITS: u32 = usize::BITS / 3;
const MASK: usize = (1 << BITS) - 1;
const _: () = assert!(Scheduler::MAX_WORKERS <= MASK, "a count runs over into the next");

impl Sleep {
    /// A bed for each worker.
    pub(super) fn new(workers: usize) -> Self {
        Self {
            counts: CachePadded::new(AtomicUsize::new(0)),
            sleepers: Mutex::new(Vec::with_capacity(workers)),
            beds: (0..workers).map(|_| CachePadded::new(Bed::new())).collect(),
        }
    }

    /// Counts a worker in as a searcher.
    pub(super) fn start_search(&self) {
        self.counts.fetch_add(SEARCHER, Ordering::Relaxed);
    }

    /// Counts a searcher out that has found something to do. If `sees_more_work` of some bands it wakes another: for a frame
    /// if it was the last searcher, and for background jobs in any case, since other searchers may be no workers for those.
    pub(super) fn end_search(&self, sees_more_work: impl Fn(&[Priority]) -> bool) {
        let before = self.counts.fetch_sub(SEARCHER, Ordering::Relaxed);
        fence(Ordering::SeqCst);
        if any_sleepers(self.counts.load(Ordering::Relaxed)) == 0 {
            return;
        }
        if searchers(before) == 1 && sees_more_work(&Priority::FRAME) {
            self.wake_any();
        }
        if sees_more_work(&[Priority::Background]) {
            self.call(|&sleeper| takes(sleeper, Priority::Background));
        }
    }

    /// Sleeps until called, unless `sees_work`, which is asked when wakers can see the worker on the list. Says whether
    /// the worker, which may come as a searcher, leaves as one: so does everyone who takes any work.
    pub(super) fn sleep(
        &self,
        worker: usize,
        wake_for: WakeFor,
        is_searcher: bool,
        sees_work: impl FnOnce() -> bool,
    ) -> bool {
        self.lie_down(worker, wake_for, is_searcher);
        fence(Ordering::SeqCst);
        let is_it = |&(sleeper, _): &(usize, WakeFor)| sleeper == worker;
        if !sees_work() || self.take_off(is_it).is_none() {
            self.beds[worker].wait();
        }
        wake_for == WakeFor::Any
    }

    /// Wakes a worker that takes any work, if one sleeps and nobody searches. The work it is woken for has been
    /// published.
    pub(super) fn wake_any(&self) {
        fence(Ordering::SeqCst);
        let counts = self.counts.load(Ordering::Relaxed);
        if any_sleepers(counts) > 0 && searchers(counts) == 0 {
            self.call(|&(_, wake_for)| wake_for == WakeFor::Any);
        }
    }

    /// Wakes a worker that takes jobs of this band, if one sleeps. Searchers are no reason not to: the caller may be one
    /// itself, and worker 0 may be one, which does not look for background jobs. The job has been published.
    pub(super) fn wake_beside(&self, band: Priority) {
        fence(Ordering::SeqCst);
        if any_sleepers(self.counts.load(Ordering::Relaxed)) > 0 {
            self.call(|&sleeper| takes(sleeper, band));
        }
    }

    /// Wakes the owner of a region for a job of that, if it sleeps until there is one, and else a worker that takes jobs of
    /// this band. The job has been published where both look for it.
    pub(super) fn wake_owner_or_other(&self, owner: usize, level: usize, band: Priority) {
        fence(Ordering::SeqCst);
        let counts = self.counts.load(Ordering::Relaxed);
        let waits_for_it = |wake_for| wake_for == WakeFor::Any || wake_for == WakeFor::Region { level };
        if sleepers(counts) > 0 && self.call(|&(sleeper, wake_for)| sleeper == owner && waits_for_it(wake_for)) {
            return;
        }
        // As in `wake_any` and `wake_beside`. The fence comes after the job and before the read of the counts there as here.
        if any_sleepers(counts) > 0 && (band == Priority::Background || searchers(counts) == 0) {
            self.call(|&sleeper| takes(sleeper, band));
        }
    }

    /// Wakes this worker, if it sleeps. What it is woken for has been published.
    pub(super) fn wake_worker(&self, worker: usize) {
        fence(Ordering::SeqCst);
        if sleepers(self.counts.load(Ordering::Relaxed)) > 0 {
            self.call(|&(sleeper, _)| sleeper == worker);
        }
    }

    /// Wakes every worker that sleeps. What they are woken for has been published.
    pub(super) fn wake_all(&self) {
        // No fence: the lock is taken in any case, and whoever lies down after that sees what has been published
        // before.
        while self.call(|_| true) {}
    }

    /// What each worker that sleeps, or is about to, is to be woken for.
    pub(super) fn asleep(&self) -> Vec<(usize, WakeFor)> {
        self.sleepers.lock().clone()
    }

    /// How many workers sleep or are about to.
    pub(super) fn sleepers(&self) -> usize {
        sleepers(self.counts.load(Ordering::Relaxed))
    }

    /// Calls the last sleeper of the kind, if there is one.
    fn call(&self, is_wanted: impl Fn(&(usize, WakeFor)) -> bool) -> bool {
        let sleeper = self.take_off(is_wanted);
        if let Some(sleeper) = sleeper {
            self.beds[sleeper].call();
        }
        sleeper.is_some()
    }

    fn lie_down(&self, worker: usize, wake_for: WakeFor, is_searcher: bool) {
        let mut sleepers = self.sleepers.lock();
        sleepers.push((worker, wake_for));
        // One operation, so that nobody sees the worker neither searching nor asleep.
        let out = if is_searcher { SEARCHER } else { 0 };
        self.counts.fetch_add(weight(wake_for).wrapping_sub(out), Ordering::Relaxed);
    }

    /// Takes the last sleeper of the kind off the list, and says which worker it is. One that takes any work is a searcher
    /// from then on.
    fn take_off(&self, is_wanted: impl Fn(&(usize, WakeFor)) -> bool) -> Option<usize> {
        let mut sleepers = self.sleepers.lock();
        let (worker, wake_for) = sleepers.iter().rposition(is_wanted).map(|place| sleepers.remove(place))?;
        let becomes = if wake_for == WakeFor::Any { SEARCHER } else { 0 };
        self.counts.fetch_add(becomes.wrapping_sub(weight(wake_for)), Ordering::Relaxed);
        Some(worker)
    }
}

/// Whether a sleeper takes jobs of this band, whoever waits for them.
fn takes((worker, wake_for): (usize, WakeFor), band: Priority) -> bool {
    wake_for == WakeFor::Any && (worker != 0 || band != Priority::Background)
}

fn weight(wake_for: WakeFor) -> usize {
    match wake_for {
        WakeFor::Any => SLEEPER + ANY_SLEEPER,
        WakeFor::Region { .. } => SLEEPER,
    }
}

fn sleepers(counts: usize) -> usize {
    counts & MASK
}

fn any_sleepers(counts: usize) -> usize {
    (counts >> BITS) & MASK
}

fn searchers(counts: usize) -> usize {
    counts >> (2 * BITS)
}

/// Where one worker waits to be called.
struct Bed {
    called: Mutex<bool>,
    bell: Condvar,
}

impl Bed {
    fn new() -> Self {
        Self { called: Mutex::new(false), bell: Condvar::new() }
    }

    /// Waits for a call, and uses it up.
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

#[cfg(all(test, drawloom_loom))]
mod models;
