//! What a run that is measured says of itself: every item of every process once, in an order that keeps every dependency.

use std::{hint::black_box, ops::Range, time::Duration};

use drawloom::{
    graph::{FrameGraph, Node, NodeError, RunMeasure, Schedule},
    task::Worker,
};
use proptest::{collection::vec, prelude::*};

use crate::{SCHEDULERS, oracle::sound_sketch};

/// A process of so many items, each of which takes some time. The chunk is the caller's.
#[derive(Clone, Copy, Debug)]
struct Busy {
    width: usize,
    pinned: bool,
}

/// What a run is lent.
struct Call {
    chunk: usize,
    fails: bool,
}

impl Node<Call> for Busy {
    fn width(&self, _call: &Call) -> usize {
        self.width
    }

    fn chunk(&self, call: &Call) -> usize {
        call.chunk
    }

    fn pinned(&self) -> bool {
        self.pinned
    }

    fn run(&self, call: &Call, range: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
        range.for_each(|item| _ = black_box((0..200).fold(item, |sum, step| black_box(sum ^ step))));
        if call.fails { Err("it was to fail".into()) } else { Ok(()) }
    }
}

/// What must hold of every measure of the schedule in a run of chunks of that size.
fn check(measure: &RunMeasure, schedule: &Schedule<Busy>, chunk: usize, workers: usize) {
    assert_eq!(measure.workers(), workers);
    assert_eq!(measure.processes().len(), schedule.len());
    assert!(workers > 1 || measure.shared_from().is_none());
    for (index, (process, (name, busy))) in measure.processes().iter().zip(schedule.processes()).enumerate() {
        assert_eq!(process.name, name);
        assert_eq!(process.dependencies, schedule.dependencies(index));
        assert_eq!(process.pinned, busy.pinned);
        assert_eq!((process.width, process.chunk), (busy.width, chunk.min(busy.width)));
        let chunks = measure.chunks_of(index);
        let mut next = 0;
        for part in chunks {
            assert_eq!((part.process, part.items.clone()), (index, next..(next + chunk).min(busy.width)));
            next = part.items.end;
            assert!(part.began < part.ended && part.ended <= measure.took());
            assert!(part.worker < workers && !(busy.pinned && part.worker != 0));
            let before = process.dependencies.iter().flat_map(|&dependency| measure.chunks_of(dependency));
            before.for_each(|before| assert!(before.ended <= part.began, "{before:?} and {part:?}"));
            let is_alone = measure.shared_from().is_none_or(|from| part.began < from);
            assert!(!is_alone || part.worker == 0, "{part:?} of a worker that was not let in");
        }
        assert_eq!(next, busy.width);
    }
    assert_eq!(measure.chunks().len(), (0..schedule.len()).map(|index| measure.chunks_of(index).len()).sum::<usize>());
    assert_eq!(measure.work(), measure.chunks().iter().map(|chunk| chunk.took()).sum());
    for worker in 0..workers {
        let mut spans: Vec<_> = measure.chunks().iter().filter(|chunk| chunk.worker == worker).collect();
        spans.sort_by_key(|chunk| chunk.began);
        assert!(spans.windows(2).all(|pair| pair[0].ended <= pair[1].began), "worker {worker} did two things at once");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    #[test]
    fn each_item_is_in_one_chunk_and_chunks_keep_all_dependencies(
        sketch in sound_sketch(),
        processes in vec((0..90_usize, prop::bool::weighted(0.2)), 24),
        chunks in vec(1..40_usize, 3),
        always_shares in any::<bool>(),
    ) {
        let graph = sketch.graph(|process| Busy { width: processes[process].0, pinned: processes[process].1 });
        let mut schedule = graph.compile().map_err(|error| TestCaseError::fail(error.to_string()))?;
        schedule.always_share(always_shares);
        for scheduler in &*SCHEDULERS {
            for &chunk in &chunks {
                let measure = schedule.run_measured(scheduler, &Call { chunk, fails: false }).unwrap();
                check(&measure, &schedule, chunk, scheduler.workers());
                // One that is not measured leaves nothing in the next.
                schedule.run(scheduler, &Call { chunk: 1, fails: false }).unwrap();
            }
        }
    }
}

#[test]
fn a_run_that_was_begun_alone_says_from_when_on_it_was_shared() {
    for scheduler in &SCHEDULERS[1..] {
        let mut schedule = one_process(Busy { width: 20_000, pinned: false });
        let measure = schedule.run_measured(scheduler, &Call { chunk: 16, fails: false }).unwrap();
        check(&measure, &schedule, 16, scheduler.workers());
        assert!(measure.shared_from().is_some_and(|from| from > Duration::ZERO), "{:?}", measure.shared_from());
        schedule.always_share(true);
        let measure = schedule.run_measured(scheduler, &Call { chunk: 16, fails: false }).unwrap();
        assert_eq!(measure.shared_from(), Some(Duration::ZERO));
    }
}

#[test]
fn a_run_that_failed_leaves_nothing_in_the_next() {
    for scheduler in &*SCHEDULERS {
        let mut schedule = one_process(Busy { width: 50, pinned: false });
        let error = schedule.run_measured(scheduler, &Call { chunk: 1, fails: true }).unwrap_err();
        assert_eq!(error.to_string(), "the process \"busy\" failed: it was to fail");
        let measure = schedule.run_measured(scheduler, &Call { chunk: 7, fails: false }).unwrap();
        check(&measure, &schedule, 7, scheduler.workers());
    }
}

fn one_process(busy: Busy) -> Schedule<Busy> {
    let mut graph = FrameGraph::new();
    let process = graph.add("busy", busy);
    graph.keep(process);
    graph.compile().unwrap()
}
