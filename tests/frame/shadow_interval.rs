//! Shadow maps that are drawn every n-th frame, and changes that cause them to be drawn earlier.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::{Quality, ShadowQuality};
use drawloom::scene::{Light, Scene};
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom::{Renderer, Submitter};
use drawloom_testing::scenes::field;

/// A renderer that draws shadow maps every n-th frame.
struct Fixture {
    renderer: Renderer<NullBackend>,
    submitter: Submitter<NullBackend>,
}

impl Fixture {
    fn new(interval: u32) -> Self {
        let scheduler = Arc::new(Scheduler::new(2).unwrap());
        let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).quality(quality_with(interval));
        let (renderer, submitter) = builder.build(scheduler).unwrap();
        Self { renderer, submitter }
    }

    /// Draws a frame, and returns the views that draw a shadow map in it.
    fn drawn(&mut self, scene: &Scene) -> Vec<usize> {
        let recorded = self.renderer.record(scene.as_scene_ref()).unwrap();
        let passes = self.submitter.submit(recorded).unwrap().submission.passes;
        assert!(passes.iter().any(|pass| pass.process == "shadowed spot lights"));
        let casters = passes.iter().filter(|pass| pass.process == "shadow casters");
        casters.map(|pass| pass.view).collect()
    }
}

fn quality_with(interval: u32) -> Quality {
    let quality = Quality::balanced();
    Quality { shadows: ShadowQuality { interval, ..quality.shadows }, ..quality }
}

fn spot(x: f64) -> Light {
    Light::Spot {
        position: DVec3::new(x, 30.0, 3.0),
        direction: Vec3::NEG_Y,
        intensity: Vec3::splat(100.0),
        range: 60.0,
        inner_angle: 0.3,
        outer_angle: 0.4,
        casts_shadow: true,
    }
}

fn sun() -> Light {
    Light::Directional { direction: Vec3::NEG_Y, illuminance: Vec3::ONE, casts_shadow: true }
}

/// Casts no shadow.
fn lamp() -> Light {
    Light::Point { position: DVec3::ZERO, intensity: Vec3::ONE, range: 9.0, casts_shadow: false }
}

/// Two cameras, followed by the shadow views of two lights: of the spot, and of the sun for each camera.
fn two_lights() -> Scene {
    let mut scene = field(300);
    scene.lights = vec![spot(3.0), sun()];
    scene
}

#[test]
fn shadow_maps_are_drawn_every_nth_frame_in_turns() {
    let expected: [&[&[usize]]; 4] = [
        &[&[2, 3, 4], &[2, 3, 4], &[2, 3, 4], &[2, 3, 4], &[2, 3, 4]],
        &[&[2, 3, 4], &[3], &[2, 4], &[3], &[2, 4]],
        &[&[2, 3, 4], &[4], &[3], &[2], &[4], &[3], &[2]],
        &[&[2, 3, 4], &[], &[4], &[3], &[2], &[], &[4], &[3], &[2]],
    ];
    for (interval, expected) in (1..).zip(expected) {
        let (scene, mut fixture) = (two_lights(), Fixture::new(interval));
        for (frame, drawn) in expected.iter().enumerate() {
            assert_eq!(fixture.drawn(&scene), *drawn, "frame {frame} of {interval}");
        }
    }
}

#[test]
fn after_frames_that_are_forgotten_maps_are_drawn_as_in_first_frames() {
    let (scene, mut fixture) = (two_lights(), Fixture::new(3));
    let mut draw = |frames: usize| (0..frames).map(|_| fixture.drawn(&scene)).collect::<Vec<_>>();
    let first = draw(5);
    assert_ne!(draw(5), first);
    fixture.renderer.forget_previous_frames();
    let mut draw = |frames: usize| (0..frames).map(|_| fixture.drawn(&scene)).collect::<Vec<_>>();
    assert_eq!(draw(5), first);
}

