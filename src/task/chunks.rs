//! How a range is cut into chunks, and who takes which.

use std::ops::Range;

use crate::sync::{AtomicBool, AtomicUsize, Instant, Ordering};

use super::worker::Worker;

/// The indices from 0 up to a length, cut into chunks of one size, of which the last may be shorter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chunks {
    length: usize,
    size: usize,
    count: usize,
    /// The chunk that is the `place`-th to be run is number `(first + place × step) mod count`.
    first: usize,
    step: usize,
}

/// The most chunks: half of what fits into a number, so that there are numbers left that stand for none.
const MOST_CHUNKS: usize = usize::MAX / 2;

impl Chunks {
    /// A size of 0 is taken for 1.
    #[inline]
    pub(crate) fn new(length: usize, size: usize) -> Self {
        let size = if length > MOST_CHUNKS { size.max(length.div_ceil(MOST_CHUNKS)) } else { size.max(1) };
        // Most are one chunk, and a division costs more than all the rest of it.
        let count = if length <= size { usize::from(length > 0) } else { length.div_ceil(size) };
        Self { length, size, count, first: 0, step: 1 }
    }

    /// The same chunks, in an order that this worker draws if the scheduler is to shuffle.
    pub(crate) fn shuffled(self, worker: &Worker) -> Self {
        let (Some(first), Some(step)) = (worker.draw(self.count), worker.draw(self.count)) else { return self };
        // Every chunk is met once if step and count have no common divisor.
        let step = (step..self.count).find(|&step| greatest_common_divisor(step, self.count) == 1).unwrap_or(1);
        Self { first, step, ..self }
    }

    #[inline]
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// The indices of the chunk that is the `place`-th to be run.
    #[inline]
    pub(crate) fn range(&self, place: usize) -> Range<usize> {
        let number = if self.step == 1 && self.first == 0 {
            place
        } else {
            ((self.first as u128 + place as u128 * self.step as u128) % self.count as u128) as usize
        };
        let start = number * self.size;
        start..start.saturating_add(self.size).min(self.length)
    }
}

fn greatest_common_divisor(one: usize, other: usize) -> usize {
    if other == 0 { one } else { greatest_common_divisor(other, one % other) }
}

/// Who takes which chunks of a pass: each worker some at a time, so that they seldom meet, and fewer and fewer towards the
/// end, so that they end together (guided self-scheduling: Polychronopoulos & Kuck, 1987). What a worker has taken nobody
/// takes off it, so its [`Pace`] sees to it that this is not much.
///
/// # Memory ordering
///
/// All is relaxed. A ticket only says whose the chunks are; what they need came with the job through which the worker
/// came here, and what they leave is for whoever counts them to order.
#[derive(Debug)]
pub(crate) struct Tickets {
    taken: AtomicUsize,
    /// Whether a job lies in somebody's queue through which another worker can join.
    is_open: AtomicBool,
    /// How many workers have joined.
    joined: AtomicUsize,
    /// The pace of whoever last took many at once, in this pass or one before.
    pace: AtomicUsize,
}

impl Tickets {
    /// More than there can be chunks.
    const REVOKED: usize = usize::MAX;

    pub(crate) fn new() -> Self {
        Self {
            taken: AtomicUsize::new(0),
            is_open: AtomicBool::new(false),
            joined: AtomicUsize::new(0),
            pace: AtomicUsize::new(1),
        }
    }

    /// Starts over, with so many chunks taken. Nobody else may be at it.
    pub(crate) fn reset(&self, taken: usize) {
        self.taken.store(taken, Ordering::Relaxed);
        self.is_open.store(false, Ordering::Relaxed);
        self.joined.store(0, Ordering::Relaxed);
    }

    /// Counts one more worker in, which has been invited unless it was the first.
    pub(crate) fn join(&self) -> Pace {
        self.is_open.store(false, Ordering::Relaxed);
        self.joined.fetch_add(1, Ordering::Relaxed);
        Pace::new(self.pace.load(Ordering::Relaxed))
    }

    /// Counts a worker out that does something else before all chunks are taken. Says whether it should queue a job through
    /// which another can join.
    pub(crate) fn leave(&self, chunks: &Chunks) -> bool {
        self.joined.fetch_sub(1, Ordering::Relaxed);
        self.taken.load(Ordering::Relaxed) < chunks.count && !self.is_open.swap(true, Ordering::Relaxed)
    }

