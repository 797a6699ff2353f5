//! Whole runs of small schedules, in random interleavings by shuttle.
//!
//! Each node counts how often each of its items has run, and checks that all items of its dependencies have run.

use std::iter;
use std::ops::Range;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::time::Duration;

use tracing::{Dispatch, Event, Metadata, Subscriber, dispatcher, span};

use super::{FrameGraph, Node, NodeError, RunError, Schedule};
use crate::sync::{AtomicUsize, Ordering, check, thread};
use crate::task::{Scheduler, SchedulerBuilder, Worker};

/// Between the usual and the longest duration of these schedules by shuttle's random clock, so that some serial runs
/// stay within their limit and some exceed it.
const WAKE_UP_COST: Duration = Duration::from_micros(2);

/// The context of a run.
struct Frame<'frame> {
    scheduler: &'frame Scheduler,
    /// Per node, how often each of its items has run.
    ran: Vec<Vec<AtomicUsize>>,
    /// How often a node was called before all its dependencies had run.
    called_too_early: AtomicUsize,
    /// Whether nodes of the failing kinds fail.
    fails: bool,
}

/// What a node does besides counting.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Plain,
    Pinned,
    /// Opens a scope and a loop in each item.
    Nests,
    /// Its second item returns an error, or panics.
    Fails,
    Panics,
}

#[derive(Clone)]
struct TestNode {
    index: usize,
    width: usize,
    kind: Kind,
    after: Vec<usize>,
}

