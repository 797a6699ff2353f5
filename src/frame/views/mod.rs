//! The views of a frame: one for each camera, and one for each shadow map; and the lights that reach them.

pub(super) mod budgeted_view;
pub(super) mod view_budget;
pub(super) mod view_cache;
pub(super) mod view_visibility;

use std::mem::discriminant;

use super::FrameError;
use crate::backend::SceneLimits;
use crate::process::{FramePlan, SampledShape, ViewArray};
use crate::scene::{Camera, Light, Projection, Redraw, SceneRef, ViewKind};
use crate::unwind::emit;
use crate::view::{FixedPosition, IssueReason, MapOwners, RenderView, SceneIssues, ShadowMaps, ViewId};

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

/// Whether lights of the same kinds request maps in the same order, wherever the lights are.
pub(super) fn have_same_maps(before: &FrameViews, requested: &FrameViews) -> bool {
    fn maps(frame: &FrameViews) -> impl Iterator<Item = (ViewId, usize, Option<std::mem::Discriminant<Light>>)> {
        // Shadow cameras of the engine's own have no light.
        let with_light = frame.views.iter().filter_map(|view| Some((view, view.valid_light?)));
        with_light.map(|(view, light)| (view.id, light, frame.lights.get(light).map(discriminant)))
    }
    maps(before).eq(maps(requested))
}

/// Whether a directional light's map, which covers what a main camera sees, still covers most of that. Other maps move
/// with their lights, which keep their range with them: it must be most of the one that a brighter light has.
pub(super) fn covers(cached: &RenderView, requested: &RenderView) -> bool {
    let (Projection::Orthographic { height }, Projection::Orthographic { height: requested_height }) =
        (cached.camera.projection, requested.camera.projection)
    else {
        return requested.camera.far <= cached.camera.far * MAX_RANGE_GROWTH;
    };
    // The centre of the ball that a map covers: see `ShadowMaps::cameras`.
    let center = |view: &RenderView| {
        let [_, _, forward] = view.picture_axes();
        view.camera.position + forward.as_dvec3() * f64::from(view.camera.far - view.camera.near)
    };
    // The size may grow by a quarter, and the centre may move by a quarter of the radius.
    requested_height <= height * 1.25 && center(cached).distance(center(requested)) <= f64::from(height) * 0.125
}

/// So much farther may a light reach than its cached map. Its brightness is then at most the square of this times that
/// which the map was drawn with, and so is what it misses of the [cut-off](crate::quality::Quality::light_cut_off).
const MAX_RANGE_GROWTH: f32 = 1.125;

/// A cached light with its current brightness.
pub(super) fn with_brightness_of(mut cached: Light, light: &Light) -> Light {
    *cached.fields_mut().color = *light.fields().color;
    cached
}

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

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn a_cached_map_covers_a_range_that_is_an_eighth_larger() {
        let map = |far| RenderView::new(&Camera { far, ..Camera::looking_at("map", DVec3::Z, DVec3::ZERO) });
        let covered = [80.0, 90.0, 90.1].map(|far| covers(&map(80.0), &map(far)));
        assert_eq!(covered, [true, true, false]);
    }
}
