//! Single decisions of the controller, with costs that are worked out by hand.

use super::*;
use crate::frame::StageTimes;

/// A budget whose first frame has these views, as if it had measured what their cameras and the rest of a frame cost,
/// in milliseconds.
fn measured(milliseconds: f64, rest: f32, views: &[Simulated]) -> ViewBudget {
    let mut budget = ViewBudget::new(milliseconds).unwrap();
    budget.cameras(&views.iter().map(|simulated| simulated.view.clone()).collect::<Vec<_>>()).unwrap();
    for _ in 0..Estimate::FIRST_SAMPLES {
        budget.rest.add(rest * 1e6, FILTER);
        let views = budget.views.iter_mut().zip(views);
        views.for_each(|(state, simulated)| state.cost.add(simulated.cost as f32 * 1e6));
    }
    budget
}

/// As if this were the number of the latest frame, with the same views.
fn set_frame(budget: &mut ViewBudget, frame: u64) {
    budget.frame = frame;
    budget.views.iter_mut().for_each(|state| state.requested = frame);
}

fn levels(budget: &ViewBudget) -> Vec<usize> {
    budget.views.iter().map(|state| state.level).collect()
}

#[test]
fn a_view_is_forgotten_when_it_was_absent_for_long() {
    let mut budget = ViewBudget::new(4.0).unwrap();
    (0..200).for_each(|_| drop(budget.cameras(&[view("mirror", 0, 1.0, &[]).view]).unwrap()));
    for absent in 1..=MEMORY_FRAMES {
        budget.cameras(&[]).unwrap();
        assert_eq!(budget.views.len(), usize::from(absent < MEMORY_FRAMES), "after {absent} frames");
    }
}

#[test]
fn choices_have_the_costs_of_quality_levels_and_say_which_is_tried() {
    let views = [view("main", 1, 1.0, &[]), view("mirror", 0, 8.0, &[every(4), QualityLevel::LeftOut])];
    let mut budget = ViewBudget::new(100.0).unwrap();
    budget.cameras(&views.each_ref().map(|simulated| simulated.view.clone())).unwrap();
    let choice = |budget: &ViewBudget| {
        let choices: Vec<_> = budget.choices().collect();
        let [TuningChoice { alternatives, chosen, is_trial, .. }] = &choices[..] else { panic!("{choices:?}") };
        (alternatives.iter().map(|alternative| alternative.nanoseconds).collect::<Vec<_>>(), *chosen, *is_trial)
    };
    assert_eq!(choice(&budget), (vec![None; 3], 0, false), "it is not measured, but not tried either");
    let mut budget = measured(100.0, 1.0, &views);
    let costs = vec![Some(8e6), Some(2e6), Some(0.0)];
    assert_eq!(choice(&budget), (costs.clone(), 0, false));
    let mirror = &mut budget.views[1];
    mirror.degrade_to(2, 1);
    mirror.restore(true, 1);
    assert_eq!(choice(&budget), (vec![None; 3], 1, true));
    (0..Estimate::FIRST_SAMPLES).for_each(|_| budget.views[1].cost.add(8e6));
    assert_eq!(choice(&budget), (costs, 1, false));
}

#[test]
fn submission_is_divided_among_views_as_their_stages_are() {
    let views = ["one", "other"].map(|name| view(name, 0, 0.0, &[]));
    let mut simulation = Simulation::new(100.0, 0.0, &views);
    let mut statistics = simulation.draw();
    let milliseconds = Duration::from_millis;
    statistics.view_times = vec![milliseconds(2), milliseconds(6)];
    statistics.stages = StageTimes { record: milliseconds(9), submit: milliseconds(4), ..StageTimes::default() };
    (0..Estimate::FIRST_SAMPLES).for_each(|_| simulation.budget.update(&statistics));
    let [one, other] = &simulation.budget.views[..] else { panic!() };
    let costs = [one.cost.on(0).unwrap(), other.cost.on(0).unwrap(), simulation.budget.rest.get().unwrap()];
    let is_near = |(cost, expected): (f32, f32)| (cost - expected).abs() < 1e4;
    assert!(costs.into_iter().zip([3e6, 9e6, 1e6]).all(is_near), "{costs:?}");

    // Without any time of views, all of it is the rest.
    let mut simulation = Simulation::new(100.0, 0.0, &views);
    let mut statistics = simulation.draw();
    statistics.stages.submit = milliseconds(5);
    (0..Estimate::FIRST_SAMPLES).for_each(|_| simulation.budget.update(&statistics));
    let predicted = simulation.budget.predicted_milliseconds();
    assert!((predicted - 5.0).abs() < 0.01, "{predicted}");
}

#[test]
fn a_budget_is_exhausted_only_if_all_quality_levels_together_exceed_it() {
    let views = [view("mirror", 0, 2.0, &[every(2)])];
    // What is predicted is 3 ms, or 2 ms on the last quality level.
    for (milliseconds, level, expected) in
        [(1.0, 0, false), (1.0, 1, true), (2.0, 1, false), (4.0, 0, false), (4.0, 1, false)]
    {
        let mut budget = measured(milliseconds, 1.0, &views);
        budget.views[0].level = level;
        assert_eq!(budget.is_exhausted(), expected, "{milliseconds} ms on quality level {level}");
    }
    // A frame that just fits is not over the budget.
    let mut budget = measured(3.0, 1.0, &views);
    (1..OVER_FRAMES).for_each(|_| budget.choose());
    assert_eq!((budget.over, levels(&budget)), (0, vec![0]));
}

