//! Logs to show.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Duration;

use drawloom_jobs::graph::{Closure, FrameGraph};
use drawloom_jobs::task::Scheduler;
use drawloom_jobs::timeline::{Chunk, Frame, Graph, Idle, IdleKind, Labels, Log, NodeInfo, Run, Span, WorkerLog};
use fastrand::Rng;
use libtest_mimic::Failed;

/// Five runs of a random graph on two workers.
pub fn real_runs() -> Result<Log, Failed> {
    let mut random = Rng::with_seed(7);
    let mut graph = FrameGraph::new();
    let mut nodes = Vec::new();
    for index in 0..40 {
        let width = random.usize(..400);
        let body = Closure::new(|_: &(), range, _worker| {
            range.for_each(|item| _ = black_box((0..200).fold(item, |sum, step| black_box(sum ^ step))));
            Ok(())
        });
        let node = graph.add(format!("node {index}"), body.with_width(move |_| width).with_chunk(16));
        let stage = Some(["cull", "fill", "sort"][index % 3].into());
        graph.label(node, Labels { stage, ..Labels::default() });
        for _ in 0..random.usize(..3).min(nodes.len()) {
            graph.order(nodes[random.usize(..nodes.len())], node);
        }
        graph.keep(node);
        nodes.push(node);
    }
    let mut schedule = graph.compile().map_err(|error| error.to_string())?;
    schedule.always_parallel(true);
    let scheduler = Scheduler::new(2)?;
    scheduler.timeline().start();
    for _ in 0..5 {
        let _span = scheduler.timeline().span("frame");
        schedule.run(&scheduler, &())?;
    }
    Ok(scheduler.timeline().take())
}

/// `count` chunks on eight workers, in `frames` frames: a chain of wide nodes with gaps between them.
pub fn many_chunks(count: usize, frames: usize) -> Log {
    const WORKERS: usize = 8;
    const CHUNKS: usize = 250;
    let nodes = count / frames / CHUNKS;
    let node = |index: usize| NodeInfo {
        name: format!("node {index}"),
        labels: Labels { stage: Some(format!("stage {}", index % 9).into()), ..Labels::default() },
        dependencies: index.checked_sub(1).into_iter().collect(),
        ..NodeInfo::default()
    };
    let graph = Arc::new(Graph { nodes: (0..nodes).map(node).collect() });
    let mut random = Rng::with_seed(1);
    let mut log = Log::default();
    log.workers.resize(WORKERS, WorkerLog { name: "worker".to_owned(), ..WorkerLog::default() });
    let mut now = Duration::from_secs(5);
    for number in 0..frames as u64 {
        let began = now;
        let mut chunks = Vec::new();
        for node in 0..nodes {
            let opened = now;
            let mut free_at = [now; WORKERS];
            for chunk in 0..CHUNKS {
                let worker = (0..WORKERS).min_by_key(|&worker| free_at[worker]).unwrap_or_default();
                let started = free_at[worker];
                let ended = started + Duration::from_nanos(500 + random.u64(..9_000));
                let items = chunk * 16..chunk * 16 + 16;
                chunks.push(Chunk { node, items, worker, opened, started, ended, stolen: worker > 0 });
                free_at[worker] = ended;
            }
            now = free_at.into_iter().max().unwrap_or(now) + Duration::from_micros(2);
            for (worker, &began) in free_at.iter().enumerate() {
                let kind = if worker % 2 == 0 { IdleKind::Searching } else { IdleKind::Asleep };
                log.workers[worker].idle.push(Idle { kind, began, ended: now });
            }
        }
        let graph = Arc::clone(&graph);
        let run =
            Run { frame: number, graph, workers: WORKERS, began, ended: now, complete: true, chunks, ..Run::default() };
        log.runs.push(run);
        log.frames.push(Frame { number, began, ended: now });
    }
    log
}

/// Three frames with a diamond of nodes each: `left` and `right` depend on the root, `right` ends later, and the end
/// depends on both, in two chunks. A thread works before and after them. The second frame is twice as long as the
/// others.
pub fn diamonds() -> Log {
    let node = |name: &str, dependencies: &[usize]| NodeInfo {
        name: name.to_owned(),
        dependencies: dependencies.to_vec(),
        ..NodeInfo::default()
    };
    let nodes = vec![node("root", &[]), node("left", &[0]), node("right", &[0]), node("end", &[1, 2])];
    let graph = Arc::new(Graph { nodes });
    let workers = ["caller", "other"].map(|name| WorkerLog { name: name.to_owned(), ..WorkerLog::default() });
    let mut log = Log { workers: workers.into(), threads: vec!["main".to_owned()], ..Log::default() };
    let starts = [(0, 100), (100, 200), (300, 100)];
    for (number, (start, length)) in (0_u64..).zip(starts) {
        let at = |share: u64| Duration::from_micros(start + length * share / 100);
        let chunk = |node, items, worker, opened, started, ended| Chunk {
            node,
            items,
            worker,
            opened: at(opened),
            started: at(started),
            ended: at(ended),
            stolen: worker > 0,
        };
        let chunks = vec![
            chunk(0, 0..1, 0, 5, 5, 20),
            chunk(1, 0..1, 0, 20, 20, 40),
            chunk(2, 0..1, 1, 25, 25, 60),
            chunk(3, 0..10, 1, 62, 62, 80),
            chunk(3, 10..20, 0, 62, 70, 95),
        ];
        let graph = Arc::clone(&graph);
        let (began, ended) = (at(2), at(97));
        log.runs.push(Run { frame: number, graph, workers: 2, began, ended, complete: true, chunks, ..Run::default() });
        let (began, ended) = (at(0), at(99));
        log.spans.push(Span { name: "work".to_owned(), thread: 0, frame: number, began, ended });
        log.frames.push(Frame { number, began, ended });
    }
    log
}
