//! Whether a run is worth sharing between workers.
//!
//! To share costs wake-ups, and cache lines that travel with every node that one worker makes ready and another runs. A
//! frame of little work is done sooner by the thread that has it. So each schedule remembers how long it took by itself and
//! how long shared, and how much work it is, and goes the way that is shorter.

use std::time::Duration;

/// What has been seen of a schedule's runs.
#[derive(Debug, Default)]
pub(crate) struct Sharing {
    /// Nanoseconds on one thread: of late, or in the runs that were measured.
    alone: Option<f64>,
    /// Nanoseconds on all workers, in the runs that were measured.
    shared: Option<f64>,
    /// How many runs have been shared, and how many runs there were since the last one that was measured.
    shared_runs: u32,
    since_measured: u32,
    is_alone: bool,
    /// Rises with each run that was too long to be finished alone, and falls with those that were not.
    given_up: u32,
}

/// How a run is to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Way {
    /// On the calling thread, unless there is a limit and it takes longer than that.
    Alone { at_most: Option<Duration> },
    /// On all workers.
    Shared { is_measured: bool },
}

/// So many of the first shared runs are measured, though not the very first, which sets up what the others find; and later
/// ones every now and then.
const FIRST_MEASURED: u32 = 4;
const MEASURED_EVERY: u32 = 31;

/// How often a schedule is shared that goes alone, though it is more work than a wake-up, to see whether that still is
/// better. Each time costs what it is spared at other times.
const SHARED_EVERY: u32 = 128;

/// What a run that was given up counts, in runs that were not. Two of them so close together are a sign that the frame has
/// become another one.
const GIVEN_UP: u32 = 8;

/// The part of the latest run in an average, and how many times the average it may be: once in a while the system takes the
/// processor away, which says nothing of the next frame.
const WEIGHT: f64 = 0.125;
const OUTLIER: f64 = 2.0;

/// How much longer the way that was gone may be before it is left.
const RELUCTANCE: f64 = 1.25;

impl Sharing {
    /// The way of the next run, where a worker is woken at that price.
    pub(crate) fn choose(&mut self, wake_up_cost: Duration) -> Way {
        let knows_nothing = self.alone.is_none() && self.shared_runs == 0 && self.given_up == 0;
        if knows_nothing {
            // What is less work than a wake-up shows it at once, and nobody is woken. All else loses no more than that.
            return Way::Alone { at_most: Some(wake_up_cost) };
        }
        let wake_up_cost = wake_up_cost.as_nanos() as f64;
        let limit = self.shared.unwrap_or(0.0).max(wake_up_cost);
        self.is_alone = match self.alone {
            None => false,
            Some(alone) if self.is_alone => alone <= limit * RELUCTANCE,
            Some(alone) => alone * RELUCTANCE <= limit,
        };
        let is_doubtful = self.alone.is_some_and(|alone| alone > wake_up_cost) && self.since_measured >= SHARED_EVERY;
        if self.is_alone && !is_doubtful {
            return Way::Alone { at_most: Some(Duration::from_nanos((limit * 2.0 * RELUCTANCE) as u64)) };
        }
        self.share()
    }

    /// The way of the next run if it is to be shared in any case.
    pub(crate) fn share(&self) -> Way {
        let is_one_of_the_first = (1..=FIRST_MEASURED).contains(&self.shared_runs);
        Way::Shared { is_measured: is_one_of_the_first || self.since_measured >= MEASURED_EVERY - 1 }
    }

    /// A run went alone and took that long.
    pub(crate) fn went_alone(&mut self, took: Duration) {
        self.given_up = self.given_up.saturating_sub(1);
        self.since_measured = self.since_measured.saturating_add(1);
        average(&mut self.alone, took);
    }

    /// A run was begun alone, and shared when it was found too long.
    pub(crate) fn gave_up(&mut self) {
        self.given_up += GIVEN_UP;
        if self.given_up > GIVEN_UP {
            // Not as if nothing were known: the next runs are shared, and measured.
            *self = Self { given_up: GIVEN_UP, ..Self::default() };
        }
    }

    /// A run was shared and took that long; where it was measured, all workers' time on it is known.
    pub(crate) fn was_shared(&mut self, took: Duration, work: Option<Duration>) {
        self.shared_runs = self.shared_runs.saturating_add(1);
        let Some(work) = work else {
            self.since_measured = self.since_measured.saturating_add(1);
            return;
        };
        let has_measured = self.since_measured < MEASURED_EVERY && self.shared_runs > 2;
        self.since_measured = 0;
        // Both ways are known from the same runs, the last of them counting most and not all, as frames may take turns in what they do.
        // What they took in all would be what they take alone, were there no clocks to be read.
        for (known, latest) in [(&mut self.shared, took), (&mut self.alone, work)] {
            let latest = latest.as_nanos() as f64;
            *known = Some(known.filter(|_| has_measured).map_or(latest, |known| (known + 3.0 * latest) / 4.0));
        }
    }
}

