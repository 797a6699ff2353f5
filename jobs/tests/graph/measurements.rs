//! What a schedule measures of its runs, and what follows from that: costs, critical paths, and the mode of the next
//! run.

use std::cell::Cell;
use std::collections::HashSet;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, ThreadId};
use std::time::Duration;

use drawloom_jobs::graph::{Closure, FrameGraph, ModeChoice, Schedule};
use drawloom_jobs::task::Worker;

use crate::SCHEDULERS;
use crate::run::single;

/// How long a slow node sleeps at least.
const SLEEP: Duration = Duration::from_millis(4);

type Step = Closure<'static, ()>;

/// Two nodes between a first and a last one. One of the two sleeps.
fn diamond() -> Schedule<Step> {
    let mut graph = FrameGraph::new();
    let first = graph.add("first", Closure::new(|_, _, _| Ok(())));
    let slow = graph.add(
        "slow",
        Closure::new(|_, _, _| {
            thread::sleep(SLEEP);
            Ok(())
        }),
    );
    let quick = graph.add("quick", Closure::new(|_, _, _| Ok(())));
    let last = graph.add("last", Closure::new(|_, _, _| Ok(())));
    for middle in [slow, quick] {
        graph.order(first, middle);
        graph.order(middle, last);
    }
    for node in [first, slow, quick, last] {
        graph.keep(node);
    }
    graph.compile().expect("the graph has no cycle")
}

/// Runs the schedule until `is_reached` holds. Another process may delay single runs, but not all.
fn run_until(schedule: &mut Schedule<Step>, is_reached: impl Fn(&Schedule<Step>) -> bool) {
    for _ in 0..1_000 {
        schedule.run(&SCHEDULERS[1], &()).expect("no node fails");
        if is_reached(schedule) {
            return;
        }
    }
    panic!("not reached after 1,000 runs: {:?}", schedule.run_mode());
}

#[test]
fn costs_count_from_each_nodes_own_start_and_decide_the_critical_path() {
    let mut schedule = diamond();
    schedule.always_parallel(true);
    let index_of = |name: &str| schedule.nodes().position(|(node, _)| node == name).expect("it was not dropped");
    let [first, slow, quick, last] = ["first", "slow", "quick", "last"].map(index_of);
    for node in 0..=schedule.len() {
        assert_eq!(schedule.cost(node), None);
        assert!(!schedule.is_critical(node));
    }
    // The last node starts later than `SLEEP / 2`. So if costs counted from the start of the run, this would never
    // hold.
    run_until(&mut schedule, |schedule| {
        let costs_less = |node| schedule.cost(node).is_some_and(|cost| cost < SLEEP / 2);
        [first, quick, last].into_iter().all(costs_less) && !schedule.is_critical(quick)
    });
    assert!(schedule.cost(slow).is_some_and(|cost| cost >= SLEEP), "{:?}", schedule.cost(slow));
    assert!([first, slow, last].into_iter().all(|node| schedule.is_critical(node)));
    assert_eq!(schedule.cost(schedule.len()), None);
    assert!(!schedule.is_critical(schedule.len()));
    // It was parallel by request, not by choice.
    assert_eq!(schedule.run_mode(), None);
    // Several measured runs, so that the work of earlier ones counts no more.
    for is_parallel in [true, true, true, true, false] {
        schedule.always_parallel(is_parallel);
        schedule.run(&SCHEDULERS[1], &()).expect("no node fails");
    }
    let mode = schedule.run_mode().expect("there was a choice");
    // A serial run includes the sleep.
    assert!(mode.serial_nanoseconds.is_some_and(|time| time >= SLEEP.as_nanos() as f32), "{mode:?}");
}

