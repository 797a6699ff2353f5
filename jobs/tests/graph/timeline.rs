//! The timeline of a run: every item of every node is in one chunk, in an order that respects all dependencies.

use std::hint::black_box;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Barrier, LazyLock, Mutex, mpsc};
use std::thread;
use std::time::Duration;

use drawloom_jobs::graph::{Closure, FrameGraph, Node, NodeError, Schedule};
use drawloom_jobs::report::{FrameReport, SchedulerCosts};
use drawloom_jobs::task::{Scheduler, Worker};
use drawloom_jobs::timeline::{Chunk, IdleKind, Log};
use proptest::collection::vec;
use proptest::prelude::*;

use crate::oracle::valid_graph;
use crate::run::single;

/// A node with items that take some time. The context sets the chunk size.
#[derive(Clone, Copy, Debug)]
struct Busy {
    width: usize,
    pinned: bool,
}

/// The context of a run.
struct RunContext {
    chunk: usize,
    fails: bool,
}

impl Node<RunContext> for Busy {
    fn width(&self, _context: &RunContext) -> usize {
        self.width
    }

    fn chunk(&self, context: &RunContext) -> usize {
        context.chunk
    }

    fn pinned(&self) -> bool {
        self.pinned
    }

    fn run(&self, context: &RunContext, range: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
        range.for_each(|item| _ = black_box((0..200).fold(item, |sum, step| black_box(sum ^ step))));
        if context.fails { Err("as planned".into()) } else { Ok(()) }
    }
}

/// Checks the log of the schedule's only run.
fn check(log: &Log, schedule: &Schedule<Busy>, chunk: usize, workers: usize) {
    let [run] = log.runs.as_slice() else { panic!("{} runs", log.runs.len()) };
    assert!(run.complete && !run.failed);
    assert_eq!((run.workers, log.workers.len(), log.all_dropped()), (workers, workers, 0));
    assert_eq!(run.graph.nodes.len(), schedule.len());
    assert!(workers > 1 || run.parallel_from.is_none());
    assert!(run.parallel_from.is_none_or(|from| (run.began..=run.ended).contains(&from)));
    for (index, (node, (name, busy))) in run.graph.nodes.iter().zip(schedule.nodes()).enumerate() {
        assert_eq!(node.name, name);
        assert_eq!(node.dependencies, schedule.dependencies(index));
        assert_eq!((node.pinned, node.chunked_by_cost), (busy.pinned, false));
        let mut next = 0;
        let empty = run.empty.iter().filter(|empty| empty.node == index);
        let parts: Vec<&Chunk> = run.chunks_of(index).iter().chain(empty).collect();
        for part in &parts {
            assert_eq!((part.node, part.items.clone()), (index, next..(next + chunk).min(busy.width)));
            next = part.items.end;
            assert!(part.opened <= part.started && part.started <= part.ended);
            assert!(run.began <= part.opened && part.ended <= run.ended);
            assert_eq!(part.opened, parts[0].opened, "all chunks of a node have the same opening time");
            assert!(part.worker < workers && !(busy.pinned && part.worker != 0));
            assert!(!(part.stolen && (workers == 1 || busy.pinned)), "{part:?}");
            for &dependency in &node.dependencies {
                let before = run.chunks_of(dependency).iter();
                before.for_each(|before| assert!(before.ended <= part.opened, "{before:?} and {part:?}"));
            }
            let is_serial = run.parallel_from.is_none_or(|from| part.started < from);
            assert!(!is_serial || part.worker == 0, "{part:?} of another worker while the run is serial");
        }
        assert_eq!(next, busy.width);
        assert_eq!((parts.is_empty(), run.width(index)), (false, busy.width));
    }
    assert_eq!(run.chunks.len(), (0..schedule.len()).map(|index| run.chunks_of(index).len()).sum::<usize>());
    assert_eq!(run.work(), run.chunks.iter().map(Chunk::duration).sum());
    for (worker, record) in log.workers.iter().enumerate() {
        let chunks = run.chunks.iter().chain(&run.empty).filter(|chunk| chunk.worker == worker);
        let idle = record.idle.iter().map(|idle| (idle.began, idle.ended));
        let mut spans: Vec<_> = chunks.map(|chunk| (chunk.started, chunk.ended)).chain(idle).collect();
        spans.sort_unstable();
        assert!(spans.windows(2).all(|pair| pair[0].1 <= pair[1].0), "intervals of worker {worker} overlap");
    }
}

