//! Which objects and meshes a backend has to upload.

use std::collections::HashSet;

use drawloom::glam::{DQuat, DVec3};
use drawloom::handle::Handle;
use drawloom::scene::{Assets, Changes, Material, Mesh, RenderObject, Scene, SceneRef};
use drawloom::view::IssueReason;
use drawloom::view::internal::ObjectTable;
use drawloom_testing::changing_world::ChangingWorld;
use drawloom_testing::random::Random;
use drawloom_testing::scenes::{cube, field};
use proptest::prelude::*;

/// The first object of each run, and the one after its last.
fn runs(table: &ObjectTable, epoch: u64, gap: usize) -> Vec<(usize, usize)> {
    let mut runs = Vec::new();
    table.for_each_change(0..table.block_count(), epoch, gap, |run| runs.push((run.start, run.end)));
    runs
}

#[test]
fn a_table_has_as_many_objects_as_the_latest_scene() {
    let mut table = ObjectTable::default();
    assert!(table.is_empty());
    for objects in [603, 1, 0] {
        table.update(&field(objects).as_scene_ref());
        assert_eq!((table.len(), table.is_empty()), (objects, objects == 0));
    }
}

#[test]
fn the_first_rejected_object_is_named_by_its_number_in_the_scene() {
    let scene = field(603);
    let scene = scene.as_scene_ref();
    let mut positions = scene.positions.to_vec();
    for object in [300, 301, 600] {
        positions[object] = DVec3::NAN;
    }
    let mut table = ObjectTable::default();
    table.update(&SceneRef { positions: &positions, ..scene });
    let [issue] = &table.scene_issues().list()[..] else { panic!("{:?}", table.scene_issues().list()) };
    assert_eq!((issue.reason, issue.count, issue.first), (IssueReason::InvalidTransform, 3, 300));
}

#[test]
fn objects_that_become_valid_are_rejected_no_more() {
    let scene = field(16);
    let scene = scene.as_scene_ref();
    let mut positions = scene.positions.to_vec();
    positions[3] = DVec3::NAN;
    let mut table = ObjectTable::default();
    table.update(&SceneRef { positions: &positions, ..scene });
    assert_eq!(table.scene_issues().list().len(), 1);
    // Its packet changes as a whole.
    draw(&mut table, &SceneRef { changes: Changes::Ranges(std::slice::from_ref(&(0..16))), ..scene });
    assert_eq!(table.scene_issues().list(), []);
}

#[test]
fn bins_are_removed_if_most_of_many_are_of_meshes_that_are_gone() {
    let mut scene = Scene::new();
    let material = scene.add(Material::default()).unwrap();
    let add = |scene: &mut Scene| {
        let mesh = scene.add(cube()).unwrap();
        (scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO)).unwrap(), mesh)
    };
    let mut objects: Vec<_> = (0..100).map(|_| add(&mut scene)).collect();
    let mut table = ObjectTable::default();
    table.update(&scene.as_scene_ref());
    assert_eq!(table.bins().len(), 100);
    for (object, mesh) in objects.split_off(3) {
        scene.remove_object(object).unwrap();
        scene.remove(mesh).unwrap();
    }
    table.update(&scene.as_scene_ref());
    assert_eq!(table.bins().len(), 3);
    add(&mut scene);
    table.update(&scene.as_scene_ref());
    assert_eq!(table.bins().len(), 4);
}

/// An engine's orientations may drift by a thousandth.
#[test]
fn orientations_are_normalized() {
    let scene = field(80);
    let scene = scene.as_scene_ref();
    let mut random = Random::stream(3);
    let orientations: Vec<_> = (0..80)
        .map(|_| {
            let turn = DQuat::from_axis_angle(random.direction(), random.between(-3.0, 3.0));
            let drifted = turn * random.between(0.9992, 1.0008);
            (turn, drifted.as_quat())
        })
        .collect();
    let drifted: Vec<_> = orientations.iter().map(|(_, drifted)| *drifted).collect();
    let mut table = ObjectTable::default();
    table.update(&SceneRef { orientations: &drifted, ..scene });
    let block = table.block(0);
    for (object, (turn, _)) in orientations.into_iter().enumerate() {
        let found = DQuat::from_array(block.gpu_objects[object].orientation.map(f64::from));
        assert!((found - turn).length() < 2e-7, "{found} {turn}");
    }
}

#[test]
fn neighbours_that_changed_are_one_run() {
    let scene = field(603);
    let mut table = ObjectTable::default();
    table.update(&scene.as_scene_ref());
    assert_eq!(runs(&table, 0, 1), [(0, 603)]);

    let before = table.epoch();
    draw(&mut table, &SceneRef { changes: Changes::Objects(&[3, 300, 301, 310, 602]), ..scene.as_scene_ref() });
    assert_eq!(runs(&table, before, 1), [(3, 4), (300, 302), (310, 311), (602, 603)], "one by one");
    assert_eq!(runs(&table, before, 291), [(3, 4), (300, 311), (602, 603)]);
    assert_eq!(runs(&table, before, 297), [(3, 603)]);
    assert_eq!(runs(&table, 0, 1), [(0, 603)]);
    assert_eq!(runs(&table, table.epoch(), 1), []);

    draw(&mut table, &SceneRef { changes: Changes::Objects(&[20]), ..scene.as_scene_ref() });
    assert_eq!(runs(&table, before, 1), [(0, 8), (16, 24), (296, 312), (600, 603)], "whole packets");
    assert_eq!(runs(&table, before, 288), [(0, 312), (600, 603)]);
    assert_eq!(runs(&table, before, 289), [(0, 603)]);
    assert_eq!(runs(&table, before + 1, 1), [(20, 21)]);
    let mut second_block = Vec::new();
    table.for_each_change(1..2, before, 1, |run| second_block.push(run));
    assert_eq!(second_block.first(), Some(&(296..312)));
    assert_eq!(second_block.len(), 1);

    draw(&mut table, &SceneRef { changes: Changes::NONE, ..scene.as_scene_ref() });
    assert_eq!(runs(&table, before + 1, 1), [(16, 24)], "changes of an earlier frame");
}

