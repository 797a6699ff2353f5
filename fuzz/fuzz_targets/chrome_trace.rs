//! Timelines as a Chrome trace, a page and reports: both files are JSON with the names of the log, and a log that
//! refers to nothing is refused.

#![no_main]

use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use arbitrary::{Arbitrary, Unstructured};
use drawloom::report::{FrameReport, SchedulerCosts, write_chrome_trace, write_page};
use drawloom::timeline::{
    Chunk, Counter, DeviceLog, DevicePass, Frame, Graph, Idle, IdleKind, Labels, Log, NodeInfo, Run, Span, WorkerLog,
};
use libfuzzer_sys::fuzz_target;
use serde_json::Value;

/// A log, of which most numbers are small, so that indices and times often fit together.
#[derive(Debug)]
struct AnyLog(Log);

impl<'a> Arbitrary<'a> for AnyLog {
    fn arbitrary(input: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self(Log {
            workers: list(input, worker)?,
            threads: list(input, String::arbitrary)?,
            frames: list(input, |input| Ok(Frame { number: small(input)?, began: time(input)?, ended: time(input)? }))?,
            runs: list(input, run)?,
            spans: list(input, |input| {
                let (name, thread) = (String::arbitrary(input)?, small(input)? as usize);
                Ok(Span { name, thread, frame: small(input)?, began: time(input)?, ended: time(input)? })
            })?,
            counters: list(input, |input| {
                Ok(Counter { name: String::arbitrary(input)?, at: time(input)?, value: f64::arbitrary(input)? })
            })?,
            tuning: Vec::new(),
            device: bool::arbitrary(input)?.then(|| device(input)).transpose()?,
            dropped: small(input)?,
            clock_panic: Option::arbitrary(input)?,
        }))
    }
}

fn list<'a, T>(
    input: &mut Unstructured<'a>,
    mut item: impl FnMut(&mut Unstructured<'a>) -> arbitrary::Result<T>,
) -> arbitrary::Result<Vec<T>> {
    (0..input.int_in_range(0..=4)?).map(|_| item(input)).collect()
}

fn small(input: &mut Unstructured<'_>) -> arbitrary::Result<u64> {
    if input.ratio(1, 30)? { u64::arbitrary(input) } else { input.int_in_range(0..=3) }
}

/// Microseconds, and sometimes any time within five centuries.
fn time(input: &mut Unstructured<'_>) -> arbitrary::Result<Duration> {
    let any = if input.ratio(1, 30)? { u64::arbitrary(input)? } else { u64::from(u16::arbitrary(input)?) };
    Ok(Duration::from_nanos(any))
}

fn worker(input: &mut Unstructured<'_>) -> arbitrary::Result<WorkerLog> {
    let name = String::arbitrary(input)?;
    let idle = list(input, |input| {
        let kind = if bool::arbitrary(input)? { IdleKind::Asleep } else { IdleKind::Searching };
        Ok(Idle { kind, began: time(input)?, ended: time(input)? })
    })?;
    Ok(WorkerLog { name, idle, dropped: u64::from(u32::arbitrary(input)?) })
}

fn run(input: &mut Unstructured<'_>) -> arbitrary::Result<Run> {
    let nodes = list(input, |input| {
        let mut label = || Ok(Option::<String>::arbitrary(input)?.map(Arc::from));
        let labels = Labels { process: label()?, stage: label()?, view: label()? };
        let dependencies = list(input, |input| Ok(small(input)? as usize))?;
        let (pinned, chunked_by_cost) = (bool::arbitrary(input)?, bool::arbitrary(input)?);
        Ok(NodeInfo { name: String::arbitrary(input)?, labels, dependencies, pinned, chunked_by_cost })
    })?;
    Ok(Run {
        frame: small(input)?,
        graph: Arc::new(Graph { nodes }),
        workers: small(input)? as usize,
        began: time(input)?,
        ended: time(input)?,
        parallel_from: bool::arbitrary(input)?.then(|| time(input)).transpose()?,
        always_parallel: bool::arbitrary(input)?,
        in_background: bool::arbitrary(input)?,
        failed: bool::arbitrary(input)?,
        complete: bool::arbitrary(input)?,
        chunks: list(input, chunk)?,
        empty: list(input, chunk)?,
    })
}

fn chunk(input: &mut Unstructured<'_>) -> arbitrary::Result<Chunk> {
    Ok(Chunk {
        node: small(input)? as usize,
        items: Range { start: small(input)? as usize, end: small(input)? as usize },
        worker: small(input)? as usize,
        opened: time(input)?,
        started: time(input)?,
        ended: time(input)?,
        stolen: bool::arbitrary(input)?,
    })
}

