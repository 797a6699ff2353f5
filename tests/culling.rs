//! No visible object is culled, with any culling volume: the cases of `benches/benches/culling/main.rs`, and frames.

use std::error::Error;
use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::NullBackend;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::{CullingVolume, Quality};
use drawloom::scene::{
    Camera, ClipPlane, Light, Material, Mesh, Projection, RenderObject, Scene, Topology, Vertex, ViewKind,
};
use drawloom::task::Scheduler;
use drawloom::view::RenderView;
use drawloom::view::internal::{Frustum, LightTable, ObjectTable};
use drawloom_testing::culling::boxes::{BoxTallies, Shapes, VOLUMES};
use drawloom_testing::culling::cameras::{any_camera, magnitude};
use drawloom_testing::culling::oracle::{Classification, Oracle};
use drawloom_testing::culling::tally::Tallies;
use drawloom_testing::culling::{boxes, spheres};
use drawloom_testing::random::Random;

/// The maximum share of invisible volumes at random positions that tests may find visible.
const MAX_FALSE_VISIBLE_SHARE: f64 = 1e-3;

/// Checks that nothing visible is culled, that few invisible volumes are kept, and that the cases include enough
/// invisible ones.
fn check(what: &str, tallies: &Tallies) {
    assert_eq!(tallies.false_culls(), 0, "{what}: of {} cases", tallies.cases());
    let share = tallies.anywhere.false_share();
    assert!(share <= MAX_FALSE_VISIBLE_SHARE, "{what}: {share} of {:?}", tallies.anywhere);
    for tally in [tallies.tangent, tallies.anywhere] {
        assert!(tally.outside > tally.cases / 10, "{what}: {tally:?}");
    }
}

#[test]
fn no_visible_sphere_is_culled() {
    let tallies = spheres::try_batches(0..2_000);
    check("sphere", &tallies.drawloom);
    // The cases are hard: the common method fails one in ten.
    assert!(tallies.naive.tangent.false_culls > tallies.naive.tangent.cases / 20, "{:?}", tallies.naive);
}

#[test]
fn no_visible_object_is_culled_by_its_volume() -> Result<(), Box<dyn Error>> {
    let BoxTallies { volumes, rejected } = boxes::try_batches(&Shapes::new()?, 0..400);
    assert_eq!(rejected, 0);
    for (volume, tallies) in VOLUMES.iter().zip(&volumes) {
        check(&format!("{volume:?}"), tallies);
    }
    Ok(())
}

/// Lights whose reach ends 3% of it inside the picture, and lights whose reach ends 3% outside.
#[test]
fn a_light_is_kept_if_and_only_if_it_reaches_the_picture() {
    let (mut reaching, mut outside) = (0, 0);
    for batch in 0..400 {
        let mut random = Random::stream(batch);
        let camera = any_camera(&mut random);
        if camera.kind == ViewKind::Shadow {
            continue;
        }
        let (oracle, view) = (Oracle::new(&camera), RenderView::new(&camera));
        let lights: Vec<_> = (0..60)
            .map(|index| {
                let range = magnitude(&mut random, -2.0, 6.0);
                let share = if random.below(3) == 0 { 1.03 } else { 0.97 };
                let (planes, along) = (spheres::any_planes(&mut random), spheres::any_along(&mut random));
                let center = oracle.touching(planes, [range * share; 6], along, spheres::any_aside(&mut random));
                light(index, oracle.world(center), random.direction().as_vec3().normalize(), range as f32)
            })
            .collect();
        let mut table = LightTable::default();
        table.fill(&view, &lights, std::slice::from_ref(&view), false);
        let kept: Vec<_> = table.sources().map(|(light, _)| light).collect();
        for (index, light) in lights.iter().enumerate() {
            let (center, range) = light.bounding_sphere().expect("it has a range");
            let (center, radius) = (oracle.relative(center), f64::from(range));
            if oracle.classify(center, [radius; 6], radius) == Classification::Inside {
                reaching += 1;
                assert!(kept.contains(&index), "{light:?} reaches what {camera:?} sees");
            } else if is_outside_beyond_tolerance(&oracle, center, radius) {
                outside += 1;
                assert!(!kept.contains(&index), "{light:?} reaches nothing that {camera:?} sees");
            }
        }
    }
    assert!(
        reaching > 5_000 && outside > 3_000,
        "{reaching} lights reach a picture, and {outside} are outside of it beyond the tolerance"
    );
}

