//! Times from one moment to another.

use std::{ops::Range, time::Duration};

use crate::timeline::{Log, Run};

/// The runs that a frame waits for and that are not part of another one's chunks, by when they began.
pub(super) fn outermost(log: &Log, frame: u64) -> Vec<&Run> {
    let mut runs: Vec<_> = log.runs_of(frame).filter(|run| !run.in_background).collect();
    runs.sort_by_key(|run| (run.began, std::cmp::Reverse(run.ended)));
    let mut until = None;
    runs.retain(|run| {
        let is_inside = until.is_some_and(|until| run.ended <= until);
        until = until.max(Some(run.ended));
        !is_inside
    });
    runs
}

/// All the time that is a frame's: in its outermost runs, and in what its threads did outside of them.
pub(super) fn own_time(log: &Log, frame: u64, outermost: &[&Run]) -> Vec<Range<Duration>> {
    let of_spans = log.spans_of(frame).map(|span| span.began..span.ended);
    union(of_spans.chain(outermost.iter().map(|run| run.began..run.ended)))
}

/// The same times without what they have in common, ascending. One that ends before it begins is no time.
pub(super) fn union(times: impl IntoIterator<Item = Range<Duration>>) -> Vec<Range<Duration>> {
    let mut times: Vec<_> = times.into_iter().filter(|time| time.start <= time.end).collect();
    times.sort_by_key(|time| time.start);
    let mut apart: Vec<Range<Duration>> = Vec::new();
    for time in times {
        match apart.last_mut() {
            Some(last) if time.start <= last.end => last.end = last.end.max(time.end),
            _ => apart.push(time),
        }
    }
    apart
}

/// How long they are together, which have nothing in common.
pub(super) fn length(times: &[Range<Duration>]) -> Duration {
    times.iter().map(|time| time.end.saturating_sub(time.start)).sum()
}

/// What of these times is in none of the others. Both ascend and have nothing in common among themselves.
pub(super) fn without(times: &[Range<Duration>], others: &[Range<Duration>]) -> Vec<Range<Duration>> {
    let mut left = Vec::new();
    for time in times {
        let mut start = time.start;
        let first = others.partition_point(|other| other.end <= time.start);
        for other in others[first..].iter().take_while(|other| other.start < time.end) {
            if start < other.start {
                left.push(start..other.start);
            }
            start = other.end;
        }
        if start < time.end {
            left.push(start..time.end);
        }
    }
    left
}
