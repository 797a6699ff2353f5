//! The timeline of a frame. Recording it does not change the frame.

use std::collections::BTreeSet;
use std::time::Instant;

use drawloom::report::{Replay, ReportError, SchedulerCosts};
use drawloom::{FencePoint, FrameError, Granularity};
use drawloom_testing::scenes::field;

use crate::renderer;

#[test]
fn a_frame_draws_the_same_while_the_timeline_records() {
    let scene = field(500);
    for workers in [1, 2] {
        let (mut renderer, submitter) = renderer(workers, Granularity::Chunk(64));
        let plain = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
        renderer.scheduler().timeline().start();
        let recorded = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
        assert_eq!(recorded.submission.passes, plain.submission.passes);
        assert_eq!(recorded.statistics.views, plain.statistics.views);
    }
}

#[test]
fn fences_are_named_after_the_frame() {
    let (mut renderer, _) = renderer(1, Granularity::default());
    let scene = field(3);
    let mut name = |records: bool| {
        if records {
            renderer.scheduler().timeline().start();
        }
        renderer.record(scene.as_scene_ref()).unwrap().fence_at(FencePoint::View(1)).unwrap().name().to_owned()
    };
    assert_eq!([false, true].map(&mut name), ["view 1 of a frame", "view 1 of frame 0"]);
}

#[test]
fn a_log_accounts_for_whole_frames() {
    let scene = field(2_000);
    for workers in [1, 2] {
        let (mut renderer, submitter) = renderer(workers, Granularity::Chunk(64));
        renderer.scheduler().timeline().start();
        let start = Instant::now();
        for number in 0..3 {
            let recorded = renderer.record(scene.as_scene_ref()).unwrap();
            assert_eq!(recorded.frame_number(), Some(number));
            submitter.submit(recorded).unwrap();
        }
        let took = start.elapsed();
        let log = renderer.scheduler().timeline().take();
        assert_eq!(log.frames.iter().map(|frame| frame.number).collect::<Vec<_>>(), [0, 1, 2]);
        assert!(log.frames[2].ended - log.frames[0].began <= took);
        for (frame, run) in log.frames.iter().zip(&log.runs) {
            assert_eq!((run.frame, run.workers, run.complete), (frame.number, workers, true));
            let spans: Vec<_> = log.spans_of(frame.number).collect();
            assert_eq!(spans.iter().map(|span| span.name.as_str()).collect::<Vec<_>>(), ["record", "submit"]);
            assert!(frame.began <= spans[0].began && spans[0].began < run.began && run.ended < spans[0].ended);
            assert!(spans[0].ended <= spans[1].began && spans[1].ended == frame.ended);

            // The visibility stage counts each word of objects once, with jobs of any size.
            let nodes = run.graph.nodes.iter().enumerate();
            let visibility = nodes.filter(|(_, node)| node.labels.stage.as_deref() == Some("visibility"));
            let widths: Vec<_> = visibility.map(|(index, _)| run.width(index)).collect();
            assert_eq!(widths, vec![2_000_usize.div_ceil(64); scene.cameras.len()]);

            let replay = Replay::of_frame(&log, frame.number, SchedulerCosts::ZERO).unwrap();
            let serial = (spans[0].ended - spans[0].began) - run.duration() + (spans[1].ended - spans[1].began);
            assert_eq!(replay.frame_time(1), run.work() + serial);
            assert!(replay.frame_time(8) < replay.frame_time(1));
        }
    }
}

#[test]
fn every_node_is_labelled_with_its_process_stage_and_view() {
    let scene = field(300);
    let (mut renderer, _submitter) = renderer(1, Granularity::default());
    renderer.scheduler().timeline().start();
    let _recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let log = renderer.scheduler().timeline().take();
    let labels = || log.runs[0].graph.nodes.iter().map(|node| &node.labels);
    let plan = renderer.plan().processes().iter().map(|planned| planned.name.as_str());
    let processes: BTreeSet<_> = labels().filter_map(|labels| labels.process.as_deref()).collect();
    assert_eq!(processes, plan.collect::<BTreeSet<_>>());
    let views: BTreeSet<_> = labels().filter_map(|labels| labels.view.as_deref()).collect();
    assert!(scene.cameras.iter().all(|camera| views.contains(camera.name.as_str())), "{views:?}");
    let stages: BTreeSet<_> = labels().map(|labels| labels.stage.as_deref().unwrap()).collect();
    // Opaque objects are binned, and blended ones sorted.
    let expected = [
        "bin",
        "bins",
        "compact",
        "fill",
        "finish",
        "instance",
        "join",
        "objects",
        "prepare",
        "record",
        "sort",
        "split",
        "upload",
        "visibility",
    ];
    assert_eq!(stages, BTreeSet::from(expected));
}

#[test]
fn a_replay_cuts_what_is_cut_by_cost_for_its_workers() {
    let scene = field(3_000);
    for (granularity, cut) in [
        (Granularity::Adaptive, ["fill", "objects", "record", "upload", "visibility"].as_slice()),
        (Granularity::Chunk(100), &["objects", "upload", "visibility"]),
        (Granularity::PerDraw, &["objects", "upload", "visibility"]),
        (Granularity::PerCamera, &["objects", "upload"]),
    ] {
        let (mut renderer, _submitter) = renderer(2, granularity);
        renderer.scheduler().timeline().start();
        let _recorded = renderer.record(scene.as_scene_ref()).unwrap();
        let log = renderer.scheduler().timeline().take();
        let run = &log.runs[0];
        for node in &run.graph.nodes {
            assert_eq!(node.chunked_by_cost, cut.contains(&node.labels.stage.as_deref().unwrap()), "{node:?}");
        }
        let chunks_of = |index: usize| run.chunks_of(index).len();
        let nodes = run.graph.nodes.iter().enumerate();
        let on_one = nodes.map(|(index, node)| chunks_of(index).min(if node.chunked_by_cost { 1 } else { usize::MAX }));
        let replay = Replay::of_frame(&log, 0, SchedulerCosts::ZERO).unwrap();
        assert_eq!(replay.run(1).chunks, on_one.sum::<usize>());
        let chunks = [1, 2, 4, 8, 16, 32, 64].map(|workers| replay.run(workers).chunks);
        assert!(chunks.is_sorted(), "{chunks:?}");
        // In unoptimised code and in optimised, describing the objects takes longer than the shortest job.
        assert!(chunks[0] < chunks[6], "{chunks:?}");
    }
}

#[test]
fn a_frame_without_a_run_has_no_report() {
    let (mut renderer, _submitter) = renderer(1, Granularity::default());
    let mut scene = field(10);
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    assert_eq!(recorded.frame_number(), None);
    renderer.scheduler().timeline().start();
    scene.cameras.clear();
    assert!(matches!(renderer.record(scene.as_scene_ref()), Err(FrameError::NoView)));
    let log = renderer.scheduler().timeline().take();
    assert_eq!((log.frames.len(), log.runs.len()), (1, 0));
    assert_eq!(Replay::of_frame(&log, 0, SchedulerCosts::ZERO).unwrap_err(), ReportError::NoRun { frame: 0 });
}
