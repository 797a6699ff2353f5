//! The execution policy: whether a run is serial or parallel.
//!
//! Parallel execution costs wake-ups, and cache misses for every node that one worker makes ready and another runs. A
//! frame of little work is faster on one thread. So each schedule keeps track of how long its serial and its parallel
//! runs take, and chooses the shorter mode.

use std::time::Duration;

use crate::tuning::{Estimate, Filter, Hysteresis};

/// The measured runs of one schedule.
#[derive(Debug, Default)]
pub(crate) struct ExecutionPolicy {
    /// Nanoseconds of a serial run: measured as such, or as the work of the measured parallel runs.
    serial: Estimate,
    /// Nanoseconds of a parallel run, over the measured ones.
    parallel: Estimate,
    parallel_runs: u32,
    /// The number of runs since the last measured one.
    since_measured: u32,
    is_serial: bool,
    /// Rises with each serial run that exceeds its limit, and falls with each that does not.
    exceeded: u32,
    /// The mode that was chosen last, and by which costs.
    latest: Option<ModeChoice>,
}

/// How a run is executed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum RunMode {
    /// By the calling thread alone. A run that takes longer than the limit continues in parallel.
    Serial { limit: Option<Duration> },
    /// By all workers.
    Parallel { is_measured: bool },
}

/// The mode that was chosen for a run, and why.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeChoice {
    /// Whether all workers take part from the beginning. A serial run that takes too long continues in parallel.
    pub parallel: bool,
    /// Whether the mode was chosen only to measure it.
    pub is_trial: bool,
    /// The estimated time of a serial run in nanoseconds, before the run; `None` if it was not measured yet.
    pub serial_nanoseconds: Option<f32>,
    /// What the serial time is compared with, in nanoseconds: the estimated time of a parallel run, before the run, but
    /// at least the wake-up cost; the wake-up cost alone if no parallel run was measured yet.
    pub parallel_nanoseconds: f32,
}

/// This many of the first parallel runs are measured, except for the very first, which warms the caches; and then one
/// run in [`MEASURED_EVERY`].
const FIRST_MEASURED: u32 = 4;
const MEASURED_EVERY: u32 = 31;

/// A serial schedule with more work than a wake-up runs in parallel once in this many runs, to check that serial
/// execution is still faster. A trial that takes twice as long as a serial run costs less than a percent of the time.
const PARALLEL_EVERY: u32 = 128;

/// How many serial runs within their limit cancel one that exceeded it. Two that exceed it with fewer runs between them
/// are a sign that the frame's work has changed.
const EXCEEDED_RUNS: u32 = 8;

const SERIAL_RUNS: Filter = Filter::limiting_outliers(8.0);

/// The latest run counts most but not alone, because alternate frames may do different things.
const MEASURED_RUNS: Filter = Filter::unlimited(4.0 / 3.0);

const HYSTERESIS: Hysteresis = Hysteresis::new(1.25);

impl ExecutionPolicy {
    /// The policy of a schedule that takes the place of this one's, with work like its work: it begins with the same
    /// mode and times, and measures its own first runs.
    pub(crate) fn of_successor(&self) -> Self {
        let Self { serial, parallel, is_serial, .. } = *self;
        Self { serial, parallel, is_serial, ..Self::default() }
    }

    /// Chooses the mode of the next run.
    pub(crate) fn choose(&mut self, wake_up_cost: Duration) -> RunMode {
        let wake_up_cost = wake_up_cost.as_nanos() as f32;
        let serial = self.serial.get();
        // A run that takes less than a wake-up is worth no wake-up.
        let parallel = self.parallel.get().unwrap_or(0.0).max(wake_up_cost);
        let (mode, is_trial) = self.choose_by(serial, parallel, wake_up_cost);
        self.latest = Some(ModeChoice {
            parallel: matches!(mode, RunMode::Parallel { .. }),
            is_trial,
            serial_nanoseconds: serial,
            parallel_nanoseconds: parallel,
        });
        mode
    }