fn device(input: &mut Unstructured<'_>) -> arbitrary::Result<DeviceLog> {
    let passes = list(input, |input| {
        let (process, view) = (String::arbitrary(input)?, String::arbitrary(input)?);
        Ok(DevicePass { frame: small(input)?, process, view, began: time(input)?, ended: time(input)? })
    })?;
    Ok(DeviceLog { name: String::arbitrary(input)?, error: time(input)?, passes })
}

fuzz_target!(|log: AnyLog| {
    let log = log.0;
    let (mut trace, mut page) = (Vec::new(), Vec::new());
    let written = write_chrome_trace(&log, &mut trace);
    let shown = write_page(&log, &SchedulerCosts::ZERO, &mut page);
    assert_eq!((written.is_ok(), shown.is_ok()), (is_consistent(&log), is_consistent(&log)), "{written:?} {shown:?}");
    for frame in &log.frames {
        // A log of real frames has a report of each; of this one it is an error or a text.
        let _ = FrameReport::new(&log, frame.number, &SchedulerCosts::ZERO).map(|report| report.to_string());
    }
    if is_consistent(&log) {
        check_trace(&log, &trace);
        check_page(&log, page);
    }
});

/// Whether every node, worker and thread that the log refers to is there, and nodes wait for earlier ones only.
fn is_consistent(log: &Log) -> bool {
    let is_listed = |run: &Run| {
        let nodes = &run.graph.nodes;
        let mut chunks = run.chunks.iter().chain(&run.empty);
        let items = run.chunks.iter().map(|chunk| chunk.items.len() as u128).sum::<u128>();
        chunks.all(|chunk| chunk.node < nodes.len() && chunk.worker < log.workers.len())
            && items <= usize::MAX as u128
            && nodes.iter().enumerate().all(|(index, node)| node.dependencies.iter().all(|&other| other < index))
    };
    log.runs.iter().all(is_listed) && log.spans.iter().all(|span| span.thread < log.threads.len())
}

fn check_trace(log: &Log, trace: &[u8]) {
    let trace: Value = serde_json::from_slice(trace).unwrap();
    let events = trace["traceEvents"].as_array().unwrap();
    let names_of = |kind: &str, category: &str| {
        let of_kind = events.iter().filter(|event| event["ph"] == kind && event["cat"] == category);
        sorted(of_kind.map(|event| event["name"].as_str().unwrap()))
    };
    let node = |run: &Run, chunk: &Chunk| run.graph.nodes[chunk.node].name.clone();
    let jobs = log.runs.iter().flat_map(|run| run.chunks.iter().map(move |chunk| node(run, chunk)));
    assert_eq!(names_of("X", "job"), sorted(jobs));
    assert_eq!(names_of("X", "span"), sorted(log.spans.iter().map(|span| &span.name)));
    let passes = log.device.iter().flat_map(|device| &device.passes);
    assert_eq!(names_of("X", "device"), sorted(passes.map(|pass| &pass.process)));
    let finite = log.counters.iter().filter(|counter| counter.value.is_finite());
    let mut counters = names_of("C", "counter");
    counters.retain(|name| name != "ready nodes" || log.counters.iter().any(|counter| counter.name == *name));
    if log.counters.iter().all(|counter| counter.name != "ready nodes") {
        assert_eq!(counters, sorted(finite.map(|counter| &counter.name)));
    }
    let threads = events.iter().filter(|event| event["name"] == "thread_name" && event["ph"] == "M");
    let threads: Vec<_> = threads.map(|event| event["args"]["name"].as_str().unwrap()).collect();
    assert!(threads.iter().zip(&log.workers).all(|(name, worker)| *name == worker.name));
    let has_thread = |thread: &String| threads[log.workers.len()..].contains(&thread.as_str());
    assert!(log.threads.iter().all(has_thread), "{threads:?}");
}

/// No name ends a script early, and the data are JSON that has all names.
fn check_page(log: &Log, page: Vec<u8>) {
    let page = String::from_utf8(page).unwrap();
    let lower = page.to_lowercase();
    assert_eq!((lower.matches("<script").count(), lower.matches("</script").count()), (2, 2));
    assert!(!page.contains("<!--") && !page.contains(['\u{2028}', '\u{2029}']));
    let (_, data) = page.split_once(r#"<script id="data" type="application/json">"#).unwrap();
    let data: Value = serde_json::from_str(data.split_once("</script>").unwrap().0).unwrap();
    let texts: Vec<_> = data["texts"].as_array().unwrap().iter().map(|text| text.as_str().unwrap()).collect();
    let workers = log.workers.iter().map(|worker| &worker.name);
    let names = workers.chain(&log.threads).chain(log.spans.iter().map(|span| &span.name));
    names.for_each(|name| assert!(texts.contains(&name.as_str()), "{name:?}"));
}

fn sorted(names: impl Iterator<Item = impl ToString>) -> Vec<String> {
    let mut names: Vec<_> = names.map(|name| name.to_string()).collect();
    names.sort_unstable();
    names
}