#[test]
fn little_work_is_run_serially_after_a_trial() {
    let schedule = || single::<Step>(Closure::new(|_, _, _| Ok(())));
    let mut on_one_worker = schedule();
    on_one_worker.run(&SCHEDULERS[0], &()).expect("the node does not fail");
    assert_eq!(on_one_worker.run_mode(), None, "one worker has no choice");

    let [mut schedule, mut successor] = [schedule(), schedule()];
    assert_eq!(schedule.run_mode(), None);
    schedule.run(&SCHEDULERS[1], &()).expect("the node does not fail");
    let first = schedule.run_mode().expect("there was a choice");
    assert!(first.is_trial && !first.parallel && first.serial_nanoseconds.is_none(), "{first:?}");
    let is_serial = |mode: ModeChoice| !mode.is_trial && !mode.parallel && mode.serial_nanoseconds.is_some();
    // A serial run that exceeds its limit, as one may by chance, is followed by parallel ones.
    let serial_runs = Cell::new(0);
    run_until(&mut schedule, |schedule| {
        serial_runs.set(if schedule.run_mode().is_some_and(is_serial) { serial_runs.get() + 1 } else { 0 });
        serial_runs.get() == 10
    });
    successor.inherit_measurements(&schedule);
    successor.run(&SCHEDULERS[1], &()).expect("the node does not fail");
    let inherited = successor.run_mode().expect("there was a choice");
    assert!(is_serial(inherited), "needs no trial: {inherited:?}");
}

#[test]
fn failed_runs_are_not_measured() {
    let mut schedule = single::<Step>(Closure::new(|_, _, _| Err("on purpose".into())));
    for _ in 0..10 {
        schedule.run(&SCHEDULERS[1], &()).expect_err("the node fails");
        let mode = schedule.run_mode().expect("there was a choice");
        assert!(mode.is_trial && !mode.parallel && mode.serial_nanoseconds.is_none(), "{mode:?}");
    }
    schedule.always_parallel(true);
    for _ in 0..10 {
        schedule.run(&SCHEDULERS[1], &()).expect_err("the node fails");
        assert_eq!(schedule.cost(0), None);
    }
}

#[test]
fn the_work_of_failed_runs_does_not_count_for_the_next_measured_one() {
    let is_failing = AtomicBool::new(true);
    let serial_nanoseconds = || {
        let mut schedule = single(Closure::new(|_: &(), _, _| {
            if !is_failing.load(Ordering::Relaxed) {
                return Ok(());
            }
            thread::sleep(SLEEP);
            Err("on purpose".into())
        }));
        // The second parallel run is measured. A failed one does not count, so the next is measured in its place.
        schedule.always_parallel(true);
        for fails in [false, true, true, false] {
            is_failing.store(fails, Ordering::Relaxed);
            assert_eq!(schedule.run(&SCHEDULERS[1], &()).is_err(), fails);
        }
        schedule.always_parallel(false);
        schedule.run(&SCHEDULERS[1], &()).expect("the node does not fail");
        schedule.run_mode().and_then(|mode| mode.serial_nanoseconds).expect("a run was measured")
    };
    // Another process may delay a measured run, but not always.
    assert!((0..100).any(|_| serial_nanoseconds() < SLEEP.as_nanos() as f32));
}

/// A node of 32 chunks, which take far longer than a wake-up, the limit of a schedule's first run. It keeps the threads
/// that run them.
fn long_node(threads: &Mutex<HashSet<ThreadId>>) -> Closure<'_, ()> {
    let body = |_: &(), _, _: &Worker| {
        threads.lock().expect("no thread panics").insert(thread::current().id());
        thread::sleep(Duration::from_millis(1));
        Ok(())
    };
    Closure::new(body).with_width(|_| 32)
}

#[test]
fn a_serial_run_that_takes_too_long_is_continued_by_all_workers() {
    // Another process may delay the other worker, but not always.
    let is_continued_by_both = (0..100).any(|_| {
        let threads = Mutex::default();
        let mut schedule = single(long_node(&threads));
        schedule.run(&SCHEDULERS[1], &()).expect("the node does not fail");
        assert!(schedule.run_mode().is_some_and(|mode| mode.is_trial && !mode.parallel));
        let count = threads.lock().expect("no thread panics").len();
        // A run that began serially and ended in parallel measures neither mode.
        schedule.run(&SCHEDULERS[1], &()).expect("the node does not fail");
        assert!(schedule.run_mode().is_some_and(|mode| mode.parallel && mode.serial_nanoseconds.is_none()));
        count == 2
    });
    assert!(is_continued_by_both);
}

#[test]
fn a_pinned_node_stays_on_its_thread_when_a_serial_run_takes_too_long() {
    for _ in 0..5 {
        let threads = Mutex::default();
        let mut schedule = single(long_node(&threads).on_calling_thread());
        schedule.run(&SCHEDULERS[1], &()).expect("the node does not fail");
        assert!(schedule.run_mode().is_some_and(|mode| mode.is_trial && !mode.parallel));
        assert_eq!(*threads.lock().expect("no thread panics"), HashSet::from([thread::current().id()]));
    }
}
