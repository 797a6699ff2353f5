//! Draw lists do not depend on the number of workers and the granularity.

use std::collections::BTreeSet;
use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::backend::internal::NullPass;
use drawloom::command::DrawList;
use drawloom::command::internal::Splitters;
use drawloom::glam::DVec3;
use drawloom::process::Deferred;
use drawloom::scene::{Blend, Projection, Scene};
use drawloom::task::Scheduler;
use drawloom::{FrameStatistics, Granularity, Renderer};
use drawloom_testing::demo;
use drawloom_testing::scenes::field;

use crate::renderer;

const GRANULARITIES: [Granularity; 7] = [
    Granularity::Adaptive,
    Granularity::PerCamera,
    Granularity::PerDraw,
    Granularity::Chunk(7),
    Granularity::Chunk(64),
    Granularity::Chunk(300),
    Granularity::Chunk(usize::MAX),
];

fn drawn(scene: &Scene, workers: usize, granularity: Granularity) -> (Vec<DrawList>, Vec<NullPass>, FrameStatistics) {
    let (mut renderer, submitter) = renderer(workers, granularity);
    // The second frame reuses the first one's tables.
    let mut result = None;
    for _ in 0..2 {
        let recorded = renderer.record(scene.as_scene_ref()).unwrap();
        let lists = (0..scene.cameras.len()).map(|view| renderer.draw_list("geometry buffer", view).unwrap().clone());
        let lists = lists.collect();
        let submitted = submitter.submit(recorded).unwrap();
        result = Some((lists, submitted.submission.passes, submitted.statistics));
    }
    let (lists, mut passes, mut statistics) = result.unwrap();
    // The granularity decides how many draws are in a bundle.
    passes.iter_mut().for_each(|pass| pass.bundles = 0);
    statistics.views.iter_mut().for_each(|view| view.bundles = 0);
    (lists, passes, statistics)
}

fn assert_same_for_all(scene: &Scene) {
    let (lists, passes, statistics) = drawn(scene, 1, Granularity::PerCamera);
    assert!(lists.iter().all(|list| !list.objects.is_empty()));
    for workers in [1, 2, 4] {
        for granularity in GRANULARITIES {
            let (other_lists, other_passes, other_statistics) = drawn(scene, workers, granularity);
            assert!(other_lists == lists, "commands or batches differ with {workers} workers, {granularity:?}");
            assert_eq!(other_passes, passes, "{workers} workers, {granularity:?}");
            assert_eq!(other_statistics.views, statistics.views, "{workers} workers, {granularity:?}");
        }
    }
}

#[test]
fn a_field_of_boxes_has_the_same_draw_lists() {
    assert_same_for_all(&field(3000));
}

#[test]
fn a_view_sorted_in_several_buckets_has_the_same_draw_lists() {
    let mut scene = field(1500);
    scene.cameras.truncate(1);
    scene.duplicate_objects(40);
    let (lists, passes, _) = drawn(&scene, 1, Granularity::PerCamera);
    assert!(lists[0].objects.len() > 8 * Splitters::MIN_COMMANDS_PER_BUCKET, "{}", lists[0].objects.len());
    assert!(lists[0].commands().is_sorted_by(|one, next| (one.key, one.object) < (next.key, next.object)));
    let batches = lists[0].batches.windows(2);
    assert!(batches.into_iter().all(|pair| (pair[0].mesh, pair[0].state) != (pair[1].mesh, pair[1].state)));
    for workers in [2, 4] {
        for granularity in [Granularity::Chunk(300), Granularity::Chunk(9000), Granularity::Adaptive] {
            let (other_lists, other_passes, _) = drawn(&scene, workers, granularity);
            assert!(other_lists == lists, "{workers} workers, {granularity:?}");
            assert_eq!(other_passes, passes, "{workers} workers, {granularity:?}");
        }
    }
}

