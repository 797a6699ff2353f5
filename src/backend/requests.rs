//! What frames request of a backend.

use super::BackendError;
use crate::command::DrawList;
use crate::process::{Draws, FramePlan, Pass, SampledViews};
use crate::quality::Quality;
use crate::scene::{Light, SceneRef};
use crate::view::{GpuView, LightTable, ObjectTable, Rejections, RenderView};

/// Everything that a backend needs to know of a frame.
#[derive(Clone, Copy)]
pub struct FrameRequest<'a> {
    /// The render processes and their targets.
    pub plan: &'a FramePlan,
    /// What each render process draws, in the plan's order.
    pub draws: &'a [Draws<'a>],
    /// The views. The targets of a cached view still hold what an earlier frame drew: see [`RenderView::is_cached`].
    pub views: &'a [RenderView],
    /// The valid lights of the scene, in its order.
    pub lights: &'a [Light],
    /// The lights that reach each view.
    pub light_tables: &'a [LightTable],
    /// Each render process in each of its views, in submission order.
    pub passes: &'a [Pass],
    /// The views that passes sample.
    pub sampled_views: &'a SampledViews,
    /// The scene.
    pub scene: &'a SceneRef<'a>,
    /// What all views need to know about the scene's objects. Blocks are complete when they are uploaded.
    pub objects: &'a ObjectTable,
    /// The frame's accuracy.
    pub quality: &'a Quality,
    /// Counts what the backend leaves out.
    pub rejections: &'a Rejections,
}

impl FrameRequest<'_> {
    /// # Errors
    /// If the camera of a view is out of reach.
    pub(crate) fn check_reach(&self) -> Result<(), BackendError> {
        match self.views.iter().find(|view| !GpuView::is_in_reach(view)) {
            Some(view) => Err(BackendError::ViewOutOfReach { view: view.name().to_owned() }),
            None => Ok(()),
        }
    }
}

/// Everything that a backend needs to know of one pass of a frame.
#[derive(Clone, Copy)]
pub struct PassRequest<'a> {
    /// The frame.
    pub frame: &'a FrameRequest<'a>,
    /// The index of the pass in [`FrameRequest::passes`].
    pub index: usize,
    /// The render process and the view.
    pub pass: Pass,
    /// Its batches; empty for a pass without commands.
    pub list: &'a DrawList,
}

impl PassRequest<'_> {
    /// What finishing the pass costs, relative to other passes that are finished together with it.
    pub(crate) fn relative_cost(&self) -> u64 {
        // A pass costs something without batches too.
        1 + self.list.batches.len() as u64
    }
}
