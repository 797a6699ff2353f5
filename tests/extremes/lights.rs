//! Lights: at, in and behind surfaces, and of extreme brightness.

use std::f32::consts::FRAC_PI_2;

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::scene::{Blend, Camera, Light, Material, RenderObject, Scene, Topology};
use drawloom_testing::scenes::{cube, sized, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::capture::Capture;
use crate::harness::Harness;
use crate::markers::with_context;

pub const CASES: &[Case] = &[
    ("lights_in_a_surface_and_very_close_to_it", at_a_surface),
    ("the_brightest_lights_of_f32_cause_no_nan", brightest_lights),
    ("an_opaque_pane_hides_radiance_beyond_half_floats", pane),
    ("lights_of_every_range", ranges),
    ("cones_from_almost_nothing_to_a_half_space", cones),
    ("lights_fall_off_correctly_from_a_millimetre_to_a_megametre", falloff),
    ("a_camera_at_a_light_and_close_to_it", camera_at_light),
];

const SIZE: [u32; 2] = [33, 33];

/// A wall of 20 m at the origin that faces +Z, and a camera 5 m in front of it.
fn wall(diffuse: f32) -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO), SIZE)];
    let material = scene.add(Material { diffuse: Vec3::splat(diffuse), ..Material::default() })?;
    let mesh = scene.add(square(Topology::TriangleList))?;
    scene.add_object(RenderObject { scale: Vec3::splat(10.0), ..RenderObject::new(mesh, material, DVec3::ZERO) })?;
    Ok(scene)
}

/// A light of every kind that has a position, with and without a shadow.
fn lamps(position: DVec3, intensity: Vec3, range: f32, direction: Vec3) -> Vec<Light> {
    let mut lamps = Vec::new();
    for casts_shadow in [false, true] {
        let (inner_angle, outer_angle) = (0.2, 0.8);
        lamps.push(Light::Point { position, intensity, range, casts_shadow });
        lamps.push(Light::Spot { position, direction, intensity, range, inner_angle, outer_angle, casts_shadow });
        lamps.push(Light::Hemispherical { position, direction, intensity, range, casts_shadow });
    }
    lamps
}

fn drawn(harness: &mut Harness, context: &str, scene: &Scene) -> Result<Option<Capture>, Failed> {
    Ok(harness.draw(scene).map_err(|failed| with_context(context, failed))?.capture)
}

/// Fails if a channel without light is lit: clamping may have turned NaN into any number.
fn assert_lit_only_in(capture: &Capture, color: Vec3) -> Result<(), Failed> {
    let greatest = capture.greatest();
    let is_dark = |(greatest, color): (f64, f32)| color > 0.0 || greatest == 0.0;
    let holds = greatest.into_iter().zip(color.to_array()).all(is_dark);
    if holds { Ok(()) } else { Err(format!("{color} becomes {greatest:?}").into()) }
}

fn at_a_surface(harness: &mut Harness) -> Result<(), Failed> {
    for height in [0.0, -0.0, 1e-30, 1e-20, 1e-9, -1e-9, 1e-6, -1e-6, 1e-3, -1e-3] {
        for direction in [Vec3::NEG_Z, Vec3::X, Vec3::Z] {
            // The middle pixel shows exactly the point at which the light is.
            for intensity in [1.0, 1e10, 1e38] {
                for lamp in lamps(DVec3::Z * height, Vec3::X * intensity, 10.0, direction) {
                    let context = format!("{lamp:?}");
                    let mut scene = wall(0.5)?;
                    scene.lights = vec![lamp];
                    let Some(capture) = drawn(harness, &context, &scene)? else { continue };
                    assert_lit_only_in(&capture, Vec3::X).map_err(|failed| with_context(&context, failed))?;
                    let behind = height < 0.0 || (direction.z > 0.0 && !matches!(lamp, Light::Point { .. }));
                    // A light behind a surface, or facing away from it, does not light it.
                    if behind && capture.covered() > 0.0 {
                        return Err(format!("{context}: lights {:.1}% from behind", capture.covered() * 100.0).into());
                    }
                }
            }
        }
    }
    Ok(())
}