/// Runs the schedule, and returns the log of the run.
fn recorded(schedule: &mut Schedule<Busy>, scheduler: &Scheduler, context: &RunContext) -> Log {
    let timeline = scheduler.timeline();
    timeline.take();
    timeline.start();
    _ = schedule.run(scheduler, context);
    timeline.stop();
    timeline.take()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    #[test]
    fn each_item_is_in_one_chunk_and_chunks_respect_all_dependencies(
        model in valid_graph(),
        shapes in vec((0..90_usize, prop::bool::weighted(0.2)), 24),
        chunks in vec(1..40_usize, 3),
        always_parallel in any::<bool>(),
    ) {
        let graph = model.graph(|node| Busy { width: shapes[node].0, pinned: shapes[node].1 });
        let mut schedule = graph.compile().map_err(|error| TestCaseError::fail(error.to_string()))?;
        schedule.always_parallel(always_parallel);
        for scheduler in &*RECORDED {
            for &chunk in &chunks {
                let log = recorded(&mut schedule, scheduler, &RunContext { chunk, fails: false });
                check(&log, &schedule, chunk, scheduler.workers());
                // A run while the timeline is off must not appear in the next log.
                schedule.run(scheduler, &RunContext { chunk: 1, fails: false }).unwrap();
            }
        }
    }
}

#[test]
fn the_log_has_the_time_at_which_a_serial_run_became_parallel() {
    let scheduler = Scheduler::new(2).unwrap();
    let mut schedule = single(Busy { width: 20_000, pinned: false });
    let log = recorded(&mut schedule, &scheduler, &RunContext { chunk: 16, fails: false });
    check(&log, &schedule, 16, 2);
    assert!(log.runs[0].parallel_from.is_some_and(|from| from > log.runs[0].began), "{:?}", log.runs[0].parallel_from);
    schedule.always_parallel(true);
    let log = recorded(&mut schedule, &scheduler, &RunContext { chunk: 16, fails: false });
    assert!(log.runs[0].parallel_from <= log.runs[0].chunks.iter().map(|chunk| chunk.opened).min());
}

#[test]
fn a_worker_that_joins_a_node_has_stolen_its_chunks() {
    let scheduler = Scheduler::new(2).unwrap();
    let barrier = Barrier::new(2);
    let mut graph = FrameGraph::new();
    let meet = Closure::new(|_: &(), _range, _worker| {
        barrier.wait();
        Ok(())
    });
    // No ticket claims both chunks.
    let wide = graph.add("wide", meet.with_width(|_| 2));
    let after = graph.add("after", Closure::new(|_: &(), _range, _worker| Ok(())));
    graph.order(wide, after);
    graph.keep(after);
    graph.keep(wide);
    let mut schedule = graph.compile().unwrap();
    schedule.always_parallel(true);
    scheduler.timeline().start();
    for _run in 0..20 {
        schedule.run(&scheduler, &()).unwrap();
    }
    for run in scheduler.timeline().take().runs {
        let wide = run.chunks_of(0);
        assert!((0..2).all(|worker| wide.iter().any(|chunk| chunk.worker == worker)));
        assert!(wide.iter().all(|chunk| chunk.stolen == (chunk.worker == 1)), "{wide:?}");
        assert!(!run.chunks_of(1)[0].stolen, "the worker that completes the first node runs the next");
    }
}

#[test]
fn a_failed_run_is_marked_and_leaves_nothing_in_the_next() {
    let scheduler = Scheduler::new(2).unwrap();
    let mut schedule = single(Busy { width: 50, pinned: false });
    let log = recorded(&mut schedule, &scheduler, &RunContext { chunk: 1, fails: true });
    assert!(log.runs[0].failed && log.runs[0].complete);
    assert!((1..50).contains(&log.runs[0].chunks.len()), "{} chunks", log.runs[0].chunks.len());
    let log = recorded(&mut schedule, &scheduler, &RunContext { chunk: 7, fails: false });
    check(&log, &schedule, 7, 2);
}

#[test]
fn dropped_chunks_are_counted_and_their_run_is_not_complete() {
    let scheduler = Scheduler::builder().workers(1).timeline_capacity(64).build().unwrap();
    let mut schedule = single(Busy { width: 100, pinned: false });
    assert_eq!(scheduler.timeline().bytes(), 0);
    scheduler.timeline().start();
    assert_eq!(scheduler.timeline().bytes(), 64 * 48);
    for chunk in [4, 1, 4] {
        schedule.run(&scheduler, &RunContext { chunk, fails: false }).unwrap();
    }
    let log = scheduler.timeline().take();
    assert_eq!(log.runs.iter().map(|run| run.chunks.len()).collect::<Vec<_>>(), [25, 39, 0]);
    assert_eq!(log.runs.iter().map(|run| run.complete).collect::<Vec<_>>(), [true, false, false]);
    assert_eq!((log.workers[0].dropped, log.all_dropped()), (61 + 25, 61 + 25));
    // Taking the log made room.
    schedule.run(&scheduler, &RunContext { chunk: 4, fails: false }).unwrap();
    check(&scheduler.timeline().take(), &schedule, 4, 1);
}

