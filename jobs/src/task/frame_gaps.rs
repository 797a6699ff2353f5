//! How long workers look for jobs between frames.
//!
//! A worker that looks for jobs costs processor time. One that sleeps must be woken, which costs the time of its waker
//! beside its own, and delays the next frame: [`max_spin_between_frames`] is the price of that in processor time. So a
//! worker looks for that long at most, and only while this costs less than a wake-up in gaps like the recent ones. This
//! is the rent-or-buy problem with the gaps before as a forecast (Karlin, Manasse, McGeoch and Owicki, "Competitive
//! randomized algorithms for nonuniform problems", 1994).
//!
//! So an engine that draws frame after frame finds its workers awake, and one that draws 60 frames a second lets them
//! sleep.

use std::time::Duration;

use crate::sync::{AtomicUsize, Instant, Mutex, Ordering};
use crate::tuning::{Estimate, Filter};

/// The longest time that workers look for jobs between frames, whatever wake-ups cost.
pub(crate) const MAX_SPIN_BETWEEN_FRAMES: Duration = Duration::from_micros(500);

/// An engine may call the scheduler several times a frame, so that short gaps and long ones alternate. A long gap is no
/// outlier, and its cost is limited anyway.
const GAPS: Filter = Filter::unlimited(8.0);

/// The gaps between recent frames, and what follows from them. A frame is whatever a thread from outside waits for
/// while others work: a parallel run, a loop or a scope.
pub(super) struct FrameGaps {
    history: Mutex<History>,
    /// How long workers look for jobs after a frame, in nanoseconds.
    spin: AtomicUsize,
}

#[derive(Default)]
struct History {
    /// When the latest frame ended.
    ended: Option<Instant>,
    cost: GapCost,
}

/// The nanoseconds of processor time that recent gaps would have cost a worker that looks for jobs in all of them.
#[derive(Clone, Copy, Debug, Default)]
struct GapCost(Estimate);

impl FrameGaps {
    pub(super) fn new() -> Self {
        Self { history: Mutex::new(History::default()), spin: AtomicUsize::new(0) }
    }

    /// How long workers look for jobs after the latest frame. A hint, so it is read and written relaxed.
    #[inline]
    pub(super) fn spin(&self) -> Duration {
        Duration::from_nanos(self.spin.load(Ordering::Relaxed) as u64)
    }

    /// A frame begins, on `workers` workers with this wake-up cost.
    pub(super) fn begin_frame(&self, now: Instant, workers: usize, wake_up_cost: Duration) {
        let (mut history, max_spin) = (self.history.lock(), max_spin_between_frames(workers, wake_up_cost));
        // While the wake-up cost is measured, it is 0.
        let Some(ended) = history.ended.filter(|_| !max_spin.is_zero()) else { return };
        let spin = history.cost.add(now.duration_since(ended), max_spin);
        self.spin.store(spin.as_nanos() as usize, Ordering::Relaxed);
    }

    /// A frame ends.
    pub(super) fn end_frame(&self, now: Instant) {
        self.history.lock().ended = Some(now);
    }
}

impl GapCost {
    /// Adds a gap. Returns how long workers should look for jobs in the next one: as long as they may, or not at all.
    fn add(&mut self, gap: Duration, max_spin: Duration) -> Duration {
        // A worker that has looked for jobs in vain must be woken nevertheless.
        let cost = if gap < max_spin { gap } else { max_spin * 2 };
        self.0.add(cost.as_nanos() as f32, GAPS);
        let average = self.0.get().unwrap_or_default();
        if average < max_spin.as_nanos() as f32 { max_spin } else { Duration::ZERO }
    }
}

/// The longest gap in which workers should look for jobs: 2 × `workers` × `wake_up_cost`, up to
/// [`MAX_SPIN_BETWEEN_FRAMES`].
///
/// Workers are woken one after the other (`sleep.rs`), so the average one begins ½ × `workers` wake-ups late. That
/// counts twice, because a wake-up occupies the processors of the waker and of the worker; and twice again, because the
/// frame is late as well.
pub(crate) fn max_spin_between_frames(workers: usize, wake_up_cost: Duration) -> Duration {
    let wake_ups = u32::try_from(2 * workers).unwrap_or(u32::MAX);
    wake_up_cost.saturating_mul(wake_ups).min(MAX_SPIN_BETWEEN_FRAMES)
}