#[test]
fn frames_without_views_that_have_quality_levels_lack_none() {
    for views in [vec![], vec![view("main", 0, 1.0, &[])]] {
        let mut simulation = Simulation::new(100.0, 1.0, &views);
        simulation.run(4);
        assert_eq!(simulation.budget.without_levels, 0);
    }
    let mut simulation = Simulation::new(100.0, 1.0, &[view("main", 0, 1.0, &[every(2)])]);
    simulation.draw();
    (1..4).for_each(|frames| {
        simulation.budget.update(&FrameStatistics::default());
        assert_eq!(simulation.budget.without_levels, frames);
    });
}

#[test]
fn a_view_that_saves_next_to_nothing_is_degraded_only_if_nothing_else_helps() {
    let nearly_as_large = QualityLevel::Drawn(ViewVariant { size: 0.999, ..ViewVariant::BEST });
    let views = [view("stubborn", 0, 4.0, &[nearly_as_large]), view("dear", 1, 4.0, &[every(2)])];
    for (milliseconds, expected) in [(9.0, [0, 0]), (7.5, [0, 1]), (6.0, [1, 1])] {
        let mut budget = measured(milliseconds, 1.0, &views);
        budget.degrade();
        assert_eq!(levels(&budget), expected, "{milliseconds} ms");
    }
    // The first quality level that just fits is enough.
    let mut budget = measured(3.0, 1.0, &[view("mirror", 0, 4.0, &[every(2), QualityLevel::LeftOut])]);
    budget.degrade();
    assert_eq!(levels(&budget), [1]);
}

/// A mirror on its second best quality level since frame 100; 3 ms are predicted, and 5 ms at its best.
fn degraded_mirror(milliseconds: f64) -> ViewBudget {
    let mut budget = measured(milliseconds, 1.0, &[view("mirror", 0, 4.0, &[every(2)])]);
    budget.views[0].degrade_to(1, 100);
    budget
}

#[test]
fn a_view_is_restored_after_its_pause_and_after_what_changed_before_has_settled() {
    let restored_in = |budget: &mut ViewBudget, frame| {
        set_frame(budget, frame);
        budget.restore();
        budget.views[0].level == 0
    };
    for (changed, first) in [(100, 100 + MIN_PAUSE), (150, 150 + SETTLE_FRAMES)] {
        let mut budget = degraded_mirror(6.0);
        budget.changed = changed;
        assert!(!restored_in(&mut budget, first - 1), "frame {}", first - 1);
        assert!(restored_in(&mut budget, first), "frame {first}");
        assert!(!budget.views[0].is_trial && budget.changed == first);
    }
}

#[test]
fn a_restoration_waits_for_a_measurement_but_not_for_ever() {
    let mut budget = degraded_mirror(60.0);
    let rare = view("rare", 1, 1.0, &[every(2)]);
    budget.views.push(ViewState::new(&rare.view));
    budget.views[1].request(&rare.view, 1);
    (budget.views[1].level, budget.views[1].restored) = (1, Some(200));
    for (frame, expected) in [(199 + MAX_MEASURING_FRAMES, [1, 1]), (200 + MAX_MEASURING_FRAMES, [0, 1])] {
        set_frame(&mut budget, frame);
        budget.restore();
        assert_eq!(levels(&budget), expected, "frame {frame}");
    }
}

#[test]
fn a_restoration_that_is_undone_soon_doubles_the_pause() {
    let mut state = ViewState::new(&view("mirror", 0, 4.0, &[every(2)]).view);
    assert_eq!(state.moved(), None);
    state.degrade_to(1, 5);
    assert_eq!((state.moved(), state.pause), (Some(5), MIN_PAUSE));
    for (after, factor) in [(RETRY_FRAMES - 1, 2), (RETRY_FRAMES - 1, 4), (RETRY_FRAMES, 1)] {
        state.restore(false, 100);
        assert_eq!(state.moved(), Some(100));
        state.degrade_to(1, 100 + after);
        assert_eq!((state.moved(), state.pause), (Some(100 + after), factor * MIN_PAUSE));
    }
}

#[test]
fn a_trial_is_compared_with_the_quality_level_before_unless_that_left_the_view_out() {
    // 8 ms on the smaller picture, so 32 ms are expected of the larger one. It takes 16 ms.
    for (level, expected) in [(1, 8e6), (2, 4e6)] {
        let mut state = ViewState::new(&view("mirror", 0, 8.0, &[small(), QualityLevel::LeftOut]).view);
        state.level = level;
        state.cost.move_to(1, &state.levels);
        (0..Estimate::FIRST_SAMPLES).for_each(|_| state.cost.add(8e6));
        state.restore(true, 1);
        state.level = 0;
        state.cost.move_to(0, &state.levels);
        (0..Estimate::FIRST_SAMPLES).for_each(|_| state.cost.add(16e6));
        assert_eq!(state.cost.on(1), Some(expected), "from quality level {level}");
    }
}
