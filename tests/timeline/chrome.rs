//! Chrome traces: what viewers need of one, checked against the log, of real runs and of any log.

use std::{
    collections::HashSet,
    hint::black_box,
    ops::Range,
    sync::{LazyLock, Mutex},
    time::Duration,
};

use drawloom::{
    graph::{FrameGraph, Node, NodeError, Schedule},
    task::{Scheduler, Worker},
    timeline::{Chunk, Idle, IdleKind, Log, Run},
};
use proptest::{collection::vec, prelude::*};
use serde_json::json;

use crate::trace::{Event, Trace, nanoseconds};

/// A node of so many items, in chunks of the caller's size. The item of that number fails.
#[derive(Clone, Debug)]
struct Busy {
    width: usize,
    pinned: bool,
    fails_at: Option<usize>,
}

impl Node<usize> for Busy {
    fn width(&self, _chunk: &usize) -> usize {
        self.width
    }

    fn chunk(&self, chunk: &usize) -> usize {
        *chunk
    }

    fn pinned(&self) -> bool {
        self.pinned
    }

    fn run(&self, _chunk: &usize, range: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
        range.clone().for_each(|item| _ = black_box((0..100).fold(item, |sum, step| black_box(sum ^ step))));
        if self.fails_at.is_some_and(|item| range.contains(&item)) { Err("it was to fail".into()) } else { Ok(()) }
    }
}

/// A graph as plain data: each node, and which of those before it it waits for.
type Sketch = Vec<(Busy, HashSet<usize>)>;

/// Of ten nodes, so many have an item that fails.
fn any_sketch(fails: u32) -> impl Strategy<Value = Sketch> {
    let width = prop_oneof![1 => Just(0), 2 => 1..4_usize, 2 => 0..60_usize];
    let fails_at = (0..10_u32, 0..30_usize).prop_map(move |(roll, item)| (roll < fails).then_some(item));
    let busy = (width, prop::bool::weighted(0.2), fails_at).prop_map(|(width, pinned, fails_at)| Busy {
        width,
        pinned,
        fails_at,
    });
    vec((busy, vec(any::<prop::sample::Index>(), 0..4)), 1..20).prop_map(|nodes| {
        let waits_for = |index: usize, picks: Vec<prop::sample::Index>| {
            picks.iter().filter(|_| index > 0).map(|pick| pick.index(index)).collect()
        };
        let nodes = nodes.into_iter().enumerate();
        nodes.map(|(index, (busy, picks))| (busy, waits_for(index, picks))).collect()
    })
}

fn compile(sketch: &[(Busy, HashSet<usize>)]) -> Schedule<Busy> {
    let mut graph = FrameGraph::new();
    let mut nodes = Vec::new();
    for (index, (busy, before)) in sketch.iter().enumerate() {
        let node = graph.add(format!("p{index}"), busy.clone());
        graph.keep(node);
        before.iter().for_each(|&before| graph.order(nodes[before], node));
        nodes.push(node);
    }
    graph.compile().expect("it has no cycle")
}

/// What the timeline says of a few runs, two a frame, each within a span.
fn recorded(schedule: &mut Schedule<Busy>, scheduler: &Scheduler, chunks: &[usize]) -> Log {
    let timeline = scheduler.timeline();
    timeline.take();
    timeline.start();
    for (run, chunk) in chunks.iter().enumerate() {
        if run % 2 == 0 {
            timeline.mark_frame();
        }
        let _outer = timeline.span("record");
        let _inner = timeline.span("run");
        _ = schedule.run(scheduler, chunk);
        timeline.count("runs", run as f64);
    }
    timeline.stop();
    timeline.take()
}

/// What must hold of the trace of every log.
pub fn check(log: &Log) {
    let trace = Trace::of(log);
    check_lanes(log, &trace);
    check_jobs(log, &trace);
    check_arrows(log, &trace);
    check_ready(log, &trace);
    let frames: Vec<_> = trace.of_kind("i").map(|event| (event.name.clone(), event.began)).collect();
    let expected = log.frames.iter().map(|frame| (format!("frame {}", frame.number), nanos(frame.began)));
    assert_eq!(frames, expected.collect::<Vec<_>>());
    assert!(trace.of_kind("i").all(|event| event.all["s"] == "g"));
    assert_eq!(trace.slices("span").count(), log.spans.len());
    assert_eq!(trace.other_data["dropped"], log.all_dropped());
    assert_eq!(trace.other_data["incomplete_runs"], log.runs.iter().filter(|run| !run.complete).count());
}

