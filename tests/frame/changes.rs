//! Changes between frames: of the pipeline and of lights, and failed frames in between.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    CommandDraws, Declare, Deferred, Draws, FullScreen, Fxaa, PlanError, RenderProcess, ToneMapping, targets,
};
use drawloom::scene::{Light, Scene, ViewKind};
use drawloom::task::Scheduler;
use drawloom::view::{IssueReason, ShadowMaps};
use drawloom::{BuildError, FrameError, Renderer, RendererBuilder, Submitter};
use drawloom_testing::scenes::field;

fn build(builder: RendererBuilder<NullBackend>) -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap()
}

fn deferred(deferred: Deferred) -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    build(Renderer::builder(NullBackend).pipeline(deferred))
}

fn spot(position: DVec3) -> Light {
    Light::Spot {
        position,
        direction: Vec3::NEG_Y,
        intensity: Vec3::splat(9.0),
        range: 20.0,
        inner_angle: 0.3,
        outer_angle: 0.6,
        casts_shadow: true,
    }
}

/// Boxes in front of one camera, without lights.
fn dark_field() -> Scene {
    let mut scene = field(50);
    scene.cameras.truncate(1);
    scene.lights.clear();
    scene
}

fn processes(renderer: &Renderer<NullBackend>) -> Vec<&str> {
    renderer.plan().processes().iter().map(|planned| planned.name.as_str()).collect()
}

#[test]
fn a_new_pipeline_takes_effect_in_the_next_frame() {
    let scene = dark_field();
    let (mut renderer, submitter) = deferred(Deferred::to_picture().leave_out("transparency"));
    drop(renderer.record(scene.as_scene_ref()).unwrap());
    assert_eq!(processes(&renderer), ["geometry buffer", "tone mapping"]);

    renderer
        .set_pipeline(Deferred::new().depth_pre_pass(true).post(ToneMapping::default()).post(Fxaa::default()))
        .unwrap();
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let drawn = submitter.submit(recorded).unwrap().submission.passes.len();
    let expected = ["depth pre-pass", "geometry buffer", "transparency", "tone mapping", "fxaa"];
    assert_eq!((processes(&renderer).as_slice(), drawn), (&expected[..], expected.len()));

    let maps = ShadowMaps { side: 0, ..ShadowMaps::default() };
    let refused = renderer.set_pipeline(Deferred::new().shadow_maps(Some(maps)));
    assert!(matches!(refused, Err(BuildError::Plan(PlanError::ShadowMaps { .. }))));
    drop(renderer.record(scene.as_scene_ref()).unwrap());
    assert_eq!(processes(&renderer), expected);
}

#[test]
fn a_failed_frame_leaves_the_earlier_draw_lists_readable() {
    let mut scene = dark_field();
    scene.lights = vec![spot(DVec3::Y * 5.0)];
    let (mut renderer, _) = deferred(Deferred::to_picture());
    drop(renderer.record(scene.as_scene_ref()).unwrap());
    let drawn = renderer.draw_list("geometry buffer", 0).unwrap().objects.len();

    scene.lights.clear();
    scene.cameras[0].kind = ViewKind::Reflection;
    assert!(matches!(renderer.record(scene.as_scene_ref()), Err(FrameError::NoProcess { .. })));
    assert!(renderer.draw_list("unknown", 0).is_none());
    assert_eq!(renderer.draw_list("geometry buffer", 0).unwrap().objects.len(), drawn);
}

#[test]
fn a_light_out_of_reach_is_counted_and_the_frame_succeeds() {
    let mut scene = dark_field();
    scene.lights = vec![spot(DVec3::Y * 5.0), spot(DVec3::X * 5e9)];
    let (mut renderer, _) = deferred(Deferred::to_picture());
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let statistics = recorded.statistics();
    let scene_issues = statistics.scene_issues.iter();
    let found: Vec<_> = scene_issues.map(|issue| (issue.reason, issue.count, issue.first)).collect();
    assert_eq!(found, [(IssueReason::LightOutOfReach, 1, 1)]);
    assert_eq!(statistics.views.len(), 2);
}

#[test]
fn a_light_that_no_camera_sees_has_no_shadow_map() {
    let mut scene = dark_field();
    let behind = scene.cameras[0].position + DVec3::Z * 50.0;
    scene.lights = vec![spot(behind), spot(DVec3::Y * 5.0)];
    let (mut renderer, _) = deferred(Deferred::to_picture());
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let views: Vec<_> = recorded.statistics().views.iter().map(|view| view.name.as_str()).collect();
    assert_eq!(views, ["front", "shadow of light 1"]);
    assert_eq!(recorded.statistics().views[0].lights, 1);
}

