//! `shadow.wgsl` in Rust: how CPU shaders read shadow maps.

use crate::process::cpu_shader::built_in::{clamp, fract, normalize};
use crate::process::{SampledTexture, ShaderLight, ShaderView};
use crate::raster::{Real, Vector, Vector2, Vector3};
use crate::scene::LightKind;
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
        if light.kind == LightKind::Point {
            map_layer = layer + cube_face(position - light.position);
            map = &by_layer[map_layer];
            return self.filtered_visibility(maps, map_layer, &biased_point(map));
        }
        if light.kind == LightKind::Directional {
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
        let found = biased_point(map);
        if found.clip.0.iter().any(|value| value.abs() >= R::one()) || found.depth <= R::zero() {
            return R::one();
        }
        self.filtered_visibility(maps, map_layer, &found)
    }

    /// The point of a light's map at which a position is looked up: that of the position, moved towards the light by the
    /// bias.
    fn biased_point<R: Real>(
        self,
        side: usize,
        light: &ShaderLight<R>,
        position: Vector3<R>,
        normal: Vector3<R>,
        off_surface: R,
    ) -> ShadowMapPoint<R> {
        let towards = match light.kind {
            LightKind::Directional => -light.direction,
            _ => normalize(light.position - position),
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

/// How far a position from depth may be off its surface, in metres. Devices move the corners of triangles to multiples of 1/256 of a
/// pixel, and their depth with them. That moves a position parallel to the picture, by at most √2/512 of a pixel's width at its distance, for
/// which 1/256 is an upper bound. And the corners were rounded to the steps of fixed-point positions.
fn distance_off_surface<R: Real>(view: &ShaderView<R>, position: Vector3<R>) -> R {
    let pixel = R::of(2.0) * view.up.length() / R::of(view.size[1] as f64);
    let distance = if view.is_perspective() { position.length() } else { R::one() };
    pixel * distance / R::of(256.0) + R::of(0.5_f64.powi(29))
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
    match light.kind {
        LightKind::Spot | LightKind::Point => {
            let distance = (-z).max(light.shadow_near);
            let half = light.shadow_half * distance;
            ShadowMapPoint {
                clip: Vector([x / half, y / half]),
                depth: light.shadow_near / distance,
                pixel: two * half / side,
            }
        }
        LightKind::Hemispherical => {
            let distance = Vector([x, y, z]).length().max(R::of(1e-30));
            let widened = distance * (R::one() - z / distance).max(R::of(1e-3));
            let clip = Vector([x / widened, y / widened]);
            // Coarsest in the middle (Brabec et al. 2002).
            let pixel = R::of(4.0) * distance / (side * (R::one() + clip.dot(clip)));
            ShadowMapPoint { clip, depth: (light.range - distance) / reach, pixel }
        }
        _ => {
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
    if light.kind == LightKind::Hemispherical {
        // A pixel's diagonal, and a little more because pixels differ in size.
        return R::of(1.5) * (R::one() - cosine * cosine).sqrt() / cosine;
    }
    // The map is flat, so a surface that faces the light off the map's axis has a slope too.
    let local = along_map_axes(light, normal);
    (local[0].abs() + local[1].abs()) / cosine
}

/// From the world's axes to those of the light's shadow map.
fn along_map_axes<R: Real>(light: &ShaderLight<R>, direction: Vector3<R>) -> Vector3<R> {
    light.shadow_orientation.inverse().rotate(direction)
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};
    use proptest::prelude::*;

    use super::*;
    use crate::process::cpu_shader::test_inputs::{FunctionTexture, UNIT, direction, light_values, plain, view_values};
    use crate::scene::{Camera, Light, Projection};
    use crate::view::RenderView;

    const SIDE: usize = 64;

    /// A light of each kind that casts shadows, with the view that draws its first map.
    fn shadowed() -> [(Light, RenderView); 4] {
        let (position, direction) = (DVec3::new(1.0, 2.0, -3.0), Vec3::new(0.48, -0.6, 0.64));
        let (intensity, range, casts_shadow) = (Vec3::ONE, 8.0, true);
        let [inner_angle, outer_angle] = [0.3, 0.7];
        [
            Light::Directional { direction, illuminance: intensity, casts_shadow },
            Light::Spot { position, direction, intensity, range, inner_angle, outer_angle, casts_shadow },
            Light::Hemispherical { position, direction, intensity, range, casts_shadow },
            Light::Point { position, intensity, range, casts_shadow },
        ]
        .map(|light| {
            let [first, ..] = &maps_of(&light)[..] else { unreachable!("it casts shadows") };
            (light, first.clone())
        })
    }

    /// The views that draw a light's maps, from layer 2 on.
    fn maps_of(light: &Light) -> Vec<RenderView> {
        let maps = ShadowMaps { side: SIDE as u32, max_distance: 10.0, ..ShadowMaps::default() };
        let main = Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z);
        let cameras = maps.cameras("map", light, &[main]);
        (2..).zip(&cameras).map(|(layer, camera)| RenderView { layer, ..RenderView::new(camera) }).collect()
    }

    /// The fraction of a light of [`shadowed`] that reaches a position.
    fn visibility<R: Real>(
        filter: ShadowFilter,
        maps: &dyn SampledTexture<R>,
        light: &Light,
        position: Vector3<R>,
        normal: Vector3<R>,
    ) -> R {
        let of_maps = maps_of(light);
        let views = [&of_maps[0]; 2].into_iter().chain(&of_maps);
        let by_layer: Vec<_> = views.map(|map| light_values(light, Some(map))).collect();
        filter.light_visibility(&main_view(), maps, &by_layer[2], &by_layer, position, normal)
    }

    fn main_view<R: Real>() -> ShaderView<R> {
        view_values(&RenderView::new(&Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z)))
    }

    fn shadow_filter(bias: f32, filter: u32) -> ShadowFilter {
        ShadowFilter::new(&ShadowMaps { bias, filter, ..ShadowMaps::default() })
    }

    /// A position that a map sees, by its offset across from the centre to the border and its distance from the camera
    /// to the end, each from 0 to 1.
    fn position_in_map(map: &RenderView, across: [f64; 2], distance: f64) -> DVec3 {
        let [right, up, forward] = map.picture_axes().map(Vec3::as_dvec3);
        let across = right * across[0] + up * across[1];
        let distance = distance * f64::from(map.camera.far);
        let way = match map.camera.projection {
            Projection::Paraboloid => (across * 3.0 + forward).normalize() * distance,
            Projection::Perspective { .. } => (across + forward) * distance,
            Projection::Orthographic { .. } => across + forward * distance,
        };
        map.camera.position + way
    }

    proptest! {
        /// Drawing a map and reading it project a position to the same point. The matrix is f32.
        #[test]
        fn a_position_is_read_where_it_was_drawn(across in prop::array::uniform2(-0.9..0.9_f64), distance in 0.1..0.9_f64) {
            for (light, map) in shadowed() {
                let position = position_in_map(&map, across, distance);
                let view = view_values::<f64>(&map);
                let [x, y, z, w] = view.clip_position(Vector3::of(position - map.camera.position)).0;
                let found = shadow_map_point(SIDE, &light_values(&light, Some(&map)), Vector3::<f64>::of(position));
                let [found_x, found_y] = found.clip.0;
                prop_assert!((found_x - x / w).abs() + (found_y - y / w).abs() < 1e-4, "{light:?} {:?} {x} {y} {w}", found.clip);
                prop_assert!((found.depth - z / w).abs() < 1e-4, "{light:?} {} {}", found.depth, z / w);
            }
        }

        /// The filter reads no pixel outside of a cube's face, and the face is where a position was drawn.
        #[test]
        fn a_cubes_face_contains_the_filter_of_what_is_seen_through_it(
            way in direction(),
            filter in 0..=ShadowMaps::MAX_FILTER,
            side in 16..2048_u32,
        ) {
            let [.., (light, _)] = shadowed();
            let Light::Point { position, .. } = light else { unreachable!() };
            let face = cube_face(Vector3::<f64>::of(way));
            let maps = ShadowMaps { side, filter, ..ShadowMaps::default() };
            let map = RenderView::new(&maps.cameras("map", &light, &[])[face]);
            let [x, y, _, w] = view_values::<f64>(&map).clip_position(Vector3::of(way)).0;
            prop_assert!(w > 0.0);
            let values = light_values(&light, Some(&map));
            let found = shadow_map_point(side as usize, &values, Vector3::<f64>::of(position + way));
            prop_assert!((found.clip[0] - x / w).abs() + (found.clip[1] - y / w).abs() < 1e-4, "{:?}", found.clip);
            let pixels = found.clip.map(|value| (1.0 - value.abs()) * f64::from(side) / 2.0);
            prop_assert!(pixels.0.iter().all(|pixels| *pixels > f64::from(filter) + 0.99), "{pixels:?}");
        }

        /// A step of a pixel's width across the map leads to the next pixel. On a flat map that is exact; on a
        /// paraboloid, whose scale changes by its own size from the middle to the rim, it is to the first order in the
        /// pixel's angle, 4/side.
        #[test]
        fn a_step_of_a_pixels_width_leads_to_the_next_pixel(across in prop::array::uniform2(-0.6..0.6_f64), around in -3.0..3.0_f64) {
            for (light, map) in shadowed() {
                let light = light_values::<f64>(&light, Some(&map));
                let position = position_in_map(&map, across, 0.5);
                let is_hemisphere = light.kind == LightKind::Hemispherical;
                let [right, up, forward] = map.picture_axes().map(|axis| axis.as_dvec3().normalize());
                let axis = if is_hemisphere { (position - map.camera.position).normalize() } else { forward };
                let step = (right * around.cos() + up * around.sin()).reject_from_normalized(axis).normalize();
                let side = 1 << 14;
                let here = shadow_map_point(side, &light, Vector3::of(position));
                let there = shadow_map_point(side, &light, Vector3::of(position + step * here.pixel));
                let pixels = (there.clip - here.clip).length() * side as f64 / 2.0;
                prop_assert!((pixels - 1.0).abs() < 1e-3, "{:?} {pixels}", light.kind);
            }
        }

        /// Up to 100 weights of at most 1 are added up to 81 at most, so the sum is off by 100u of itself and each
        /// weight by 2u.
        #[test]
        fn a_map_of_one_depth_lights_all_or_nothing(
            across in prop::array::uniform2(-0.8..0.8_f64),
            distance in 0.2..0.8_f64,
            normal in direction(),
            filter in 0..=ShadowMaps::MAX_FILTER,
        ) {
            for (light, map) in shadowed() {
                let position = Vector3::of(position_in_map(&map, across, distance));
                let share = |depth: f64| visibility(shadow_filter(1.0, filter), &plain::<f32>([depth, 0.0, 0.0, 0.0]), &light, position, Vector3::of(normal));
                prop_assert!((f64::from(share(0.0)) - 1.0).abs() <= 102.0 * UNIT);
                let moved = share(1.0);
                // A position that the offset moves to the light itself, or out of the map, is lit.
                prop_assert!(moved == 0.0 || (moved - 1.0).abs() < 1e-5);
                let without = light_values(&light, None);
                prop_assert_eq!(shadow_filter(1.0, filter).light_visibility(&main_view(), &plain([1.0; 4]), &without, &[], position, Vector3::of(normal)), 1.0);
            }
        }

        /// A device that moves the corners of a surface by half of 1/256 of a pixel each way gives its positions the depth of others, so that they
        /// lie beyond the surface as the map shows it.
        #[test]
        fn a_surface_whose_corners_were_moved_within_a_pixel_is_lit(
            across in prop::array::uniform2(-0.8..0.8_f64),
            distance in 0.2..0.8_f64,
        ) {
            for (light, map) in shadowed().into_iter().take(2) {
                let [.., forward] = map.picture_axes().map(Vec3::as_dvec3);
                let position = position_in_map(&map, across, distance);
                let view = main_view::<f64>();
                let pixel = 2.0 * view.up.length() / view.size[1] as f64 * position.length();
                let beyond = position + forward.normalize() * (pixel / 512.0);
                let depth = shadow_map_point(1 << 20, &light_values(&light, Some(&map)), Vector3::<f64>::of(position)).depth;
                let texture = FunctionTexture { size: [1 << 20; 2], color: move |_, _| Vector([depth, 0.0, 0.0, 0.0]) };
                let share = visibility(shadow_filter(1.0, 0), &texture, &light, Vector3::of(beyond), Vector3::of(-forward.normalize()));
                prop_assert_eq!(share, 1.0, "{:?}", light);
            }
        }

        /// The filter is a box of 2·filter + 1 pixels: across a straight edge the visibility is how much of the box
        /// lies beyond the edge.
        #[test]
        fn shadows_fade_over_the_width_of_the_filter(
            across in -0.6..0.6_f64,
            row in -0.6..0.6_f64,
            edge in 20..44_usize,
            filter in 0..=ShadowMaps::MAX_FILTER,
        ) {
            let (light, map) = &shadowed()[1];
            let position = Vector3::of(position_in_map(map, [across, row], 0.5));
            let facing = Vector3::<f64>::of_single(-map.picture_axes()[2]);
            let shade = |[column, _]: [usize; 2], layer| {
                assert_eq!(layer, 2);
                Vector::splat(if column < edge { 1.0 } else { 0.0 })
            };
            let share = visibility(shadow_filter(0.0, filter), &FunctionTexture { size: [SIDE; 2], color: shade }, light, position, facing);
            let column = (shadow_map_point(SIDE, &light_values(light, Some(map)), position).clip[0] + 1.0) / 2.0 * SIDE as f64;
            let wide = f64::from(2 * filter + 1);
            let beyond = (column + wide / 2.0 - edge as f64).clamp(0.0, wide) / wide;
            prop_assert!((share - beyond).abs() < 1e-9, "{share} {beyond}");
        }

        /// A wall that is fully visible to its light casts no shadow on itself at the documented bias.
        #[test]
        fn a_surface_does_not_shadow_itself(
            across in prop::array::uniform2(-0.5..0.5_f64),
            tilt in prop::array::uniform2(-0.7..0.7_f64),
            filter in 0..=2_u32,
        ) {
            for (light, map) in shadowed() {
                let [right, up, forward] = map.picture_axes().map(|axis| axis.as_dvec3().normalize());
                let normal = (right * tilt[0] + up * tilt[1] - forward).normalize();
                let middle = position_in_map(&map, [0.0; 2], 0.5);
                let from = map.camera.position;
                // The depth of the wall as the map's pixel sees it, along the pixel's ray.
                let view = view_values::<f64>(&map);
                let depth_of = |[column, row]: [usize; 2], _: usize| {
                    let x = (column as f64 + 0.5) / SIDE as f64 * 2.0 - 1.0;
                    let y = 1.0 - (row as f64 + 0.5) / SIDE as f64 * 2.0;
                    let [right, up, forward] = map.picture_axes().map(Vec3::as_dvec3);
                    let across = right * x + up * y;
                    let (start, way) = match map.camera.projection {
                        Projection::Paraboloid => {
                            (from, across * 2.0 + forward * (1.0 - x * x - y * y))
                        }
                        Projection::Perspective { .. } => (from, across + forward),
                        Projection::Orthographic { .. } => (from + across, forward),
                    };
                    let distance = (middle - start).dot(normal) / way.dot(normal);
                    let [.., z, w] = view.clip_position(Vector3::of(start + way * distance - from)).0;
                    Vector::splat(if distance > 0.0 { z / w } else { 0.0 })
                };
                let seen = position_in_map(&map, across, 0.5);
                let position = {
                    let (start, way) = match map.camera.projection {
                        Projection::Orthographic { .. } => (seen, forward),
                        _ => (from, seen - from),
                    };
                    start + way * ((middle - start).dot(normal) / way.dot(normal))
                };
                let drawn = FunctionTexture { size: [SIDE; 2], color: depth_of };
                let share = visibility(shadow_filter(1.0, filter), &drawn, &light, Vector3::of(position), Vector3::of(normal));
                prop_assert!(share > 1.0 - 1e-9, "{light:?} {share} {tilt:?} {across:?}");
            }
        }
    }

    #[test]
    fn an_occluder_blocks_the_light() {
        for (light, map) in shadowed() {
            let values = light_values::<f64>(&light, Some(&map));
            let towards = Vector3::of_single(-map.picture_axes()[2]);
            let share = |distance: f64, wall: f64| {
                let depth = shadow_map_point(SIDE, &values, Vector3::of(position_in_map(&map, [0.0; 2], wall))).depth;
                let position = Vector3::of(position_in_map(&map, [0.0; 2], distance));
                visibility(shadow_filter(1.0, 1), &plain::<f64>([depth, 0.0, 0.0, 0.0]), &light, position, towards)
            };
            assert!((share(0.4, 0.5) - 1.0).abs() < 1e-12, "before the wall");
            assert_eq!(share(0.6, 0.5), 0.0, "behind it");
        }
    }

    #[test]
    fn positions_outside_of_a_map_are_lit() {
        let shade = plain::<f64>([1.0; 4]);
        // A cube sees everything.
        let [directional, spot, hemisphere, _] = shadowed();
        for (light, map) in [directional, spot, hemisphere] {
            let [right, _, forward] = map.picture_axes().map(Vec3::as_dvec3);
            let far = f64::from(map.camera.far);
            let share = |way: DVec3| {
                let is_sun = light.kind() == LightKind::Directional;
                let facing = if is_sun { -forward } else { -way.normalize() };
                let position = Vector3::of(map.camera.position + way);
                visibility(shadow_filter(1.0, 1), &shade, &light, position, Vector3::of(facing))
            };
            assert_eq!(share(forward * far * 1.1), if light.kind() == LightKind::Spot { 0.0 } else { 1.0 });
            assert_eq!(share(right.normalize() * far * 1.1 + forward * 0.1), 1.0);
        }
    }
}
