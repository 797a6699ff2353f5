//! Chrome traces of hand-made logs, with cases that are rare in real runs.

use std::io::{self, Write};
use std::sync::Arc;
use std::time::Duration;

use drawloom_jobs::report::write_chrome_trace;
use drawloom_jobs::timeline::{
    Chunk, Counter, DeviceLog, DevicePass, Frame, Graph, Idle, IdleKind, Labels, Log, NodeInfo, Run, Span, WorkerLog,
};
use proptest::collection::vec;
use proptest::prelude::*;

use crate::chrome::check;
use crate::trace::Trace;

fn at(nanoseconds: u64) -> Duration {
    Duration::from_nanos(nanoseconds)
}

fn node(name: &str, dependencies: &[usize]) -> NodeInfo {
    NodeInfo { name: name.to_owned(), dependencies: dependencies.to_vec(), ..NodeInfo::default() }
}

fn chunk(node: usize, worker: usize, opened: u64, started: u64, ended: u64) -> Chunk {
    let (opened, started, ended) = (at(opened), at(started), at(ended));
    Chunk { node, items: 0..1, worker, opened, started, ended, stolen: false }
}

/// A complete run that begins at 0.
fn run(nodes: Vec<NodeInfo>, ended: u64, chunks: Vec<Chunk>) -> Run {
    Run { graph: Arc::new(Graph { nodes }), workers: 2, ended: at(ended), complete: true, chunks, ..Run::default() }
}

fn log(runs: Vec<Run>) -> Log {
    let worker = |name: &str| WorkerLog { name: name.to_owned(), ..WorkerLog::default() };
    Log { workers: ["caller", "worker 1"].map(worker).into(), runs, ..Log::default() }
}

fn span(name: &str, thread: usize, began: u64, ended: u64) -> Span {
    Span { name: name.to_owned(), thread, frame: 0, began: at(began), ended: at(ended) }
}

fn pass(process: &str, began: u64, ended: u64) -> DevicePass {
    let (process, view) = (process.to_owned(), "main".to_owned());
    DevicePass { frame: 3, process, view, began: at(began), ended: at(ended) }
}

#[test]
fn an_empty_log_makes_a_trace() {
    let trace = Trace::of(&Log::default());
    assert!(trace.events.iter().all(|event| event.kind == "M" && event.process == 1));
    check(&Log::default());
}

#[test]
fn the_arguments_of_a_chunk_are_its_labels_its_wait_and_whether_it_was_stolen() {
    let labels =
        Labels { process: Some("g-buffer".into()), stage: Some("record".into()), view: Some("main \"1\"".into()) };
    let record = NodeInfo { labels, ..node("record main", &[0]) };
    let stolen = Chunk { items: 512..1024, stolen: true, ..chunk(1, 1, 2_500, 70_001, 70_001) };
    let log = log(vec![Run {
        frame: 7,
        ..run(vec![node("cull", &[]), record], 80_000, vec![chunk(0, 0, 5, 5, 1_234), stolen])
    }]);
    check(&log);
    let trace = Trace::of(&log);
    let arguments = r#""args":{"process":"g-buffer","stage":"record","view":"main \"1\"","items":"512..1024","queued_us":68.767,"opened_us":2.500,"stolen":true,"frame":7,"run":0}"#;
    assert!(trace.text.contains(arguments), "{}", trace.text);
    assert_eq!(trace.counter_values("ready nodes"), [(0, 1.0), (5, 0.0), (1_234, 1.0), (2_500, 0.0)]);
}

