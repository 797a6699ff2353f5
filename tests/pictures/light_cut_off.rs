//! Lights that end at a range beyond which they are negligible.

use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::{Quality, ShadowQuality};
use drawloom::scene::{Light, Scene};
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, radiance};
use crate::rays::{Panel, PanelScene};
use crate::shadows::{MAPS, camera, hemisphere, spot};

pub const CASES: &[Case] = &[
    ("a_cut_off_removes_at_most_the_documented_illuminance", bound),
    ("a_cut_off_removes_little_from_a_light_that_brightens_while_its_map_is_kept", brightening),
    ("a_cut_off_shortens_the_reach_of_lights", reach),
];

fn with_cut_off(light_cut_off: f32) -> Result<Fixture, Failed> {
    let quality = Quality { light_cut_off, ..Quality::balanced() };
    Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture()).quality(quality))
}

fn radiance_of(fixture: &mut Fixture, scene: &Scene) -> Result<Vec<[f64; 3]>, Failed> {
    let recorded = fixture.record(scene)?;
    radiance(&fixture.submit(recorded)?, 0)
}

/// The field in lights of each kind with falloff, which reach far beyond it.
fn scene() -> Scene {
    let mut scene = field(300);
    let down = DVec3::new(0.2, -0.9, -0.3).normalize();
    let position = DVec3::new(0.0, 6.0, 12.0);
    let point = Light::Point {
        position: DVec3::new(0.0, 3.0, -5.0),
        intensity: Vec3::new(30.0, 10.0, 5.0),
        range: 1e3,
        casts_shadow: false,
    };
    scene.lights = vec![point, spot(position, down, 60.0), hemisphere(DVec3::new(-3.0, 5.0, 10.0), down)];
    for light in &mut scene.lights {
        if let Light::Spot { range, .. } | Light::Hemispherical { range, .. } = light {
            *range = 1e3;
        }
    }
    scene
}

/// A white floor below a light, at heights around the one where the window subtracts the most: (2/3)^¼ of the range.
fn bound() -> Result<(), Failed> {
    let (cut_off, end) = (0.125_f32, 3.0_f64);
    let (mut whole, mut ending) = (with_cut_off(0.0)?, with_cut_off(cut_off)?);
    let bound = 1.089 * f64::from(cut_off) / std::f64::consts::PI;
    for kind in 0..3 {
        let mut worst = 0.0_f64;
        for share in [0.3, 0.6, 0.8, 0.85, 0.9036, 0.95, 1.0, 1.2, 2.0] {
            let mut light = scene().lights[kind];
            if let Light::Point { position, intensity, .. }
            | Light::Spot { position, intensity, .. }
            | Light::Hemispherical { position, intensity, .. } = &mut light
            {
                (*position, *intensity) = (DVec3::Y * end * share, Vec3::splat(cut_off * (end * end) as f32));
            }
            if let Light::Spot { direction, .. } | Light::Hemispherical { direction, .. } = &mut light {
                *direction = Vec3::NEG_Y;
            }
            let floor = Panel::facing(DVec3::ZERO, DVec3::Y, 2.0);
            let panel_scene = PanelScene { panels: vec![floor], lights: vec![light], maps: MAPS };
            let scene = panel_scene.scene(&[camera(DVec3::new(0.5, 2.0, 1.0), DVec3::ZERO, 60.0)])?;
            let (expected, found) = (radiance_of(&mut whole, &scene)?, radiance_of(&mut ending, &scene)?);
            for (expected, found) in expected.iter().flatten().zip(found.iter().flatten()) {
                // Both are half floats.
                let rounding = 2.0 * 2_f64.powi(-11) * expected;
                if (expected - found).abs() > bound + rounding {
                    return Err(format!("{found} for {expected} at {share} of where light {kind} ends").into());
                }
                worst = worst.max(expected - found);
            }
        }
        // The bound is tight.
        if worst < 0.95 * bound {
            return Err(format!("{worst} of {bound} in light {kind}").into());
        }
    }
    Ok(())
}

/// A white floor below a light that becomes brighter after its map was drawn.
fn brightening() -> Result<(), Failed> {
    let cut_off = 0.125_f32;
    let kept = |light_cut_off| {
        let shadows = ShadowQuality { interval: 1000, ..Quality::balanced().shadows };
        let quality = Quality { light_cut_off, shadows, ..Quality::balanced() };
        Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture()).quality(quality))
    };
    // 1.125² times the bound of a light that does not change.
    let bound = 1.089 * 1.125 * 1.125 * f64::from(cut_off) / std::f64::consts::PI;
    for (kind, growth) in [(0, 1.2), (0, 1.3), (1, 1.25), (1, 4.0), (2, 100.0)] {
        for share in [0.6, 0.9, 1.0, 1.1, 1.5] {
            let end = 3.0;
            let mut light = scene().lights[kind];
            let mut set = |factor: f32| {
                if let Light::Point { position, intensity, casts_shadow, .. }
                | Light::Spot { position, intensity, casts_shadow, .. }
                | Light::Hemispherical { position, intensity, casts_shadow, .. } = &mut light
                {
                    (*position, *casts_shadow) = (DVec3::Y * end * share, true);
                    *intensity = Vec3::splat(factor * cut_off * (end * end) as f32);
                }
                if let Light::Spot { direction, .. } | Light::Hemispherical { direction, .. } = &mut light {
                    *direction = Vec3::NEG_Y;
                }
                let floor = Panel::facing(DVec3::ZERO, DVec3::Y, 2.0);
                let panel_scene = PanelScene { panels: vec![floor], lights: vec![light], maps: MAPS };
                panel_scene.scene(&[camera(DVec3::new(0.5, 2.0, 1.0), DVec3::ZERO, 60.0)])
            };
            let (before, after) = (set(1.0)?, set(growth)?);
            let mut ending = kept(cut_off)?;
            radiance_of(&mut ending, &before)?;
            let (expected, found) = (radiance_of(&mut kept(0.0)?, &after)?, radiance_of(&mut ending, &after)?);
            for (expected, found) in expected.iter().flatten().zip(found.iter().flatten()) {
                // Both are half floats.
                let rounding = 2.0 * 2_f64.powi(-11) * expected;
                if (expected - found).abs() > bound + rounding {
                    let context = format!("light {kind}, {growth} times as bright, at {share} of where it ended");
                    return Err(format!("{found} for {expected}: {context}").into());
                }
            }
        }
    }
    Ok(())
}

fn reach() -> Result<(), Failed> {
    let mut scene = scene();
    for light in &mut scene.lights {
        if let Light::Point { position, .. } | Light::Spot { position, .. } | Light::Hemispherical { position, .. } =
            light
        {
            position.z += 100.0;
        }
    }
    for (cut_off, lights) in [(0.0, 3), (1e-4, 3), (0.5, 0)] {
        let recorded = with_cut_off(cut_off)?.record(&scene)?;
        let (found, views) = (recorded.statistics().views[0].lights, recorded.statistics().views.len());
        // A light that reaches no view needs no map.
        if (found, views) != (lights, if lights == 0 { 2 } else { 4 }) {
            return Err(format!("{found} lights in one of {views} views, cut off at {cut_off}").into());
        }
    }
    Ok(())
}