#[test]
fn without_instancing_each_object_is_a_batch_of_its_own() {
    let scene = field(1000);
    let (lists, ..) = drawn(&scene, 2, Granularity::default());
    let scheduler = Arc::new(Scheduler::new(2).unwrap());
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).instancing(false);
    let (mut renderer, submitter) = builder.build(scheduler).unwrap();
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    for (view, list) in lists.iter().enumerate() {
        let separate = renderer.draw_list("geometry buffer", view).unwrap();
        assert!(list.batches.len() < list.objects.len() && separate.batches.len() == list.objects.len());
        assert_eq!(separate.objects, list.objects);
        assert!(separate.commands().eq(list.commands()));
        assert!(separate.batches.iter().all(|batch| batch.count == 1));
    }
    submitter.submit(recorded).unwrap();
}

#[test]
fn the_projects_own_scene_has_the_same_draw_lists() {
    assert_same_for_all(&demo::colonnade().unwrap());
}

#[test]
fn coincident_copies_have_the_same_draw_lists() {
    let mut scene = field(100);
    scene.duplicate_objects(5);
    let (lists, ..) = drawn(&scene, 2, Granularity::Chunk(64));
    for list in lists {
        assert!(list.commands().is_sorted_by(|one, next| (one.key, one.object) < (next.key, next.object)));
    }
    assert_same_for_all(&scene);
}

#[test]
fn visibility_matches_a_reference_loop() {
    let scene = field(2000);
    let (lists, _, statistics) = drawn(&scene, 2, Granularity::default());
    for (camera, (list, view)) in scene.cameras.iter().zip(lists.iter().zip(&statistics.views)) {
        let reference = scene.as_scene_ref();
        let inside = |object: usize| {
            let bounds = reference.bounds[object];
            let offset =
                reference.orientations[object].as_dquat() * (reference.scales[object] * bounds.center).as_dvec3();
            let position =
                camera.orientation.as_dquat().inverse() * (reference.positions[object] + offset - camera.position);
            let radius = f64::from(bounds.radius * reference.scales[object].abs().max_element());
            let Projection::Perspective { field_of_view } = camera.projection else { unreachable!() };
            let half = f64::from(field_of_view) * 0.5;
            let half_x = (half.tan() * f64::from(camera.aspect())).atan();
            let beside =
                |coordinate: f64, angle: f64| coordinate.abs() * angle.cos() + position.z * angle.sin() <= radius;
            -position.z + radius >= f64::from(camera.near) && beside(position.x, half_x) && beside(position.y, half)
        };
        let expected_visible: Vec<u32> =
            (0..reference.object_count()).filter(|&object| inside(object)).map(|object| object as u32).collect();
        // A sphere that touches a plane may be on either side of it, depending on rounding.
        assert!(
            view.visible.abs_diff(expected_visible.len()) <= 1,
            "{} against {}",
            view.visible,
            expected_visible.len()
        );
        assert!(view.visible > 100 && view.visible < 2000, "the camera {} tests something", camera.name);
        let is_opaque =
            |object: &u32| scene.assets().get(reference.materials[*object as usize]).unwrap().blend == Blend::None;
        let expected: BTreeSet<u32> = expected_visible.into_iter().filter(is_opaque).collect();
        let drawn: BTreeSet<u32> = list.objects.iter().copied().collect();
        assert!(expected.symmetric_difference(&drawn).count() <= 1);
        assert_eq!(drawn.len(), list.objects.len(), "no object is drawn twice");
    }
}

#[test]
fn moving_the_world_and_the_camera_together_changes_nothing() {
    let near = field(500);
    for distance in [1e3, 1e6, 1e9] {
        let mut far = field(500);
        let shift = DVec3::new(distance, -distance * 0.5, distance * 0.25);
        for camera in &mut far.cameras {
            camera.position += shift;
        }
        let handles: Vec<_> = far.objects().collect();
        for handle in handles {
            let mut object = far.object(handle).unwrap();
            object.position += shift;
            far.replace_object(handle, object).unwrap();
        }
        let (near, far) = (drawn(&near, 1, Granularity::default()), drawn(&far, 1, Granularity::default()));
        for (near, far) in near.2.views.iter().zip(&far.2.views) {
            assert!(near.visible.abs_diff(far.visible) <= 1, "{distance}: {near:?} {far:?}");
        }
    }
}
