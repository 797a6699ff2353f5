//! Shadows are where ray casting finds them, to within the filter and a pixel of the map.

use std::sync::Arc;

use drawloom::backend::SoftwareBackend;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::{Camera, LayerMask, Light, Projection};
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom::wgpu;
use drawloom_testing::adapter;
use drawloom_testing::scenes::sized;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, draw_on_processor, half_floats, radiance};
use crate::rays::{Counts, Panel, PanelScene};

pub const CASES: &[Case] = &[
    ("a_square_casts_the_shadow_of_its_geometry", square_occluder),
    ("shadows_are_correct_in_the_middle_of_a_hemisphere_and_at_its_rim", around_a_hemisphere),
    ("a_long_beam_casts_a_straight_shadow", long_beam),
    ("an_object_across_a_hemispheres_plane_casts_no_shadow_in_front_of_it", across_the_rim),
    ("a_wall_close_behind_a_hemisphere_casts_no_shadow_in_front_of_it", close_behind),
    ("a_distant_object_blocks_a_directional_light", far_towards_the_sun),
    ("a_tower_shadows_what_is_close_behind_it", tower),
    ("a_box_a_hundred_times_as_large_as_what_is_seen_casts_its_shadow", || across_the_near_plane(NearPlane::Default)),
    ("without_depth_clip_control_a_large_box_casts_its_shadow", || across_the_near_plane(NearPlane::WithoutFeature)),
    ("software_casts_the_shadow_of_a_large_box", || across_the_near_plane(NearPlane::Software)),
    ("surfaces_beyond_a_maps_distance_are_lit", beyond_the_reach),
    ("each_light_has_its_own_shadow", several_lights),
    ("maps_of_one_and_two_pixels_only_darken", smallest_maps),
    ("a_spot_light_of_180_degrees_casts_shadows", widest_spot),
    ("an_orthographic_camera_sees_the_same_shadows", orthographic),
    ("shadows_far_from_the_origin_equal_those_near_it", far_away),
];

pub const MAPS: ShadowMaps = ShadowMaps {
    side: 512,
    max_distance: 12.0,
    cascades: 1,
    split_lambda: 0.5,
    bias: 1.0,
    filter: 1,
    layers: LayerMask::ALL,
};

/// The shipped processes with these shadow maps.
pub fn fixture_with(maps: ShadowMaps) -> Result<Fixture, Failed> {
    Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture().shadow_maps(Some(maps))))
}

pub fn sun(direction: DVec3) -> Light {
    Light::Directional { direction: direction.as_vec3(), illuminance: Vec3::new(3.0, 2.0, 1.0), casts_shadow: true }
}

pub fn spot(position: DVec3, direction: DVec3, degrees: f32) -> Light {
    let outer_angle = degrees.to_radians();
    Light::Spot {
        position,
        direction: direction.as_vec3(),
        intensity: Vec3::new(50.0, 40.0, 30.0),
        range: 15.0,
        inner_angle: outer_angle * 0.9,
        outer_angle,
        casts_shadow: true,
    }
}

pub fn hemisphere(position: DVec3, direction: DVec3) -> Light {
    Light::Hemispherical {
        position,
        direction: direction.as_vec3(),
        intensity: Vec3::new(50.0, 40.0, 30.0),
        range: 15.0,
        casts_shadow: true,
    }
}

pub fn lamp(position: DVec3) -> Light {
    Light::Point { position, intensity: Vec3::new(50.0, 40.0, 30.0), range: 15.0, casts_shadow: true }
}

pub fn camera(position: DVec3, target: DVec3, degrees: f64) -> Camera {
    let projection = Projection::Perspective { field_of_view: degrees.to_radians() as f32 };
    sized(Camera { projection, ..Camera::looking_at("main", position, target) }, [64, 64])
}