/// All maps of a light are drawn together, whichever of them no longer fits.
#[test]
fn lights_with_several_maps_have_all_of_them_cached() {
    let maps = ShadowMaps { cascades: 3, ..ShadowMaps::default() };
    let mut fixture = Fixture::new(100);
    fixture.renderer.set_pipeline(Deferred::to_picture().shadow_maps(Some(maps))).unwrap();
    let mut scene = two_lights();
    scene.lights.push(Light::Point { position: DVec3::Y, intensity: Vec3::ONE, range: 9.0, casts_shadow: true });
    let all: Vec<_> = (2..15).collect();
    assert_eq!(fixture.drawn(&scene), all);
    assert!(fixture.drawn(&scene).is_empty());
    // A lamp keeps its maps while it moves.
    if let Light::Point { position, .. } = &mut scene.lights[2] {
        position.x += 1.0;
    }
    assert!(fixture.drawn(&scene).is_empty());
    // The camera leaves the finest cascade, but not what a single map would have covered.
    let step = 12.0;
    scene.cameras.truncate(1);
    assert_eq!(fixture.drawn(&scene), (1..11).collect::<Vec<_>>());
    // Behind the main view and the spot's map.
    let of_sun = [2, 3, 4];
    scene.cameras[0].position.x += step;
    assert_eq!(fixture.drawn(&scene), of_sun);
    let mut single = Fixture::new(100);
    single.drawn(&scene);
    scene.cameras[0].position.x += step;
    assert!(single.drawn(&scene).is_empty());
    // One light more shifts no layer of those before it, but all are drawn.
    scene.lights.push(sun());
    assert_eq!(fixture.drawn(&scene).len(), 1 + 3 + 6 + 3);
}

/// The plan and the names of the maps stay the same.
#[test]
fn lights_that_become_others_of_another_kind_draw_their_maps() {
    let (position, intensity) = (DVec3::new(3.0, 30.0, 3.0), Vec3::splat(100.0));
    let hemispherical =
        Light::Hemispherical { position, direction: Vec3::NEG_Y, intensity, range: 60.0, casts_shadow: true };
    let (mut scene, mut fixture) = (two_lights(), Fixture::new(100));
    scene.lights = vec![spot(3.0), hemispherical, spot(5.0)];
    let all = [2, 3, 4];
    assert_eq!(fixture.drawn(&scene), all);
    scene.lights.swap(0, 2);
    assert!(fixture.drawn(&scene).is_empty(), "lights of one kind keep their maps while they move");
    scene.lights.swap(1, 2);
    assert_eq!(fixture.drawn(&scene), all);
}

#[test]
fn a_cached_map_costs_no_culling_and_no_commands() {
    let (scene, mut fixture) = (two_lights(), Fixture::new(4));
    fixture.drawn(&scene);
    assert!(fixture.renderer.draw_list("shadow casters", 2).is_some());
    let recorded = fixture.renderer.record(scene.as_scene_ref()).unwrap();
    for view in &recorded.statistics().views[2..] {
        assert_eq!((view.age, view.visible, view.commands, view.batches, view.bundles), (1, 0, 0, 0, 0));
    }
    assert!(recorded.queues()[2..].iter().all(|queue| queue.passes.is_empty()));
    assert!(fixture.renderer.draw_list("shadow casters", 2).is_none());
    assert!(!fixture.renderer.stage_graph_to_dot().unwrap().contains("shadow casters"));
}

#[test]
fn movements_do_not_draw_cached_maps_early() {
    let (mut scene, mut fixture) = (two_lights(), Fixture::new(100));
    assert_eq!(fixture.drawn(&scene), [2, 3, 4]);
    let handle = scene.objects().next().unwrap();
    let object = scene.object(handle).unwrap();
    let moves: [&dyn Fn(&mut Scene); 4] = [
        &|scene| scene.lights[0] = spot(3.5),
        &|scene| scene.cameras[0].position.x += 0.5,
        &|scene| scene.cameras[1].size = [50, 40],
        &|scene| scene.replace_object(handle, object).unwrap(),
    ];
    for change in moves {
        change(&mut scene);
        assert!(fixture.drawn(&scene).is_empty());
    }
}