fn average(average: &mut Option<f64>, latest: Duration) {
    let latest = latest.as_nanos() as f64;
    *average = Some(match *average {
        None => latest,
        Some(average) => average + WEIGHT * (latest.min(average * OUTLIER) - average),
    });
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use std::time::Duration;

    use super::{Sharing, Way};

    const PRICE: Duration = Duration::from_micros(40);

    /// Runs that take so many microseconds alone and so many shared. Says how many of the last ten went alone.
    fn run(sharing: &mut Sharing, runs: usize, alone: u64, shared: u64) -> usize {
        let ways: Vec<bool> = (0..runs).map(|_| run_once(sharing, alone, shared)).collect();
        ways.iter().rev().take(10).filter(|&&is_alone| is_alone).count()
    }

    fn run_once(sharing: &mut Sharing, alone: u64, shared: u64) -> bool {
        let [alone, shared] = [alone, shared].map(Duration::from_micros);
        match sharing.choose(PRICE) {
            Way::Alone { at_most } if at_most.is_some_and(|at_most| alone > at_most) => sharing.gave_up(),
            Way::Alone { .. } => {
                sharing.went_alone(alone);
                return true;
            }
            Way::Shared { is_measured } => sharing.was_shared(shared, is_measured.then_some(alone)),
        }
        false
    }

    #[test]
    fn the_shorter_way_is_gone() {
        for (alone, shared, goes_alone) in [(10, 30, 10), (35, 30, 0), (1700, 850, 0), (100, 500, 10)] {
            assert_eq!(run(&mut Sharing::default(), 100, alone, shared), goes_alone, "{alone} {shared}");
        }
    }

    #[test]
    fn work_that_grows_is_shared_and_work_that_shrinks_is_not() {
        let mut sharing = Sharing::default();
        assert_eq!(run(&mut sharing, 100, 10, 30), 10);
        assert_eq!(run(&mut sharing, 20, 2_000, 1_000), 0);
        assert_eq!(run(&mut sharing, 150, 10, 30), 10);
        // By so little that no run is given up.
        assert_eq!(run(&mut sharing, 100, 70, 45), 0);
    }

    #[test]
    fn a_slow_first_run_is_forgotten() {
        let mut sharing = Sharing::default();
        run(&mut sharing, 1, 300_000, 300_000);
        assert_eq!(run(&mut sharing, 20, 25_000, 3_300), 0);
    }

    #[test]
    fn a_run_that_the_system_disturbed_changes_nothing() {
        let mut sharing = Sharing::default();
        assert_eq!(run(&mut sharing, 100, 20, 60), 10);
        run_once(&mut sharing, 5_000, 2_500);
        assert_eq!(run(&mut sharing, 10, 20, 60), 10);
    }

    #[test]
    fn what_came_to_be_worth_sharing_at_the_same_work_is_found_out() {
        let mut sharing = Sharing::default();
        assert_eq!(run(&mut sharing, 100, 400, 500), 10);
        assert_eq!(run(&mut sharing, 300, 400, 100), 0);
    }

    /// At a thousand frames a second that is after 50 days.
    #[test]
    fn more_runs_than_can_be_counted_change_nothing() {
        let mut sharing = Sharing { shared_runs: u32::MAX, since_measured: u32::MAX, ..Sharing::default() };
        sharing.was_shared(PRICE, None);
        sharing.went_alone(PRICE);
        assert_eq!((sharing.shared_runs, sharing.since_measured), (u32::MAX, u32::MAX));
        assert_eq!(sharing.share(), Way::Shared { is_measured: true });
        assert_eq!(run(&mut sharing, 100, 1_700, 850), 0);
    }

    #[test]
    fn every_other_frame_being_long_is_noticed() {
        let mut sharing = Sharing::default();
        assert_eq!(run(&mut sharing, 100, 10, 30), 10);
        let given_up = (0..100).filter(|_| {
            let before = sharing.given_up;
            run_once(&mut sharing, 2_000, 1_000);
            let gave_up = sharing.given_up > before;
            run_once(&mut sharing, 10, 30);
            gave_up
        });
        assert!(given_up.count() < 20);
    }
}
