//! The jobs that other workers hand to the owner of their region: pinned ones, which only the owner may run, and those
//! that the worker which spawned them must not keep.
//!
//! An owner that waits inside a job does not steal, so it cannot reach jobs in another worker's queues. Therefore only
//! the owner keeps jobs of that region in its queues. Other workers put them into the owner's mailbox, where the owner
//! finds them, and so does every worker that looks for work. So no job has to wait until the worker that spawned it
//! looks into its queues again.
//!
//! The regions of a worker lie on its stack, so an open region is identified by its level there. Each level has a
//! queue, which the regions of that level use one after another. A region finds it empty, because the region before
//! ended when all of its jobs had run.

use std::collections::VecDeque;
use std::fmt;

use super::job::Job;
use super::priority::Priority;
use super::region::{JobContext, Region};
use crate::sync::{AtomicUsize, Mutex, Ordering};

/// The jobs of a worker's open regions that are in no worker's queues.
pub(super) struct Mailbox<W: JobContext> {
    /// For the owner alone, in the order in which they came.
    pinned: LevelQueues<W>,
    /// For the owner, and for any worker that looks for a frame's jobs.
    frame: LevelQueues<W>,
    /// For the owner, and for any worker that looks for background jobs.
    background: LevelQueues<W>,
}

impl<W: JobContext> Mailbox<W> {
    pub(super) fn new() -> Self {
        Self { pinned: LevelQueues::new(), frame: LevelQueues::new(), background: LevelQueues::new() }
    }

    pub(super) fn put_pinned(&self, job: Job<W>) {
        self.pinned.put(job);
    }

    /// Takes the oldest pinned job of the region. Only its owner may call this.
    pub(super) fn take_pinned(&self, region: &Region<W>) -> Option<Job<W>> {
        self.pinned.take_from(region.level(), VecDeque::pop_front)
    }

    pub(super) fn has_pinned(&self, region: &Region<W>) -> bool {
        self.pinned.has(region.level())
    }

    /// Puts a job where the owner of its region and other workers find it.
    pub(super) fn put_shared(&self, job: Job<W>) {
        self.shared(job.region.is_background()).put(job);
    }

    /// Takes the newest shared job of the region. Only its owner may call this. The newest comes first, as in a
    /// worker's queues, so that a tree of jobs is run depth first.
    pub(super) fn take_shared(&self, region: &Region<W>) -> Option<Job<W>> {
        self.shared(region.is_background()).take_from(region.level(), VecDeque::pop_back)
    }

    pub(super) fn has_shared(&self, region: &Region<W>) -> bool {
        self.shared(region.is_background()).has(region.level())
    }

    /// Takes a shared job of any region for this priority.
    pub(super) fn take_any_shared(&self, priority: Priority) -> Option<Job<W>> {
        self.shared(priority == Priority::Background).take_any()
    }

    pub(super) fn has_any_shared(&self, priority: Priority) -> bool {
        !self.shared(priority == Priority::Background).is_empty()
    }

    fn shared(&self, is_background: bool) -> &LevelQueues<W> {
        if is_background { &self.background } else { &self.frame }
    }
}

impl<W: JobContext> fmt::Debug for Mailbox<W> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Mailbox")
            .field("pinned", &self.pinned.len())
            .field("frame", &self.frame.len())
            .field("background", &self.background.len())
            .finish()
    }
}

/// A queue for each level of nesting behind one lock, and a count with which workers skip the lock if all queues are
/// empty. Its memory grows and is kept.
///
/// The count is a hint, so it is relaxed. The fences of [`Sleep`](super::sleep::Sleep) make sure that a worker which
/// goes to sleep finds a job that was put here. The lock orders the jobs themselves.
struct LevelQueues<W: JobContext> {
    count: AtomicUsize,
    levels: Mutex<Vec<VecDeque<Job<W>>>>,
}

impl<W: JobContext> LevelQueues<W> {
    fn new() -> Self {
        Self { count: AtomicUsize::new(0), levels: Mutex::new(Vec::new()) }
    }

    fn len(&self) -> usize {
        self.count.load(Ordering::Relaxed)
    }

    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn put(&self, job: Job<W>) {
        let level = job.region.level();
        let mut levels = self.levels.lock();
        if levels.len() <= level {
            levels.resize_with(level + 1, VecDeque::new);
        }
        levels[level].push_back(job);
        self.count.store(self.len() + 1, Ordering::Relaxed);
    }

    fn has(&self, level: usize) -> bool {
        !self.is_empty() && self.levels.lock().get(level).is_some_and(|jobs| !jobs.is_empty())
    }

    /// Takes a job of this level with `take`.
    fn take_from(&self, level: usize, take: impl FnOnce(&mut VecDeque<Job<W>>) -> Option<Job<W>>) -> Option<Job<W>> {
        if self.is_empty() {
            return None;
        }
        let mut levels = self.levels.lock();
        let taken = levels.get_mut(level).and_then(take)?;
        self.count.store(self.len() - 1, Ordering::Relaxed);
        Some(taken)
    }

    /// Takes the newest job of the lowest level that has one.
    fn take_any(&self) -> Option<Job<W>> {
        if self.is_empty() {
            return None;
        }
        let mut levels = self.levels.lock();
        let taken = levels.iter_mut().find_map(VecDeque::pop_back)?;
        self.count.store(self.len() - 1, Ordering::Relaxed);
        Some(taken)
    }
}
