//! Reports of hand-made frames with known results.

use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use drawloom_jobs::report::{FrameReport, HeldBy, ReportError, SchedulerCosts};
use drawloom_jobs::timeline::{Chunk, Graph, Idle, IdleKind, Labels, Log, NodeInfo, Run, Span, WorkerLog};
use expect_test::expect_file;

fn micros(count: u64) -> Duration {
    Duration::from_micros(count)
}

fn chunk(node: usize, item: usize, worker: usize, times: Range<u64>) -> Chunk {
    let [started, ended] = [times.start, times.end].map(micros);
    Chunk { node, items: item..item + 1, worker, opened: started, started, ended, stolen: worker == 1 }
}

fn node(name: &str, group: &str, dependencies: &[usize]) -> NodeInfo {
    let labels = Labels { process: Some(group.into()), ..Labels::default() };
    NodeInfo { name: name.to_owned(), labels, dependencies: dependencies.to_vec(), ..NodeInfo::default() }
}

fn span(name: &str, times: Range<u64>) -> Span {
    let [began, ended] = [times.start, times.end].map(micros);
    Span { name: name.to_owned(), thread: 0, frame: 12, began, ended }
}

/// A frame of two workers, from 1,000 µs on: `record` with a run in it, and `submit` after a pause. `lighting` is ready
/// at the same time as `shadows`, but the caller begins with `shadows`, and the other worker wakes up for these as
/// well.
///
/// ```text
/// caller    | record 100 | cull 200 | . shadows 290 | lighting 200 | end 20, record 80 |   | submit 100 |
/// worker 1               |  asleep  | .. shadows 270 | bloom 80 |  searching
/// ```
fn log() -> Log {
    let nodes = vec![
        node("cull", "visibility", &[]),
        node("lighting, record", "lighting", &[0]),
        node("shadows, record", "shadows", &[0]),
        node("bloom", "post", &[2]),
        node("nothing", "post", &[1, 3]),
    ];
    let run = Run {
        frame: 12,
        graph: Arc::new(Graph { nodes }),
        workers: 2,
        began: micros(1_100),
        ended: micros(1_820),
        parallel_from: Some(micros(1_100)),
        always_parallel: true,
        complete: true,
        chunks: vec![
            chunk(0, 0, 0, 1_100..1_200),
            chunk(0, 1, 0, 1_200..1_300),
            chunk(1, 0, 0, 1_600..1_800),
            chunk(2, 0, 0, 1_310..1_600),
            chunk(2, 1, 1, 1_350..1_620),
            chunk(3, 0, 1, 1_620..1_700),
        ],
        empty: vec![Chunk { items: 0..0, ..chunk(4, 0, 0, 1_800..1_800) }],
        ..Run::default()
    };
    let idle = |kind, times: Range<u64>| Idle { kind, began: micros(times.start), ended: micros(times.end) };
    let workers = vec![
        WorkerLog { name: "caller".to_owned(), ..WorkerLog::default() },
        WorkerLog {
            name: "worker 1".to_owned(),
            idle: vec![idle(IdleKind::Asleep, 900..1_330), idle(IdleKind::Searching, 1_700..1_950)],
            dropped: 0,
        },
    ];
    Log {
        workers,
        threads: vec!["main".to_owned()],
        runs: vec![run],
        spans: vec![span("record", 1_000..1_900), span("submit", 2_000..2_100), span("extract", 1_020..1_050)],
        ..Log::default()
    }
}

fn report_of(log: &Log) -> FrameReport {
    FrameReport::new(log, 12, &SchedulerCosts::ZERO).unwrap()
}

