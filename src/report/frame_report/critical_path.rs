//! Which stays of its workers made a run as long as it was, and how much later its processes could have ended.

use std::time::Duration;

use crate::timeline::{Log, Run};

use super::{
    Slack,
    stays::{ProcessTimes, Stay, stays},
};

/// A run, and when what went on in it.
pub(super) struct RunTimes<'log> {
    /// The run's index in the log.
    pub(super) place: usize,
    pub(super) run: &'log Run,
    pub(super) processes: Vec<ProcessTimes>,
    stays: Vec<Stay>,
}

impl<'log> RunTimes<'log> {
    /// Of a run of that log.
    pub(super) fn new(log: &Log, run: &'log Run) -> Self {
        let place = log.runs.iter().position(|other| std::ptr::eq(other, run)).unwrap_or(0);
        let (processes, stays) = stays(run);
        Self { place, run, processes, stays }
    }

    /// The stay that ended last, before it the one that held that up, and so on: from the first to the last.
    pub(super) fn critical_path(&self) -> Vec<&Stay> {
        let holder = |stay: &&Stay| stay.holder.map(|holder| &self.stays[holder]);
        let mut path: Vec<_> = std::iter::successors(self.stays.last(), holder).collect();
        path.reverse();
        path
    }

    /// How much later each process could have ended: see [`Slack::time`].
    pub(super) fn slack(&self) -> Vec<Slack> {
        let processes = &self.run.graph.processes;
        let end = self.stays.last().map_or(self.run.began, |stay| stay.ended);
        // Every stay of a process has to end before any stay of its dependents is ready. One moment for each process says
        // the same as an edge for each pair of stays.
        let mut latest_ends_of_processes = vec![end; processes.len()];
        let mut latest_ready = vec![end; processes.len()];
        let mut latest_ends_of_stays = vec![end; self.stays.len()];
        let mut times = vec![Duration::MAX; processes.len()];
        let mut stays_left = vec![0_usize; processes.len()];
        self.stays.iter().for_each(|stay| stays_left[stay.process] += 1);
        for (place, stay) in self.stays.iter().enumerate().rev() {
            let process = stay.process;
            let latest_end = latest_ends_of_stays[place].min(latest_ends_of_processes[process]);
            times[process] = times[process].min(latest_end.saturating_sub(stay.ended));
            let ready = latest_end.saturating_sub(stay.weight());
            latest_ready[process] = latest_ready[process].min(ready);
            if let Some(previous) = stay.previous {
                latest_ends_of_stays[previous] = latest_ends_of_stays[previous].min(ready);
            }
            stays_left[process] -= 1;
            if stays_left[process] == 0 {
                for &dependency in &processes[process].dependencies {
                    let latest_end = &mut latest_ends_of_processes[dependency];
                    *latest_end = (*latest_end).min(latest_ready[process]);
                }
            }
        }
        let slack = |(index, time)| Slack { process: (self.place, index), name: processes[index].name.clone(), time };
        times.into_iter().enumerate().map(slack).collect()
    }
}
