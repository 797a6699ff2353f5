//! The views of the shadow maps of a frame's lights.

use super::error::FrameError;
use super::valid_lights::ValidLights;
use crate::backend::SceneLimits;
use crate::scene::{Camera, Light, Redraw, SceneRef};
use crate::view::{IssueReason, MapOwners, RenderView, SceneIssues, ShadowMaps};

/// The lights of a frame, and the views of their shadow maps.
pub(super) struct ShadowViews {
    /// In the scene's order. If several main cameras have maps of their own, a directional light is followed by a copy
    /// for each that has maps of it.
    pub(super) lights: Vec<Light>,
    /// For each light, the main view that a copy is for.
    pub(super) main_views: Vec<Option<usize>>,
    /// For each light, its index in the scene.
    pub(super) scene_indices: Vec<usize>,
    /// In the order of the lights.
    pub(super) views: Vec<RenderView>,
}

/// How shadow maps are drawn.
#[derive(Clone, Copy)]
pub(super) struct MapSettings<'a> {
    pub(super) maps: &'a ShadowMaps,
    /// The number of frames from one drawing of a map to the next.
    pub(super) interval: u32,
    pub(super) limits: SceneLimits,
}

/// The maps of a light.
struct LightMaps {
    /// The light's index among the valid ones.
    light: usize,
    /// The main view that they are for; `None` if they are for all views.
    main_view: Option<usize>,
    cameras: Vec<Camera>,
}

impl ShadowViews {
    /// Those of lights without maps.
    pub(super) fn without_maps(valid: ValidLights) -> Self {
        let ValidLights { lights, scene_indices } = valid;
        Self { main_views: vec![None; lights.len()], lights, scene_indices, views: Vec::new() }
    }

    /// The maps of each light that casts shadows and reaches what one of `views` may see; `views` are those of the
    /// scene's cameras, and get their [main views](RenderView::main_view). Lights whose maps do not fit have none, and
    /// are counted as scene issues.
    pub(super) fn new(
        scene: &SceneRef<'_>,
        valid: ValidLights,
        views: &mut [RenderView],
        settings: MapSettings<'_>,
        scene_issues: &SceneIssues,
    ) -> Self {
        let owners = settings.maps.map_owners(scene.cameras);
        for (index, view) in views.iter_mut().enumerate().filter(|(_, view)| view.kind().rules().is_lit) {
            view.main_view = owners.owner_of(index);
        }
        let maps = maps_that_fit(scene, &valid, views, &owners, settings, scene_issues);
        let mut maps = maps.into_iter().peekable();
        let redraw = Redraw::Interval(settings.interval);
        let mut frame =
            Self { lights: Vec::new(), main_views: Vec::new(), scene_indices: Vec::new(), views: Vec::new() };
        for (index, (light, scene_index)) in valid.lights.into_iter().zip(valid.scene_indices).enumerate() {
            frame.push(light, scene_index, None);
            while let Some(LightMaps { main_view, cameras, .. }) = maps.next_if(|maps| maps.light == index) {
                if main_view.is_some() {
                    frame.push(light, scene_index, main_view);
                }
                let valid_light = Some(frame.lights.len() - 1);
                let map = |camera| RenderView { valid_light, ..RenderView::new(&Camera { redraw, ..camera }) };
                frame.views.extend(cameras.into_iter().map(map));
            }
        }
        frame
    }

    fn push(&mut self, light: Light, scene_index: usize, main_view: Option<usize>) {
        self.lights.push(light);
        self.scene_indices.push(scene_index);
        self.main_views.push(main_view);
    }
}

/// The maps of the lights, in their order. Main cameras take what they need one after the other, and each of them for
/// one light after the other.
fn maps_that_fit(
    scene: &SceneRef<'_>,
    valid: &ValidLights,
    views: &[RenderView],
    owners: &MapOwners,
    settings: MapSettings<'_>,
    scene_issues: &SceneIssues,
) -> Vec<LightMaps> {
    let is_bounded = |light: &Light| light.kind().rules().is_bounded();
    let lights = valid.lights.iter().zip(&valid.scene_indices).enumerate();
    let casting: Vec<_> = lights.filter(|(_, (light, _))| light.casts_shadow()).collect();
    let ranks: Vec<_> = casting.iter().map(|(_, (light, _))| rank_of_first_reached(light, views, owners)).collect();
    let mut room = room_for_maps(views, settings.limits);
    let mut maps = Vec::new();
    // Without a main camera, all views are equal.
    for rank in 0..owners.owners().len().max(1) {
        let owner = owners.owners().get(rank).copied();
        for (&(index, (light, &scene_index)), light_rank) in casting.iter().zip(&ranks) {
            let needs_maps = if is_bounded(light) { *light_rank == Some(rank) } else { owner.is_some() };
            if !needs_maps {
                continue;
            }
            if settings.maps.map_count(light) > room {
                scene_issues.count_once(IssueReason::ShadowMapLimit, scene_index);
                continue;
            }
            let name = format!("shadow of light {scene_index}");
            let (main_view, cameras) = match owner.filter(|_| !is_bounded(light)) {
                Some(owner) => {
                    let name = owners.map_name(&name, owner, scene.cameras);
                    let main_camera = std::slice::from_ref(&scene.cameras[owner]);
                    (
                        Some(owner).filter(|_| owners.owners().len() > 1),
                        settings.maps.cameras(&name, light, main_camera),
                    )
                }
                None => (None, settings.maps.cameras(&name, light, &[])),
            };
            room -= cameras.len();
            if !cameras.is_empty() {
                maps.push(LightMaps { light: index, main_view, cameras });
            }
        }
    }
    // Stable, so those of one light keep the order of their main cameras.
    maps.sort_by_key(|maps| maps.light);
    maps
}

/// How many maps there may be beside these views, the cameras of a scene, some of which may draw maps of the engine's
/// own.
fn room_for_maps(views: &[RenderView], limits: SceneLimits) -> usize {
    let own = views.iter().filter(|view| view.kind().rules().is_shadow_map).count();
    let layers = (limits.texture_layers as usize).saturating_sub(own);
    layers.min(FrameError::MAX_VIEWS.saturating_sub(views.len()))
}

/// The rank of the first owner of maps that sees what a light reaches, itself or by a view that has its maps; `None` if
/// no view does.
fn rank_of_first_reached(light: &Light, views: &[RenderView], owners: &MapOwners) -> Option<usize> {
    let (center, radius) = light.bounding_sphere()?;
    let mut first = None;
    for view in views.iter().filter(|view| view.kind().rules().is_lit) {
        // Without a main camera all views are equal.
        let rank =
            view.main_view.and_then(|owner| owners.owners().iter().position(|other| *other == owner)).unwrap_or(0);
        if first.is_none_or(|first| rank < first) && view.frustum.intersects_sphere(center, radius) {
            first = Some(rank);
        }
        if first == Some(0) {
            break;
        }
    }
    first
}