#[test]
fn the_report_of_a_hand_made_frame_equals_the_calculation() {
    let report = report_of(&log());
    assert_eq!((report.frame, report.began, report.duration), (12, micros(1_000), micros(1_000)));
    let steps = report.critical_path.iter();
    let steps: Vec<_> = steps.map(|step| (step.name.as_str(), step.ready, step.started, step.ended)).collect();
    let step = |name, ready, started, ended| (name, micros(ready), micros(started), micros(ended));
    let expected = [
        step("record, before its jobs", 1_000, 1_000, 1_020),
        step("extract", 1_020, 1_020, 1_050),
        step("record, before its jobs", 1_050, 1_050, 1_100),
        step("cull", 1_100, 1_100, 1_300),
        step("shadows, record", 1_300, 1_310, 1_600),
        step("lighting, record", 1_600, 1_600, 1_800),
        step("nothing", 1_800, 1_800, 1_800),
        step("end of the run", 1_800, 1_800, 1_820),
        step("record, after its jobs", 1_820, 1_820, 1_900),
        step("submit", 2_000, 2_000, 2_100),
    ];
    assert_eq!(steps, expected);
    let holders = report.critical_path.iter().map(|step| (step.node, step.worker, step.held_by));
    let span = |node, held_by| (Some((0, node)), Some(0), held_by);
    let outside = [(None, None, HeldBy::Start); 3];
    let spans =
        [span(0, HeldBy::Start), span(2, HeldBy::Dependency), span(1, HeldBy::Worker), span(4, HeldBy::Dependency)];
    assert_eq!(holders.collect::<Vec<_>>(), [outside.as_slice(), &spans, &outside].concat());
    let shares: Vec<_> = report.shares.iter().map(|share| (share.group.as_str(), share.duration())).collect();
    let expected = [
        ("shadows", 300),
        ("lighting", 200),
        ("visibility", 200),
        ("record", 150),
        ("submit", 100),
        ("extract", 30),
        ("end of the run", 20),
    ];
    assert_eq!(shares[..7], expected.map(|(group, took)| (group, micros(took))));
    assert_eq!(report.slack.iter().map(|slack| slack.time).collect::<Vec<_>>(), [0, 0, 0, 100, 0].map(micros));
    let worker = |index: usize| {
        let worker = &report.workers[index];
        let times = [worker.busy, worker.searching, worker.asleep, worker.other];
        (times, worker.chunks, worker.stolen)
    };
    assert_eq!(worker(0), ([690, 0, 0, 310].map(micros), 4, 0));
    assert_eq!(worker(1), ([350, 200, 330, 120].map(micros), 2, 2));
    let [wait, short] = report.queue_waits.as_slice() else { panic!("{:?}", report.queue_waits) };
    assert_eq!((wait.name.as_str(), wait.waited()), ("lighting, record", micros(300)));
    assert_eq!(wait.meanwhile, [("shadows".to_owned(), micros(290 + 250))]);
    assert_eq!((short.name.as_str(), short.waited()), ("shadows, record", micros(10)));
    // Without scheduler costs: 280 µs outside of the run, the two chunks of cull in parallel, then lighting and a chunk
    // of shadows in parallel with the other chunk of shadows, then bloom.
    assert_eq!(report.replayed, micros(280 + 100 + 200 + 270 + 80));
    let what_if: Vec<_> = report.what_if.iter().map(|what_if| (what_if.group.as_str(), what_if.saved)).collect();
    // Without shadows only lighting is left after cull. Without lighting both chunks of shadows run in parallel.
    let expected = [("shadows", 350), ("lighting", 180), ("visibility", 100), ("post", 80)];
    assert_eq!(what_if, expected.map(|(group, saved)| (group, micros(saved))));
    assert_eq!(report.on_workers, [(1, 1_320), (2, 930), (4, 750), (8, 750), (16, 750)].map(|(w, t)| (w, micros(t))));
}

#[test]
fn the_text_equals_the_golden_file() {
    expect_file!["report.txt"].assert_eq(&report_of(&log()).to_string());
}

#[test]
fn the_text_leaves_out_small_savings_and_short_waits() {
    let mut report = report_of(&log());
    report.what_if[2].saved = micros(4);
    report.what_if[3].saved = Duration::ZERO;
    report.queue_waits = vec![report.queue_waits[0].clone(); 10];
    let text = report.to_string();
    assert!(text.contains("if lighting cost nothing") && !text.contains("if visibility cost nothing"), "{text}");
    assert!(text.contains("\n  and 2 groups that would save less\n"), "{text}");
    assert_eq!(text.matches("lighting, record: 1.8 shadows").count(), 5, "{text}");
    report.what_if[0].saved = micros(4);
    report.what_if[1].saved = micros(4);
    let text = report.to_string();
    assert!(!text.contains("could be saved") && !text.contains("cost nothing"), "{text}");
}

#[test]
fn a_worker_span_inside_another_is_not_held_up_by_it() {
    let mut log = log();
    // The caller runs lighting while its chunk of shadows waits for something, and finishes it before that chunk.
    log.runs[0].chunks[2] = chunk(1, 0, 0, 1_400..1_500);
    log.runs[0].chunks[3] = chunk(2, 0, 0, 1_310..1_650);
    log.runs[0].chunks[5] = chunk(3, 0, 1, 1_650..1_700);
    let path = report_of(&log).critical_path;
    let spans: Vec<_> = path[3..6].iter().map(|step| (step.name.as_str(), step.ended, step.held_by)).collect();
    let span = |name, ended, held_by| (name, micros(ended), held_by);
    let expected = [
        span("cull", 1_300, HeldBy::Start),
        span("shadows, record", 1_650, HeldBy::Dependency),
        span("bloom", 1_700, HeldBy::Dependency),
    ];
    assert_eq!(spans, expected);
}