#[test]
fn a_change_of_maps_draws_all_of_them_at_once() {
    let (mut scene, mut fixture) = (two_lights(), Fixture::new(100));
    fixture.drawn(&scene);
    type Change<'a> = &'a dyn Fn(&mut Scene);
    let changes: [(&str, Change<'_>, &[usize]); 10] = [
        ("another plan", &|scene| scene.lights.push(lamp()), &[2, 3, 4]),
        ("a light added", &|scene| scene.lights.push(spot(-3.0)), &[2, 3, 4, 5]),
        ("a light in between", &|scene| scene.lights.insert(0, lamp()), &[2, 3, 4, 5]),
        ("two lights swapped", &|scene| scene.lights.swap(1, 2), &[2, 3, 4, 5]),
        ("a light removed", &|scene| _ = scene.lights.pop(), &[2, 3, 4]),
        ("another light added", &|scene| scene.lights.push(spot(8.0)), &[2, 3, 4, 5]),
        (
            "a camera added that shares the maps of another one",
            &|scene| scene.cameras.push(scene.cameras[0].clone()),
            &[],
        ),
        ("that camera removed", &|scene| _ = scene.cameras.pop(), &[]),
        ("one more light casts shadows", &|scene| scene.lights[0] = sun(), &[2, 3, 4, 5, 6, 7]),
        ("a camera removed that had maps", &|scene| _ = scene.cameras.pop(), &[1, 2, 3, 4]),
    ];
    for (what, change, drawn) in changes {
        change(&mut scene);
        assert_eq!(fixture.drawn(&scene), drawn, "{what}");
        assert!(fixture.drawn(&scene).is_empty(), "the frame after {what}");
    }
}

#[test]
fn a_change_of_quality_or_pipeline_draws_all_maps_at_once() {
    let (scene, mut fixture) = (two_lights(), Fixture::new(100));
    fixture.drawn(&scene);
    fixture.renderer.set_quality(quality_with(50)).unwrap();
    assert_eq!(fixture.drawn(&scene), [2, 3, 4]);
    assert!(fixture.drawn(&scene).is_empty());
    let maps = ShadowMaps { side: 64, ..ShadowMaps::default() };
    fixture.renderer.set_pipeline(Deferred::to_picture().shadow_maps(Some(maps))).unwrap();
    assert_eq!(fixture.drawn(&scene), [2, 3, 4]);
    assert!(fixture.drawn(&scene).is_empty());
    fixture.renderer.set_quality(quality_with(1)).unwrap();
    assert_eq!(fixture.drawn(&scene), [2, 3, 4]);
    assert_eq!(fixture.drawn(&scene), [2, 3, 4]);
}

#[test]
fn maps_of_frames_that_were_not_submitted_are_not_cached() {
    let (scene, mut fixture) = (two_lights(), Fixture::new(100));
    // A frame that is never submitted.
    drop(fixture.renderer.record(scene.as_scene_ref()).unwrap());
    assert_eq!(fixture.drawn(&scene), [2, 3, 4]);
    // The second frame is recorded before the first one is dropped.
    fixture.renderer.set_quality(quality_with(100)).unwrap();
    let first = fixture.renderer.record(scene.as_scene_ref()).unwrap();
    let second = fixture.renderer.record(scene.as_scene_ref()).unwrap();
    drop(first);
    fixture.submitter.submit(second).unwrap();
    assert_eq!(fixture.drawn(&scene), [2, 3, 4]);
    // A failed frame.
    let mut bad = two_lights();
    bad.cameras[0].position.x = 1e300;
    assert!(fixture.renderer.record(bad.as_scene_ref()).is_err());
    assert_eq!(fixture.drawn(&scene), [2, 3, 4]);
    assert!(fixture.drawn(&scene).is_empty());
}