fn check_lanes(log: &Log, trace: &Trace) {
    let names = trace.thread_names();
    let lanes: HashSet<_> = names.iter().map(|&(_, thread, _)| thread).collect();
    assert_eq!(lanes.len(), names.len(), "no two lanes are one");
    for (worker, record) in log.workers.iter().enumerate() {
        assert_eq!(names[worker], (1, worker as u64 + 1, record.name.clone()));
    }
    let order = trace.of_kind("M").filter(|event| event.name == "thread_sort_index");
    let order: Vec<_> = order.map(|event| (event.thread, event.arguments["sort_index"].as_u64().unwrap())).collect();
    assert_eq!(order.len(), names.len());
    assert!(order.is_sorted() && order.windows(2).all(|pair| pair[0].1 < pair[1].1), "{order:?}");
    let slices: Vec<&Event> = trace.of_kind("X").collect();
    for (index, slice) in slices.iter().enumerate() {
        assert!(lanes.contains(&slice.thread), "{slice:?} is on a lane without a name");
        for other in slices[..index].iter().filter(|other| other.is_on_lane_of(slice)) {
            let apart = slice.ended <= other.began || other.ended <= slice.began;
            assert!(apart || slice.contains(other) || other.contains(slice), "{slice:?} and {other:?}");
        }
    }
    for (worker, record) in log.workers.iter().enumerate() {
        let idle = trace.slices("idle").filter(|slice| slice.thread == worker as u64 + 1);
        let idle: Vec<_> = idle.map(|slice| (slice.name.as_str(), slice.began, slice.ended)).collect();
        let name = |idle: &Idle| if idle.kind == IdleKind::Asleep { "asleep" } else { "searching" };
        let expected = record.idle.iter().map(|idle| (name(idle), nanos(idle.began), nanos(idle.ended)));
        assert_eq!(idle, expected.collect::<Vec<_>>());
    }
}

fn check_jobs(log: &Log, trace: &Trace) {
    for (category, list) in [("job", (|run| &run.chunks) as fn(&Run) -> &Vec<Chunk>), ("empty", |run| &run.empty)] {
        let mut expected: Vec<String> = Vec::new();
        for (index, run) in log.runs.iter().enumerate() {
            for chunk in list(run) {
                let node = &run.graph.nodes[chunk.node];
                let mut arguments = json!({
                    "items": format!("{}..{}", chunk.items.start, chunk.items.end),
                    "opened_us": nanos(chunk.opened),
                    "stolen": chunk.stolen,
                    "frame": run.frame,
                    "run": index,
                });
                if let Some(ready) = ready(run, chunk.node) {
                    arguments["queued_us"] = nanos(chunk.started - ready).into();
                }
                let labels = &node.labels;
                for (key, label) in [("process", &labels.process), ("stage", &labels.stage), ("view", &labels.view)] {
                    label.iter().for_each(|label| arguments[key] = label.as_str().into());
                }
                let times = (nanos(chunk.started), nanos(chunk.ended), chunk.worker as u64 + 1);
                expected.push(format!("{:?} {times:?} {arguments}", node.name));
            }
        }
        let mut found: Vec<String> = Vec::new();
        for slice in trace.slices(category) {
            let mut arguments = slice.arguments.clone();
            for (_, time) in arguments.as_object_mut().unwrap().iter_mut().filter(|(key, _)| key.ends_with("_us")) {
                *time = nanoseconds(time).into();
            }
            assert_eq!(slice.process, 1);
            found.push(format!("{:?} {:?} {arguments}", slice.name, (slice.began, slice.ended, slice.thread)));
        }
        expected.sort_unstable();
        found.sort_unstable();
        assert_eq!(found, expected, "{category}");
    }
}

fn check_arrows(log: &Log, trace: &Trace) {
    let mut left_out = 0;
    let mut arrows = Vec::new();
    let mut ids = HashSet::new();
    for end in trace.of_kind("f") {
        assert!(ids.insert(end.id.unwrap()), "{end:?} is not the only one of that number");
        let begins: Vec<&Event> = trace.of_kind("s").filter(|begin| begin.id == end.id).collect();
        let [begin] = begins.as_slice() else { panic!("{} arrows begin as {end:?} ends", begins.len()) };
        assert_eq!((end.category.as_str(), end.all["bp"].as_str()), ("dependency", Some("e")));
        assert_eq!((&begin.category, &begin.name), (&end.category, &end.name));
        assert!(begin.began <= end.began);
        arrows.push((*begin, end));
    }
    assert_eq!(arrows.len(), trace.of_kind("s").count());
    for (index, run) in log.runs.iter().enumerate() {
        let slices = |node: usize| {
            let slices = trace.slices("job").chain(trace.slices("empty"));
            let name = &run.graph.nodes[node].name;
            slices.filter(move |slice| slice.arguments["run"] == index && slice.name == *name)
        };
        for (to, node) in run.graph.nodes.iter().enumerate() {
            for &dependency in &node.dependencies {
                let (Some(last), Some(first)) =
                    (slices(dependency).max_by_key(|slice| slice.ended), slices(to).min_by_key(|slice| slice.began))
                else {
                    left_out += 1;
                    continue;
                };
                assert!(last.ended <= first.began, "{last:?} and {first:?}");
                let place = arrows.iter().position(|(begin, end)| {
                    // A nanosecond inside, where there is an inside.
                    let (before_end, last_moment) =
                        ((last.ended - 1).max(last.began), (first.ended - 1).max(first.began));
                    begin.is_on_lane_of(last)
                        && begin.began == before_end
                        && end.is_on_lane_of(first)
                        && end.began == (first.began + 1).min(last_moment)
                });
                arrows.swap_remove(place.unwrap_or_else(|| panic!("no arrow from {last:?} to {first:?}")));
            }
        }
    }
    assert_eq!(arrows.len(), 0, "arrows along no dependency: {arrows:?}");
    assert_eq!(trace.other_data["dependencies_left_out"], left_out);
}

