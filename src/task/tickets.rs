//! Which worker runs which chunks of a loop or a node.

use std::ops::Range;

use super::chunks::Chunks;
use crate::sync::{AtomicBool, AtomicUsize, Instant, Ordering};
use crate::tuning::{Estimate, Filter};

/// Hands out the chunks of a loop or a node to the workers that have joined it. A ticket is a claim on some chunks.
///
/// A worker claims several chunks at a time, so that workers seldom contend, and fewer towards the end, so that they finish
/// together (guided self-scheduling: Polychronopoulos & Kuck, 1987). Claimed chunks cannot be stolen, so [`TicketSize`] limits how
/// long the chunks of one ticket take.
///
/// # Memory ordering
///
/// All accesses are relaxed. A ticket only decides who runs a chunk. The data that the chunk reads came with the job through
/// which the worker joined; the counter of finished chunks orders the data that it writes.
#[derive(Debug)]
pub(crate) struct Tickets {
    /// How many chunks are claimed: the position of the next one.
    claimed: AtomicUsize,
    /// Whether some queue holds a job through which another worker can join.
    has_invitation: AtomicBool,
    /// How many workers have joined.
    joined: AtomicUsize,
    /// The initial ticket size, learnt from the previous execution.
    initial_size: AtomicUsize,
}

impl Tickets {
    /// A value of `claimed` that is greater than the number of chunks can be.
    const CANCELLED: usize = usize::MAX;

    pub(crate) fn new() -> Self {
        Self {
            claimed: AtomicUsize::new(0),
            has_invitation: AtomicBool::new(false),
            joined: AtomicUsize::new(0),
            initial_size: AtomicUsize::new(1),
        }
    }

    /// Starts over, with the first `claimed` chunks claimed. No worker may be using the tickets.
    pub(crate) fn reset(&self, claimed: usize) {
        self.claimed.store(claimed, Ordering::Relaxed);
        self.has_invitation.store(false, Ordering::Relaxed);
        self.joined.store(0, Ordering::Relaxed);
    }

    /// Counts a worker in. Every worker but the first comes through an invitation.
    pub(crate) fn join(&self) -> TicketSize {
        self.has_invitation.store(false, Ordering::Relaxed);
        self.joined.fetch_add(1, Ordering::Relaxed);
        TicketSize::new(self.initial_size.load(Ordering::Relaxed))
    }

    /// Counts out a worker that leaves before all chunks are claimed. Returns true if it should queue a job through which another
    /// worker can join.
    pub(crate) fn leave(&self, chunks: &Chunks) -> bool {
        self.joined.fetch_sub(1, Ordering::Relaxed);
        self.claimed.load(Ordering::Relaxed) < chunks.count() && !self.has_invitation.swap(true, Ordering::Relaxed)
    }

    /// Claims the next chunks for one of `workers` workers: their positions in the order, empty if none are left. `now` reads the
    /// clock, which not every ticket does.
    pub(crate) fn take(
        &self,
        chunks: &Chunks,
        size: &mut TicketSize,
        workers: usize,
        now: impl Fn() -> Instant,
    ) -> Range<usize> {
        let mut claimed = self.claimed.load(Ordering::Relaxed);
        while claimed < chunks.count() {
            let remaining = chunks.count() - claimed;
            let end = claimed + size.of(remaining, workers);
            match self.claimed.compare_exchange_weak(claimed, end, Ordering::Relaxed, Ordering::Relaxed) {
                Ok(_) => {
                    if end - claimed > 1 || remaining > 2 * workers {
                        size.adapt(end - claimed, now);
                    }
                    return claimed..end;
                }
                Err(changed) => claimed = changed,
            }
        }
        // Measures the last ticket too: there may have been no other.
        if size.since.is_some() {
            size.measure(0, now);
        }
        if size.max != self.initial_size.load(Ordering::Relaxed) {
            self.initial_size.store(size.max, Ordering::Relaxed);
        }
        0..0
    }

    /// Claims all chunks that are left.
    pub(crate) fn take_rest(&self, chunks: &Chunks) -> Range<usize> {
        let claimed = self.claimed.swap(chunks.count(), Ordering::Relaxed);
        claimed.min(chunks.count())..chunks.count()
    }

    /// Whether one of `workers` workers, which has claimed the chunks up to `end`, should queue a job through which another
    /// worker can join.
    pub(crate) fn should_invite(&self, end: usize, chunks: &Chunks, workers: usize) -> bool {
        // The loads before the swap keep the cache line shared.
        end < chunks.count()
            && !self.has_invitation.load(Ordering::Relaxed)
            && self.joined.load(Ordering::Relaxed) < workers
            && !self.has_invitation.swap(true, Ordering::Relaxed)
    }

