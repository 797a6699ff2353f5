//! How workers without work sleep and are woken. An idle scheduler costs no time, and no work waits for a worker that
//! sleeps through it. While nobody sleeps, nobody makes a system call. One worker is woken at a time, and wakes the
//! next if there is more work.
//!
//! # Protocol
//!
//! - *Work*: a job in some queue or mailbox, a released latch, or the shutdown flag.
//! - *Sleeper*: a worker that sleeps or is about to. An *unrestricted* sleeper takes any work. A sleeper that waits
//!   inside a job takes only work of the region that it waits for.
//! - *Searcher*: a worker that is awake and has nothing to do. It looks into all queues and mailboxes once more before
//!   it stops being a searcher.
//!
//! ```text
//!  sleeper                                        waker
//!  S1  lock: add itself to the list, count        W1  publish the work
//!      itself in, and out as a searcher           W2  fence
//!  S2  fence                                      W3  read the counts: return if there is no sleeper
//!  S3  look for work once more                        or, where any worker will do, if there is a
//!  S4  work seen: lock, remove itself                 searcher
//!      as at W4; if it was still there, go on     W4  lock: remove one sleeper and, if it takes any
//!  S5  otherwise park until unparked                  work, count it in as a searcher
//!                                                 W5  unpark it
//!
//!  searcher that has found work
//!  F1  count itself out                           F3  if it was the last searcher: look for more work,
//!  F2  fence                                          and wake one sleeper if there is some
//!                                                 F4  look for background jobs, and wake one sleeper
//!                                                     that takes them if there are some
//! ```
//!
//! # Proof
//!
//! **No wake-up is lost.** All fences are sequentially consistent, so any two of them are ordered.
//!
//! *W3 and a sleeper.* If W2 precedes S2, then S3 comes after W1 and sees the work. If S2 precedes W2, then W3 comes
//! after S1 and reads a count that includes the sleeper, unless the sleeper has been removed from the list since. If it
//! removed itself, it is awake. If another waker removed it, that waker unparks it, and it looks for work, with a fence
//! of its own, before it can park again. In either case it passes S2 again *after* W2, and S3 sees the work. If it is
//! still on the list, W4 finds it, or, where any sleeper will do, another sleeper that takes any work.
//!
//! *W3 and a searcher.* All changes of the counts are read-modify-writes of one variable, so they have one order, and
//! W3 reads one of its values. Let X be the last of the searchers in that value to be counted out, at S1 or F1. That is
//! later in the order than the value that W3 read. If the fence that X passes next, S2 or F2, preceded W2, then W3
//! would have to read the value that X wrote or a later one. So W2 comes first, and the look that follows X's fence, S3
//! or F3, sees the work.
//! - At S3, X becomes a searcher again, finds that work or some other, and comes to F3 in the end.
//! - At F3, X wakes a sleeper, unless there is none. If the sleeper becomes a searcher, the same holds for it. A
//!   searcher that was woken at W4 is one like any other, whatever it was woken for.
//! - X skips F3 only if another searcher is still counted in. That one is counted out later than X, so the fence that
//!   it passes next comes after W2 as well, and the same holds for it. The last of them skips nothing.
//!
//! *Background jobs.* W3 ignores searchers, because one of them may be worker 0, which does not look for background
//! jobs. The sleeper that is woken looks for a frame's jobs first, and may find one. Therefore every searcher that has
//! found work looks for background jobs at F4, and passes the call on. A worker that turns from background jobs to a
//! frame's passes the call on, too: it frees its slot.
//!
//! *Background slots.* A worker takes a background job only with a slot (`background_slots.rs`). Without a free slot,
//! background jobs are no work to it, neither at S3 nor at F4, and who queues one wakes nobody. A worker H that frees
//! its slot passes a fence, looks for background jobs, and wakes a sleeper if there are some. Let P be a thread that
//! has queued a job, or was woken for one, has passed a fence, and then reads that no slot is free. If H's fence
//! preceded P's, P would read the slot as free. So P's comes first, and H sees the job. Every slot is freed in the end,
//! and with the last one somebody sees the job.
//!
//! *Work with an owner* is in the owner's mailbox, and W3 and W4 happen twice: for the owner, then for others. An owner
//! that sleeps until this region has work is handled as any sleeper, and woken. An owner that does anything else passes
//! S2, after W2, before it next sleeps for this region, and S3 sees the work. So an owner never sleeps while its
//! mailbox has work for it, even if no other worker is free to take that. If the owner is woken, no other worker is:
//! the owner runs the work.
//!
//! *Work that moves.* A thief that takes several jobs at once, or pushes back one that it popped, hides them for a
//! moment from S3 and F3. When they are visible again, it passes W2 and W4 anew, and ignores searchers
//! (`wake_despite_searchers`).
//!
//! **A notification is neither lost nor left over.** Under the lock exactly one thread removes a sleeper from the list.
//! If that is a waker, it unparks the sleeper once, and the sleeper waits for this one notification even if it has seen
//! work meanwhile. If it is the sleeper itself, nobody unparks it. So between two sleeps no notification is pending.
//!
//! **Nothing deadlocks.** The lock of the list and that of a parker are never held together, and no code of a user runs
//! under either.
//!
//! # Memory ordering
//!
//! The argument rests on the fences, so the counts are changed and read relaxed, and W1 and S3 may be relaxed too. A
//! stale count of sleepers costs a lock; the fences exclude a stale zero. The queues, the mailbox's lock and the latch
//! order the data that belongs to the work: a wake-up is only a reason to look.

