//! Shadow maps that are kept for some frames.

use std::mem::discriminant;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::process::FramePlan;
use crate::scene::{Light, Projection};
use crate::view::RenderView;

/// The shadow maps of the last frame, for the next one to read: see
/// [`ShadowQuality::interval`](crate::quality::ShadowQuality::interval).
#[derive(Default)]
pub(super) struct KeptMaps {
    /// `None` where the next frame must draw its own.
    latest: Option<MapsOfFrame>,
    /// Whether a frame was recorded since the last one was begun, or before, and never drawn.
    lost: Arc<AtomicBool>,
}

/// The shadow maps that a frame reads.
pub(super) struct MapsOfFrame {
    /// How many frames before this one they were drawn.
    age: u32,
    /// The plan by its identity.
    plan: u64,
    maps: Vec<Map>,
}

/// A shadow map as it was drawn.
struct Map {
    /// Its view's index.
    place: usize,
    view: RenderView,
    light: Light,
}

/// A frame on its way to the device. Dropped before it was submitted, it leaves maps that nobody has drawn.
pub(super) struct OnItsWay {
    lost: Option<Arc<AtomicBool>>,
}

impl KeptMaps {
    /// Draws the maps of a frame, or keeps those that are there: then they take the place of `views`, and so do the lights as
    /// they were of `lights`, because a map is of use only beside the light that it was drawn for. How bright those are is up
    /// to the frame.
    ///
    /// Maps are kept for less than `interval` frames, and only where each light that has one had one, and in the same layer.
    /// That a light has moved, or what it lights, is no reason to draw them: so they are up to `interval` − 1 frames old.
    ///
    /// What is returned is for [`KeptMaps::keep`]; `None` where all frames draw their own.
    pub(super) fn follow(
        &mut self,
        interval: u32,
        plan: &FramePlan,
        views: &mut [RenderView],
        lights: &mut [Light],
    ) -> Option<MapsOfFrame> {
        let latest = self.latest.take();
        let was_lost = self.lost.swap(false, Ordering::Relaxed);
        if interval <= 1 {
            return None;
        }
        let fits = |latest: &MapsOfFrame| {
            !was_lost && latest.age + 1 < interval && latest.plan == plan.identity() && latest.fits(views, lights)
        };
        let Some(mut kept) = latest.filter(fits) else {
            return Some(MapsOfFrame { age: 0, plan: plan.identity(), maps: maps_of(views, lights) });
        };
        kept.age += 1;
        for map in &kept.maps {
            views[map.place] = RenderView { is_cached: true, ..map.view.clone() };
            if let Some(light) = map.view.valid_light.and_then(|light| lights.get_mut(light)) {
                *light = as_bright_as(map.light, light);
            }
        }
        Some(kept)
    }

    /// Keeps the maps of a frame that was recorded.
    pub(super) fn keep(&mut self, maps: Option<MapsOfFrame>) -> OnItsWay {
        self.latest = maps;
        OnItsWay { lost: self.latest.is_some().then(|| Arc::clone(&self.lost)) }
    }

    /// Has the next frame draw its own.
    pub(super) fn forget(&mut self) {
        self.latest = None;
    }
}

impl OnItsWay {
    /// It was submitted.
    pub(super) fn arrive(mut self) {
        self.lost = None;
    }
}

impl Drop for OnItsWay {
    fn drop(&mut self) {
        if let Some(lost) = &self.lost {
            lost.store(true, Ordering::Relaxed);
        }
    }
}

impl MapsOfFrame {
    /// Whether these views have just these maps, whatever they show.
    fn fits(&self, views: &[RenderView], lights: &[Light]) -> bool {
        let same = |map: &Map, (place, view): (usize, &RenderView)| {
            let kind = |light: &Light| discriminant(light);
            let light = view.valid_light.and_then(|light| lights.get(light));
            (map.place, map.view.name(), map.view.valid_light, map.view.layer, map.view.camera.size)
                == (place, view.name(), view.valid_light, view.layer, view.camera.size)
                && light.map(kind) == Some(kind(&map.light))
                && still_covers(&map.view, view)
        };
        let mut wanted = maps(views);
        self.maps.iter().all(|map| wanted.next().is_some_and(|view| same(map, view))) && wanted.next().is_none()
    }
}

/// Whether a directional light's map, which covers what main cameras see, still covers most of what it would. Others move with their
/// lights.
fn still_covers(kept: &RenderView, wanted: &RenderView) -> bool {
    let (Projection::Orthographic { height }, Projection::Orthographic { height: wanted_height }) =
        (kept.camera.projection, wanted.camera.projection)
    else {
        return true;
    };
    // The middle of the ball that a map covers: see `ShadowMaps::camera`.
    let middle = |view: &RenderView| {
        let [_, _, forward] = view.picture_axes();
        view.camera.position + forward.as_dvec3() * f64::from(view.camera.far - view.camera.near)
    };
    // A quarter of its radius, or of its size.
    wanted_height <= height * 1.25 && middle(kept).distance(middle(wanted)) <= f64::from(height) * 0.125
}

/// The views that draw a light's map, each with its index. A shadow camera of the engine's own is not for Drawloom to keep.
fn maps(views: &[RenderView]) -> impl Iterator<Item = (usize, &RenderView)> {
    views.iter().enumerate().filter(|(_, view)| view.valid_light.is_some())
}

fn maps_of(views: &[RenderView], lights: &[Light]) -> Vec<Map> {
    let map = |(place, view): (usize, &RenderView)| {
        let light = *view.valid_light.and_then(|light| lights.get(light))?;
        Some(Map { place, view: view.clone(), light })
    };
    maps(views).filter_map(map).collect()
}

/// A light where it was, as bright as it is.
fn as_bright_as(mut kept: Light, light: &Light) -> Light {
    if let (
        Light::Directional { illuminance: before, .. }
        | Light::Spot { intensity: before, .. }
        | Light::Hemispherical { intensity: before, .. },
        Light::Directional { illuminance: now, .. }
        | Light::Spot { intensity: now, .. }
        | Light::Hemispherical { intensity: now, .. },
    ) = (&mut kept, light)
    {
        *before = *now;
    }
    kept
}
