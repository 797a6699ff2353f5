//! Passes that draw pixels of the picture: every one, or what lights reach.

use std::ops::Range;

use super::light_bounds::reached_by;
use super::number::Number;
use super::pass::{DrawingPass, MOST_COLORS, OpenTile};
use super::tiles::pixels_of;
use crate::process::{FullScreenPixel, FullScreenTwin, LightTwin};
use crate::raster::{PixelBounds, Vector, Vector4};
use crate::scene::Blend;
use crate::task::JobPanic;

/// Draws every pixel once, infinitely far away: where depth is tested, only where nothing is.
///
/// # Errors
/// If the twin panics.
pub(super) fn draw_full_screen<R: Number>(
    drawing: &DrawingPass<'_, R>,
    twin: &dyn FullScreenTwin<R>,
    blend: Blend,
) -> Result<(), JobPanic> {
    drawing.attachments.open(|open| {
        let sampled = open.sampled();
        let values = drawing.values(&sampled);
        drawing.crew.each(open.tiles.len(), |tile| {
            let mut tile = open.tiles[tile].lock();
            tile.clear(drawing.attachments.depth.as_ref());
            let bounds = tile.bounds;
            draw_pixels(
                &mut tile,
                bounds,
                blend,
                drawing.view.values.size,
                |there| there == R::zero(),
                |pixel, targets| twin.fragment(&values, pixel, targets),
            );
        })
    })
}

/// Draws what some of the view's lights reach: adds what the twin finds at each pixel that is near enough in the picture, and
/// where depth is tested, where something is.
///
/// # Errors
/// If the twin panics.
pub(super) fn draw_lights<R: Number>(
    drawing: &DrawingPass<'_, R>,
    twin: &dyn LightTwin<R>,
    lights: Range<usize>,
) -> Result<(), JobPanic> {
    let view = drawing.view;
    let lights = &view.lights[lights];
    let reached: Vec<_> = lights.iter().map(|light| reached_by(&view.values, light)).collect();
    drawing.attachments.open(|open| {
        let sampled = open.sampled();
        let values = drawing.values(&sampled);
        drawing.crew.each(open.tiles.len(), |tile| {
            let mut tile = open.tiles[tile].lock();
            tile.clear(drawing.attachments.depth.as_ref());
            for (light, reached) in lights.iter().zip(&reached) {
                let bounds = tile.bounds.intersection(reached.bounds);
                let [low, high] = reached.depths.map(R::of);
                let is_there = |there| there > R::zero() && low <= there && there <= high;
                draw_pixels(&mut tile, bounds, Blend::Additive, view.values.size, is_there, |pixel, targets| {
                    twin.fragment(&values, pixel, light, targets)
                });
            }
        })
    })
}

fn draw_pixels<R: Number>(
    tile: &mut OpenTile<'_, R>,
    bounds: PixelBounds,
    blend: Blend,
    size: [usize; 2],
    passes: impl Fn(R) -> bool,
    fragment: impl Fn(&FullScreenPixel<R>, &mut [Vector4<R>]) -> bool,
) {
    let count = tile.color_count();
    for place in pixels_of(bounds) {
        if !tile.depth(place).is_none_or(&passes) {
            continue;
        }
        let mut targets = [Vector4::zero(); MOST_COLORS];
        if fragment(&FullScreenPixel { place, clip: clip_of(place, size) }, &mut targets[..count]) {
            tile.draw(place, blend, &targets[..count]);
        }
    }
}

/// A pixel's middle, from (-1, -1) at the picture's lower left to (1, 1) at its upper right.
fn clip_of<R: Number>(place: [usize; 2], size: [usize; 2]) -> Vector<R, 2> {
    let share = |axis: usize| (R::of_integer(place[axis] as i64) + R::of(0.5)) / R::of_integer(size[axis] as i64);
    let two = R::of(2.0);
    Vector([share(0) * two - R::one(), R::one() - share(1) * two])
}
