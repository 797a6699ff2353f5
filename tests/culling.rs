//! No visible object is culled, with any culling volume: the cases of `benches/benches/culling/main.rs`, and frames.

use std::error::Error;
use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::NullBackend;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::{CullingVolume, Quality};
use drawloom::scene::{Camera, Material, Mesh, RenderObject, Scene, Topology, Vertex};
use drawloom::task::Scheduler;
use drawloom::view::{Frustum, ObjectTable};
use drawloom_testing::culling::boxes::{BoxTallies, Shapes, VOLUMES};
use drawloom_testing::culling::tally::Tallies;
use drawloom_testing::culling::{boxes, spheres};

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
    let builder = Renderer::builder(NullBackend).deferred(Deferred::to_picture());
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
        assert_eq!(table.block(0).boxes.is_some(), VOLUMES[1..].contains(&volume), "{volume:?}");
    }
    Ok(())
}
