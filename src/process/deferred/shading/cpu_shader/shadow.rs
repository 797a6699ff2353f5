//! `shadow.wgsl` in Rust: how CPU shaders read shadow maps.

use crate::process::cpu_shader::built_in::{clamp, fract, normalize};
use crate::process::{SampledTexture, ShaderLight, ShaderView};
use crate::raster::{Real, Vector, Vector2, Vector3};
use crate::scene::ShadowProjection;
use crate::view::ShadowMaps;

/// Reads shadow maps in CPU shaders: `shadow.wgsl`.
#[derive(Clone, Copy, Debug)]
pub(in crate::process::deferred) struct ShadowFilter {
    bias: f32,
    filter: u32,
    cascades: u32,
}

impl ShadowFilter {
    /// With the settings of these maps.
    pub(in crate::process::deferred) fn new(maps: &ShadowMaps) -> Self {
        Self { bias: maps.bias, filter: maps.filter, cascades: maps.cascades }
    }

    /// The fraction of a light that reaches a position, from 0 to 1. `by_layer` are the lights by layer.
    pub(in crate::process::deferred) fn light_visibility<R: Real>(
        self,
        view: &ShaderView<R>,
        maps: &dyn SampledTexture<R>,
        light: &ShaderLight<R>,
        by_layer: &[ShaderLight<R>],
        position: Vector3<R>,
        normal: Vector3<R>,
    ) -> R {
        let Some(layer) = light.shadow_layer else { return R::one() };
        let side = maps.size()[0];
        let off_surface = distance_off_surface(view, position);
        let biased_point = |map| self.biased_point(side, map, position, normal, off_surface);
        let (mut map, mut map_layer) = (light, layer);
        match light.kind.rules().maps {
            ShadowProjection::Cube => {
                map_layer = layer + cube_face(position - light.position);
                map = &by_layer[map_layer];
                return self.filtered_visibility(maps, map_layer, &biased_point(map));
            }
            ShadowProjection::Cascades => {
                // The finest cascade in which the filter reads no pixel outside of the map.
                let extent = R::one() - R::of(f64::from(2 * self.filter + 1)) / R::of(side as f64);
                for cascade in 1..self.cascades as usize {
                    let found = biased_point(map);
                    let is_inside = found.clip.0.iter().all(|value| value.abs() < extent);
                    if is_inside && found.depth > R::zero() && found.depth < R::one() {
                        return self.filtered_visibility(maps, map_layer, &found);
                    }
                    map_layer = layer + cascade;
                    map = &by_layer[map_layer];
                }
            }
            ShadowProjection::Perspective | ShadowProjection::Paraboloid => {}
        }
        let found = biased_point(map);
        if found.clip.0.iter().any(|value| value.abs() >= R::one()) || found.depth <= R::zero() {
            return R::one();
        }
        self.filtered_visibility(maps, map_layer, &found)
    }

    /// The point of a light's map at which a position is looked up: that of the position, moved towards the light by
    /// the bias.
    fn biased_point<R: Real>(
        self,
        side: usize,
        light: &ShaderLight<R>,
        position: Vector3<R>,
        normal: Vector3<R>,
        off_surface: R,
    ) -> ShadowMapPoint<R> {
        let towards = match light.kind.rules().maps {
            ShadowProjection::Cascades => -light.direction,
            ShadowProjection::Cube | ShadowProjection::Perspective | ShadowProjection::Paraboloid => {
                normalize(light.position - position)
            }
        };
        // Slope times this, in pixels' widths, is an upper bound of the depth change within the filter.
        let reach = R::of(f64::from(self.filter + 1));
        let pixel = shadow_map_point(side, light, position).pixel;
        let depth_change = pixel * (R::of(0.1) + reach * shadow_slope(light, normal, towards));
        let bias = R::of(f64::from(self.bias));
        let offset = bias * (depth_change + off_surface / normal.dot(towards).max(R::of(1e-3)));

        // An offset towards the light does not change where in the map the position is.
        shadow_map_point(side, light, position + towards * offset.min((light.position - position).length()))
    }

    /// The mean of the depth tests of the map's pixels around a point: a box filter, in which pixels on the edge are
    /// weighted by how much of them is inside.
    fn filtered_visibility<R: Real>(self, maps: &dyn SampledTexture<R>, layer: usize, point: &ShadowMapPoint<R>) -> R {
        let side = maps.size()[0];
        let half = R::of(0.5);
        let center = Vector([point.clip[0] * half + half, point.clip[1] * -half + half])
            .map(|value| value * R::of(side as f64) - half);
        let first = |value: R| value.floor().as_f64() as i64 - i64::from(self.filter);
        let [left, top] = center.0.map(first);
        let inside = center.map(fract);
        let last = 2 * i64::from(self.filter) + 1;
        let weight_of = |index: i64, inside: R| match index {
            0 => R::one() - inside,
            _ if index == last => inside,
            _ => R::one(),
        };
        let within = |index: i64| index.clamp(0, side as i64 - 1) as usize;
        let (mut lit, mut is_shadowed) = (R::zero(), false);
        for row in 0..=last {
            let weight_of_row = weight_of(row, inside[1]);
            for column in 0..=last {
                // Depth is reversed: nearer to the light is greater.
                let [depth, ..] = maps.load([within(left + column), within(top + row)], layer).0;
                if depth <= point.depth {
                    lit += weight_of_row * weight_of(column, inside[0]);
                } else {
                    is_shadowed = true;
                }
            }
        }
        // Without an occluder the result is exactly 1, as without a map, although the sum of the weights is rounded.
        if is_shadowed { lit / R::of((last * last) as f64) } else { R::one() }
    }
}