/// The same light without shadows.
pub fn without_shadow(light: Light) -> Light {
    let mut light = light;
    if let Light::Directional { casts_shadow, .. }
    | Light::Point { casts_shadow, .. }
    | Light::Spot { casts_shadow, .. }
    | Light::Hemispherical { casts_shadow, .. } = &mut light
    {
        *casts_shadow = false;
    }
    light
}

fn panel_scene(panels: Vec<Panel>, lights: Vec<Light>, maps: ShadowMaps) -> PanelScene {
    PanelScene { panels, lights, maps }
}

/// Fails unless at least these fractions of the pixels are certainly lit and certainly dark, and at most a fifth is
/// uncertain.
pub fn expect(counts: Counts, lit: f64, dark: f64) -> Result<(), Failed> {
    let all = (counts.lit + counts.dark + counts.fading + counts.edges) as f64;
    let enough = counts.lit as f64 >= lit * all && counts.dark as f64 >= dark * all;
    let sure = (counts.fading + counts.edges) as f64 <= 0.2 * all;
    if enough && sure { Ok(()) } else { Err(format!("too few pixels to compare: {counts:?}").into()) }
}

pub fn with_context(failed: Failed, context: impl std::fmt::Display) -> Failed {
    format!("{context}: {}", failed.message().unwrap_or("")).into()
}

/// The six axes, and two directions between them.
fn directions() -> impl Iterator<Item = DVec3> {
    let between = [[1.0, 0.3, 0.3], [-0.3, -0.9, 0.2]].map(DVec3::from);
    DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]).chain(between).map(DVec3::normalize)
}

fn square_occluder() -> Result<(), Failed> {
    for filter in [0, 1, 4] {
        let maps = ShadowMaps { filter, ..MAPS };
        let mut fixture = fixture_with(maps)?;
        // The filter does not depend on the direction.
        for up in directions().skip(if filter == 1 { 0 } else { 7 }) {
            let sideways = up.any_orthonormal_vector();
            let across = up.cross(sideways);
            let floor = Panel::facing(DVec3::ZERO, up, 6.0);
            let mut square = Panel::facing(up * 1.2, up, 0.7).double_sided();
            // Neither along the map's axes nor across them.
            (square.right, square.up) = (square.right + square.up * 0.3, square.up - square.right * 0.3);
            let position = up * 3.0 + sideways * 0.7 + across * 0.4;
            let down = (-up - sideways * 0.2).normalize();
            let eye = up * 4.0 - sideways * 3.0 + across * 2.0;
            for light in [sun(down), spot(position, down, 50.0), hemisphere(position, down), lamp(position)] {
                let panel_scene = panel_scene(vec![floor, square], vec![light], maps);
                let view = camera(eye, sideways * -0.5, 50.0);
                let counts = panel_scene.expect(&mut fixture, &[view]).map_err(|failed| with_context(failed, up))?;
                if filter == 1 {
                    expect(counts, 0.4, 0.01).map_err(|failed| with_context(failed, format!("{light:?}")))?;
                }
            }
        }
    }
    Ok(())
}

/// A direction at an angle from `axis`, rotated by `around` about it.
fn tilted(axis: DVec3, degrees: f64, around: f64) -> DVec3 {
    let right = axis.any_orthonormal_vector();
    let sideways = right * around.cos() + axis.cross(right) * around.sin();
    axis * degrees.to_radians().cos() + sideways * degrees.to_radians().sin()
}

fn around_a_hemisphere() -> Result<(), Failed> {
    let mut fixture = fixture_with(MAPS)?;
    let position = DVec3::new(0.3, 1.0, -2.0);
    for axis in directions() {
        for degrees in [5.0, 45.0, 75.0, 85.0] {
            let direction = tilted(axis, degrees, degrees + axis.x);
            let wall = Panel::facing(position + direction * 2.5, -direction, 1.5);
            let square = Panel::facing(position + direction, -direction, 0.2).double_sided();
            let panel_scene = panel_scene(vec![wall, square], vec![hemisphere(position, axis)], MAPS);
            let sideways = direction.cross(axis).normalize_or(direction.any_orthonormal_vector());
            let view = camera(position + sideways * 0.8, wall.center, 40.0);
            let context = format!("{degrees} degrees from {axis}");
            let counts = panel_scene.expect(&mut fixture, &[view]).map_err(|failed| with_context(failed, &context))?;
            expect(counts, 0.3, 0.05).map_err(|failed| with_context(failed, &context))?;
        }
    }
    Ok(())
}