use crossbeam_utils::CachePadded;

use super::parker::Parker;
use super::priority::Priority;
use crate::sync::{AtomicUsize, Mutex, Ordering, fence};

/// What a sleeper is woken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WakeFor {
    /// Any job in a queue or a mailbox, and anything that only this worker waits for.
    Any,
    /// The region that it has open at this level: its end, or a job of it in the mailbox.
    Region { level: usize },
}

/// The most workers of a scheduler.
pub(super) const MAX_WORKERS: usize = 1000;

/// A parker for each worker, the list of sleepers, and the counts of sleepers and searchers.
pub(super) struct Sleep {
    /// A sum of [`SLEEPER`], [`UNRESTRICTED_SLEEPER`] and [`SEARCHER`], read without the lock.
    counts: CachePadded<AtomicUsize>,
    /// The workers that sleep or are about to. The last one is woken first, because its caches are the warmest.
    sleepers: Mutex<Vec<(usize, WakeFor)>>,
    parkers: Box<[CachePadded<Parker>]>,
}

// Each count has bits of its own, enough for all workers, so that one load reads all counts.

/// One sleeper in the count of all sleepers.
const SLEEPER: usize = 1;
/// One sleeper in the count of unrestricted sleepers, who count as sleepers too.
const UNRESTRICTED_SLEEPER: usize = 1 << BITS;
/// One searcher in the count of searchers.
const SEARCHER: usize = 1 << (2 * BITS);
const BITS: u32 = usize::BITS / 3;
const MASK: usize = (1 << BITS) - 1;
const _: () = assert!(MAX_WORKERS <= MASK, "one count overflows into the next");

impl Sleep {
    pub(super) fn new(workers: usize) -> Self {
        Self {
            counts: CachePadded::new(AtomicUsize::new(0)),
            sleepers: Mutex::new(Vec::with_capacity(workers)),
            parkers: (0..workers).map(|_| CachePadded::new(Parker::new())).collect(),
        }
    }

    /// Counts a worker in as a searcher.
    pub(super) fn start_search(&self) {
        self.counts.fetch_add(SEARCHER, Ordering::Relaxed);
    }

    /// Counts out a searcher that has found work. If `sees_more_work` of some priorities, it wakes another worker: for
    /// a frame's jobs if it was the last searcher, and for background jobs always, because other searchers may not take
    /// those.
    pub(super) fn end_search(&self, sees_more_work: impl Fn(&[Priority]) -> bool) {
        let before = self.counts.fetch_sub(SEARCHER, Ordering::Relaxed);
        fence(Ordering::SeqCst);
        if unrestricted_sleepers(self.counts.load(Ordering::Relaxed)) == 0 {
            return;
        }
        if searchers(before) == 1 && sees_more_work(&Priority::FRAME) {
            self.wake_any();
        }
        if sees_more_work(&[Priority::Background]) {
            self.wake(|&sleeper| takes(sleeper, Priority::Background));
        }
    }

    /// Sleeps until woken, unless `sees_work`, which is called when wakers can see the worker on the list.
    /// `is_searcher` says whether the worker counts as a searcher now. Returns whether it does on return.
    pub(super) fn sleep(
        &self,
        worker: usize,
        wake_for: WakeFor,
        is_searcher: bool,
        sees_work: impl FnOnce() -> bool,
    ) -> bool {
        self.add_sleeper(worker, wake_for, is_searcher);
        fence(Ordering::SeqCst);
        let is_this_worker = |&(sleeper, _): &(usize, WakeFor)| sleeper == worker;
        if !sees_work() || self.remove_sleeper(is_this_worker).is_none() {
            self.parkers[worker].park();
        }
        wake_for == WakeFor::Any
    }

    /// Wakes a worker that takes any work, if one sleeps and nobody searches. The work must have been published.
    pub(super) fn wake_any(&self) {
        fence(Ordering::SeqCst);
        let counts = self.counts.load(Ordering::Relaxed);
        if unrestricted_sleepers(counts) > 0 && searchers(counts) == 0 {
            self.wake(|&(_, wake_for)| wake_for == WakeFor::Any);
        }
    }