#[test]
fn a_run_that_lost_chunks_is_not_complete_even_if_the_clock_runs_backwards() {
    let clock = {
        let now = AtomicU64::new(1_000_000);
        move || Duration::from_micros(now.fetch_sub(1, Ordering::Relaxed))
    };
    let scheduler = Scheduler::builder().workers(1).timeline_capacity(64).timeline_clock(clock).build().unwrap();
    let mut schedule = single(Busy { width: 100, pinned: false });
    scheduler.timeline().start();
    for chunk in [4, 1, 4] {
        schedule.run(&scheduler, &RunContext { chunk, fails: false }).unwrap();
    }
    let log = scheduler.timeline().take();
    assert_eq!(log.runs.iter().map(|run| run.chunks.len()).collect::<Vec<_>>(), [25, 39, 0]);
    assert_eq!(log.runs.iter().map(|run| run.complete).collect::<Vec<_>>(), [true, false, false]);
}

#[test]
fn a_run_is_not_complete_if_a_log_is_taken_during_it_and_lost_chunks_are_counted() {
    let scheduler = Scheduler::new(1).unwrap();
    let early = Mutex::new(None);
    let mut graph = FrameGraph::new();
    let take = Closure::new(|_: &(), range: Range<usize>, _worker| {
        if range.start == 5 {
            *early.lock().unwrap() = Some(scheduler.timeline().take());
        }
        Ok(())
    });
    let node = graph.add("take", take.with_width(|_| 9));
    graph.keep(node);
    let mut schedule = graph.compile().unwrap();
    scheduler.timeline().start();
    schedule.run(&scheduler, &()).unwrap();
    let early = early.lock().unwrap().take().unwrap();
    assert_eq!((early.runs.len(), early.all_dropped()), (0, 5));
    let late = scheduler.timeline().take();
    assert_eq!((late.runs[0].complete, late.runs[0].chunks.len()), (false, 4));
    schedule.run(&scheduler, &()).unwrap();
    assert!(!scheduler.timeline().take().runs[0].complete);
}

#[test]
fn each_run_is_a_frame_unless_the_engine_marks_frames() {
    let scheduler = Scheduler::new(1).unwrap();
    let mut schedule = single(Busy { width: 5, pinned: false });
    let timeline = scheduler.timeline();
    timeline.start();
    let mut run = || schedule.run(&scheduler, &RunContext { chunk: 1, fails: false }).unwrap();
    run();
    run();
    let log = timeline.take();
    assert_eq!(log.runs.iter().map(|run| run.frame).collect::<Vec<_>>(), [0, 1]);
    assert_eq!(log.frames.iter().map(|frame| frame.number).collect::<Vec<_>>(), [0, 1]);
    timeline.mark_frame();
    run();
    let simulated = timeline.span("simulate");
    run();
    drop(simulated);
    timeline.count("objects", 3.0);
    timeline.mark_frame();
    let log = timeline.take();
    assert_eq!(log.runs.iter().map(|run| run.frame).collect::<Vec<_>>(), [2, 2]);
    assert_eq!(log.frames.iter().map(|frame| frame.number).collect::<Vec<_>>(), [2, 3]);
    assert!(log.frames[0].began <= log.runs[0].began && log.frames[0].ended == log.spans[0].ended);
    assert_eq!((log.spans[0].name.as_str(), log.spans[0].frame), ("simulate", 2));
    assert!(log.threads[log.spans[0].thread].contains("each_run_is_a_frame"));
    assert_eq!((log.counters[0].name.as_str(), log.counters[0].value), ("objects", 3.0));
}

#[test]
fn frames_that_an_engine_marked_before_the_start_are_counted() {
    let scheduler = Scheduler::new(1).unwrap();
    let mut schedule = single(Busy { width: 5, pinned: false });
    let timeline = scheduler.timeline();
    timeline.mark_frame();
    assert_eq!(timeline.take().frames, [], "it is off");
    // In the middle of the engine's frame.
    timeline.start();
    for _run in 0..2 {
        schedule.run(&scheduler, &RunContext { chunk: 1, fails: false }).unwrap();
    }
    timeline.mark_frame();
    schedule.run(&scheduler, &RunContext { chunk: 1, fails: false }).unwrap();
    let log = timeline.take();
    assert_eq!(log.runs.iter().map(|run| run.frame).collect::<Vec<_>>(), [0, 0, 1]);
    assert_eq!(log.frames.len(), 2);
}

