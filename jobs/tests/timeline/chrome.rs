//! Chrome traces of real runs, checked against their logs.

use std::collections::HashSet;
use std::hint::black_box;
use std::ops::Range;
use std::sync::{LazyLock, Mutex};
use std::time::Duration;

use drawloom_jobs::graph::{FrameGraph, Node, NodeError, Schedule};
use drawloom_jobs::task::{Scheduler, Worker};
use drawloom_jobs::timeline::{Chunk, Idle, IdleKind, Log, Run};
use proptest::collection::vec;
use proptest::prelude::*;
use serde_json::json;

use crate::trace::{Event, Trace, nanoseconds};

/// A node with chunks of the size that is the context of the run.
#[derive(Clone, Debug)]
struct Busy {
    width: usize,
    pinned: bool,
    /// The item that fails.
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
        if self.fails_at.is_some_and(|item| range.contains(&item)) {
            Err("the item fails on purpose".into())
        } else {
            Ok(())
        }
    }
}

/// A graph as plain data: each node, with its dependencies among the nodes before it.
type GraphSpec = Vec<(Busy, HashSet<usize>)>;

/// Any graph in which `failing` of ten nodes have an item that fails.
fn any_graph(failing: u32) -> impl Strategy<Value = GraphSpec> {
    let width = prop_oneof![1 => Just(0), 2 => 1..4_usize, 2 => 0..60_usize];
    let fails_at = (0..10_u32, 0..30_usize).prop_map(move |(roll, item)| (roll < failing).then_some(item));
    let busy = (width, prop::bool::weighted(0.2), fails_at).prop_map(|(width, pinned, fails_at)| Busy {
        width,
        pinned,
        fails_at,
    });
    vec((busy, vec(any::<prop::sample::Index>(), 0..4)), 1..20).prop_map(|nodes| {
        let dependencies = |index: usize, picks: Vec<prop::sample::Index>| {
            picks.iter().filter(|_| index > 0).map(|pick| pick.index(index)).collect()
        };
        let nodes = nodes.into_iter().enumerate();
        nodes.map(|(index, (busy, picks))| (busy, dependencies(index, picks))).collect()
    })
}

fn compile(spec: &[(Busy, HashSet<usize>)]) -> Schedule<Busy> {
    let mut graph = FrameGraph::new();
    let mut nodes = Vec::new();
    for (index, (busy, dependencies)) in spec.iter().enumerate() {
        let node = graph.add(format!("p{index}"), busy.clone());
        graph.keep(node);
        dependencies.iter().for_each(|&dependency| graph.order(nodes[dependency], node));
        nodes.push(node);
    }
    graph.compile().expect("dependencies are among the nodes before, so there is no cycle")
}

