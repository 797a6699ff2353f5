//! Extreme numbers: no panic, and no visible object is culled.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::quality::Quality;
use drawloom::scene::{Camera, Material, Projection, RenderObject, Scene};
use drawloom_testing::samples::Samples;
use drawloom_testing::scenes::{cube, sized};

use crate::occlusion;

/// A large cube in front of small ones, all scaled by `size` and moved by `shift`.
fn scene(size: f64, shift: DVec3, change: impl Fn(&mut Camera)) -> Scene {
    let mut scene = Scene::new();
    let (mesh, material) = (scene.add(cube()).unwrap(), scene.add(Material::default()).unwrap());
    for index in 0..60 {
        let (x, y) = (f64::from(index % 8) - 3.5, f64::from(index / 8) - 3.5);
        let (position, scale) = if index == 0 {
            (DVec3::new(0.0, 0.0, -10.0), 3.0)
        } else {
            (DVec3::new(x * 1.7, y * 1.7, -16.0 - f64::from(index % 5)), 0.3)
        };
        let object = RenderObject::new(mesh, material, shift + position * size);
        let orientation = Quat::from_rotation_y(index as f32);
        scene.add_object(RenderObject { scale: Vec3::splat((scale * size) as f32), orientation, ..object }).unwrap();
    }
    let mut camera = sized(Camera::looking_at("main", shift, shift + DVec3::NEG_Z), [96, 64]);
    camera.near = ((0.05 * size) as f32).max(f32::MIN_POSITIVE);
    change(&mut camera);
    scene.cameras = vec![camera];
    scene
}

/// Checks that no visible object is culled, and returns the number of culled objects, summed over all tile sizes.
fn check(scene: &Scene, case: &str) -> usize {
    let scene = scene.as_scene_ref();
    let samples = Samples::new(&scene, &scene.cameras[0], 0.25, |_| true);
    let mut count = 0;
    for tile_size in Quality::OCCLUSION_TILE_SIZES {
        let (_, hidden) = occlusion(&scene, tile_size);
        for (object, (hidden, shown)) in hidden.into_iter().zip(&samples.shown).enumerate() {
            assert!(!(hidden && *shown), "{case}: {object} at {tile_size}");
            count += usize::from(hidden);
        }
    }
    count
}

#[test]
fn far_origins_and_large_and_small_worlds_cull_the_same() {
    let usual = check(&scene(1.0, DVec3::ZERO, |_| {}), "usual");
    assert!(usual > 50, "{usual}");
    for distance in [1e3, -1e6, 1e9] {
        let count = check(&scene(1.0, DVec3::new(distance, -distance, distance), |_| {}), "far origin");
        assert!(count.abs_diff(usual) <= 2, "{count} at {distance}, and {usual} without");
    }
    for size in [1e-3, 1e7] {
        let count = check(&scene(size, DVec3::ZERO, |_| {}), "size");
        assert!(count.abs_diff(usual) <= 2, "{count} at {size}, and {usual} at 1");
    }
    // Below the resolution of positions, and near their limit.
    for size in [1e-20, 1e-9, 1e8] {
        check(&scene(size, DVec3::ZERO, |_| {}), "size");
    }
}

#[test]
fn cameras_of_every_kind_cull_no_visible_object() {
    for degrees in [0.1_f32, 1.0, 90.0, 170.0, 179.0] {
        let projection = Projection::Perspective { field_of_view: degrees.to_radians() };
        check(&scene(1.0, DVec3::ZERO, |camera| camera.projection = projection), "field of view");
    }
    for size in [[1, 1], [1, 300], [300, 1], [97, 3]] {
        check(&scene(1.0, DVec3::ZERO, |camera| camera.size = size), "size of the picture");
    }
    for near in [1e-30, 1e-5, 6.9, 7.1, 12.0, 50.0, 1e9] {
        check(&scene(1.0, DVec3::ZERO, |camera| camera.near = near), "near plane");
    }
    for (near, far) in [(0.05, 1e9), (6.0, 6.001), (1e-3, 15.0), (0.05, 12.0)] {
        let change = |camera: &mut Camera| {
            camera.projection = Projection::Orthographic { height: 12.0 };
            (camera.near, camera.far) = (near, far);
        };
        check(&scene(1.0, DVec3::ZERO, change), "orthographic");
    }
}

#[test]
fn very_small_and_very_large_scales_cull_no_visible_object() {
    for scale in [
        Vec3::ZERO,
        Vec3::new(0.0, 3.0, 3.0),
        Vec3::splat(-3.0),
        Vec3::new(3.0, 1e-20, 3.0),
        Vec3::new(f32::MIN_POSITIVE / 8.0, 3.0, 3.0),
        Vec3::new(1e20, 3.0, 1e-20),
        Vec3::splat(1e30),
        Vec3::new(1e6, 1.0, 1.0),
    ] {
        let mut scene = scene(1.0, DVec3::ZERO, |_| {});
        let handles: Vec<_> = scene.objects().collect();
        for &handle in &handles[..2] {
            let object = scene.object(handle).unwrap();
            scene.replace_object(handle, RenderObject { scale, ..object }).unwrap();
        }
        check(&scene, "scale");
    }
}

#[test]
fn an_empty_scene_culls_nothing() {
    let mut scene = Scene::new();
    scene.cameras = vec![Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z)];
    assert_eq!(check(&scene, "empty"), 0);
}
