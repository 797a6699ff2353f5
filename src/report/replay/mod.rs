//! The time of a frame on so many workers.

mod costs;
mod crew;
mod prices;
mod run;

#[cfg(all(test, not(drawloom_loom)))]
mod sketch;

use std::time::Duration;

use crate::{
    graph::{ExecutionPolicy, RankedAdjacency, RunMode},
    task::Scheduler,
    timeline::{Log, Run},
};

use self::{
    costs::Costs,
    run::{Outcome, Replays},
};
use super::{
    consistency::check_run,
    error::ReportError,
    moments::{length, outermost, own_time, union},
};

pub use self::prices::Prices;

/// What was recorded of a frame, to be run again by the scheduler's rules on a clock of its own, by any number of workers. The
/// same record and prices always give the same times.
///
/// It stands for one of many such frames, one after another: workers are asleep when it begins, and schedules have
/// learnt what their processes cost and whether they are worth sharing.
///
/// Where several workers ran, chunks have waited for each other's locks and cache lines. So a record of one worker tells best
/// what one worker takes, and what many could take at best; one of several workers tells better what those take. Where chunks
/// are shorter than half a microsecond, recording disturbs them, and all times come out too long.
#[derive(Clone, Debug)]
pub struct Replay {
    runs: Vec<Costs>,
    serial: Duration,
    prices: Prices,
}

/// A frame as it would be.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Replayed {
    /// How long it takes, with what is [serial](Replay::serial).
    pub time: Duration,
    /// Whether the calling thread runs all of it alone, as that is faster.
    pub alone: bool,
    /// How long each worker is in chunks; what is serial is left out.
    pub busy: Vec<Duration>,
}

/// In how many runs a schedule comes to know which way is shorter.
const RUNS_TO_SETTLE: usize = 64;

/// How often a run is measured for the next to know what its processes cost.
const RUNS_TO_LEARN: usize = 3;

impl Replay {
    /// A replay of one run of a schedule.
    ///
    /// # Errors
    ///
    /// [`ReportError::Incomplete`], [`ReportError::Failed`] or [`ReportError::Contradictory`] if the run is.
    pub fn new(run: &Run, prices: Prices) -> Result<Self, ReportError> {
        Self::of_runs([run], Duration::ZERO, prices)
    }

    /// A replay of the frame of that number: its runs one after another, and what its threads did outside of them.
    ///
    /// # Errors
    ///
    /// [`ReportError`], whose variants say when.
    pub fn of_frame(log: &Log, frame: u64, prices: Prices) -> Result<Self, ReportError> {
        let runs = outermost(log, frame);
        if runs.is_empty() {
            return Err(ReportError::NoRun { frame });
        }
        let of_runs = union(runs.iter().map(|run| run.began..run.ended));
        let serial = length(&own_time(log, frame, &runs)).saturating_sub(length(&of_runs));
        Self::of_runs(runs, serial, prices)
    }

