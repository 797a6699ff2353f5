//! The controller with costs of simulated frames.

mod decisions;
mod simulation;

use fastrand::Rng;

use super::*;
use crate::frame::ViewVariant;
use crate::scene::Redraw;
use simulation::{SMALL, Simulated, Simulation, every, small, view, with_cameras};

/// A picture that is always drawn, a mirror, a cube map, and antialiasing; 8 ms of views and 1 ms of rest.
fn usual() -> Vec<Simulated> {
    let fewer = |max_cameras| QualityLevel::Drawn(ViewVariant { max_cameras, ..ViewVariant::BEST });
    vec![
        view("main", 9, 2.0, &[]),
        view("mirror", 3, 2.0, &[every(2), small(), QualityLevel::LeftOut]),
        with_cameras("cube", 2, 0.25, 6, &[every(2), every(6), QualityLevel::LeftOut]),
        with_cameras("samples", 1, 0.5, 5, &[fewer(2), fewer(1)]),
    ]
}

#[test]
fn a_time_that_is_no_budget_is_an_error() {
    for milliseconds in [0.0, -1.0, f64::NAN, f64::INFINITY, -f64::INFINITY, 1e-60, 0.9e-6, 1.1e12] {
        let error = ViewBudget::new(milliseconds).unwrap_err();
        assert!(matches!(error, BudgetError::InvalidBudget { .. }));
        let message = format!("a budget of {milliseconds} ms a frame is not from 0.000001 to 1000000000000 ms");
        assert_eq!(error.to_string(), message);
    }
    for milliseconds in [BudgetError::MIN_MILLISECONDS, BudgetError::MAX_MILLISECONDS] {
        assert!(ViewBudget::new(milliseconds).is_ok());
    }
    let mut budget = ViewBudget::new(2.0).unwrap();
    assert!(budget.set_milliseconds(0.0).is_err() && budget.set_milliseconds(3.0).is_ok());
}

