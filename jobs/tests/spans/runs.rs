//! A run has one span per node and one per chunk, in every mode.

use std::collections::BTreeSet;

use drawloom_jobs::graph::{FrameGraph, Schedule};
use proptest::prelude::*;
use tracing::level_filters::LevelFilter;
use tracing::{Level, dispatcher, info_span};

use crate::recorder::{ChangeKind, Fields, Origin, Record, Recorder, scheduler, subscriber};
use crate::work::{Mode, RanChunk, RunContext, Work, labels, schedules};

const NODE: Origin = Origin { target: "drawloom::graph", name: "node", level: Level::DEBUG };
const CHUNK: Origin = Origin { target: "drawloom::graph", name: "chunk", level: Level::TRACE };
const TAKEN: Origin = Origin { target: "drawloom::graph", name: "taken", level: Level::TRACE };

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(12) })]

    #[test]
    fn each_node_and_each_chunk_has_a_span(mut schedule in schedules(), has_parent in any::<bool>()) {
        for workers in [1, 2, 4] {
            for mode in Mode::ALL {
                for level in [LevelFilter::DEBUG, LevelFilter::TRACE] {
                    let mut fresh = copy(&mut schedule);
                    mode.set(&mut fresh);
                    let recorder = Recorder::default();
                    let dispatch = subscriber(recorder.clone(), level);
                    let scheduler = scheduler(mode.scheduler(workers), &dispatch);
                    dispatcher::with_default(&dispatch, || for is_first in [true, false] {
                        let context = RunContext::default();
                        let outer = has_parent.then(|| info_span!("outer").entered());
                        fresh.run(&scheduler, &context).unwrap();
                        drop(outer);
                        let (record, ran) = (recorder.take(), context.ran_chunks.into_inner().unwrap());
                        check(&record, &fresh, &ran, has_parent, level);
                        if level < LevelFilter::TRACE || workers == 1 || mode == Mode::Serial {
                            assert_eq!(record.events.len(), 0);
                        } else {
                            check_counters(&record, fresh.len(), mode == Mode::SerialThenParallel && is_first, mode == Mode::Parallel);
                        }
                    });
                }
            }
        }
    }
}

#[test]
fn a_node_that_ran_serially_is_closed_before_the_run_becomes_parallel() {
    let recorder = Recorder::default();
    let dispatch = subscriber(recorder.clone(), LevelFilter::DEBUG);
    let scheduler = scheduler(Mode::SerialThenParallel.scheduler(2), &dispatch);
    let mut graph = FrameGraph::new();
    let first = graph.add("first", Work { number: 0, width: 3, pinned: false });
    graph.keep(first);
    // Enough nodes that some begin while others are still being pushed.
    for number in 1..20_000 {
        let node = graph.add(format!("node {number}"), Work { number, width: 0, pinned: false });
        graph.order(first, node);
        graph.keep(node);
    }
    let mut schedule = graph.compile().unwrap();
    dispatcher::with_default(&dispatch, || schedule.run(&scheduler, &RunContext::default()).unwrap());
    let record = recorder.take();
    record.check_nesting();
    let (closed, last) = record.changes_of(0).next_back().unwrap();
    assert!(record.spans[0].fields["name"] == "first" && last.kind == ChangeKind::Close);
    let first_other = record.changes.iter().position(|change| change.span != 0 && change.kind == ChangeKind::New);
    assert!(first_other.is_some_and(|first_other| closed < first_other));
}

/// The same nodes without measurements of earlier runs.
fn copy(schedule: &mut Schedule<Work>) -> Schedule<Work> {
    let mut graph = FrameGraph::new();
    let mut added = Vec::new();
    for (index, (name, work)) in schedule.nodes().enumerate() {
        let node = graph.add(name, *work);
        if let Some(labels) = labels(work.number) {
            graph.label(node, labels);
        }
        schedule.dependencies(index).iter().for_each(|&before| graph.order(added[before], node));
        graph.keep(node);
        added.push(node);
    }
    graph.compile().unwrap()
}