    /// The places of the next chunks for a worker, one of so many, to run. There are none if it is empty. `now` tells the
    /// time, which is not asked at every ticket.
    pub(crate) fn take(
        &self,
        chunks: &Chunks,
        pace: &mut Pace,
        workers: usize,
        now: impl Fn() -> Instant,
    ) -> Range<usize> {
        let mut taken = self.taken.load(Ordering::Relaxed);
        while taken < chunks.count {
            let remaining = chunks.count - taken;
            let end = taken + pace.of(remaining, workers);
            match self.taken.compare_exchange_weak(taken, end, Ordering::Relaxed, Ordering::Relaxed) {
                Ok(_) => {
                    if end - taken > 1 || remaining > 2 * workers {
                        pace.adapt(end - taken, now);
                    }
                    return taken..end;
                }
                Err(changed) => taken = changed,
            }
        }
        // How long the last ones took, too: there may have been no others.
        if pace.since.is_some() {
            pace.look(0, now);
        }
        if pace.most != self.pace.load(Ordering::Relaxed) {
            self.pace.store(pace.most, Ordering::Relaxed);
        }
        0..0
    }

    /// The places of all chunks that nobody has taken.
    pub(crate) fn take_rest(&self, chunks: &Chunks) -> Range<usize> {
        let taken = self.taken.swap(chunks.count, Ordering::Relaxed);
        taken.min(chunks.count)..chunks.count
    }

    /// Whether a worker, one of so many, that has taken the chunks before `end` should queue a job through which another can
    /// join.
    pub(crate) fn invites(&self, end: usize, chunks: &Chunks, workers: usize) -> bool {
        // The looks before the swap spare the others the cache line.
        end < chunks.count
            && !self.is_open.load(Ordering::Relaxed)
            && self.joined.load(Ordering::Relaxed) < workers
            && !self.is_open.swap(true, Ordering::Relaxed)
    }

    /// Leaves no chunk to be taken.
    pub(crate) fn revoke(&self) {
        self.taken.store(Self::REVOKED, Ordering::Relaxed);
    }

    /// Whether chunks that were taken and have not begun are not to begin.
    pub(crate) fn are_revoked(&self) -> bool {
        self.taken.load(Ordering::Relaxed) == Self::REVOKED
    }
}

/// How many chunks a worker takes at once: one at first, and more if those before were soon done.
#[derive(Debug)]
pub(crate) struct Pace {
    /// Never less than one.
    most: usize,
    /// When the time was last asked, and how many chunks have been taken since.
    since: Option<(Instant, usize)>,
    /// After how many chunks it is asked again.
    look_after: usize,
}

impl Pace {
    /// How many nanoseconds the chunks of one ticket may take: long enough for the ticket to cost nothing beside them, and so
    /// short that it is no matter who runs them.
    const WORTH: usize = 8_000;
    /// The part of that which is worth a ticket even if less than that is left for each worker.
    const LEAST: usize = 16;
    /// By how much more than the last time may be taken: one cheap chunk says little about the rest.
    const GROWTH: usize = 4;
    /// How many chunks go by without asking the time, once it is known.
    const STEADY: usize = 8;

    fn new(most: usize) -> Self {
        Self { most, since: None, look_after: 1 }
    }

    /// How many to take of so many: two thirds of what is this worker's share, within bounds.
    #[inline]
    fn of(&self, remaining: usize, workers: usize) -> usize {
        let share = 2 * (remaining / (3 * workers));
        share.clamp((self.most / Self::LEAST).max(1), self.most).min(remaining)
    }

    /// So many more have been taken, and begin; those before are done.
    #[inline]
    fn adapt(&mut self, taken: usize, now: impl FnOnce() -> Instant) {
        match &mut self.since {
            Some((_, chunks)) if *chunks < self.look_after => *chunks += taken,
            _ => self.look(taken, now),
        }
    }

    fn look(&mut self, taken: usize, now: impl FnOnce() -> Instant) {
        // In loom's models time is real, and tells nothing.
        if cfg!(drawloom_loom) {
            return;
        }
        let now = now();
        if let Some((since, chunks)) = self.since {
            let nanoseconds = (now.duration_since(since).as_nanos() as usize).max(1);
            let fitting = chunks.saturating_mul(Self::WORTH) / nanoseconds;
            self.most = fitting.clamp(1, self.most.max(chunks.saturating_mul(Self::GROWTH)));
            self.look_after = Self::STEADY;
        }
        self.since = Some((now, taken));
    }
}