    fn of_runs<'log>(
        runs: impl IntoIterator<Item = &'log Run>,
        serial: Duration,
        prices: Prices,
    ) -> Result<Self, ReportError> {
        let costs = |run: &Run| match run {
            Run { failed: true, frame, .. } => Err(ReportError::Failed { frame: *frame }),
            Run { complete: false, frame, .. } => Err(ReportError::Incomplete { frame: *frame }),
            Run { frame, .. } if check_run(run, "it", run.workers).is_err() => {
                Err(ReportError::Contradictory { frame: *frame })
            }
            _ => Ok(Costs::new(run, &prices)),
        };
        Ok(Self { runs: runs.into_iter().map(costs).collect::<Result<_, _>>()?, serial, prices })
    }

    /// Adds what the calling thread does before the runs or after them, while the others have nothing to do.
    pub fn serial(mut self, time: Duration) -> Self {
        self.serial += time;
        self
    }

    /// The same frame with nothing to do for the processes of that [group](crate::timeline::Process::group), which is the name
    /// of a render process, say. They are there still, and wait for what they depend on.
    pub fn with_free(mut self, group: &str) -> Self {
        self.runs.iter_mut().for_each(|run| run.empty(group));
        self
    }

    /// How long the frame takes on so many workers, as in [`run`](Self::run).
    pub fn frame_time(&self, workers: usize) -> Duration {
        self.run(workers).time
    }

    /// The frame on so many workers: 0 is taken for 1, and more than [`Scheduler::MAX_WORKERS`] for that many.
    pub fn run(&self, workers: usize) -> Replayed {
        let workers = workers.clamp(1, Scheduler::MAX_WORKERS);
        let mut all = Replayed { time: self.serial, alone: true, busy: vec![Duration::ZERO; workers] };
        for costs in &self.runs {
            let one = self.run_one(costs, workers);
            all.time += one.time;
            all.alone &= one.alone;
            all.busy.iter_mut().zip(one.busy).for_each(|(sum, busy)| *sum += busy);
        }
        all
    }

    fn run_one(&self, costs: &Costs, workers: usize) -> Replayed {
        let alone = costs.alone(&self.prices);
        if workers > 1 {
            let shared = self.share(costs, workers);
            if costs.always_parallel || !goes_alone(alone, shared.time, &self.prices) {
                return replayed(false, shared.time, shared.busy);
            }
        }
        let mut busy = vec![0; workers];
        busy[0] = costs.work();
        replayed(true, alone, busy)
    }

    fn share(&self, costs: &Costs, workers: usize) -> Outcome {
        let mut adjacency = RankedAdjacency::new(&costs.dependencies);
        let replays = Replays::new(costs, &self.prices, workers);
        for _run in 0..RUNS_TO_LEARN {
            let costs: Vec<u64> = replays.run(&adjacency).processes.iter().map(|span| span.end - span.start).collect();
            adjacency.rank(&costs);
        }
        replays.run(&adjacency)
    }
}

fn replayed(alone: bool, time: u64, busy: Vec<u64>) -> Replayed {
    let busy = busy.into_iter().map(Duration::from_nanos).collect();
    Replayed { time: Duration::from_nanos(time), alone, busy }
}

