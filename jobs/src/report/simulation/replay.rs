//! The replay of a frame.

use std::time::Duration;

use super::measured_run::MeasuredRun;
use super::run::{Outcome, Simulation};
use super::scheduler_costs::SchedulerCosts;
use crate::graph::{ExecutionPolicy, RankedAdjacency, RunMode};
use crate::report::consistency::check_run;
use crate::report::error::ReportError;
use crate::report::intervals::{frame_intervals, gaps_up_to, outermost_runs, total_length, union};
use crate::task::{Scheduler, are_awake_after};
use crate::timeline::{Log, Run};

/// A recorded frame, to be replayed by any number of workers: by the scheduler's rules, on a simulated clock. The same
/// record and costs always give the same times.
///
/// A replay stands for one of many such frames, one after another: schedules have learnt how long their nodes take and
/// whether it is worth running them in parallel. Workers are awake when a run begins if they would have looked for jobs
/// for that long after the run before, by the gaps between the runs of the log up to there. So a log of a single frame
/// has them asleep, and loops and scopes that the engine ran between its frames are not known.
///
/// A renderer with `Granularity::Adaptive` cuts a frame by what its items cost and by the number of workers. Such
/// [nodes](crate::timeline::NodeInfo::chunked_by_cost) are cut anew for the workers of the replay, by the rule of the
/// renderer, as if its estimates were the costs of the recorded frame, into 65,536 chunks at most. The time of a
/// recorded chunk is spread evenly over its items; what it costs whatever its size is not known apart. All other nodes
/// keep their chunks. So do the stages that sort, instance or bin the objects of a pass, which a renderer divides by
/// rules of their own.
///
/// Where several workers ran, chunks have waited for each other's locks and cache lines. So a record of one worker is
/// best for predicting the time on one worker, and a lower bound for many. A record of several workers is better for
/// predicting the time on as many. Where chunks are shorter than half a microsecond, recording disturbs them, and all
/// predicted times are too long.
#[derive(Clone, Debug)]
pub struct Replay {
    runs: Vec<RunOfLog>,
    serial: Duration,
    costs: SchedulerCosts,
}

/// A run, and when the runs of its log before it ended.
#[derive(Clone, Debug)]
struct RunOfLog {
    measured: MeasuredRun,
    /// The gaps between the runs up to this one: see [`gaps_up_to`].
    gaps: Vec<Duration>,
}

/// The outcome of a replay.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ReplayedFrame {
    /// How long the frame takes, including its [serial time](Replay::with_serial_time).
    pub time: Duration,
    /// Whether the calling thread executes all runs serially, because that is faster.
    pub serial: bool,
    /// The number of chunks that the frame is cut into.
    pub chunks: usize,
    /// How long each worker is in chunks, without the serial time.
    pub busy: Vec<Duration>,
}

/// After this many runs a schedule knows whether it is shorter serial or parallel.
const RUNS_TO_SETTLE: usize = 64;

/// After this many runs a schedule knows how long its nodes take.
const RUNS_TO_LEARN: usize = 3;

impl Replay {
    /// A replay of one run of a schedule.
    ///
    /// # Errors
    /// Returns [`ReportError::Incomplete`], [`ReportError::Failed`] or [`ReportError::Contradictory`] if the run is.
    pub fn new(run: &Run, costs: SchedulerCosts) -> Result<Self, ReportError> {
        Self::of_runs([(run, Vec::new())], Duration::ZERO, costs)
    }

    /// A replay of the frame of that number: its runs one after another, and what its threads did outside of them.
    ///
    /// # Errors
    /// Returns a [`ReportError`] under the conditions that its variants describe.
    pub fn of_frame(log: &Log, frame: u64, costs: SchedulerCosts) -> Result<Self, ReportError> {
        let runs = outermost_runs(log, frame);
        if runs.is_empty() {
            return Err(ReportError::NoRun { frame });
        }
        let of_runs = union(runs.iter().map(|run| run.began..run.ended));
        let of_frame = frame_intervals(log, frame, &runs);
        let serial = total_length(&of_frame).saturating_sub(total_length(&of_runs));
        Self::of_runs(runs.into_iter().map(|run| (run, gaps_up_to(log, run))), serial, costs)
    }

