//! Why a frame took as long as it did.

mod critical_path;
mod queue_waits;
mod stays;
mod steps;
mod words;
mod worker_times;

use std::{
    cmp::Reverse,
    collections::{BTreeMap, HashMap},
    time::Duration,
};

use crate::timeline::Log;

use self::{critical_path::RunTimes, queue_waits::queue_waits, steps::steps, worker_times::worker_times};
use super::{
    error::ReportError,
    moments::{length, outermost, own_time},
    replay::{Prices, Replay},
};

/// Why a frame took as long as it did. Times of moments are those of the [`Log`]. Printed, it is words for a terminal.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameReport {
    /// The frame's number.
    pub frame: u64,
    /// When it began.
    pub began: Duration,
    /// How long it took: what its threads did outside of all runs, and its runs. While nothing of it goes on, as when what was
    /// recorded waits to be submitted, it takes no time.
    pub took: Duration,
    /// What the end of the frame waited for, one step after another, from its beginning to its end. They are as long together
    /// as the frame [took](Self::took).
    pub critical_path: Vec<Step>,
    /// How much of the critical path is whose, the longest first.
    pub shares: Vec<Share>,
    /// How much later each process could have ended, in the order of runs and of their schedules.
    pub slack: Vec<Slack>,
    /// How each worker passed the frame.
    pub workers: Vec<WorkerReport>,
    /// The processes that waited longest for a worker although all they depend on was done, the longest first: 10 at most.
    pub queue_waits: Vec<QueueWait>,
    /// How long the frame takes as it is by the replay, on as many workers as there were. The times below are to be compared
    /// with this, not with what it [took](Self::took): a replay stands for many such frames, and leaves out what else the
    /// machine did.
    pub replayed: Duration,
    /// What the frame would take with nothing to do for the processes of one group, by what that saves, the most first. These
    /// are the 32 groups with the most work: one can hardly save more than the work that it is.
    pub what_if: Vec<WhatIf>,
    /// What it would take on other numbers of workers, ascending (by the replay): 1, 2, 4, 8, 16.
    pub on_workers: Vec<(usize, Duration)>,
}

/// A step of the critical path: a worker's stay at a process of a run, or what a thread did outside of all runs.
///
/// A stay is the chunks of one process that a worker ran with none of the run's others in between. It could not begin before
/// the last of what its process waits for had ended, nor before the worker's stay before had. What ended last of these is what
/// it was [held by](Self::held_by), and the step before it. The first step of a run begins with the run: nothing lies between
/// one step and the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// What it is called.
    pub name: String,
    /// What it counts as: see [`Process::group`](crate::timeline::Process::group).
    pub group: String,
    /// The index of the run in the log, and of the process in its graph; `None` for what a thread did outside of all runs, and
    /// for what a run took to end after its last process.
    pub process: Option<(usize, usize)>,
    /// The worker whose stay it is; `None` where there is no process, or nothing is known of it.
    pub worker: Option<usize>,
    /// What it had to wait for.
    pub held_by: HeldBy,
    /// When it could have begun: when the step before ended.
    pub ready: Duration,
    /// When it began: from `ready` until then a worker had yet to come, which had to be woken, say, or to look for work.
    pub started: Duration,
    /// When it ended.
    pub ended: Duration,
}

/// What a step of the critical path had to wait for: what the step before it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeldBy {
    /// Nothing but its run, of which it is the first; or it is no process.
    Start,
    /// A process that its own waits for.
    Dependency,
    /// Its worker, which was at something else until then.
    Worker,
}

/// How much of the critical path is a group's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Share {
    /// The group.
    pub group: String,
    /// How long its steps ran, from each one's start to its end.
    pub ran: Duration,
    /// How long they waited before that for a worker to come.
    pub waited: Duration,
}

/// How much later a process could have ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Slack {
    /// The index of the run in the log, and of the process in its graph.
    pub process: (usize, usize),
    /// What the process is called.
    pub name: String,
    /// How much later all its stays could have ended without its run's last one ending later, if all stays that had to wait
    /// for them, directly or not, took as long from ready to end as they did: those of its dependents, and those of the same
    /// workers. Zero on the critical path. It is the total float of the critical path method (Kelley and Walker,
    /// "Critical-Path Planning and Scheduling", 1959), on a graph of [stays](Step).
    pub time: Duration,
}

/// How a worker passed a frame: the four times are as long together as the frame [took](FrameReport::took).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkerReport {
    /// The worker's name.
    pub name: String,
    /// Its time in chunks, whichever frame they are of, without the time in which they waited for others.
    pub busy: Duration,
    /// Its time looking for work.
    pub searching: Duration,
    /// Its time asleep.
    pub asleep: Duration,
    /// The rest: what the scheduler itself does, jobs that are no schedule's, and what worker 0's thread does outside of runs.
    pub other: Duration,
    /// How many chunks of the frame it ran.
    pub chunks: usize,
    /// How many of them it had stolen.
    pub stolen: usize,
}

