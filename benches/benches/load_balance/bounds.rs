//! What bounds a prediction: what the predicted frame would save without one of its parts.

use std::collections::BTreeSet;
use std::error::Error;
use std::mem;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use drawloom::report::{Replay, SchedulerCosts};
use drawloom::timeline::Log;
use drawloom_benches::statistics::median;

/// The number of workers that the parts are given for.
pub const WORKERS: usize = 16;

/// The least share of a frame that is shown.
const MIN_SHARE: f64 = 0.02;

/// The predicted times of frames on [`WORKERS`] workers, and what they would save without each part, in seconds. The
/// parts do not add up, because others take the place of the one that is left out.
#[derive(Clone, Default)]
pub struct Bounds {
    frames: Vec<f64>,
    parts: Vec<(String, Vec<f64>)>,
}

impl Bounds {
    /// Adds a recorded frame of one run.
    ///
    /// # Errors
    /// Returns an error if the frame cannot be replayed.
    pub fn add(&mut self, log: &Log, frame: u64, costs: SchedulerCosts) -> Result<(), Box<dyn Error>> {
        let (Some(run), Some(record)) = (log.runs_of(frame).next(), span_of(log, frame, "record")) else {
            return Err("a frame has no run or span".into());
        };
        self.put("before the jobs", run.began.saturating_sub(record.start));
        self.put("after the jobs", record.end.saturating_sub(run.ended));
        let submit = span_of(log, frame, "submit").unwrap_or_default();
        self.put("submit", submit.end - submit.start);

        let by_stage = grouped_by_stage(log);
        let replay = Replay::of_frame(&by_stage, frame, costs)?;
        let time = replay.frame_time(WORKERS);
        self.frames.push(time.as_secs_f64());
        let awake = SchedulerCosts { wake: Duration::ZERO, waker: Duration::ZERO, ..costs };
        self.put("waking workers", time.saturating_sub(Replay::of_frame(&by_stage, frame, awake)?.frame_time(WORKERS)));
        let stages: BTreeSet<_> = run.graph.nodes.iter().filter_map(|node| node.labels.stage.as_deref()).collect();
        for stage in stages {
            let without = replay.clone().without_work_of(stage).frame_time(WORKERS);
            self.put(&format!("stage {stage}"), time.saturating_sub(without));
        }
        Ok(())
    }

    /// The parts without which the frame would save at least [`MIN_SHARE`], the largest first: their names, seconds,
    /// and shares of the frame. All are medians.
    pub fn parts(&self) -> Vec<(&str, f64, f64)> {
        let frame = median(self.frames.iter().copied());
        let all = self.parts.iter().map(|(name, times)| (name.as_str(), median(times.iter().copied())));
        let with_shares = all.map(|(name, saved)| (name, saved, saved / frame));
        let mut parts: Vec<_> = with_shares.filter(|&(_, _, share)| share >= MIN_SHARE).collect();
        parts.sort_by(|one, other| other.1.total_cmp(&one.1));
        parts
    }

    fn put(&mut self, part: &str, time: Duration) {
        let index = self.parts.iter().position(|(name, _)| name == part).unwrap_or_else(|| {
            self.parts.push((part.to_owned(), Vec::new()));
            self.parts.len() - 1
        });
        self.parts[index].1.push(time.as_secs_f64());
    }
}

/// From when to when the span of that name lasts.
fn span_of(log: &Log, frame: u64, name: &str) -> Option<Range<Duration>> {
    log.spans_of(frame).find(|span| span.name == name).map(|span| span.began..span.ended)
}

/// The log with the nodes of its runs grouped by stage. A label still tells the processes apart, because items of
/// different processes differ in cost.
fn grouped_by_stage(log: &Log) -> Log {
    let mut log = log.clone();
    for run in &mut log.runs {
        for node in &mut Arc::make_mut(&mut run.graph).nodes {
            mem::swap(&mut node.labels.process, &mut node.labels.stage);
        }
    }
    log
}