/// Whether workers are awake after a gap, if these gaps have come before it, and the last of them is repeated.
#[cfg(feature = "report")]
pub(crate) fn are_awake_after(gaps: &[Duration], workers: usize, wake_up_cost: Duration) -> bool {
    let max_spin = max_spin_between_frames(workers, wake_up_cost);
    let mut cost = GapCost::default();
    let spin = gaps.iter().fold(Duration::ZERO, |_, &gap| cost.add(gap, max_spin));
    gaps.last().is_some_and(|&gap| gap < spin)
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use drawloom_signal::{ControllerBounds, check_controller};

    use super::*;

    /// Two workers may look for jobs for 40 µs.
    const WAKE_UP_COST: Duration = Duration::from_micros(10);

    /// An engine whose frames take no time.
    struct Engine {
        gaps: FrameGaps,
        now: Instant,
    }

    impl Engine {
        fn new() -> Self {
            let engine = Self { gaps: FrameGaps::new(), now: Instant::now() };
            engine.gaps.begin_frame(engine.now, 2, WAKE_UP_COST);
            engine
        }

        /// Draws a frame after a gap in microseconds. Returns for how many microseconds workers look for jobs
        /// afterwards.
        fn draw_after(&mut self, gap: f32) -> u128 {
            self.gaps.end_frame(self.now);
            self.now += Duration::from_nanos((gap * 1e3) as u64);
            self.gaps.begin_frame(self.now, 2, WAKE_UP_COST);
            self.gaps.spin().as_micros()
        }
    }

    /// How long workers look for jobs after each of these gaps, in microseconds.
    fn spins(gaps: impl IntoIterator<Item = u16>) -> Vec<u128> {
        let mut engine = Engine::new();
        gaps.into_iter().map(|gap| engine.draw_after(gap.into())).collect()
    }

    #[test]
    fn workers_stay_awake_between_frames_that_follow_at_once() {
        assert_eq!(FrameGaps::new().spin(), Duration::ZERO);
        assert_eq!(spins([15; 5]), [40; 5]);
        assert_eq!(spins([39; 5]), [40; 5]);
    }

    #[test]
    fn workers_sleep_at_once_between_frames_that_are_far_apart() {
        assert_eq!(spins([40, 100, 16_000, 16_000]), [0; 4]);
    }

    #[test]
    fn frames_while_the_wake_up_cost_is_unknown_do_not_count() {
        let mut engine = Engine::new();
        for _ in 0..10 {
            engine.gaps.end_frame(engine.now);
            engine.gaps.begin_frame(engine.now, 2, Duration::ZERO);
        }
        assert_eq!(engine.draw_after(16_000.0), 0);
    }

    #[test]
    fn a_single_long_gap_changes_nothing_and_several_do() {
        let spins = spins([15, 15, 16_000, 15, 16_000, 16_000, 16_000, 16_000, 16_000]);
        assert_eq!(spins[..4], [40; 4]);
        assert_eq!(spins.last(), Some(&0));
    }

    #[test]
    fn workers_stay_awake_in_alternate_gaps_only_if_the_short_ones_pay_for_the_long_ones() {
        let one_of_two = spins((0..100).map(|index| if index % 2 == 0 { 10 } else { 16_000 }));
        // A long gap costs 80 µs, and the limit is 40.
        assert_eq!(one_of_two[50..], [0; 50]);
        let three_of_four = spins((0..100).map(|index| if index % 4 == 0 { 16_000 } else { 10 }));
        assert_eq!(three_of_four[50..], [40; 50]);
    }

    #[test]
    #[cfg_attr(miri, ignore = "long, and calls no unsafe code")]
    fn it_settles_and_recovers_and_an_outlier_counts_briefly() {
        let bounds = ControllerBounds { settles_within: [1, 10, 10], max_wrong: 30, max_changes: 60 };
        check_controller(
            &bounds,
            Engine::new,
            |engine, is_after, signal| engine.draw_after(signal.sample(if is_after { 200.0 } else { 20.0 })) > 0,
            |&is_awake, is_after| is_awake != is_after,
        );
    }

    #[test]
    fn nobody_looks_for_jobs_for_longer_than_wake_ups_are_worth() {
        assert_eq!(max_spin_between_frames(2, WAKE_UP_COST).as_micros(), 40);
        assert_eq!(max_spin_between_frames(16, WAKE_UP_COST).as_micros(), 320);
        assert_eq!(max_spin_between_frames(1000, Duration::from_millis(5)), MAX_SPIN_BETWEEN_FRAMES);
        assert_eq!(max_spin_between_frames(1, Duration::ZERO), Duration::ZERO);
        assert_eq!(spins([60; 3]), [0; 3]);
    }
}
