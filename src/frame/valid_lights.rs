//! The lights of a scene that can be drawn.

use crate::scene::{Light, SceneRef};
use crate::unwind::emit;
use crate::view::{FixedPosition, IssueReason, SceneIssues};

/// The lights of a scene that can be drawn, in the scene's order, each with its range cut off: see
/// [`Quality::light_cut_off`](crate::quality::Quality::light_cut_off).
pub(super) struct ValidLights {
    pub(super) lights: Vec<Light>,
    /// For each light, its index in the scene.
    pub(super) scene_indices: Vec<usize>,
}

impl ValidLights {
    /// The valid lights of `scene`. The others are counted as scene issues.
    pub(super) fn new(scene: &SceneRef<'_>, scene_issues: &SceneIssues, cut_off: f32) -> Self {
        let capacity = scene.lights.len();
        let mut valid = Self { lights: Vec::with_capacity(capacity), scene_indices: Vec::with_capacity(capacity) };
        for (index, light) in scene.lights.iter().enumerate() {
            if let Err(error) = light.check(index) {
                emit(|| tracing::debug!(target: "drawloom", %error, "light left out"));
                scene_issues.count(IssueReason::InvalidLight, index);
            } else if light.bounding_sphere().is_some_and(|(position, _)| FixedPosition::new(position).is_none()) {
                scene_issues.count(IssueReason::LightOutOfReach, index);
            } else if light.is_dark() {
                scene_issues.count(IssueReason::DarkLight, index);
            } else {
                valid.lights.push(light.cut_off_at(cut_off));
                valid.scene_indices.push(index);
            }
        }
        valid
    }
}
