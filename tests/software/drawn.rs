//! Pictures of the software backend.

use std::collections::HashSet;

use drawloom::Granularity;
use drawloom::backend::Picture;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{Deferred, Format};
use drawloom::scene::{Camera, Light, Material, Projection, RenderObject, Scene, Topology};
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::{cube, field, sized, square};

use crate::{Fixture, deferred, pixel};

/// A square of 2 m, 5 m in front of the camera, that emits this radiance and reflects nothing.
fn lit_square(radiance: Vec3) -> Scene {
    let mut scene = Scene::new();
    let mesh = scene.add(square(Topology::TriangleStrip)).unwrap();
    let material = Material { diffuse: Vec3::ZERO, emission: radiance, ..Material::default() };
    let material = scene.add(material).unwrap();
    scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO)).unwrap();
    scene.background = Vec3::new(0.0, 0.25, 0.5);
    let camera = Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO);
    let projection = Projection::Orthographic { height: 4.0 };
    scene.cameras = vec![sized(Camera { projection, far: 10.0, ..camera }, [80, 40])];
    scene
}

#[test]
fn a_square_covers_its_pixels_and_the_background_the_others() {
    let scene = lit_square(Vec3::new(1.0, 0.5, 0.25));
    for mut fixture in [Fixture::with_granularity(2, Granularity::Adaptive), Fixture::reference()] {
        let submission = fixture.draw(&scene);
        let radiance = submission.numbers(0, "radiance").unwrap();
        // 2 of 4 m in 40 rows, and as many columns in the middle of 80: half floats hold these numbers exactly.
        for (index, found) in radiance.iter().enumerate() {
            let (x, y) = (index % 80, index / 80);
            let is_inside = (30..50).contains(&x) && (10..30).contains(&y);
            let expected = if is_inside { [1.0, 0.5, 0.25, 1.0] } else { [0.0, 0.25, 0.5, 1.0] };
            assert_eq!(*found, expected, "({x}, {y})");
        }
        let depth = submission.numbers(0, "depth").unwrap();
        let expected = (10.0 - 5.0) / (10.0 - 0.05);
        assert!((depth[20 * 80 + 40][0] - expected).abs() < 1e-6 && depth[0][0] == 0.0, "{:?}", depth[20 * 80 + 40]);
    }
}

#[test]
fn nearer_objects_hide_farther_ones_in_either_order() {
    for turned in [false, true] {
        let mut scene = lit_square(Vec3::X);
        let near = scene.add(Material { diffuse: Vec3::ZERO, emission: Vec3::Y, ..Material::default() }).unwrap();
        let mesh = scene.add(square(Topology::TriangleList)).unwrap();
        let position = if turned { DVec3::NEG_Z } else { DVec3::Z };
        scene.add_object(RenderObject::new(mesh, near, position)).unwrap();
        let radiance = Fixture::with_granularity(1, Granularity::Adaptive).draw(&scene).numbers(0, "radiance").unwrap();
        let expected = if turned { [1.0, 0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0, 1.0] };
        assert_eq!(radiance[20 * 80 + 40], expected);
    }
}

#[test]
fn an_empty_scene_is_its_background() {
    let mut scene = field(0);
    scene.lights.clear();
    let picture = Fixture::with_granularity(2, Granularity::Adaptive).picture(&scene);
    let first = pixel(&picture, 0, 0);
    assert!(first[2] > first[0] && (0..180).all(|y| (0..320).all(|x| pixel(&picture, x, y) == first)), "{first:?}");
}

#[test]
fn each_of_many_views_draws_what_it_draws_alone() {
    let mut scene = field(150);
    let sizes = [[64, 64], [65, 30], [1, 1], [200, 3], [96, 54]];
    let base = scene.cameras[0].clone();
    scene.cameras = sizes.into_iter().map(|size| sized(base.clone(), size)).collect();
    for (index, camera) in scene.cameras.iter_mut().enumerate() {
        (camera.name, camera.position.x) = (format!("view {index}"), index as f64 - 2.0);
    }
    let together = Fixture::with_granularity(2, Granularity::Adaptive).draw(&scene);
    for (view, camera) in scene.cameras.clone().into_iter().enumerate() {
        let mut alone = field(150);
        alone.cameras = vec![camera];
        let expected = Fixture::with_granularity(2, Granularity::Adaptive).picture(&alone);
        assert!(together.read(view, "picture").unwrap() == expected, "{view}");
    }
}