#[test]
fn a_run_inside_a_chunk_of_another_counts_once() {
    let mut log = log();
    let inner = Run {
        graph: Arc::new(Graph { nodes: vec![node("inner", "inner", &[])] }),
        began: micros(1_400),
        ended: micros(1_500),
        chunks: vec![chunk(0, 0, 0, 1_420..1_480)],
        empty: Vec::new(),
        ..log.runs[0].clone()
    };
    log.runs.insert(0, inner);
    // Inside the chunk the calling thread waits for the other workers.
    log.workers[0].idle.push(Idle { kind: IdleKind::Searching, began: micros(1_480), ended: micros(1_500) });
    let (report, without) = (report_of(&log), report_of(&self::log()));
    let names = |report: &FrameReport| report.critical_path.iter().map(|step| step.name.clone()).collect::<Vec<_>>();
    assert_eq!((report.duration, names(&report)), (without.duration, names(&without)));
    assert_eq!(report.critical_path[3].node, Some((1, 0)), "its run is the second one of the log");
    let caller = &report.workers[0];
    assert_eq!([caller.busy, caller.searching, caller.other], [670, 20, 310].map(micros));
    assert_eq!((caller.chunks, report.what_if), (5, without.what_if));
}

#[test]
fn of_two_overlapping_spans_the_one_that_began_last_is_on_the_path() {
    let mut log = log();
    log.spans.push(span("stream", 1_880..1_950));
    let path = report_of(&log).critical_path;
    let last: Vec<_> = path[8..].iter().map(|step| (step.name.as_str(), step.duration())).collect();
    assert_eq!(
        last,
        [("record, after its jobs", 60), ("stream", 70), ("submit", 100)].map(|(name, took)| (name, micros(took)))
    );
}

#[test]
fn the_part_of_a_span_between_two_runs_is_named_between() {
    let mut log = log();
    let later = |time: Duration| time + micros(740);
    let mut second = log.runs[0].clone();
    (second.began, second.ended) = (later(second.began), later(second.ended));
    for chunk in second.chunks.iter_mut().chain(&mut second.empty) {
        (chunk.opened, chunk.started, chunk.ended) = (chunk.opened, later(chunk.started), later(chunk.ended));
    }
    log.runs.push(second);
    log.spans = vec![span("record", 1_090..2_600)];
    let report = report_of(&log);
    let outside = report.critical_path.iter().filter(|step| step.node.is_none());
    let outside: Vec<_> = outside.map(|step| (step.name.as_str(), step.duration())).collect();
    let expected = [
        ("record, before its jobs", 10),
        ("end of the run", 20),
        ("record, between its jobs", 20),
        ("end of the run", 20),
        ("record, after its jobs", 40),
    ];
    assert_eq!(outside, expected.map(|(name, took)| (name, micros(took))));
}

#[test]
fn a_missing_incomplete_or_failed_frame_is_an_error() {
    let report = |log: &Log, frame| FrameReport::new(log, frame, &SchedulerCosts::ZERO).map(|_| ());
    assert_eq!(report(&log(), 13), Err(ReportError::NoRun { frame: 13 }));
    let mut incomplete = log();
    incomplete.runs[0].complete = false;
    assert_eq!(report(&incomplete, 12), Err(ReportError::Incomplete { frame: 12 }));
    let mut failed = log();
    failed.runs[0].failed = true;
    assert_eq!(report(&failed, 12), Err(ReportError::Failed { frame: 12 }));
}

#[test]
fn an_inconsistent_log_is_an_error() {
    let is_refused = |corrupt: fn(&mut Run)| {
        let mut log = log();
        corrupt(&mut log.runs[0]);
        FrameReport::new(&log, 12, &SchedulerCosts::ZERO) == Err(ReportError::Contradictory { frame: 12 })
    };
    assert!(is_refused(|run| run.chunks[0].worker = 99));
    assert!(is_refused(|run| run.chunks[0].node = 77));
    assert!(is_refused(|run| run.empty[0].node = 77));
    assert!(is_refused(|run| run.chunks.iter_mut().for_each(|chunk| chunk.items = 0..usize::MAX)));
    assert!(is_refused(|run| Arc::make_mut(&mut run.graph).nodes[0].dependencies.push(3)));
    assert!(is_refused(|run| Arc::make_mut(&mut run.graph).nodes[0].dependencies.push(0)));
}

