//! Passes without objects: full-screen passes, and the pixels that lights reach.

use std::ops::Range;

use super::attachments::{MAX_COLOR_ATTACHMENTS, TileAttachments};
use super::light_bounds::LightBounds;
use super::pass_context::PassContext;
use super::precision::Precision;
use super::tiles::pixels_of;
use crate::process::{FullScreenCpuShader, FullScreenPixel, LightCpuShader, ShaderView};
use crate::raster::{PixelBounds, Vector, Vector4};
use crate::scene::Blend;
use crate::task::JobPanic;

/// Draws every pixel once, infinitely far away: if depth is tested, only pixels where nothing was drawn.
///
/// # Errors
/// If the CPU shader panics.
pub(super) fn draw_full_screen<R: Precision>(
    context: &PassContext<'_, R>,
    shader: &dyn FullScreenCpuShader<R>,
    blend: Blend,
) -> Result<(), JobPanic> {
    context.attachments.open(|open| {
        let sampled = open.sampled();
        let inputs = context.inputs(&sampled);
        context.executor.for_each(open.tiles.len(), |tile| {
            let mut tile = open.tiles[tile].lock();
            tile.clear(context.attachments.depth.as_ref());
            let bounds = tile.bounds;
            draw_pixels(
                &mut tile,
                bounds,
                blend,
                open.tiling.size(),
                |stored| stored == R::zero(),
                |pixel, targets| shader.fragment(&inputs, pixel, targets),
            );
        })
    })
}

/// Draws the pixels that some of the view's lights reach: adds the shader's result at each pixel within a light's
/// bounds; if depth is tested, only where something was drawn.
///
/// # Errors
/// If the CPU shader panics.
pub(super) fn draw_lights<R: Precision>(
    context: &PassContext<'_, R>,
    shader: &dyn LightCpuShader<R>,
    lights: Range<usize>,
) -> Result<(), JobPanic> {
    let view = context.view;
    let lights = &view.lights[lights];
    context.attachments.open(|open| {
        let shader_view = ShaderView { size: open.tiling.size(), ..view.shader_view.clone() };
        let light_bounds: Vec<_> = lights.iter().map(|light| LightBounds::new(&shader_view, light)).collect();
        let sampled = open.sampled();
        let inputs = context.inputs(&sampled);
        context.executor.for_each(open.tiles.len(), |tile| {
            let mut tile = open.tiles[tile].lock();
            tile.clear(context.attachments.depth.as_ref());
            for (light, light_bounds) in lights.iter().zip(&light_bounds) {
                let bounds = tile.bounds.intersection(light_bounds.pixels);
                let [low, high] = light_bounds.depths.map(R::of);
                let is_within = |stored| stored > R::zero() && low <= stored && stored <= high;
                draw_pixels(&mut tile, bounds, Blend::Additive, shader_view.size, is_within, |pixel, targets| {
                    shader.fragment(&inputs, pixel, light, targets)
                });
            }
        })
    })
}

fn draw_pixels<R: Precision>(
    tile: &mut TileAttachments<'_, R>,
    bounds: PixelBounds,
    blend: Blend,
    size: [usize; 2],
    passes_depth: impl Fn(R) -> bool,
    fragment: impl Fn(&FullScreenPixel<R>, &mut [Vector4<R>]) -> bool,
) {
    let count = tile.color_count();
    for coordinates in pixels_of(bounds) {
        if !tile.depth(coordinates).is_none_or(&passes_depth) {
            continue;
        }
        let mut targets = [Vector4::zero(); MAX_COLOR_ATTACHMENTS];
        let pixel = FullScreenPixel { coordinates, clip: clip_of(coordinates, size) };
        if fragment(&pixel, &mut targets[..count]) {
            tile.draw(coordinates, blend, &targets[..count]);
        }
    }
}

/// A pixel's centre, from (-1, -1) at the picture's lower left to (1, 1) at its upper right.
fn clip_of<R: Precision>(pixel: [usize; 2], size: [usize; 2]) -> Vector<R, 2> {
    let fraction = |axis: usize| (R::of_integer(pixel[axis] as i64) + R::of(0.5)) / R::of_integer(size[axis] as i64);
    let two = R::of(2.0);
    Vector([fraction(0) * two - R::one(), R::one() - fraction(1) * two])
}
