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
    report::{FrameReport, Prices, Replay, Step},
    task::Scheduler,
    timeline::{Chunk, Labels, Log, Run},
};
use proptest::{collection::vec, prelude::*, sample::Index};

/// A process: what it depends on, how many items it has, what each costs, and what it counts as.
#[derive(Clone, Debug)]
struct Sketch {
    dependencies: Vec<Index>,
    width: usize,
    cost: u64,
    group: usize,
}

fn any_graph() -> impl Strategy<Value = Vec<Sketch>> {
    let process = (vec(any::<Index>(), 0..4), 0..9_usize, 0..50_u64, 0..4_usize);
    let process = process.prop_map(|(dependencies, width, cost, group)| Sketch { dependencies, width, cost, group });
    vec(process, 1..10)
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
    let mut processes = Vec::new();
    for (index, &Sketch { ref dependencies, width, cost, group }) in sketch.iter().enumerate() {
        let group = format!("group {group}");
        let label = Labels { process: Some(group.clone()), ..Labels::default() };
        let body = Closure::new(move |call: &Call, range, _worker| {
            range.for_each(|item| call.spend(cost + item as u64));
            Ok(())
        });
        let width = move |call: &Call| if call.free.as_ref() == Some(&group) { 0 } else { width };
        let process = graph.add(format!("p{index}"), body.with_width(width));
        graph.label(process, label);
        graph.keep(process);
        for dependency in dependencies.iter().filter(|_| index > 0).map(|dependency| dependency.index(index)) {
            graph.order(processes[dependency], process);
        }
        processes.push(process);
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

/// When each process ended, and how long after it could have begun.
fn ends_and_weights(run: &Run) -> Vec<(Duration, Duration)> {
    let mut all: Vec<(Duration, Duration)> = Vec::new();
    for (index, process) in run.graph.processes.iter().enumerate() {
        let ready = process.dependencies.iter().map(|&dependency| all[dependency].0).max().unwrap_or(run.began);
        let chunks = run.chunks.iter().chain(&run.empty).filter(|chunk| chunk.process == index);
        let ended = chunks.map(|chunk| chunk.ended).max().expect("a process has chunks, or has none to be seen");
        all.push((ended, ended - ready));
    }
    all
}

/// The longest of all ways that end with the process.
fn longest_way(run: &Run, weights: &[(Duration, Duration)], process: usize) -> Duration {
    let before = run.graph.processes[process].dependencies.iter();
    weights[process].1 + before.map(|&before| longest_way(run, weights, before)).max().unwrap_or_default()
}

/// When the last process ends if one of them ends so much later.
fn end_if_late(run: &Run, weights: &[(Duration, Duration)], late: usize, by: Duration) -> Duration {
    let mut ends: Vec<Duration> = Vec::new();
    for (index, process) in run.graph.processes.iter().enumerate() {
        let ready = process.dependencies.iter().map(|&dependency| ends[dependency]).max().unwrap_or(run.began);
        ends.push(ready + weights[index].1 + if index == late { by } else { Duration::ZERO });
    }
    ends.into_iter().max().unwrap()
}

fn check(report: &FrameReport, log: &Log) -> Result<(), TestCaseError> {
    let took: Duration = log.spans.iter().map(|span| span.ended - span.began).sum();
    prop_assert_eq!(report.took, took);
    let path = &report.critical_path;
    prop_assert_eq!(path.iter().map(Step::took).sum::<Duration>(), took);
    prop_assert_eq!(path[0].ready, report.began);
    prop_assert!(path.iter().all(|step| step.ready <= step.started && step.started <= step.ended));
    for pair in path.windows(2) {
        let is_pause = pair[0].ended == log.spans[0].ended && pair[1].ready == log.spans[1].began;
        prop_assert!(pair[0].ended == pair[1].ready || is_pause, "{:?}", pair);
    }
    prop_assert_eq!(report.shares.iter().map(|share| share.took()).sum::<Duration>(), took);
    let mut slack = report.slack.iter();
    for (place, run) in log.runs.iter().enumerate() {
        let weights = ends_and_weights(run);
        let steps = || path.iter().filter(|step| step.process.is_some_and(|(run, _)| run == place));
        let longest = (0..weights.len()).map(|process| longest_way(run, &weights, process)).max().unwrap();
        prop_assert_eq!(steps().map(Step::took).sum::<Duration>(), longest);
        let critical: BTreeSet<_> = steps().filter_map(|step| step.process).collect();
        let end = weights.iter().map(|&(end, _)| end).max().unwrap();
        for (index, slack) in slack.by_ref().take(weights.len()).enumerate() {
            prop_assert_eq!(slack.process, (place, index));
            prop_assert!(slack.time.is_zero() || !critical.contains(&slack.process));
            prop_assert_eq!(end_if_late(run, &weights, index, slack.time), end);
            prop_assert!(end_if_late(run, &weights, index, slack.time + Duration::from_nanos(1)) > end);
        }
    }
    prop_assert_eq!(slack.len(), 0);
    let all = || log.runs.iter().flat_map(|run| run.chunks.iter().chain(&run.empty));
    for (index, worker) in report.workers.iter().enumerate() {
        prop_assert_eq!(worker.busy + worker.searching + worker.asleep + worker.other, took);
        let ran: Duration = all().filter(|chunk| chunk.worker == index).map(Chunk::took).sum();
        prop_assert_eq!(worker.busy, ran);
    }
    let chunks: usize = log.runs.iter().map(|run| run.chunks.len()).sum();
    prop_assert_eq!(report.workers.iter().map(|worker| worker.chunks).sum::<usize>(), chunks);
    let mut waits: Vec<Duration> = Vec::new();
    for run in &log.runs {
        for (index, (ended, weight)) in ends_and_weights(run).into_iter().enumerate() {
            let started = run.chunks.iter().chain(&run.empty).filter(|chunk| chunk.process == index);
            waits.push(started.map(|chunk| chunk.started).min().unwrap() - (ended - weight));
        }
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
    fn a_report_agrees_with_naive_oracles(sketch in any_graph(), always_shares in any::<bool>(), wake in 0..20_u64) {
        let mut schedule = schedule_of(&sketch);
        schedule.always_share(always_shares);
        let prices = Prices { wake: Duration::from_micros(wake), ..Prices::FREE };
        for scheduler in &*SCHEDULERS {
            let scheduler = scheduler.lock().unwrap();
            let (log, frame) = frame_of(&mut schedule, &scheduler, &Call::default());
            let report = FrameReport::new(&log, frame, &prices).unwrap();
            check(&report, &log)?;
            let replay = Replay::of_frame(&log, frame, prices).unwrap();
            prop_assert_eq!(report.replayed, replay.frame_time(scheduler.workers()));
            for what_if in &report.what_if {
                let time = replay.clone().with_free(&what_if.group).frame_time(scheduler.workers());
                prop_assert_eq!(what_if.time, time.min(report.replayed));
                prop_assert_eq!(what_if.saved, report.replayed - what_if.time);
            }
            let groups: BTreeSet<_> = sketch.iter().map(|process| process.group).collect();
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
            let report = FrameReport::new(&log, frame, &Prices::FREE).unwrap();
            check(&report, &log).map(|()| report)
        };
        let whole = report(None)?;
        prop_assert_eq!(whole.replayed, whole.took);
        for what_if in &whole.what_if {
            prop_assert_eq!(report(Some(&what_if.group))?.took, what_if.time, "without {}", what_if.group);
        }
    }
}

/// Each is used by one test at a time, as others' runs would be recorded too.
static SCHEDULERS: LazyLock<[Mutex<Scheduler>; 3]> = LazyLock::new(|| {
    [1, 2, 4].map(|workers| Mutex::new(Scheduler::new(workers).expect("four threads can be started")))
});