#[test]
fn background_runs_do_not_extend_frames() {
    let scheduler = Arc::new(Scheduler::new(2).unwrap());
    scheduler.timeline().start();
    let (begun, has_begun) = mpsc::channel();
    let (ended, has_ended) = mpsc::channel::<()>();
    let streaming = {
        let scheduler = Arc::clone(&scheduler);
        scheduler.clone().background(move || {
            let has_ended = Mutex::new(has_ended);
            let stream = Closure::new(move |_: &(), _range, _worker| {
                begun.send(()).unwrap();
                has_ended.lock().unwrap().recv().unwrap();
                Ok(())
            });
            let mut graph = FrameGraph::new();
            let stream = graph.add("stream", stream);
            graph.keep(stream);
            graph.compile().unwrap().run(&scheduler, &()).unwrap();
        })
    };
    has_begun.recv().unwrap();
    let mut schedule = single(Busy { width: 5, pinned: false });
    for _run in 0..2 {
        schedule.run(&scheduler, &RunContext { chunk: 1, fails: false }).unwrap();
    }
    ended.send(()).unwrap();
    streaming.wait().unwrap();
    let log = scheduler.timeline().take();
    let runs: Vec<_> = log.runs.iter().map(|run| (run.in_background, run.graph.nodes[0].name.as_str())).collect();
    assert_eq!(runs, [(false, "single"), (false, "single"), (true, "stream")]);
    assert_ne!(log.runs[0].frame, log.runs[1].frame, "each run is a frame of its own");
    for run in &log.runs[..2] {
        let frame = log.frames.iter().find(|frame| frame.number == run.frame).unwrap();
        assert_eq!((frame.began, frame.ended), (run.began, run.ended));
        let report = FrameReport::new(&log, run.frame, &SchedulerCosts::ZERO).unwrap();
        assert_eq!((report.duration, report.critical_path[0].name.as_str()), (run.duration(), "single"));
    }
}

#[test]
fn a_span_around_a_run_belongs_to_the_runs_frame() {
    let scheduler = Scheduler::new(1).unwrap();
    let mut schedule = single(Busy { width: 5, pinned: false });
    scheduler.timeline().start();
    for _frame in 0..3 {
        let _span = scheduler.timeline().span("frame");
        schedule.run(&scheduler, &RunContext { chunk: 1, fails: false }).unwrap();
    }
    let log = scheduler.timeline().take();
    let frames = log.frames.iter().zip(&log.spans).zip(&log.runs);
    for ((frame, span), run) in frames {
        assert_eq!((span.frame, run.frame), (frame.number, frame.number));
        assert_eq!((frame.began, frame.ended), (span.began, span.ended));
    }
    assert_eq!(log.frames.len(), 3);
}

#[test]
fn a_worker_that_fell_asleep_before_the_start_is_asleep_in_the_log() {
    let scheduler = Scheduler::new(2).unwrap();
    let asleep = |log: &Log| log.workers[1].idle.iter().any(|idle| idle.kind == IdleKind::Asleep);
    let is_asleep = (0..10_000).any(|_try| {
        thread::sleep(Duration::from_millis(1));
        asleep(&scheduler.timeline().take())
    });
    assert!(is_asleep);
    scheduler.timeline().start();
    let log = scheduler.timeline().take();
    assert!(asleep(&log) && log.workers[1].idle[0].began < log.workers[1].idle[0].ended);
}

#[test]
fn runs_that_a_stolen_job_starts_are_not_stolen() {
    let scheduler = Scheduler::new(2).unwrap();
    let mut schedule = single(Busy { width: 1, pinned: false });
    schedule.always_parallel(true);
    let (done, is_done) = mpsc::channel();
    scheduler.timeline().start();
    scheduler
        .scope(|scope| {
            scope.spawn(|_scope, _worker| {
                (0..2).for_each(|_run| schedule.run(&scheduler, &RunContext { chunk: 1, fails: false }).unwrap());
                done.send(()).unwrap();
            });
            // This thread waits, so the other worker runs the job.
            is_done.recv().unwrap();
        })
        .unwrap();
    let log = scheduler.timeline().take();
    let chunks: Vec<_> = log.runs.iter().flat_map(|run| &run.chunks).collect();
    assert_eq!(chunks.iter().map(|chunk| (chunk.worker, chunk.stolen)).collect::<Vec<_>>(), [(1, false); 2]);
}

