//! Reports of real runs of any graph, checked against naive oracles.

use std::collections::BTreeSet;
use std::hint::black_box;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, Mutex};
use std::time::Duration;

use drawloom_jobs::graph::{Closure, FrameGraph, Schedule};
use drawloom_jobs::report::{FrameReport, HeldBy, Replay, SchedulerCosts, Slack, Step};
use drawloom_jobs::task::Scheduler;
use drawloom_jobs::timeline::{Chunk, Labels, Log, Run};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::Index;

/// A node: its dependencies, its number of items, the time of each, and its group.
#[derive(Clone, Debug)]
struct NodeSpec {
    dependencies: Vec<Index>,
    width: usize,
    cost: u64,
    group: usize,
}

fn any_graph() -> impl Strategy<Value = Vec<NodeSpec>> {
    let node = (vec(any::<Index>(), 0..4), 0..9_usize, 0..50_u64, 0..4_usize);
    let node = node.prop_map(|(dependencies, width, cost, group)| NodeSpec { dependencies, width, cost, group });
    vec(node, 1..10)
}

/// The context of a run.
#[derive(Default)]
struct Context {
    /// The simulated clock that chunks advance, unless time is real.
    clock: Option<Arc<AtomicU64>>,
    /// The group without work.
    free: Option<String>,
}

impl Context {
    fn spend(&self, time: u64) {
        match &self.clock {
            Some(clock) => _ = clock.fetch_add(time, Ordering::Relaxed),
            None => (0..time).for_each(|step| _ = black_box(step)),
        }
    }
}

fn schedule_of(specs: &[NodeSpec]) -> Schedule<Closure<'static, Context>> {
    let mut graph = FrameGraph::new();
    let mut nodes = Vec::new();
    for (index, &NodeSpec { ref dependencies, width, cost, group }) in specs.iter().enumerate() {
        let group = format!("group {group}");
        let label = Labels { process: Some(group.as_str().into()), ..Labels::default() };
        let body = Closure::new(move |context: &Context, range, _worker| {
            range.for_each(|item| context.spend(cost + item as u64));
            Ok(())
        });
        let width = move |context: &Context| if context.free.as_ref() == Some(&group) { 0 } else { width };
        let node = graph.add(format!("p{index}"), body.with_width(width));
        graph.label(node, label);
        graph.keep(node);
        for dependency in dependencies.iter().filter(|_| index > 0).map(|dependency| dependency.index(index)) {
            graph.order(nodes[dependency], node);
        }
        nodes.push(node);
    }
    graph.compile().unwrap()
}

/// Records a frame of two runs, and of spans before, between and after them. Returns the log and the frame's number.
fn record_frame(schedule: &mut Schedule<Closure<'_, Context>>, scheduler: &Scheduler, context: &Context) -> (Log, u64) {
    let timeline = scheduler.timeline();
    timeline.take();
    timeline.start();
    timeline.mark_frame();
    let record = timeline.span("record");
    for serial in [30, 20] {
        context.spend(serial);
        schedule.run(scheduler, context).unwrap();
    }
    context.spend(40);
    drop(record);
    context.spend(1_000);
    let submit = timeline.span("submit");
    context.spend(10);
    drop(submit);
    timeline.stop();
    let log = timeline.take();
    let frame = log.runs[0].frame;
    (log, frame)
}

/// A worker span: see [`Step`].
#[derive(Clone, Copy, Debug, PartialEq)]
struct WorkerSpan {
    node: usize,
    worker: usize,
    started: Duration,
    ended: Duration,
}

/// The times at which each node was ready and at which it started.
fn ready_and_started(run: &Run) -> Vec<(Duration, Duration)> {
    let chunks_of = |node| run.chunks.iter().chain(&run.empty).filter(move |chunk| chunk.node == node);
    let ended = |node| chunks_of(node).map(|chunk| chunk.ended).max().expect("every node has a chunk or an empty one");
    let nodes = run.graph.nodes.iter().enumerate();
    let times = nodes.map(|(index, node)| {
        let ready = node.dependencies.iter().map(|&dependency| ended(dependency)).max().unwrap_or(run.began);
        (ready, chunks_of(index).map(|chunk| chunk.started).min().unwrap())
    });
    times.collect()
}