    /// Cancels all chunks that have not begun.
    pub(crate) fn cancel(&self) {
        self.claimed.store(Self::CANCELLED, Ordering::Relaxed);
    }

    /// Whether claimed chunks that have not begun must not begin.
    pub(crate) fn are_cancelled(&self) -> bool {
        self.claimed.load(Ordering::Relaxed) == Self::CANCELLED
    }
}

/// How many chunks a worker claims at once: one at first, more if the chunks before were quick.
#[derive(Debug)]
pub(crate) struct TicketSize {
    /// Nanoseconds per chunk.
    cost: Estimate,
    /// At least one.
    max: usize,
    /// The last reading of the clock, and how many chunks have been claimed since.
    since: Option<(Instant, usize)>,
    /// After how many chunks the clock is read again.
    measure_after: usize,
}

impl TicketSize {
    /// How many nanoseconds the chunks of one ticket may take: long enough that the ticket itself costs nothing beside them, and
    /// short enough that it does not matter who runs them.
    const TARGET_NANOSECONDS: f32 = 8_000.0;
    /// The smallest ticket is this fraction of the largest, even if less is left for each worker.
    const MIN_FRACTION: usize = 16;
    /// The latest chunks count alone, as the costs of chunks may differ much within a loop. But one cheap chunk says little about
    /// the rest, so a ticket is at most four times as large as the last one.
    const FILTER: Filter = Filter::rare(1.0).with_max_fall(4.0);
    /// How many chunks pass between two readings of the clock, once their cost is known.
    const STEADY: usize = 8;

    fn new(max: usize) -> Self {
        let cost = Estimate::settled_at(Self::TARGET_NANOSECONDS / max as f32);
        Self { cost, max, since: None, measure_after: 1 }
    }

    /// How many of the remaining chunks to claim: two thirds of this worker's share, within bounds.
    #[inline]
    fn of(&self, remaining: usize, workers: usize) -> usize {
        let share = 2 * (remaining / (3 * workers));
        share.clamp((self.max / Self::MIN_FRACTION).max(1), self.max).min(remaining)
    }

    /// The chunks of the last ticket are done, and `claimed` more begin.
    #[inline]
    fn adapt(&mut self, claimed: usize, now: impl FnOnce() -> Instant) {
        match &mut self.since {
            Some((_, chunks)) if *chunks < self.measure_after => *chunks += claimed,
            _ => self.measure(claimed, now),
        }
    }

    fn measure(&mut self, claimed: usize, now: impl FnOnce() -> Instant) {
        // In loom's models the clock is the real one, and says nothing about the modelled threads.
        if cfg!(drawloom_loom) {
            return;
        }
        let now = now();
        if let Some((since, chunks)) = self.since {
            let nanoseconds = (now.duration_since(since).as_nanos() as f32).max(1.0);
            self.cost.add(nanoseconds / chunks as f32, Self::FILTER);
            let fitting = Self::TARGET_NANOSECONDS / self.cost.get().unwrap_or(Self::TARGET_NANOSECONDS);
            self.max = (fitting as usize).max(1);
            self.measure_after = Self::STEADY;
        }
        self.since = Some((now, claimed));
    }
}

#[cfg(all(test, not(any(drawloom_loom, drawloom_shuttle))))]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::tuning::signal::{Requirements, check_controller};

    /// The cost of a chunk in nanoseconds.
    fn cost(is_after: bool) -> f32 {
        if is_after { 1000.0 } else { 50.0 }
    }

    #[test]
    fn it_settles_follows_outliers_briefly_and_recovers() {
        let requirements = Requirements { settles_within: 20, max_wrong: 250, max_changes: 1000 };
        check_controller(
            &requirements,
            || (TicketSize::new(1), Instant::now()),
            |(size, now), is_after, signal| {
                let claimed = size.of(1_000_000, 2);
                size.adapt(claimed, || *now);
                *now += Duration::from_nanos((signal.sample(cost(is_after)) * claimed as f32) as u64);
                claimed
            },
            |&claimed, is_after| {
                let ticket = cost(is_after) * claimed as f32;
                (TicketSize::TARGET_NANOSECONDS / 4.0..=TicketSize::TARGET_NANOSECONDS).contains(&ticket)
            },
        );
    }

    #[test]
    fn a_ticket_grows_fourfold_at_most() {
        let (mut size, now) = (TicketSize::new(1), Instant::now());
        let mut largest = 1;
        for step in 0..10 {
            let claimed = size.of(1_000_000, 2);
            assert!(claimed <= 4 * largest, "{claimed} after {largest}");
            largest = largest.max(claimed);
            size.adapt(claimed, || now + Duration::from_nanos(10 * step));
        }
        assert!(largest > 1000, "{largest}");
    }
}
