//! What each worker and thread did in a frame, as intervals on tracks.

use std::time::Duration;

use drawloom::timeline::IdleKind;
use egui::Color32;

use crate::colors::{ASLEEP, SEARCHING, group_color};
use crate::frame_history::FrameRecord;

/// The intervals of one worker, or of one thread.
#[derive(Debug, Default)]
pub struct Track {
    /// The worker's or thread's name.
    pub name: String,
    /// By how deep they are nested, so that an interval is drawn over those that contain it.
    pub intervals: Vec<Interval>,
    /// How deep intervals are nested, and 1 without nesting.
    pub depth: usize,
}

/// An interval on a track.
#[derive(Debug)]
pub struct Interval {
    /// When it began, on the axis of the log.
    pub began: Duration,
    /// When it ended.
    pub ended: Duration,
    /// How many intervals contain it.
    pub depth: usize,
    /// What is drawn in it; empty for idle workers.
    pub text: String,
    /// What is shown when it is pointed at.
    pub explanation: String,
    pub color: Color32,
}

/// The tracks of a frame: threads with spans first, then all workers, with the spans of their threads behind their chunks.
pub fn tracks(record: &FrameRecord) -> Vec<Track> {
    let log = &record.log;
    let mut threads: Vec<_> =
        log.threads.iter().enumerate().map(|(thread, name)| span_track(record, thread, name)).collect();
    let workers = log.workers.iter().enumerate().map(|(worker, log)| {
        let chunks = worker_track(record, worker, &log.name);
        let Some(spans) = threads.iter().position(|thread| thread.name == log.name) else { return chunks };
        let mut track = threads.remove(spans);
        track.intervals.extend(chunks.intervals);
        track
    });
    let workers: Vec<_> = workers.collect();
    threads.into_iter().chain(workers).collect()
}

fn span_track(record: &FrameRecord, thread: usize, name: &str) -> Track {
    let mut spans: Vec<_> = record.log.spans.iter().filter(|span| span.thread == thread).collect();
    // Those that contain others first.
    spans.sort_by_key(|span| (span.began, std::cmp::Reverse(span.ended)));
    let mut open: Vec<Duration> = Vec::new();
    let intervals = spans.into_iter().map(|span| {
        open.retain(|&ended| ended > span.began);
        open.push(span.ended);
        Interval {
            began: span.began,
            ended: span.ended,
            depth: open.len() - 1,
            text: span.name.clone(),
            explanation: format!("{}: {}", span.name, microseconds(span.ended.saturating_sub(span.began))),
            color: group_color(&span.name),
        }
    });
    let intervals: Vec<_> = intervals.collect();
    let depth = intervals.iter().map(|interval| interval.depth + 1).max().unwrap_or(1);
    Track { name: name.to_owned(), intervals, depth }
}

fn worker_track(record: &FrameRecord, worker: usize, name: &str) -> Track {
    let idle = record.log.workers[worker].idle.iter().map(|idle| {
        let (what, color) = match idle.kind {
            IdleKind::Searching => ("searches for work", SEARCHING),
            IdleKind::Asleep => ("sleeps", ASLEEP),
        };
        let duration = idle.ended.saturating_sub(idle.began);
        let explanation = format!("{what}: {}", microseconds(duration));
        Interval { began: idle.began, ended: idle.ended, depth: 0, text: String::new(), explanation, color }
    });
    let chunks = record.log.runs.iter().flat_map(|run| run.chunks.iter().map(move |chunk| (run, chunk)));
    let chunks = chunks.filter(|(_, chunk)| chunk.worker == worker).map(|(run, chunk)| {
        let node = &run.graph.nodes[chunk.node];
        let waited = chunk.started.saturating_sub(chunk.opened);
        let explanation = format!(
            "{}\nitems {} to {} of {}, in {}\n{}began {} after all that it depends on",
            node.name,
            chunk.items.start,
            chunk.items.end,
            run.width(chunk.node),
            microseconds(chunk.duration()),
            if chunk.stolen { "stolen from another worker\n" } else { "" },
            microseconds(waited),
        );
        Interval {
            began: chunk.started,
            ended: chunk.ended,
            depth: 0,
            text: node.name.clone(),
            explanation,
            color: group_color(node.group()),
        }
    });
    Track { name: name.to_owned(), intervals: idle.chain(chunks).collect(), depth: 1 }
}

fn microseconds(time: Duration) -> String {
    format!("{:.1} µs", time.as_secs_f64() * 1e6)
}
