//! Frames that are drawn before the first one.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::Quality;
use drawloom::scene::{Camera, Light, Material, RenderObject, Scene, SceneRef, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter, WarmUp};
use drawloom_testing::scenes::everything::{class_of, everything, everything_with_mirror};
use drawloom_testing::scenes::leveled::globe;

use crate::sampled_views;

fn new_renderer() -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    let builder = Renderer::builder(NullBackend).deferred(Deferred::to_picture()).process(sampled_views::RADIANCE);
    builder.quality(Quality::fast()).build(Arc::new(Scheduler::new(1).unwrap())).unwrap()
}

fn with_mirror() -> Scene {
    everything_with_mirror(sampled_views::MIRROR)
}

#[test]
fn a_warm_up_draws_everything_and_then_each_class_of_lights_alone_and_none_of_what_may_be_absent() {
    let scene = with_mirror();
    let (mut renderer, submitter) = new_renderer();
    let mut warm_up = WarmUp::new(scene.as_scene_ref());
    let mut drawn = Vec::new();
    while let Some(recorded) = warm_up.record_next(&mut renderer).unwrap() {
        let submitted = submitter.submit(recorded).unwrap();
        let has = |name: &str| submitted.submission.passes.iter().any(|pass| pass.process == name);
        let views = submitted.statistics.views.iter().filter(|view| view.kind == ViewKind::Reflection).count();
        let casters = submitted.submission.passes.iter().any(|pass| pass.process == "shadow casters");
        drawn.push((submitted.statistics.lights, has("transparency"), views, casters));
    }
    let casts_shadow = |light: &Light| class_of(light).shadowed;
    let mut expected = vec![(8, true, 1, true)];
    expected.extend(scene.lights.iter().map(|light| (1, true, 1, casts_shadow(light))));
    expected.extend([(0, true, 1, false), (0, false, 1, false), (0, true, 0, false)]);
    assert_eq!(drawn, expected);
    assert_eq!(warm_up.frames_left(), 0);
    assert!(warm_up.record_next(&mut renderer).unwrap().is_none());
}

#[test]
fn a_warm_up_of_a_scene_with_fewer_lights_has_fewer_frames() {
    let mut scene = everything();
    scene.lights.truncate(2);
    let doubled: Vec<_> = scene.lights.iter().flat_map(|light| [*light; 2]).collect();
    assert_eq!(WarmUp::new(SceneRef { lights: &doubled, ..scene.as_scene_ref() }).frames_left(), 1 + 2 + 3);
}

#[test]
fn a_frame_of_a_warm_up_that_fails_leaves_the_others() {
    let scene = with_mirror();
    let (mut renderer, _submitter) = new_renderer();
    let broken = SceneRef { ambient: Vec3::NAN, ..scene.as_scene_ref() };
    let mut warm_up = WarmUp::new(broken);
    let frames = warm_up.frames_left();
    assert!(warm_up.record_next(&mut renderer).is_err());
    assert_eq!(warm_up.frames_left(), frames - 1);
    drop(renderer.record(scene.as_scene_ref()).unwrap());
}

/// An object with levels of detail at some distance from the camera.
fn levelled(distance: f64) -> Scene {
    let mut scene = Scene::new();
    let (mesh, material) = (scene.add(globe()).unwrap(), scene.add(Material::default()).unwrap());
    scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO)).unwrap();
    scene.cameras.push(Camera::looking_at("main", DVec3::Z * distance, DVec3::ZERO));
    scene
}

#[test]
fn levels_of_detail_after_a_warm_up_are_those_of_a_new_renderer() {
    let triangles = |renderer: &mut Renderer<NullBackend>, submitter: &Submitter<NullBackend>, distance: f64| {
        let scene = levelled(distance);
        let submitted = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
        submitted.statistics.views[0].levels_of_detail.unwrap().triangles
    };
    let mut has_hysteresis = false;
    for distance in (0..60).map(|step| 2.0 * 1.08_f64.powi(step)) {
        let (mut fresh, submitter) = new_renderer();
        let expected = triangles(&mut fresh, &submitter, distance);
        let (mut moved, submitter) = new_renderer();
        triangles(&mut moved, &submitter, 2.0);
        has_hysteresis |= triangles(&mut moved, &submitter, distance) != expected;
        let (mut warm, submitter) = new_renderer();
        let scene = levelled(2.0);
        let mut warm_up = WarmUp::new(scene.as_scene_ref());
        while let Some(frame) = warm_up.record_next(&mut warm).unwrap() {
            submitter.submit(frame).unwrap();
        }
        assert_eq!(triangles(&mut warm, &submitter, distance), expected, "at {distance} m");
    }
    assert!(has_hysteresis);
}
