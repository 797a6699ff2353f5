//! The views of a frame: its cameras, and what its lights see.

use super::FrameError;
use crate::process::FramePlan;
use crate::scene::{Light, SceneRef, ViewKind};
use crate::view::{FixedPosition, RejectionReason, Rejections, RenderView, ShadowMaps};

/// A scene's lights that can be drawn, each with its index in the scene.
pub(super) struct ValidLights {
    pub(super) lights: Vec<Light>,
    indices: Vec<usize>,
}

impl ValidLights {
    /// Counts those that are left out; see [`Quality::light_cut_off`](crate::quality::Quality::light_cut_off) for the others.
    pub(super) fn new(scene: &SceneRef<'_>, rejections: &Rejections, cut_off: f32) -> Self {
        let mut valid =
            Self { lights: Vec::with_capacity(scene.lights.len()), indices: Vec::with_capacity(scene.lights.len()) };
        for (index, light) in scene.lights.iter().enumerate() {
            if let Err(error) = light.check(index) {
                tracing::debug!(target: "drawloom", %error, "light left out");
                rejections.count(RejectionReason::InvalidLight, index);
            } else if light.bounding_sphere().is_some_and(|(position, _)| FixedPosition::new(position).is_none()) {
                rejections.count(RejectionReason::LightOutOfReach, index);
            } else if light.is_dark() {
                rejections.count(RejectionReason::DarkLight, index);
            } else {
                valid.lights.push(light.cut_off_at(cut_off));
                valid.indices.push(index);
            }
        }
        valid
    }
}

/// A view for each camera, in their order, and behind them one for each light that casts shadows where a camera may see them,
/// if `maps` says how.
///
/// # Errors
/// If views whose targets are layers of one texture differ in size.
pub(super) fn views_of(
    scene: &SceneRef<'_>,
    lights: &ValidLights,
    maps: Option<&ShadowMaps>,
    plan: &FramePlan,
) -> Result<Vec<RenderView>, FrameError> {
    let mut views: Vec<_> = scene.cameras.iter().map(RenderView::new).collect();
    if let Some(maps) = maps {
        let lit = views.iter().filter(|view| view.kind() != ViewKind::Shadow);
        let cameras: Vec<_> = lit.cloned().collect();
        for (light, (index, definition)) in lights.indices.iter().zip(&lights.lights).enumerate() {
            let reaches = |(center, radius)| {
                cameras.iter().any(|view: &RenderView| view.frustum.intersects_sphere(center, radius))
            };
            if !definition.casts_shadow() || !definition.bounding_sphere().is_none_or(reaches) {
                continue;
            }
            let name = format!("shadow of light {index}");
            let camera = maps.camera(name, definition, scene.cameras);
            views.extend(camera.map(|camera| RenderView { valid_light: Some(light), ..RenderView::new(&camera) }));
        }
    }
    let mut layers = [0; ViewKind::COUNT];
    for view in &mut views {
        let next = &mut layers[view.kind() as usize];
        view.layer = *next;
        *next += 1;
    }
    check_layers(plan, &views)?;
    Ok(views)
}

fn check_layers(plan: &FramePlan, views: &[RenderView]) -> Result<(), FrameError> {
    for target in plan.targets().iter().filter(|target| target.layered) {
        let mut sharing = views.iter().filter(|view| view.kind() == target.views);
        let Some(first) = sharing.next() else { continue };
        if let Some(other) = sharing.find(|view| view.camera.size != first.camera.size) {
            let names = [first, other].map(|view| view.name().to_owned());
            return Err(FrameError::UnequalLayers { target: target.name.clone(), views: names });
        }
    }
    Ok(())
}