#[test]
fn what_is_wrong_with_views_is_named() {
    let mut budget = ViewBudget::new(2.0).unwrap();
    let mut refused = |views: &[Simulated]| {
        let views: Vec<_> = views.iter().map(|simulated| simulated.view.clone()).collect();
        budget.cameras(&views).unwrap_err().to_string()
    };
    assert!(refused(&[view("a", 0, 1.0, &[]), view("b", 0, 1.0, &[]), view("a", 1, 1.0, &[])]).contains("\"a\""));
    for form in [
        ViewVariant { interval: 0, ..ViewVariant::BEST },
        ViewVariant { size: 0.0, ..ViewVariant::BEST },
        ViewVariant { size: 1.5, ..ViewVariant::BEST },
        ViewVariant { size: f32::NAN, ..ViewVariant::BEST },
        ViewVariant { level_of_detail_scale: 0.5, ..ViewVariant::BEST },
        ViewVariant { level_of_detail_scale: f32::NAN, ..ViewVariant::BEST },
        ViewVariant { max_cameras: 0, ..ViewVariant::BEST },
    ] {
        let error = refused(&[view("mirror", 0, 1.0, &[every(2), QualityLevel::Drawn(form)])]);
        assert!(error.contains("quality level 2 of view \"mirror\""), "{error}");
    }
    for after in [every(2), QualityLevel::LeftOut] {
        let error = refused(&[view("mirror", 0, 1.0, &[small(), QualityLevel::LeftOut, after])]);
        assert!(error.contains("quality level 3 of view \"mirror\""), "{error}");
    }
    let named = |name: &str, cameras: &[&str]| {
        let mut simulated = with_cameras(name, 0, 1.0, cameras.len(), &[]);
        let cameras = simulated.view.cameras.iter_mut().zip(cameras);
        cameras.for_each(|(camera, name)| camera.name = (*name).to_owned());
        simulated
    };
    let error = refused(&[named("a", &["one", "two"]), named("b", &["three", "one"])]);
    assert_eq!(error, r#"the budget has two cameras named "one": in view "a" and in view "b""#);
    let error = refused(&[named("a", &["one", "two", "two"])]);
    assert_eq!(error, r#"the budget has two cameras named "two": in view "a" and in view "a""#);
}

#[test]
fn each_quality_level_has_its_cameras() {
    let form = ViewVariant { interval: 4, size: 0.25, level_of_detail_scale: 2.0, max_cameras: 2 };
    let mut simulated = with_cameras("view", 0, 1.0, 3, &[every(2), QualityLevel::Drawn(form), QualityLevel::LeftOut]);
    simulated.view.cameras[1].redraw = Redraw::Interval(3);
    simulated.view.cameras[1].level_of_detail_scale = 3.0;
    let mut budget = ViewBudget::new(1.0).unwrap();
    let mut cameras_on = |level: usize| {
        let views = [simulated.view.clone()];
        budget.cameras(&views).unwrap();
        budget.views[0].level = level;
        let cameras = budget.cameras(&views).unwrap();
        let of_camera = |camera: &Camera| (camera.size, camera.redraw, camera.level_of_detail_scale);
        cameras.iter().map(of_camera).collect::<Vec<_>>()
    };
    let best = [960, 540];
    use Redraw::{EveryFrame, Interval};
    assert_eq!(cameras_on(0), [(best, EveryFrame, 1.0), (best, Interval(3), 3.0), (best, EveryFrame, 1.0)]);
    assert_eq!(cameras_on(1), [(best, Interval(2), 1.0), (best, Interval(3), 3.0), (best, Interval(2), 1.0)]);
    assert_eq!(cameras_on(2), [([240, 135], Interval(4), 2.0), ([240, 135], Interval(4), 6.0)]);
    assert_eq!(cameras_on(3), []);
}

#[test]
fn views_are_degraded_when_the_load_rises_and_all_are_back_when_it_falls() {
    for noise in [0.0, 0.2] {
        for factor in [1.2, 1.5, 2.0, 2.5, 3.0] {
            let mut simulation = Simulation::new(11.0, 1.0, &usual());
            simulation.noise = noise;
            simulation.run(100);
            assert!(simulation.is_at_best() && simulation.changes == 0, "{:?}", simulation.levels());
            simulation.scale_costs(factor);
            simulation.run(30);
            let cost = simulation.true_cost();
            assert!(
                cost <= 12.1,
                "{cost} ms with noise of {noise} after a rise by {factor}: {:?}",
                simulation.levels()
            );
            simulation.run(200);
            let cost = simulation.true_cost();
            assert!((6.0..=12.1).contains(&cost), "{cost} ms after a rise by {factor}: {:?}", simulation.levels());
            simulation.scale_costs(1.0 / factor);
            simulation.run(400);
            assert!(simulation.is_at_best(), "after {factor}: {:?}", simulation.levels());
        }
    }
}

#[test]
fn a_steady_load_with_noise_changes_hardly_a_quality_level() {
    for seed in 0..2 {
        for budget in 3..=12 {
            let mut simulation = Simulation::new(f64::from(budget), 1.0, &usual());
            (simulation.noise, simulation.random) = (0.2, Rng::with_seed(seed));
            simulation.run(200);
            let settled = simulation.changes;
            simulation.run(1000);
            let (changes, cost) = (simulation.changes - settled, simulation.true_cost());
            assert!(changes <= 8, "{changes} changes with a budget of {budget} ms and a cost of {cost} ms");
        }
    }
}

#[test]
fn lower_priorities_are_degraded_first_and_restored_last() {
    let levels = [every(2), QualityLevel::LeftOut];
    let views = [("a", 2), ("b", 1), ("c", 3), ("d", 1)].map(|(name, priority)| view(name, priority, 2.0, &levels));
    let mut simulation = Simulation::new(20.0, 1.0, &views);
    simulation.run(20);
    let mut seen = Vec::new();
    // The budget falls by half a view at a time, and comes back at once.
    for step in 0..=8 {
        simulation.budget.set_milliseconds(9.1 - f64::from(step)).unwrap();
        simulation.run(30);
        seen.push(simulation.levels());
    }
    let down = [
        [0, 0, 0, 0],
        [0, 0, 0, 1],
        [0, 0, 0, 2],
        [0, 1, 0, 2],
        [0, 2, 0, 2],
        [1, 2, 0, 2],
        [2, 2, 0, 2],
        [2, 2, 1, 2],
        [2, 2, 2, 2],
    ];
    assert_eq!(seen, down);
    simulation.budget.set_milliseconds(20.0).unwrap();
    let mut up = vec![simulation.levels()];
    for _ in 0..400 {
        simulation.run(1);
        if up.last() != Some(&simulation.levels()) {
            up.push(simulation.levels());
        }
    }
    assert!(up.iter().eq(down.map(Vec::from).iter().rev()), "{up:?}");
}

#[test]
fn a_view_that_costs_nothing_is_not_degraded() {
    let views = [view("free", 0, 0.0, &[every(2), QualityLevel::LeftOut]), view("dear", 1, 5.0, &[every(2), every(4)])];
    let mut simulation = Simulation::new(4.0, 1.0, &views);
    simulation.run(50);
    assert_eq!(simulation.levels(), [0, 1]);
    assert!(!simulation.budget.is_exhausted());
}

#[test]
fn an_impossible_budget_is_reported_with_every_view_on_its_last_quality_level() {
    for noise in [0.0, 0.2] {
        let mut simulation = Simulation::new(0.5, 1.0, &usual());
        simulation.noise = noise;
        simulation.run(50);
        assert!(simulation.is_at_last() && simulation.budget.is_exhausted());
        let changes = simulation.changes;
        simulation.run(1000);
        assert!(simulation.is_at_last() && simulation.budget.is_exhausted());
        assert_eq!(simulation.changes, changes);
    }
}

#[test]
fn a_quality_level_that_saves_less_than_expected_is_passed_over_and_does_not_flap() {
    for share in [1.0, 0.9, 0.05] {
        let mut views = usual();
        views[1] = view("mirror", 0, 4.0, &[small(), every(4), QualityLevel::LeftOut]);
        views[1].share_of_small = share;
        let mut simulation = Simulation::new(8.0, 1.0, &views);
        simulation.noise = 0.1;
        simulation.run(200);
        let (cost, changes) = (simulation.true_cost(), simulation.changes);
        assert!(cost <= 8.8, "{cost} ms: {:?}", simulation.levels());
        simulation.run(1000);
        assert!(simulation.changes - changes <= 6, "{} changes", simulation.changes - changes);
    }
}

#[test]
fn a_view_that_is_left_out_is_measured_now_and_then() {
    let mut simulation =
        Simulation::new(4.0, 1.0, &[view("main", 1, 1.0, &[]), view("mirror", 0, 9.0, &[QualityLevel::LeftOut])]);
    simulation.run(50);
    assert_eq!(simulation.levels(), [0, 1]);
    simulation.run(4000);
    let trials = simulation.changes / 2;
    assert!((3..=6).contains(&trials), "{trials} trials that failed");
    // It becomes cheap while nobody sees it.
    simulation.views[1].cost = 0.5;
    simulation.run(2 * (TRIAL_PAUSES * MAX_PAUSE) as usize);
    assert_eq!(simulation.levels(), [0, 0]);
}

#[test]
fn a_view_that_is_never_measured_does_not_keep_others_from_being_restored() {
    let mut map = view("map", 2, 40.0, &[small(), QualityLevel::LeftOut]);
    map.view.cameras[0].redraw = Redraw::OnCameraChange;
    let mut simulation = Simulation::new(1.5, 1.0, &[map, view("mirror", 1, 2.0, &[QualityLevel::LeftOut])]);
    // It is drawn in each of the first frames, and so is measured and left out.
    for _ in 0..20 {
        simulation.cached.clear();
        simulation.run(1);
    }
    assert_eq!(simulation.levels(), [2, 1]);
    // Now a trial draws it once.
    simulation.budget.set_milliseconds(4.0).unwrap();
    simulation.run(2 * (TRIAL_PAUSES * MIN_PAUSE + MAX_MEASURING_FRAMES) as usize);
    assert_eq!(simulation.levels(), [1, 0]);
}

#[test]
fn new_views_that_are_cached_keep_no_other_from_being_restored() {
    let mut simulation = Simulation::new(1.5, 1.0, &[view("mirror", 1, 2.0, &[QualityLevel::LeftOut])]);
    simulation.run(40);
    assert_eq!(simulation.levels(), [1]);
    simulation.budget.set_milliseconds(8.0).unwrap();
    for number in 0..6 {
        let mut picture = view(&format!("picture {number}"), 0, 0.1, &[]);
        picture.view.cameras[0].redraw = Redraw::OnCameraChange;
        simulation.views.truncate(1);
        simulation.views.push(picture);
        simulation.run(20);
    }
    assert_eq!(simulation.levels()[0], 0);
}

#[test]
fn nothing_is_restored_on_the_room_of_a_view_that_is_not_measured_again_yet() {
    let mut views = [view("rare", 2, 40.0, &[QualityLevel::LeftOut]), view("mirror", 1, 2.0, &[QualityLevel::LeftOut])];
    views[0].view.cameras[0].redraw = Redraw::Interval(8);
    let mut simulation = Simulation::new(4.0, 1.0, &views);
    simulation.run(60);
    assert_eq!(simulation.levels(), [1, 1]);
    let mut tried = 0;
    for _ in 0..2_000 {
        simulation.run(1);
        let [rare, mirror] = simulation.levels()[..] else { panic!() };
        tried += usize::from(rare == 0);
        assert!(rare != 0 || mirror != 0, "both are drawn");
    }
    assert!(tried > 0);
}

#[test]
fn a_view_whose_cost_rises_leaves_no_room_meanwhile() {
    let views = [view("main", 1, 2.0, &[]), view("mirror", 0, 6.0, &[QualityLevel::LeftOut])];
    let mut simulation = Simulation::new(10.0, 1.0, &views);
    simulation.run(50);
    assert_eq!(simulation.levels(), [0, 0]);
    simulation.views[0].cost = 4.0;
    simulation.run(30);
    assert_eq!(simulation.levels(), [0, 1]);
    simulation.run(200);
    simulation.views[0].cost = 6.5;
    let changes = simulation.changes;
    let mut least = f64::INFINITY;
    for _ in 0..40 {
        simulation.run(1);
        least = least.min(simulation.budget.predicted_milliseconds());
    }
    assert!(least > 4.9 && simulation.changes == changes, "predicts {least} ms of 5");
}

#[test]
fn what_is_learned_on_a_quality_level_holds_for_those_that_draw_alike() {
    let small_and_rare = QualityLevel::Drawn(ViewVariant { interval: 4, size: SMALL, ..ViewVariant::BEST });
    let mut simulated = view("mirror", 0, 8.0, &[every(2), small(), small_and_rare]);
    simulated.share_of_small = 0.9;
    let mut simulation = Simulation::new(8.1, 0.01, &[simulated]);
    simulation.run(12);
    simulation.budget.views[0].degrade_to(3, simulation.budget.frame);
    simulation.run(13);
    let cost = |level| f64::from(simulation.budget.views[0].cost.on(level).unwrap()) * 1e-6;
    for (level, expected) in [8.0, 8.0, 7.2, 7.2].into_iter().enumerate() {
        assert!((cost(level) - expected).abs() < 0.1, "{} ms on quality level {level}", cost(level));
    }
}

#[test]
#[cfg(feature = "wgpu")]
fn device_times_are_added_up_by_view_unless_some_are_missing() {
    use crate::backend::DevicePassTime;
    let mut simulation = Simulation::new(100.0, 1.0, &[view("main", 0, 4.0, &[])]);
    let pass = |view: &str, began: u64, ended: u64| DevicePassTime {
        process: String::from("any"),
        view: view.to_owned(),
        began: Duration::from_millis(began),
        ended: Duration::from_millis(ended),
    };
    let passes = vec![pass("main 0", 10, 13), pass("main 0", 12, 13), pass("another", 13, 15)];
    for skipped in [1, 0] {
        for _ in 0..6 {
            let statistics = simulation.draw();
            simulation.budget.update_from_device(&statistics, &DevicePassTimes { passes: passes.clone(), skipped });
        }
        let expected = if skipped == 0 { 6.0 } else { 0.0 };
        assert!((simulation.budget.predicted_milliseconds() - expected).abs() < 1e-3);
    }
}

#[test]
fn frames_that_were_recorded_before_a_quality_level_changed_do_not_count_for_it() {
    let mut simulation = Simulation::new(4.0, 1.0, &[view("mirror", 0, 5.0, &[small()])]);
    let old = simulation.draw();
    while simulation.levels() == [0] {
        simulation.run(1);
    }
    let predicted = simulation.budget.predicted_milliseconds();
    simulation.draw();
    (0..3).for_each(|_| simulation.budget.update(&old));
    assert!((simulation.budget.predicted_milliseconds() - predicted).abs() < 0.01);
}

#[test]
fn random_quality_levels_fit_or_are_at_their_ends_and_come_back() {
    let mut random = Rng::with_seed(11);
    for case in 0..40 {
        let views: Vec<_> = (0..random.usize(1..6))
            .map(|index| {
                let mut levels = Vec::new();
                for interval in [2, 4, 8] {
                    if random.bool() {
                        let size = if interval == 8 { SMALL } else { 1.0 };
                        levels.push(QualityLevel::Drawn(ViewVariant { interval, size, ..ViewVariant::BEST }));
                    }
                }
                if random.bool() {
                    levels.push(QualityLevel::LeftOut);
                }
                let name = format!("view {index}");
                let (priority, cameras) = (random.i32(0..3), random.usize(1..4));
                let mut simulated = with_cameras(&name, priority, 3.0 * random.f64(), cameras, &levels);
                simulated.share_of_small = 0.1 + 0.9 * random.f64();
                simulated
            })
            .collect();
        let milliseconds = 1.0 + 10.0 * random.f64();
        let mut simulation = Simulation::new(milliseconds, 0.8 * random.f64(), &views);
        simulation.run(150);
        // Now and then a quality level is tried that does not fit.
        let mut late = 0;
        for _ in 0..100 {
            simulation.run(1);
            late += usize::from(simulation.true_cost() > milliseconds * 1.001 && !simulation.is_at_last());
        }
        assert!(late <= 30, "case {case}: {late} frames, {:?}", simulation.levels());
        simulation.scale_costs(0.01);
        simulation.run(1500);
        assert!(simulation.is_at_best(), "case {case}: {:?}", simulation.levels());
    }
}

#[test]
fn views_that_come_and_go_keep_what_was_learned_of_them() {
    let mut simulation = Simulation::new(4.0, 1.0, &[view("main", 1, 1.0, &[]), view("mirror", 0, 9.0, &[every(8)])]);
    simulation.run(60);
    assert_eq!(simulation.levels(), [0, 1]);
    let mirror = simulation.views.pop().unwrap();
    simulation.run(40);
    assert_eq!(simulation.budget.level("mirror"), None);
    simulation.views.push(mirror.clone());
    simulation.run(1);
    assert_eq!(simulation.levels(), [0, 1]);
    simulation.views.pop();
    simulation.run(MEMORY_FRAMES as usize);
    simulation.views.push(mirror);
    simulation.run(1);
    assert_eq!(simulation.levels(), [0, 0]);
}

#[test]
fn a_view_that_is_drawn_seldom_is_measured_before_it_is_restored_further() {
    let heavy = view("heavy", 0, 60.0, &[every(8), every(16), QualityLevel::LeftOut]);
    let mut simulation = Simulation::new(4.0, 1.0, &[view("main", 1, 1.0, &[]), heavy]);
    simulation.run(100);
    for frame in 100..1500 {
        simulation.run(1);
        assert!(simulation.levels()[1] >= 2, "frame {frame}: {:?}", simulation.levels());
    }
}

#[test]
fn the_smallest_size_has_a_finite_prediction() {
    let tiny = QualityLevel::Drawn(ViewVariant { size: 1e-23, ..ViewVariant::BEST });
    let mut simulation = Simulation::new(4.0, 1.0, &[view("mirror", 0, 60.0, &[tiny, QualityLevel::LeftOut])]);
    let mut seen = [false; 3];
    for _ in 0..3000 {
        simulation.run(1);
        assert!(simulation.budget.predicted_milliseconds().is_finite(), "{:?}", simulation.levels());
        seen[simulation.levels()[0]] = true;
    }
    assert_eq!(seen, [true; 3]);
}

#[test]
fn an_empty_picture_stays_empty() {
    let mut empty = view("minimised", 0, 1.0, &[small()]).view;
    empty.cameras[0].size = [0, 540];
    let cameras = ViewBudget::new(4.0).unwrap().cameras(&[empty]).unwrap();
    assert_eq!(cameras[0].size, [0, 540]);
}