fn long_beam() -> Result<(), Failed> {
    let maps = ShadowMaps { side: 1024, ..MAPS };
    let mut fixture = fixture_with(maps)?;
    let floor = Panel::facing(DVec3::Y * -4.0, DVec3::Y, 12.0);
    let wall = Panel::facing(DVec3::Z * -6.0, DVec3::Z, 12.0);
    // Below the light; to its side; near its plane. All are about 2.2 m away, and extend 10 m to either side.
    for (y, z) in [(-2.2, 0.1), (-1.5, -1.6), (-0.3, -2.2)] {
        let normal = DVec3::new(0.0, y, z).normalize();
        let beam = Panel::new(DVec3::new(0.0, y, z), DVec3::X * 10.0, normal.cross(DVec3::X) * 0.1).double_sided();
        let lamps = [hemisphere(DVec3::ZERO, DVec3::NEG_Y), spot(DVec3::ZERO, normal, 80.0), lamp(DVec3::ZERO)];
        for light in lamps.into_iter().chain([sun(normal)]) {
            // A map of this extent would be too coarse for the beam.
            let maps = if matches!(light, Light::Directional { .. }) {
                ShadowMaps { max_distance: 20.0, ..maps }
            } else {
                maps
            };
            let panel_scene = panel_scene(vec![floor, wall, beam], vec![light], maps);
            let views = [
                camera(DVec3::new(0.5, 1.0, 3.0), DVec3::new(0.0, -3.0, -3.0), 70.0),
                camera(DVec3::new(1.0, 0.5, 1.0), DVec3::new(7.0, -3.0, -4.0), 80.0),
            ];
            let counts = if maps.max_distance == 20.0 {
                panel_scene.expect(&mut fixture_with(maps)?, &views)
            } else {
                panel_scene.expect(&mut fixture, &views)
            };
            let counts = counts.map_err(|failed| with_context(failed, format!("({y}, {z}) {light:?}")))?;
            if counts.lit < 3000 {
                return Err(format!("too few pixels to compare: {counts:?}").into());
            }
        }
    }
    Ok(())
}

/// A square in front of the light, and the wall that its shadow falls on.
fn wall_and_square(position: DVec3, axis: DVec3) -> [Panel; 2] {
    let wall = Panel::facing(position + axis * 3.0, -axis, 3.5);
    [wall, Panel::facing(position + tilted(axis, 20.0, 0.7) * 1.2, -axis, 0.3).double_sided()]
}

fn across_the_rim() -> Result<(), Failed> {
    let mut fixture = fixture_with(MAPS)?;
    let position = DVec3::new(0.3, 1.0, -2.0);
    for axis in directions().skip(4) {
        for (turn, distance) in [(40.0, 1.0), (80.0, 0.5), (100.0, 1.0), (150.0, 0.6)] {
            // From in front of the light to behind it, 12 m in either direction.
            let away = tilted(axis, turn, turn);
            let slab = Panel::facing(position + away * distance, -away, 12.0).double_sided();
            let mut panels = wall_and_square(position, axis).to_vec();
            panels.push(slab);
            let panel_scene = panel_scene(panels, vec![hemisphere(position, axis)], MAPS);
            let views = [
                camera(position - away * 0.2, position + axis * 3.0, 90.0),
                camera(position - away * 2.0, position + axis + away, 90.0),
            ];
            let context = format!("{turn} degrees from {axis}, {distance} m away");
            let counts = panel_scene.expect(&mut fixture, &views).map_err(|failed| with_context(failed, &context))?;
            if counts.lit < 500 {
                return Err(format!("{context}: too few pixels to compare: {counts:?}").into());
            }
        }
    }
    Ok(())
}

