//! Jobs that lie in no worker's queues, each with the owner of its region: those that only the owner may run, and those that
//! the worker which spawned them must not keep.
//!
//! What a worker keeps in its queues is out of reach for an owner that waits in the midst of a job, since such an owner does
//! not steal. So a job of a region that was opened inside a job is kept by the owner alone; other workers hand it to the
//! owner's mailbox, where the owner finds it, and so does every worker that looks for work. Whatever a worker does after it
//! has spawned the job, nobody waits for it to come back to its queues.
//!
//! The regions of a worker lie on its stack, so an open one is known by its level there, and each level has a queue that
//! passes from one region to the next. It is empty by then: a region ends when its jobs have run.

use std::{collections::VecDeque, fmt};

use crate::sync::{AtomicUsize, Mutex, Ordering};

use super::{job::Job, priority::Priority, region::Region};

/// The jobs of a worker's open regions that lie in no queue.
pub(super) struct Mailbox {
    /// For the owner alone, and in the order in which they came.
    pinned: LevelQueues,
    /// For the owner, and for whoever looks for work of a frame.
    frame: LevelQueues,
    /// For the owner, and for whoever looks for background work.
    background: LevelQueues,
}

impl Mailbox {
    pub(super) fn new() -> Self {
        Self { pinned: LevelQueues::new(), frame: LevelQueues::new(), background: LevelQueues::new() }
    }

    pub(super) fn put_pinned(&self, job: Job) {
        self.pinned.put(job);
    }

    /// The oldest pinned job of the region, which is the owner's.
    pub(super) fn take_pinned(&self, region: &Region) -> Option<Job> {
        self.pinned.change(region.level(), VecDeque::pop_front)
    }

    pub(super) fn has_pinned(&self, region: &Region) -> bool {
        self.pinned.has(region.level())
    }

    /// Puts a job where the owner of its region finds it, and others too.
    pub(super) fn put_shared(&self, job: Job) {
        self.shared(job.region.is_background()).put(job);
    }

    /// The newest shared job of the region, which is the owner's. The newest first, as with a worker's own queues, so that a
    /// tree of jobs is not spread out over its whole breadth.
    pub(super) fn take_shared(&self, region: &Region) -> Option<Job> {
        self.shared(region.is_background()).change(region.level(), VecDeque::pop_back)
    }

    pub(super) fn has_shared(&self, region: &Region) -> bool {
        self.shared(region.is_background()).has(region.level())
    }

    /// A shared job of this band, of whichever region.
    pub(super) fn take_any_shared(&self, band: Priority) -> Option<Job> {
        self.shared(band == Priority::Background).take_any()
    }

    pub(super) fn has_any_shared(&self, band: Priority) -> bool {
        !self.shared(band == Priority::Background).is_empty()
    }

    fn shared(&self, is_background: bool) -> &LevelQueues {
        if is_background { &self.background } else { &self.frame }
    }
}

impl fmt::Debug for Mailbox {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Mailbox")
            .field("pinned", &self.pinned.len())
            .field("frame", &self.frame.len())
            .field("background", &self.background.len())
            .finish()
    }
}

/// A queue for each level of nesting, and a count that spares those who find all of them empty the lock. Its memory grows and
/// stays.
///
/// The count is a hint, so it is relaxed. That a sleeping worker learns of a job that is put here is up to the fences of
/// [`Sleep`](super::sleep::Sleep), and the lock orders the jobs themselves.
struct LevelQueues {
    count: AtomicUsize,
    levels: Mutex<Vec<VecDeque<Job>>>,
}

impl LevelQueues {
    fn new() -> Self {
        Self { count: AtomicUsize::new(0), levels: Mutex::new(Vec::new()) }
    }

    fn len(&self) -> usize {
        self.count.load(Ordering::Relaxed)
    }

    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn put(&self, job: Job) {
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

    /// Takes what `take` takes out of the queue of a level, if there are any jobs at all.
    fn change(&self, level: usize, take: impl FnOnce(&mut VecDeque<Job>) -> Option<Job>) -> Option<Job> {
        if self.is_empty() {
            return None;
        }
        let mut levels = self.levels.lock();
        let taken = levels.get_mut(level).and_then(take)?;
        self.count.store(self.len() - 1, Ordering::Relaxed);
        Some(taken)
    }

    /// The newest job of the outermost region that has one.
    fn take_any(&self) -> Option<Job> {
        if self.is_empty() {
            return None;
        }
        let mut levels = self.levels.lock();
        let taken = levels.iter_mut().find_map(VecDeque::pop_back)?;
        self.count.store(self.len() - 1, Ordering::Relaxed);
        Some(taken)
    }
}