#[test]
fn alternating_plans_do_not_affect_each_other() {
    let mut scene = dark_field();
    let (mut renderer, _) = deferred(Deferred::to_picture());
    let mut first = None;
    for frame in 0..6 {
        scene.lights = if frame % 2 == 0 { Vec::new() } else { vec![spot(DVec3::Y * 5.0); 3] };
        let recorded = renderer.record(scene.as_scene_ref()).unwrap();
        let main = recorded.statistics().views[0].clone();
        let commands = first.get_or_insert(main.commands);
        assert_eq!(main.commands, *commands, "in frame {frame}");
    }
}

/// Fog that samples the shadow maps.
struct Fog;

impl RenderProcess for Fog {
    fn name(&self) -> &str {
        "fog"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples("depth");
        declare.samples_layers(ViewKind::Shadow, targets::SHADOW_MAP);
        declare.draws_over("radiance");
        declare.after("transparency");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen::default())
    }
}

#[test]
fn an_engines_process_may_sample_shadow_maps_even_without_lights() {
    let mut scene = dark_field();
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).process(Fog);
    let (mut renderer, _) = build(builder);
    for lights in [vec![], vec![spot(DVec3::Y * 5.0)], vec![]] {
        let drawn = !lights.is_empty();
        scene.lights = lights;
        drop(renderer.record(scene.as_scene_ref()).unwrap());
        assert_eq!(processes(&renderer).contains(&"shadow casters"), drawn);
        assert!(processes(&renderer).contains(&"fog"));
        let maps = renderer.plan().targets().iter().filter(|target| target.name == targets::SHADOW_MAP.name());
        assert_eq!(maps.map(|map| (map.layered, map.views)).collect::<Vec<_>>(), [(true, ViewKind::Shadow)]);
    }
    // Without the deferred pipeline no process draws shadow maps.
    let fog_only = Renderer::builder(NullBackend).process(Fog).output("radiance");
    assert!(fog_only.build(Arc::new(Scheduler::new(1).unwrap())).is_err());
}

#[test]
fn the_chain_skips_left_out_processes_and_without_casters_no_light_is_shadowed() {
    let steps = || Deferred::new().post(ToneMapping::default()).post(Fxaa::default());
    let mut scene = dark_field();
    scene.lights = vec![spot(DVec3::Y * 5.0)];
    let drawn = |pipeline: Deferred| {
        let (mut renderer, _) = deferred(pipeline.leave_out("transparency"));
        drop(renderer.record(scene.as_scene_ref()).unwrap());
        let names = processes(&renderer).into_iter().map(str::to_owned);
        names.collect::<Vec<_>>()
    };
    let lit = ["geometry buffer", "shadowed spot lights"];
    assert_eq!(drawn(steps().leave_out("fxaa"))[1..], [lit[0], lit[1], "tone mapping"]);
    assert_eq!(drawn(steps().leave_out("tone mapping"))[1..], [lit[0], lit[1], "fxaa"]);
    assert_eq!(drawn(steps().leave_out("fxaa").leave_out("tone mapping"))[1..], lit);
    let unshadowed = drawn(steps().leave_out("shadow casters"));
    assert_eq!(unshadowed, ["geometry buffer", "spot lights", "tone mapping", "fxaa"]);
}

/// Draws shadow views into a target of the engine's own.
struct OwnMaps;

impl RenderProcess for OwnMaps {
    fn name(&self) -> &str {
        "own maps"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(ViewKind::Shadow);
        declare.clears_depth_layer("own map", drawloom::process::Format::Depth32Float);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws { fragment: None, ..CommandDraws::default() })
    }
}

#[test]
fn without_shadow_maps_lights_are_drawn_unshadowed_beside_an_engines_own_maps() {
    let mut scene = dark_field();
    scene.lights = vec![spot(DVec3::Y * 5.0)];
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture().shadow_maps(None)).process(OwnMaps);
    let (mut renderer, submitter) = build(builder);
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let passes = submitter.submit(recorded).unwrap().submission.passes;
    let lit: Vec<_> = passes.iter().filter(|pass| pass.lights > 0).map(|pass| pass.process.as_str()).collect();
    assert_eq!(lit, ["spot lights"]);
    assert_eq!(passes[0].process, "own maps");
}