fn close_behind() -> Result<(), Failed> {
    let mut fixture = fixture_with(MAPS)?;
    let position = DVec3::new(0.3, 1.0, -2.0);
    for axis in directions().skip(5) {
        for turn in [170.0, 175.0, 180.0] {
            for distance in [0.1, 0.02] {
                let away = tilted(axis, turn, turn);
                let mut slab = Panel::facing(position + away * distance, -away, 12.0).double_sided();
                // No corner of the triangles that it is split into may be straight behind the light.
                slab.center += slab.right.normalize() * 0.05 + slab.up.normalize() * 0.12;
                let mut panels = wall_and_square(position, axis).to_vec();
                panels.push(slab);
                let panel_scene = panel_scene(panels, vec![hemisphere(position, axis)], MAPS);
                let view = camera(position + axis * 0.5, position + axis * 3.0, 90.0);
                let context = format!("{turn} degrees from {axis}, {distance} m away");
                let counts =
                    panel_scene.expect(&mut fixture, &[view]).map_err(|failed| with_context(failed, &context))?;
                if counts.lit < 500 {
                    return Err(format!("{context}: too few pixels to compare: {counts:?}").into());
                }
            }
        }
    }
    Ok(())
}

fn far_towards_the_sun() -> Result<(), Failed> {
    let mut fixture = fixture_with(MAPS)?;
    let down = DVec3::new(0.2, -0.9, -0.3).normalize();
    for height in [5.0, 50.0, 500.0, 5000.0] {
        let floor = Panel::facing(DVec3::ZERO, DVec3::Y, 8.0);
        let kite = Panel::facing(-down * height, DVec3::Y, 1.0).double_sided();
        let panel_scene = panel_scene(vec![floor, kite], vec![sun(down)], MAPS);
        let view = camera(DVec3::new(2.0, 3.0, 4.0), DVec3::ZERO, 50.0);
        let counts = panel_scene.expect(&mut fixture, &[view]).map_err(|failed| with_context(failed, height))?;
        expect(counts, 0.4, 0.1).map_err(|failed| with_context(failed, height))?;
    }
    Ok(())
}

/// Each triangle of the tower extends from the ground to far above everything that the camera sees.
fn tower() -> Result<(), Failed> {
    let mut fixture = fixture_with(MAPS)?;
    for (height, lean) in [(20.0, 0.0), (100.0, 0.3), (200.0, 0.0)] {
        let up = DVec3::new(0.0, height / 2.0, lean * height);
        let tower = Panel::new(up, DVec3::Z * 3.0, up).double_sided();
        let wall = Panel::new(DVec3::new(1.5, 3.0, 0.0), DVec3::Z * 4.0, DVec3::Y * 3.0).double_sided();
        let floor = Panel::facing(DVec3::ZERO, DVec3::Y, 8.0);
        let panel_scene = panel_scene(vec![tower, wall, floor], vec![sun(DVec3::new(0.6, -0.8, 0.0))], MAPS);
        let view = camera(DVec3::new(0.3, 2.0, 5.0), DVec3::new(1.5, 3.0, -0.5), 70.0);
        let counts = panel_scene.expect(&mut fixture, &[view]).map_err(|failed| with_context(failed, height))?;
        expect(counts, 0.05, 0.1).map_err(|failed| with_context(failed, height))?;
    }
    Ok(())
}

/// What draws triangles that reach from within a map to beyond its near plane.
#[derive(Clone, Copy, PartialEq)]
enum NearPlane {
    Default,
    WithoutFeature,
    Software,
}