/// Records one run for each chunk size: two runs in a frame, each in a span.
fn record(schedule: &mut Schedule<Busy>, scheduler: &Scheduler, chunks: &[usize]) -> Log {
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

/// Checks the trace of a log.
pub fn check(log: &Log) {
    let trace = Trace::of(log);
    check_tracks(log, &trace);
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

fn check_tracks(log: &Log, trace: &Trace) {
    let names = trace.thread_names();
    let tracks: HashSet<_> = names.iter().map(|&(_, thread, _)| thread).collect();
    assert_eq!(tracks.len(), names.len(), "two tracks have the same number");
    for (worker, record) in log.workers.iter().enumerate() {
        assert_eq!(names[worker], (1, worker as u64 + 1, record.name.clone()));
    }
    let order = trace.of_kind("M").filter(|event| event.name == "thread_sort_index");
    let order: Vec<_> = order.map(|event| (event.thread, event.arguments["sort_index"].as_u64().unwrap())).collect();
    assert_eq!(order.len(), names.len());
    assert!(order.is_sorted() && order.windows(2).all(|pair| pair[0].1 < pair[1].1), "{order:?}");
    let slices: Vec<&Event> = trace.of_kind("X").collect();
    for (index, slice) in slices.iter().enumerate() {
        assert!(tracks.contains(&slice.thread), "{slice:?} is on a track without a name");
        for other in slices[..index].iter().filter(|other| other.is_on_track_of(slice)) {
            let are_disjoint = slice.ended <= other.began || other.ended <= slice.began;
            assert!(are_disjoint || slice.contains(other) || other.contains(slice), "{slice:?} and {other:?}");
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
                    label.iter().for_each(|label| arguments[key] = (&**label).into());
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
        assert!(ids.insert(end.id.unwrap()), "{end:?} is not the only arrow with this number");
        let begins: Vec<&Event> = trace.of_kind("s").filter(|begin| begin.id == end.id).collect();
        let [begin] = begins.as_slice() else { panic!("{} arrows begin with the number of {end:?}", begins.len()) };
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
                // Slices on two tracks can end, or begin, at the same nanosecond. The arrow may be at any of them.
                let last = slices(dependency).map(|slice| slice.ended).max();
                let first = slices(to).map(|slice| slice.began).min();
                let (Some(last), Some(first)) = (last, first) else {
                    left_out += 1;
                    continue;
                };
                assert!(last <= first, "node {to} begins before node {dependency} ends");
                let index = arrows.iter().position(|(begin, end)| {
                    // A nanosecond inside the slice, if it is long enough.
                    let is_at_end = |slice: &Event| {
                        let before_end = (slice.ended - 1).max(slice.began);
                        slice.ended == last && begin.is_on_track_of(slice) && begin.began == before_end
                    };
                    let is_at_begin = |slice: &Event| {
                        let latest_start = (slice.ended - 1).max(slice.began);
                        let after_begin = (slice.began + 1).min(latest_start);
                        slice.began == first && end.is_on_track_of(slice) && end.began == after_begin
                    };
                    slices(dependency).any(is_at_end) && slices(to).any(is_at_begin)
                });
                arrows.swap_remove(index.unwrap_or_else(|| panic!("no arrow from node {dependency} to node {to}")));
            }
        }
    }
    assert_eq!(arrows.len(), 0, "arrows without a dependency: {arrows:?}");
    assert_eq!(trace.other_data["dependencies_left_out"], left_out);
}

/// Checks that the counter has a value at each time at which the number of ready nodes changes, and at no other.
fn check_ready(log: &Log, trace: &Trace) {
    let mut waits = Vec::new();
    for run in &log.runs {
        for node in 0..run.graph.nodes.len() {
            let opened = slices_of(run, node).map(|slice| slice.opened).min();
            waits.extend(ready(run, node).zip(opened).map(|(ready, opened)| (nanos(ready), nanos(opened))));
        }
    }
    let count = |at: u64| waits.iter().filter(|&&(ready, opened)| ready <= at && at < opened).count() as f64;
    let mut times: Vec<u64> = waits.iter().flat_map(|&(ready, opened)| [ready, opened]).collect();
    times.sort_unstable();
    times.dedup();
    let mut expected: Vec<(u64, f64)> = Vec::new();
    for at in times {
        if count(at) != expected.last().map_or(0.0, |last| last.1) {
            expected.push((at, count(at)));
        }
    }
    assert_eq!(trace.counter_values("ready nodes"), expected);
}

/// The time at which the last dependency of a node ended, or `None` if one of them has no slices.
fn ready(run: &Run, node: usize) -> Option<Duration> {
    let ends = |&dependency: &usize| slices_of(run, dependency).map(|slice| slice.ended).max();
    let dependencies = &run.graph.nodes[node].dependencies;
    let ends: Option<Vec<Duration>> = dependencies.iter().map(ends).collect();
    Some(ends?.into_iter().chain([run.began]).max().unwrap_or_default())
}

fn slices_of(run: &Run, node: usize) -> impl Iterator<Item = &Chunk> {
    run.chunks.iter().chain(&run.empty).filter(move |slice| slice.node == node)
}

fn nanos(time: Duration) -> u64 {
    time.as_nanos() as u64
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(48) })]

    #[test]
    fn a_trace_has_all_chunks_and_dependencies(
        spec in any_graph(0),
        chunks in vec(1..30_usize, 1..4),
        always_parallel in any::<bool>(),
    ) {
        let mut schedule = compile(&spec);
        schedule.always_parallel(always_parallel);
        for scheduler in &*SCHEDULERS {
            let scheduler = scheduler.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            let log = record(&mut schedule, &scheduler, &chunks);
            prop_assert!(log.runs.iter().all(|run| run.complete));
            check(&log);
        }
    }

    #[test]
    fn a_trace_has_the_chunks_of_a_failed_run(spec in any_graph(3), chunks in vec(1..30_usize, 1..4)) {
        let mut schedule = compile(&spec);
        for scheduler in &*SCHEDULERS {
            let scheduler = scheduler.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            check(&record(&mut schedule, &scheduler, &chunks));
        }
    }
}

#[test]
fn the_trace_of_an_incomplete_log_counts_what_is_missing() {
    let scheduler = Scheduler::builder().workers(2).timeline_capacity(16).build().unwrap();
    let node = |width, dependencies: &[usize]| {
        (Busy { width, pinned: false, fails_at: None }, dependencies.iter().copied().collect())
    };
    let mut schedule = compile(&[node(9, &[]), node(0, &[0]), node(30, &[0]), node(4, &[1])]);
    let log = record(&mut schedule, &scheduler, &[3, 1, 1]);
    assert!(log.all_dropped() > 0 && log.runs.iter().any(|run| !run.complete));
    check(&log);
    assert!(Trace::of(&log).other_data["dependencies_left_out"].as_u64() > Some(0));
}

/// Used by one test at a time, because a log has all runs of its scheduler.
static SCHEDULERS: LazyLock<[Mutex<Scheduler>; 3]> =
    LazyLock::new(|| [1, 2, 4].map(|workers| Mutex::new(Scheduler::new(workers).expect("threads can be started"))));