/// How far a position from depth may be off its surface, in metres. Devices move the corners of triangles to multiples
/// of 1/256 of a pixel, and their depth with them. That moves a position parallel to the picture, by at most √2/512 of
/// a pixel's width at its distance, for which 1/256 is an upper bound. Where an oblique near plane makes depth differ
/// across the picture, the same depth is that of a position farther or nearer there, too. And the corners were rounded
/// to the steps of fixed-point positions.
fn distance_off_surface<R: Real>(view: &ShaderView<R>, position: Vector3<R>) -> R {
    let [width, height] = view.size.map(|pixels| R::of(pixels as f64));
    let mut pixel = R::of(2.0) * view.up.length() / height;
    if view.is_perspective() {
        let distance = position.length();
        let [x, y, z, origin] = view.clip_from_relative.map(|column| column[2]);
        let row = Vector([x, y, z]);
        // The depth of a position at distance t is row · ray + origin ÷ t, for a ray that is at least 1 long.
        let depth_change = row.dot(view.right).abs() / width + row.dot(view.up).abs() / height;
        pixel = distance * (pixel + distance * depth_change / origin.abs());
    }
    pixel / R::of(256.0) + R::of(0.5_f64.powi(29))
}

/// The face of a cube around the origin that a position is seen through: 0 for +X, 1 for −X, and so on.
fn cube_face<R: Real>(position: Vector3<R>) -> usize {
    let Vector([x, y, z]) = position.map(|value| value.abs());
    let axis = if x >= y && x >= z {
        0
    } else if y >= z {
        1
    } else {
        2
    };
    2 * axis + usize::from(position[axis] < R::zero())
}

/// A point of a light's shadow map.
struct ShadowMapPoint<R> {
    /// From (-1, -1) at the map's lower left to (1, 1) at its upper right.
    clip: Vector2<R>,
    depth: R,
    /// The width of a pixel of the map there, in metres.
    pixel: R,
}

fn shadow_map_point<R: Real>(side: usize, light: &ShaderLight<R>, position: Vector3<R>) -> ShadowMapPoint<R> {
    let side = R::of(side as f64);
    let two = R::of(2.0);
    let Vector([x, y, z]) = along_map_axes(light, position - light.position);
    let reach = light.range - light.shadow_near;
    match light.kind.rules().maps {
        ShadowProjection::Perspective | ShadowProjection::Cube => {
            let distance = (-z).max(light.shadow_near);
            let half = light.shadow_half * distance;
            ShadowMapPoint {
                clip: Vector([x / half, y / half]),
                depth: light.shadow_near / distance,
                pixel: two * half / side,
            }
        }
        ShadowProjection::Paraboloid => {
            let distance = Vector([x, y, z]).length().max(R::of(1e-30));
            let widened = distance * (R::one() - z / distance).max(R::of(1e-3));
            let clip = Vector([x / widened, y / widened]);
            // Coarsest in the middle (Brabec et al. 2002).
            let pixel = R::of(4.0) * distance / (side * (R::one() + clip.dot(clip)));
            ShadowMapPoint { clip, depth: (light.range - distance) / reach, pixel }
        }
        ShadowProjection::Cascades => {
            let half = light.shadow_half;
            ShadowMapPoint {
                clip: Vector([x / half, y / half]),
                depth: (light.range + z) / reach,
                pixel: two * half / side,
            }
        }
    }
}

/// The greatest change of a surface's distance to the light over a pixel of its map along both of the map's axes, in
/// pixel widths.
fn shadow_slope<R: Real>(light: &ShaderLight<R>, normal: Vector3<R>, towards: Vector3<R>) -> R {
    let cosine = clamp(normal.dot(towards), R::of(1e-3), R::one());
    match light.kind.rules().maps {
        // A pixel's diagonal, and a little more because pixels differ in size.
        ShadowProjection::Paraboloid => R::of(1.5) * (R::one() - cosine * cosine).sqrt() / cosine,
        // The map is flat, so a surface that faces the light off the map's axis has a slope too.
        ShadowProjection::Cascades | ShadowProjection::Cube | ShadowProjection::Perspective => {
            let local = along_map_axes(light, normal);
            (local[0].abs() + local[1].abs()) / cosine
        }
    }
}

/// From the world's axes to those of the light's shadow map.
fn along_map_axes<R: Real>(light: &ShaderLight<R>, direction: Vector3<R>) -> Vector3<R> {
    light.shadow_orientation.inverse().rotate(direction)
}

#[cfg(test)]
mod tests;
