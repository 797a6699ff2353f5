//! The order in which a process draws objects.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::command::{DrawOrder, Selection};
use drawloom::process::{CommandDraws, Declare, Draws, Format, PlanError, RenderProcess};
use drawloom::scene::{Changes, ObjectColumn, Projection, Scene, SceneError, SceneRef, StaticGroup, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{FrameError, Renderer};
use drawloom_testing::scenes::field;

const NUMBER: ObjectColumn<u32> = ObjectColumn::new("number");

struct Ordered(DrawOrder);

impl RenderProcess for Ordered {
    fn name(&self) -> &str {
        "ordered"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_depth("depth", Format::Depth32Float);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        let selection = Selection::ALL.in_order(self.0);
        Draws::Commands(CommandDraws { selection, ..CommandDraws::default() })
    }
}

fn renderer(order: DrawOrder, workers: usize) -> Renderer<NullBackend> {
    let builder = Renderer::builder(NullBackend).process(Ordered(order));
    builder.build(Arc::new(Scheduler::new(workers).unwrap())).unwrap().0
}

fn objects_of(renderer: &mut Renderer<NullBackend>, scene: SceneRef<'_>) -> Vec<u32> {
    drop(renderer.record(scene).unwrap());
    renderer.draw_list("ordered", 0).unwrap().objects.clone()
}

fn sorted(mut objects: Vec<u32>) -> Vec<u32> {
    objects.sort_unstable();
    objects
}

/// The distance of each object's centre along the axis of the first camera.
fn depths(scene: &Scene) -> Vec<f64> {
    let camera = &scene.cameras[0];
    let forward = camera.orientation.as_dquat() * drawloom::glam::DVec3::NEG_Z;
    // Meshes are centred.
    scene.as_scene_ref().positions.iter().map(|position| (*position - camera.position).dot(forward)).collect()
}

#[test]
fn objects_are_drawn_by_distance() {
    let scene = field(2000);
    let (all, depths) = (objects_of(&mut renderer(DrawOrder::ByState, 2), scene.as_scene_ref()), depths(&scene));
    let blends = |objects: &[u32]| objects.windows(2).any(|pair| depths[pair[0] as usize] > depths[pair[1] as usize]);
    assert!(blends(&all), "by state, distances go up and down");
    for workers in [1, 2] {
        let near_to_far = objects_of(&mut renderer(DrawOrder::FrontToBack, workers), scene.as_scene_ref());
        let far_to_near = objects_of(&mut renderer(DrawOrder::BackToFront, workers), scene.as_scene_ref());
        assert_eq!(sorted(near_to_far.clone()), sorted(all.clone()));
        assert_eq!(sorted(far_to_near.clone()), sorted(all.clone()));
        // The depths of sort keys have fewer bits than these.
        let step = 1e-3;
        for pair in near_to_far.windows(2) {
            assert!(depths[pair[0] as usize] <= depths[pair[1] as usize] + step, "{pair:?}");
        }
        for pair in far_to_near.windows(2) {
            assert!(depths[pair[0] as usize] >= depths[pair[1] as usize] - step, "{pair:?}");
        }
    }
}

/// Draws all objects by state.
struct ByState;

impl RenderProcess for ByState {
    fn name(&self) -> &str {
        "by state"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_depth("other depth", Format::Depth32Float);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws::default())
    }
}

#[test]
fn objects_of_static_groups_are_drawn_in_order_too() {
    let mut scene = field(200);
    scene.cameras.truncate(1);
    let expected = objects_of(&mut renderer(DrawOrder::FrontToBack, 1), scene.as_scene_ref());
    scene.static_groups.push(StaticGroup::new("all", (0..200).collect()));
    let builder = Renderer::builder(NullBackend).process(ByState).process(Ordered(DrawOrder::FrontToBack));
    let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    for _ in 0..4 {
        let unchanged = SceneRef { changes: Changes::NONE, ..scene.as_scene_ref() };
        assert_eq!(objects_of(&mut renderer, unchanged), expected);
    }
}

