//! The job queues of a worker: the owner's end, and the end that other workers steal from.
//!
//! A queue is crossbeam's deque as long as it holds few jobs. That deque allocates when it grows and again when it
//! shrinks, so it is never filled so far that it grows. Further jobs go to an *overflow* behind a lock, which keeps its
//! memory. The overflow holds the newest jobs, so the owner takes from it first and thieves take from it last.
//!
//! # Memory ordering
//!
//! The count of the overflow is a hint, so it is relaxed. For the owner it is exact unless thieves took something. A
//! thief that misses a job finds it when it looks once more before it sleeps, after a fence. The deque and the lock
//! order the jobs.

use std::array;
use std::cell::Cell;
use std::collections::VecDeque;

use crossbeam_utils::CachePadded;

use super::job::Job;
use super::locked_queue::LockedQueue;
use super::priority::Priority;
use super::region::{JobContext, Region};
use super::shuffle::Shuffle;
use crate::sync::{Arc, Deque, Steal, Stealer};

/// The most jobs in a deque. Crossbeam's deque starts with room for 64, and grows when that is full.
const MAX_IN_DEQUE: usize = if cfg!(drawloom_model_check) { 2 } else { 60 };

/// How many jobs a thief takes from an overflow beside the one that it runs, at most.
const MAX_EXTRA_STOLEN: usize = 59;

/// A worker's own end of its queues, one for each priority.
pub(super) struct Queues<W: JobContext> {
    queues: [Queue<W>; Priority::ALL.len()],
    /// Chooses the next job at random, instead of by age.
    shuffle: Option<Shuffle>,
    /// For each priority, the number of jobs pushed since the current nested wait began, and not popped.
    pushed_since_wait: [Cell<usize>; Priority::ALL.len()],
}

/// The result of [`Queues::pop_awaited`].
pub(super) enum Popped<W: JobContext> {
    Job(Job<W>),
    Nothing,
    /// A job of another region was popped, and pushed back.
    PutBack,
}

impl<W: JobContext> Queues<W> {
    /// Empty queues. Without a shuffle, the newest job comes first.
    pub(super) fn new(shuffle: Option<Shuffle>) -> Self {
        Self {
            queues: Priority::ALL.map(|_| Queue::new()),
            shuffle,
            pushed_since_wait: Priority::ALL.map(|_| Cell::new(0)),
        }
    }

    /// The other end of the queues.
    pub(super) fn stealers(&self) -> Stealers<W> {
        Stealers { queues: self.queues.each_ref().map(Queue::stealer) }
    }

    pub(super) fn push(&self, job: Job<W>, priority: Priority) {
        let pushed = &self.pushed_since_wait[priority as usize];
        pushed.set(pushed.get() + 1);
        let queue = &self.queues[priority as usize];
        match self.shuffle {
            None => queue.push(job),
            Some(_) => queue.overflow.push(job),
        }
    }

    /// Steals the oldest job of another worker. From an overflow it moves some more jobs to these queues.
    pub(super) fn steal_from(&self, stealers: &Stealers<W>, priority: Priority) -> Option<Job<W>> {
        let queue = &stealers.queues[priority as usize];
        let mut stolen = queue.steal();
        if stolen.is_none() && !queue.overflow.is_empty() {
            stolen = queue.overflow.take_oldest(|job| self.push(Job { is_stolen: true, ..job }, priority));
        }
        stolen.map(|job| Job { is_stolen: true, ..job })
    }

    /// Pops the newest job.
    pub(super) fn pop(&self, priority: Priority) -> Option<Job<W>> {
        let queue = &self.queues[priority as usize];
        match &self.shuffle {
            None => queue.pop(),
            Some(shuffle) => queue.overflow.take_random(shuffle, |_job| true),
        }
    }

    /// Pops the newest job, if it belongs to this region, which the worker waits for inside a job.
    pub(super) fn pop_awaited(&self, priority: Priority, region: &Region<W>) -> Popped<W> {
        let queue = &self.queues[priority as usize];
        if let Some(shuffle) = &self.shuffle {
            let job = queue.overflow.take_random(shuffle, |job| job.region.is(region));
            return job.map_or(Popped::Nothing, Popped::Job);
        }
        let pushed = &self.pushed_since_wait[priority as usize];
        // Without this count every call would pop a job of another region, and hide it from thieves.
        if pushed.get() == 0 {
            return Popped::Nothing;
        }
        match queue.pop() {
            Some(job) if job.region.is(region) => {
                pushed.set(pushed.get() - 1);
                Popped::Job(job)
            }
            Some(job) => {
                pushed.set(0);
                queue.push(job);
                Popped::PutBack
            }
            None => {
                pushed.set(0);
                Popped::Nothing
            }
        }
    }

