//! Reports of any graph that was really run, against naive oracles.

use std::{
    collections::BTreeSet,
    hint::black_box,
    sync::{
        Arc, LazyLock, Mutex,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use drawloom::{
    graph::{Closure, FrameGraph, Schedule},
    report::{FrameReport, HeldBy, Replay, SchedulerCosts, Slack, Step},
    task::Scheduler,
    timeline::{Chunk, Labels, Log, Run},
};
use proptest::{collection::vec, prelude::*, sample::Index};

/// A node: what it depends on, how many items it has, what each costs, and what it counts as.
#[derive(Clone, Debug)]
struct Sketch {
    dependencies: Vec<Index>,
    width: usize,
    cost: u64,
    group: usize,
}

fn any_graph() -> impl Strategy<Value = Vec<Sketch>> {
    let node = (vec(any::<Index>(), 0..4), 0..9_usize, 0..50_u64, 0..4_usize);
    let node = node.prop_map(|(dependencies, width, cost, group)| Sketch { dependencies, width, cost, group });
    vec(node, 1..10)
}

/// What a run is lent: the clock that its chunks move, where it is no real one, and the group that has nothing to do.
#[derive(Default)]
struct Call {
    clock: Option<Arc<AtomicU64>>,
    free: Option<String>,
}

impl Call {
    fn spend(&self, time: u64) {
        match &self.clock {
            Some(clock) => _ = clock.fetch_add(time, Ordering::Relaxed),
            None => (0..time).for_each(|step| _ = black_box(step)),
        }
    }
}

fn schedule_of(sketch: &[Sketch]) -> Schedule<Closure<'static, Call>> {
    let mut graph = FrameGraph::new();
    let mut nodes = Vec::new();
    for (index, &Sketch { ref dependencies, width, cost, group }) in sketch.iter().enumerate() {
        let group = format!("group {group}");
        let label = Labels { process: Some(group.clone()), ..Labels::default() };
        let body = Closure::new(move |call: &Call, range, _worker| {
            range.for_each(|item| call.spend(cost + item as u64));
            Ok(())
        });
        let width = move |call: &Call| if call.free.as_ref() == Some(&group) { 0 } else { width };
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

/// What is recorded of a frame of two runs, and what the thread does before, between and after them; and the frame's number.
fn frame_of(schedule: &mut Schedule<Closure<'_, Call>>, scheduler: &Scheduler, call: &Call) -> (Log, u64) {
    let timeline = scheduler.timeline();
    timeline.take();
    timeline.start();
    timeline.mark_frame();
    let record = timeline.span("record");
    for serial in [30, 20] {
        call.spend(serial);
        schedule.run(scheduler, call).unwrap();
    }
    call.spend(40);
    drop(record);
    call.spend(1_000);
    let submit = timeline.span("submit");
    call.spend(10);
    drop(submit);
    timeline.stop();
    let log = timeline.take();
    let frame = log.runs[0].frame;
    (log, frame)
}

/// A worker's stay at a node.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stay {
    node: usize,
    worker: usize,
    started: Duration,
    ended: Duration,
}

/// When each node could have begun, and when it did.
fn ready_and_started(run: &Run) -> Vec<(Duration, Duration)> {
    let chunks_of = |node| run.chunks.iter().chain(&run.empty).filter(move |chunk| chunk.node == node);
    let ended = |node| chunks_of(node).map(|chunk| chunk.ended).max().expect("it has chunks, or none to be seen");
    let nodes = run.graph.nodes.iter().enumerate();
    let times = nodes.map(|(index, node)| {
        let ready = node.dependencies.iter().map(|&dependency| ended(dependency)).max().unwrap_or(run.began);
        (ready, chunks_of(index).map(|chunk| chunk.started).min().unwrap())
    });
    times.collect()
}

/// All stays in the order in which they ended, and which of them had to end before which.
fn stays_and_edges(run: &Run) -> (Vec<Stay>, Vec<[usize; 2]>) {
    let mut chunks: Vec<_> = run.chunks.iter().chain(&run.empty).collect();
    chunks.sort_by_key(|chunk| (chunk.ended, chunk.started, chunk.node));
    let mut stays: Vec<Stay> = Vec::new();
    for chunk in chunks {
        let &Chunk { node, worker, started, ended, .. } = chunk;
        match stays.iter_mut().rfind(|stay| stay.worker == worker) {
            Some(last) if last.node == node => last.ended = ended,
            _ => stays.push(Stay { node, worker, started, ended }),
        }
    }
    stays.sort_by_key(|stay| (stay.ended, stay.started, stay.node));
    let mut edges = Vec::new();
    for (to, stay) in stays.iter().enumerate() {
        let dependencies = &run.graph.nodes[stay.node].dependencies;
        let is_before = |&from: &usize| dependencies.contains(&stays[from].node);
        edges.extend((0..stays.len()).filter(is_before).map(|from| [from, to]));
        let previous = (0..to).rfind(|&from| stays[from].worker == stay.worker);
        edges.extend(previous.map(|from| [from, to]));
    }
    (stays, edges)
}

/// When each stay ends that begins when it can and takes so long; each no earlier than it has to.
fn ends(run: &Run, weights: &[Duration], edges: &[[usize; 2]], at_least: impl Fn(usize) -> Duration) -> Vec<Duration> {
    let mut ends: Vec<_> = (0..weights.len()).map(|stay| at_least(stay).max(run.began + weights[stay])).collect();
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
    let (stays, edges) = stays_and_edges(run);
    let ready = |stay: usize| {
        let before = edges.iter().filter(|[_, to]| *to == stay);
        before.map(|&[from, _]| stays[from].ended).max().unwrap_or(run.began)
    };
    let weights: Vec<_> = (0..stays.len()).map(|stay| stays[stay].ended - ready(stay).max(run.began)).collect();
    let end = stays.iter().map(|stay| stay.ended).max().unwrap();
    let longest = ends(run, &weights, &edges, |_| Duration::ZERO).into_iter().max().unwrap();
    prop_assert_eq!(longest, end);
    prop_assert_eq!(path.iter().map(|step| step.duration()).sum::<Duration>(), end - run.began);
    let mut places = Vec::new();
    for step in path {
        let (_, node) = step.node.unwrap();
        let stay = Stay { node, worker: step.worker.unwrap(), started: step.started, ended: step.ended };
        places.extend(stays.iter().position(|other| *other == stay));
        prop_assert!(slack[node].time.is_zero());
    }
    prop_assert_eq!(places.len(), path.len());
    prop_assert_eq!(path[0].held_by, HeldBy::Start);
    for (pair, steps) in places.windows(2).zip(path.windows(2)) {
        prop_assert!(edges.iter().any(|edge| edge == pair), "{:?}", steps);
        let [from, to] = [stays[pair[0]], stays[pair[1]]];
        let depends = run.graph.nodes[to.node].dependencies.contains(&from.node);
        prop_assert_eq!(steps[1].held_by, if depends { HeldBy::Dependency } else { HeldBy::Worker });
        prop_assert!(depends || from.worker == to.worker);
    }
    if run.workers == 1 {
        let all = (0..stays.len()).filter(|&stay| !weights[stay].is_zero()).collect::<Vec<_>>();
        places.retain(|&stay| !weights[stay].is_zero());
        prop_assert_eq!(places, all);
    }
    for (node, slack) in slack.iter().enumerate() {
        let end_if_late = |by| {
            let late = |stay: usize| stays[stay].node == node;
            let at_least = |stay| if late(stay) { stays[stay].ended + by } else { Duration::ZERO };
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
    for (place, run) in log.runs.iter().enumerate() {
        let steps = path.iter().filter(|step| step.node.is_some_and(|(run, _)| run == place));
        let (of_run, rest) = slack.split_at(run.graph.nodes.len());
        prop_assert!(of_run.iter().enumerate().all(|(index, slack)| slack.node == (place, index)));
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
        let at_work: Duration = wait.meanwhile.iter().map(|(_, time)| *time).sum();
        prop_assert!(at_work <= wait.waited() * report.workers.len() as u32);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(96) })]

    #[test]
    fn a_report_agrees_with_naive_oracles(sketch in any_graph(), always_parallel in any::<bool>(), wake in 0..20_u64) {
        let mut schedule = schedule_of(&sketch);
        schedule.always_parallel(always_parallel);
        let costs = SchedulerCosts { wake: Duration::from_micros(wake), ..SchedulerCosts::ZERO };
        for scheduler in &*SCHEDULERS {
            let scheduler = scheduler.lock().unwrap();
            let (log, frame) = frame_of(&mut schedule, &scheduler, &Call::default());
            let report = FrameReport::new(&log, frame, &costs).unwrap();
            check(&report, &log)?;
            let replay = Replay::of_frame(&log, frame, costs).unwrap();
            prop_assert_eq!(report.replayed, replay.frame_time(scheduler.workers()));
            for what_if in &report.what_if {
                let time = replay.clone().without_work_of(&what_if.group).frame_time(scheduler.workers());
                prop_assert_eq!(what_if.time, time.min(report.replayed));
                prop_assert_eq!(what_if.saved, report.replayed - what_if.time);
            }
            let groups: BTreeSet<_> = sketch.iter().map(|node| node.group).collect();
            prop_assert_eq!(report.what_if.len(), groups.len());
            prop_assert!(report.what_if.is_sorted_by(|one, other| one.saved >= other.saved));
            let on = [1, 2, 4, 8, 16].map(|workers| (workers, replay.frame_time(workers)));
            prop_assert_eq!(report.on_workers.as_slice(), on);
        }
    }

    #[test]
    fn what_a_group_would_save_is_what_it_does_save(sketch in any_graph()) {
        let clock = Arc::new(AtomicU64::new(0));
        let of_scheduler = Arc::clone(&clock);
        let now = move || Duration::from_micros(of_scheduler.load(Ordering::Relaxed));
        let scheduler = Scheduler::builder().workers(1).timeline_clock(now).build().unwrap();
        let mut schedule = schedule_of(&sketch);
        let mut report = |free: Option<&str>| {
            let call = Call { clock: Some(Arc::clone(&clock)), free: free.map(str::to_owned) };
            let (log, frame) = frame_of(&mut schedule, &scheduler, &call);
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

/// Each is used by one test at a time, as others' runs would be recorded too.
static SCHEDULERS: LazyLock<[Mutex<Scheduler>; 3]> = LazyLock::new(|| {
    [1, 2, 4].map(|workers| Mutex::new(Scheduler::new(workers).expect("four threads can be started")))
});