    /// Wakes a worker that takes jobs of this priority, if one sleeps, even if there are searchers: the caller may be
    /// one itself, and worker 0 may be one, which does not look for background jobs. The job must have been published.
    pub(super) fn wake_despite_searchers(&self, priority: Priority) {
        fence(Ordering::SeqCst);
        if unrestricted_sleepers(self.counts.load(Ordering::Relaxed)) > 0 {
            self.wake(|&sleeper| takes(sleeper, priority));
        }
    }

    /// Wakes the owner of a region for a job of that region, if it sleeps until there is one, and otherwise a worker
    /// that takes jobs of this priority. The job must have been published where both look for it.
    pub(super) fn wake_owner_or_other(&self, owner: usize, level: usize, priority: Priority) {
        fence(Ordering::SeqCst);
        let counts = self.counts.load(Ordering::Relaxed);
        let waits_for_it = |wake_for| wake_for == WakeFor::Any || wake_for == WakeFor::Region { level };
        if sleepers(counts) > 0 && self.wake(|&(sleeper, wake_for)| sleeper == owner && waits_for_it(wake_for)) {
            return;
        }
        // As in `wake_any` and `wake_despite_searchers`, the fence is after the job and before the load of the counts.
        if unrestricted_sleepers(counts) > 0 && (priority == Priority::Background || searchers(counts) == 0) {
            self.wake(|&sleeper| takes(sleeper, priority));
        }
    }

    /// Wakes this worker, if it sleeps. The work must have been published.
    pub(super) fn wake_worker(&self, worker: usize) {
        fence(Ordering::SeqCst);
        if sleepers(self.counts.load(Ordering::Relaxed)) > 0 {
            self.wake(|&(sleeper, _)| sleeper == worker);
        }
    }

    /// Wakes all workers that sleep. The work must have been published.
    pub(super) fn wake_all(&self) {
        // Without a fence: this takes the lock in any case, and a worker that is added to the list later sees what was
        // published before.
        while self.wake(|_| true) {}
    }

    /// The workers that sleep or are about to, with what they are woken for.
    pub(super) fn sleeping(&self) -> Vec<(usize, WakeFor)> {
        self.sleepers.lock().clone()
    }

    /// How many workers sleep or are about to.
    pub(super) fn sleepers(&self) -> usize {
        sleepers(self.counts.load(Ordering::Relaxed))
    }

    /// Wakes the last sleeper that is wanted, and returns whether there was one.
    fn wake(&self, is_wanted: impl Fn(&(usize, WakeFor)) -> bool) -> bool {
        let sleeper = self.remove_sleeper(is_wanted);
        if let Some(sleeper) = sleeper {
            self.parkers[sleeper].unpark();
        }
        sleeper.is_some()
    }

    fn add_sleeper(&self, worker: usize, wake_for: WakeFor, is_searcher: bool) {
        let mut sleepers = self.sleepers.lock();
        sleepers.push((worker, wake_for));
        // One operation, so that the worker counts as a searcher or as a sleeper at all times.
        let out = if is_searcher { SEARCHER } else { 0 };
        self.counts.fetch_add(weight(wake_for).wrapping_sub(out), Ordering::Relaxed);
    }

    /// Removes the last sleeper that is wanted from the list, and returns its worker. If it takes any work, it is a
    /// searcher from then on.
    fn remove_sleeper(&self, is_wanted: impl Fn(&(usize, WakeFor)) -> bool) -> Option<usize> {
        let mut sleepers = self.sleepers.lock();
        let (worker, wake_for) = sleepers.iter().rposition(is_wanted).map(|index| sleepers.remove(index))?;
        let becomes = if wake_for == WakeFor::Any { SEARCHER } else { 0 };
        self.counts.fetch_add(becomes.wrapping_sub(weight(wake_for)), Ordering::Relaxed);
        Some(worker)
    }
}

/// Whether a sleeper takes jobs of this priority, of any region.
fn takes((worker, wake_for): (usize, WakeFor), priority: Priority) -> bool {
    wake_for == WakeFor::Any && (worker != 0 || priority != Priority::Background)
}

fn weight(wake_for: WakeFor) -> usize {
    match wake_for {
        WakeFor::Any => SLEEPER + UNRESTRICTED_SLEEPER,
        WakeFor::Region { .. } => SLEEPER,
    }
}

fn sleepers(counts: usize) -> usize {
    counts & MASK
}

fn unrestricted_sleepers(counts: usize) -> usize {
    (counts >> BITS) & MASK
}

fn searchers(counts: usize) -> usize {
    counts >> (2 * BITS)
}

#[cfg(all(test, drawloom_loom))]
mod models;