#[test]
fn what_changed_before_a_frame_without_changes_is_not_lost() {
    let scene = field(603);
    let mut table = ObjectTable::default();
    table.update(&scene.as_scene_ref());
    draw(&mut table, &SceneRef { changes: Changes::NONE, ..scene.as_scene_ref() });
    assert_eq!(runs(&table, 0, 1), [(0, 603)]);
}

/// The used ones among these assets' meshes.
fn used_meshes(table: &ObjectTable, assets: &Assets) -> HashSet<Handle<Mesh>> {
    assets.iter().map(|(mesh, _)| mesh).filter(|mesh| table.used_meshes().contains(*mesh)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_used_meshes_are_those_that_an_object_has_had(seed in any::<u64>(), count in 0_usize..300) {
        let mut world = ChangingWorld::new(seed, count);
        let mut table = ObjectTable::default();
        let mut had = HashSet::new();
        for step in 0..40 {
            let scene = world.as_scene_ref();
            if step % 10 == 3 {
                // A frame that fails early does not look at the objects, and the next one is not told of their changes
                // again.
                table.invalidate();
            } else {
                let (before, revision) = (used_meshes(&table, scene.assets), table.used_meshes().revision());
                if step % 10 == 6 {
                    table.begin_frame(&scene);
                    table.invalidate();
                } else {
                    draw(&mut table, &scene);
                }
                had.extend(scene.meshes.iter().copied());
                let live: HashSet<_> = scene.assets.iter().map(|(mesh, _)| mesh).collect();
                let found = used_meshes(&table, scene.assets);
                prop_assert_eq!(&found, &had.intersection(&live).copied().collect(), "in step {}", step);
                prop_assert_eq!(table.used_meshes().revision() > revision, found != before, "in step {}", step);
                prop_assert!(!had.difference(&live).any(|mesh| table.used_meshes().contains(*mesh)), "in step {}", step);
            }
            world.step().unwrap();
        }
    }
}

/// All objects are new, so masks of 64 are full, but for the last one.
#[test]
fn a_mesh_of_one_object_far_behind_in_the_scene_is_used() {
    let mut scene = field(300);
    let objects: Vec<_> = scene.objects().collect();
    for number in [100, 299] {
        let mesh = scene.add(cube()).unwrap();
        let now = RenderObject { mesh, ..scene.object(objects[number]).unwrap() };
        scene.replace_object(objects[number], now).unwrap();
    }
    let mut table = ObjectTable::default();
    table.update(&scene.as_scene_ref());
    assert_eq!(used_meshes(&table, scene.assets()).len(), 3 + 2);
}

#[test]
fn scenes_of_several_assets_use_their_own_meshes() {
    let mut table = ObjectTable::default();
    let (two, all) = (field(2), field(20));
    for _ in 0..2 {
        for (scene, expected) in [(&two, 2), (&all, 3)] {
            draw(&mut table, &scene.as_scene_ref());
            assert_eq!(used_meshes(&table, scene.assets()).len(), expected);
        }
        assert!(used_meshes(&table, two.assets()).is_empty());
    }
}

#[test]
fn bins_without_objects_are_given_up() {
    let mut scene = field(3);
    let mut table = ObjectTable::default();
    let of_field = scene.as_scene_ref().meshes.to_vec();
    let meshes: Vec<_> = (0..100).map(|_| scene.add(cube()).unwrap()).collect();
    let drawn_in_turn: Vec<_> = meshes.iter().map(|mesh| [*mesh, of_field[1], of_field[2]]).collect();
    for meshes in &drawn_in_turn {
        draw(&mut table, &SceneRef { meshes, changes: Changes::Objects(&[0]), ..scene.as_scene_ref() });
    }
    assert_eq!(table.bins().len(), 102);

    meshes[..99].iter().for_each(|mesh| drop(scene.remove(*mesh).unwrap()));
    let last = SceneRef { meshes: &drawn_in_turn[99], changes: Changes::NONE, ..scene.as_scene_ref() };
    draw(&mut table, &last);
    assert_eq!(table.bins().len(), 3);
    let mut new = ObjectTable::default();
    draw(&mut new, &last);
    let bin = |table: &ObjectTable, object: usize| table.bins().get(table.block(0).bins[object]);
    for object in 0..3 {
        assert_eq!(bin(&table, object), bin(&new, object));
    }
}

/// Describes what changed in a frame.
fn draw(table: &mut ObjectTable, scene: &SceneRef<'_>) {
    table.begin_frame(scene);
    table.describe(scene, 0..table.changed_block_count());
    table.finish();
    table.end_frame();
}