/// Whether a schedule that takes so many nanoseconds on one thread, or on all workers, comes to be run by one.
fn goes_alone(alone: u64, shared: u64, prices: &Prices) -> bool {
    let [alone, shared] = [alone, shared].map(Duration::from_nanos);
    let mut policy = ExecutionPolicy::default();
    let mut is_alone = false;
    for _run in 0..RUNS_TO_SETTLE {
        let mode = policy.choose(prices.wake);
        is_alone = matches!(mode, RunMode::Serial { limit } if limit.is_none_or(|limit| alone <= limit));
        match mode {
            RunMode::Serial { .. } if is_alone => policy.report_serial(alone),
            RunMode::Serial { .. } => policy.report_exceeded(),
            RunMode::Parallel { is_measured } => policy.report_parallel(shared, is_measured.then_some(alone)),
        }
    }
    is_alone
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use std::time::Duration;

    use proptest::prelude::*;

    use super::sketch::{Sketch, any_sketch};
    use super::{Prices, Replay, Replayed, Scheduler};

    fn micros(count: u64) -> Duration {
        Duration::from_micros(count)
    }

    /// A worker is woken 30 µs before it begins, 10 of which are the waker's.
    fn dear_wakes() -> Prices {
        Prices { wake: micros(30), waker: micros(10), ..Prices::FREE }
    }

    fn replay(sketch: &Sketch, prices: Prices) -> Replay {
        Replay::new(&sketch.run(&prices), prices).unwrap()
    }

    fn times<const COUNT: usize>(replay: &Replay, workers: [usize; COUNT]) -> [Duration; COUNT] {
        workers.map(|workers| replay.frame_time(workers))
    }

    #[test]
    fn a_chain_takes_as_long_on_any_number_of_workers() {
        let chain = Sketch::new().add(&[], &[100]).add(&[0], &[200]).add(&[1], &[300]);
        assert_eq!(times(&replay(&chain, Prices::FREE), [0, 1, 2, 64]), [micros(600); 4]);
        let prices = Prices { process: micros(2), process_alone: micros(1), chunk: micros(4), ..dear_wakes() };
        assert_eq!(times(&replay(&chain, prices), [1, 2, 64]), [micros(615), micros(618), micros(618)]);
    }

    #[test]
    fn a_wide_pass_is_divided_among_all() {
        let pass = Sketch::new().add(&[], &[10; 64]);
        let expected = [640, 320, 160, 80, 40, 20, 10].map(micros);
        assert_eq!(times(&replay(&pass, Prices::FREE), [1, 2, 4, 8, 16, 32, 64]), expected);
        // On two workers the first begins at 10 µs and the second at 30. On four the others begin at 40, 70 and 90, since all
        // but the last wake somebody before they begin.
        assert_eq!(times(&replay(&pass, dear_wakes()), [1, 2, 4]), [640, 340, 220].map(micros));
        // Each of 32 chunks begins with a ticket.
        let prices = Prices { ticket: micros(1), chunk: micros(1), ..Prices::FREE };
        assert_eq!(times(&replay(&pass, prices), [1, 2]), [704, 384].map(micros));
    }

    #[test]
    fn chunks_that_are_short_go_many_to_a_ticket() {
        let pass = Sketch::new().add(&[], &[1; 4_000]);
        let prices = Prices { ticket: micros(1), ..Prices::FREE };
        // Seven chunks and their ticket are 8 µs, so each of the two draws 286 tickets, and some at both ends for fewer.
        let time = replay(&pass, prices).frame_time(2);
        assert!((micros(2_286)..micros(2_350)).contains(&time), "{time:?}");
    }

    #[test]
    fn the_longer_of_two_branches_is_what_is_waited_for() {
        let fork = Sketch::new().add(&[], &[10]).add(&[0], &[100]).add(&[0], &[300]).add(&[1, 2], &[20]);
        assert_eq!(times(&replay(&fork, Prices::FREE), [1, 2, 3]), [430, 330, 330].map(micros));
        // Who wakes the other goes on with the longer one.
        let replayed = replay(&fork, dear_wakes()).run(2);
        let expected = Replayed { time: micros(340), alone: false, busy: vec![micros(330), micros(100)] };
        assert_eq!(replayed, expected);
        // The second begins 5 µs after it has come, and still has time.
        let prices = Prices { steal: micros(5), ..dear_wakes() };
        assert_eq!(replay(&fork, prices).frame_time(2), micros(340));
    }

    #[test]
    fn what_is_less_work_than_a_wake_up_stays_on_one_thread() {
        let small = (0..5).fold(Sketch::new(), |sketch, _| sketch.add(&[], &[2, 2]));
        for workers in [1, 2, 8] {
            let mut busy = vec![micros(0); workers];
            busy[0] = micros(20);
            assert_eq!(replay(&small, dear_wakes()).run(workers), Replayed { time: micros(20), alone: true, busy });
        }
        let mut shared = small.run(&Prices::FREE);
        shared.always_parallel = true;
        assert!(!Replay::new(&shared, dear_wakes()).unwrap().run(2).alone);
        assert!(!replay(&small, Prices::FREE).run(2).alone);
    }

    #[test]
    fn what_is_pinned_runs_on_the_calling_thread() {
        let pinned = Sketch::new().add_pinned(&[], &[50, 50]).add_pinned(&[], &[100]).add(&[], &[150]);
        let replayed = replay(&pinned, Prices::FREE).run(2);
        assert_eq!(replayed, Replayed { time: micros(200), alone: false, busy: vec![micros(200), micros(150)] });
    }

    #[test]
    fn a_calling_thread_that_has_gone_to_sleep_is_woken_at_the_end() {
        let sketch = Sketch::new().add(&[], &[10]).add_pinned(&[0], &[100]).add(&[0], &[50]).add(&[2], &[500]);
        // The other worker comes at 40 µs, and has 550 to do; the calling thread has nothing to do from 120 µs on.
        assert_eq!(replay(&sketch, dear_wakes()).frame_time(2), micros(590 + 30));
        // With a shorter tail it still looks.
        let sketch = Sketch::new().add(&[], &[10]).add_pinned(&[0], &[100]).add(&[0], &[50]).add(&[2], &[50]);
        let prices = Prices { steal: micros(3), ..dear_wakes() };
        assert_eq!(replay(&sketch, prices).frame_time(2), micros(43 + 100 + 3));
    }

    #[test]
    fn who_looks_for_work_gets_it_at_once() {
        let sketch = Sketch::new().add(&[], &[10]).add(&[0], &[100]).add(&[0], &[60]).add(&[1], &[50]).add(&[1], &[50]);
        // The other worker has nothing to do from 100 µs on, and at 120 two become ready.
        let prices = Prices { silence: micros(5), ..dear_wakes() };
        assert_eq!(times(&replay(&sketch, prices), [2, 3]), [micros(170); 2]);
        // Who has not looked for long does not count, so a third one is woken for nothing.
        let prices = Prices { silence: micros(25), ..prices };
        assert_eq!(times(&replay(&sketch, prices), [2, 3]), [170, 180].map(micros));
    }

    #[test]
    fn who_looks_in_silence_still_has_the_time_that_a_wake_up_takes() {
        let sketch = Sketch::new().add(&[], &[10]).add(&[0], &[100]).add(&[0], &[40]).add(&[1], &[50]).add(&[1], &[50]);
        // The other worker has nothing to do from 80 µs on, and at 120 two become ready.
        let prices = Prices { silence: micros(20), ..dear_wakes() };
        assert_eq!(replay(&sketch, prices).frame_time(2), micros(170));
        let prices = Prices { silence: micros(5), ..dear_wakes() };
        assert_eq!(replay(&sketch, prices).frame_time(2), micros(200));
    }

    #[test]
    fn one_worker_at_a_time_is_woken_and_wakes_the_next() {
        let sketch = Sketch::new().add(&[], &[10]).add(&[], &[200]).add(&[0], &[200]).add(&[0], &[100]);
        // At 20 µs, when there is more to do, the second is on its way. It comes at 30, wakes the third, and begins at 40.
        let replayed = replay(&sketch, dear_wakes()).run(3);
        assert_eq!(replayed.time, micros(240));
        assert_eq!(replayed.busy, [210, 200, 100].map(micros));
    }

    #[test]
    fn what_is_serial_is_added() {
        let pass = Sketch::new().add(&[], &[10; 64]);
        let replay = replay(&pass, Prices::FREE).serial(micros(7)).serial(micros(3));
        assert_eq!(times(&replay, [1, 2]), [650, 330].map(micros));
    }

    #[test]
    fn what_notes_take_is_left_out() {
        let run = Sketch::new().add(&[], &[10; 4]).run(&Prices::FREE);
        let prices = Prices { note: micros(1), ..Prices::FREE };
        assert_eq!(Replay::new(&run, prices).unwrap().frame_time(1), micros(36));
    }

    #[test]
    fn there_are_no_more_workers_than_a_scheduler_may_have() {
        let pass = Sketch::new().add(&[], &[10; 64]);
        let replay = replay(&pass, Prices::FREE);
        assert_eq!(replay.run(usize::MAX), replay.run(Scheduler::MAX_WORKERS));
    }

    #[test]
    fn prices_without_end_leave_all_work_to_one_thread() {
        let pass = Sketch::new().add(&[], &[10; 64]).add(&[0], &[10; 64]);
        let ever = Duration::MAX;
        let prices =
            Prices { wake: ever, waker: ever, steal: ever, silence: ever, ticket: ever, process: ever, ..Prices::FREE };
        assert_eq!(times(&replay(&pass, prices), [1, 2, 64]), [micros(1280); 3]);
    }

    #[test]
    fn no_work_takes_no_time() {
        assert_eq!(times(&replay(&Sketch::new(), Prices::FREE), [1, 2]), [Duration::ZERO; 2]);
        assert_eq!(times(&replay(&Sketch::new().add(&[], &[]), Prices::FREE), [1, 2]), [Duration::ZERO; 2]);
    }

    /// The longest way through the graph, where a process takes as long as `cost` says.
    fn longest_way(sketch: &Sketch, cost: impl Fn(&[u64]) -> u64) -> Duration {
        let mut ends: Vec<u64> = Vec::new();
        for process in &sketch.processes {
            let start = process.dependencies.iter().map(|&dependency| ends[dependency]).max().unwrap_or(0);
            ends.push(start + cost(&process.chunks));
        }
        micros(ends.into_iter().max().unwrap_or(0))
    }

    fn sum(chunks: &[u64]) -> u64 {
        chunks.iter().sum()
    }

    fn price() -> impl Strategy<Value = Duration> {
        prop_oneof![Just(Duration::ZERO), (0..40_u64).prop_map(micros)]
    }

    proptest! {
        #[test]
        fn free_runs_are_within_the_bounds_of_any_that_keeps_workers_busy(
            sketch in any_sketch(false),
            workers in 1..12_usize,
        ) {
            let work = micros(sketch.processes.iter().map(|process| sum(&process.chunks)).sum());
            let replay = replay(&sketch, Prices::FREE);
            prop_assert_eq!(replay.frame_time(1), work);
            let time = replay.frame_time(workers);
            prop_assert!(time >= longest_way(&sketch, |chunks| chunks.iter().copied().max().unwrap_or(0)));
            prop_assert!(time * workers as u32 >= work);
            // Graham, "Bounds on Multiprocessing Timing Anomalies", 1969.
            prop_assert!(time <= work / workers as u32 + longest_way(&sketch, sum));
        }

        #[test]
        fn runs_at_any_price_are_within_bounds(
            sketch in any_sketch(true),
            workers in 2..12_usize,
            prices in [price(), price(), price(), price(), price(), price()],
        ) {
            let [wake, waker, steal, silence, ticket, process] = prices;
            let prices = Prices { wake, waker, steal, silence, ticket, process, ..Prices::FREE };
            let work = micros(sketch.processes.iter().map(|process| sum(&process.chunks)).sum());
            let mut run = sketch.run(&prices);
            let replay = Replay::new(&run, prices).unwrap();
            let replayed = replay.run(workers);
            prop_assert_eq!(&replayed, &replay.run(workers), "another time");
            prop_assert_eq!(replayed.busy.iter().sum::<Duration>(), work);
            prop_assert!(replayed.busy.iter().all(|&busy| busy <= replayed.time));
            let pinned = sketch.processes.iter().filter(|process| process.pinned);
            prop_assert!(replayed.busy[0] >= micros(pinned.map(|process| sum(&process.chunks)).sum()));
            prop_assert!(replayed.time >= longest_way(&sketch, |chunks| chunks.iter().copied().max().unwrap_or(0)));
            prop_assert!(replayed.time * workers as u32 >= work);
            // Who has the choice does not take a way that is much longer.
            prop_assert!(replayed.time <= replay.frame_time(1).mul_f64(1.25) + micros(1));
            run.always_parallel = true;
            let steps = (run.graph.processes.len() + run.chunks.len() + workers) as u32;
            let most = work + (wake + waker * 2 + steal + ticket + process) * steps;
            prop_assert!(Replay::new(&run, prices).unwrap().frame_time(workers) <= most);
        }
    }
}