#[test]
fn times_are_exact_even_after_centuries() {
    let late = u64::MAX / 2;
    let trace = Trace::of(&log(vec![run(vec![node("late", &[])], late, vec![chunk(0, 0, 0, late - 1, late)])]));
    assert!(trace.text.contains(r#""ts":9223372036854775.806,"dur":0.001,"#), "{}", trace.text);
}

#[test]
fn runs_inside_a_chunk_nest_in_it_and_their_ready_nodes_are_counted_together() {
    let inner = |name: &str, began: u64, opened: u64, ended: u64| {
        let chunks = vec![chunk(0, 0, opened, opened, ended)];
        Run { began: at(began), ..run(vec![node(name, &[])], ended, chunks) }
    };
    let outer =
        run(vec![node("outer", &[]), node("other", &[])], 90, vec![chunk(0, 0, 10, 10, 80), chunk(1, 0, 85, 85, 90)]);
    let log = log(vec![inner("early", 10, 10, 30), inner("late", 50, 55, 60), Run { began: at(10), ..outer }]);
    check(&log);
    let trace = Trace::of(&log);
    let names: Vec<_> = trace.slices("job").map(|slice| slice.name.clone()).collect();
    assert_eq!(names, ["outer", "other", "early", "late"], "an outer slice comes before those inside it");
    let ready = trace.counter_values("ready nodes");
    assert_eq!(ready, [(10, 1.0), (50, 2.0), (55, 1.0), (85, 0.0)]);
}

#[test]
fn arrows_lead_from_the_last_chunk_to_the_first_by_time_not_by_items() {
    let chunks = vec![
        chunk(0, 0, 0, 5, 30),
        chunk(0, 1, 0, 0, 20),
        chunk(0, 1, 0, 30, 30),
        chunk(1, 0, 30, 40, 50),
        chunk(1, 1, 30, 35, 35),
        chunk(1, 1, 30, 35, 60),
    ];
    let log = log(vec![run(vec![node("from", &[]), node("to", &[0])], 60, chunks)]);
    let trace = Trace::of(&log);
    let only = |kind: &str| trace.of_kind(kind).map(|event| (event.thread, event.began)).collect::<Vec<_>>();
    assert_eq!((only("s"), only("f")), (vec![(1, 29)], vec![(2, 36)]));
    let end = trace.events.iter().position(|event| event.kind == "f").unwrap();
    assert_eq!(trace.events[end - 1].ended, 60, "of two slices that begin at once the longer one");
}

#[test]
fn spans_that_begin_at_once_are_nested() {
    let spans = vec![span("inner", 0, 1, 5), span("outer", 0, 1, 8)];
    let trace = Trace::of(&Log { spans, threads: vec!["engine".into()], ..log(vec![]) });
    let spans: Vec<_> = trace.slices("span").map(|slice| (slice.name.as_str(), slice.thread)).collect();
    assert_eq!(spans, [("outer", 3), ("inner", 3)]);
}

#[test]
fn arrows_of_chunks_of_no_duration_are_in_topological_order() {
    let nodes = vec![node("a", &[]), node("b", &[0]), node("c", &[1])];
    let mut run = run(nodes, 50, vec![chunk(0, 0, 10, 10, 10), chunk(2, 0, 10, 10, 10)]);
    run.empty = vec![Chunk { items: 0..0, ..chunk(1, 0, 10, 10, 10) }];
    let log = log(vec![run]);
    check(&log);
    let trace = Trace::of(&log);
    let order: Vec<String> = trace
        .events
        .iter()
        .filter(|event| "Xsf".contains(&event.kind))
        .map(|event| event.id.map_or_else(|| event.name.clone(), |id| format!("{}{id}", event.kind)))
        .collect();
    assert_eq!(order, ["a", "s1", "b", "f1", "s2", "c", "f2"]);
}

#[test]
fn finite_counters_are_written_unchanged_and_others_are_left_out() {
    let values = [0.5, -3.0, f64::NAN, f64::INFINITY, 1e300];
    let counters =
        values.iter().enumerate().map(|(index, &value)| Counter { name: "bytes".into(), at: at(index as u64), value });
    let trace = Trace::of(&Log { counters: counters.collect(), ..log(vec![]) });
    assert_eq!(trace.counter_values("bytes"), [(0, 0.5), (1, -3.0), (4, 1e300)]);
}

#[test]
fn the_device_is_a_process_of_its_own_with_its_error() {
    let passes = vec![pass("depth", 1_000, 5_000), pass("light", 5_000, 9_000), pass("post", 8_000, 12_000)];
    let device = DeviceLog { name: "Fast \"9\"".into(), error: at(12_345), passes };
    let log = Log { device: Some(device), threads: vec!["engine".into()], ..log(vec![]) };
    check(&log);
    let trace = Trace::of(&log);
    let of_device: Vec<_> = trace.events.iter().filter(|event| event.process == 2).collect();
    let metadata = |name: &str, key: &str| {
        let event = of_device.iter().find(|event| event.kind == "M" && event.name == name).expect(name);
        event.arguments[key].clone()
    };
    assert_eq!(
        (metadata("process_name", "name"), metadata("process_labels", "labels")),
        ("Fast \"9\"".into(), "±12.345 µs".into())
    );
    assert!(trace.text.contains(r#""device_error_us":12.345"#));
    let tracks: Vec<_> = trace.thread_names().into_iter().filter(|(process, ..)| *process == 2).collect();
    assert_eq!(tracks, [(2, 4, "passes".to_owned()), (2, 5, "passes (2)".to_owned())]);
    let slices: Vec<_> =
        trace.slices("device").map(|slice| (slice.name.as_str(), slice.thread, slice.began, slice.ended)).collect();
    assert_eq!(slices, [("depth", 4, 1_000, 5_000), ("light", 4, 5_000, 9_000), ("post", 5, 8_000, 12_000)]);
    assert!(trace.slices("device").all(|slice| slice.arguments["view"] == "main" && slice.arguments["frame"] == 3));
}

#[test]
fn without_a_device_there_is_no_device_process() {
    let log = log(vec![run(vec![node("cull", &[])], 9, vec![chunk(0, 0, 1, 2, 3)])]);
    let trace = Trace::of(&log);
    assert!(trace.events.iter().all(|event| event.process == 1));
    assert!(trace.other_data.get("device_error_us").is_none());
}

#[test]
fn counts_of_dropped_events_saturate() {
    let mut log = Log { dropped: u64::MAX - 1, ..log(vec![]) };
    log.workers.iter_mut().for_each(|worker| worker.dropped = 1);
    assert_eq!(Trace::of(&log).other_data["dropped"], u64::MAX);
}

#[test]
fn a_large_trace_is_written_in_pieces() {
    let chunks =
        (0..100_000).map(|index| chunk(0, index as usize % 2, 0, index / 2 * 10, index / 2 * 10 + 10)).collect();
    let log = log(vec![run(vec![node("wide", &[])], 500_000, chunks)]);
    let mut trace = SliceCounter::default();
    write_chrome_trace(&log, &mut trace).unwrap();
    assert_eq!(trace.slices, 100_000);
    assert!(trace.max_write < 64 << 10, "{} bytes were in memory at once", trace.max_write);
}

/// Counts the slices that are written, and the largest write.
#[derive(Default)]
struct SliceCounter {
    slices: usize,
    max_write: usize,
    rest: Vec<u8>,
}

impl Write for SliceCounter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.max_write = self.max_write.max(bytes.len());
        self.rest.extend(bytes);
        while let Some(end) = self.rest.iter().position(|&byte| byte == b'\n') {
            let line: Vec<u8> = self.rest.drain(..=end).collect();
            self.slices += usize::from(line.starts_with(br#"{"ph":"X""#));
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn errors_of_the_writer_are_returned() {
    for length in 0..300 {
        let mut small = vec![0; length];
        let error = write_chrome_trace(&log(vec![]), small.as_mut_slice()).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::WriteZero);
    }
}

#[test]
fn a_log_with_invalid_indices_is_an_error() {
    let fine = run(vec![node("a", &[]), node("b", &[0])], 9, vec![chunk(1, 1, 0, 0, 9)]);
    let cases = [
        (Run { chunks: vec![chunk(2, 0, 0, 0, 1)], ..fine.clone() }, "run 0 has a chunk of node 2 of 2"),
        (Run { empty: vec![chunk(5, 0, 0, 0, 1)], ..fine.clone() }, "run 0 has a chunk of node 5 of 2"),
        (Run { chunks: vec![chunk(0, 2, 0, 0, 1)], ..fine.clone() }, "run 0 has a chunk of worker 2 of 2"),
        (
            Run {
                chunks: [0, 1].map(|node| Chunk { items: 0..usize::MAX, ..chunk(node, 0, 0, 0, 1) }).into(),
                ..fine.clone()
            },
            "run 0 has more items than a `usize` can count",
        ),
        (run(vec![node("a", &[]), node("b", &[2])], 9, vec![]), "node 1 of run 0 waits for node 2 of 2"),
        (
            run(vec![node("a", &[1]), node("b", &[])], 9, vec![]),
            "node 0 of run 0 waits for node 1, which is not before it",
        ),
    ];
    for (run, problem) in cases {
        let error = write_chrome_trace(&log(vec![run]), io::sink()).unwrap_err();
        assert_eq!((error.kind(), error.to_string().as_str()), (io::ErrorKind::InvalidInput, problem));
    }
    let error =
        write_chrome_trace(&Log { spans: vec![span("s", 0, 1, 2)], ..log(vec![fine]) }, io::sink()).unwrap_err();
    assert_eq!(error.to_string(), "there is a span of thread 0 of 0");
}

/// Names that break writers that do not escape.
fn any_name() -> impl Strategy<Value = String> {
    let special = prop::sample::select(vec![
        "",
        "\"",
        "\\",
        "\\u0000",
        "</script>",
        "]}",
        "a\nb\r\tc",
        "\u{0}\u{1b}\u{7f}",
        "\u{2028}\u{feff}",
        "ü 漢字 🧵",
        "\"ts\":1",
    ]);
    prop_oneof![special.prop_map(str::to_owned), any::<String>(), Just("\"\n\u{1}".repeat(3_500)),]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    #[test]
    fn any_name_can_be_read_back_unchanged(names in vec(any_name(), 12)) {
        let [name, process_label, stage, view, worker, thread, span_name, counter, device, pass_name, pass_view, idle_worker] = &names[..] else {
            unreachable!("there are twelve")
        };
        let label = |name: &String| Some(name.as_str().into());
        let labels = Labels { process: label(process_label), stage: label(stage), view: label(view) };
        let mut log = log(vec![run(vec![NodeInfo { labels, ..node(name, &[]) }], 9, vec![chunk(0, 1, 1, 2, 3)])]);
        log.workers[0].name.clone_from(idle_worker);
        log.workers[0].idle.push(Idle { kind: IdleKind::Searching, began: at(0), ended: at(9) });
        log.workers[1].name.clone_from(worker);
        log.threads.push(thread.clone());
        log.frames.push(Frame::default());
        log.spans.push(span(span_name, 0, 1, 8));
        log.counters.push(Counter { name: counter.clone(), at: at(4), value: 1.0 });
        let passes = vec![DevicePass { view: pass_view.clone(), ..pass(pass_name, 1, 2) }];
        log.device = Some(DeviceLog { name: device.clone(), error: at(1), passes });
        check(&log);
        let trace = Trace::of(&log);
        let only = |category: &str| trace.slices(category).next().unwrap();
        prop_assert_eq!(&only("job").name, name);
        for (key, label) in [("process", process_label), ("stage", stage), ("view", view)] {
            prop_assert_eq!(only("job").arguments[key].as_str(), Some(label.as_str()));
        }
        prop_assert_eq!((&only("span").name, &only("device").name), (span_name, pass_name));
        prop_assert_eq!(only("device").arguments["view"].as_str(), Some(pass_view.as_str()));
        prop_assert_eq!(trace.counter_values(counter), [(4, 1.0)]);
        let threads: Vec<_> = trace.thread_names().into_iter().map(|(.., name)| name).collect();
        prop_assert_eq!(threads, [idle_worker, worker, thread, "passes"]);
        let processes = trace.of_kind("M").filter(|event| event.name == "process_name");
        let processes: Vec<_> = processes.map(|event| event.arguments["name"].as_str().unwrap()).collect();
        prop_assert_eq!(processes, ["drawloom", device.as_str()]);
    }

    #[test]
    fn overlapping_spans_and_passes_nest_on_their_tracks(
        spans in vec((0..2_usize, 0..40_u64, 0..20_u64), 0..20),
        passes in vec((0..40_u64, 0..20_u64), 0..20),
    ) {
        let spans = spans.into_iter().map(|(thread, began, duration)| span("work", thread, began, began + duration)).collect();
        let passes: Vec<_> = passes.into_iter().map(|(began, duration)| pass("draw", began, began + duration)).collect();
        let count = passes.len();
        let device = Some(DeviceLog { name: "device".into(), error: at(0), passes });
        let log = Log { spans, threads: vec!["one".into(), "two".into()], device, ..log(vec![]) };
        check(&log);
        let trace = Trace::of(&log);
        prop_assert_eq!(trace.slices("device").count(), count);
        for (thread, name) in ["one", "two"].into_iter().enumerate() {
            let tracks: Vec<u64> =
                trace.thread_names().into_iter().filter(|(.., track)| track.starts_with(name)).map(|(_, track, _)| track).collect();
            let mut found: Vec<_> =
                trace.slices("span").filter(|slice| tracks.contains(&slice.thread)).map(|slice| (slice.began, slice.ended)).collect();
            let own = log.spans.iter().filter(|span| span.thread == thread);
            let mut expected: Vec<_> =
                own.map(|span| (span.began.as_nanos() as u64, span.ended.as_nanos() as u64)).collect();
            found.sort_unstable();
            expected.sort_unstable();
            prop_assert_eq!(found, expected);
        }
    }
}
