use glam::{DVec3, Vec3};
use proptest::prelude::*;

use super::*;
use crate::process::cpu_shader::test_inputs::{FunctionTexture, UNIT, direction, light_values, plain, view_values};
use crate::scene::{Camera, ClipPlane, Light, LightKind, Projection};
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

/// The point of a plane that the ray of a map's pixel meets, if the map has this side.
fn seen_point(
    map: &RenderView,
    side: usize,
    [column, row]: [usize; 2],
    on_plane: DVec3,
    normal: DVec3,
) -> Option<DVec3> {
    let x = (column as f64 + 0.5) / side as f64 * 2.0 - 1.0;
    let y = 1.0 - (row as f64 + 0.5) / side as f64 * 2.0;
    let [right, up, forward] = map.picture_axes().map(Vec3::as_dvec3);
    let (from, across) = (map.camera.position, right * x + up * y);
    let (start, way) = match map.camera.projection {
        Projection::Paraboloid => (from, across * 2.0 + forward * (1.0 - x * x - y * y)),
        Projection::Perspective { .. } => (from, across + forward),
        Projection::Orthographic { .. } => (from + across, forward),
    };
    let distance = (on_plane - start).dot(normal) / way.dot(normal);
    (distance > 0.0).then(|| start + way * distance)
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

    /// A device that moves the corners of a surface by half of 1/256 of a pixel each way gives its positions the depth
    /// of others, so that they may lie beyond the surface as the map shows it.
    #[test]
    fn a_surface_whose_corners_were_moved_within_a_pixel_is_lit(
        across in prop::array::uniform2(-0.8..0.8_f64),
        distance in 0.2..0.8_f64,
        tilt in prop::array::uniform2(-2.0..2.0_f64),
        near_plane in prop::option::of(prop::array::uniform2(-0.8..0.8_f64)),
    ) {
        for (light, map) in shadowed().into_iter().take(2) {
            let camera = Camera::looking_at("main", DVec3::ZERO, position_in_map(&map, [0.0; 2], 0.5));
            let turned = |axis: DVec3| camera.orientation.as_dquat() * axis;
            let clip_plane = near_plane.map(|[x, y]| ClipPlane {
                point: turned(DVec3::NEG_Z * 0.2),
                normal: turned(DVec3::new(x, y, -1.0)).as_vec3(),
            });
            let main = RenderView::new(&Camera { clip_plane, ..camera });
            prop_assert_eq!(main.has_oblique_near_plane(), clip_plane.is_some());
            let main = view_values::<f64>(&main);
            let [right, up, forward] = map.picture_axes().map(|axis| axis.as_dvec3().normalize());
            let normal = (right * tilt[0] + up * tilt[1] - forward).normalize();
            let position = position_in_map(&map, across, distance);
            let [x, y, z, w] = main.clip_position(Vector3::of(position)).0;
            let is_seen = w > 0.1 && x.abs() < w && y.abs() < w && (0.0..w).contains(&z);
            let of_maps: Vec<_> = maps_of(&light).iter().map(|map| light_values(&light, Some(map))).collect();
            let towards = match light.kind() {
                LightKind::Directional => -forward,
                _ => (map.camera.position - position).normalize(),
            };
            // A surface that faces away, or that the light only grazes, is dark anyway.
            if !is_seen || normal.dot(towards) <= 1e-3 {
                continue;
            }
            const FINE: usize = 1 << 26;
            let by_layer = [&of_maps[..1], &of_maps[..1], &of_maps].concat();
            let drawn = |pixel, _| {
                let depth = |point| shadow_map_point(FINE, &by_layer[2], Vector3::of(point)).depth;
                Vector::splat(seen_point(&map, FINE, pixel, position, normal).map_or(0.0, depth))
            };
            for (right, up) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                let clip = Vector([x / w + right / 256.0 / main.size[0] as f64, y / w + up / 256.0 / main.size[1] as f64]);
                let moved = main.position_from_depth(clip, z / w);
                let drawn = FunctionTexture { size: [FINE; 2], color: drawn };
                let share = shadow_filter(1.0, 0).light_visibility(&main, &drawn, &by_layer[2], &by_layer, moved, Vector3::of(normal));
                prop_assert_eq!(share, 1.0, "{:?}", light);
            }
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
            // The depth of the wall as the map's pixel sees it.
            let view = view_values::<f64>(&map);
            let depth_of = |pixel: [usize; 2], _: usize| {
                let depth = |point: DVec3| {
                    let [.., z, w] = view.clip_position(Vector3::of(point - from)).0;
                    z / w
                };
                Vector::splat(seen_point(&map, SIDE, pixel, middle, normal).map_or(0.0, depth))
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
