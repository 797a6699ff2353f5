//! Views of several kinds, each drawn by the processes that are for it.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::DVec3;
use drawloom::process::{CommandDraws, Declare, Draws, Format, RenderProcess};
use drawloom::scene::{Camera, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{Granularity, Renderer};

use crate::renderer;
use crate::scenes::field;

/// The depth that a light sees.
struct ShadowDepth;

impl RenderProcess for ShadowDepth {
    fn name(&self) -> &str {
        "shadow depth"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(ViewKind::Shadow);
        declare.clears_depth("depth", Format::Depth32Float);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws { fragment: None, ..CommandDraws::default() })
    }
}

#[test]
fn each_kind_goes_through_its_own_processes_and_shadows_go_first() {
    let mut scene = field(400);
    let mut sun = Camera::looking_at("sun", DVec3::new(3.0, 30.0, 3.0), DVec3::ZERO);
    sun.kind = ViewKind::Shadow;
    scene.cameras.push(sun);
    let scheduler = Arc::new(Scheduler::new(2).unwrap());
    let (mut renderer, submitter) =
        Renderer::builder(NullBackend).deferred().process(ShadowDepth).build(scheduler).unwrap();
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let queues: Vec<_> = recorded.queues().iter().map(|queue| (queue.view, queue.passes.len())).collect();
    assert_eq!(queues, [(0, 3), (1, 3), (2, 1)]);
    assert_eq!(recorded.statistics().views[2].kind, ViewKind::Shadow);
    assert!(recorded.statistics().views[2].commands > 0);

    let passes = submitter.submit(recorded).unwrap().submission.passes;
    let order: Vec<_> = passes.iter().map(|pass| (pass.process.as_str(), pass.view)).collect();
    let expected = [
        ("shadow depth", 2),
        ("geometry buffer", 0),
        ("geometry buffer", 1),
        ("lighting", 0),
        ("lighting", 1),
        ("tone mapping", 0),
        ("tone mapping", 1),
    ];
    assert_eq!(order, expected);
    assert!(renderer.draw_list("shadow depth", 2).is_some());
    assert!(renderer.draw_list("shadow depth", 0).is_none());
    assert!(renderer.draw_list("lighting", 0).is_none());
}

#[test]
fn graphs_can_be_looked_at() {
    let (mut renderer, _) = renderer(1, Granularity::default());
    assert!(renderer.jobs_to_dot().is_none());
    drop(renderer.record(field(3).as_scene_ref()).unwrap());
    let jobs = renderer.jobs_to_dot().unwrap();
    assert!(renderer.plan().to_dot().contains("geometry buffer") && jobs.contains("fill"));
}

#[test]
fn bundles_hold_256_batches_whatever_the_granularity() {
    let mut scene = field(3000);
    // Every object gets a mesh of its own, so that nothing merges.
    let (cube, stone) = (scene.as_scene_ref().meshes[0], scene.as_scene_ref().materials[0]);
    let cube = scene.assets().get(cube).unwrap().clone();
    for handle in scene.objects().collect::<Vec<_>>() {
        let mut object = scene.object(handle).unwrap();
        object.mesh = scene.add(cube.clone()).unwrap();
        object.material = stone;
        scene.replace_object(handle, object).unwrap();
    }
    for granularity in [Granularity::PerCamera, Granularity::PerDraw, Granularity::Chunk(300)] {
        let (mut renderer, submitter) = renderer(2, granularity);
        let recorded = renderer.record(scene.as_scene_ref()).unwrap();
        let submitted = submitter.submit(recorded).unwrap();
        for (view, pass) in submitted.statistics.views.iter().zip(&submitted.submission.passes) {
            assert_eq!(view.batches, view.commands);
            assert_eq!(view.bundles, view.batches.div_ceil(256));
            assert!(view.bundles > 3);
            assert_eq!((pass.bundles, pass.batches), (view.bundles, view.batches));
        }
    }
}
