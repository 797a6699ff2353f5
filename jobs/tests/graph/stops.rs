//! Failing runs: the chunks that are cancelled, the reported error, and the next run, which is unaffected.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Barrier, Mutex};

use drawloom_jobs::graph::{Closure, FrameGraph, Node, NodeError, RunError, Schedule};
use drawloom_jobs::task::Worker;

use crate::SCHEDULERS;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Failure {
    Error,
    PanicInRun,
    PanicInWidth,
    PanicInChunk,
    PanicInPinned,
}

/// A node of ten items that fails at the fourth item, or before the first.
struct Failing<'a> {
    failure: Failure,
    is_on: &'a AtomicBool,
}

impl Failing<'_> {
    fn has(&self, failure: Failure) -> bool {
        self.failure == failure && self.is_on.load(Ordering::Relaxed)
    }
}

type Log = Mutex<Vec<String>>;

impl Node<Log> for Failing<'_> {
    fn width(&self, _log: &Log) -> usize {
        assert!(!self.has(Failure::PanicInWidth), "as planned");
        10
    }

    fn chunk(&self, _log: &Log) -> usize {
        assert!(!self.has(Failure::PanicInChunk), "as planned");
        1
    }

    fn pinned(&self) -> bool {
        assert!(!self.has(Failure::PanicInPinned), "as planned");
        false
    }

    fn run(&self, _log: &Log, range: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
        if range.contains(&3) {
            assert!(!self.has(Failure::PanicInRun), "as planned");
            if self.has(Failure::Error) {
                return Err("as planned".into());
            }
        }
        Ok(())
    }
}

/// A chain of `first`, `failing` and `last`. The first and the last log their names.
fn chain(failure: Failure, is_on: &AtomicBool) -> Schedule<Box<dyn Node<Log> + '_>> {
    let logging = |name: &'static str| {
        Closure::new(move |log: &Log, _, _| {
            log.lock().map_err(|_| "poisoned")?.push(name.to_owned());
            Ok(())
        })
    };
    let mut graph = FrameGraph::<Box<dyn Node<Log> + '_>>::new();
    let nodes = [
        graph.add("first", Box::new(logging("first"))),
        graph.add("failing", Box::new(Failing { failure, is_on })),
        graph.add("last", Box::new(logging("last"))),
    ];
    for pair in nodes.windows(2) {
        graph.order(pair[0], pair[1]);
    }
    for node in nodes {
        graph.keep(node);
    }
    graph.compile().expect("the graph is valid")
}

#[test]
fn a_failure_stops_the_run_and_the_error_names_the_node() {
    let all =
        [Failure::Error, Failure::PanicInRun, Failure::PanicInWidth, Failure::PanicInChunk, Failure::PanicInPinned];
    for failure in all {
        for scheduler in SCHEDULERS.iter() {
            let is_on = AtomicBool::new(false);
            let mut schedule = chain(failure, &is_on);
            for fails in [true, false, true, true, false] {
                is_on.store(fails, Ordering::Relaxed);
                let log = Log::default();
                let result = schedule.run(scheduler, &log);
                let log = log.into_inner().expect("no thread panics while it holds the log");
                match result {
                    Ok(()) => assert!(!fails && log == ["first", "last"], "{log:?}"),
                    Err(RunError::Failed { node, source }) => {
                        assert!(fails && failure == Failure::Error);
                        assert_eq!((node.as_str(), source.to_string().as_str()), ("failing", "as planned"));
                        assert_eq!(log, ["first"]);
                    }
                    Err(RunError::Panicked { node, message }) => {
                        assert!(fails && failure != Failure::Error);
                        assert_eq!((node.as_str(), message.as_str()), ("failing", "as planned"));
                        assert_eq!(log, ["first"]);
                    }
                    Err(other) => panic!("{other}"),
                }
            }
        }
    }
}

