//! Which worker runs which chunks of a loop or a node.

use std::ops::Range;

use super::chunks::Chunks;
use crate::sync::{AtomicBool, AtomicUsize, Instant, Ordering};

/// Hands out the chunks of a loop or a node to the workers that have joined it. A ticket is a claim on some chunks.
///
/// A worker claims several chunks at a time, so that workers seldom contend, and fewer towards the end, so that they
/// finish together (guided self-scheduling: Polychronopoulos & Kuck, 1987). Claimed chunks cannot be stolen, so
/// [`TicketSize`] limits how long the chunks of one ticket take.
///
/// # Memory ordering
///
/// All accesses are relaxed. A ticket only decides who runs a chunk. The data that the chunk reads came with the job
/// through which the worker joined; the counter of finished chunks orders the data that it writes.
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

    /// Counts out a worker that leaves before all chunks are claimed. Returns true if it should queue a job through
    /// which another worker can join.
    pub(crate) fn leave(&self, chunks: &Chunks) -> bool {
        self.joined.fetch_sub(1, Ordering::Relaxed);
        self.claimed.load(Ordering::Relaxed) < chunks.count() && !self.has_invitation.swap(true, Ordering::Relaxed)
    }

    /// Claims the next chunks for one of `workers` workers: their positions in the order, empty if none are left. `now`
    /// reads the clock, which not every ticket does.
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
            let end = claimed + size.chunks_to_claim(remaining, workers);
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

    /// Whether one of `workers` workers, which has claimed the chunks up to `end`, should queue a job through which
    /// another worker can join.
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
    /// At least one.
    max: usize,
    /// The last reading of the clock, and how many chunks have been claimed since.
    since: Option<(Instant, usize)>,
    /// After how many chunks the clock is read again.
    measure_after: usize,
}

impl TicketSize {
    /// How many nanoseconds the chunks of one ticket may take: long enough that the ticket itself costs nothing beside
    /// them, and short enough that it does not matter who runs them.
    const TARGET_NANOSECONDS: usize = 8_000;
    /// The smallest ticket is the largest divided by this, even if less is left for each worker.
    const MIN_SIZE_DIVISOR: usize = 16;
    /// The factor by which a ticket may exceed the last one: one cheap chunk says little about the rest.
    const GROWTH: usize = 4;
    /// How many chunks pass between two readings of the clock, once their cost is known.
    const CHUNKS_PER_MEASUREMENT: usize = 8;

    fn new(max: usize) -> Self {
        Self { max, since: None, measure_after: 1 }
    }

    /// How many of the remaining chunks to claim: two thirds of this worker's share, within bounds.
    #[inline]
    fn chunks_to_claim(&self, remaining: usize, workers: usize) -> usize {
        let share = 2 * (remaining / (3 * workers));
        share.clamp((self.max / Self::MIN_SIZE_DIVISOR).max(1), self.max).min(remaining)
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
            let nanoseconds = (now.duration_since(since).as_nanos() as usize).max(1);
            let fitting = chunks.saturating_mul(Self::TARGET_NANOSECONDS) / nanoseconds;
            self.max = fitting.clamp(1, self.max.max(chunks.saturating_mul(Self::GROWTH)));
            self.measure_after = Self::CHUNKS_PER_MEASUREMENT;
        }
        self.since = Some((now, claimed));
    }
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use std::time::Duration;

    use drawloom_signal::{ControllerBounds, Signal, check_controller};

    use super::*;

    /// A worker that takes tickets of an endless loop.
    struct Simulation {
        size: TicketSize,
        now: Instant,
    }

    impl Simulation {
        fn new() -> Self {
            Self { size: TicketSize::new(1), now: Instant::now() }
        }

        /// Takes a ticket of chunks that take these nanoseconds each, and returns their number.
        fn take(&mut self, nanoseconds: f32) -> usize {
            let claimed = self.size.chunks_to_claim(1_000_000, 2);
            self.size.adapt(claimed, || self.now);
            self.now += Duration::from_nanos((nanoseconds * claimed as f32) as u64);
            claimed
        }
    }

    fn nanoseconds(is_after: bool) -> f32 {
        if is_after { 1000.0 } else { 50.0 }
    }

    #[test]
    #[cfg_attr(miri, ignore = "long, and calls no unsafe code")]
    fn it_settles_and_recovers_and_an_outlier_counts_briefly() {
        let bounds = ControllerBounds { settles_within: [20; 3], max_wrong: 250, max_changes: 60 };
        check_controller(
            &bounds,
            Simulation::new,
            |simulation, is_after, signal| {
                let ticket = simulation.take(signal.sample(nanoseconds(is_after))) as f32 * nanoseconds(is_after);
                let target = TicketSize::TARGET_NANOSECONDS as f32;
                (target / 4.0..=target).contains(&ticket)
            },
            |&is_right, _| is_right,
        );
    }

    #[test]
    fn a_ticket_is_at_most_four_times_as_large_as_all_before_it() {
        let mut simulation = Simulation::new();
        let (mut largest, mut total) = (1, 1);
        for _ in 0..30 {
            let claimed = simulation.take(1.0);
            assert!(claimed <= 4 * total, "{claimed} after {total}");
            (largest, total) = (largest.max(claimed), total + claimed);
        }
        assert!(largest > 4000, "{largest}");
    }

    #[test]
    fn tickets_are_large_again_soon_after_a_costly_chunk() {
        let mut simulation = Simulation::new();
        simulation.take(1_000_000.0);
        let chunks: usize = (0..).map(|_| simulation.take(50.0)).take_while(|&claimed| claimed < 100).sum();
        assert!(chunks < 100, "{chunks}");
        let mut signal = Signal::new(1);
        assert!((0..20).all(|_| simulation.take(signal.sample(50.0)) >= 100));
    }
}
