//! What was chosen by measurement is in the statistics, the log and the frame report.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use drawloom::backend::NullBackend;
use drawloom::process::Deferred;
use drawloom::quality::Quality;
use drawloom::report::{FrameReport, SchedulerCosts};
use drawloom::task::Scheduler;
use drawloom::timeline::{FrameTuning, TuningChoice, TuningSubject};
use drawloom::{Granularity, Renderer};
use drawloom_testing::scenes::field;

use crate::occlusion::wall_and_cubes;

/// A scheduler whose clock goes on by this much at each reading, so that costs are the same however busy the machine
/// is.
fn scheduler(workers: usize, tick: Duration) -> Arc<Scheduler> {
    let readings = AtomicU32::new(0);
    let clock = move || tick * readings.fetch_add(1, Ordering::Relaxed);
    Arc::new(Scheduler::builder().workers(workers).timeline_clock(clock).build().unwrap())
}

const TICK: Duration = Duration::from_micros(1);

/// The tuning of some frames, and the renderer's scheduler, whose timeline recorded them.
fn record(
    frames: usize,
    (workers, tick): (usize, Duration),
    granularity: Granularity,
) -> (Vec<FrameTuning>, Arc<Scheduler>) {
    let scheduler = scheduler(workers, tick);
    let quality = Quality { occlusion: Some(8), ..Quality::balanced() };
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).quality(quality);
    let (mut renderer, _submitter) = builder.granularity(granularity).build(Arc::clone(&scheduler)).unwrap();
    let scene = field(3000);
    scheduler.timeline().start();
    let record = |_| renderer.record(scene.as_scene_ref()).unwrap().statistics().tuning.clone();
    ((0..frames).map(record).collect(), scheduler)
}

fn choices_of(tuning: &FrameTuning, subject: TuningSubject) -> Vec<&TuningChoice> {
    tuning.choices.iter().filter(|choice| choice.subject == subject).collect()
}

#[test]
fn choices_come_with_the_costs_that_they_were_made_by() {
    // Two workers read the clock in an order of their own, so it stands still.
    let (tuning, _) = record(40, (2, Duration::ZERO), Granularity::Adaptive);
    let view_count = choices_of(&tuning[0], TuningSubject::OcclusionTest).len();
    assert!(view_count > 0);
    for (frame, tuning) in tuning.iter().enumerate() {
        let tests = choices_of(tuning, TuningSubject::OcclusionTest);
        assert_eq!((tests.len(), choices_of(tuning, TuningSubject::RunMode).len()), (view_count, 1));
        assert!(tests.iter().all(|choice| choice.labels.view.is_some()));
        for TuningChoice { alternatives, .. } in tests {
            let known = [0, 1].map(|alternative| alternatives[alternative].nanoseconds.is_some());
            // Frame 0 is cold, 1 to 3 measure the test; 4 is cold again, 5 to 7 measure frames without it.
            assert_eq!(known, [frame >= 2, frame >= 6], "frame {frame}: {alternatives:?}");
        }
    }
}

#[test]
fn job_sizes_come_with_the_cost_of_an_item() {
    let (tuning, _) = record(20, (2, TICK), Granularity::Adaptive);
    let sizes = &tuning.last().unwrap().job_sizes;
    let objects: Vec<_> = sizes.iter().filter(|size| size.labels.stage.as_deref() == Some("objects")).collect();
    assert_eq!(objects.len(), 1);
    assert!(objects[0].items > 0 && objects[0].nanoseconds_per_item.unwrap() > 0.0);
    for size in sizes {
        assert!((1..=size.items).contains(&size.items_per_job), "{size:?}");
        assert_eq!(size.jobs() == 1, size.items_per_job == size.items);
    }
    let fill = sizes.iter().find(|size| size.labels.stage.as_deref() == Some("fill")).unwrap();
    assert!(fill.labels.process.is_some() && fill.labels.view.is_some());
}

#[test]
fn a_frame_that_tests_for_occlusion_says_so() {
    let quality = Quality { occlusion: Some(8), ..Quality::balanced() };
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).quality(quality);
    let (mut renderer, _submitter) = builder.build(scheduler(1, TICK)).unwrap();
    let scene = wall_and_cubes();
    let mut chosen = BTreeSet::new();
    for _ in 0..20 {
        let recorded = renderer.record(scene.as_scene_ref()).unwrap();
        let statistics = recorded.statistics();
        let view = &statistics.views[0];
        let choices = choices_of(&statistics.tuning, TuningSubject::OcclusionTest);
        let choice = choices.iter().find(|choice| choice.labels.view.as_deref() == Some(&*view.name)).unwrap();
        assert_eq!(choice.alternatives[choice.chosen].name == "on", view.occluded > 0);
        chosen.insert((choice.chosen, choice.is_trial));
    }
    assert!(chosen.contains(&(0, false)) && chosen.contains(&(1, true)), "{chosen:?}");
}