/// Draws all objects by state in shadow maps.
struct ShadowMaps;

impl RenderProcess for ShadowMaps {
    fn name(&self) -> &str {
        "shadow maps"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(ViewKind::Shadow);
        declare.clears_depth_layer("shadow maps", Format::Depth32Float);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws::default())
    }
}

#[test]
fn a_camera_that_becomes_a_paraboloid_draws_what_a_new_renderer_draws() {
    let new = || {
        let builder = Renderer::builder(NullBackend).process(ShadowMaps);
        builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap().0
    };
    let batches = |renderer: &mut Renderer<NullBackend>, scene: SceneRef<'_>| {
        drop(renderer.record(scene).unwrap());
        renderer.draw_list("shadow maps", 0).unwrap().batches.clone()
    };
    let (mut scene, mut kept) = (field(200), new());
    scene.cameras.truncate(1);
    (scene.cameras[0].kind, scene.cameras[0].far) = (ViewKind::Shadow, 100.0);
    let perspective = scene.cameras[0].projection;
    let in_perspective = batches(&mut kept, scene.as_scene_ref());
    for projection in [Projection::Paraboloid, perspective] {
        scene.cameras[0].projection = projection;
        let found = batches(&mut kept, SceneRef { changes: Changes::NONE, ..scene.as_scene_ref() });
        assert_eq!(found, batches(&mut new(), scene.as_scene_ref()), "{projection:?}");
        assert_eq!(found == in_perspective, projection == perspective, "in a paraboloid, meshes are subdivided");
    }
}

#[test]
fn objects_are_drawn_by_a_number_of_the_engines() {
    let scene = field(2000);
    let all = objects_of(&mut renderer(DrawOrder::ByState, 2), scene.as_scene_ref());
    let mut numbers: Vec<u32> =
        (0..2000_u32).map(|object| object.wrapping_mul(2_654_435_761) % 97 * 44_000_000).collect();
    let expected = |numbers: &[u32]| {
        let mut expected = sorted(all.clone());
        expected.sort_by_key(|object| numbers[*object as usize]);
        expected
    };
    let mut renderer = renderer(DrawOrder::ByColumn(NUMBER), 2);
    let mut frame = |numbers: &[u32], changes| {
        let columns = [NUMBER.values(numbers)];
        objects_of(&mut renderer, SceneRef { columns: &columns, changes, ..scene.as_scene_ref() })
    };
    assert_eq!(frame(&numbers, Changes::Unknown), expected(&numbers));
    assert_eq!(frame(&numbers, Changes::NONE), expected(&numbers));
    let first = all[0] as usize;
    numbers[first] = u32::MAX;
    let found = frame(&numbers, Changes::Objects(&[all[0]]));
    assert_eq!(found, expected(&numbers));
    assert_eq!(found.last(), Some(&all[0]));
}

#[test]
fn a_missing_order_and_an_unreported_change_of_it_are_named() {
    let scene = field(100);
    let mut renderer = renderer(DrawOrder::ByColumn(NUMBER), 1);
    let error = renderer.record(scene.as_scene_ref()).map(drop).unwrap_err();
    let is_named = matches!(
        &error,
        FrameError::Plan(PlanError::MissingColumn { process, column: "number" }) if process == "ordered"
    );
    assert!(is_named, "{error}");
    let mut numbers = vec![1; 100];
    let mut frame = |numbers: &[u32], changes| {
        renderer.record(SceneRef { columns: &[NUMBER.values(numbers)], changes, ..scene.as_scene_ref() }).map(drop)
    };
    frame(&numbers, Changes::Unknown).unwrap();
    numbers[7] = 5;
    let error = frame(&numbers, Changes::NONE);
    if cfg!(debug_assertions) {
        let is_named =
            matches!(error, Err(FrameError::Scene(SceneError::UnreportedColumnChange { column: "number", object: 7 })));
        assert!(is_named, "{error:?}");
    }
}
