//! Lights beyond a buffer.

use drawloom::backend::SceneLimits;
use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Light, Scene};
use drawloom::view::IssueReason;
use drawloom::view::internal::GpuLight;
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Device, Options, binding, expect_pictures, expect_same, expect_scene_issues, renderer, small};

pub const CASES: &[Case] = &[
    ("lights_beyond_a_buffer_are_left_out", Device::ALL, beyond_a_buffer),
    ("only_lights_that_reach_a_view_take_room", Device::DRAWING, out_of_reach),
    ("views_share_a_buffer_of_lights", Device::DRAWING, shared_buffer),
    ("layers_of_shadow_maps_take_room_for_lights", Device::DRAWING, layers),
    ("lights_come_and_go_at_the_limit", Device::DRAWING, changing),
];

const LIGHT: usize = size_of::<GpuLight>();

/// A lamp above the middle of the field.
fn lamp(number: usize) -> Light {
    Light::Point {
        position: DVec3::new(number as f64 % 7.0 - 3.0, 3.0, number as f64 % 5.0 - 2.0),
        intensity: Vec3::new(2.0, 1.0 + number as f32 * 0.1, 3.0),
        range: 30.0,
        casts_shadow: false,
    }
}

/// One that reaches nothing in sight.
fn far_lamp() -> Light {
    let Light::Point { intensity, range, casts_shadow, .. } = lamp(0) else { unreachable!("a lamp is a point light") };
    Light::Point { position: DVec3::Y * 1e5, intensity, range, casts_shadow }
}

/// Few objects, since they share the limit, with these lights.
fn lit_by(lights: Vec<Light>) -> Scene {
    let mut scene = small(field(12));
    scene.lights = lights;
    scene
}

fn beyond_a_buffer(device: Device) -> Result<(), Failed> {
    let mut lights: Vec<_> = (0..40).map(lamp).collect();
    // An invalid light and a dark one have no room to take.
    lights.insert(3, Light::Point { position: DVec3::NAN, intensity: Vec3::ONE, range: 1.0, casts_shadow: false });
    let scene = lit_by(lights.clone());
    for capacity in [10, 11, 39, 40, 41] {
        let options = Options { limits: binding(capacity * LIGHT + LIGHT - 1), ..Options::default() };
        let mut frames = renderer(device, options)?;
        let valid = lights.iter().enumerate().filter(|(index, _)| *index != 3).map(|(_, light)| *light);
        let expected = lit_by(valid.take(capacity).collect());
        let invalid = (IssueReason::InvalidLight, 1, 3, None);
        // The invalid one is before them.
        let limit = (IssueReason::LightLimit, 40 - capacity.min(40), capacity + 1, None);
        let pictures = [scene.as_scene_ref(), expected.as_scene_ref()];
        let scene_issues = expect_same(&mut *frames, device, options, pictures)?;
        expect_scene_issues(&scene_issues, &[invalid, limit][..if capacity < 40 { 2 } else { 1 }])?;
    }
    Ok(())
}

fn out_of_reach(device: Device) -> Result<(), Failed> {
    let options = Options { limits: binding(12 * LIGHT), ..Options::default() };
    let lights = |near: usize| [vec![far_lamp(); 30], (0..near).map(lamp).collect()].concat();
    for near in [11, 12, 13] {
        let (scene, expected) = (lit_by(lights(near)), lit_by(lights(near.min(12))));
        let mut frames = renderer(device, options)?;
        let pictures = [scene.as_scene_ref(), expected.as_scene_ref()];
        let scene_issues = expect_same(&mut *frames, device, options, pictures)?;
        expect_scene_issues(&scene_issues, &[(IssueReason::LightLimit, 1, 42, None)][..near / 13])?;
    }
    Ok(())
}

/// The second view has what the first one leaves. Views begin at multiples of 256 bytes.
fn shared_buffer(device: Device) -> Result<(), Failed> {
    for (buffer_bytes, of_views) in [(8192, [40, 40]), (6144, [40, 35]), (3328, [40, 0]), (2048, [25, 0])] {
        let limits = SceneLimits { buffer_bytes, binding_bytes: 4096, ..SceneLimits::NONE };
        let options = Options { limits: Some(limits), ..Options::default() };
        let lights: Vec<_> = (0..40).map(lamp).collect();
        let scene = lit_by(lights.clone());
        let mut frames = renderer(device, options)?;
        let found = frames.frame(scene.as_scene_ref())?;
        for (view, count) in of_views.into_iter().enumerate() {
            let expected = lit_by(lights[..count].to_vec());
            let expected = renderer(device, Options { limits: None, ..options })?.frame(expected.as_scene_ref())?;
            if found.pictures[view] != expected.pictures[view] {
                return Err(format!("{buffer_bytes} bytes: view {view} has not {count} lights").into());
            }
        }
        let least = of_views.into_iter().min().unwrap_or(0);
        let expected = [(IssueReason::LightLimit, 40 - least, least, None)];
        expect_scene_issues(&found.scene_issues, &expected[..usize::from(least < 40)])?;
        expect_pictures(&frames.frame(scene.as_scene_ref())?, &found)?;
    }
    Ok(())
}

fn layers(device: Device) -> Result<(), Failed> {
    // A lamp with six maps, and lamps without.
    let mut lights: Vec<_> = (0..20).map(lamp).collect();
    if let Light::Point { casts_shadow, .. } = &mut lights[0] {
        *casts_shadow = true;
    }
    let scene = lit_by(lights.clone());
    let options = Options { shadows: true, limits: binding(20 * LIGHT), ..Options::default() };
    let mut frames = renderer(device, options)?;
    let expected = lit_by(lights[..14].to_vec());
    let scene_issues = expect_same(&mut *frames, device, options, [scene.as_scene_ref(), expected.as_scene_ref()])?;
    expect_scene_issues(&scene_issues, &[(IssueReason::LightLimit, 6, 14, None)])
}

fn changing(device: Device) -> Result<(), Failed> {
    let options = Options { limits: binding(16 * LIGHT), ..Options::default() };
    let mut frames = renderer(device, options)?;
    for count in [3, 16, 40, 17, 2, 25] {
        let lights = |count: usize| lit_by((0..count).map(lamp).collect());
        let (scene, expected) = (lights(count), lights(count.min(16)));
        let pictures = [scene.as_scene_ref(), expected.as_scene_ref()];
        let scene_issues = expect_same(&mut *frames, device, options, pictures)?;
        let expected = [(IssueReason::LightLimit, count.saturating_sub(16), 16, None)];
        expect_scene_issues(&scene_issues, &expected[..usize::from(count > 16)])?;
    }
    Ok(())
}