    fn of_runs<'log>(
        runs: impl IntoIterator<Item = (&'log Run, Vec<Duration>)>,
        serial: Duration,
        costs: SchedulerCosts,
    ) -> Result<Self, ReportError> {
        let costs = costs.bounded();
        let measured = |(run, gaps): (&Run, Vec<Duration>)| match run {
            Run { failed: true, frame, .. } => Err(ReportError::Failed { frame: *frame }),
            Run { complete: false, frame, .. } => Err(ReportError::Incomplete { frame: *frame }),
            Run { frame, .. } if check_run(run, "the run", run.workers).is_err() => {
                Err(ReportError::Contradictory { frame: *frame })
            }
            _ => Ok(RunOfLog { measured: MeasuredRun::new(run, &costs), gaps }),
        };
        Ok(Self { runs: runs.into_iter().map(measured).collect::<Result<_, _>>()?, serial, costs })
    }

    /// Adds time in which the calling thread works before or after the runs, while the other workers have nothing to
    /// do.
    pub fn with_serial_time(mut self, time: Duration) -> Self {
        self.serial = self.serial.saturating_add(time);
        self
    }

    /// The same frame without the work of a [group](crate::timeline::NodeInfo::group), for example of a render process.
    /// The nodes of the group remain, and wait for their dependencies.
    pub fn without_work_of(mut self, group: &str) -> Self {
        self.runs.iter_mut().for_each(|run| run.measured.remove_work_of(group));
        self
    }

    /// How long the frame takes on this many workers, as in [`run`](Self::run).
    pub fn frame_time(&self, workers: usize) -> Duration {
        self.run(workers).time
    }

    /// Replays the frame on this many workers, clamped to 1 to [`Scheduler::MAX_WORKERS`].
    pub fn run(&self, workers: usize) -> ReplayedFrame {
        let workers = workers.clamp(1, Scheduler::MAX_WORKERS);
        let mut frame =
            ReplayedFrame { time: self.serial, serial: true, chunks: 0, busy: vec![Duration::ZERO; workers] };
        for RunOfLog { measured, gaps } in &self.runs {
            let are_awake = are_awake_after(gaps, workers, self.costs.wake);
            let replayed = self.replay(&measured.cut_for(workers), workers, are_awake);
            frame.chunks += replayed.chunks;
            frame.time = frame.time.saturating_add(replayed.time);
            frame.serial &= replayed.serial;
            frame.busy.iter_mut().zip(replayed.busy).for_each(|(sum, busy)| *sum += busy);
        }
        frame
    }

    fn replay(&self, run: &MeasuredRun, workers: usize, are_awake: bool) -> ReplayedFrame {
        let serial_time = run.serial_time(&self.costs);
        if workers > 1 {
            let parallel = self.simulate(run, workers, are_awake);
            if run.always_parallel || !chooses_serial(serial_time, parallel.time, &self.costs) {
                return replayed(run, false, parallel.time, parallel.busy);
            }
        }
        let mut busy = vec![0; workers];
        busy[0] = run.work();
        replayed(run, true, serial_time, busy)
    }

    /// Simulates the parallel run of a schedule that knows how long its nodes take.
    fn simulate(&self, run: &MeasuredRun, workers: usize, are_awake: bool) -> Outcome {
        let mut adjacency = RankedAdjacency::new(&run.dependencies);
        let simulation = Simulation::new(run, &self.costs, workers, are_awake);
        for _run in 0..RUNS_TO_LEARN {
            let spans = simulation.run(&adjacency).node_spans;
            let costs: Vec<u64> = spans.iter().map(|span| span.end - span.start).collect();
            adjacency.rank(&|node| costs[node]);
        }
        simulation.run(&adjacency)
    }
}

fn replayed(run: &MeasuredRun, serial: bool, time: u64, busy: Vec<u64>) -> ReplayedFrame {
    let busy = busy.into_iter().map(Duration::from_nanos).collect();
    ReplayedFrame { time: Duration::from_nanos(time), serial, chunks: run.chunk_count(), busy }
}

