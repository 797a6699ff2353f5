//! What workers did in a run, stay by stay: which process each was at, from when to when, and what had to end before.

use std::{collections::HashMap, time::Duration};

use crate::timeline::{Chunk, Run};

use super::HeldBy;

/// A worker at a process: the chunks of it that the worker ran with none of the run's others in between.
pub(super) struct Stay {
    pub(super) process: usize,
    /// `None` if nothing is known of the process.
    pub(super) worker: Option<usize>,
    /// The worker's stay before, unless this is its first.
    pub(super) previous: Option<usize>,
    pub(super) held_by: HeldBy,
    /// The stay whose end it had to wait for longest, unless that is the run's beginning.
    pub(super) holder: Option<usize>,
    /// When that had ended.
    pub(super) ready: Duration,
    /// When its first chunk began: no earlier than `ready`.
    pub(super) started: Duration,
    /// When its last chunk ended: no earlier than `started`.
    pub(super) ended: Duration,
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

impl Stay {
    /// From ready to end. What passes until it starts is part of it: otherwise there would be holes in the critical path.
    pub(super) fn weight(&self) -> Duration {
        self.ended - self.ready
    }
}

impl ProcessTimes {
    pub(super) fn waited(&self) -> Duration {
        self.started - self.ready
    }
}

/// When each process of the run ran, and all its stays: each after those that had to end before it, and the last is the one
/// that ended last. Every process has at least one.
pub(super) fn stays(run: &Run) -> (Vec<ProcessTimes>, Vec<Stay>) {
    let mut stays = by_process(run);
    let times = put_in_order(run, &mut stays);
    // A stay that takes no time may begin and end at once with others: then the processes' order tells.
    stays.sort_by_key(|stay| (stay.ended, stay.started, stay.process));
    hold(run, &mut stays);
    (times, stays)
}

/// The stays as they stand in the log, by process. They do not know yet what they waited for.
fn by_process(run: &Run) -> Vec<Stay> {
    let mut is_known = vec![false; run.graph.processes.len()];
    let mut chunks: Vec<&Chunk> = run.chunks.iter().chain(&run.empty).collect();
    chunks.retain(|chunk| chunk.process < is_known.len());
    chunks.iter().for_each(|chunk| is_known[chunk.process] = true);
    chunks.sort_by_key(|chunk| (chunk.worker, chunk.ended, chunk.started, chunk.process));
    let of_one_stay = |one: &&Chunk, next: &&Chunk| (one.worker, one.process) == (next.worker, next.process);
    let stay = |process, worker, started, ended| Stay {
        process,
        worker,
        previous: None,
        held_by: HeldBy::Start,
        holder: None,
        ready: run.began,
        started,
        ended,
    };
    let known = chunks.chunk_by(of_one_stay).map(|chunks| {
        let (first, last) = (chunks[0], chunks[chunks.len() - 1]);
        let started = chunks.iter().map(|chunk| chunk.started).min().unwrap_or(first.started);
        stay(first.process, Some(first.worker), started, last.ended)
    });
    let unknown = is_known.iter().enumerate().filter(|(_process, is_known)| !**is_known);
    // They end, and take no time, as soon as they can.
    let unknown = unknown.map(|(process, _)| stay(process, None, Duration::ZERO, Duration::ZERO));
    let mut stays: Vec<_> = known.chain(unknown).collect();
    stays.sort_by_key(|stay| stay.process);
    stays
}

/// Sees to it that no stay begins before what its process waits for has ended, whatever the log says.
fn put_in_order(run: &Run, by_process: &mut [Stay]) -> Vec<ProcessTimes> {
    let mut times: Vec<ProcessTimes> = Vec::new();
    let of_processes = by_process.chunk_by_mut(|one, next| one.process == next.process);
    for (process, stays) in run.graph.processes.iter().zip(of_processes) {
        let ready = process.dependencies.iter().map(|&dependency| times[dependency].ended).max().unwrap_or(run.began);
        for stay in stays.iter_mut() {
            stay.started = stay.started.max(ready);
            stay.ended = stay.ended.max(stay.started);
        }
        let started = stays.iter().map(|stay| stay.started).min().unwrap_or(ready);
        let ended = stays.iter().map(|stay| stay.ended).max().unwrap_or(started);
        times.push(ProcessTimes { ready, started, ended });
    }
    times
}

/// Finds what each of the stays, which ascend by their ends, had to wait for.
fn hold(run: &Run, stays: &mut [Stay]) {
    let processes = &run.graph.processes;
    let mut last_of_processes = vec![0; processes.len()];
    stays.iter().enumerate().for_each(|(place, stay)| last_of_processes[stay.process] = place);
    let awaited = processes.iter().map(|process| {
        let dependencies = process.dependencies.iter();
        dependencies.map(|&dependency| last_of_processes[dependency]).max()
    });
    let awaited: Vec<Option<usize>> = awaited.collect();
    let mut of_workers = HashMap::<usize, Vec<usize>>::new();
    for place in 0..stays.len() {
        let previous = stays[place].worker.and_then(|worker| {
            let earlier = of_workers.entry(worker).or_default();
            // A worker that waits for another run amid a chunk helps out with this one meanwhile: then a stay lies inside of
            // another, which had begun by then and was not held by it.
            let count = earlier.partition_point(|&earlier| stays[earlier].ended <= stays[place].started);
            let previous = earlier[..count].last().copied();
            earlier.push(place);
            previous
        });
        let awaited = awaited[stays[place].process];
        let end_of = |stay: Option<usize>| stay.map_or(run.began, |stay| stays[stay].ended);
        let (held_by, holder) = if end_of(previous) > end_of(awaited) {
            (HeldBy::Worker, previous)
        } else {
            (awaited.map_or(HeldBy::Start, |_| HeldBy::Dependency), awaited)
        };
        let ready = end_of(holder);
        stays[place] = Stay { previous, held_by, holder, ready, ..stays[place] };
    }
}