#[test]
fn a_fixed_granularity_has_job_sizes_of_stages_without_draws_alone() {
    for (granularity, expected) in [
        (Granularity::PerDraw, ["coarse depth", "objects", "occlusion", "upload", "visibility"].as_slice()),
        (Granularity::PerCamera, &["objects", "upload"]),
    ] {
        let (tuning, _) = record(3, (2, TICK), granularity);
        // Nor a choice of the run mode: they are always parallel.
        assert!(tuning.iter().all(|tuning| choices_of(tuning, TuningSubject::RunMode).is_empty()));
        let sizes = tuning.iter().flat_map(|tuning| &tuning.job_sizes);
        let stages: BTreeSet<_> = sizes.filter_map(|size| size.labels.stage.as_deref()).collect();
        assert!(stages.contains("objects") && stages.iter().all(|stage| expected.contains(stage)), "{stages:?}");
    }
}

#[test]
fn one_worker_has_one_job_a_stage_and_no_run_mode() {
    for tuning in record(3, (1, TICK), Granularity::Adaptive).0 {
        assert!(choices_of(&tuning, TuningSubject::RunMode).is_empty());
        assert!(!tuning.job_sizes.is_empty() && tuning.job_sizes.iter().all(|size| size.jobs() == 1), "{tuning:?}");
    }
}

#[test]
fn the_log_and_the_frame_report_have_the_choices_of_each_frame() {
    let (tuning, scheduler) = record(5, (2, TICK), Granularity::Adaptive);
    let log = scheduler.timeline().take();
    assert_eq!(log.tuning.iter().map(|(_, tuning)| tuning).collect::<Vec<_>>(), tuning.iter().collect::<Vec<_>>());
    let costs = SchedulerCosts::measure().unwrap();
    for (frame, tuning) in log.tuning.iter().zip(&tuning).map(|((frame, _), tuning)| (*frame, tuning)) {
        let report = FrameReport::new(&log, frame, &costs).unwrap();
        assert_eq!(&report.tuning, std::slice::from_ref(tuning));
        let text = report.to_string();
        assert!(text.contains(&tuning.choices[0].to_string()), "{text}");
    }
}

#[cfg(feature = "wgpu")]
#[test]
fn each_pass_of_commands_has_a_choice_of_recording() {
    use drawloom::backend::{RecordingStrategy, WgpuBackend};
    use drawloom_testing::adapter;

    let frames = |backend: fn(WgpuBackend) -> WgpuBackend| {
        let (device, queue) = adapter::noop_device().unwrap();
        let scheduler = Arc::new(Scheduler::new(1).unwrap());
        let builder = Renderer::builder(backend(WgpuBackend::new(device, queue).unwrap()));
        let (mut renderer, submitter) = builder.pipeline(Deferred::to_picture()).build(scheduler).unwrap();
        let scene = field(600);
        let draw = |_| submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap().statistics.tuning;
        let tuning: Vec<_> = (0..60).map(draw).collect();
        (tuning, renderer.backend().pass_statistics())
    };
    let (tuning, passes) = frames(|backend| backend);
    let choices = choices_of(tuning.last().unwrap(), TuningSubject::Recording);
    assert_eq!(choices.len(), passes.len());
    for (choice, pass) in choices.iter().zip(&passes) {
        assert_eq!(choice.labels.process.as_deref(), Some(pass.process.as_str()));
        let name = match pass.recording {
            RecordingStrategy::Direct => "direct",
            RecordingStrategy::Bundles => "bundles",
            RecordingStrategy::CachedBundles => "cached bundles",
        };
        assert_eq!(choice.alternatives[choice.chosen].name.trim_start_matches("split "), name, "{choice} {pass:?}");
        let (has_batches, is_known) = (pass.batches > 0, choice.alternatives[choice.chosen].nanoseconds.is_some());
        // The cost of a trial is not known in its first frame.
        assert!(is_known == has_batches || (choice.is_trial && !is_known), "{choice} {pass:?}");
    }
    let trials =
        tuning.iter().flat_map(|tuning| choices_of(tuning, TuningSubject::Recording)).filter(|choice| choice.is_trial);
    assert!(trials.count() > passes.len());
    let (fixed, _) = frames(|backend| backend.recording_strategy(RecordingStrategy::Direct));
    assert!(choices_of(&fixed[0], TuningSubject::Recording).iter().all(|choice| choice.alternatives.len() == 2));
}