#[test]
fn a_depth_pre_pass_changes_nothing() {
    let scene = everything();
    let mut with = Fixture::new(2, |builder| builder.pipeline(deferred().depth_pre_pass(true)));
    assert!(with.picture(&scene) == Fixture::with_granularity(2, Granularity::Adaptive).picture(&scene));
}

#[test]
fn splitting_the_geometry_buffer_changes_nothing() {
    let scene = everything();
    let mut shared = Fixture::new(2, |builder| builder.pipeline(deferred().geometry_shares(3)));
    assert!(shared.picture(&scene) == Fixture::with_granularity(2, Granularity::Adaptive).picture(&scene));
}

/// Rounding may move a lookup across a shadow map's texel, so a few pixels on a shadow's edge differ.
#[test]
fn the_reference_draws_the_same_picture() {
    for scene in [everything(), field(120)] {
        let single = Fixture::with_granularity(2, Granularity::Adaptive).picture(&scene);
        let double = Fixture::reference().picture(&scene);
        assert_eq!((double.format, double.bytes.len()), (Format::Rgba8Srgb, single.bytes.len()));
        let share = share_within(&single, &double, 3);
        assert!(share >= 0.99, "{share}");
        let rmse = rmse(&single, &double);
        assert!(rmse <= 2.0, "{rmse}");
        let colors: HashSet<_> = single.bytes.chunks_exact(4).collect();
        assert!(colors.len() > 500, "a picture of {} colours shows little", colors.len());
    }
}

/// The root mean square difference, 0 to 255.
fn rmse(one: &Picture, other: &Picture) -> f64 {
    let squares = one.bytes.iter().zip(&other.bytes).map(|(one, other)| f64::from(one.abs_diff(*other)).powi(2));
    (squares.sum::<f64>() / one.bytes.len() as f64).sqrt()
}

fn share_within(one: &Picture, other: &Picture, bound: u8) -> f64 {
    let pixels = one.bytes.chunks_exact(4).zip(other.bytes.chunks_exact(4));
    let is_near =
        |(one, other): &(&[u8], &[u8])| one.iter().zip(*other).all(|(one, other)| one.abs_diff(*other) <= bound);
    pixels.filter(is_near).count() as f64 / (one.bytes.len() / 4) as f64
}

/// Each tile of the picture is touched by the light's sphere from at least one of the positions.
#[test]
fn the_bounds_of_a_light_contain_all_that_it_reaches() {
    let mut scene = Scene::new();
    let mesh = scene.add(cube()).unwrap();
    let material = scene.add(Material::default()).unwrap();
    let floor = RenderObject { scale: Vec3::new(30.0, 0.1, 30.0), ..RenderObject::new(mesh, material, DVec3::NEG_Y) };
    scene.add_object(floor).unwrap();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::new(0.0, 4.0, 12.0), DVec3::ZERO), [150, 100])];
    let light = |position| Light::Point { position, intensity: Vec3::splat(20.0), range: 3.0, casts_shadow: false };
    let mut fixture = Fixture::new(2, |builder| builder.pipeline(Deferred::to_picture()));
    for position in [[0.0, 0.5, 0.0], [-9.0, 0.5, -6.0], [1.0, 4.0, 12.5], [0.0, 2.0, 9.0], [7.0, 1.0, 4.0]] {
        scene.lights = vec![light(DVec3::from(position))];
        let submission = fixture.draw(&scene);
        let depth = submission.numbers(0, "depth").unwrap();
        let radiance = submission.numbers(0, "radiance").unwrap();
        let camera = &scene.cameras[0];
        let tangent = (60_f64.to_radians() * 0.5).tan();
        for (index, (depth, radiance)) in depth.iter().zip(&radiance).enumerate() {
            let (x, y) = ((index % 150) as f64 + 0.5, (index / 150) as f64 + 0.5);
            let ray = DVec3::new((x / 75.0 - 1.0) * tangent * 1.5, (1.0 - y / 50.0) * tangent, -1.0);
            let surface = camera.position + camera.orientation.as_dquat() * ray * (0.05 / depth[0]);
            // Well inside of the sphere, above the floor, pixels are lit; outside none is.
            let distance = surface.distance(DVec3::from(position));
            if depth[0] > 0.0 && distance < 2.7 && surface.y > -0.95 {
                assert!(radiance[0] > 1e-4, "{position:?}: {surface} at {distance} is dark");
            } else if depth[0] == 0.0 || distance > 3.01 {
                assert_eq!(radiance[0], 0.0, "{position:?}: {surface} at {distance}");
            }
        }
    }
}

