//! The shadow maps of lights in the [view cache](super::view_cache).

use std::mem::discriminant;

use super::views::FrameViews;
use crate::scene::{Light, Projection};
use crate::view::{RenderView, ViewId};

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
