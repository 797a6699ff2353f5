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

/// The gaps between the parallel runs of frames up to an outermost run, in order: from the end of all that began before
/// one until that one began. There is none before the first of the log. Serial runs of several workers belong to the
/// gaps around them.
pub(super) fn gaps_up_to(log: &Log, run: &Run) -> Vec<Duration> {
    let start_of = |run: &Run| if run.workers == 1 { Some(run.began) } else { run.parallel_from };
    let Some(start) = start_of(run) else { return Vec::new() };
    let before = log.runs.iter().filter(|other| !other.in_background && other.began < run.began);
    let intervals = union(before.filter_map(|run| Some(start_of(run)?..run.ended)));
    let gaps_before = intervals.windows(2).map(|pair| pair[1].start - pair[0].end);
    let gap = intervals.last().map(|last| start.saturating_sub(last.end));
    gaps_before.chain(gap).collect()
}

/// The intervals in which a frame is worked on: its outermost runs, and the spans of its threads. Ascending and
/// disjoint.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn micros(count: u64) -> Duration {
        Duration::from_micros(count)
    }

    fn gaps(runs: Vec<Run>) -> Vec<Vec<Duration>> {
        let log = Log { runs, ..Log::default() };
        log.runs.iter().map(|run| gaps_up_to(&log, run)).collect()
    }

    #[test]
    fn a_gap_begins_when_all_earlier_runs_of_frames_have_ended() {
        let run = |(began, ended, in_background)| Run {
            workers: 1,
            began: micros(began),
            ended: micros(ended),
            in_background,
            ..Run::default()
        };
        let runs = [(10, 90, false), (20, 30, false), (40, 140, true), (150, 160, false), (170, 180, false)].map(run);
        let gaps = gaps(runs.to_vec());
        assert_eq!(gaps[0], []);
        // It began while the first one ran.
        assert_eq!(gaps[1], [micros(0)]);
        assert_eq!(gaps[3..], [vec![micros(60)], vec![micros(60), micros(10)]]);
    }

    #[test]
    fn serial_runs_belong_to_gaps_and_others_begin_where_they_are_parallel() {
        let run = |(began, parallel_from, ended): (u64, Option<u64>, u64)| Run {
            workers: 2,
            began: micros(began),
            parallel_from: parallel_from.map(micros),
            ended: micros(ended),
            ..Run::default()
        };
        let runs = [(0, Some(0), 100), (110, None, 120), (130, Some(135), 200), (210, Some(210), 300)].map(run);
        let expected = [vec![], vec![], vec![micros(35)], vec![micros(35), micros(10)]];
        assert_eq!(gaps(runs.to_vec()), expected);
    }
}