impl TestNode {
    fn check_dependencies(&self, frame: &Frame<'_>) {
        let mut items = self.after.iter().flat_map(|&before| &frame.ran[before]);
        if items.any(|item| item.load(Ordering::Relaxed) != 1) {
            frame.called_too_early.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn nest(&self, scheduler: &Scheduler) {
        let inner = AtomicUsize::new(0);
        let count = || _ = inner.fetch_add(1, Ordering::Relaxed);
        let outcome = scheduler.scope(|scope| (0..2).for_each(|_job| scope.spawn(|_scope, _worker| count())));
        assert_eq!(outcome, Ok(()));
        assert_eq!(scheduler.parallel_for(2, 1, |_range, _worker| count()), Ok(()));
        assert_eq!(inner.load(Ordering::Relaxed), 4);
    }
}

impl Node<Frame<'_>> for TestNode {
    fn width(&self, frame: &Frame<'_>) -> usize {
        self.check_dependencies(frame);
        self.width
    }

    fn pinned(&self) -> bool {
        self.kind == Kind::Pinned
    }

    fn run(&self, frame: &Frame<'_>, range: Range<usize>, worker: &Worker) -> Result<(), NodeError> {
        assert!(worker.index() == 0 || self.kind != Kind::Pinned);
        self.check_dependencies(frame);
        if frame.fails && range.contains(&1) {
            match self.kind {
                Kind::Fails => return Err("as planned".into()),
                // Unlike `panic!`, this prints nothing, which it would do in each interleaving.
                Kind::Panics => resume_unwind(Box::new("as planned")),
                Kind::Plain | Kind::Pinned | Kind::Nests => {}
            }
        }
        if self.kind == Kind::Nests {
            self.nest(frame.scheduler);
        }
        for item in range {
            frame.ran[self.index][item].fetch_add(1, Ordering::Relaxed);
        }
        Ok(())
    }
}

/// Nodes with a width, a kind, and the indices of their dependencies.
fn nodes(list: &[(usize, Kind, &[usize])]) -> Vec<TestNode> {
    let node = |(index, &(width, kind, after)): (usize, &(usize, Kind, &[usize]))| TestNode {
        index,
        width,
        kind,
        after: after.to_vec(),
    };
    list.iter().enumerate().map(node).collect()
}

fn schedule(nodes: &[TestNode]) -> Schedule<TestNode> {
    let mut graph = FrameGraph::new();
    let mut ids = Vec::new();
    for node in nodes {
        let id = graph.add(node.index.to_string(), node.clone());
        graph.keep(id);
        node.after.iter().for_each(|&before| graph.order(ids[before], id));
        ids.push(id);
    }
    graph.compile().expect("the dependencies have lower indices")
}

/// Runs one frame, and returns how often each item has run.
fn run_frame(
    schedule: &mut Schedule<TestNode>,
    scheduler: &Scheduler,
    fails: bool,
) -> (Result<(), RunError>, Vec<Vec<usize>>) {
    let counters = |node: &TestNode| iter::repeat_with(|| AtomicUsize::new(0)).take(node.width).collect();
    let ran = schedule.nodes().map(|(_, node)| counters(node)).collect();
    let frame = Frame { scheduler, ran, called_too_early: AtomicUsize::new(0), fails };
    let outcome = schedule.run(scheduler, &frame);
    assert_eq!(frame.called_too_early.load(Ordering::Relaxed), 0);
    let counts = |items: &Vec<AtomicUsize>| items.iter().map(|item| item.load(Ordering::Relaxed)).collect();
    (outcome, frame.ran.iter().map(counts).collect())
}

/// Runs a frame in which no node fails.
fn run_all(schedule: &mut Schedule<TestNode>, scheduler: &Scheduler) {
    let (outcome, ran) = run_frame(schedule, scheduler, false);
    outcome.unwrap();
    assert!(ran.iter().flatten().all(|&times| times == 1), "an item has not run, or has run twice: {ran:?}");
}

/// Checks `frames` frames of these nodes, on schedulers of a few workers and on one that shuffles.
fn check_frames(frames: usize, always_parallel: bool, nodes: Vec<TestNode>) {
    let nodes = Arc::new(nodes);
    for (workers, seed) in [(2, None), (3, None), (2, Some(1))] {
        let nodes = Arc::clone(&nodes);
        check(move || {
            let builder = Scheduler::builder().workers(workers).wake_up_cost(WAKE_UP_COST);
            let scheduler = seed.into_iter().fold(builder, SchedulerBuilder::shuffle).build().unwrap();
            let mut schedule = schedule(&nodes);
            schedule.always_parallel(always_parallel);
            (0..frames).for_each(|_frame| run_all(&mut schedule, &scheduler));
        });
    }
}

#[test]
fn shuttle_a_diamond_runs_in_order() {
    use Kind::Plain;
    check_frames(1, true, nodes(&[(1, Plain, &[]), (1, Plain, &[0]), (1, Plain, &[0]), (1, Plain, &[1, 2])]));
}

#[test]
fn shuttle_nodes_that_become_ready_together_all_run() {
    use Kind::Plain;
    let fan = [(1, Plain, &[0][..]); 9];
    let list: Vec<_> =
        iter::once((1, Plain, &[][..])).chain(fan).chain([(1, Plain, &[1, 2, 3, 4, 5, 6, 7, 8, 9][..])]).collect();
    check_frames(1, true, nodes(&list));
}

#[test]
fn shuttle_a_wide_node_is_complete_when_its_last_item_is() {
    use Kind::Plain;
    check_frames(1, true, nodes(&[(1, Plain, &[]), (5, Plain, &[0]), (0, Plain, &[0]), (2, Plain, &[1, 2])]));
}

#[test]
fn shuttle_pinned_nodes_run_on_the_calling_thread() {
    use Kind::{Pinned, Plain};
    let list: [(usize, Kind, &[usize]); 5] =
        [(1, Plain, &[]), (2, Pinned, &[0]), (1, Plain, &[0]), (2, Plain, &[1, 2]), (1, Pinned, &[2])];
    check_frames(1, true, nodes(&list));
}

#[test]
fn shuttle_nodes_may_open_scopes() {
    use Kind::{Nests, Plain};
    check_frames(1, true, nodes(&[(2, Nests, &[]), (1, Nests, &[]), (1, Plain, &[0, 1])]));
}

#[test]
fn shuttle_one_frame_follows_another() {
    use Kind::{Pinned, Plain};
    let list: [(usize, Kind, &[usize]); 5] =
        [(3, Plain, &[]), (1, Plain, &[]), (1, Plain, &[0]), (1, Pinned, &[0, 1]), (2, Plain, &[2, 3])];
    check_frames(3, true, nodes(&list));
}

#[test]
fn shuttle_a_serial_run_that_exceeds_its_limit_continues_in_parallel() {
    use Kind::{Pinned, Plain};
    let list: [(usize, Kind, &[usize]); 6] = [
        (2, Plain, &[]),
        (4, Plain, &[]),
        (2, Plain, &[0]),
        (2, Pinned, &[0]),
        (1, Plain, &[0, 1]),
        (3, Plain, &[2, 3, 4]),
    ];
    check_frames(4, false, nodes(&list));
}

#[test]
fn shuttle_a_failure_cancels_the_dependents_and_the_next_frame_is_complete() {
    use Kind::{Fails, Panics, Plain};
    for (kind, other, always_parallel) in [(Fails, Plain, true), (Panics, Plain, false), (Fails, Panics, true)] {
        for workers in [2, 3] {
            check(move || {
                let scheduler = Scheduler::builder().workers(workers).wake_up_cost(WAKE_UP_COST).build().unwrap();
                let list: [(usize, Kind, &[usize]); 5] =
                    [(1, Plain, &[]), (3, kind, &[0]), (2, other, &[0]), (1, Plain, &[1]), (1, Plain, &[2, 3])];
                let mut schedule = schedule(&nodes(&list));
                schedule.always_parallel(always_parallel);
                if !always_parallel {
                    run_all(&mut schedule, &scheduler);
                }
                let (outcome, ran) = run_frame(&mut schedule, &scheduler, true);
                match outcome {
                    Err(RunError::Failed { node, source }) => {
                        assert_eq!((node.as_str(), source.to_string().as_str()), ("1", "as planned"));
                    }
                    Err(RunError::Panicked { node, message }) => {
                        assert!(node == "1" || node == "2");
                        assert_eq!(message, "as planned");
                    }
                    other => panic!("a run with a failure: {other:?}"),
                }
                assert_eq!(ran[3..], [[0], [0]], "dependents of a failed node have run");
                assert!(ran.iter().flatten().all(|&times| times <= 1), "{ran:?}");
                run_all(&mut schedule, &scheduler);
            });
        }
    }
}

/// A subscriber that panics when `left` more spans have been entered; 0 means never. All threads of a model run on one
/// thread of the system, so it is the subscriber of all of them.
struct PanickingSubscriber {
    left: std::sync::atomic::AtomicUsize,
}

impl Subscriber for PanickingSubscriber {
    fn enabled(&self, _metadata: &Metadata<'_>) -> bool {
        true
    }