/// The sphere around what the camera sees has a radius of some 9 m, and the map reaches 16 radii towards the sun. Each
/// triangle of the boxes extends from the ground to far beyond that.
fn across_the_near_plane(near_plane: NearPlane) -> Result<(), Failed> {
    let view = camera(DVec3::new(0.5, 2.0, 5.0), DVec3::new(0.5, 0.0, -1.5), 70.0);
    for cascades in [1, 3] {
        let maps = ShadowMaps { cascades, ..MAPS };
        let deferred = Deferred::to_picture().shadow_maps(Some(maps));
        let mut fixture = match near_plane {
            NearPlane::WithoutFeature => {
                let device = adapter::device_without(wgpu::Features::DEPTH_CLIP_CONTROL)?;
                Fixture::on(device, 2, |builder| builder.pipeline(deferred.clone()))?
            }
            _ => fixture_with(maps)?,
        };
        for (size, direction) in [
            (1.0, DVec3::new(-0.6, -0.8, 0.0)),
            (100.0, DVec3::new(-0.6, -0.8, 0.0)),
            (900.0, DVec3::new(-0.7, -0.9, 0.3)),
            (900.0, DVec3::new(-0.2, -1.0, 0.1)),
            (1800.0, DVec3::new(-0.9, -0.5, 0.2)),
        ] {
            // Its shadow falls to the left, from x = 2, and begins at z = -0.5.
            let half = DVec3::new(size, size, 2.0 * size);
            let mut panels = Panel::closed_box(DVec3::new(2.0 + size, size - 1.0, 2.0 * size - 0.5), half);
            // A pillar of nothing but sides, which stands free, and reaches as far down as up, beyond the map's far
            // plane.
            let pillar = DVec3::new(0.15, size, 0.15);
            panels.extend(Panel::closed_box(DVec3::new(0.3, 0.0, -2.5), pillar));
            panels.push(Panel::facing(DVec3::ZERO, DVec3::Y, 6.0));
            let panel_scene = panel_scene(panels, vec![sun(direction.normalize())], maps);
            let context = format!("{cascades} cascades, {size} m, {direction}");
            let counts = if near_plane == NearPlane::Software {
                let scheduler = Arc::new(Scheduler::new(2)?);
                let backend = SoftwareBackend::new(Arc::clone(&scheduler));
                let scene = panel_scene.scene(std::slice::from_ref(&view))?;
                let found = draw_on_processor((backend, scheduler), deferred.clone(), &scene, "radiance")?;
                panel_scene.compare_with(&view, &half_floats(&found))
            } else {
                panel_scene.expect(&mut fixture, std::slice::from_ref(&view))
            };
            let counts = counts.map_err(|failed| with_context(failed, &context))?;
            expect(counts, 0.05, 0.1).map_err(|failed| with_context(failed, &context))?;
        }
    }
    Ok(())
}

fn beyond_the_reach() -> Result<(), Failed> {
    let maps = ShadowMaps { max_distance: 5.0, ..MAPS };
    let mut fixture = fixture_with(maps)?;
    let down = DVec3::new(0.2, -0.9, -0.3).normalize();
    // The surface that its shadow would fall on is too far away, so all of it is lit.
    let floor = Panel::facing(DVec3::ZERO, DVec3::Y, 8.0);
    let square = Panel::facing(DVec3::Y, DVec3::Y, 0.5).double_sided();
    let view = camera(DVec3::new(20.0, 30.0, 40.0), DVec3::ZERO, 8.0);
    let lit =
        Light::Directional { direction: down.as_vec3(), illuminance: Vec3::new(3.0, 2.0, 1.0), casts_shadow: false };
    let found = [sun(down), lit].map(|light| {
        let scene = panel_scene(vec![floor, square], vec![light], maps).scene(std::slice::from_ref(&view))?;
        fixture.draw(&scene)
    });
    let [shadowed, lit] = found;
    if shadowed? != lit? {
        return Err("there are shadows beyond the reach".into());
    }
    // At this distance there are shadows.
    let near = camera(DVec3::new(1.0, 2.0, 2.0), DVec3::ZERO, 50.0);
    expect(panel_scene(vec![floor, square], vec![sun(down)], maps).expect(&mut fixture, &[near])?, 0.3, 0.02)
}