/// Whether a sphere is so far outside of a plane that a test in f32 must cull it. [`Frustum::intersects_sphere`] widens
/// spheres and planes by 16 · 2⁻²⁴ of the centre's ‖·‖₁, the radius and the plane's distance from the camera. Its
/// rounding errors are smaller than that, so twice as much suffices here. That holds for cameras without a shift, as
/// here. Others have shorter normals.
fn is_outside_beyond_tolerance(oracle: &Oracle, center: DVec3, radius: f64) -> bool {
    let tolerance = |offset: f64| 32.0 / f64::from(1 << 24) * (center.abs().element_sum() + radius + offset.abs());
    let planes = oracle.depths(center).into_iter().zip(oracle.depths(DVec3::ZERO));
    planes.into_iter().any(|(depth, offset)| depth + radius < -tolerance(offset))
}

/// A light of one of the kinds that have a range.
fn light(index: usize, position: DVec3, direction: Vec3, range: f32) -> Light {
    let (intensity, casts_shadow) = (Vec3::ONE, false);
    match index % 3 {
        0 => Light::Point { position, intensity, range, casts_shadow },
        1 => Light::Hemispherical { position, direction, intensity, range, casts_shadow },
        _ => {
            let (inner_angle, outer_angle) = (0.2, 0.9);
            Light::Spot { position, direction, intensity, range, inner_angle, outer_angle, casts_shadow }
        }
    }
}

/// Poles 3 m outside the frustum, whose bounding spheres intersect it. One is vertical, as is its box. One is parallel
/// to the frustum's side, so its axis-aligned box intersects the frustum, and its oriented box does not.
#[test]
fn frames_draw_objects_whose_volume_is_visible() -> Result<(), Box<dyn Error>> {
    let mut scene = Scene::new();
    let half = Vec3::new(0.1, 0.1, 10.0);
    let vertices = [-1.0, 1.0, 1.0].map(|sign| Vertex { position: (half * sign).to_array(), ..Vertex::default() });
    let pole = scene.add(Mesh::new("pole", Topology::TriangleList, vertices.into(), vec![0, 1, 2])?)?;
    let paint = scene.add(Material::default())?;
    // The camera looks along −z, and at a depth of 10 m the picture ends 10.3 m to the right, at 45.7°.
    let outside = RenderObject::new(pole, paint, DVec3::new(14.5, 0.0, -10.0));
    for orientation in [Quat::from_rotation_x(90_f32.to_radians()), Quat::from_rotation_y(-45.7_f32.to_radians())] {
        scene.add_object(RenderObject { orientation, ..outside })?;
    }
    // One visible, and one far behind the camera.
    scene.add_object(RenderObject::new(pole, paint, DVec3::new(0.0, 0.0, -10.0)))?;
    scene.add_object(RenderObject::new(pole, paint, DVec3::new(0.0, 0.0, 100.0)))?;
    scene.cameras.push(Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z));

    let scheduler = Arc::new(Scheduler::new(1)?);
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture());
    let (mut renderer, submitter) = builder.build(scheduler)?;
    let mut visible = |volume| -> Result<usize, Box<dyn Error>> {
        renderer.set_quality(Quality { culling: volume, ..Quality::balanced() })?;
        let submitted = submitter.submit(renderer.record(scene.as_scene_ref())?)?;
        Ok(submitted.statistics.views[0].visible)
    };
    for _ in 0..2 {
        let counts = [CullingVolume::None, CullingVolume::Sphere, CullingVolume::Box, CullingVolume::OrientedBox];
        assert_eq!(counts.map(|volume| visible(volume).ok()), [4, 3, 2, 1].map(Some));
    }
    Ok(())
}

