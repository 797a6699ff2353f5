//! Whether a view tests for occlusion, and what may occlude there.

use std::sync::Arc;

use drawloom_jobs::internal::{CostSample, Tuner};

use super::occluders::occluders;
use crate::command::Selection;
use crate::process::{Draws, FramePlan, Pass};
use crate::timeline::{Labels, TuningAlternative, TuningChoice, TuningSubject};
use crate::view::RenderView;

/// Whether a view tests for occlusion, and what may occlude there. The view tries frames with the test and frames
/// without it, and keeps what is cheaper. The measure is the thread time of the test and of drawing what is left,
/// divided by the number of objects in the frustum. The picture is the same either way.
#[derive(Clone, Debug)]
pub(super) struct OcclusionControl {
    /// The objects that may occlude others; `None` where the view cannot test for occlusion.
    pub(super) occluders: Option<Vec<Selection>>,
    tuner: Tuner,
    frames: u64,
    /// The alternative of the next frame, and whether it is a trial.
    chosen: usize,
    is_trial: bool,
    /// The alternative of the frame before.
    previous: Option<usize>,
}

/// The alternatives, by index.
const WITH_TEST: usize = 0;
const WITHOUT_TEST: usize = 1;

/// The longest pauses between two trials in frames. A trial without the test is the slow one where the test is worth
/// its time, so it is rare. A trial with it is cheap, and comes soon after the camera has moved behind a wall.
const MAX_PAUSES: [u64; 2] = [64, 512];

impl OcclusionControl {
    /// The control of a view, by index, in a frame with these passes. `is_enabled` is the quality's setting.
    pub(super) fn new(
        is_enabled: bool,
        plan: &FramePlan,
        draws: &[Draws<'_>],
        passes: &[Pass],
        view: (usize, &RenderView),
    ) -> Self {
        let occluders = is_enabled.then(|| occluders(plan, draws, passes, view)).flatten();
        Self::with_occluders(occluders)
    }

    fn with_occluders(occluders: Option<Vec<Selection>>) -> Self {
        Self { occluders, tuner: Tuner::new(MAX_PAUSES), frames: 0, chosen: WITH_TEST, is_trial: false, previous: None }
    }

    /// Takes over what was measured of the same view in the frames of another graph.
    pub(super) fn inherit_measurements(&mut self, before: &Self) {
        if self.is_possible() && before.is_possible() {
            // The tables of the other graph may be gone, so the first frame does not count as warm.
            *self = Self { occluders: self.occluders.take(), previous: None, ..before.clone() };
        }
    }

    /// The number of frames in which the view had objects.
    pub(super) fn frames(&self) -> u64 {
        self.frames
    }

    /// Whether the view can test for occlusion.
    pub(super) fn is_possible(&self) -> bool {
        self.occluders.is_some()
    }

    /// Whether the view tests for occlusion in the next frame.
    pub(super) fn is_on(&self) -> bool {
        self.is_possible() && self.chosen == WITH_TEST
    }

    /// The choice for the frame that was recorded, before [`update`](Self::update) chooses for the next one; `None`
    /// where the view cannot test for occlusion, or did not though it was chosen, because its picture is too large.
    pub(super) fn choice(&self, has_tested: bool, labels: &Arc<Labels>) -> Option<TuningChoice> {
        let alternative = |(name, nanoseconds): (&'static str, _)| TuningAlternative { name: name.into(), nanoseconds };
        (self.is_possible() && has_tested == self.is_on()).then(|| TuningChoice {
            subject: TuningSubject::OcclusionTest,
            labels: Arc::clone(labels),
            alternatives: ["on", "off"].into_iter().zip(self.tuner.costs()).map(alternative).collect(),
            chosen: self.chosen,
            is_trial: self.is_trial,
        })
    }

    /// Reports the thread time of the frame, which had `objects` in the view's frustum and tested them or not, and
    /// chooses for the next frame.
    pub(super) fn update(&mut self, nanoseconds: u64, objects: usize, has_tested: bool, may_try: &mut bool) {
        if objects == 0 {
            return;
        }
        let used = if has_tested { WITH_TEST } else { WITHOUT_TEST };
        let is_warm = self.previous == Some(used);
        self.tuner.report(self.frames, used, CostSample { nanoseconds: nanoseconds as f64, units: objects, is_warm });
        self.previous = Some(used);
        self.frames += 1;
        (self.chosen, self.is_trial) = self.tuner.choose(self.frames, may_try, |_, _| true);
    }
}

#[cfg(test)]
mod tests {
    use drawloom_signal::{ControllerBounds, Signal, check_controller};

    use super::*;

    fn control() -> OcclusionControl {
        OcclusionControl::with_occluders(Some(Vec::new()))
    }

    /// Runs a frame that takes these times an object with and without the test, and returns whether it was with.
    fn frame(control: &mut OcclusionControl, [with, without]: [f32; 2], signal: &mut Signal) -> bool {
        let is_on = control.is_on();
        let cost = signal.sample(if is_on { with } else { without });
        control.update((cost * 1000.0) as u64, 1000, is_on, &mut true);
        is_on
    }

    /// Returns how many of some frames were with the test.
    fn frames_with(control: &mut OcclusionControl, frames: usize, costs: [f32; 2]) -> usize {
        (0..frames).filter(|_| frame(control, costs, &mut Signal::new(1))).count()
    }

    #[test]
    fn it_settles_does_not_flap_and_recovers() {
        let bounds = ControllerBounds { settles_within: [20, 70, 80], max_wrong: 60, max_changes: 60 };
        check_controller(
            &bounds,
            control,
            |control, is_after, signal| frame(control, if is_after { [300.0, 100.0] } else { [100.0, 300.0] }, signal),
            |&is_on, is_after| is_on != is_after,
        );
    }

    #[test]
    fn both_ways_are_tried_at_first_and_the_cheaper_one_is_kept() {
        let mut control = control();
        assert_eq!(frames_with(&mut control, 10, [100.0, 300.0]), 6);
        assert!(frames_with(&mut control, 5000, [100.0, 300.0]) > 4950);
        let mut control = super::tests::control();
        frames_with(&mut control, 10, [300.0, 100.0]);
        let tried = frames_with(&mut control, 6000, [300.0, 100.0]);
        assert!((150..300).contains(&tried), "2 in 66 are tried: {tried}");
    }

    #[test]
    fn a_wall_in_front_of_the_camera_is_noticed_within_eighty_frames() {
        let mut control = control();
        frames_with(&mut control, 1000, [130.0, 100.0]);
        // The frames without the test cost what they did.
        frames_with(&mut control, 80, [20.0, 100.0]);
        assert!(frames_with(&mut control, 60, [20.0, 100.0]) >= 58);
    }

    #[test]
    fn an_empty_view_changes_nothing() {
        let mut control = control();
        (0..100).for_each(|_| control.update(1_000_000, 0, true, &mut true));
        assert!(control.is_on() && control.tuner.costs().all(|cost| cost.is_none()));
    }

    #[test]
    fn a_test_that_was_chosen_but_did_not_run_is_no_choice() {
        let control = control();
        assert!(control.choice(true, &Arc::default()).is_some());
        assert_eq!(control.choice(false, &Arc::default()), None);
    }
}