fn several_lights() -> Result<(), Failed> {
    let mut fixture = fixture_with(MAPS)?;
    let floor = Panel::facing(DVec3::ZERO, DVec3::Y, 6.0);
    let square = Panel::facing(DVec3::new(0.1, 1.0, 0.2), DVec3::Y, 0.5).double_sided();
    let tinted = |light: Light, tint: Vec3| match light {
        Light::Spot { position, direction, range, inner_angle, outer_angle, casts_shadow, .. } => {
            Light::Spot { position, direction, intensity: tint, range, inner_angle, outer_angle, casts_shadow }
        }
        Light::Hemispherical { position, direction, range, casts_shadow, .. } => {
            Light::Hemispherical { position, direction, intensity: tint, range, casts_shadow }
        }
        Light::Directional { direction, casts_shadow, .. } => {
            Light::Directional { direction, illuminance: tint * 0.1, casts_shadow }
        }
        other => other,
    };
    let [left, right, back] = [DVec3::new(-2.0, 3.0, 0.3), DVec3::new(2.0, 3.0, -0.2), DVec3::new(0.4, 3.0, -2.0)];
    let red = tinted(spot(left, -left.normalize(), 50.0), Vec3::new(50.0, 0.0, 0.0));
    let green = tinted(spot(right, -right.normalize(), 50.0), Vec3::new(0.0, 50.0, 0.0));
    let blue = tinted(hemisphere(back, DVec3::NEG_Y), Vec3::new(0.0, 0.0, 50.0));
    let sun = tinted(sun(DVec3::new(0.1, -0.8, -0.6).normalize()), Vec3::new(0.0, 0.0, 40.0));
    let bare = Light::Spot {
        position: left,
        direction: -left.normalize().as_vec3(),
        intensity: Vec3::new(7.0, 7.0, 0.0),
        range: 15.0,
        inner_angle: 0.3,
        outer_angle: 0.9,
        casts_shadow: false,
    };
    let lamp = Light::Point {
        position: right + DVec3::Y,
        intensity: Vec3::new(0.0, 0.0, 9.0),
        range: 12.0,
        casts_shadow: false,
    };
    let dark = tinted(red, Vec3::ZERO);
    let orders = [
        vec![red, green],
        vec![green, red],
        vec![bare, red, lamp, green, blue, sun],
        vec![sun, blue, dark, green, bare],
    ];
    for lights in orders {
        let views = [
            camera(DVec3::new(1.0, 4.0, 4.0), DVec3::ZERO, 60.0),
            // Not every light reaches what this camera sees.
            camera(DVec3::new(-4.0, 1.0, 1.0), DVec3::new(-1.0, 0.0, 0.0), 50.0),
        ];
        panel_scene(vec![floor, square], lights, MAPS).expect(&mut fixture, &views)?;
    }
    Ok(())
}