    /// Begins a wait inside a job. Returns what [`end_wait`](Self::end_wait) needs.
    pub(super) fn start_wait(&self) -> [usize; Priority::ALL.len()] {
        self.pushed_since_wait.each_ref().map(Cell::take)
    }

    /// Ends a wait inside a job, and continues the wait around it.
    pub(super) fn end_wait(&self, outer: [usize; Priority::ALL.len()]) {
        for (pushed, outer) in self.pushed_since_wait.iter().zip(outer) {
            pushed.set(outer);
        }
    }

    /// The number of jobs.
    pub(super) fn len(&self) -> usize {
        self.queues.iter().map(|queue| queue.deque.len() + queue.overflow.len()).sum()
    }

    /// A random number below `count`, if there is a shuffle.
    pub(super) fn draw(&self, count: usize) -> Option<usize> {
        self.shuffle.as_ref()?.below(count)
    }
}

struct Queue<W: JobContext> {
    deque: Deque<Job<W>>,
    /// How many more jobs the deque has room for at least.
    free: Cell<usize>,
    overflow: Arc<CachePadded<Overflow<W>>>,
}

impl<W: JobContext> Queue<W> {
    fn new() -> Self {
        Self {
            deque: Deque::new_lifo(),
            free: Cell::new(MAX_IN_DEQUE),
            overflow: Arc::new(CachePadded::new(Overflow::new())),
        }
    }

    fn stealer(&self) -> QueueStealer<W> {
        QueueStealer { stealer: self.deque.stealer(), overflow: Arc::clone(&self.overflow) }
    }

    fn push(&self, job: Job<W>) {
        // Jobs in the overflow are newer than those in the deque, so new jobs go there until it is empty.
        if !self.overflow.is_empty() {
            self.overflow.push(job);
            return;
        }
        if self.free.get() == 0 {
            self.free.set(MAX_IN_DEQUE.saturating_sub(self.deque.len()));
        }
        if self.free.get() == 0 {
            self.overflow.push(job);
        } else {
            self.free.set(self.free.get() - 1);
            self.deque.push(job);
        }
    }

    fn pop(&self) -> Option<Job<W>> {
        if !self.overflow.is_empty()
            && let Some(newest) = self.overflow.take_newest()
        {
            return Some(newest);
        }
        let newest = self.deque.pop()?;
        self.free.set((self.free.get() + 1).min(MAX_IN_DEQUE));
        Some(newest)
    }
}

/// The end of a worker's queues that other workers steal from.
pub(super) struct Stealers<W: JobContext> {
    queues: [QueueStealer<W>; Priority::ALL.len()],
}

impl<W: JobContext> Stealers<W> {
    pub(super) fn is_empty(&self, priority: Priority) -> bool {
        self.queues[priority as usize].is_empty()
    }

    /// The number of jobs.
    pub(super) fn len(&self) -> usize {
        self.queues.iter().map(QueueStealer::len).sum()
    }
}

struct QueueStealer<W: JobContext> {
    stealer: Stealer<Job<W>>,
    overflow: Arc<CachePadded<Overflow<W>>>,
}

impl<W: JobContext> QueueStealer<W> {
    /// Steals the oldest job of the deque.
    fn steal(&self) -> Option<Job<W>> {
        while !self.stealer.is_empty() {
            match self.stealer.steal() {
                Steal::Success(job) => return Some(job),
                Steal::Empty => break,
                // Another thief or the owner took that job, and there may be more.
                Steal::Retry => {}
            }
        }
        None
    }

    fn is_empty(&self) -> bool {
        self.stealer.is_empty() && self.overflow.is_empty()
    }

    fn len(&self) -> usize {
        self.stealer.len() + self.overflow.len()
    }
}

struct Overflow<W: JobContext> {
    jobs: LockedQueue<Job<W>>,
}

impl<W: JobContext> Overflow<W> {
    fn new() -> Self {
        Self { jobs: LockedQueue::new() }
    }

    fn is_empty(&self) -> bool {
        self.jobs.is_empty()
    }

    fn len(&self) -> usize {
        self.jobs.len()
    }

    fn push(&self, job: Job<W>) {
        self.jobs.push(job);
    }

    fn take_newest(&self) -> Option<Job<W>> {
        self.jobs.update(VecDeque::pop_back)
    }

