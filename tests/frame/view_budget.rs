//! A budget of views with a renderer: what it chooses is what frames draw, and is reported.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::DVec3;
use drawloom::process::Deferred;
use drawloom::report::{FrameReport, SchedulerCosts};
use drawloom::scene::{Camera, SceneRef};
use drawloom::task::Scheduler;
use drawloom::timeline::TuningSubject;
use drawloom::{BudgetedView, FrameStatistics, QualityLevel, Renderer, Submitter, ViewBudget, ViewVariant};
use drawloom_testing::scenes::field;

use crate::reported;

/// Budgets that are beyond all costs, and below them: what is measured decides nothing.
const GENEROUS: f64 = 1e6;
const IMPOSSIBLE: f64 = 1e-6;

fn views() -> Vec<BudgetedView> {
    let camera = |name: &str| Camera::looking_at(name, DVec3::new(0.0, 0.0, 30.0), DVec3::ZERO);
    let of = |name: &str, priority, levels| BudgetedView {
        name: name.to_owned(),
        priority,
        cameras: vec![camera(name)],
        levels,
    };
    let small = ViewVariant { interval: 3, size: 0.5, ..ViewVariant::BEST };
    vec![
        of("main", 2, vec![]),
        of("map", 1, vec![QualityLevel::Drawn(small)]),
        of("preview", 0, vec![QualityLevel::LeftOut]),
    ]
}

fn frame(
    budget: &mut ViewBudget,
    renderer: &mut Renderer<NullBackend>,
    submitter: &Submitter<NullBackend>,
) -> FrameStatistics {
    let scene = field(200);
    let cameras = budget.cameras(&views()).unwrap();
    renderer.add_choices(budget.choices());
    let recorded = renderer.record(SceneRef { cameras: &cameras, ..scene.as_scene_ref() }).unwrap();
    let statistics = submitter.submit(recorded).unwrap().statistics;
    budget.update(&statistics);
    statistics
}

fn renderer() -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    let scheduler = Arc::new(Scheduler::new(2).unwrap());
    Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).build(scheduler).unwrap()
}

fn names(statistics: &FrameStatistics) -> Vec<&str> {
    statistics.views.iter().filter(|view| !view.name.starts_with("shadow")).map(|view| view.name.as_str()).collect()
}

#[test]
fn frames_draw_what_the_budget_chooses_and_report_it() {
    let (mut renderer, submitter) = renderer();
    let mut budget = ViewBudget::new(GENEROUS).unwrap();
    for _ in 0..12 {
        let statistics = frame(&mut budget, &mut renderer, &submitter);
        assert_eq!(statistics.levels().collect::<Vec<_>>(), [("map", 0), ("preview", 0)]);
        assert_eq!(names(&statistics), ["main", "map", "preview"]);
    }
    assert!(!budget.is_exhausted());
    budget.set_milliseconds(IMPOSSIBLE).unwrap();
    let degraded = (0..20).find(|_| {
        frame(&mut budget, &mut renderer, &submitter);
        budget.level("map") == Some(1)
    });
    assert!(degraded.is_some() && budget.level("preview") == Some(1) && budget.is_exhausted());

    renderer.scheduler().timeline().start();
    let ages: Vec<_> = (0..12)
        .map(|_| {
            let statistics = frame(&mut budget, &mut renderer, &submitter);
            assert_eq!(statistics.levels().collect::<Vec<_>>(), [("map", 1), ("preview", 1)]);
            assert_eq!(names(&statistics), ["main", "map"]);
            statistics.views[1].age
        })
        .collect();
    // Its first frames depend on whose turn it is.
    assert_eq!(ages[3..].iter().filter(|age| **age == 0).count(), 3, "{ages:?}");
    let log = renderer.scheduler().timeline().take();
    for (_, tuning) in &log.tuning {
        let levels: Vec<_> =
            tuning.choices.iter().filter(|choice| choice.subject == TuningSubject::QualityLevel).collect();
        assert_eq!(levels.iter().map(|choice| choice.chosen).collect::<Vec<_>>(), [1, 1]);
    }
    let costs = SchedulerCosts::measure().unwrap();
    let report = FrameReport::new(&log, log.tuning.last().unwrap().0, &costs).unwrap().to_string();
    assert!(report.contains("quality level in map: every 3 frames, 50% of the size for"), "{report}");
    assert!(report.contains("quality level in preview: left out for 0.00 ns a frame; at its best"), "{report}");
}

#[test]
fn a_budget_whose_choices_frames_do_not_report_is_warned_of_once() {
    let warnings = |adds_choices: bool| {
        let (mut renderer, submitter) = renderer();
        let mut budget = ViewBudget::new(GENEROUS).unwrap();
        let text = reported(|| {
            for _ in 0..30 {
                let scene = field(20);
                let cameras = budget.cameras(&views()).unwrap();
                if adds_choices {
                    renderer.add_choices(budget.choices());
                }
                let recorded = renderer.record(SceneRef { cameras: &cameras, ..scene.as_scene_ref() }).unwrap();
                budget.update(&submitter.submit(recorded).unwrap().statistics);
            }
        });
        text.matches("Renderer::add_choices").count()
    };
    assert_eq!([warnings(true), warnings(false)], [0, 1]);
}

#[cfg(feature = "wgpu")]
#[test]
fn a_budget_that_gets_no_complete_times_of_the_device_warns_once() {
    use drawloom::backend::DevicePassTimes;
    let warnings = |skipped: usize| {
        let mut budget = ViewBudget::new(GENEROUS).unwrap();
        let times = DevicePassTimes { passes: Vec::new(), skipped };
        let text = reported(|| (0..30).for_each(|_| budget.update_from_device(&FrameStatistics::default(), &times)));
        text.matches("the device's times lack passes").count()
    };
    assert_eq!([0, 1].map(warnings), [0, 1]);
}

#[test]
fn the_times_of_views_are_those_of_their_stages() {
    let (mut renderer, submitter) = renderer();
    let mut scene = field(2000);
    scene.lights.clear();
    scene.cameras = views().into_iter().flat_map(|view| view.cameras).collect();
    // One that sees nothing.
    scene.cameras[2].position = DVec3::new(1e6, 0.0, 0.0);
    for _ in 0..3 {
        scene.cameras[..2].iter_mut().for_each(|camera| camera.position.x += 0.1);
        let statistics = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap().statistics;
        assert_eq!(statistics.view_times.len(), 3);
        assert!(statistics.view_times.iter().all(|time| !time.is_zero()));
        assert!(statistics.view_times.iter().sum::<std::time::Duration>() < statistics.stages.total());
    }
}

#[test]
fn choices_are_those_of_one_frame_also_if_it_fails() {
    let (mut renderer, _) = renderer();
    let mut budget = ViewBudget::new(GENEROUS).unwrap();
    let mut scene = field(20);
    budget.cameras(&views()).unwrap();
    renderer.add_choices(budget.choices());
    let cameras = std::mem::take(&mut scene.cameras);
    assert!(renderer.record(scene.as_scene_ref()).is_err());
    scene.cameras = cameras;
    assert_eq!(renderer.record(scene.as_scene_ref()).unwrap().statistics().levels().count(), 0);
    renderer.add_choices(budget.choices());
    assert_eq!(renderer.record(scene.as_scene_ref()).unwrap().statistics().levels().count(), 2);
    assert_eq!(renderer.record(scene.as_scene_ref()).unwrap().statistics().levels().count(), 0);
}
