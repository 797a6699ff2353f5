//! The shadow cache: shadow maps that are drawn once for several frames.

use std::mem::discriminant;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::views::FrameViews;
use crate::process::FramePlan;
use crate::scene::{Light, Projection};
use crate::view::RenderView;

/// The shadow maps of the latest frame, for the next one to read: see
/// [`ShadowQuality::interval`](crate::quality::ShadowQuality::interval).
#[derive(Default)]
pub(super) struct ShadowCache {
    /// `None` where the next frame must draw its own.
    latest: Option<FrameShadowMaps>,
    /// Whether a recorded frame was dropped before it was submitted, so that its maps were never drawn.
    lost: Arc<AtomicBool>,
}

/// The shadow maps that a frame reads.
pub(super) struct FrameShadowMaps {
    /// How many frames before this one they were drawn.
    age: u32,
    /// The plan's identity.
    plan: u64,
    maps: Vec<ShadowMap>,
}

/// A shadow map as it was drawn.
struct ShadowMap {
    view_index: usize,
    view: RenderView,
    light: Light,
}

/// A recorded frame that is not submitted yet. If it is dropped, its shadow maps are lost.
pub(super) struct InFlight {
    lost: Option<Arc<AtomicBool>>,
}

impl ShadowCache {
    /// Decides whether a frame draws its shadow maps or reads cached ones. Returns the requested views; a cached map replaces its
    /// view and light by those that it was drawn for, because it is valid only with that light. The brightness of a light is always
    /// the requested one.
    ///
    /// Maps are cached for less than `interval` frames, and only while the same lights request maps in the same layers. Lights and
    /// objects that move do not cause a redraw, so maps are up to `interval` − 1 frames old.
    ///
    /// The maps that are returned are for [`ShadowCache::store`]; `None` where every frame draws its own.
    pub(super) fn resolve(
        &mut self,
        interval: u32,
        plan: &FramePlan,
        requested: FrameViews,
    ) -> (FrameViews, Option<FrameShadowMaps>) {
        let latest = self.latest.take();
        let was_lost = self.lost.swap(false, Ordering::Relaxed);
        if interval <= 1 {
            return (requested, None);
        }
        let FrameViews { mut views, mut lights } = requested;
        let is_usable = |latest: &FrameShadowMaps| {
            !was_lost
                && latest.age + 1 < interval
                && latest.plan == plan.identity()
                && latest.match_request(&views, &lights)
        };
        let Some(mut cached) = latest.filter(is_usable) else {
            let maps = FrameShadowMaps { age: 0, plan: plan.identity(), maps: shadow_maps_of(&views, &lights) };
            return (FrameViews { views, lights }, Some(maps));
        };
        cached.age += 1;
        for map in &cached.maps {
            views[map.view_index] = RenderView { is_cached: true, ..map.view.clone() };
            if let Some(light) = map.view.valid_light.and_then(|light| lights.get_mut(light)) {
                *light = with_brightness_of(map.light, light);
            }
        }
        (FrameViews { views, lights }, Some(cached))
    }

    /// Stores the maps of a frame that was recorded.
    pub(super) fn store(&mut self, maps: Option<FrameShadowMaps>) -> InFlight {
        self.latest = maps;
        InFlight { lost: self.latest.is_some().then(|| Arc::clone(&self.lost)) }
    }

    /// Makes the next frame draw its own maps.
    pub(super) fn invalidate(&mut self) {
        self.latest = None;
    }
}

impl InFlight {
    /// The frame was submitted.
    pub(super) fn submitted(mut self) {
        self.lost = None;
    }
}

impl Drop for InFlight {
    fn drop(&mut self) {
        if let Some(lost) = &self.lost {
            lost.store(true, Ordering::Relaxed);
        }
    }
}

impl FrameShadowMaps {
    /// Whether these views request exactly these maps, whatever the maps show.
    fn match_request(&self, views: &[RenderView], lights: &[Light]) -> bool {
        let same = |map: &ShadowMap, (index, view): (usize, &RenderView)| {
            let kind = |light: &Light| discriminant(light);
            let light = view.valid_light.and_then(|light| lights.get(light));
            (map.view_index, map.view.name(), map.view.valid_light, map.view.layer, map.view.camera.size)
                == (index, view.name(), view.valid_light, view.layer, view.camera.size)
                && light.map(kind) == Some(kind(&map.light))
                && still_covers(&map.view, view)
        };
        let mut requested = shadow_map_views(views);
        self.maps.iter().all(|map| requested.next().is_some_and(|view| same(map, view))) && requested.next().is_none()
    }
}

/// Whether a directional light's map, which covers what main cameras see, still covers most of that. Other maps move with their
/// lights.
fn still_covers(cached: &RenderView, requested: &RenderView) -> bool {
    let (Projection::Orthographic { height }, Projection::Orthographic { height: requested_height }) =
        (cached.camera.projection, requested.camera.projection)
    else {
        return true;
    };
    // The centre of the ball that a map covers: see `ShadowMaps::camera`.
    let center = |view: &RenderView| {
        let [_, _, forward] = view.picture_axes();
        view.camera.position + forward.as_dvec3() * f64::from(view.camera.far - view.camera.near)
    };
    // The size may grow by a quarter, and the centre may move by a quarter of the radius.
    requested_height <= height * 1.25 && center(cached).distance(center(requested)) <= f64::from(height) * 0.125
}

/// The views that draw a light's map, each with its index. Shadow cameras of the engine's own are not cached.
fn shadow_map_views(views: &[RenderView]) -> impl Iterator<Item = (usize, &RenderView)> {
    views.iter().enumerate().filter(|(_, view)| view.valid_light.is_some())
}

fn shadow_maps_of(views: &[RenderView], lights: &[Light]) -> Vec<ShadowMap> {
    let map = |(view_index, view): (usize, &RenderView)| {
        let light = *view.valid_light.and_then(|light| lights.get(light))?;
        Some(ShadowMap { view_index, view: view.clone(), light })
    };
    shadow_map_views(views).filter_map(map).collect()
}

/// A cached light with its current brightness.
fn with_brightness_of(mut cached: Light, light: &Light) -> Light {
    if let (
        Light::Directional { illuminance: before, .. }
        | Light::Spot { intensity: before, .. }
        | Light::Hemispherical { intensity: before, .. },
        Light::Directional { illuminance: now, .. }
        | Light::Spot { intensity: now, .. }
        | Light::Hemispherical { intensity: now, .. },
    ) = (&mut cached, light)
    {
        *before = *now;
    }
    cached
}
