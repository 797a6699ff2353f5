//! The report on a frame.

use std::time::Duration;

use super::critical_path::critical_path;
use super::queue_wait::{QueueWait, queue_waits};
use super::run_spans::RunSpans;
use super::share::{PathShare, shares};
use super::slack::{Slack, slack};
use super::step::Step;
use super::what_if::{WhatIf, what_if};
use super::worker_report::{WorkerReport, worker_reports};
use crate::report::error::ReportError;
use crate::report::intervals::{frame_intervals, outermost_runs, total_length};
use crate::report::simulation::{Replay, SchedulerCosts};
use crate::timeline::{FrameTuning, Log};

/// Why a frame took as long as it did. Points in time are on the axis of the [`Log`]. Its `Display` is a text for a
/// terminal.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameReport {
    /// The frame's number.
    pub frame: u64,
    /// When it began.
    pub began: Duration,
    /// How long it took: its runs, and what its threads did outside of them. Time in which no thread works on the frame
    /// does not count, such as the time in which a recorded frame waits to be submitted.
    pub duration: Duration,
    /// The chain of steps that the end of the frame waited for, from its beginning to its end. Their durations add up
    /// to the frame's [duration](Self::duration).
    pub critical_path: Vec<Step>,
    /// How much of the critical path each group takes, the longest first.
    pub shares: Vec<PathShare>,
    /// How much later each node could have ended, in the order of runs and of their schedules.
    pub slack: Vec<Slack>,
    /// How each worker spent the frame.
    pub workers: Vec<WorkerReport>,
    /// The nodes that waited longest for a worker after all their dependencies were done, the longest first: 10 at
    /// most.
    pub queue_waits: Vec<QueueWait>,
    /// How long a replay of the unchanged frame takes, on as many workers as there were. Compare the times below with
    /// this one, not with the [duration](Self::duration): a replay stands for many such frames, and leaves out what
    /// else the machine did.
    pub replayed: Duration,
    /// How long the frame would take if the nodes of one group had nothing to do, what saves the most first. These are
    /// the 32 groups with the most work, as a group can hardly save more than its work.
    pub what_if: Vec<WhatIf>,
    /// How long a replay takes on other numbers of workers: 1, 2, 4, 8, 16.
    pub on_workers: Vec<(usize, Duration)>,
    /// What was chosen by measurement, for each `Renderer::record` of the frame.
    pub tuning: Vec<FrameTuning>,
}

/// The numbers of workers that each frame is replayed on.
const WORKER_COUNTS: [usize; 5] = [1, 2, 4, 8, 16];

impl FrameReport {
    /// Reports on the frame with that number. `costs` are those of this machine, for the [replay](Replay).
    ///
    /// ```
    /// use drawloom_jobs::graph::{Closure, FrameGraph};
    /// use drawloom_jobs::report::{FrameReport, SchedulerCosts};
    /// use drawloom_jobs::task::Scheduler;
    ///
    /// let mut graph = FrameGraph::new();
    /// let cull = graph.add("cull", Closure::new(|_: &(), _range, _worker| Ok(())));
    /// graph.keep(cull);
    /// let mut schedule = graph.compile()?;
    ///
    /// let scheduler = Scheduler::new(2)?;
    /// scheduler.timeline().start();
    /// schedule.run(&scheduler, &())?;
    /// let report = FrameReport::new(&scheduler.timeline().take(), 0, &SchedulerCosts::measure()?)?;
    /// println!("{report}");
    /// assert_eq!(report.critical_path[0].name, "cull");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Replay::of_frame`].
    pub fn new(log: &Log, frame: u64, costs: &SchedulerCosts) -> Result<Self, ReportError> {
        let replay = Replay::of_frame(log, frame, *costs)?;
        let outermost = outermost_runs(log, frame);
        let frame_intervals = frame_intervals(log, frame, &outermost);
        let runs: Vec<_> = outermost.into_iter().map(|run| RunSpans::new(log, run)).collect();
        let critical_path = critical_path(log, frame, &frame_intervals, &runs);
        let workers = log.workers.len();
        let replayed = replay.frame_time(workers);
        Ok(Self {
            frame,
            began: frame_intervals.first().map_or(Duration::ZERO, |interval| interval.start),
            duration: total_length(&frame_intervals),
            shares: shares(&critical_path),
            critical_path,
            slack: runs.iter().flat_map(slack).collect(),
            workers: worker_reports(log, frame, &frame_intervals),
            queue_waits: queue_waits(&runs),
            replayed,
            what_if: what_if(&runs, &replay, workers, replayed),
            tuning: log
                .tuning
                .iter()
                .filter(|(number, _)| *number == frame)
                .map(|(_, tuning)| tuning.clone())
                .collect(),
            on_workers: WORKER_COUNTS.map(|workers| (workers, replay.frame_time(workers))).to_vec(),
        })
    }
}
