//! The views of a frame: one for each camera, and one for each shadow map.

use super::FrameError;
use super::valid_lights::ValidLights;
use crate::process::FramePlan;
use crate::scene::{Light, SceneRef, ViewKind};
use crate::view::{RenderView, ShadowMaps};

/// The views of a frame, and the valid lights that light them.
pub(super) struct FrameViews {
    pub(super) views: Vec<RenderView>,
    pub(super) lights: Vec<Light>,
}

impl FrameViews {
    /// The views that a scene requests: one for each camera in the scene's order, then, if `maps` is given, one for each light that
    /// casts shadows and reaches what a camera may see.
    ///
    /// # Errors
    /// If views whose targets are layers of one texture differ in size.
    pub(super) fn new(
        scene: &SceneRef<'_>,
        valid: ValidLights,
        maps: Option<&ShadowMaps>,
        plan: &FramePlan,
    ) -> Result<Self, FrameError> {
        let mut views: Vec<_> = scene.cameras.iter().map(RenderView::new).collect();
        if let Some(maps) = maps {
            let cameras: Vec<_> = views.iter().filter(|view| view.kind() != ViewKind::Shadow).cloned().collect();
            for (index, (light, scene_index)) in valid.lights.iter().zip(&valid.scene_indices).enumerate() {
                let is_reached = |(center, radius)| {
                    cameras.iter().any(|view: &RenderView| view.frustum.intersects_sphere(center, radius))
                };
                if !light.casts_shadow() || !light.bounding_sphere().is_none_or(is_reached) {
                    continue;
                }
                let camera = maps.camera(format!("shadow of light {scene_index}"), light, scene.cameras);
                views.extend(camera.map(|camera| RenderView { valid_light: Some(index), ..RenderView::new(&camera) }));
            }
        }
        let mut layer_counts = [0; ViewKind::COUNT];
        for view in &mut views {
            let count = &mut layer_counts[view.kind() as usize];
            view.layer = *count;
            *count += 1;
        }
        check_layers(plan, &views)?;
        Ok(Self { views, lights: valid.lights })
    }
}

fn check_layers(plan: &FramePlan, views: &[RenderView]) -> Result<(), FrameError> {
    for target in plan.targets().iter().filter(|target| target.layered) {
        let mut layers = views.iter().filter(|view| view.kind() == target.views);
        let Some(first) = layers.next() else { continue };
        if let Some(other) = layers.find(|view| view.camera.size != first.camera.size) {
            let names = [first, other].map(|view| view.name().to_owned());
            return Err(FrameError::UnequalLayers { target: target.name.clone(), views: names });
        }
    }
    Ok(())
}