/// Checks the record of a run that executed these chunks.
fn check(record: &Record, schedule: &Schedule<Work>, ran: &[RanChunk], has_parent: bool, level: LevelFilter) {
    record.check_nesting();
    let outer = record.named("outer").next();
    assert_eq!(outer.is_some(), has_parent);
    let is_detailed = level == LevelFilter::TRACE;
    let chunks = if is_detailed { ran.len() } else { 0 };
    assert_eq!(record.spans.len(), usize::from(has_parent) + schedule.len() + chunks);
    let mut spans = Vec::new();
    for (_, work) in schedule.nodes() {
        let own = |&span: &usize| record.spans[span].fields["name"] == format!("node {}", work.number);
        let found: Vec<_> = record.named("node").filter(own).collect();
        let [span] = found[..] else { panic!("{} spans of {work:?}", found.len()) };
        spans.push(span);
        assert_eq!((record.spans[span].origin, record.spans[span].parent), (NODE, outer));
        assert_eq!(record.spans[span].fields, fields(work.number));

        // The threads that ran chunks, and the one that opened the node, which may have come too late to get a chunk.
        let threads = |kind| {
            let changes = record.changes_of(span).filter(move |(_, change)| change.kind == kind);
            changes.map(|(_, change)| format!("{:?}", change.thread))
        };
        let own = || ran.iter().filter(|chunk| chunk.node == work.number);
        let mut entered: BTreeSet<_> = threads(ChangeKind::Enter).collect();
        let took_part: BTreeSet<_> = own().map(|chunk| format!("{:?}", chunk.thread)).collect();
        assert!(took_part.is_subset(&entered), "{took_part:?} ran chunks, and {entered:?} entered");
        threads(ChangeKind::New).for_each(|opener| _ = entered.remove(&opener));
        assert!(entered.is_subset(&took_part), "{took_part:?} ran chunks, and {entered:?} entered");

        if is_detailed {
            let chunks = record.named("chunk").filter(|&chunk| record.spans[chunk].parent == Some(span));
            let mut found: Vec<_> = chunks.map(|chunk| record.spans[chunk].fields.clone()).collect();
            let mut ran: Vec<_> = own().map(|chunk| items(chunk)).collect();
            found.sort_unstable();
            ran.sort_unstable();
            assert_eq!(found, ran);
        }
    }
    assert!(record.named("chunk").all(|chunk| record.spans[chunk].origin == CHUNK));

    for (index, &span) in spans.iter().enumerate() {
        let (opened, _) = record.changes_of(span).next().unwrap();
        for &before in schedule.dependencies(index) {
            let (closed, last) = record.changes_of(spans[before]).next_back().unwrap();
            assert!(last.kind == ChangeKind::Close && closed < opened, "{index} begins before {before} is closed");
        }
    }
}

fn fields(number: usize) -> Fields {
    let labels = labels(number).unwrap_or_default();
    let labels = [("process", labels.process), ("stage", labels.stage), ("view", labels.view)];
    let labels = labels.into_iter().filter_map(|(name, value)| Some((name, value?.to_string())));
    labels.chain([("name", format!("node {number}"))]).collect()
}

fn items(chunk: &RanChunk) -> Fields {
    [("start", chunk.items.start.to_string()), ("end", chunk.items.end.to_string())].into()
}

/// In a parallel run, there is an event for each node that starts, with the number of other ready nodes.
fn check_counters(record: &Record, nodes: usize, is_suspended: bool, is_parallel: bool) {
    let taken = record.events.len();
    assert!(taken <= nodes && !(is_suspended && taken == nodes) && !(is_parallel && taken < nodes));
    let ready: Vec<usize> = record.events.iter().map(|(_, fields)| fields["ready"].parse().unwrap()).collect();
    assert!(ready.iter().all(|&ready| ready < nodes), "{ready:?}");
    assert!(taken == 0 || ready.contains(&0), "the last one leaves none: {ready:?}");
    for (origin, fields) in &record.events {
        assert_eq!(*origin, TAKEN);
        assert!(fields.len() == 2 && fields["queued"].parse::<usize>().is_ok());
    }
}