/// Whether the policy chooses serial execution for these two times, in nanoseconds.
fn chooses_serial(serial: u64, parallel: u64, costs: &SchedulerCosts) -> bool {
    let [serial, parallel] = [serial, parallel].map(Duration::from_nanos);
    let mut policy = ExecutionPolicy::default();
    let mut is_serial = false;
    for _run in 0..RUNS_TO_SETTLE {
        let mode = policy.choose(costs.wake);
        is_serial = matches!(mode, RunMode::Serial { limit } if limit.is_none_or(|limit| serial <= limit));
        match mode {
            RunMode::Serial { .. } if is_serial => policy.report_serial(serial),
            RunMode::Serial { .. } => policy.report_exceeded(),
            RunMode::Parallel { is_measured } => policy.report_parallel(parallel, is_measured.then_some(serial)),
        }
    }
    is_serial
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use std::time::Duration;

    use proptest::prelude::*;

    use super::super::test_run::{TestNode, TestRun, any_test_run};
    use super::{Replay, ReplayedFrame, Scheduler, SchedulerCosts};

    fn micros(count: u64) -> Duration {
        Duration::from_micros(count)
    }

    /// A worker is woken 30 µs before it begins. The waker is busy for 10 of them.
    fn costly_wake_ups() -> SchedulerCosts {
        SchedulerCosts { wake: micros(30), waker: micros(10), ..SchedulerCosts::ZERO }
    }

    fn replay(test_run: &TestRun, costs: SchedulerCosts) -> Replay {
        Replay::new(&test_run.run(&costs), costs).unwrap()
    }

    fn times<const COUNT: usize>(replay: &Replay, workers: [usize; COUNT]) -> [Duration; COUNT] {
        workers.map(|workers| replay.frame_time(workers))
    }

    #[test]
    fn a_chain_takes_as_long_on_any_number_of_workers() {
        let chain = TestRun::new().add(&[], &[100]).add(&[0], &[200]).add(&[1], &[300]);
        assert_eq!(times(&replay(&chain, SchedulerCosts::ZERO), [0, 1, 2, 64]), [micros(600); 4]);
        let costs = SchedulerCosts { node: micros(2), node_serial: micros(1), chunk: micros(4), ..costly_wake_ups() };
        assert_eq!(times(&replay(&chain, costs), [1, 2, 64]), [micros(615), micros(618), micros(618)]);
    }

    #[test]
    fn a_wide_node_is_divided_among_all_workers() {
        let wide = TestRun::new().add(&[], &[10; 64]);
        let expected = [640, 320, 160, 80, 40, 20, 10].map(micros);
        assert_eq!(times(&replay(&wide, SchedulerCosts::ZERO), [1, 2, 4, 8, 16, 32, 64]), expected);
        // On two workers the first begins at 10 µs and the second at 30. On four the others begin at 40, 70 and 90,
        // since all but the last wake another worker before they begin.
        assert_eq!(times(&replay(&wide, costly_wake_ups()), [1, 2, 4]), [640, 340, 220].map(micros));
        // Each of 32 chunks begins with a ticket.
        let costs = SchedulerCosts { ticket: micros(1), chunk: micros(1), ..SchedulerCosts::ZERO };
        assert_eq!(times(&replay(&wide, costs), [1, 2]), [704, 384].map(micros));
    }

    #[test]
    fn workers_are_awake_when_a_run_begins_that_follows_another_at_once() {
        let run = TestRun::new().add(&[], &[10; 64]).run(&SchedulerCosts::ZERO);
        let after = |gaps: &[u64]| {
            let gaps = gaps.iter().copied().map(micros).collect();
            let replay = Replay::of_runs([(&run, gaps)], Duration::ZERO, costly_wake_ups()).unwrap();
            times(&replay, [1, 2, 4])
        };
        assert_eq!(after(&[119]), [640, 320, 160].map(micros));
        // It is worth more to four workers, who would be woken one after the other.
        assert_eq!(after(&[120]), [640, 340, 160].map(micros));
        for gaps in [&[][..], &[240], &[10, 10, 16_000], &[16_000, 16_000, 10]] {
            assert_eq!(after(gaps), [640, 340, 220].map(micros), "{gaps:?}");
        }
    }

    #[test]
    fn nodes_that_are_chunked_by_cost_are_cut_for_the_workers_of_the_replay() {
        // 1,000 items of 1 µs. On 16 workers 66 chunks of 15 items, and one of 10: five for each of three workers.
        let by_cost = replay(&TestRun::new().add_by_cost("fill", 1_000, &[1_000]), SchedulerCosts::ZERO);
        let of = |replay: &Replay| [1, 16].map(|workers| replay.run(workers)).map(|frame| (frame.chunks, frame.time));
        assert_eq!(of(&by_cost), [(1, micros(1_000)), (67, micros(75))]);
        assert_eq!(of(&by_cost.without_work_of("fill")), [(0, micros(0)); 2]);
        let fixed = replay(&TestRun::new().add(&[], &[1_000]), SchedulerCosts::ZERO);
        assert_eq!(of(&fixed), [(1, micros(1_000)); 2]);
        // Each of the 67 chunks, and each ticket, has its cost.
        let costs = SchedulerCosts { ticket: micros(1), chunk: micros(1), ..SchedulerCosts::ZERO };
        let by_cost = replay(&TestRun::new().add_by_cost("fill", 1_000, &[1_000]), costs);
        assert_eq!(of(&by_cost), [(1, micros(1_001)), (67, micros(75 + 5 * 2))]);
    }

    #[test]
    fn one_ticket_takes_many_short_chunks() {
        let wide = TestRun::new().add(&[], &[1; 4_000]);
        let costs = SchedulerCosts { ticket: micros(1), ..SchedulerCosts::ZERO };
        // Seven chunks and their ticket take 8 µs, so each of the two workers draws 286 tickets, and some for fewer
        // chunks at both ends.
        let time = replay(&wide, costs).frame_time(2);
        assert!((micros(2_286)..micros(2_350)).contains(&time), "{time:?}");
    }

    #[test]
    fn the_longer_of_two_branches_determines_the_time() {
        let fork = TestRun::new().add(&[], &[10]).add(&[0], &[100]).add(&[0], &[300]).add(&[1, 2], &[20]);
        assert_eq!(times(&replay(&fork, SchedulerCosts::ZERO), [1, 2, 3]), [430, 330, 330].map(micros));
        // The worker that wakes the other goes on with the longer branch.
        let replayed = replay(&fork, costly_wake_ups()).run(2);
        let expected =
            ReplayedFrame { time: micros(340), serial: false, chunks: 4, busy: vec![micros(330), micros(100)] };
        assert_eq!(replayed, expected);
        // The second worker begins 5 µs after it has woken up, and still finishes first.
        let costs = SchedulerCosts { steal: micros(5), ..costly_wake_ups() };
        assert_eq!(replay(&fork, costs).frame_time(2), micros(340));
    }

    #[test]
    fn a_run_shorter_than_a_wake_up_stays_on_one_thread() {
        let small = (0..5).fold(TestRun::new(), |test_run, _| test_run.add(&[], &[2, 2]));
        for workers in [1, 2, 8] {
            let mut busy = vec![micros(0); workers];
            busy[0] = micros(20);
            assert_eq!(
                replay(&small, costly_wake_ups()).run(workers),
                ReplayedFrame { time: micros(20), serial: true, chunks: 10, busy }
            );
        }
        let mut parallel = small.run(&SchedulerCosts::ZERO);
        parallel.always_parallel = true;
        assert!(!Replay::new(&parallel, costly_wake_ups()).unwrap().run(2).serial);
        assert!(!replay(&small, SchedulerCosts::ZERO).run(2).serial);
    }

    #[test]
    fn pinned_nodes_run_on_the_calling_thread() {
        let pinned = TestRun::new().add_pinned(&[], &[50, 50]).add_pinned(&[], &[100]).add(&[], &[150]);
        let replayed = replay(&pinned, SchedulerCosts::ZERO).run(2);
        assert_eq!(
            replayed,
            ReplayedFrame { time: micros(200), serial: false, chunks: 4, busy: vec![micros(200), micros(150)] }
        );
    }

    #[test]
    fn a_sleeping_calling_thread_is_woken_at_the_end() {
        let test_run = TestRun::new().add(&[], &[10]).add_pinned(&[0], &[100]).add(&[0], &[50]).add(&[2], &[500]);
        // The other worker begins at 40 µs with 550 µs of work. The calling thread has nothing to do from 120 µs on.
        assert_eq!(replay(&test_run, costly_wake_ups()).frame_time(2), micros(590 + 30));
        // With a shorter tail the calling thread still searches.
        let test_run = TestRun::new().add(&[], &[10]).add_pinned(&[0], &[100]).add(&[0], &[50]).add(&[2], &[50]);
        let costs = SchedulerCosts { steal: micros(3), ..costly_wake_ups() };
        assert_eq!(replay(&test_run, costs).frame_time(2), micros(43 + 100 + 3));
    }

    #[test]
    fn a_searching_worker_takes_new_work_at_once() {
        let test_run =
            TestRun::new().add(&[], &[10]).add(&[0], &[100]).add(&[0], &[60]).add(&[1], &[50]).add(&[1], &[50]);
        // The other worker has nothing to do from 100 µs on, and at 120 two nodes become ready.
        let costs = SchedulerCosts { uncounted_search: micros(5), ..costly_wake_ups() };
        assert_eq!(times(&replay(&test_run, costs), [2, 3]), [micros(170); 2]);
        // A worker in its uncounted search does not count as searching, so a third one is woken in vain.
        let costs = SchedulerCosts { uncounted_search: micros(25), ..costs };
        assert_eq!(times(&replay(&test_run, costs), [2, 3]), [170, 180].map(micros));
    }

    #[test]
    fn after_its_uncounted_search_a_worker_searches_as_long_as_a_wake_up_takes() {
        let test_run =
            TestRun::new().add(&[], &[10]).add(&[0], &[100]).add(&[0], &[40]).add(&[1], &[50]).add(&[1], &[50]);
        // The other worker has nothing to do from 80 µs on, and at 120 two nodes become ready.
        let costs = SchedulerCosts { uncounted_search: micros(20), ..costly_wake_ups() };
        assert_eq!(replay(&test_run, costs).frame_time(2), micros(170));
        let costs = SchedulerCosts { uncounted_search: micros(5), ..costly_wake_ups() };
        assert_eq!(replay(&test_run, costs).frame_time(2), micros(200));
    }

    #[test]
    fn one_worker_at_a_time_is_woken_and_wakes_the_next() {
        let test_run = TestRun::new().add(&[], &[10]).add(&[], &[200]).add(&[0], &[200]).add(&[0], &[100]);
        // At 20 µs, when more nodes become ready, the second is still waking up. It looks for work at 30, wakes the
        // third, and begins at 40.
        let replayed = replay(&test_run, costly_wake_ups()).run(3);
        assert_eq!(replayed.time, micros(240));
        assert_eq!(replayed.busy, [210, 200, 100].map(micros));
    }

    #[test]
    fn serial_time_is_added() {
        let wide = TestRun::new().add(&[], &[10; 64]);
        let replay = replay(&wide, SchedulerCosts::ZERO).with_serial_time(micros(7)).with_serial_time(micros(3));
        assert_eq!(times(&replay, [1, 2]), [650, 330].map(micros));
    }

    #[test]
    fn the_cost_of_recording_is_subtracted() {
        let run = TestRun::new().add(&[], &[10; 4]).run(&SchedulerCosts::ZERO);
        let costs = SchedulerCosts { recording: micros(1), ..SchedulerCosts::ZERO };
        assert_eq!(Replay::new(&run, costs).unwrap().frame_time(1), micros(36));
    }

    #[test]
    fn the_number_of_workers_is_clamped_to_the_maximum() {
        let wide = TestRun::new().add(&[], &[10; 64]);
        let replay = replay(&wide, SchedulerCosts::ZERO);
        assert_eq!(replay.run(usize::MAX), replay.run(Scheduler::MAX_WORKERS));
    }

    #[test]
    fn infinite_costs_leave_all_work_to_one_thread() {
        let wide = TestRun::new().add(&[], &[10; 64]).add(&[0], &[10; 64]);
        let infinite = Duration::MAX;
        let costs = SchedulerCosts {
            wake: infinite,
            waker: infinite,
            steal: infinite,
            uncounted_search: infinite,
            ticket: infinite,
            node: infinite,
            ..SchedulerCosts::ZERO
        };
        assert_eq!(times(&replay(&wide, costs), [1, 2, 64]), [micros(1280); 3]);
    }

    #[test]
    fn no_work_takes_no_time() {
        assert_eq!(times(&replay(&TestRun::new(), SchedulerCosts::ZERO), [1, 2]), [Duration::ZERO; 2]);
        assert_eq!(times(&replay(&TestRun::new().add(&[], &[]), SchedulerCosts::ZERO), [1, 2]), [Duration::ZERO; 2]);
    }

    /// The longest path through the graph, if `cost` says how long a node takes.
    fn longest_path(test_run: &TestRun, cost: impl Fn(&TestNode) -> u64) -> Duration {
        let mut ends: Vec<u64> = Vec::new();
        for node in &test_run.nodes {
            let start = node.dependencies.iter().map(|&dependency| ends[dependency]).max().unwrap_or(0);
            ends.push(start + cost(node));
        }
        micros(ends.into_iter().max().unwrap_or(0))
    }

    fn sum(node: &TestNode) -> u64 {
        node.chunks.iter().sum()
    }

    /// What a node takes at least on any number of workers.
    fn longest_chunk(node: &TestNode) -> u64 {
        if node.cost_kind.is_some() { 0 } else { node.chunks.iter().copied().max().unwrap_or(0) }
    }

    fn any_cost() -> impl Strategy<Value = Duration> {
        prop_oneof![Just(Duration::ZERO), (0..40_u64).prop_map(micros)]
    }

    proptest! {
        #[test]
        fn without_scheduler_costs_times_are_within_grahams_bounds(
            test_run in any_test_run(false),
            workers in 1..12_usize,
        ) {
            let work = micros(test_run.nodes.iter().map(sum).sum());
            let replay = replay(&test_run, SchedulerCosts::ZERO);
            prop_assert_eq!(replay.frame_time(1), work);
            let time = replay.frame_time(workers);
            prop_assert!(time >= longest_path(&test_run, longest_chunk));
            prop_assert!(time * workers as u32 >= work);
            // Graham, "Bounds on Multiprocessing Timing Anomalies", 1969.
            prop_assert!(time <= work / workers as u32 + longest_path(&test_run, sum));
        }

        #[test]
        fn with_any_scheduler_costs_times_are_within_bounds(
            test_run in any_test_run(true),
            workers in 2..12_usize,
            costs in [any_cost(), any_cost(), any_cost(), any_cost(), any_cost(), any_cost()],
        ) {
            let [wake, waker, steal, uncounted_search, ticket, node] = costs;
            let costs = SchedulerCosts { wake, waker, steal, uncounted_search, ticket, node, ..SchedulerCosts::ZERO };
            let work = micros(test_run.nodes.iter().map(sum).sum());
            let mut run = test_run.run(&costs);
            let replay = Replay::new(&run, costs).unwrap();
            let replayed = replay.run(workers);
            prop_assert_eq!(&replayed, &replay.run(workers), "a replay is deterministic");
            prop_assert_eq!(replayed.busy.iter().sum::<Duration>(), work);
            prop_assert!(replayed.busy.iter().all(|&busy| busy <= replayed.time));
            let pinned = test_run.nodes.iter().filter(|node| node.pinned);
            prop_assert!(replayed.busy[0] >= micros(pinned.map(sum).sum()));
            prop_assert!(replayed.time >= longest_path(&test_run, longest_chunk));
            prop_assert!(replayed.time * workers as u32 >= work);
            // Unless it is always parallel, a schedule does not choose a mode that is much slower.
            prop_assert!(replayed.time <= replay.frame_time(1).mul_f64(1.25) + micros(1));
            run.always_parallel = true;
            let steps = (run.graph.nodes.len() + replayed.chunks + workers) as u32;
            let max = work + (wake + waker * 2 + steal + ticket + node) * steps;
            prop_assert!(Replay::new(&run, costs).unwrap().frame_time(workers) <= max);
        }
    }
}