/// At the moment of each reading, and no other, as many nodes are ready and not opened as it says, or others than before.
fn check_ready(log: &Log, trace: &Trace) {
    let mut waits = Vec::new();
    for run in &log.runs {
        for node in 0..run.graph.nodes.len() {
            let opened = parts(run, node).map(|part| part.opened).min();
            waits.extend(ready(run, node).zip(opened).map(|(ready, opened)| (nanos(ready), nanos(opened))));
        }
    }
    let count = |at: u64| waits.iter().filter(|&&(ready, opened)| ready <= at && at < opened).count() as f64;
    let mut moments: Vec<u64> = waits.iter().flat_map(|&(ready, opened)| [ready, opened]).collect();
    moments.sort_unstable();
    moments.dedup();
    let mut expected: Vec<(u64, f64)> = Vec::new();
    for at in moments {
        if count(at) != expected.last().map_or(0.0, |last| last.1) {
            expected.push((at, count(at)));
        }
    }
    assert_eq!(trace.readings("ready nodes"), expected);
}

/// When the last of what a node waits for had ended, unless something of that has left nothing.
fn ready(run: &Run, node: usize) -> Option<Duration> {
    let ends = |&before: &usize| parts(run, before).map(|part| part.ended).max();
    let dependencies = &run.graph.nodes[node].dependencies;
    let ends: Option<Vec<Duration>> = dependencies.iter().map(ends).collect();
    Some(ends?.into_iter().chain([run.began]).max().unwrap_or_default())
}

fn parts(run: &Run, node: usize) -> impl Iterator<Item = &Chunk> {
    run.chunks.iter().chain(&run.empty).filter(move |part| part.node == node)
}

fn nanos(time: Duration) -> u64 {
    time.as_nanos() as u64
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(48) })]

    #[test]
    fn what_ran_is_in_the_trace_with_its_dependencies(
        sketch in any_sketch(0),
        chunks in vec(1..30_usize, 1..4),
        always_parallel in any::<bool>(),
    ) {
        let mut schedule = compile(&sketch);
        schedule.always_parallel(always_parallel);
        for scheduler in &*RECORDED {
            let scheduler = scheduler.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            let log = recorded(&mut schedule, &scheduler, &chunks);
            prop_assert!(log.runs.iter().all(|run| run.complete));
            check(&log);
        }
    }

    #[test]
    fn what_a_failed_run_left_is_in_the_trace(sketch in any_sketch(3), chunks in vec(1..30_usize, 1..4)) {
        let mut schedule = compile(&sketch);
        for scheduler in &*RECORDED {
            let scheduler = scheduler.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            check(&recorded(&mut schedule, &scheduler, &chunks));
        }
    }
}

#[test]
fn a_full_ring_makes_a_trace_that_says_what_is_missing() {
    let scheduler = Scheduler::builder().workers(2).timeline_capacity(16).build().unwrap();
    let node =
        |width, before: &[usize]| (Busy { width, pinned: false, fails_at: None }, before.iter().copied().collect());
    let mut schedule = compile(&[node(9, &[]), node(0, &[0]), node(30, &[0]), node(4, &[1])]);
    let log = recorded(&mut schedule, &scheduler, &[3, 1, 1]);
    assert!(log.all_dropped() > 0 && log.runs.iter().any(|run| !run.complete));
    check(&log);
    assert!(Trace::of(&log).other_data["dependencies_left_out"].as_u64() > Some(0));
}

/// Tests share them, one at a time, or one test's runs would be in another one's log.
static RECORDED: LazyLock<[Mutex<Scheduler>; 3]> = LazyLock::new(|| {
    [1, 2, 4].map(|workers| Mutex::new(Scheduler::new(workers).expect("four threads can be started")))
});
