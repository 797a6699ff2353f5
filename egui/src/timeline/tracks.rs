//! What each worker and thread did in a frame, as intervals on tracks.

use std::cmp::Reverse;
use std::time::Duration;

use drawloom::timeline::{Chunk, Idle, IdleKind, Run, Span};
use egui::Color32;

use crate::colors::{ASLEEP, SEARCHING, group_color};
use crate::frame_history::FrameRecord;

/// The intervals of one worker, or of one thread.
#[derive(Debug)]
pub struct Track<'a> {
    /// The worker's or thread's name.
    pub name: &'a str,
    /// In the order in which they are drawn.
    pub intervals: Vec<Interval<'a>>,
    /// How many rows its intervals take.
    pub rows: usize,
}

/// An interval on a track.
#[derive(Debug)]
pub struct Interval<'a> {
    /// When it began, on the axis of the log.
    pub began: Duration,
    /// When it ended.
    pub ended: Duration,
    /// The row of its track, from the top.
    pub row: usize,
    content: Content<'a>,
}

#[derive(Debug)]
enum Content<'a> {
    Idle(IdleKind),
    Span(&'a Span),
    Chunk(&'a Run, &'a Chunk),
}

/// The tracks of a frame: threads with spans first, then all workers, with the spans of their threads behind their
/// chunks.
pub fn tracks(record: &FrameRecord) -> Vec<Track<'_>> {
    let log = &record.log;
    let mut threads: Vec<_> =
        log.threads.iter().enumerate().map(|(thread, name)| span_track(record, thread, name)).collect();
    let workers = log.workers.iter().enumerate().map(|(worker, log)| {
        let chunks = worker_intervals(record, worker);
        match threads.iter().position(|thread| thread.name == log.name) {
            Some(spans) => {
                let mut track = threads.remove(spans);
                track.intervals.extend(chunks);
                track
            }
            None => Track { name: &log.name, intervals: chunks.collect(), rows: 1 },
        }
    });
    let workers: Vec<_> = workers.collect();
    threads.into_iter().chain(workers).collect()
}

fn span_track<'a>(record: &'a FrameRecord, thread: usize, name: &'a str) -> Track<'a> {
    let mut spans: Vec<_> = record.log.spans.iter().filter(|span| span.thread == thread).collect();
    // Those that contain others first.
    spans.sort_by_key(|span| (span.began, Reverse(span.ended)));
    // When the last span of each row ends.
    let mut rows: Vec<Duration> = Vec::new();
    let intervals = spans.into_iter().map(|span| {
        let row = rows.iter().position(|ended| *ended <= span.began).unwrap_or(rows.len());
        rows.resize(rows.len().max(row + 1), Duration::ZERO);
        rows[row] = span.ended;
        Interval { began: span.began, ended: span.ended, row, content: Content::Span(span) }
    });
    let intervals: Vec<_> = intervals.collect();
    Track { name, intervals, rows: rows.len().max(1) }
}

fn worker_intervals(record: &FrameRecord, worker: usize) -> impl Iterator<Item = Interval<'_>> {
    let interval = |&Idle { kind, began, ended }| Interval { began, ended, row: 0, content: Content::Idle(kind) };
    let idle = record.log.workers[worker].idle.iter().map(interval);
    let chunks = record.log.runs.iter().flat_map(|run| run.chunks.iter().map(move |chunk| (run, chunk)));
    let chunks = chunks.filter(move |(_, chunk)| chunk.worker == worker).map(|(run, chunk)| Interval {
        began: chunk.started,
        ended: chunk.ended,
        row: 0,
        content: Content::Chunk(run, chunk),
    });
    idle.chain(chunks)
}