#[test]
fn a_report_tolerates_times_that_run_backwards() {
    let range = |start, end| Range { start, end };
    let mut log = log();
    let run = &mut log.runs[0];
    run.chunks.push(chunk(3, 9, 1, range(1_400, 1_300)));
    run.ended = micros(1_500);
    log.spans.push(span("backwards", range(1_500, 1_400)));
    log.workers[1].idle.push(Idle { kind: IdleKind::Asleep, began: micros(1_500), ended: micros(1_200) });
    let mut overlapping = log.runs[0].clone();
    (overlapping.began, overlapping.ended) = (micros(1_400), micros(1_850));
    log.runs.push(overlapping);
    let backwards = |times: Range<u64>| {
        let [began, ended] = [times.start, times.end].map(micros);
        Run { frame: 12, began, ended, complete: true, ..Run::default() }
    };
    log.runs.push(backwards(range(1_880, 1_860)));
    let report = report_of(&log);
    assert_eq!(report.critical_path.iter().map(|step| step.duration()).sum::<Duration>(), report.duration);
    let times =
        |worker: &drawloom_jobs::report::WorkerReport| worker.busy + worker.searching + worker.asleep + worker.other;
    assert!(report.workers.iter().all(|worker| times(worker) == report.duration));
    let report = report_of(&Log { runs: vec![backwards(range(5, 3))], ..Log::default() });
    assert_eq!((report.duration, report.critical_path), (Duration::ZERO, vec![]));
}

#[test]
fn the_text_is_short_with_any_names() {
    let mut log = log();
    let names = (0..200).map(|index| format!("{index}\n\u{1b}[31m{}", "x".repeat(10_000)));
    let nodes = names.enumerate().map(|(index, name)| {
        let before = index.checked_sub(1 + index % 2);
        node(&name, &name, before.as_slice())
    });
    log.runs[0].graph = Arc::new(Graph { nodes: nodes.collect() });
    log.runs[0].empty.clear();
    log.runs[0].chunks =
        (0..200).map(|index| chunk(index, 0, index % 2, 1_100 + index as u64 * 3..1_103 + index as u64 * 3)).collect();
    log.workers = vec![WorkerLog { name: "w\t".repeat(100), ..WorkerLog::default() }; 100];
    let mut report = report_of(&log);
    let long = |index: usize| format!("{index}{}", "x".repeat(10_000));
    report.shares.iter_mut().enumerate().for_each(|(index, share)| share.group = long(index));
    report.queue_waits[0].meanwhile = (0..9).map(|index| (long(index), micros(200))).collect();
    let text = report.to_string();
    assert!(text.lines().count() < 110, "{text}");
    let longest = text.lines().map(|line| line.chars().count()).max().unwrap();
    assert!(longest <= 120, "{longest}");
    assert!(!text.chars().any(|character| character.is_control() && character != '\n'));
    assert!(text.contains("shorter steps") && text.contains("more in between") && text.contains("and 84 workers"));
}

#[test]
fn neighbouring_steps_of_one_group_are_merged_to_one_line() {
    let mut log = log();
    let nodes = (0..30).map(|index: usize| node(&format!("p{index}"), "chain", index.checked_sub(1).as_slice()));
    log.runs[0].graph = Arc::new(Graph { nodes: nodes.collect() });
    log.runs[0].empty.clear();
    log.runs[0].chunks =
        (0..30).map(|index| chunk(index, 0, 0, 1_100 + index as u64 * 10..1_110 + index as u64 * 10)).collect();
    let text = report_of(&log).to_string();
    assert!(text.contains("  0.100       0.300           -  -            chain, 30 steps\n"), "{text}");
}

#[test]
fn a_line_of_several_steps_has_their_common_prefix() {
    let mut log = log();
    let name = |index: usize| format!("shadows, view {} \"sun\", stage {index}", index / 15);
    let group = |index: usize| if index / 15 == 0 { "one" } else { "other" };
    let nodes = (0..30).map(|index: usize| node(&name(index), group(index), index.checked_sub(1).as_slice()));
    log.runs[0].graph = Arc::new(Graph { nodes: nodes.collect() });
    log.runs[0].empty.clear();
    log.runs[0].chunks =
        (0..30).map(|index| chunk(index, 0, 0, 1_100 + index as u64 * 10..1_110 + index as u64 * 10)).collect();
    let text = report_of(&log).to_string();
    assert!(text.contains("  shadows, view 0 \"sun\", 15 steps\n"), "{text}");
    assert!(text.contains("  shadows, view 1 \"sun\", 15 steps\n"), "{text}");
}
