//! Where the jobs of a worker wait: its own end of the queue, and the end that thieves see.
//!
//! A queue is crossbeam's deque as long as few jobs are in it. That deque allocates when it grows, and again when it
//! shrinks, so it is never filled so far that it grows; what is beyond goes into an *overflow* behind a lock, whose memory
//! stays. The overflow holds the newest jobs, so it is the owner's end, and thieves come to it last.
//!
//! # Memory ordering
//!
//! The count of the overflow is a hint, so it is relaxed: for the owner it is exact unless thieves took something, and
//! a thief that misses a job finds it when it looks once more before it sleeps, after a fence. The jobs are ordered by
//! the deque and the lock.

use std::{array, cell::Cell, collections::VecDeque};

use crossbeam_utils::CachePadded;

use crate::sync::{Arc, Deque, Steal, Stealer};

use super::{job::Job, locked_queue::LockedQueue, priority::Priority, region::Region, shuffle::Shuffle};

/// How many jobs lie in the deque at most. Crossbeam's has room for 64 at first, and grows when that is full.
const MOST_IN_DEQUE: usize = if cfg!(any(drawloom_loom, drawloom_shuttle)) { 2 } else { 60 };

/// How many jobs a thief takes out of an overflow beside the one it runs.
const MOST_AT_ONCE: usize = 59;

/// A worker's own end of its queues, one for each band.
pub(super) struct Queues {
    bands: [Queue; Priority::ALL.len()],
    /// What decides who is next instead of age.
    shuffle: Option<Shuffle>,
    /// Per band, how many jobs have been queued here since the innermost wait in the midst of a job began, and have not
    /// been taken out here.
    since_wait: [Cell<usize>; Priority::ALL.len()],
}

/// What came of looking for a job.
pub(super) enum Popped {
    Job(Job),
    Nothing,
    /// A job was taken out and put back, as it was the wrong one.
    PutBack,
}

impl Queues {
    /// Empty queues, which give jobs out newest first, or in some other order that the shuffle decides.
    pub(super) fn new(shuffle: Option<Shuffle>) -> Self {
        Self { bands: Priority::ALL.map(|_| Queue::new()), shuffle, since_wait: Priority::ALL.map(|_| Cell::new(0)) }
    }

    /// The end for thieves.
    pub(super) fn loot(&self) -> Loot {
        Loot { bands: self.bands.each_ref().map(Queue::loot) }
    }

    pub(super) fn push(&self, job: Job, band: Priority) {
        let since_wait = &self.since_wait[band as usize];
        since_wait.set(since_wait.get() + 1);
        let queue = &self.bands[band as usize];
        match self.shuffle {
            None => queue.push(job),
            Some(_) => queue.overflow.put(job),
        }
    }

    /// Takes over the oldest jobs of somebody else, if there are any, as if they had been queued here, and gives back the
    /// first.
    pub(super) fn steal_from(&self, loot: &Loot, band: Priority) -> Option<Job> {
        let loot = &loot.bands[band as usize];
        let mut stolen = loot.steal();
        if stolen.is_none() && !loot.overflow.is_empty() {
            stolen = loot.overflow.take_oldest(|job| self.push(Job { is_stolen: true, ..job }, band));
        }
        stolen.map(|job| Job { is_stolen: true, ..job })
    }

    /// The newest job.
    pub(super) fn pop(&self, band: Priority) -> Option<Job> {
        let queue = &self.bands[band as usize];
        match &self.shuffle {
            None => queue.pop(),
            Some(shuffle) => queue.overflow.take_any(shuffle, |_job| true),
        }
    }

    /// The newest job, if it is one of this region, which the worker waits for.
    pub(super) fn pop_awaited(&self, band: Priority, region: &Region) -> Popped {
        let queue = &self.bands[band as usize];
        if let Some(shuffle) = &self.shuffle {
            let job = queue.overflow.take_any(shuffle, |job| job.region.is(region));
            return job.map_or(Popped::Nothing, Popped::Job);
        }
        let since_wait = &self.since_wait[band as usize];
        // Without this count every look would take a job out that is not looked for, and hide it from others.
        if since_wait.get() == 0 {
            return Popped::Nothing;
        }
        match queue.pop() {
            Some(job) if job.region.is(region) => {
                since_wait.set(since_wait.get() - 1);
                Popped::Job(job)
            }
            Some(job) => {
                since_wait.set(0);
                queue.push(job);
                Popped::PutBack
            }
            None => {
                since_wait.set(0);
                Popped::Nothing
            }
        }
    }

    /// A wait begins in the midst of a job. Gives back what the end of the wait is to be told.
    pub(super) fn start_wait(&self) -> [usize; Priority::ALL.len()] {
        self.since_wait.each_ref().map(Cell::take)
    }

    /// A wait ends, and the one goes on that it was inside of.
    pub(super) fn end_wait(&self, before: [usize; Priority::ALL.len()]) {
        for (since_wait, before) in self.since_wait.iter().zip(before) {
            since_wait.set(before);
        }
    }

    /// How many jobs there are.
    pub(super) fn len(&self) -> usize {
        self.bands.iter().map(|queue| queue.deque.len() + queue.overflow.len()).sum()
    }

    /// One of so many, if there is a shuffle.
    pub(super) fn draw(&self, count: usize) -> Option<usize> {
        self.shuffle.as_ref()?.below(count)
    }
}

struct Queue {
    deque: Deque<Job>,
    /// How many more the deque has room for at least.
    room: Cell<usize>,
    overflow: Arc<CachePadded<Overflow>>,
}

