//! The views of a frame: one for each camera, and one for each shadow map.

use super::FrameError;
use super::shadow_views::{MapSettings, ShadowViews};
use super::valid_lights::ValidLights;
use crate::process::{FramePlan, SampledShape, ViewArray};
use crate::scene::{Light, SceneRef, ViewKind};
use crate::view::{RenderView, SceneIssues};

/// The views of a frame, and the valid lights that light them.
pub(super) struct FrameViews {
    pub(super) views: Vec<RenderView>,
    /// See [`ShadowViews::lights`].
    pub(super) lights: Vec<Light>,
    /// See [`ShadowViews::main_views`].
    pub(super) main_views: Vec<Option<usize>>,
    /// For each light, its index in the scene.
    pub(super) scene_indices: Vec<usize>,
    /// The views whose targets are layers of textures.
    pub(super) arrays: Vec<ViewArray>,
}

impl FrameViews {
    /// The views that a scene requests: one for each camera in the scene's order, then, if `maps` is given, those of
    /// the shadow maps of each light that casts shadows and reaches what a camera may see.
    ///
    /// # Errors
    /// If there are too many views, or those whose targets are layers of one texture differ in size, or are faces of a
    /// cube map and not square.
    pub(super) fn new(
        scene: &SceneRef<'_>,
        valid: ValidLights,
        maps: Option<MapSettings<'_>>,
        plan: &FramePlan,
        scene_issues: &SceneIssues,
    ) -> Result<Self, FrameError> {
        let mut views: Vec<_> = scene.cameras.iter().map(RenderView::new).collect();
        let ShadowViews { lights, main_views, scene_indices, views: of_maps } = match maps {
            Some(settings) => ShadowViews::new(scene, valid, &mut views, settings, scene_issues),
            None => ShadowViews::without_maps(valid),
        };
        views.extend(of_maps);
        if views.len() > FrameError::MAX_VIEWS {
            return Err(FrameError::TooManyViews { views: views.len() });
        }
        let mut layer_counts = [0; ViewKind::COUNT];
        for view in &mut views {
            let count = &mut layer_counts[view.kind() as usize];
            view.layer = *count;
            *count += 1;
        }
        let arrays = plan.view_arrays(&views);
        check_layers(plan, &views, &arrays)?;
        Ok(Self { views, lights, main_views, scene_indices, arrays })
    }

    /// The number of lights, without copies.
    pub(super) fn light_count(&self) -> usize {
        self.main_views.iter().filter(|copy| copy.is_none()).count()
    }

    /// Whether a frame may leave out one of the views.
    pub(super) fn may_be_cached(&self) -> bool {
        self.views.iter().any(|view| !view.camera.redraw.is_every_frame())
    }
}

fn check_layers(plan: &FramePlan, views: &[RenderView], arrays: &[ViewArray]) -> Result<(), FrameError> {
    for target in plan.targets().iter().filter(|target| target.layered) {
        let mut layers = views.iter().filter(|view| view.kind() == target.views);
        let Some(first) = layers.next() else { continue };
        if let Some(other) = layers.find(|view| view.camera.size != first.camera.size) {
            let names = [first, other].map(|view| view.name().to_owned());
            return Err(FrameError::UnequalLayers { target: target.name.clone(), views: names });
        }
    }
    for array in arrays {
        let target = &plan.targets()[array.target_index];
        let size_of = |view: &RenderView| target.size.in_view(view.camera.size);
        let mut layers = array.view_indices.iter().flatten().map(|index| &views[*index]);
        let Some(first) = layers.next() else { continue };
        let [width, height] = size_of(first);
        if let Some(other) = layers.find(|view| size_of(view) != [width, height]) {
            let names = [first, other].map(|view| view.name().to_owned());
            return Err(FrameError::UnequalLayers { target: target.name.clone(), views: names });
        }
        if array.shapes.contains(&SampledShape::Cube) && width != height {
            return Err(FrameError::OblongCubeFace { view: first.name().to_owned(), width, height });
        }
    }
    Ok(())
}
