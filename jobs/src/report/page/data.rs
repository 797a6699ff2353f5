//! The data of the page: the log in few bytes.

use std::collections::HashMap;
use std::io;
use std::sync::Arc;
use std::time::Duration;

use serde::Serialize;

use crate::report::consistency::check_log;
use crate::report::{FrameReport, SchedulerCosts};
use crate::timeline::{self, Chunk, Graph, IdleKind, Log, NodeInfo, WorkerLog};

/// A log and its reports, as `model.js` reads them. Strings are indices of `texts`. Times are in nanoseconds: points in
/// time since the first one of the log, and durations. Long lists are flat, with a fixed number of numbers for each
/// entry.
#[derive(Serialize)]
pub(super) struct Data {
    texts: Vec<String>,
    dropped: u64,
    threads: Vec<usize>,
    workers: Vec<Worker>,
    frames: Vec<Frame>,
    graphs: Vec<Vec<Node>>,
    runs: Vec<RunData>,
    /// Name, thread, frame, began, duration.
    spans: Vec<i64>,
    device: Option<Device>,
}

#[derive(Serialize)]
struct Worker {
    name: usize,
    /// Whether it slept (1) or searched (0), began, duration.
    idle: Vec<i64>,
}

#[derive(Serialize)]
struct Frame {
    number: u64,
    began: i64,
    ended: i64,
    /// The text of the report, or why there is none.
    report: usize,
    /// The critical path: group, which is the span's name outside of runs; run, node and worker, which are −1 outside
    /// of runs; ready, waited, duration.
    path: Vec<i64>,
}

#[derive(Serialize)]
struct Node {
    name: usize,
    group: usize,
    color: usize,
    view: Option<usize>,
    pinned: bool,
    dependencies: Vec<usize>,
}

#[derive(Serialize)]
struct RunData {
    frame: u64,
    graph: usize,
    began: i64,
    ended: i64,
    /// Node, first item, number of items, worker, stolen (1) or not (0), opened, waited from then on, duration.
    chunks: Vec<i64>,
    /// The same for nodes without items.
    empty: Vec<i64>,
}

#[derive(Serialize)]
struct Device {
    name: usize,
    error: i64,
    /// Render process, view, frame, began, duration.
    passes: Vec<i64>,
}

