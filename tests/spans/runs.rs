//! One span a process and run, one a chunk, whichever way a run goes.

use std::collections::BTreeSet;

use drawloom::graph::{FrameGraph, Schedule};
use proptest::prelude::*;
use tracing::level_filters::LevelFilter;
use tracing::{Level, dispatcher, info_span};

use crate::recorder::{Fields, MoveKind, Origin, Record, Recorder, scheduler, subscriber};
use crate::work::{Call, Entry, Way, Work, labels, schedules};

const NODE: Origin = Origin { target: "drawloom::graph", name: "node", level: Level::DEBUG };
const CHUNK: Origin = Origin { target: "drawloom::graph", name: "chunk", level: Level::TRACE };
const TAKEN: Origin = Origin { target: "drawloom::graph", name: "taken", level: Level::TRACE };

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(32) })]

    #[test]
    fn spans_are_the_processes_and_the_chunks_that_ran(mut schedule in schedules(), has_parent in any::<bool>()) {
        for workers in [1, 2, 4] {
            for way in Way::ALL {
                for level in [LevelFilter::DEBUG, LevelFilter::TRACE] {
                    let mut fresh = copy(&mut schedule);
                    way.set(&mut fresh);
                    let recorder = Recorder::default();
                    let dispatch = subscriber(recorder.clone(), level);
                    let scheduler = scheduler(way.scheduler(workers), &dispatch);
                    dispatcher::with_default(&dispatch, || for is_first in [true, false] {
                        let call = Call::default();
                        let outer = has_parent.then(|| info_span!("outer").entered());
                        fresh.run(&scheduler, &call).unwrap();
                        drop(outer);
                        let (record, book) = (recorder.take(), call.book.into_inner().unwrap());
                        check(&record, &fresh, &book, has_parent, level);
                        if level < LevelFilter::TRACE || workers == 1 || way == Way::Alone {
                            assert_eq!(record.events.len(), 0);
                        } else {
                            check_counters(&record, fresh.len(), way == Way::BegunAlone && is_first, way == Way::Shared);
                        }
                    });
                }
            }
        }
    }
}

#[test]
fn a_process_that_was_done_alone_is_closed_before_the_rest_is_shared() {
    let recorder = Recorder::default();
    let dispatch = subscriber(recorder.clone(), LevelFilter::DEBUG);
    let scheduler = scheduler(Way::BegunAlone.scheduler(2), &dispatch);
    let mut graph = FrameGraph::new();
    let first = graph.add("first", Work { number: 0, width: 3, pinned: false });
    graph.keep(first);
    // So many that others begin while they are still being handed out.
    for number in 1..20_000 {
        let process = graph.add(format!("process {number}"), Work { number, width: 0, pinned: false });
        graph.order(first, process);
        graph.keep(process);
    }
    let mut schedule = graph.compile().unwrap();
    dispatcher::with_default(&dispatch, || schedule.run(&scheduler, &Call::default()).unwrap());
    let record = recorder.take();
    record.check_nesting();
    let (closed, last) = record.moves_of(0).next_back().unwrap();
    assert!(record.spans[0].fields["name"] == "first" && last.kind == MoveKind::Close);
    let others_begin = record.moves.iter().position(|of| of.span != 0 && of.kind == MoveKind::New);
    assert!(others_begin.is_some_and(|begin| closed < begin));
}

/// The same processes with nothing known of earlier runs.
fn copy(schedule: &mut Schedule<Work>) -> Schedule<Work> {
    let mut graph = FrameGraph::new();
    let mut added = Vec::new();
    for (index, (name, work)) in schedule.nodes().enumerate() {
        let process = graph.add(name, *work);
        if let Some(labels) = labels(work.number) {
            graph.label(process, labels);
        }
        schedule.dependencies(index).iter().for_each(|&before| graph.order(added[before], process));
        graph.keep(process);
        added.push(process);
    }
    graph.compile().unwrap()
}