fn brightest_lights(harness: &mut Harness) -> Result<(), Failed> {
    for intensity in [1e5, 1e20, 1e38, f32::MAX] {
        for color in [Vec3::ONE, Vec3::X, Vec3::new(0.0, 1.0, 1e-30)] {
            for diffuse in [1.0, 1e-30, f32::MAX] {
                for blend in [Blend::None, Blend::Alpha, Blend::Additive, Blend::Subtractive] {
                    let mut scene = wall(diffuse)?;
                    let (mesh, wall) = (scene.as_scene_ref().meshes[0], scene.as_scene_ref().materials[0]);
                    let pane = Material { blend, opacity: 0.5, ..scene.assets().get(wall)?.clone() };
                    let pane = scene.add(pane)?;
                    scene.add_object(RenderObject::new(mesh, pane, DVec3::Z * 0.5))?;
                    let sun = |casts_shadow| Light::Directional {
                        direction: Vec3::NEG_Z,
                        illuminance: color * intensity,
                        casts_shadow,
                    };
                    scene.lights = lamps(DVec3::Z, color * intensity, f32::MAX, Vec3::NEG_Z);
                    scene.lights.extend([sun(false), sun(true)]);
                    let context = format!("{color} * {intensity:e} on {diffuse:e}, {blend:?}");
                    let Some(capture) = drawn(harness, &context, &scene)? else { continue };
                    assert_lit_only_in(&capture, color).map_err(|failed| with_context(&context, failed))?;
                    if capture.radiance(2, 2)[1..] == [0.0; 2] && color.y == 1.0 && diffuse == 1.0 {
                        return Err(format!("{context}: the wall is dark").into());
                    }
                }
            }
        }
    }
    Ok(())
}

fn pane(harness: &mut Harness) -> Result<(), Failed> {
    let mut scene = wall(1.0)?;
    let mesh = scene.as_scene_ref().meshes[0];
    let dark =
        Material { diffuse: Vec3::ZERO, emission: Vec3::splat(0.25), blend: Blend::Alpha, ..Material::default() };
    let dark = scene.add(dark)?;
    scene.add_object(RenderObject::new(mesh, dark, DVec3::Z * 0.5))?;
    scene.lights = lamps(DVec3::Z, Vec3::splat(1e30), 100.0, Vec3::NEG_Z);
    let Some(capture) = drawn(harness, "a pane", &scene)? else { return Ok(()) };
    if capture.middle() == [0.25; 3] { Ok(()) } else { Err(format!("it shows {:?}", capture.middle()).into()) }
}

fn ranges(harness: &mut Harness) -> Result<(), Failed> {
    for range in [f32::from_bits(1), f32::MIN_POSITIVE, 1e-20, 1e-6, 0.5, 2.0, 1e3, 1e9, 1e20, 1e38, f32::MAX] {
        for lamp in lamps(DVec3::Z, Vec3::splat(10.0), range, Vec3::NEG_Z) {
            let mut scene = wall(0.5)?;
            scene.lights = vec![lamp];
            let context = format!("{lamp:?}");
            let Some(capture) = drawn(harness, &context, &scene)? else { continue };
            let middle = capture.middle()[0];
            // 1 m away: 10 lux on a surface of diffuse 0.5, windowed by the range.
            let window = (1.0 - f64::from(range).powi(-4)).max(0.0);
            let expected = 10.0 * 0.5 / std::f64::consts::PI * window * window;
            let expected = if range > 1.0 { expected } else { 0.0 };
            if (middle - expected).abs() > 0.02 * expected + 1e-6 {
                return Err(format!("{context}: the middle is {middle}, not {expected}").into());
            }
        }
    }
    Ok(())
}