/// An engine's own bounds replace the mesh's for every volume, and an object with invalid bounds is never visible.
#[test]
fn an_engines_bounds_take_precedence() -> Result<(), Box<dyn Error>> {
    let mut scene = Scene::new();
    let vertices = [0.0, 0.1, 0.1].map(|size| Vertex { position: [size; 3], ..Vertex::default() });
    let tiny = scene.add(Mesh::new("tiny", Topology::TriangleList, vertices.into(), vec![0, 1, 2])?)?;
    let paint = scene.add(Material::default())?;
    // Behind the camera: visible only with bounds that say that a shader moves its vertices by up to 9 m.
    for _ in 0..3 {
        scene.add_object(RenderObject::new(tiny, paint, DVec3::new(0.0, 0.0, 5.0)))?;
    }
    let scene_ref = scene.as_scene_ref();
    let mut bounds = scene_ref.bounds.to_vec();
    bounds[1].radius = 9.0;
    bounds[2].radius = f32::NAN;
    let scene_ref = drawloom::scene::SceneRef { bounds: &bounds, ..scene_ref };
    let frustum = Frustum::new(&Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z));
    let away = Frustum::new(&Camera::looking_at("away", DVec3::Z * 100.0, DVec3::Z * 200.0));
    for (volume, visible) in [
        (CullingVolume::None, 0b011),
        (CullingVolume::Sphere, 0b010),
        (CullingVolume::Box, 0b010),
        (CullingVolume::OrientedBox, 0b010),
    ] {
        let mut table = ObjectTable::default();
        table.configure(volume);
        table.update(&scene_ref);
        assert_eq!(table.block(0).visible(&frustum, volume, 0..3), visible, "{volume:?}");
        // All are behind the other camera.
        let visible_from_away = if volume == CullingVolume::None { visible } else { 0 };
        for (frustum, visible) in [(&frustum, visible), (&away, visible_from_away)] {
            let mut words = Vec::new();
            table.block(0).visible_words(frustum, volume, 0..2, |word, mask| words.push((word, mask)));
            assert_eq!(words, [(0, visible), (1, 0)], "{volume:?}");
        }
        assert_eq!(table.block(0).boxes.is_some(), VOLUMES[1..].contains(&volume), "{volume:?}");
    }
    Ok(())
}

/// Few objects are tested one by one, and more in groups.
#[test]
fn a_range_has_the_visible_objects_of_its_parts() -> Result<(), Box<dyn Error>> {
    let mut random = Random::stream(7);
    let mut scene = Scene::new();
    let vertices = [Vec3::ZERO, Vec3::new(0.3, 3.0, 0.1), Vec3::new(0.1, 0.2, 1.0)]
        .map(|position| Vertex { position: position.into(), ..Vertex::default() });
    let mesh = scene.add(Mesh::new("long", Topology::TriangleList, vertices.into(), vec![0, 1, 2])?)?;
    let paint = scene.add(Material::default())?;
    for _ in 0..256 {
        let [x, y, z] = [0; 3].map(|_| random.between(-4.0, 4.0));
        scene.add_object(RenderObject::new(mesh, paint, DVec3::new(x, y, z)))?;
    }
    let frustum = Frustum::new(&Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO));
    for volume in [CullingVolume::None, CullingVolume::Sphere, CullingVolume::Box, CullingVolume::OrientedBox] {
        let mut table = ObjectTable::default();
        table.configure(volume);
        table.update(&scene.as_scene_ref());
        let block = table.block(0);
        let (mut found, mut tested) = (0, 0);
        for _ in 0..400 {
            let first = random.below(256);
            let last = first + random.below(64 - first % 64);
            let visible = block.visible(&frustum, volume, first..last + 1);
            for object in first..=last {
                let alone = block.visible(&frustum, volume, object..object + 1);
                assert_eq!(visible >> (object - first) & 1, alone, "{volume:?}: object {object} of {first} to {last}");
                (found, tested) = (found + alone, tested + 1);
            }
            assert_eq!(visible.checked_shr((last + 1 - first) as u32).unwrap_or(0), 0);
        }
        assert_eq!(volume == CullingVolume::None, found == tested);
        assert!(found > tested / 20, "{volume:?}: {found} of {tested}");
    }
    Ok(())
}

#[test]
fn what_is_between_a_clip_plane_and_the_near_plane_is_seen() {
    let clip_plane = Some(ClipPlane { point: DVec3::NEG_Z * 0.5, normal: Vec3::NEG_Z });
    let camera = Camera { near: 1.0, ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z) };
    let clipped = Camera { clip_plane, ..camera.clone() };
    let flat = Camera { projection: Projection::Orthographic { height: 2.0 }, ..camera.clone() };
    for (depth, by_near_plane, by_clip_plane) in [(0.7, false, true), (1.5, true, true), (-0.7, false, false)] {
        let sees = |camera| Frustum::new(camera).intersects_sphere(DVec3::NEG_Z * depth, 0.05);
        let found = [&camera, &flat, &clipped].map(sees);
        assert_eq!(found, [by_near_plane, by_near_plane, by_clip_plane], "{depth}");
    }
}