/// What must be told of a run in which that ran which stands in the book.
fn check(record: &Record, schedule: &Schedule<Work>, book: &[Entry], has_parent: bool, level: LevelFilter) {
    record.check_nesting();
    let outer = record.named("outer").next();
    assert_eq!(outer.is_some(), has_parent);
    let is_detailed = level == LevelFilter::TRACE;
    let chunks = if is_detailed { book.len() } else { 0 };
    assert_eq!(record.spans.len(), usize::from(has_parent) + schedule.len() + chunks);
    let mut spans = Vec::new();
    for (_, work) in schedule.nodes() {
        let own = |&span: &usize| record.spans[span].fields["name"] == format!("process {}", work.number);
        let found: Vec<_> = record.named("node").filter(own).collect();
        let [span] = found[..] else { panic!("{} spans of {work:?}", found.len()) };
        spans.push(span);
        assert_eq!((record.spans[span].origin, record.spans[span].parent), (NODE, outer));
        assert_eq!(record.spans[span].fields, fields(work.number));

        // Who took part, but for whoever opened the process, who may have come too late for a chunk.
        let threads = |kind| {
            let moves = record.moves_of(span).filter(move |(_, of)| of.kind == kind);
            moves.map(|(_, of)| format!("{:?}", of.thread))
        };
        let own = || book.iter().filter(|entry| entry.process == work.number);
        let mut entered: BTreeSet<_> = threads(MoveKind::Enter).collect();
        let took_part: BTreeSet<_> = own().map(|entry| format!("{:?}", entry.thread)).collect();
        assert!(took_part.is_subset(&entered), "{took_part:?} took part, and {entered:?} entered");
        threads(MoveKind::New).for_each(|opener| _ = entered.remove(&opener));
        assert!(entered.is_subset(&took_part), "{took_part:?} took part, and {entered:?} entered");

        if is_detailed {
            let chunks = record.named("chunk").filter(|&chunk| record.spans[chunk].parent == Some(span));
            let mut told: Vec<_> = chunks.map(|chunk| record.spans[chunk].fields.clone()).collect();
            let mut ran: Vec<_> = own().map(|entry| items(entry)).collect();
            told.sort_unstable();
            ran.sort_unstable();
            assert_eq!(told, ran);
        }
    }
    assert!(record.named("chunk").all(|chunk| record.spans[chunk].origin == CHUNK));

    for (index, &span) in spans.iter().enumerate() {
        let (opened, _) = record.moves_of(span).next().unwrap();
        for &before in schedule.dependencies(index) {
            let (closed, last) = record.moves_of(spans[before]).next_back().unwrap();
            assert!(last.kind == MoveKind::Close && closed < opened, "{index} begins before {before} is closed");
        }
    }
}

fn fields(number: usize) -> Fields {
    let labels = labels(number).unwrap_or_default();
    let labels = [("process", labels.process), ("stage", labels.stage), ("view", labels.view)];
    let labels = labels.into_iter().filter_map(|(name, value)| Some((name, value?)));
    labels.chain([("name", format!("process {number}"))]).collect()
}

fn items(entry: &Entry) -> Fields {
    [("start", entry.items.start.to_string()), ("end", entry.items.end.to_string())].into()
}

/// Every process that is taken up in a shared run is told, with a count of others that are ready.
fn check_counters(record: &Record, processes: usize, is_begun_alone: bool, is_shared: bool) {
    let told = record.events.len();
    assert!(told <= processes && !(is_begun_alone && told == processes) && !(is_shared && told < processes));
    let ready: Vec<usize> = record.events.iter().map(|(_, fields)| fields["ready"].parse().unwrap()).collect();
    assert!(ready.iter().all(|&ready| ready < processes), "{ready:?}");
    assert!(told == 0 || ready.contains(&0), "the last one leaves none: {ready:?}");
    for (origin, fields) in &record.events {
        assert_eq!(*origin, TAKEN);
        assert!(fields.len() == 2 && fields["queued"].parse::<usize>().is_ok());
    }
}
