//! The steps of a frame: those of its runs' critical paths, and what its threads did before, between and after them.

use std::{cmp::Reverse, collections::BinaryHeap, ops::Range, time::Duration};

use crate::{
    report::moments::{union, without},
    timeline::{Log, Span},
};

use super::{HeldBy, Step, critical_path::RunTimes, stays::Stay};

/// What a run's time is called from the end of its last process on: workers find that nothing is left, and the calling
/// thread is woken if it sleeps.
const END_OF_RUN: &str = "end of the run";

/// All steps of the frame, from its beginning to its end.
pub(super) fn steps(log: &Log, frame: u64, own_time: &[Range<Duration>], runs: &[RunTimes<'_>]) -> Vec<Step> {
    let mut steps = Vec::new();
    let mut until = Duration::ZERO;
    for times in runs {
        // Where two threads have had runs at the same time, the first goes on to its end.
        let start = until.max(times.run.began);
        let within = start..start.max(times.run.ended);
        steps.extend(steps_of_run(times).into_iter().filter_map(|step| clip(step, &within)));
        until = within.end;
    }
    let of_runs = union(runs.iter().map(|times| times.run.began..times.run.ended));
    steps.extend(steps_of_spans(log, frame, &without(own_time, &of_runs), runs));
    steps.sort_by_key(|step| step.ready);
    steps
}

fn steps_of_run(times: &RunTimes<'_>) -> Vec<Step> {
    let step = |stay: &Stay| {
        let process = &times.run.graph.processes[stay.process];
        Step {
            name: process.name.clone(),
            group: process.group().to_owned(),
            process: Some((times.place, stay.process)),
            worker: stay.worker,
            held_by: stay.held_by,
            ready: stay.ready,
            started: stay.started,
            ended: stay.ended,
        }
    };
    let mut steps: Vec<_> = times.critical_path().into_iter().map(step).collect();
    let end = steps.last().map_or(times.run.began, |step| step.ended);
    if end < times.run.ended {
        steps.push(outside_of_processes(END_OF_RUN.to_owned(), END_OF_RUN, end..times.run.ended));
    }
    steps
}

fn clip(mut step: Step, within: &Range<Duration>) -> Option<Step> {
    let is_outside = step.ended < within.start || step.ready > within.end;
    for moment in [&mut step.ready, &mut step.started, &mut step.ended] {
        *moment = (*moment).clamp(within.start, within.end);
    }
    (!is_outside).then_some(step)
}

/// What threads did in these times, which are outside of all runs: each is the innermost span's, which is the one that began last.
fn steps_of_spans(log: &Log, frame: u64, times: &[Range<Duration>], runs: &[RunTimes<'_>]) -> Vec<Step> {
    let mut spans: Vec<_> = log.spans_of(frame).collect();
    spans.sort_by_key(|span| span.began);
    let mut coming = spans.iter().enumerate().peekable();
    let mut open = BinaryHeap::new();
    let mut steps: Vec<(usize, Step)> = Vec::new();
    for time in times {
        let mut now = time.start;
        while now < time.end {
            while let Some((place, span)) = coming.next_if(|(_place, span)| span.began <= now) {
                open.push((span.began, Reverse(span.ended), place));
            }
            while open.peek().is_some_and(|&(_began, Reverse(ended), _place)| ended <= now) {
                open.pop();
            }
            let next = coming.peek().map_or(time.end, |(_place, span)| span.began.min(time.end));
            let Some(&(_began, Reverse(ended), place)) = open.peek() else {
                now = next;
                continue;
            };
            let until = next.min(ended);
            match steps.last_mut() {
                // Not across a run, and there are those that take no time.
                Some((last, step)) if *last == place && step.ended == now && now > time.start => step.ended = until,
                _ => {
                    let span = spans[place];
                    let name = name_of(span, &(now..until), runs);
                    steps.push((place, outside_of_processes(name, &span.name, now..until)));
                }
            }
            now = until;
        }
    }
    steps.into_iter().map(|(_place, step)| step).collect()
}

/// What a part of a span is called, which is outside of these runs.
fn name_of(span: &Span, part: &Range<Duration>, runs: &[RunTimes<'_>]) -> String {
    let is_after = runs.iter().any(|times| span.began <= times.run.began && times.run.ended <= part.start);
    let is_before = runs.iter().any(|times| part.end <= times.run.began && times.run.ended <= span.ended);
    let name = &span.name;
    match (is_after, is_before) {
        (false, false) => name.clone(),
        (false, true) => format!("{name}, before its jobs"),
        (true, false) => format!("{name}, after its jobs"),
        (true, true) => format!("{name}, between its jobs"),
    }
}

fn outside_of_processes(name: String, group: &str, time: Range<Duration>) -> Step {
    let Range { start, end } = time;
    let (group, held_by) = (group.to_owned(), HeldBy::Start);
    Step { name, group, process: None, worker: None, held_by, ready: start, started: start, ended: end }
}
