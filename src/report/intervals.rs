//! Intervals of time, and which of them a frame consists of.

use std::cmp::Reverse;
use std::ops::Range;
use std::time::Duration;

use crate::timeline::{Log, Run};

/// The runs that a frame waits for, by when they began, without runs that were started inside another run's chunk.
pub(super) fn outermost_runs(log: &Log, frame: u64) -> Vec<&Run> {
    let mut runs: Vec<_> = log.runs_of(frame).filter(|run| !run.in_background).collect();
    runs.sort_by_key(|run| (run.began, Reverse(run.ended)));
    let mut until = None;
    runs.retain(|run| {
        let is_inside = until.is_some_and(|until| run.ended <= until);
        until = until.max(Some(run.ended));
        !is_inside
    });
    runs
}

/// The intervals in which a frame is worked on: its outermost runs, and the spans of its threads. Ascending and disjoint.
pub(super) fn frame_intervals(log: &Log, frame: u64, outermost: &[&Run]) -> Vec<Range<Duration>> {
    let spans = log.spans_of(frame).map(|span| span.began..span.ended);
    union(spans.chain(outermost.iter().map(|run| run.began..run.ended)))
}

/// The union of these intervals, ascending and disjoint. An interval that ends before it begins is ignored.
pub(super) fn union(intervals: impl IntoIterator<Item = Range<Duration>>) -> Vec<Range<Duration>> {
    let mut intervals: Vec<_> = intervals.into_iter().filter(|interval| interval.start <= interval.end).collect();
    intervals.sort_by_key(|interval| interval.start);
    let mut disjoint: Vec<Range<Duration>> = Vec::new();
    for interval in intervals {
        match disjoint.last_mut() {
            Some(last) if interval.start <= last.end => last.end = last.end.max(interval.end),
            _ => disjoint.push(interval),
        }
    }
    disjoint
}

/// The length of disjoint intervals together.
pub(super) fn total_length(intervals: &[Range<Duration>]) -> Duration {
    intervals.iter().map(|interval| interval.end.saturating_sub(interval.start)).sum()
}

/// The parts of `intervals` that lie in none of `others`. Both are ascending and disjoint.
pub(super) fn difference(intervals: &[Range<Duration>], others: &[Range<Duration>]) -> Vec<Range<Duration>> {
    let mut rest = Vec::new();
    for interval in intervals {
        let mut start = interval.start;
        let first = others.partition_point(|other| other.end <= interval.start);
        for other in others[first..].iter().take_while(|other| other.start < interval.end) {
            if start < other.start {
                rest.push(start..other.start);
            }
            start = other.end;
        }
        if start < interval.end {
            rest.push(start..interval.end);
        }
    }
    rest
}
