//! Times from one moment to another.

use std::{ops::Range, time::Duration};

use crate::timeline::{Log, Run};

/// The runs of a frame that are not part of another one's chunks, by when they began.
pub(super) fn outermost(log: &Log, frame: u64) -> Vec<&Run> {
    let mut runs: Vec<_> = log.runs_of(frame).collect();
    runs.sort_by_key(|run| (run.began, std::cmp::Reverse(run.ended)));
    let mut until = None;
    runs.retain(|run| {
        let is_inside = until.is_some_and(|until| run.ended <= until);
        until = until.max(Some(run.ended));
        !is_inside
    });
    runs
}

/// The same times without what they have in common, ascending.
pub(super) fn union(times: impl IntoIterator<Item = Range<Duration>>) -> Vec<Range<Duration>> {
    let mut times: Vec<_> = times.into_iter().collect();
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