#[test]
fn a_restart_begins_a_new_frame() {
    let scheduler = Scheduler::new(1).unwrap();
    let timeline = scheduler.timeline();
    timeline.start();
    drop(timeline.span("load"));
    timeline.mark_frame();
    drop(timeline.span("draw"));
    timeline.stop();
    timeline.start();
    drop(timeline.span("the rest of a later frame"));
    let log = timeline.take();
    assert_eq!(log.spans.iter().map(|span| span.frame).collect::<Vec<_>>(), [0, 1, 2]);
    assert!(log.frames.windows(2).all(|pair| pair[0].ended <= pair[1].began), "{:?}", log.frames);
}

#[test]
fn each_log_names_only_its_own_threads() {
    let scheduler = Scheduler::new(1).unwrap();
    let timeline = scheduler.timeline();
    timeline.start();
    for round in ["first", "second"] {
        let thread = thread::Builder::new().name(round.to_owned());
        thread::scope(|scope| _ = thread.spawn_scoped(scope, || drop(timeline.span("span"))).unwrap());
        let log = timeline.take();
        assert_eq!((log.threads, log.spans[0].thread), (vec![round.to_owned()], 0));
    }
    // If all spans of a thread were dropped, it is not named either.
    (0..1 << 16).for_each(|_span| drop(timeline.span("span")));
    thread::scope(|scope| _ = scope.spawn(|| drop(timeline.span("late"))));
    let log = timeline.take();
    assert_eq!((log.threads.len(), log.dropped), (1, 1));
}

#[test]
fn each_idle_interval_is_in_one_log() {
    let scheduler = Scheduler::new(2).unwrap();
    scheduler.timeline().start();
    let mut until = Duration::ZERO;
    for _log in 0..20 {
        thread::sleep(Duration::from_millis(1));
        for idle in &scheduler.timeline().take().workers[1].idle {
            assert!(until <= idle.began && idle.began <= idle.ended, "{idle:?} after {until:?}");
            until = idle.ended;
        }
    }
    assert!(until > Duration::ZERO);
}

#[test]
fn any_capacity_is_accepted() {
    for capacity in [0, usize::MAX] {
        let scheduler = Scheduler::builder().workers(1).timeline_capacity(capacity).build().unwrap();
        assert!(!scheduler.timeline().is_on());
    }
}

#[test]
fn a_boxed_node_is_run_as_the_node_in_the_box() {
    /// Differs from the defaults in everything.
    struct Unusual;

    impl Node<()> for Unusual {
        fn width(&self, _context: &()) -> usize {
            5
        }

        fn chunk(&self, _context: &()) -> usize {
            2
        }

        fn chunked_by_cost(&self, _context: &()) -> bool {
            true
        }

        fn pinned(&self) -> bool {
            true
        }

        fn run(&self, _context: &(), _range: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
            Ok(())
        }
    }

    let mut graph: FrameGraph<Box<dyn Node<()> + Send + Sync>> = FrameGraph::new();
    let unusual = graph.add("unusual", Box::new(Unusual));
    let plain = graph.add("plain", Box::new(Closure::new(|_: &(), _range, _worker| Ok(()))));
    [unusual, plain].into_iter().for_each(|node| graph.keep(node));
    let mut schedule = graph.compile().unwrap();
    let scheduler = Scheduler::new(1).unwrap();
    scheduler.timeline().start();
    schedule.run(&scheduler, &()).unwrap();
    let log = scheduler.timeline().take();
    let [run] = log.runs.as_slice() else { panic!("{} runs", log.runs.len()) };
    for (index, node) in run.graph.nodes.iter().enumerate() {
        let is_unusual = node.name == "unusual";
        assert_eq!((node.pinned, node.chunked_by_cost), (is_unusual, is_unusual), "{}", node.name);
        let chunks: Vec<_> = run.chunks_of(index).iter().map(|chunk| chunk.items.len()).collect();
        assert_eq!(chunks, if is_unusual { vec![2, 2, 1] } else { vec![1] }, "{}", node.name);
    }
}

/// Separate from the schedulers of the other tests, because all runs of a scheduler are recorded.
static RECORDED: LazyLock<[Scheduler; 3]> =
    LazyLock::new(|| [1, 2, 4].map(|workers| Scheduler::new(workers).expect("four threads can be started")));
