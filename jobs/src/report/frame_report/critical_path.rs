//! The critical path of a frame: those of its runs, and what its threads did before, between and after them.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;
use std::time::Duration;

use super::run_spans::RunSpans;
use super::step::{HeldBy, Step};
use super::worker_spans::WorkerSpan;
use crate::report::intervals::{difference, union};
use crate::timeline::{Log, Span};

/// The name of the step from the end of a run's last node to the end of the run: workers find that nothing is left, and
/// the calling thread is woken if it sleeps.
const END_OF_RUN: &str = "end of the run";

/// All steps of the frame, from its beginning to its end.
pub(super) fn critical_path(
    log: &Log,
    frame: u64,
    frame_intervals: &[Range<Duration>],
    runs: &[RunSpans<'_>],
) -> Vec<Step> {
    let mut steps = Vec::new();
    let mut until = Duration::ZERO;
    for run in runs {
        // Where runs of two threads overlap, the path follows the first to its end.
        let start = until.max(run.run.began);
        let within = start..start.max(run.run.ended);
        steps.extend(steps_of_run(run).into_iter().filter_map(|step| clip(step, &within)));
        until = within.end;
    }
    let of_runs = union(runs.iter().map(|run| run.run.began..run.run.ended));
    steps.extend(steps_of_spans(log, frame, &difference(frame_intervals, &of_runs), runs));
    steps.sort_by_key(|step| step.ready);
    steps
}

fn steps_of_run(run: &RunSpans<'_>) -> Vec<Step> {
    let step = |span: &WorkerSpan| {
        let node = &run.run.graph.nodes[span.node];
        Step {
            name: node.name.clone(),
            group: node.group().to_owned(),
            node: Some((run.index, span.node)),
            worker: span.worker,
            held_by: span.held_by,
            ready: span.ready,
            started: span.started,
            ended: span.ended,
        }
    };
    let mut steps: Vec<_> = run.critical_path().into_iter().map(step).collect();
    let end = steps.last().map_or(run.run.began, |step| step.ended);
    if end < run.run.ended {
        steps.push(step_outside_nodes(END_OF_RUN.to_owned(), END_OF_RUN, end..run.run.ended));
    }
    steps
}

fn clip(mut step: Step, within: &Range<Duration>) -> Option<Step> {
    let is_outside = step.ended < within.start || step.ready > within.end;
    for time in [&mut step.ready, &mut step.started, &mut step.ended] {
        *time = (*time).clamp(within.start, within.end);
    }
    (!is_outside).then_some(step)
}

/// What threads did in these intervals, which lie outside of all runs. Each part belongs to its innermost span, which
/// is the one that began last.
fn steps_of_spans(log: &Log, frame: u64, intervals: &[Range<Duration>], runs: &[RunSpans<'_>]) -> Vec<Step> {
    let mut spans: Vec<_> = log.spans_of(frame).collect();
    spans.sort_by_key(|span| span.began);
    let mut upcoming = spans.iter().enumerate().peekable();
    let mut open = BinaryHeap::new();
    let mut steps: Vec<(usize, Step)> = Vec::new();
    for interval in intervals {
        let mut now = interval.start;
        while now < interval.end {
            while let Some((index, span)) = upcoming.next_if(|(_index, span)| span.began <= now) {
                open.push((span.began, Reverse(span.ended), index));
            }
            while open.peek().is_some_and(|&(_began, Reverse(ended), _index)| ended <= now) {
                open.pop();
            }
            let next = upcoming.peek().map_or(interval.end, |(_index, span)| span.began.min(interval.end));
            let Some(&(_began, Reverse(ended), index)) = open.peek() else {
                now = next;
                continue;
            };
            let until = next.min(ended);
            match steps.last_mut() {
                // `now > interval.start`: a step does not go on across a run, even one of zero length.
                Some((last, step)) if *last == index && step.ended == now && now > interval.start => step.ended = until,
                _ => {
                    let span = spans[index];
                    let name = name_of_part(span, &(now..until), runs);
                    steps.push((index, step_outside_nodes(name, &span.name, now..until)));
                }
            }
            now = until;
        }
    }
    steps.into_iter().map(|(_index, step)| step).collect()
}

/// The name of a part of a span that lies outside of these runs.
fn name_of_part(span: &Span, part: &Range<Duration>, runs: &[RunSpans<'_>]) -> String {
    let is_after = runs.iter().any(|run| span.began <= run.run.began && run.run.ended <= part.start);
    let is_before = runs.iter().any(|run| part.end <= run.run.began && run.run.ended <= span.ended);
    let name = &span.name;
    match (is_after, is_before) {
        (false, false) => name.clone(),
        (false, true) => format!("{name}, before its jobs"),
        (true, false) => format!("{name}, after its jobs"),
        (true, true) => format!("{name}, between its jobs"),
    }
}

fn step_outside_nodes(name: String, group: &str, interval: Range<Duration>) -> Step {
    let Range { start, end } = interval;
    let (group, held_by) = (group.to_owned(), HeldBy::Start);
    Step { name, group, node: None, worker: None, held_by, ready: start, started: start, ended: end }
}
