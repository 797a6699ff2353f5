//! Lights and shadows at the limits of the number formats.

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Camera, Light, Material, RenderObject, Scene, Topology};
use drawloom::view::IssueReason;
use drawloom_testing::scenes::{sized, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, draw, pixel};
use crate::image_distance::assert_color;

pub const CASES: &[Case] = &[
    ("a_black_surface_stays_black_in_any_light", black),
    ("a_shade_close_to_a_bright_lamp_casts_its_shadow", shade),
    ("edges_too_long_for_a_paraboloid_are_counted_once_per_object", coarse),
    ("edges_too_long_because_shorter_ones_take_too_many_triangles_are_counted", too_many_triangles),
];

/// A wall of 2 m at the origin that faces +Z, and a camera 5 m in front of it.
fn wall(diffuse: f32) -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO), [31, 31])];
    let material = scene.add(Material { diffuse: Vec3::splat(diffuse), double_sided: true, ..Material::default() })?;
    let mesh = scene.add(square(Topology::TriangleList))?;
    scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO))?;
    Ok(scene)
}

fn lamp(height: f64, intensity: f32, casts_shadow: bool) -> Light {
    let intensity = Vec3::splat(intensity);
    let range = Light::range_for(intensity);
    Light::Hemispherical { position: DVec3::Z * height, direction: Vec3::NEG_Z, intensity, range, casts_shadow }
}

fn black() -> Result<(), Failed> {
    for intensity in [1.0, 1e30, 3e38] {
        for casts_shadow in [false, true] {
            let mut scene = wall(0.0)?;
            let point = Light::Point {
                position: DVec3::Z * 0.25,
                intensity: Vec3::splat(intensity),
                range: 10.0,
                casts_shadow: false,
            };
            let sun = Light::Directional { direction: Vec3::NEG_Z, illuminance: Vec3::splat(intensity), casts_shadow };
            scene.lights = vec![lamp(0.25, intensity, casts_shadow), point, sun];
            assert_color(pixel(&draw(&scene)?, 15, 15), [0; 3])?;
        }
    }
    Ok(())
}

fn shade() -> Result<(), Failed> {
    for intensity in [1.0, 30.0, 400.0] {
        let mut scene = wall(0.5)?;
        scene.lights = vec![lamp(1.0, intensity, true)];
        let (mesh, material) = (scene.as_scene_ref().meshes[0], scene.as_scene_ref().materials[0]);
        let object = RenderObject::new(mesh, material, DVec3::Z * 0.92);
        // At 8 cm from the lamp, its 10 cm hide more than a metre around the wall's centre; the camera sees past it.
        scene.add_object(RenderObject { scale: Vec3::splat(0.05), ..object })?;
        scene.cameras = vec![sized(Camera::looking_at("main", DVec3::new(2.0, 0.0, 3.0), DVec3::ZERO), [31, 31])];
        assert_color(pixel(&draw(&scene)?, 15, 15), [0; 3])
            .map_err(|failed| Failed::from(format!("{intensity}: {}", failed.message().unwrap_or(""))))?;
    }
    Ok(())
}

fn coarse() -> Result<(), Failed> {
    let mut scene = wall(0.5)?;
    let (mesh, material) = (scene.as_scene_ref().meshes[0], scene.as_scene_ref().materials[0]);
    let object = RenderObject::new(mesh, material, DVec3::NEG_Z * 9.0);
    scene.add_object(RenderObject { scale: Vec3::splat(1e4), ..object })?;
    scene.lights = vec![lamp(1.0, 5.0, true), lamp(2.0, 5.0, true)];
    expect_coarse(&scene, 1)
}

/// A wall of 8,192 triangles at 10 cm from a lamp: their edges, of 4.4 cm, are halved three times, which takes 2¹⁹
/// triangles.
fn too_many_triangles() -> Result<(), Failed> {
    let mut scene = wall(0.5)?;
    let mesh = scene.as_scene_ref().meshes[0];
    scene.replace(mesh, square(Topology::TriangleList).subdivided(0.05, 10_000))?;
    scene.lights = vec![lamp(0.1, 5.0, true)];
    expect_coarse(&scene, 0)
}

/// Draws two frames, each of which counts this object as coarse, and no other.
fn expect_coarse(scene: &Scene, object: usize) -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    for _ in 0..2 {
        let recorded = fixture.record(scene)?;
        let scene_issues = recorded.statistics().scene_issues.iter();
        let counts: Vec<_> = scene_issues.map(|issue| (issue.reason, issue.count, issue.first)).collect();
        if counts != [(IssueReason::CoarseEdges, 1, object)] {
            return Err(format!("{counts:?}").into());
        }
        fixture.submit(recorded)?;
    }
    Ok(())
}