/// All worker spans, ordered by their end, and the pairs in which the first had to end before the second.
fn spans_and_edges(run: &Run) -> (Vec<WorkerSpan>, Vec<[usize; 2]>) {
    let mut chunks: Vec<_> = run.chunks.iter().chain(&run.empty).collect();
    chunks.sort_by_key(|chunk| (chunk.ended, chunk.started, chunk.node));
    let mut spans: Vec<WorkerSpan> = Vec::new();
    for chunk in chunks {
        let &Chunk { node, worker, started, ended, .. } = chunk;
        match spans.iter_mut().rfind(|span| span.worker == worker) {
            Some(last) if last.node == node => last.ended = ended,
            _ => spans.push(WorkerSpan { node, worker, started, ended }),
        }
    }
    spans.sort_by_key(|span| (span.ended, span.started, span.node));
    let mut edges = Vec::new();
    for (to, span) in spans.iter().enumerate() {
        let dependencies = &run.graph.nodes[span.node].dependencies;
        let is_before = |&from: &usize| dependencies.contains(&spans[from].node);
        edges.extend((0..spans.len()).filter(is_before).map(|from| [from, to]));
        let previous = (0..to).rfind(|&from| spans[from].worker == span.worker);
        edges.extend(previous.map(|from| [from, to]));
    }
    (spans, edges)
}

/// The end of each span if it begins as early as possible, takes as long as its weight, and ends no earlier than
/// `at_least`.
fn ends(run: &Run, weights: &[Duration], edges: &[[usize; 2]], at_least: impl Fn(usize) -> Duration) -> Vec<Duration> {
    let mut ends: Vec<_> = (0..weights.len()).map(|span| at_least(span).max(run.began + weights[span])).collect();
    loop {
        let before = ends.clone();
        for &[from, to] in edges {
            ends[to] = ends[to].max(ends[from] + weights[to]);
        }
        if ends == before {
            return ends;
        }
    }
}

fn check_run(run: &Run, path: &[&Step], slack: &[Slack]) -> Result<(), TestCaseError> {
    let (spans, edges) = spans_and_edges(run);
    let ready = |span: usize| {
        let before = edges.iter().filter(|[_, to]| *to == span);
        before.map(|&[from, _]| spans[from].ended).max().unwrap_or(run.began)
    };
    let weights: Vec<_> = (0..spans.len()).map(|span| spans[span].ended - ready(span).max(run.began)).collect();
    let end = spans.iter().map(|span| span.ended).max().unwrap();
    let longest = ends(run, &weights, &edges, |_| Duration::ZERO).into_iter().max().unwrap();
    prop_assert_eq!(longest, end);
    prop_assert_eq!(path.iter().map(|step| step.duration()).sum::<Duration>(), end - run.began);
    let mut path_spans = Vec::new();
    for step in path {
        let (_, node) = step.node.unwrap();
        let span = WorkerSpan { node, worker: step.worker.unwrap(), started: step.started, ended: step.ended };
        path_spans.extend(spans.iter().position(|other| *other == span));
        prop_assert!(slack[node].time.is_zero());
    }
    prop_assert_eq!(path_spans.len(), path.len());
    prop_assert_eq!(path[0].held_by, HeldBy::Start);
    for (pair, steps) in path_spans.windows(2).zip(path.windows(2)) {
        prop_assert!(edges.iter().any(|edge| edge == pair), "{:?}", steps);
        let [from, to] = [spans[pair[0]], spans[pair[1]]];
        let depends = run.graph.nodes[to.node].dependencies.contains(&from.node);
        prop_assert_eq!(steps[1].held_by, if depends { HeldBy::Dependency } else { HeldBy::Worker });
        prop_assert!(depends || from.worker == to.worker);
    }
    if run.workers == 1 {
        let all = (0..spans.len()).filter(|&span| !weights[span].is_zero()).collect::<Vec<_>>();
        path_spans.retain(|&span| !weights[span].is_zero());
        prop_assert_eq!(path_spans, all);
    }
    for (node, slack) in slack.iter().enumerate() {
        let end_if_late = |by| {
            let late = |span: usize| spans[span].node == node;
            let at_least = |span| if late(span) { spans[span].ended + by } else { Duration::ZERO };
            ends(run, &weights, &edges, at_least).into_iter().max().unwrap()
        };
        prop_assert_eq!(end_if_late(slack.time), end);
        prop_assert!(end_if_late(slack.time + Duration::from_nanos(1)) > end);
    }
    Ok(())
}