#[test]
fn a_root_that_panics_in_pinned_is_named() {
    let is_on = AtomicBool::new(true);
    let mut graph = FrameGraph::new();
    let root = graph.add("root", Failing { failure: Failure::PanicInPinned, is_on: &is_on });
    graph.keep(root);
    let mut schedule = graph.compile().expect("the graph is valid");
    let error = schedule.run(&SCHEDULERS[1], &Log::default()).expect_err("it panics");
    assert_eq!(error.to_string(), r#"the node "root" panicked: as planned"#);
    is_on.store(false, Ordering::Relaxed);
    schedule.run(&SCHEDULERS[1], &Log::default()).expect("it does not panic");
}

#[test]
fn no_further_chunk_starts_after_a_failure() {
    for pinned in [false, true] {
        let started = AtomicUsize::new(0);
        let node = Closure::new(|(): &(), range: Range<usize>, _| {
            started.fetch_add(1, Ordering::Relaxed);
            if range.len() < 2 {
                return Err("a width beyond half of usize must have chunks of at least 2 items".into());
            }
            if range.contains(&5) { Err("enough".into()) } else { Ok(()) }
        });
        // So wide that the run ends only because the failure stops it.
        let node = node.with_width(|()| usize::MAX);
        let mut graph = FrameGraph::new();
        let node = graph.add("endless", if pinned { node.on_calling_thread() } else { node });
        let after = graph.add("after", Closure::new(|(): &(), _, _| panic!("it must not run")));
        graph.order(node, after);
        graph.keep(node);
        graph.keep(after);
        let mut schedule = graph.compile().expect("the graph is valid");
        for scheduler in SCHEDULERS.iter() {
            started.store(0, Ordering::Relaxed);
            let error = schedule.run(scheduler, &()).expect_err("it fails");
            assert_eq!(error.to_string(), r#"the node "endless" failed: enough"#);
            if pinned || scheduler.workers() == 1 {
                // One chunk after another, up to the one that fails.
                assert!(started.load(Ordering::Relaxed) <= 6);
            }
        }
    }
}

#[test]
fn of_two_failures_the_first_node_in_the_schedule_is_reported() {
    // Each node waits until the other runs, so both fail in every run.
    let failing = |message: &'static str| {
        Closure::new(move |barrier: &Barrier, _, _| {
            barrier.wait();
            Err(message.into())
        })
    };
    let mut graph = FrameGraph::new();
    for name in ["one", "two"] {
        let node = graph.add(name, failing(name));
        graph.keep(node);
    }
    let mut schedule = graph.compile().expect("the graph is valid");
    schedule.always_parallel(true);
    for _ in 0..200 {
        let error = schedule.run(&SCHEDULERS[1], &Barrier::new(2)).expect_err("both fail");
        assert_eq!(error.to_string(), r#"the node "one" failed: one"#);
    }
}

#[test]
fn of_two_failing_chunks_the_lowest_is_reported() {
    let failing = Closure::new(|barrier: &Barrier, range: Range<usize>, _| {
        barrier.wait();
        Err(format!("chunk {}", range.start).into())
    });
    let mut graph = FrameGraph::new();
    let node = graph.add("wide", failing.with_width(|_| 2));
    graph.keep(node);
    let mut schedule = graph.compile().expect("the graph is valid");
    schedule.always_parallel(true);
    for _ in 0..200 {
        let error = schedule.run(&SCHEDULERS[1], &Barrier::new(2)).expect_err("both fail");
        assert_eq!(error.to_string(), r#"the node "wide" failed: chunk 0"#);
    }
}

#[test]
fn a_panic_in_an_errors_drop_does_not_reach_the_caller() {
    #[derive(Debug, thiserror::Error)]
    #[error("bad")]
    struct Bad;
    impl Drop for Bad {
        fn drop(&mut self) {
            panic!("dropped");
        }
    }
    let failing = |both: &Barrier, _: Range<usize>, _: &Worker| -> Result<(), NodeError> {
        both.wait();
        Err(Box::new(Bad))
    };
    let mut graph = FrameGraph::new();
    for name in ["one", "two"] {
        let node = graph.add(name, Closure::new(failing));
        graph.keep(node);
    }
    let mut schedule = graph.compile().expect("the graph is valid");
    schedule.always_parallel(true);
    for _ in 0..50 {
        match schedule.run(&SCHEDULERS[1], &Barrier::new(2)) {
            Err(RunError::Failed { node, source }) => {
                std::mem::forget(source);
                assert_eq!(node, "one");
            }
            other => panic!("{other:?}"),
        }
    }
}
