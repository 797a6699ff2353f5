//! Which processes waited longest for a worker, and what workers were at meanwhile.

use std::{cmp::Reverse, collections::BTreeMap, time::Duration};

use super::{QueueWait, critical_path::RunTimes};

/// How many waits are told.
const MOST: usize = 10;

/// The longest waits of all processes of these runs, the longest first.
pub(super) fn queue_waits(runs: &[RunTimes<'_>]) -> Vec<QueueWait> {
    let mut waits: Vec<_> =
        runs.iter().flat_map(|times| (0..times.processes.len()).map(move |process| (times, process))).collect();
    waits.retain(|&(times, process)| !times.processes[process].waited().is_zero());
    waits.sort_by_key(|&(times, process)| Reverse(times.processes[process].waited()));
    waits.truncate(MOST);
    waits.into_iter().map(|(times, process)| queue_wait(times, process)).collect()
}

fn queue_wait(times: &RunTimes<'_>, process: usize) -> QueueWait {
    let processes = &times.run.graph.processes;
    let at = times.processes[process];
    let mut by_group = BTreeMap::<&str, Duration>::new();
    for chunk in &times.run.chunks {
        let common = chunk.ended.min(at.started).saturating_sub(chunk.started.max(at.ready));
        if let Some(of) = processes.get(chunk.process).filter(|_| !common.is_zero()) {
            *by_group.entry(of.group()).or_default() += common;
        }
    }
    let mut meanwhile: Vec<_> = by_group.into_iter().map(|(group, time)| (group.to_owned(), time)).collect();
    meanwhile.sort_by_key(|&(_, time)| Reverse(time));
    let name = processes[process].name.clone();
    QueueWait { process: (times.place, process), name, ready: at.ready, started: at.started, meanwhile }
}