    fn new_span(&self, _attributes: &span::Attributes<'_>) -> span::Id {
        span::Id::from_u64(1)
    }

    fn record(&self, _span: &span::Id, _values: &span::Record<'_>) {}

    fn record_follows_from(&self, _span: &span::Id, _follows: &span::Id) {}

    fn event(&self, _event: &Event<'_>) {}

    fn enter(&self, _span: &span::Id) {
        let count_down = |left: usize| left.checked_sub(1);
        if self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, count_down) == Ok(1) {
            resume_unwind(Box::new("as planned"));
        }
    }

    fn exit(&self, _span: &span::Id) {}
}

#[test]
fn shuttle_a_subscriber_that_panics_between_nodes_fails_no_run() {
    use Kind::{Pinned, Plain};
    let subscriber = Arc::new(PanickingSubscriber { left: std::sync::atomic::AtomicUsize::new(0) });
    let dispatch = Dispatch::from(Arc::clone(&subscriber));
    for (workers, always_parallel) in [(2, true), (3, true), (2, false)] {
        let (subscriber, dispatch) = (Arc::clone(&subscriber), dispatch.clone());
        let next = Arc::new(std::sync::atomic::AtomicUsize::new(0));
        check(move || {
            let list: [(usize, Kind, &[usize]); 5] =
                [(2, Plain, &[]), (3, Plain, &[0]), (1, Pinned, &[0]), (0, Plain, &[1]), (1, Plain, &[2, 3])];
            let scheduler = Scheduler::builder().workers(workers).wake_up_cost(WAKE_UP_COST).build().unwrap();
            let mut schedule = schedule(&nodes(&list));
            schedule.always_parallel(always_parallel);
            dispatcher::with_default(&dispatch, || {
                subscriber.left.store(1 + next.fetch_add(1, Ordering::Relaxed) % 12, Ordering::Relaxed);
                let (outcome, ran) = run_frame(&mut schedule, &scheduler, false);
                subscriber.left.store(0, Ordering::Relaxed);
                assert!(outcome.is_ok(), "{outcome:?}");
                assert!(ran.iter().flatten().all(|&times| times == 1), "{ran:?}");
                (0..2).for_each(|_frame| run_all(&mut schedule, &scheduler));
            });
        });
    }
}

#[test]
fn shuttle_complete_runs_have_all_chunks_in_logs_taken_during_runs() {
    use Kind::Plain;
    const WIDTHS: [usize; 3] = [3, 1, 0];
    check(|| {
        // Fewer events than two runs have.
        let builder = Scheduler::builder().workers(2).wake_up_cost(WAKE_UP_COST).timeline_capacity(8);
        let scheduler = Arc::new(builder.build().unwrap());
        let reader = thread::spawn({
            let scheduler = Arc::clone(&scheduler);
            move || {
                let timeline = scheduler.timeline();
                timeline.start();
                let logs = [(); 2].map(|()| timeline.take());
                timeline.stop();
                logs
            }
        });
        let list: [(usize, Kind, &[usize]); 3] =
            [(WIDTHS[0], Plain, &[]), (WIDTHS[1], Plain, &[0]), (WIDTHS[2], Plain, &[0])];
        let mut schedule = schedule(&nodes(&list));
        schedule.always_parallel(true);
        (0..3).for_each(|_frame| run_all(&mut schedule, &scheduler));
        let mut logs = Vec::from(reader.join().unwrap());
        logs.push(scheduler.timeline().take());
        let (mut runs, mut events, mut dropped) = (0, 0, 0);
        for log in &logs {
            dropped += log.all_dropped();
            for run in &log.runs {
                runs += 1;
                events += run.chunks.len() + run.empty.len();
                if run.complete {
                    assert_eq!([0, 1, 2].map(|node| run.width(node)), WIDTHS);
                    assert_eq!(run.empty.len(), 1);
                }
            }
        }
        // Each run has four chunks and one empty node. The dropped events include idle intervals.
        assert!(events + dropped as usize >= 5 * runs, "{events} events of {runs} runs, and {dropped} dropped");
    });
}