/// Every light reads its own shadow maps: the radiance of all is the sum of what each adds alone, where its maps are
/// the first.
#[test]
fn lights_with_shadows_add_up() {
    let mut scene = Scene::new();
    let mesh = scene.add(cube()).unwrap();
    let material = scene.add(Material::default()).unwrap();
    for (position, scale) in [(DVec3::NEG_Y, Vec3::new(8.0, 0.1, 8.0)), (DVec3::Y * 0.5, Vec3::new(1.2, 0.3, 0.8))] {
        scene.add_object(RenderObject { scale, ..RenderObject::new(mesh, material, position) }).unwrap();
    }
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::new(1.0, 4.0, 5.0), DVec3::ZERO), [48, 32])];
    let (intensity, range, casts_shadow) = (Vec3::new(20.0, 15.0, 10.0), 12.0, true);
    let spot = |position: DVec3| {
        let direction = -position.as_vec3().normalize();
        Light::Spot { position, direction, intensity, range, inner_angle: 0.5, outer_angle: 0.7, casts_shadow }
    };
    let lights = [
        spot(DVec3::new(-3.0, 3.0, 1.0)),
        Light::Directional { direction: Vec3::new(0.48, -0.8, -0.36), illuminance: Vec3::ONE, casts_shadow },
        Light::Point { position: DVec3::new(0.5, 3.0, -1.0), intensity, range, casts_shadow },
        spot(DVec3::new(2.0, 3.5, 1.5)),
    ];
    for mut fixture in [Fixture::with_granularity(2, Granularity::Adaptive), Fixture::reference()] {
        let mut radiance = |lights: &[Light]| {
            scene.lights = lights.to_vec();
            fixture.draw(&scene).numbers(0, "radiance").unwrap()
        };
        let together = radiance(&lights);
        let alone = lights.map(|light| radiance(&[light]));
        for (index, found) in together.iter().enumerate() {
            for channel in 0..3 {
                let sum: f64 = alone.iter().map(|light| light[index][channel]).sum();
                // Half floats, rounded once for each light, alone and together.
                let rounding = 2.0 * lights.len() as f64 * (sum * 0.5_f64.powi(11) + 0.5_f64.powi(25));
                assert!((found[channel] - sum).abs() <= rounding, "pixel {index}: {found:?}, and the sum is {sum}");
            }
        }
        // Each light has a shadow, and no two have the same.
        let shadows = [0, 1, 2, 3].map(|light| {
            let bare = radiance(&[without_shadow(lights[light])]);
            (0..bare.len()).filter(|&pixel| alone[light][pixel][0] < bare[pixel][0]).collect::<HashSet<_>>()
        });
        assert!(shadows.iter().all(|shadow| shadow.len() > 10), "{:?}", shadows.each_ref().map(HashSet::len));
        assert!((0..4).all(|light| !shadows[..light].contains(&shadows[light])), "{shadows:?}");
    }
}

/// The same light, which casts no shadow.
fn without_shadow(mut light: Light) -> Light {
    if let Light::Directional { casts_shadow, .. }
    | Light::Point { casts_shadow, .. }
    | Light::Spot { casts_shadow, .. }
    | Light::Hemispherical { casts_shadow, .. } = &mut light
    {
        *casts_shadow = false;
    }
    light
}