impl Queue {
    fn new() -> Self {
        Self {
            deque: Deque::new_lifo(),
            room: Cell::new(MOST_IN_DEQUE),
            overflow: Arc::new(CachePadded::new(Overflow::new())),
        }
    }

    fn loot(&self) -> BandLoot {
        BandLoot { stealer: self.deque.stealer(), overflow: Arc::clone(&self.overflow) }
    }

    fn push(&self, job: Job) {
        // Jobs in the overflow are newer than those in the deque, so as long as there are any, more follow them.
        if !self.overflow.is_empty() {
            self.overflow.put(job);
            return;
        }
        if self.room.get() == 0 {
            self.room.set(MOST_IN_DEQUE.saturating_sub(self.deque.len()));
        }
        if self.room.get() == 0 {
            self.overflow.put(job);
        } else {
            self.room.set(self.room.get() - 1);
            self.deque.push(job);
        }
    }

    fn pop(&self) -> Option<Job> {
        if !self.overflow.is_empty()
            && let Some(newest) = self.overflow.take_newest()
        {
            return Some(newest);
        }
        let newest = self.deque.pop()?;
        self.room.set((self.room.get() + 1).min(MOST_IN_DEQUE));
        Some(newest)
    }
}

/// The end of a worker's queues that other workers see.
pub(super) struct Loot {
    bands: [BandLoot; Priority::ALL.len()],
}

impl Loot {
    pub(super) fn of(&self, band: Priority) -> &BandLoot {
        &self.bands[band as usize]
    }

    /// How many jobs there are.
    pub(super) fn len(&self) -> usize {
        self.bands.iter().map(BandLoot::len).sum()
    }
}

pub(super) struct BandLoot {
    stealer: Stealer<Job>,
    overflow: Arc<CachePadded<Overflow>>,
}

impl BandLoot {
    /// The oldest job of those that are not in the overflow.
    fn steal(&self) -> Option<Job> {
        while !self.stealer.is_empty() {
            match self.stealer.steal() {
                Steal::Success(job) => return Some(job),
                Steal::Empty => break,
                // Another thief was faster, or the owner, and there may be more.
                Steal::Retry => {}
            }
        }
        None
    }

    pub(super) fn is_empty(&self) -> bool {
        self.stealer.is_empty() && self.overflow.is_empty()
    }

    pub(super) fn len(&self) -> usize {
        self.stealer.len() + self.overflow.len()
    }
}

struct Overflow {
    jobs: LockedQueue<Job>,
}

impl Overflow {
    fn new() -> Self {
        Self { jobs: LockedQueue::new() }
    }

    fn is_empty(&self) -> bool {
        self.jobs.is_empty()
    }

    fn len(&self) -> usize {
        self.jobs.len()
    }

    fn put(&self, job: Job) {
        self.jobs.put(job);
    }

    fn take_newest(&self) -> Option<Job> {
        self.jobs.change(VecDeque::pop_back)
    }

    /// Takes the oldest jobs, to spare others the lock: gives back the first, and calls `keep` with the others. Those are of
    /// an outermost region: no thief may [keep](super::worker::Worker::push) others.
    fn take_oldest(&self, keep: impl FnMut(Job)) -> Option<Job> {
        let (first, others) = self.jobs.change(|jobs| {
            let count = (jobs.len() / 2).min(MOST_AT_ONCE);
            let first = jobs.pop_front();
            let others: [Option<Job>; MOST_AT_ONCE] = array::from_fn(|place| {
                let may_keep = place < count && jobs.front().is_some_and(|job| job.region.is_outermost());
                if may_keep { jobs.pop_front() } else { None }
            });
            (first, others)
        });
        others.into_iter().flatten().for_each(keep);
        first
    }

    /// Some job of those that are wanted.
    fn take_any(&self, shuffle: &Shuffle, is_wanted: impl Fn(&Job) -> bool) -> Option<Job> {
        self.jobs.change(|jobs| {
            let wanted = jobs.iter().filter(|job| is_wanted(job)).count();
            let chosen = shuffle.below(wanted)?;
            let (place, _) = jobs.iter().enumerate().filter(|(_, job)| is_wanted(job)).nth(chosen)?;
            jobs.remove(place)
        })
    }
}

#[cfg(all(test, drawloom_loom))]
mod loom_tests {
    use loom::{model::Builder, thread};

    use super::{Job, Priority, Queues};
    use crate::task::{
        Scheduler, TokenContext, Tokens,
        job::Work,
        region::{self, Region},
    };

    struct NoTokens;

    impl Tokens for NoTokens {
        fn run(&self, _token: u64, _crew: &TokenContext<'_>) {
            unreachable!("the jobs are taken, and not run");
        }
    }

    fn token(job: Option<Job>) -> Option<u64> {
        job.map(|job| match job.work {
            Work::Token(token) => token,
            Work::Closure(_) => unreachable!("there are tokens only"),
        })
    }

    /// The owner pushes so many jobs, takes one back after `early` of them, and the rest at the end, while a thief is at it.
    /// Says what the owner took at the end, and what the thief took.
    fn share(region: &'static Region, jobs: u64, early: u64) -> (Option<u64>, Vec<u64>, Vec<u64>) {
        let queues = Queues::new(None);
        let loot = queues.loot();
        let thief = thread::spawn(move || {
            let own = Queues::new(None);
            let mut stolen: Vec<u64> = (0..3).filter_map(|_| token(own.steal_from(&loot, Priority::Normal))).collect();
            // What it took over beside those.
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
                region::open(worker, &NoTokens, |region| {
                    let (taken_early, taken, stolen) = share(region, jobs, early);
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