    /// Chooses by these times in nanoseconds. Returns the mode, and whether it is a trial.
    fn choose_by(&mut self, serial: Option<f32>, parallel: f32, wake_up_cost: f32) -> (RunMode, bool) {
        let is_unknown = serial.is_none() && self.parallel_runs == 0 && self.exceeded == 0;
        if is_unknown {
            // A run loses no more time than one wake-up takes.
            return (RunMode::Serial { limit: Some(Duration::from_nanos(wake_up_cost as u64)) }, true);
        }
        self.is_serial = match serial {
            None => false,
            Some(serial) if self.is_serial => !HYSTERESIS.replaces(parallel, serial),
            Some(serial) => HYSTERESIS.replaces(serial, parallel),
        };
        let is_due = serial.is_some_and(|serial| serial > wake_up_cost) && self.since_measured >= PARALLEL_EVERY;
        if self.is_serial && !is_due {
            let limit = parallel * 2.0 * HYSTERESIS.factor();
            return (RunMode::Serial { limit: Some(Duration::from_nanos(limit as u64)) }, false);
        }
        (self.parallel(), self.is_serial)
    }

    /// The mode of the next run if it must be parallel.
    pub(crate) fn parallel(&self) -> RunMode {
        let is_one_of_the_first = (1..=FIRST_MEASURED).contains(&self.parallel_runs);
        RunMode::Parallel { is_measured: is_one_of_the_first || self.since_measured >= MEASURED_EVERY - 1 }
    }

    /// Reports a serial run within its limit.
    pub(crate) fn report_serial(&mut self, took: Duration) {
        self.exceeded = self.exceeded.saturating_sub(1);
        self.since_measured = self.since_measured.saturating_add(1);
        self.serial.add(took.as_nanos() as f32, SERIAL_RUNS);
    }

    /// Reports a serial run that exceeded its limit and continued in parallel.
    pub(crate) fn report_exceeded(&mut self) {
        self.exceeded += EXCEEDED_RUNS;
        if self.exceeded > EXCEEDED_RUNS {
            // Keeping `exceeded` makes the next runs parallel and measured; a policy that knows nothing would start
            // serially.
            *self = Self { exceeded: EXCEEDED_RUNS, latest: self.latest, ..Self::default() };
        }
    }

    /// Reports a parallel run. `work` is the time of all workers together, if the run was measured.
    pub(crate) fn report_parallel(&mut self, took: Duration, work: Option<Duration>) {
        self.parallel_runs = self.parallel_runs.saturating_add(1);
        let Some(work) = work else {
            self.since_measured = self.since_measured.saturating_add(1);
            return;
        };
        if self.since_measured >= MEASURED_EVERY {
            // What was measured that long ago says nothing any more.
            (self.serial, self.parallel) = (Estimate::default(), Estimate::default());
        }
        self.since_measured = 0;
        // The same run estimates both modes: apart from the clock readings, a serial run takes as long as the work of
        // all workers.
        self.parallel.add(took.as_nanos() as f32, MEASURED_RUNS);
        self.serial.add(work.as_nanos() as f32, MEASURED_RUNS);
    }

    /// The mode that was chosen last; `None` before the first choice.
    pub(crate) fn latest(&self) -> Option<ModeChoice> {
        self.latest
    }
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use std::time::Duration;

    use drawloom_signal::{ControllerBounds, check_controller};

    use super::{ExecutionPolicy, RunMode};

    const WAKE_UP_COST: Duration = Duration::from_micros(40);

    /// Runs that take this many microseconds in each mode. Returns how many of the last ten were serial.
    fn run(policy: &mut ExecutionPolicy, runs: usize, serial: u64, parallel: u64) -> usize {
        let are_serial: Vec<bool> = (0..runs).map(|_| run_once(policy, serial, parallel)).collect();
        are_serial.iter().rev().take(10).filter(|&&is_serial| is_serial).count()
    }