impl Data {
    /// Collects the data of a log.
    ///
    /// # Errors
    /// Returns [`io::ErrorKind::InvalidData`] if the log is inconsistent, and the error of writing JSON.
    pub(super) fn new(log: &Log, costs: &SchedulerCosts) -> io::Result<Self> {
        check_log(log).map_err(|problem| io::Error::new(io::ErrorKind::InvalidData, problem))?;
        let start = first_time(log);
        let mut texts = Texts::default();
        let threads = log.threads.iter().map(|name| texts.add(name)).collect();
        let worker = |worker: &WorkerLog| Worker {
            name: texts.add(&worker.name),
            idle: worker
                .idle
                .iter()
                .flat_map(|idle| {
                    [
                        i64::from(idle.kind == IdleKind::Asleep),
                        nanoseconds_between(start, idle.began),
                        nanoseconds_between(idle.began, idle.ended),
                    ]
                })
                .collect(),
        };
        let workers = log.workers.iter().map(worker).collect();
        let frame = |frame: &timeline::Frame| {
            let report = FrameReport::new(log, frame.number, costs);
            let text = report.as_ref().map_or_else(ToString::to_string, ToString::to_string);
            let steps = report.map(|report| report.critical_path).unwrap_or_default();
            let path = steps.iter().flat_map(|step| {
                let (run, node) = step.node.map_or((-1, -1), |(run, node)| (run as i64, node as i64));
                let worker = step.worker.map_or(-1, |worker| worker as i64);
                let waited = nanoseconds_between(step.ready, step.started);
                let duration = nanoseconds_between(step.started, step.ended);
                let ready = nanoseconds_between(start, step.ready);
                [texts.add(&step.group) as i64, run, node, worker, ready, waited, duration]
            });
            Frame {
                path: path.collect(),
                number: frame.number,
                began: nanoseconds_between(start, frame.began),
                ended: nanoseconds_between(start, frame.ended),
                report: texts.add(&text),
            }
        };
        let frames = log.frames.iter().map(frame).collect();
        let (mut graphs, mut graph_indices) = (Vec::new(), HashMap::new());
        let runs = log.runs.iter().map(|run| {
            let graph = *graph_indices.entry(Arc::as_ptr(&run.graph)).or_insert_with(|| {
                graphs.push(nodes(&run.graph, &mut texts));
                graphs.len() - 1
            });
            RunData {
                frame: run.frame,
                graph,
                began: nanoseconds_between(start, run.began),
                ended: nanoseconds_between(start, run.ended),
                chunks: run.chunks.iter().flat_map(|chunk| chunk_numbers(chunk, start)).collect(),
                empty: run.empty.iter().flat_map(|chunk| chunk_numbers(chunk, start)).collect(),
            }
        });
        let runs = runs.collect();
        let spans = log.spans.iter().flat_map(|span| {
            let began = nanoseconds_between(start, span.began);
            let duration = nanoseconds_between(span.began, span.ended);
            [texts.add(&span.name) as i64, span.thread as i64, span.frame as i64, began, duration]
        });
        let spans = spans.collect();
        let device = log.device.as_ref().map(|device| {
            let passes = device.passes.iter().flat_map(|pass| {
                let began = nanoseconds_between(start, pass.began);
                let duration = nanoseconds_between(pass.began, pass.ended);
                let (process, view) = (texts.add(&pass.process), texts.add(&pass.view));
                [process as i64, view as i64, pass.frame as i64, began, duration]
            });
            let passes = passes.collect();
            let error = nanoseconds_between(Duration::ZERO, device.error);
            Device { name: texts.add(&device.name), error, passes }
        });
        Ok(Self { dropped: log.all_dropped(), threads, workers, frames, graphs, runs, spans, device, texts: texts.all })
    }
}

/// Each distinct string once.
#[derive(Default)]
struct Texts {
    all: Vec<String>,
    indices: HashMap<String, usize>,
}

impl Texts {
    fn add(&mut self, text: &str) -> usize {
        if let Some(&index) = self.indices.get(text) {
            return index;
        }
        self.all.push(text.to_owned());
        self.indices.insert(text.to_owned(), self.all.len() - 1);
        self.all.len() - 1
    }
}

fn nodes(graph: &Graph, texts: &mut Texts) -> Vec<Node> {
    let node = |node: &NodeInfo| Node {
        name: texts.add(&node.name),
        group: texts.add(node.group()),
        color: texts.add(node.labels.stage.as_deref().unwrap_or(node.group())),
        view: node.labels.view.as_ref().map(|view| texts.add(view)),
        pinned: node.pinned,
        dependencies: node.dependencies.clone(),
    };
    graph.nodes.iter().map(node).collect()
}

fn chunk_numbers(chunk: &Chunk, start: Duration) -> [i64; 8] {
    [
        chunk.node as i64,
        chunk.items.start as i64,
        chunk.items.len() as i64,
        chunk.worker as i64,
        i64::from(chunk.stolen),
        nanoseconds_between(start, chunk.opened),
        nanoseconds_between(chunk.opened, chunk.started),
        nanoseconds_between(chunk.started, chunk.ended),
    ]
}

/// Negative if `to` is before `from`.
fn nanoseconds_between(from: Duration, to: Duration) -> i64 {
    let nanoseconds = |time: Duration| i64::try_from(time.as_nanos()).unwrap_or(i64::MAX);
    nanoseconds(to) - nanoseconds(from)
}

/// The earliest time in the log.
fn first_time(log: &Log) -> Duration {
    let frames = log.frames.iter().map(|frame| frame.began);
    let runs = log.runs.iter().map(|run| run.began);
    let spans = log.spans.iter().map(|span| span.began);
    let idle = log.workers.iter().flat_map(|worker| &worker.idle).map(|idle| idle.began);
    let passes = log.device.iter().flat_map(|device| &device.passes).map(|pass| pass.began);
    frames.chain(runs).chain(spans).chain(idle).chain(passes).min().unwrap_or_default()
}