/// A process that waited for a worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct QueueWait {
    /// The index of the run in the log, and of the process in its graph.
    pub process: (usize, usize),
    /// What the process is called.
    pub name: String,
    /// When all it depends on was done.
    pub ready: Duration,
    /// When its first chunk began.
    pub started: Duration,
    /// What workers were at meanwhile: groups, and all workers' time in their chunks together, the longest first.
    pub meanwhile: Vec<(String, Duration)>,
}

/// A frame with nothing to do for the processes of a group.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WhatIf {
    /// The group.
    pub group: String,
    /// What the frame would take.
    pub time: Duration,
    /// What that is less than what the frame takes by the same [replay](FrameReport::replayed).
    pub saved: Duration,
}

/// For how many groups it is said what the frame would take without them.
const MOST_GROUPS: usize = 32;

const NUMBERS_OF_WORKERS: [usize; 5] = [1, 2, 4, 8, 16];

impl FrameReport {
    /// Reports on the frame of that number. `prices` are those of this machine, for the [replay](Replay).
    ///
    /// ```
    /// use drawloom::{
    ///     graph::{Closure, FrameGraph},
    ///     report::{FrameReport, Prices},
    ///     task::Scheduler,
    /// };
    ///
    /// let mut graph = FrameGraph::new();
    /// let cull = graph.add("cull", Closure::new(|_: &(), _range, _worker| Ok(())));
    /// graph.keep(cull);
    /// let mut schedule = graph.compile()?;
    ///
    /// let scheduler = Scheduler::new(2)?;
    /// scheduler.timeline().start();
    /// schedule.run(&scheduler, &())?;
    /// let report = FrameReport::new(&scheduler.timeline().take(), 0, &Prices::measure()?)?;
    /// println!("{report}");
    /// assert_eq!(report.critical_path[0].name, "cull");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    ///
    /// As [`Replay::of_frame`].
    pub fn new(log: &Log, frame: u64, prices: &Prices) -> Result<Self, ReportError> {
        let replay = Replay::of_frame(log, frame, *prices)?;
        let outermost = outermost(log, frame);
        let own_time = own_time(log, frame, &outermost);
        let runs: Vec<_> = outermost.into_iter().map(|run| RunTimes::new(log, run)).collect();
        let critical_path = steps(log, frame, &own_time, &runs);
        let workers = log.workers.len();
        let replayed = replay.frame_time(workers);
        Ok(Self {
            frame,
            began: own_time.first().map_or(Duration::ZERO, |time| time.start),
            took: length(&own_time),
            shares: shares(&critical_path),
            critical_path,
            slack: runs.iter().flat_map(RunTimes::slack).collect(),
            workers: worker_times(log, frame, &own_time),
            queue_waits: queue_waits(&runs),
            replayed,
            what_if: what_if(&runs, &replay, workers, replayed),
            on_workers: NUMBERS_OF_WORKERS.map(|workers| (workers, replay.frame_time(workers))).to_vec(),
        })
    }
}

impl Step {
    /// How long it took, with what it waited.
    pub fn took(&self) -> Duration {
        self.ended.saturating_sub(self.ready)
    }

    /// How long it waited for a worker to come.
    pub fn waited(&self) -> Duration {
        self.started.saturating_sub(self.ready)
    }
}

impl Share {
    /// How long its steps took, with what they waited.
    pub fn took(&self) -> Duration {
        self.ran + self.waited
    }
}

impl QueueWait {
    /// How long it waited.
    pub fn waited(&self) -> Duration {
        self.started.saturating_sub(self.ready)
    }
}

fn shares(path: &[Step]) -> Vec<Share> {
    let mut by_group = BTreeMap::<&str, (Duration, Duration)>::new();
    for step in path {
        let (ran, waited) = by_group.entry(&step.group).or_default();
        *ran += step.ended.saturating_sub(step.started);
        *waited += step.waited();
    }
    let share = |(group, (ran, waited)): (&str, _)| Share { group: group.to_owned(), ran, waited };
    let mut shares: Vec<_> = by_group.into_iter().map(share).collect();
    shares.sort_by_key(|share| Reverse(share.took()));
    shares
}

fn what_if(runs: &[RunTimes<'_>], replay: &Replay, workers: usize, replayed: Duration) -> Vec<WhatIf> {
    let mut work = HashMap::<&str, Duration>::new();
    for times in runs {
        for (index, process) in times.run.graph.processes.iter().enumerate() {
            *work.entry(process.group()).or_default() +=
                times.run.chunks_of(index).iter().map(|chunk| chunk.took()).sum();
        }
    }
    let mut groups: Vec<_> = work.into_iter().collect();
    groups.sort_by_key(|&(group, work)| (Reverse(work), group));
    groups.truncate(MOST_GROUPS);
    let mut all: Vec<_> = groups
        .into_iter()
        .map(|(group, _work)| {
            // Less work can take longer, as another order follows from it (Graham, "Bounds on Multiprocessing Timing Anomalies",
            // 1969). That is chance, and no price of the work that was left out.
            let time = replay.clone().with_free(group).frame_time(workers).min(replayed);
            WhatIf { group: group.to_owned(), time, saved: replayed - time }
        })
        .collect();
    all.sort_by_key(|what_if| Reverse(what_if.saved));
    all
}