    fn run_once(policy: &mut ExecutionPolicy, serial: u64, parallel: u64) -> bool {
        let [serial, parallel] = [serial, parallel].map(Duration::from_micros);
        match policy.choose(WAKE_UP_COST) {
            RunMode::Serial { limit } if limit.is_some_and(|limit| serial > limit) => policy.report_exceeded(),
            RunMode::Serial { .. } => {
                policy.report_serial(serial);
                return true;
            }
            RunMode::Parallel { is_measured } => policy.report_parallel(parallel, is_measured.then_some(serial)),
        }
        false
    }

    #[test]
    fn a_successor_begins_in_the_mode_that_was_faster() {
        for (serial, parallel) in [(100, 300), (900, 300)] {
            let mut policy = ExecutionPolicy::default();
            run(&mut policy, 50, serial, parallel);
            let mut successor = policy.of_successor();
            assert_eq!(run_once(&mut successor, serial, parallel), serial < parallel);
            assert!(successor.latest().is_some_and(|choice| !choice.is_trial));
        }
    }

    #[test]
    fn a_successor_keeps_a_mode_that_a_new_policy_would_not_choose() {
        let mut policy = ExecutionPolicy::default();
        run(&mut policy, 100, 50, 70);
        // Serial runs are faster, but not by enough to replace parallel ones.
        assert_eq!(run(&mut policy, 300, 50, 55), 10);
        assert!(run_once(&mut policy.of_successor(), 50, 55));
        assert_eq!(run(&mut ExecutionPolicy::default(), 300, 50, 55), 0);
    }

    #[test]
    #[cfg_attr(miri, ignore = "long, and calls no unsafe code")]
    fn it_settles_does_not_flap_and_recovers() {
        let bounds = ControllerBounds { settles_within: [100, 100, 200], max_wrong: 100, max_changes: 60 };
        check_controller(
            &bounds,
            ExecutionPolicy::default,
            |policy, is_after, signal| {
                let [serial, parallel] = if is_after { [2000.0, 1100.0] } else { [30.0, 60.0] };
                run_once(policy, signal.sample(serial) as u64, signal.sample(parallel) as u64)
            },
            |&is_serial, is_after| is_serial != is_after,
        );
    }

    #[test]
    fn the_faster_mode_is_chosen() {
        for (serial, parallel, serial_runs) in [(10, 30, 10), (35, 30, 0), (1700, 850, 0), (100, 500, 10)] {
            assert_eq!(run(&mut ExecutionPolicy::default(), 100, serial, parallel), serial_runs, "{serial} {parallel}");
        }
    }

    #[test]
    fn growing_work_becomes_parallel_and_shrinking_work_serial() {
        let mut policy = ExecutionPolicy::default();
        assert_eq!(run(&mut policy, 100, 10, 30), 10);
        assert_eq!(run(&mut policy, 20, 2_000, 1_000), 0);
        assert_eq!(run(&mut policy, 150, 10, 30), 10);
        // Too small a difference for a run to exceed its limit.
        assert_eq!(run(&mut policy, 100, 70, 45), 0);
    }

    #[test]
    fn a_slow_first_run_has_no_lasting_effect() {
        let mut policy = ExecutionPolicy::default();
        run(&mut policy, 1, 300_000, 300_000);
        assert_eq!(run(&mut policy, 20, 25_000, 3_300), 0);
    }

    #[test]
    fn the_first_run_may_take_one_wake_up_and_later_ones_two_and_a_half_parallel_runs() {
        let mut policy = ExecutionPolicy::default();
        assert_eq!(policy.choose(WAKE_UP_COST), RunMode::Serial { limit: Some(WAKE_UP_COST) });
        assert!(policy.latest().is_some_and(|choice| choice.is_trial));
        assert_eq!(run(&mut policy, 100, 100, 200), 10);
        assert_eq!(policy.choose(WAKE_UP_COST), RunMode::Serial { limit: Some(Duration::from_micros(500)) });
        assert!(policy.latest().is_some_and(|choice| !choice.is_trial));
    }

    #[test]
    fn the_mode_changes_only_for_one_that_is_faster_by_a_quarter() {
        for (parallel, serial_runs) in [(81, 10), (79, 0)] {
            let mut policy = ExecutionPolicy::default();
            assert_eq!(run(&mut policy, 100, 100, 140), 10);
            assert_eq!(run(&mut policy, 300, 100, parallel), serial_runs, "{parallel}");
        }
    }

