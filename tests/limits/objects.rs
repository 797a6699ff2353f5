//! Objects beyond the capacity of a buffer.

use drawloom::scene::{Changes, ObjectSet, Scene, SceneRef, StaticGroup, ViewFilter};
use drawloom::view::{IssueReason, SceneIssue};
use drawloom_testing::changing_world::ChangingWorld;
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Device, Options, Process, binding, expect_same, expect_scene_issues, renderer, small};
use crate::wide_tints::{STRIDE, TINTS};

pub const CASES: &[Case] = &[
    ("objects_beyond_a_buffer_are_left_out", Device::ALL, beyond_a_buffer),
    ("objects_that_change_beyond_a_buffer_are_left_out_until_they_fit", Device::ALL, changing),
    ("static_groups_and_filters_may_list_objects_beyond_a_buffer", Device::DRAWING, static_groups_and_filters),
    ("a_column_that_is_read_decides_how_many_objects_there_are", Device::DRAWING, columns),
];

/// The scene without the objects from `count` on.
pub fn first_objects(scene: SceneRef<'_>, count: usize) -> SceneRef<'_> {
    let count = count.min(scene.object_count());
    SceneRef {
        positions: &scene.positions[..count],
        orientations: &scene.orientations[..count],
        scales: &scene.scales[..count],
        bounds: &scene.bounds[..count],
        meshes: &scene.meshes[..count],
        materials: &scene.materials[..count],
        layers: scene.layers.get(..count).unwrap_or_default(),
        changes: Changes::Unknown,
        ..scene
    }
}

const OBJECTS: usize = 600;

fn beyond_a_buffer(device: Device) -> Result<(), Failed> {
    let scene = small(field(OBJECTS));
    let scene = scene.as_scene_ref();
    // Around the borders of packets, words, blocks and pages, and of all objects.
    for capacity in [7, 63, 65, 256, 257, 512, 599, 600, 601] {
        // Not a multiple of an object's 64 bytes, as limits of devices are not either.
        let options = Options { limits: binding(capacity * 64 + 63), ..Options::default() };
        let mut frames = renderer(device, options)?;
        let expected = first_objects(scene, capacity);
        let scene_issues = expect_same(&mut *frames, device, options, [scene, expected])?;
        expect_object_limit(&scene_issues, scene, capacity).map_err(|failed| format!("{capacity}: {failed:?}"))?;
    }
    Ok(())
}

/// # Errors
/// If the objects from `capacity` on are not those that are left out.
fn expect_object_limit(found: &[SceneIssue], scene: SceneRef<'_>, capacity: usize) -> Result<(), Failed> {
    let beyond = scene.object_count().saturating_sub(capacity);
    let found: Vec<_> = found.iter().filter(|issue| issue.reason == IssueReason::ObjectLimit).cloned().collect();
    let name = scene.meshes.get(capacity).and_then(|mesh| scene.assets.get(*mesh).ok()).map(|mesh| mesh.name());
    let expected = [(IssueReason::ObjectLimit, beyond, capacity, name)];
    expect_scene_issues(&found, &expected[..usize::from(beyond > 0)])
}

fn changing(device: Device) -> Result<(), Failed> {
    const CAPACITY: usize = 300;
    let options = Options { limits: binding(CAPACITY * 64), ..Options::default() };
    for seed in 0..2 {
        let mut world = ChangingWorld::new(seed, CAPACITY + 40);
        for camera in &mut world.scene.cameras {
            camera.size = [64, 36];
        }
        let mut frames = renderer(device, options)?;
        let mut most = 0;
        for step in 0..12 {
            let scene = world.as_scene_ref();
            most = most.max(scene.object_count());
            let scene_issues = expect_same(&mut *frames, device, options, [scene, first_objects(scene, CAPACITY)])
                .map_err(|failed| format!("seed {seed}, step {step}: {failed:?}"))?;
            expect_object_limit(&scene_issues, scene, CAPACITY)?;
            world.step()?;
        }
        if most <= CAPACITY {
            return Err(format!("all of {most} objects have room").into());
        }
    }
    Ok(())
}

fn static_groups_and_filters(device: Device) -> Result<(), Failed> {
    const CAPACITY: usize = 100;
    let options = Options { limits: binding(CAPACITY * 64), ..Options::default() };
    let with_sets = |last: u32| {
        let mut scene = small(field(150));
        let static_group = |name, objects: std::ops::Range<u32>| {
            StaticGroup::new(name, ObjectSet::new(objects.filter(|object| *object < last)))
        };
        scene.static_groups =
            vec![static_group("within", 5..40), static_group("across", 90..120), static_group("beyond", 120..160)];
        scene.cameras[1].filter = ViewFilter::except(ObjectSet::new((80..130).chain([700]).filter(|at| *at < last)));
        scene
    };
    let (scene, reduced) = (with_sets(u32::MAX), with_sets(CAPACITY as u32));
    let mut frames = renderer(device, options)?;
    // Static groups are recorded in the second frame, and executed from the third on.
    for frame in 0..4 {
        let changes = if frame == 0 { Changes::Unknown } else { Changes::NONE };
        let scene = SceneRef { changes, ..scene.as_scene_ref() };
        let expected = first_objects(reduced.as_scene_ref(), CAPACITY);
        let scene_issues = expect_same(&mut *frames, device, options, [scene, expected])?;
        let square = Some("square");
        let name = scene.assets.get(scene.meshes[CAPACITY]).ok().map(|mesh| mesh.name()).or(square);
        // What the scene has is not unknown because it is beyond.
        let expected = [(IssueReason::ObjectLimit, 50, CAPACITY, name), (IssueReason::UnknownObject, 11, 150, None)];
        expect_scene_issues(&scene_issues, &expected)?;
    }
    Ok(())
}

/// A field of which every fifth object is blended, if `is_blended`.
fn partly_blended(count: usize, is_blended: bool) -> (Scene, Vec<drawloom::handle::Handle<drawloom::scene::Material>>) {
    let scene = small(field(count));
    let opaque = scene.as_scene_ref().materials[0];
    let blended = scene.as_scene_ref().materials[2];
    let material = |object: usize| if is_blended && object % 5 == 2 { blended } else { opaque };
    let materials = (0..count).map(material).collect();
    (scene, materials)
}

fn columns(device: Device) -> Result<(), Failed> {
    // 200 objects have room, and 80 of their wide tints.
    let options = Options { limits: binding(200 * 64), process: Process::WideTransparency, ..Options::default() };
    let capacity = 200 * 64 / STRIDE;
    let tints: Vec<_> = (0..150).map(|object| [[object as f32 / 150.0, 0.5, 0.25, 0.5]; 10]).collect();
    let mut frames = renderer(device, options)?;
    for is_blended in [false, true, true, false, true] {
        let (scene, materials) = partly_blended(tints.len(), is_blended);
        let columns = [TINTS.values(&tints)];
        let scene = SceneRef { materials: &materials, columns: &columns, ..scene.as_scene_ref() };
        let room = if is_blended { capacity } else { tints.len() };
        let some = [TINTS.values(&tints[..room])];
        let expected = SceneRef { columns: &some, ..first_objects(scene, room) };
        let scene_issues = expect_same(&mut *frames, device, options, [scene, expected])
            .map_err(|failed| format!("blended: {is_blended}: {failed:?}"))?;
        expect_object_limit(&scene_issues, scene, room)?;
    }
    Ok(())
}
