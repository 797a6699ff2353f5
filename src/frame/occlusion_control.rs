//! Whether a view tests for occlusion, and what may occlude there.

use super::occluders::occluders;
use super::occlusion_tuner::OcclusionTuner;
use super::tables::FrameTables;
use crate::command::Selection;
use crate::process::{Draws, FramePlan, Pass};
use crate::view::RenderView;

/// Whether a view tests for occlusion, and what may occlude there.
#[derive(Clone, Debug)]
pub(super) struct OcclusionControl {
    /// The objects that may occlude others; `None` where the view cannot test for occlusion.
    pub(super) occluders: Option<Vec<Selection>>,
    /// Whether the test is worth its time.
    pub(super) tuner: OcclusionTuner,
}

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
        Self { occluders, tuner: OcclusionTuner::default() }
    }

    /// Whether the view can test for occlusion.
    pub(super) fn is_possible(&self) -> bool {
        self.occluders.is_some()
    }

    /// Whether the view tests for occlusion in the next frame.
    pub(super) fn is_on(&self) -> bool {
        self.is_possible() && self.tuner.is_on()
    }
}

/// Updates the tuner of each view with the times of a frame that was recorded.
pub(super) fn update_occlusion_tuners(controls: &mut [OcclusionControl], tables: &FrameTables) {
    for (view, control) in controls.iter_mut().enumerate().filter(|(_, control)| control.is_possible()) {
        let occlusion = &tables.occlusion[view];
        control.tuner.update(occlusion.nanoseconds(), tables.visible[view].count() + occlusion.hidden());
    }
}
