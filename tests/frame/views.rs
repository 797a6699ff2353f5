//! Views of several kinds, each drawn by the processes for its kind.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::backend::internal::NullPass;
use drawloom::command::Selection;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{CommandDraws, Declare, Deferred, Draws, Format, RenderProcess};
use drawloom::scene::{Camera, Light, SceneRef, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{FrameError, Granularity, Renderer};
use drawloom_testing::scenes::field;

use crate::layers::Depth;
use crate::renderer;

/// Draws a light's depth.
struct ShadowDepth;

impl RenderProcess for ShadowDepth {
    fn name(&self) -> &str {
        "shadow depth"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(ViewKind::Shadow);
        declare.clears_depth_layer("shadow map", Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws { fragment: None, ..CommandDraws::default() })
    }
}

#[test]
fn views_are_submitted_whole_shadows_first_each_with_the_processes_of_its_kind() {
    let mut scene = field(400);
    scene.lights = vec![Light::Spot {
        position: DVec3::new(3.0, 30.0, 3.0),
        direction: Vec3::NEG_Y,
        intensity: Vec3::splat(100.0),
        range: 60.0,
        inner_angle: 0.3,
        outer_angle: 0.4,
        casts_shadow: true,
    }];
    let scheduler = Arc::new(Scheduler::new(2).unwrap());
    // The engine's process replaces the shipped shadow casters.
    let deferred = Deferred::to_picture().replace("shadow casters", ShadowDepth);
    let (mut renderer, submitter) = Renderer::builder(NullBackend).pipeline(deferred).build(scheduler).unwrap();
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let queues: Vec<_> = recorded.queues().iter().map(|queue| (queue.view, queue.passes.len())).collect();
    assert_eq!(queues, [(0, 4), (1, 4), (2, 1)]);
    assert_eq!(recorded.statistics().views[2].kind, ViewKind::Shadow);
    let visible = recorded.statistics().views[2].visible;
    assert!((10..200).contains(&visible), "{visible} objects in the cone");

    let passes = submitter.submit(recorded).unwrap().submission.passes;
    let order: Vec<_> = passes.iter().map(|pass| (pass.process.as_str(), pass.view)).collect();
    let expected = [
        ("shadow depth", 2),
        ("geometry buffer", 0),
        ("shadowed spot lights", 0),
        ("transparency", 0),
        ("tone mapping", 0),
        ("geometry buffer", 1),
        ("shadowed spot lights", 1),
        ("transparency", 1),
        ("tone mapping", 1),
    ];
    assert_eq!(order, expected);
    assert!(renderer.draw_list("shadow depth", 2).is_some());
    assert!(renderer.draw_list("shadow depth", 0).is_none());
    assert!(renderer.draw_list("shadowed spot lights", 0).is_none());
}

#[test]
fn graphs_can_be_exported_to_dot() {
    let (mut renderer, _) = renderer(1, Granularity::default());
    assert!(renderer.stage_graph_to_dot().is_none());
    drop(renderer.record(field(3).as_scene_ref()).unwrap());
    let jobs = renderer.stage_graph_to_dot().unwrap();
    assert!(renderer.plan().to_dot().contains("geometry buffer") && jobs.contains("fill"));
}

#[test]
fn bundles_hold_256_batches_unless_the_granularity_asks_for_fewer() {
    let mut scene = field(3000);
    // Every object has a mesh of its own, so no commands merge.
    let (cube, stone) = (scene.as_scene_ref().meshes[0], scene.as_scene_ref().materials[0]);
    let cube = scene.assets().get(cube).unwrap().clone();
    for handle in scene.objects().collect::<Vec<_>>() {
        let mut object = scene.object(handle).unwrap();
        object.mesh = scene.add(cube.clone()).unwrap();
        object.material = stone;
        scene.replace_object(handle, object).unwrap();
    }
    for (granularity, size) in [
        (Granularity::Adaptive, 256),
        (Granularity::PerCamera, 256),
        (Granularity::PerDraw, 1),
        (Granularity::Chunk(64), 64),
        // Two bundles a job.
        (Granularity::Chunk(300), 150),
    ] {
        let (mut renderer, submitter) = renderer(2, granularity);
        let recorded = renderer.record(scene.as_scene_ref()).unwrap();
        let submitted = submitter.submit(recorded).unwrap();
        let is_geometry = |pass: &&NullPass| pass.process == "geometry buffer";
        let passes = submitted.submission.passes.iter().filter(is_geometry);
        for (view, pass) in submitted.statistics.views.iter().zip(passes) {
            assert_eq!(view.batches, view.commands);
            assert_eq!(view.bundles, view.batches.div_ceil(size));
            assert!(view.bundles > 3);
            assert_eq!((pass.bundles, pass.batches), (view.bundles, view.batches));
        }
    }
}

#[test]
fn a_frame_has_at_most_as_many_views_as_it_may() {
    let scene = field(1);
    let mut renderer = renderer_of_depth();
    for (count, is_drawn) in [(FrameError::MAX_VIEWS, true), (FrameError::MAX_VIEWS + 1, false)] {
        let cameras: Vec<_> =
            (0..count).map(|index| Camera { name: index.to_string(), ..scene.cameras[0].clone() }).collect();
        let error = renderer.record(SceneRef { cameras: &cameras, ..scene.as_scene_ref() }).err();
        assert_eq!(error.is_none(), is_drawn);
        assert!(error.is_none_or(|error| matches!(error, FrameError::TooManyViews { views } if views == count)));
    }
}

fn renderer_of_depth() -> Renderer<NullBackend> {
    let process = Depth { name: "depth".to_owned(), selection: Selection::ALL };
    let builder = Renderer::builder(NullBackend).process(process);
    builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap().0
}

#[test]
fn without_shadow_maps_lights_that_cast_shadows_are_drawn_like_others() {
    let drawn = |casts_shadow: bool| -> Vec<(String, usize)> {
        let mut scene = field(10);
        let (position, intensity, range) = (DVec3::new(3.0, 30.0, 3.0), Vec3::splat(100.0), 60.0);
        scene.lights = vec![Light::Point { position, intensity, range, casts_shadow }];
        let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture().shadow_maps(None));
        let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
        let submitted = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
        submitted.submission.passes.into_iter().map(|pass| (pass.process, pass.lights)).collect()
    };
    assert_eq!(drawn(true), drawn(false));
    assert!(drawn(true).iter().any(|(_, lights)| *lights > 0), "{:?}", drawn(true));
}