fn smallest_maps() -> Result<(), Failed> {
    for side in [1, 2] {
        let maps = ShadowMaps { side, ..MAPS };
        let mut fixture = fixture_with(maps)?;
        let floor = Panel::facing(DVec3::ZERO, DVec3::Y, 6.0);
        let square = Panel::facing(DVec3::Y, DVec3::Y, 0.5).double_sided();
        let position = DVec3::Y * 3.0;
        for light in [sun(DVec3::NEG_Y), spot(position, DVec3::NEG_Y, 50.0), hemisphere(position, DVec3::NEG_Y)] {
            let view = camera(DVec3::new(1.0, 4.0, 4.0), DVec3::ZERO, 60.0);
            // The positions of shadows are undefined, but nothing is brighter than its light, and nothing is shadowed
            // without a caster.
            let mut shots = Vec::new();
            for (panels, light) in [
                (vec![floor, square], without_shadow(light)),
                (vec![floor, square], light),
                (vec![floor], without_shadow(light)),
                (vec![floor], light),
            ] {
                let recorded =
                    fixture.record(&panel_scene(panels, vec![light], maps).scene(std::slice::from_ref(&view))?)?;
                shots.push(radiance(&fixture.submit(recorded)?, 0)?.into_flattened());
            }
            let [lit, shadowed, bare_lit, bare] = &shots[..] else { return Err("a picture is missing".into()) };
            if lit.iter().zip(shadowed).any(|(lit, shadowed)| !(*shadowed >= 0.0 && shadowed <= lit))
                || bare != bare_lit
            {
                return Err(format!("{side} pixels, {light:?}").into());
            }
        }
    }
    Ok(())
}

fn widest_spot() -> Result<(), Failed> {
    let maps = ShadowMaps { side: 2048, ..MAPS };
    let mut fixture = fixture_with(maps)?;
    let position = DVec3::Y * 2.0;
    for degrees in [80.0, 84.9, 90.0] {
        let floor = Panel::facing(DVec3::ZERO, DVec3::Y, 8.0);
        let square = Panel::facing(DVec3::new(0.3, 1.0, 0.0), DVec3::Y, 0.6).double_sided();
        let panel_scene = panel_scene(vec![floor, square], vec![spot(position, DVec3::NEG_Y, degrees)], maps);
        let view = camera(DVec3::new(1.0, 4.0, 5.0), DVec3::ZERO, 60.0);
        let counts = panel_scene.expect(&mut fixture, &[view]).map_err(|failed| with_context(failed, degrees))?;
        if counts.dark < 10 || counts.lit < 1200 {
            return Err(format!("{degrees}: too few pixels to compare: {counts:?}").into());
        }
    }
    Ok(())
}

fn orthographic() -> Result<(), Failed> {
    let mut fixture = fixture_with(MAPS)?;
    let floor = Panel::facing(DVec3::ZERO, DVec3::Y, 6.0);
    let square = Panel::facing(DVec3::Y, DVec3::Y, 0.6).double_sided();
    let down = DVec3::new(0.2, -0.9, -0.3).normalize();
    let position = DVec3::new(0.5, 3.0, 0.2);
    for light in [sun(down), spot(position, down, 50.0), hemisphere(position, down), lamp(position)] {
        for far in [8.0, 40.0] {
            let looking = Camera::looking_at("plan", DVec3::new(1.0, 4.0, 4.0), DVec3::ZERO);
            let projection = Projection::Orthographic { height: 4.0 };
            let view = sized(Camera { projection, far, ..looking }, [80, 80]);
            let counts = panel_scene(vec![floor, square], vec![light], MAPS).expect(&mut fixture, &[view])?;
            expect(counts, 0.4, 0.02)?;
        }
    }
    Ok(())
}

fn far_away() -> Result<(), Failed> {
    let mut fixture = fixture_with(MAPS)?;
    let shift = DVec3::new(1e6, -5e5, 2.5e5);
    let floor = Panel::facing(shift, DVec3::Y, 6.0);
    let square = Panel::facing(shift + DVec3::Y, DVec3::Y, 0.6).double_sided();
    let down = DVec3::new(0.2, -0.9, -0.3).normalize();
    let position = shift + DVec3::new(0.5, 3.0, 0.2);
    for light in [sun(down), spot(position, down, 50.0), hemisphere(position, down), lamp(position)] {
        let view = camera(shift + DVec3::new(1.0, 4.0, 4.0), shift, 45.0);
        expect(panel_scene(vec![floor, square], vec![light], MAPS).expect(&mut fixture, &[view])?, 0.4, 0.01)?;
    }
    Ok(())
}