    #[test]
    fn one_parallel_run_in_thirty_one_is_measured() {
        let mut policy = ExecutionPolicy::default();
        run(&mut policy, 100, 1_700, 850);
        let measured: Vec<usize> = (0..62)
            .filter(|_| {
                let mode = policy.choose(WAKE_UP_COST);
                run_once(&mut policy, 1_700, 850);
                mode == RunMode::Parallel { is_measured: true }
            })
            .collect();
        assert!(measured.len() == 2 && measured[1] - measured[0] == 31, "{measured:?}");
    }

    #[test]
    fn the_latest_choice_is_known_after_runs_that_exceed_their_limit() {
        let mut policy = ExecutionPolicy::default();
        policy.choose(WAKE_UP_COST);
        let choice = policy.latest();
        (0..3).for_each(|_| policy.report_exceeded());
        assert!(choice.is_some() && policy.latest() == choice);
    }

    #[test]
    fn one_outlier_does_not_change_the_mode() {
        let mut policy = ExecutionPolicy::default();
        assert_eq!(run(&mut policy, 100, 20, 60), 10);
        run_once(&mut policy, 5_000, 2_500);
        assert_eq!(run(&mut policy, 10, 20, 60), 10);
    }

    #[test]
    fn parallel_runs_that_become_faster_are_noticed() {
        let mut policy = ExecutionPolicy::default();
        assert_eq!(run(&mut policy, 100, 400, 500), 10);
        assert_eq!(run(&mut policy, 300, 400, 100), 0);
    }

    #[test]
    fn a_trial_replaces_what_was_measured_long_before() {
        let mut policy = ExecutionPolicy::default();
        run(&mut policy, 100, 400, 500);
        assert_eq!(run(&mut policy, 200, 400, 450), 10);
        assert!(policy.latest().is_some_and(|choice| choice.parallel_nanoseconds == 450_000.0));
    }

    #[test]
    fn the_latest_measured_run_counts_most_but_not_alone() {
        let mut policy = ExecutionPolicy::default();
        for microseconds in [100, 200] {
            policy.report_parallel(Duration::from_micros(microseconds), Some(Duration::from_micros(1_000)));
        }
        policy.choose(WAKE_UP_COST);
        let parallel = policy.latest().expect("a mode was chosen").parallel_nanoseconds;
        assert!(150_000.0 < parallel && parallel < 200_000.0, "{parallel}");
    }

    #[test]
    fn work_as_long_as_a_wake_up_is_never_tried_in_parallel() {
        let (mut policy, wake_up) = (ExecutionPolicy::default(), WAKE_UP_COST.as_micros() as u64);
        assert_eq!(run(&mut policy, 100, wake_up, 100), 10);
        assert!((0..300).all(|_| run_once(&mut policy, wake_up, 100)));
    }

    /// At a thousand frames a second, the counters saturate after 50 days.
    #[test]
    fn saturated_counters_do_not_overflow() {
        let mut policy =
            ExecutionPolicy { parallel_runs: u32::MAX, since_measured: u32::MAX, ..ExecutionPolicy::default() };
        policy.report_parallel(WAKE_UP_COST, None);
        policy.report_serial(WAKE_UP_COST);
        assert_eq!((policy.parallel_runs, policy.since_measured), (u32::MAX, u32::MAX));
        assert_eq!(policy.parallel(), RunMode::Parallel { is_measured: true });
        assert_eq!(run(&mut policy, 100, 1_700, 850), 0);
    }

    #[test]
    fn alternating_long_frames_are_noticed() {
        let mut policy = ExecutionPolicy::default();
        assert_eq!(run(&mut policy, 100, 10, 30), 10);
        let exceeded = (0..100).filter(|_| {
            let before = policy.exceeded;
            run_once(&mut policy, 2_000, 1_000);
            let has_exceeded = policy.exceeded > before;
            run_once(&mut policy, 10, 30);
            has_exceeded
        });
        assert!(exceeded.count() < 20);
    }
}
