//! Shadow maps that are drawn once every few frames.

use drawloom::backend::Picture;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::{Quality, ShadowQuality};
use drawloom::scene::{Camera, Light, Scene, SceneError};
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;
use crate::image_distance::{assert_alike, assert_different};
use crate::shadows::{hemisphere, lamp, spot, sun};

pub const CASES: &[Case] = &[
    ("cached_shadow_maps_equal_new_ones_while_nothing_moves", nothing_moves),
    ("the_shadow_of_a_moved_object_lags_and_catches_up", moved_casters),
    ("a_moved_light_lags_together_with_its_shadow", moved_light),
    ("shadows_stay_in_the_world_when_the_camera_moves", moved_camera),
    ("another_main_camera_does_not_change_when_maps_are_drawn", another_camera),
    ("a_dropped_frame_loses_no_shadow_map", dropped),
    ("no_old_shadow_remains_when_lights_or_views_are_added_or_removed", other_lists),
];

/// A fixture whose shadow maps are drawn every `interval` frames.
fn fixture_every(interval: u32) -> Result<Fixture, Failed> {
    let quality = Quality::balanced();
    let quality = Quality { shadows: ShadowQuality { interval, side: 512, ..quality.shadows }, ..quality };
    Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture()).quality(quality))
}

fn lights() -> Vec<Light> {
    let down = DVec3::new(0.2, -0.9, -0.3).normalize();
    let mut lights = vec![
        sun(down),
        spot(DVec3::new(0.0, 6.0, 12.0), down, 60.0),
        hemisphere(DVec3::new(-3.0, 5.0, 10.0), down),
        lamp(DVec3::new(3.0, 4.0, 10.0)),
    ];
    for light in &mut lights[1..] {
        if let Light::Point { range, .. } | Light::Spot { range, .. } | Light::Hemispherical { range, .. } = light {
            *range = 40.0;
        }
    }
    lights
}

fn scene() -> Scene {
    let mut scene = field(300);
    scene.lights = lights();
    scene
}

/// Moves all objects.
fn shift(scene: &mut Scene, by: DVec3) -> Result<(), SceneError> {
    for handle in scene.objects().collect::<Vec<_>>() {
        let mut object = scene.object(handle)?;
        object.position += by;
        scene.replace_object(handle, object)?;
    }
    Ok(())
}

fn nothing_moves() -> Result<(), Failed> {
    let scene = scene();
    let expected = fixture_every(1)?.draw(&scene)?;
    let mut unlit = field(300);
    unlit.lights.clear();
    assert_different(&expected, &fixture_every(1)?.draw(&unlit)?)?;
    for interval in [2, 3] {
        let mut fixture = fixture_every(interval)?;
        for frame in 0..5 {
            if fixture.draw(&scene)? != expected {
                return Err(format!("frame {frame} of {interval}").into());
            }
        }
    }
    Ok(())
}

fn moved_casters() -> Result<(), Failed> {
    let mut scene = scene();
    let mut fixture = fixture_every(3)?;
    fixture.draw(&scene)?;
    shift(&mut scene, DVec3::new(0.5, 0.0, 0.8))?;
    let expected = fixture_every(1)?.draw(&scene)?;
    // Each frame draws the map of one light.
    let late = [fixture.draw(&scene)?, fixture.draw(&scene)?];
    if late[0] == late[1] || late.contains(&expected) {
        return Err("the shadows do not catch up one by one".into());
    }
    if fixture.draw(&scene)? == expected { Ok(()) } else { Err("the shadows do not catch up".into()) }
}

fn moved_light() -> Result<(), Failed> {
    for index in 0..4 {
        let mut scene = field(300);
        scene.lights = vec![lights()[index]];
        let mut fixture = fixture_every(2)?;
        let before = fixture.draw(&scene)?;
        match &mut scene.lights[0] {
            Light::Point { position, .. } | Light::Spot { position, .. } | Light::Hemispherical { position, .. } => {
                position.x += 1.0
            }
            Light::Directional { direction, .. } => *direction = Vec3::new(0.5, -0.8, 0.1).normalize(),
            other => return Err(format!("{other:?}").into()),
        }
        let expected = fixture_every(1)?.draw(&scene)?;
        assert_different(&before, &expected)?;
        if fixture.draw(&scene)? != before {
            return Err(format!("light {index} moved without its map").into());
        }
        if fixture.draw(&scene)? != expected {
            return Err(format!("light {index} does not catch up").into());
        }
    }
    Ok(())
}

fn moved_camera() -> Result<(), Failed> {
    let mut scene = scene();
    let mut fixture = fixture_every(2)?;
    fixture.draw(&scene)?;
    for camera in &mut scene.cameras {
        camera.position += DVec3::new(2.0, 0.5, -3.0);
    }
    // The sun's new map has its pixels at other positions.
    assert_alike(&fixture.draw(&scene)?, &fixture_every(1)?.draw(&scene)?)
}

/// Objects move, and the second camera stands still or leaps.
fn another_camera() -> Result<(), Failed> {
    let frames = |leap: f64| -> Result<Vec<Picture>, Failed> {
        let mut scene = scene();
        scene.cameras.truncate(1);
        let second = Camera { name: "second".to_owned(), ..scene.cameras[0].clone() };
        scene.cameras.push(Camera { near: 0.5, ..second });
        let mut fixture = fixture_every(3)?;
        (0..7)
            .map(|_| {
                shift(&mut scene, DVec3::new(0.1, 0.0, 0.2))?;
                scene.cameras[1].position.x += leap;
                fixture.draw(&scene)
            })
            .collect()
    };
    let expected = frames(0.0)?;
    for leap in [3.0, 70.0, 1e5] {
        if let Some(frame) = frames(leap)?.iter().zip(&expected).position(|(found, expected)| found != expected) {
            return Err(format!("frame {frame} differs when the second camera leaps {leap} m").into());
        }
    }
    Ok(())
}

fn dropped() -> Result<(), Failed> {
    let mut scene = scene();
    let mut fixture = fixture_every(2)?;
    fixture.draw(&scene)?;
    fixture.draw(&scene)?;
    shift(&mut scene, DVec3::new(0.5, 0.0, 0.8))?;
    drop(fixture.record(&scene)?);
    let expected = fixture_every(1)?.draw(&scene)?;
    if fixture.draw(&scene)? == expected { Ok(()) } else { Err("the dropped frame's maps are missing".into()) }
}

fn other_lists() -> Result<(), Failed> {
    let mut fixture = fixture_every(100)?;
    let mut scene = scene();
    let changes: [&dyn Fn(&mut Scene); 6] = [
        &|_| {},
        &|scene| _ = scene.lights.remove(0),
        &|scene| scene.lights = lights(),
        &|scene| _ = scene.cameras.pop(),
        &|scene| scene.lights.extend(lights()),
        &|scene| scene.lights.truncate(1),
    ];
    for (step, change) in changes.into_iter().enumerate() {
        change(&mut scene);
        let expected = fixture_every(1)?.draw(&scene)?;
        for frame in 0..2 {
            // The sun's new map would have its pixels at other positions, as it covers what the cameras see.
            assert_alike(&fixture.draw(&scene)?, &expected)
                .map_err(|error| format!("frame {frame} of step {step}: {error:?}"))?;
        }
    }
    Ok(())
}