    /// Takes the oldest jobs together, so that others need the lock less often. Returns the first, and passes the rest
    /// to `keep`. The rest belong to an outermost region: a thief must not keep jobs of other regions (see
    /// `Worker::push`).
    fn take_oldest(&self, keep: impl FnMut(Job<W>)) -> Option<Job<W>> {
        let (first, rest) = self.jobs.update(|jobs| {
            let count = (jobs.len() / 2).min(MAX_EXTRA_STOLEN);
            let first = jobs.pop_front();
            let rest: [Option<Job<W>>; MAX_EXTRA_STOLEN] = array::from_fn(|index| {
                let may_keep = index < count && jobs.front().is_some_and(|job| job.region.is_outermost());
                if may_keep { jobs.pop_front() } else { None }
            });
            (first, rest)
        });
        rest.into_iter().flatten().for_each(keep);
        first
    }

    /// Takes a random one of the wanted jobs.
    fn take_random(&self, shuffle: &Shuffle, is_wanted: impl Fn(&Job<W>) -> bool) -> Option<Job<W>> {
        self.jobs.update(|jobs| {
            let wanted = jobs.iter().filter(|job| is_wanted(job)).count();
            let chosen = shuffle.below(wanted)?;
            let (index, _) = jobs.iter().enumerate().filter(|(_, job)| is_wanted(job)).nth(chosen)?;
            jobs.remove(index)
        })
    }
}

#[cfg(all(test, drawloom_loom))]
mod loom_tests {
    use loom::model::Builder;
    use loom::thread;

    use super::{Job, Priority};
    use crate::task::job::Work;
    use crate::task::{Scheduler, TokenContext, Tokens, Worker};

    type Queues = super::Queues<Worker>;
    type Region = super::Region<Worker>;

    struct NoTokens;

    impl Tokens for NoTokens {
        fn run(&self, _token: u64, _context: &TokenContext<'_>) {
            unreachable!("no job of this test is run");
        }
    }

    fn token(job: Option<Job<Worker>>) -> Option<u64> {
        job.map(|job| match job.work {
            Work::Token(token) => token,
            Work::Closure(_) => unreachable!("all jobs are tokens"),
        })
    }

    /// The owner pushes `jobs` jobs, pops one after `early` of them, and the rest at the end, while a thief steals.
    /// Returns the job that the owner popped early, those that it popped at the end, and those that the thief took.
    fn push_and_steal(region: &'static Region, jobs: u64, early: u64) -> (Option<u64>, Vec<u64>, Vec<u64>) {
        let queues = Queues::new(None);
        let stealers = queues.stealers();
        let thief = thread::spawn(move || {
            let own = Queues::new(None);
            let mut stolen: Vec<u64> =
                (0..3).filter_map(|_| token(own.steal_from(&stealers, Priority::Normal))).collect();
            // The jobs that it moved to its own queues.
            stolen.extend(std::iter::from_fn(|| token(own.pop(Priority::Normal))));
            stolen
        });
        let mut taken_early = None;
        for number in 0..jobs {
            if number == early {
                taken_early = token(queues.pop(Priority::Normal));
            }
            queues.push(Job { work: Work::Token(number), region, is_stolen: false }, Priority::Normal);
        }
        let taken = std::iter::from_fn(|| token(queues.pop(Priority::Normal))).collect();
        (taken_early, taken, thief.join().unwrap())
    }

    fn check_each_once(jobs: u64, early: u64) {
        let mut builder = Builder::new();
        builder.preemption_bound = Some(3);
        builder.check(move || {
            let scheduler = Scheduler::new(1).unwrap();
            let outcome = scheduler.with_worker(|worker| {
                worker.open_region(&NoTokens, |region| {
                    let (taken_early, taken, stolen) = push_and_steal(region, jobs, early);
                    assert!(taken.is_sorted_by(|earlier, later| earlier > later), "not the newest first: {taken:?}");
                    let mut all: Vec<u64> = taken_early.into_iter().chain(taken).chain(stolen).collect();
                    all.sort_unstable();
                    assert_eq!(all, Vec::from_iter(0..jobs));
                })
            });
            assert_eq!(outcome, Ok(()));
        });
    }

    #[test]
    fn jobs_that_overflow_are_taken_once_by_the_owner_or_a_thief() {
        check_each_once(3, 3);
    }

    #[test]
    fn jobs_that_follow_an_overflow_are_taken_after_it() {
        check_each_once(4, 4);
    }

    #[test]
    fn room_that_becomes_free_is_used_again() {
        check_each_once(4, 3);
    }
}
