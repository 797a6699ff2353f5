//! Frames that are drawn before the first one.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{Deferred, LightVolumes};
use drawloom::quality::Quality;
use drawloom::scene::{Camera, Light, LightKind, Material, RenderObject, Scene, SceneRef, ViewKind};
use drawloom::task::Scheduler;
use drawloom::view::LightClass;
use drawloom::{Renderer, Submitter, WarmUp};
use drawloom_testing::scenes::everything::{class_of, dark, everything, everything_with_mirror, glasses};
use drawloom_testing::scenes::leveled::globe;

use crate::sampled_views;

fn new_renderer() -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).process(sampled_views::RADIANCE);
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
    let (frames, mut drawn) = (warm_up.frames_left(), Vec::new());
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
    assert_eq!(frames, expected.len());
    assert_eq!(drawn, expected);
    assert_eq!(warm_up.frames_left(), 0);
    assert!(warm_up.record_next(&mut renderer).unwrap().is_none());
}

#[test]
fn a_warm_up_has_no_frames_for_what_its_scene_lacks() {
    let mut scene = everything();
    scene.lights.truncate(2);
    let doubled: Vec<_> = scene.lights.iter().flat_map(|light| [*light; 2]).collect();
    let frames = |scene: SceneRef<'_>| WarmUp::new(scene).frames_left();
    // Everything, two lights, no light, no glass.
    assert_eq!(frames(SceneRef { lights: &doubled, ..scene.as_scene_ref() }), 5);
    for handle in scene.objects().collect::<Vec<_>>().into_iter().rev() {
        if glasses(&scene).iter().any(|(glass, _)| *glass == scene.object(handle).unwrap().material) {
            scene.remove_object(handle).unwrap();
        }
    }
    assert_eq!(frames(scene.as_scene_ref()), 4);
    // Without another view there is no frame without reflections.
    let mirror = with_mirror();
    let reflections: Vec<_> =
        mirror.cameras.iter().filter(|camera| camera.kind == ViewKind::Reflection).cloned().collect();
    assert_eq!(frames(SceneRef { cameras: &reflections, ..mirror.as_scene_ref() }), frames(mirror.as_scene_ref()) - 1);
}

#[test]
fn lights_that_are_dark_or_out_of_sight_are_drawn_too() {
    let mut scene = everything();
    let far = |mut light: Light| {
        if let Light::Point { position, range, .. }
        | Light::Spot { position, range, .. }
        | Light::Hemispherical { position, range, .. } = &mut light
        {
            position.x += 1e6;
            // Less than the near plane's distance.
            *range = 0.01;
        }
        light
    };
    let invalid = |mut light: Light| {
        light.color_mut().x = f32::NAN;
        light
    };
    // The first light of each class cannot be drawn at all.
    scene.lights = scene.lights.iter().flat_map(|light| [invalid(*light), dark(far(*light))]).collect();
    let (mut renderer, submitter) = new_renderer();
    let mut warm_up = WarmUp::new(scene.as_scene_ref());
    let mut drawn = Vec::new();
    while let Some(recorded) = warm_up.record_next(&mut renderer).unwrap() {
        let submitted = submitter.submit(recorded).unwrap();
        let of_lights = submitted.submission.passes.into_iter().find(|pass| pass.process.ends_with("lights"));
        let maps = submitted.statistics.views.iter().filter(|view| view.kind == ViewKind::Shadow).count();
        drawn.push((of_lights.map(|pass| pass.process), submitted.statistics.views[0].lights, maps));
    }
    let of_class = |class: LightClass| {
        let maps = if class.kind == LightKind::Point { 6 } else { 1 };
        (Some(LightVolumes::name_of(class)), 1, usize::from(class.shadowed) * maps)
    };
    let mut expected = vec![(None, 0, 0)];
    expected.extend(LightClass::all().map(of_class));
    expected.extend([(None, 0, 0), (None, 0, 0)]);
    assert_eq!(drawn, expected);
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
