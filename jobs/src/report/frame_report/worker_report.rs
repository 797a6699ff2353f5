//! How each worker spent a frame.

use std::ops::Range;
use std::time::Duration;

use crate::report::intervals::{total_length, union};
use crate::timeline::{Chunk, IdleKind, Log, Run, WorkerLog};

/// How a worker spent a frame. The four times add up to the frame's [duration](super::FrameReport::duration).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkerReport {
    /// The worker's name.
    pub name: String,
    /// Its time in chunks of any frame, without the time in which these waited for other chunks.
    pub busy: Duration,
    /// Its time searching for work.
    pub searching: Duration,
    /// Its time asleep.
    pub asleep: Duration,
    /// The rest: the scheduler's own work, jobs that belong to no schedule, and what worker 0's thread does outside of
    /// runs.
    pub other: Duration,
    /// How many chunks of the frame it ran.
    pub chunks: usize,
    /// How many of them it had stolen.
    pub stolen: usize,
}

/// The chunks that a worker ran.
#[derive(Clone, Default)]
struct WorkerChunks {
    intervals: Vec<Range<Duration>>,
    /// How many of them belong to the frame, and how many of those were stolen.
    count: usize,
    stolen: usize,
}

/// How each worker spent the frame's intervals, which are ascending and disjoint.
pub(super) fn worker_reports(log: &Log, frame: u64, frame_intervals: &[Range<Duration>]) -> Vec<WorkerReport> {
    let chunks = chunks_by_worker(log, frame, frame_intervals);
    log.workers.iter().zip(chunks).map(|(worker, chunks)| worker_report(worker, chunks, frame_intervals)).collect()
}

fn chunks_by_worker(log: &Log, frame: u64, frame_intervals: &[Range<Duration>]) -> Vec<WorkerChunks> {
    let mut by_worker = vec![WorkerChunks::default(); log.workers.len()];
    let (Some(first), Some(last)) = (frame_intervals.first(), frame_intervals.last()) else { return by_worker };
    let overlaps = |run: &Run| run.began < last.end && first.start < run.ended;
    for run in log.runs.iter().filter(|run| run.frame == frame || overlaps(run)) {
        let with_items = run.chunks.iter().map(|chunk| (chunk, run.frame == frame));
        for (chunk, counts) in with_items.chain(run.empty.iter().map(|empty| (empty, false))) {
            let Chunk { worker, started, ended, stolen, .. } = *chunk;
            if let Some(chunks) = by_worker.get_mut(worker) {
                chunks.intervals.push(started..ended);
                chunks.count += usize::from(counts);
                chunks.stolen += usize::from(counts && stolen);
            }
        }
    }
    by_worker
}

/// Chunks are nested where a chunk runs a schedule of its own, and idle times are nested in chunks that wait for
/// others. So intervals are merged before they are measured.
fn worker_report(worker: &WorkerLog, chunks: WorkerChunks, frame_intervals: &[Range<Duration>]) -> WorkerReport {
    // A log may cover many frames: only the idle times that overlap this one are considered.
    let until = frame_intervals.last().map_or(Duration::ZERO, |interval| interval.end);
    let since = frame_intervals.first().map_or(until, |interval| interval.start);
    let rest = &worker.idle[worker.idle.partition_point(|idle| idle.ended <= since)..];
    let of_frame = &rest[..rest.partition_point(|idle| idle.began < until)];
    let idle = |kind| of_frame.iter().filter(move |idle| idle.kind == kind).map(|idle| idle.began..idle.ended);
    let searching = union(idle(IdleKind::Searching));
    let idle = union(idle(IdleKind::Asleep).chain(searching.iter().cloned()));
    let known = union(chunks.intervals.into_iter().chain(idle.iter().cloned()));
    let [searching, idle, known] =
        [searching, idle, known].map(|intervals| intersection_length(&intervals, frame_intervals));
    WorkerReport {
        name: worker.name.clone(),
        busy: known - idle,
        searching,
        asleep: idle - searching,
        other: total_length(frame_intervals) - known,
        chunks: chunks.count,
        stolen: chunks.stolen,
    }
}

/// The length of the intersection of two lists of disjoint intervals.
fn intersection_length(one: &[Range<Duration>], other: &[Range<Duration>]) -> Duration {
    let both = union(one.iter().chain(other).cloned());
    total_length(one) + total_length(other) - total_length(&both)
}