fn check(report: &FrameReport, log: &Log) -> Result<(), TestCaseError> {
    let took: Duration = log.spans.iter().map(|span| span.ended - span.began).sum();
    prop_assert_eq!(report.duration, took);
    let path = &report.critical_path;
    prop_assert_eq!(path.iter().map(Step::duration).sum::<Duration>(), took);
    prop_assert_eq!(path[0].ready, report.began);
    prop_assert!(path.iter().all(|step| step.ready <= step.started && step.started <= step.ended));
    for pair in path.windows(2) {
        let is_pause = pair[0].ended == log.spans[0].ended && pair[1].ready == log.spans[1].began;
        prop_assert!(pair[0].ended == pair[1].ready || is_pause, "{:?}", pair);
    }
    prop_assert_eq!(report.shares.iter().map(|share| share.duration()).sum::<Duration>(), took);
    let mut slack = report.slack.as_slice();
    for (index, run) in log.runs.iter().enumerate() {
        let steps = path.iter().filter(|step| step.node.is_some_and(|(run, _)| run == index));
        let (of_run, rest) = slack.split_at(run.graph.nodes.len());
        prop_assert!(of_run.iter().enumerate().all(|(node, slack)| slack.node == (index, node)));
        check_run(run, &steps.collect::<Vec<_>>(), of_run)?;
        slack = rest;
    }
    prop_assert!(slack.is_empty());
    let all = || log.runs.iter().flat_map(|run| run.chunks.iter().chain(&run.empty));
    for (index, worker) in report.workers.iter().enumerate() {
        prop_assert_eq!(worker.busy + worker.searching + worker.asleep + worker.other, took);
        let ran: Duration = all().filter(|chunk| chunk.worker == index).map(Chunk::duration).sum();
        prop_assert_eq!(worker.busy, ran);
    }
    let chunks: usize = log.runs.iter().map(|run| run.chunks.len()).sum();
    prop_assert_eq!(report.workers.iter().map(|worker| worker.chunks).sum::<usize>(), chunks);
    let mut waits: Vec<Duration> = Vec::new();
    for run in &log.runs {
        waits.extend(ready_and_started(run).into_iter().map(|(ready, started)| started - ready));
    }
    waits.retain(|wait| !wait.is_zero());
    waits.sort_unstable_by_key(|&wait| std::cmp::Reverse(wait));
    waits.truncate(10);
    prop_assert_eq!(report.queue_waits.iter().map(|wait| wait.waited()).collect::<Vec<_>>(), waits);
    for wait in &report.queue_waits {
        let worked: Duration = wait.meanwhile.iter().map(|(_, time)| *time).sum();
        prop_assert!(worked <= wait.waited() * report.workers.len() as u32);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(48) })]

    #[test]
    fn a_report_agrees_with_naive_oracles(specs in any_graph(), always_parallel in any::<bool>(), wake in 0..20_u64) {
        let mut schedule = schedule_of(&specs);
        schedule.always_parallel(always_parallel);
        let costs = SchedulerCosts { wake: Duration::from_micros(wake), ..SchedulerCosts::ZERO };
        for scheduler in &*SCHEDULERS {
            let scheduler = scheduler.lock().unwrap();
            let (log, frame) = record_frame(&mut schedule, &scheduler, &Context::default());
            let report = FrameReport::new(&log, frame, &costs).unwrap();
            check(&report, &log)?;
            let replay = Replay::of_frame(&log, frame, costs).unwrap();
            prop_assert_eq!(report.replayed, replay.frame_time(scheduler.workers()));
            for what_if in &report.what_if {
                let time = replay.clone().without_work_of(&what_if.group).frame_time(scheduler.workers());
                prop_assert_eq!(what_if.time, time.min(report.replayed));
                prop_assert_eq!(what_if.saved, report.replayed - what_if.time);
            }
            let groups: BTreeSet<_> = specs.iter().map(|node| node.group).collect();
            prop_assert_eq!(report.what_if.len(), groups.len());
            prop_assert!(report.what_if.is_sorted_by(|one, other| one.saved >= other.saved));
            let on = [1, 2, 4, 8, 16].map(|workers| (workers, replay.frame_time(workers)));
            prop_assert_eq!(report.on_workers.as_slice(), on);
        }
    }

    #[test]
    fn removing_a_group_saves_what_was_predicted(specs in any_graph()) {
        let clock = Arc::new(AtomicU64::new(0));
        let clock_of_scheduler = Arc::clone(&clock);
        let now = move || Duration::from_micros(clock_of_scheduler.load(Ordering::Relaxed));
        let scheduler = Scheduler::builder().workers(1).timeline_clock(now).build().unwrap();
        let mut schedule = schedule_of(&specs);
        let mut report = |free: Option<&str>| {
            let context = Context { clock: Some(Arc::clone(&clock)), free: free.map(str::to_owned) };
            let (log, frame) = record_frame(&mut schedule, &scheduler, &context);
            let report = FrameReport::new(&log, frame, &SchedulerCosts::ZERO).unwrap();
            check(&report, &log).map(|()| report)
        };
        let whole = report(None)?;
        prop_assert_eq!(whole.replayed, whole.duration);
        for what_if in &whole.what_if {
            prop_assert_eq!(report(Some(&what_if.group))?.duration, what_if.time, "without {}", what_if.group);
        }
    }
}

/// Used by one test at a time, because a log has all runs of its scheduler.
static SCHEDULERS: LazyLock<[Mutex<Scheduler>; 3]> =
    LazyLock::new(|| [1, 2, 4].map(|workers| Mutex::new(Scheduler::new(workers).expect("threads can be started"))));