impl Interval<'_> {
    /// What is drawn in it; empty for idle workers.
    pub fn text(&self) -> &str {
        match self.content {
            Content::Idle(_) => "",
            Content::Span(span) => &span.name,
            Content::Chunk(run, chunk) => &run.graph.nodes[chunk.node].name,
        }
    }

    /// Its colour.
    pub fn color(&self) -> Color32 {
        match self.content {
            Content::Idle(IdleKind::Searching) => SEARCHING,
            Content::Idle(IdleKind::Asleep) => ASLEEP,
            Content::Span(span) => group_color(&span.name),
            Content::Chunk(run, chunk) => group_color(run.graph.nodes[chunk.node].group()),
        }
    }

    /// What is shown when it is pointed at.
    pub fn explanation(&self) -> String {
        let duration = microseconds(self.ended.saturating_sub(self.began));
        match self.content {
            Content::Idle(IdleKind::Searching) => format!("searches for work: {duration}"),
            Content::Idle(IdleKind::Asleep) => format!("sleeps: {duration}"),
            Content::Span(span) => format!("{}: {duration}", span.name),
            Content::Chunk(run, chunk) => format!(
                "{}\nitems {} to {} of {}, in {duration}\n{}began {} after all that it depends on",
                run.graph.nodes[chunk.node].name,
                chunk.items.start,
                chunk.items.end,
                run.width(chunk.node),
                if chunk.stolen { "stolen from another worker\n" } else { "" },
                microseconds(chunk.started.saturating_sub(chunk.opened)),
            ),
        }
    }
}

fn microseconds(time: Duration) -> String {
    format!("{:.1} µs", time.as_secs_f64() * 1e6)
}

#[cfg(test)]
mod tests {
    use drawloom::timeline::{Graph, Log, NodeInfo, WorkerLog};

    use super::*;

    fn span(name: &str, thread: usize, [began, ended]: [u64; 2]) -> Span {
        let [began, ended] = [began, ended].map(Duration::from_micros);
        Span { name: name.into(), thread, frame: 0, began, ended }
    }

    #[test]
    fn nested_and_overlapping_spans_are_in_rows_of_their_own() {
        let spans = [("inner", [12, 15]), ("outer", [10, 20]), ("overlapping", [14, 30]), ("later", [20, 25])];
        let spans = spans.map(|(name, interval)| span(name, 0, interval)).to_vec();
        let record = FrameRecord {
            log: Log { threads: vec!["main".into()], spans, ..Log::default() },
            ..FrameRecord::default()
        };
        let tracks = tracks(&record);
        let rows: Vec<_> = tracks[0].intervals.iter().map(|interval| (interval.text(), interval.row)).collect();
        assert_eq!(rows, [("outer", 0), ("inner", 1), ("overlapping", 2), ("later", 0)]);
        assert_eq!(tracks[0].rows, 3);
    }

    #[test]
    fn a_worker_has_its_chunks_and_the_spans_of_its_thread() {
        let chunk = |worker, items| Chunk { worker, items, ..Chunk::default() };
        let node = NodeInfo { name: "cull".into(), ..NodeInfo::default() };
        let run = Run {
            graph: Graph { nodes: vec![node] }.into(),
            chunks: vec![chunk(0, 0..3), chunk(1, 3..8)],
            ..Run::default()
        };
        let worker = |name: &str| WorkerLog { name: name.into(), ..WorkerLog::default() };
        let record = FrameRecord {
            log: Log {
                threads: vec!["drawloom-1".into(), "main".into()],
                spans: vec![span("update", 0, [0, 1]), span("submit", 1, [0, 1])],
                workers: vec![worker("caller"), worker("drawloom-1")],
                runs: vec![run],
                ..Log::default()
            },
            ..FrameRecord::default()
        };
        let tracks = tracks(&record);
        let texts: Vec<_> = tracks
            .iter()
            .map(|track| (track.name, track.intervals.iter().map(Interval::text).collect::<Vec<_>>()))
            .collect();
        let expected = [("main", vec!["submit"]), ("caller", vec!["cull"]), ("drawloom-1", vec!["update", "cull"])];
        assert_eq!(texts, expected);
        assert!(tracks[2].intervals[1].explanation().contains("items 3 to 8 of 8"));
    }
}
