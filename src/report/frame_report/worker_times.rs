//! How workers passed a frame.

use std::{ops::Range, time::Duration};

use crate::{
    report::moments::{length, union},
    timeline::{Chunk, IdleKind, Log, Run, WorkerLog},
};

use super::WorkerReport;

/// What a worker ran.
#[derive(Clone, Default)]
struct Ran {
    times: Vec<Range<Duration>>,
    chunks: usize,
    stolen: usize,
}

/// How each worker passed these times, which are the frame's own, ascend and have nothing in common.
pub(super) fn worker_times(log: &Log, frame: u64, own_time: &[Range<Duration>]) -> Vec<WorkerReport> {
    let all_ran = all_ran(log, frame, own_time);
    log.workers.iter().zip(all_ran).map(|(worker, ran)| worker_report(worker, ran, own_time)).collect()
}

fn all_ran(log: &Log, frame: u64, own_time: &[Range<Duration>]) -> Vec<Ran> {
    let mut all_ran = vec![Ran::default(); log.workers.len()];
    let (Some(first), Some(last)) = (own_time.first(), own_time.last()) else { return all_ran };
    let is_near = |run: &Run| run.began < last.end && first.start < run.ended;
    for run in log.runs.iter().filter(|run| run.frame == frame || is_near(run)) {
        let of_items = run.chunks.iter().map(|chunk| (chunk, run.frame == frame));
        for (chunk, counts) in of_items.chain(run.empty.iter().map(|empty| (empty, false))) {
            let Chunk { worker, started, ended, stolen, .. } = *chunk;
            if let Some(ran) = all_ran.get_mut(worker) {
                ran.times.push(started..ended);
                ran.chunks += usize::from(counts);
                ran.stolen += usize::from(counts && stolen);
            }
        }
    }
    all_ran
}

/// Chunks lie inside of each other where one has run a schedule of its own, and idle times in chunks where one waits for
/// others. So times are put together before they are measured.
fn worker_report(worker: &WorkerLog, ran: Ran, own_time: &[Range<Duration>]) -> WorkerReport {
    // A log may be of many frames: only those that this one touches.
    let until = own_time.last().map_or(Duration::ZERO, |time| time.end);
    let since = own_time.first().map_or(until, |time| time.start);
    let rest = &worker.idle[worker.idle.partition_point(|idle| idle.ended <= since)..];
    let of_frame = &rest[..rest.partition_point(|idle| idle.began < until)];
    let idle = |kind| of_frame.iter().filter(move |idle| idle.kind == kind).map(|idle| idle.began..idle.ended);
    let searching = union(idle(IdleKind::Searching));
    let idle = union(idle(IdleKind::Asleep).chain(searching.iter().cloned()));
    let known = union(ran.times.into_iter().chain(idle.iter().cloned()));
    let [searching, idle, known] = [searching, idle, known].map(|times| length_in_common(&times, own_time));
    WorkerReport {
        name: worker.name.clone(),
        busy: known - idle,
        searching,
        asleep: idle - searching,
        other: length(own_time) - known,
        chunks: ran.chunks,
        stolen: ran.stolen,
    }
}

/// How long these two have in common.
fn length_in_common(times: &[Range<Duration>], own_time: &[Range<Duration>]) -> Duration {
    let both = union(times.iter().chain(own_time).cloned());
    length(times) + length(own_time) - length(&both)
}
