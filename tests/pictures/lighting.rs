//! Lights have the brightness that their documentation defines.

use std::f64::consts::PI;

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Camera, Light, Material, RenderObject, Scene, Topology};
use drawloom_testing::scenes::{sized, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{draw, pixel};
use crate::image_distance::{assert_color, tone_mapped};

pub const CASES: &[Case] = &[
    ("a_directional_light_depends_on_its_angle", directional),
    ("a_point_light_falls_off_with_the_square_of_the_distance", point),
    ("a_spot_light_ends_at_its_cone", spot),
    ("a_hemispherical_light_falls_off_with_the_cosine", hemispherical),
    ("ambient_light_and_emission_add_up", ambient_and_emission),
    ("the_background_fills_the_rest_of_the_picture", background),
    ("an_invalid_light_lights_nothing", invalid_light),
];

const DIFFUSE: f64 = 0.5;

/// The colour at the centre of a wall of 2 m at the origin, which faces +Z, in one light, from 5 m away.
fn middle_of_wall(light: Option<Light>, change: impl FnOnce(&mut Scene)) -> Result<[u8; 3], Failed> {
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO), [91, 91])];
    let material = scene.add(Material { diffuse: Vec3::splat(DIFFUSE as f32), ..Material::default() })?;
    let wall = scene.add(square(Topology::TriangleList))?;
    scene.add_object(RenderObject::new(wall, material, DVec3::ZERO))?;
    scene.lights.extend(light);
    change(&mut scene);
    Ok(pixel(&draw(&scene)?, 45, 45))
}

fn expect(light: Light, illuminance: [f64; 3]) -> Result<(), Failed> {
    // The diffuse target holds a byte, sRGB encoded; 188 is the nearest to one half, and decodes to this.
    let diffuse = ((188.0 / 255.0 + 0.055) / 1.055_f64).powf(2.4);
    let expected = tone_mapped(illuminance.map(|illuminance| illuminance * diffuse / PI));
    assert_color(middle_of_wall(Some(light), |_| {})?, expected)
        .map_err(|failed| format!("{light:?}: {}", failed.message().unwrap_or("")).into())
}

fn directional() -> Result<(), Failed> {
    for degrees in [0.0_f32, 30.0, 60.0, 80.0, 90.0, 120.0] {
        let angle = degrees.to_radians();
        let light = Light::Directional {
            direction: Vec3::new(angle.sin(), 0.0, -angle.cos()),
            illuminance: Vec3::new(3.0, 2.0, 1.0),
            casts_shadow: false,
        };
        let facing = f64::from(angle.cos()).max(0.0);
        expect(light, [3.0 * facing, 2.0 * facing, facing])?;
    }
    Ok(())
}

fn windowed(distance: f64, range: f64) -> f64 {
    let window = 1.0 - (distance / range).powi(4);
    window * window / (distance * distance)
}

fn point() -> Result<(), Failed> {
    for distance in [0.5, 1.0, 2.0, 4.0, 7.9, 8.1] {
        let light = Light::Point {
            position: DVec3::Z * distance,
            intensity: Vec3::new(4.0, 2.0, 1.0),
            range: 8.0,
            casts_shadow: false,
        };
        let share = if distance < 8.0 { windowed(distance, 8.0) } else { 0.0 };
        expect(light, [4.0 * share, 2.0 * share, share])?;
    }
    Ok(())
}

fn spot() -> Result<(), Failed> {
    let share = windowed(2.0, 20.0);
    for (angle, lit) in [(0.0, 1.0), (0.2, 1.0), (0.35, 0.5), (0.45, 0.0), (3.0, 0.0)] {
        // The axis is turned away from the wall's centre by this angle.
        let (inner, outer) = (0.3_f32, 0.4_f32);
        let light = Light::Spot {
            position: DVec3::Z * 2.0,
            direction: Vec3::new((angle as f32).sin(), 0.0, -(angle as f32).cos()),
            intensity: Vec3::splat(6.0),
            range: 20.0,
            inner_angle: inner,
            outer_angle: outer,
            casts_shadow: false,
        };
        let fade = if lit == 0.5 {
            let along = f64::from((angle as f32).cos());
            let step = (along - f64::from(outer.cos())) / f64::from(inner.cos() - outer.cos());
            step * step * (3.0 - 2.0 * step)
        } else {
            lit
        };
        expect(light, [6.0 * share * fade; 3])?;
    }
    Ok(())
}

fn hemispherical() -> Result<(), Failed> {
    let share = windowed(2.0, 20.0);
    for degrees in [0.0_f32, 40.0, 85.0, 95.0, 180.0] {
        let angle = degrees.to_radians();
        let light = Light::Hemispherical {
            position: DVec3::Z * 2.0,
            direction: Vec3::new(0.0, angle.sin(), -angle.cos()),
            intensity: Vec3::splat(8.0),
            range: 20.0,
            casts_shadow: false,
        };
        expect(light, [8.0 * share * f64::from(angle.cos()).max(0.0); 3])?;
    }
    Ok(())
}

fn ambient_and_emission() -> Result<(), Failed> {
    let found = middle_of_wall(None, |scene| {
        scene.ambient = Vec3::new(0.4, 0.2, 0.0);
        let material = scene.as_scene_ref().materials[0];
        let mut glowing = scene.assets().get(material).expect("it was just added").clone();
        glowing.emission = Vec3::new(0.0, 0.1, 0.3);
        scene.replace(material, glowing).expect("it is valid");
    })?;
    let diffuse = ((188.0 / 255.0 + 0.055) / 1.055_f64).powf(2.4);
    assert_color(found, tone_mapped([0.4 * diffuse, 0.2 * diffuse + 0.1, 0.3]))
}

fn invalid_light() -> Result<(), Failed> {
    let without = middle_of_wall(None, |scene| scene.ambient = Vec3::splat(0.2))?;
    for intensity in [f32::INFINITY, -5.0] {
        let light =
            Light::Point { position: DVec3::Z, intensity: Vec3::splat(intensity), range: 5.0, casts_shadow: false };
        assert_color(middle_of_wall(Some(light), |scene| scene.ambient = Vec3::splat(0.2))?, without)?;
    }
    Ok(())
}

fn background() -> Result<(), Failed> {
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::ZERO, DVec3::X), [16, 16])];
    scene.background = Vec3::new(0.1, 0.3, 0.7);
    scene.lights =
        vec![Light::Directional { direction: Vec3::NEG_Y, illuminance: Vec3::splat(5.0), casts_shadow: false }];
    assert_color(pixel(&draw(&scene)?, 8, 8), tone_mapped([0.1, 0.3, 0.7]))
}