fn cones(harness: &mut Harness) -> Result<(), Failed> {
    let angles = [[0.0, 1e-3], [0.0, 0.05], [1.0, 1.001], [0.0, FRAC_PI_2], [1.5, FRAC_PI_2], [1.569, FRAC_PI_2]];
    for [inner_angle, outer_angle] in angles {
        for casts_shadow in [false, true] {
            let mut scene = wall(0.5)?;
            let (position, direction, intensity) = (DVec3::Z, Vec3::NEG_Z, Vec3::splat(10.0));
            scene.lights = vec![Light::Spot {
                position,
                direction,
                intensity,
                range: 1e3,
                inner_angle,
                outer_angle,
                casts_shadow,
            }];
            let context = format!("{inner_angle}..{outer_angle}, shadow {casts_shadow}");
            let Some(capture) = drawn(harness, &context, &scene)? else { continue };
            let middle = capture.middle()[0];
            let expected = 10.0 * 0.5 / std::f64::consts::PI;
            // The middle pixel is 0.17 m wide.
            if outer_angle > 0.3 && (middle - expected).abs() > 0.02 * expected {
                return Err(format!("{context}: the middle is {middle}, not {expected}").into());
            }
            let corner = capture.radiance(0, 0)[0];
            if outer_angle < 1.2 && corner != 0.0 {
                return Err(format!("{context}: the corner is {corner}").into());
            }
        }
    }
    Ok(())
}

fn falloff(harness: &mut Harness) -> Result<(), Failed> {
    for distance in [1e-3, 1.0, 1e3, 1e6] {
        for lamp in lamps(
            DVec3::Z * distance,
            Vec3::splat((distance * distance * 3.0) as f32),
            (distance * 100.0) as f32,
            Vec3::NEG_Z,
        ) {
            let mut scene = wall(0.5)?;
            let camera = &mut scene.cameras[0];
            (camera.position, camera.near) = (DVec3::Z * distance * 5.0, (distance * 0.01) as f32);
            let handle = scene.objects().next().ok_or("there is a wall")?;
            let mut object = scene.object(handle)?;
            object.scale = Vec3::splat((distance * 2.0) as f32);
            scene.replace_object(handle, object)?;
            scene.lights = vec![lamp];
            let context = format!("{lamp:?}");
            let Some(capture) = drawn(harness, &context, &scene)? else { continue };
            let (middle, expected) = (capture.middle()[0], 3.0 * 0.5 / std::f64::consts::PI);
            if (middle - expected).abs() > 0.02 * expected {
                return Err(format!("{context}: the middle is {middle}, not {expected}").into());
            }
        }
    }
    Ok(())
}

fn camera_at_light(harness: &mut Harness) -> Result<(), Failed> {
    for offset in [DVec3::ZERO, DVec3::splat(1e-9), DVec3::X * 0.05, DVec3::Z * 0.5] {
        for range in [6.0, 1e3, 1e9] {
            let position = DVec3::Z * 5.0 + offset;
            for lamp in lamps(position, Vec3::splat(100.0), range, Vec3::NEG_Z) {
                let mut scene = wall(0.5)?;
                // A box behind the camera.
                let block = scene.add(cube())?;
                let material = scene.as_scene_ref().materials[0];
                let around = RenderObject::new(block, material, position + DVec3::Z * 2.5);
                scene.add_object(RenderObject { orientation: Quat::from_rotation_z(0.5), ..around })?;
                scene.lights = vec![lamp];
                let context = format!("{lamp:?}");
                let Some(capture) = drawn(harness, &context, &scene)? else { continue };
                let away = 5.0 + offset.z;
                let window = 1.0 - (away / f64::from(range)).powi(4);
                let expected = 100.0 * 0.5 / std::f64::consts::PI * window * window / (away * away);
                let middle = capture.middle()[0];
                if (middle - expected).abs() > 0.03 * expected {
                    return Err(format!("{context}: the middle is {middle}, not {expected}").into());
                }
            }
        }
    }
    Ok(())
}
