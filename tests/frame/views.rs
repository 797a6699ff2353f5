//! Views of several kinds, each drawn by the processes that are for it.

use std::f32::consts::PI;
use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{CommandDraws, Declare, Draws, Format, RenderProcess};
use drawloom::scene::{Light, ViewKind};
use drawloom::task::Scheduler;
use drawloom::view::RenderView;
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
    let spot = Light::Spot {
        position: DVec3::new(3.0, 30.0, 3.0),
        direction: Vec3::NEG_Y,
        intensity: Vec3::splat(100.0),
        range: 60.0,
        inner_angle: 0.3,
        outer_angle: 0.4,
    };
    scene.lights.push(spot);
    scene.cameras.extend(spot.shadow_camera("spot", 512));
    let scheduler = Arc::new(Scheduler::new(2).unwrap());
    let (mut renderer, submitter) =
        Renderer::builder(NullBackend).deferred().process(ShadowDepth).build(scheduler).unwrap();
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let queues: Vec<_> = recorded.queues().iter().map(|queue| (queue.view, queue.passes.len())).collect();
    assert_eq!(queues, [(0, 3), (1, 3), (2, 1)]);
    assert_eq!(recorded.statistics().views[2].kind, ViewKind::Shadow);
    let seen = recorded.statistics().views[2].visible;
    assert!((10..200).contains(&seen), "{seen} objects in the cone");

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
fn a_shadow_view_sees_the_lights_cone_and_no_more() {
    let spot = |outer_angle: f32| Light::Spot {
        position: DVec3::new(5.0, 8.0, -3.0),
        direction: Vec3::new(1.0, -2.0, 0.5).normalize(),
        intensity: Vec3::ONE,
        range: 50.0,
        inner_angle: 0.0,
        outer_angle,
    };
    for outer_angle in [0.01_f32, 0.3, 1.0, 1.4] {
        let view = RenderView::new(&spot(outer_angle).shadow_camera("spot", 256).unwrap());
        let axis = Vec3::new(1.0, -2.0, 0.5).normalize();
        let place = |angle: f32| {
            let aside = axis.any_orthonormal_vector() * angle.sin();
            DVec3::new(5.0, 8.0, -3.0) + ((axis * angle.cos() + aside) * 10.0).as_dvec3()
        };
        assert!(view.frustum.may_see(place(outer_angle * 0.99), 0.0));
        // The picture is a square around the cone, so its corners see a little more.
        assert!(!view.frustum.may_see(place((outer_angle * 1.5).max(outer_angle + 0.1)), 0.0));
    }
    assert!(spot(PI / 2.0).shadow_camera("wide", 64).unwrap().field_of_view < PI);
    let point = Light::Point { position: DVec3::ZERO, intensity: Vec3::ONE, range: 1.0 };
    assert!(point.shadow_camera("point", 64).is_none());
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
