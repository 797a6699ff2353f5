//! What the page is given: the log in few bytes.

use std::{collections::HashMap, io, sync::Arc, time::Duration};

use serde::Serialize;

use crate::{
    report::{FrameReport, SchedulerCosts, consistency::check_log},
    timeline::{Chunk, Graph, IdleKind, Log, NodeInfo},
};

/// A log and its reports, as `model.js` reads them. Texts are indices of `texts`. Times are in nanoseconds: moments since the
/// first that the log has, and lengths. What there is much of stands in one flat list, so many numbers each.
#[derive(Serialize)]
pub(super) struct Data {
    texts: Vec<String>,
    dropped: u64,
    threads: Vec<usize>,
    workers: Vec<Worker>,
    frames: Vec<Frame>,
    graphs: Vec<Vec<Node>>,
    runs: Vec<RunData>,
    /// Name, thread, frame, began, took.
    spans: Vec<i64>,
    device: Option<Device>,
}

#[derive(Serialize)]
struct Worker {
    name: usize,
    /// Whether it slept (1) or searched (0), began, took.
    idle: Vec<i64>,
}

#[derive(Serialize)]
struct Frame {
    number: u64,
    began: i64,
    ended: i64,
    /// The report in words, or why there is none.
    words: usize,
    /// The critical path. Group, which is the span's name where it is no node; run, node and worker (−1 for what a thread
    /// did outside of all runs), ready, waited, took.
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
    /// NodeInfo, first item, number of items, worker, stolen (1) or not (0), opened, waited from then on, took.
    chunks: Vec<i64>,
    /// The same of nodes that had no items.
    empty: Vec<i64>,
}

#[derive(Serialize)]
struct Device {
    name: usize,
    error: i64,
    /// NodeInfo, view, frame, began, took.
    passes: Vec<i64>,
}

impl Data {
    pub(super) fn new(log: &Log, prices: &SchedulerCosts) -> io::Result<Self> {
        check_log(log).map_err(|problem| io::Error::new(io::ErrorKind::InvalidData, problem))?;
        let start = first_moment(log);
        let mut texts = Texts::default();
        let threads = log.threads.iter().map(|name| texts.add(name)).collect();
        let worker = |worker: &crate::timeline::WorkerLog| Worker {
            name: texts.add(&worker.name),
            idle: worker
                .idle
                .iter()
                .flat_map(|idle| {
                    [
                        i64::from(idle.kind == IdleKind::Asleep),
                        between(start, idle.began),
                        between(idle.began, idle.ended),
                    ]
                })
                .collect(),
        };
        let workers = log.workers.iter().map(worker).collect();
        let frame = |frame: &crate::timeline::Frame| {
            let report = FrameReport::new(log, frame.number, prices);
            let words = report.as_ref().map_or_else(ToString::to_string, ToString::to_string);
            let steps = report.map(|report| report.critical_path).unwrap_or_default();
            let path = steps.iter().flat_map(|step| {
                let (run, node) = step.node.map_or((-1, -1), |(run, node)| (run as i64, node as i64));
                let worker = step.worker.map_or(-1, |worker| worker as i64);
                let (waited, took) = (between(step.ready, step.started), between(step.started, step.ended));
                [texts.add(&step.group) as i64, run, node, worker, between(start, step.ready), waited, took]
            });
            Frame {
                path: path.collect(),
                number: frame.number,
                began: between(start, frame.began),
                ended: between(start, frame.ended),
                words: texts.add(&words),
            }
        };
        let frames = log.frames.iter().map(frame).collect();
        let (mut graphs, mut places) = (Vec::new(), HashMap::new());
        let runs = log.runs.iter().map(|run| {
            let graph = *places.entry(Arc::as_ptr(&run.graph)).or_insert_with(|| {
                graphs.push(nodes(&run.graph, &mut texts));
                graphs.len() - 1
            });
            RunData {
                frame: run.frame,
                graph,
                began: between(start, run.began),
                ended: between(start, run.ended),
                chunks: run.chunks.iter().flat_map(|chunk| numbers(chunk, start)).collect(),
                empty: run.empty.iter().flat_map(|chunk| numbers(chunk, start)).collect(),
            }
        });
        let runs = runs.collect();
        let spans = log.spans.iter().flat_map(|span| {
            let (began, took) = (between(start, span.began), between(span.began, span.ended));
            [texts.add(&span.name) as i64, span.thread as i64, span.frame as i64, began, took]
        });
        let spans = spans.collect();
        let device = log.device.as_ref().map(|device| {
            let passes = device.passes.iter().flat_map(|pass| {
                let (began, took) = (between(start, pass.began), between(pass.began, pass.ended));
                let (process, view) = (texts.add(&pass.process), texts.add(&pass.view));
                [process as i64, view as i64, pass.frame as i64, began, took]
            });
            let passes = passes.collect();
            Device { name: texts.add(&device.name), error: between(Duration::ZERO, device.error), passes }
        });
        Ok(Self { dropped: log.all_dropped(), threads, workers, frames, graphs, runs, spans, device, texts: texts.all })
    }
}

/// Every text once.
#[derive(Default)]
struct Texts {
    all: Vec<String>,
    places: HashMap<String, usize>,
}

impl Texts {
    fn add(&mut self, text: &str) -> usize {
        if let Some(&place) = self.places.get(text) {
            return place;
        }
        self.all.push(text.to_owned());
        self.places.insert(text.to_owned(), self.all.len() - 1);
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

fn numbers(chunk: &Chunk, start: Duration) -> [i64; 8] {
    [
        chunk.node as i64,
        chunk.items.start as i64,
        chunk.items.len() as i64,
        chunk.worker as i64,
        i64::from(chunk.stolen),
        between(start, chunk.opened),
        between(chunk.opened, chunk.started),
        between(chunk.started, chunk.ended),
    ]
}

/// From one moment to another, in nanoseconds.
fn between(from: Duration, to: Duration) -> i64 {
    let nanoseconds = |time: Duration| i64::try_from(time.as_nanos()).unwrap_or(i64::MAX);
    nanoseconds(to) - nanoseconds(from)
}

fn first_moment(log: &Log) -> Duration {
    let frames = log.frames.iter().map(|frame| frame.began);
    let runs = log.runs.iter().map(|run| run.began);
    let spans = log.spans.iter().map(|span| span.began);
    let idle = log.workers.iter().flat_map(|worker| &worker.idle).map(|idle| idle.began);
    let passes = log.device.iter().flat_map(|device| &device.passes).map(|pass| pass.began);
    frames.chain(runs).chain(spans).chain(idle).chain(passes).min().unwrap_or_default()
}
