//! When each process of a run could begin, did and ended, which of them made the run as long as it was, and how much later the
//! others could have ended.

use std::time::Duration;

use crate::timeline::{Log, Run};

use super::Slack;

/// A run, and when its processes ran.
pub(super) struct RunTimes<'log> {
    /// The run's index in the log.
    pub(super) place: usize,
    pub(super) run: &'log Run,
    pub(super) processes: Vec<ProcessTimes>,
}

/// When a process ran. Each of the three is no earlier than the one before.
#[derive(Clone, Copy)]
pub(super) struct ProcessTimes {
    /// When the last of what it waits for had ended.
    pub(super) ready: Duration,
    /// When its first chunk began.
    pub(super) started: Duration,
    /// When its last chunk ended.
    pub(super) ended: Duration,
}

impl ProcessTimes {
    pub(super) fn waited(&self) -> Duration {
        self.started - self.ready
    }

    /// From ready to end. What a process waits for a worker is part of it: otherwise there would be holes in the critical path.
    fn weight(&self) -> Duration {
        self.ended - self.ready
    }
}

impl<'log> RunTimes<'log> {
    /// Of a run of that log.
    pub(super) fn new(log: &Log, run: &'log Run) -> Self {
        let place = log.runs.iter().position(|other| std::ptr::eq(other, run)).unwrap_or(0);
        let mut processes: Vec<ProcessTimes> = Vec::new();
        for (index, process) in run.graph.processes.iter().enumerate() {
            let ends = process.dependencies.iter().map(|&dependency| processes[dependency].ended);
            let ready = ends.max().unwrap_or(run.began);
            let empty = run.empty.binary_search_by_key(&index, |empty| empty.process);
            let chunks = run.chunks_of(index).iter().chain(empty.ok().map(|place| &run.empty[place]));
            // What nothing is known of takes no time.
            let (began, ended) = chunks.fold((None, ready), |(began, ended), chunk| {
                (Some(began.unwrap_or(chunk.started).min(chunk.started)), ended.max(chunk.ended))
            });
            let started = began.map_or(ready, |began: Duration| began.clamp(ready, ended));
            processes.push(ProcessTimes { ready, started, ended });
        }
        Self { place, run, processes }
    }

    /// The process that ended last, before it that of its dependencies which did, and so on: from the first to the last.
    pub(super) fn critical_path(&self) -> Vec<usize> {
        let last_of =
            |processes: &mut dyn Iterator<Item = usize>| processes.max_by_key(|&process| self.processes[process].ended);
        let mut path = Vec::new();
        let mut next = last_of(&mut (0..self.processes.len()));
        while let Some(process) = next {
            path.push(process);
            next = last_of(&mut self.dependencies(process));
        }
        path.reverse();
        path
    }

    /// How much later each process could have ended: see [`Slack::time`].
    pub(super) fn slack(&self) -> Vec<Slack> {
        let end = self.processes.iter().map(|times| times.ended).max().unwrap_or_default();
        let mut latest_ends = vec![end; self.processes.len()];
        for (process, times) in self.processes.iter().enumerate().rev() {
            let latest_ready = latest_ends[process].saturating_sub(times.weight());
            for dependency in self.dependencies(process) {
                latest_ends[dependency] = latest_ends[dependency].min(latest_ready);
            }
        }
        let slack = |(index, latest_end): (usize, Duration)| Slack {
            process: (self.place, index),
            name: self.run.graph.processes[index].name.clone(),
            time: latest_end.saturating_sub(self.processes[index].ended),
        };
        latest_ends.into_iter().enumerate().map(slack).collect()
    }

    fn dependencies(&self, process: usize) -> impl Iterator<Item = usize> {
        self.run.graph.processes[process].dependencies.iter().copied()
    }
}
