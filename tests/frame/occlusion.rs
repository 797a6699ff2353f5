//! Occlusion culling leaves out objects hidden in a view, and only those.

use std::collections::BTreeSet;
use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::command::Selection;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{CommandDraws, Declare, Deferred, Deformation, Draws, Format, RenderProcess};
use drawloom::quality::{CullingVolume, Quality};
use drawloom::scene::{Blend, Camera, Changes, LayerMask, Light, Material, RenderObject, Scene, SceneRef, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{FrameStatistics, Granularity, Renderer, ViewStatistics};
use drawloom_testing::scenes::{cube, field, sized};

/// A wall in front of the first camera, and small cubes behind and beside it, one in four of them glass. The second
/// camera views the scene from behind, so that its cubes are in front of the wall.
pub fn wall_and_cubes() -> Scene {
    let mut scene = Scene::new();
    let mesh = scene.add(cube()).unwrap();
    let stone = scene.add(Material::default()).unwrap();
    let glass = scene.add(Material { blend: Blend::Alpha, opacity: 0.5, ..Material::default() }).unwrap();
    let wall = RenderObject::new(mesh, stone, DVec3::Z * -10.0);
    scene.add_object(RenderObject { scale: Vec3::new(4.0, 4.0, 0.1), ..wall }).unwrap();
    for index in 0..300 {
        let position = DVec3::new(f64::from(index % 20) - 9.5, f64::from(index / 20) * 0.5 - 3.5, -20.0);
        let material = if index % 4 == 0 { glass } else { stone };
        let object = RenderObject::new(mesh, material, position);
        scene.add_object(RenderObject { scale: Vec3::splat(0.2), ..object }).unwrap();
    }
    scene.cameras = vec![
        sized(Camera::looking_at("before", DVec3::ZERO, DVec3::NEG_Z), [320, 240]),
        sized(Camera::looking_at("behind", DVec3::Z * -40.0, DVec3::ZERO), [320, 240]),
    ];
    scene.ambient = Vec3::ONE;
    scene
}

fn with_quality(quality: Quality, workers: usize, granularity: Granularity) -> Renderer<NullBackend> {
    let scheduler = Arc::new(Scheduler::new(workers).unwrap());
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).quality(quality);
    builder.granularity(granularity).build(scheduler).unwrap().0
}

fn renderer(occlusion: Option<u32>, workers: usize, granularity: Granularity) -> Renderer<NullBackend> {
    with_quality(Quality { occlusion, ..Quality::balanced() }, workers, granularity)
}

/// The objects that a process draws in the next frame, for each camera of the scene.
fn drawn(renderer: &mut Renderer<NullBackend>, scene: &Scene, process: &str) -> (Vec<BTreeSet<u32>>, FrameStatistics) {
    let statistics = renderer.record(scene.as_scene_ref()).unwrap().statistics().clone();
    let objects = |view| renderer.draw_list(process, view).unwrap().objects.iter().copied().collect();
    ((0..scene.cameras.len()).map(objects).collect(), statistics)
}

#[test]
fn hidden_objects_are_culled_and_all_others_are_drawn() {
    let scene = wall_and_cubes();
    // The wall at 9.9 m is 4 m wide to either side. A metre of slack allows for tiles of 8 pixels.
    let is_behind = |object: u32, within: f64| {
        let position = scene.as_scene_ref().positions[object as usize];
        object > 0 && position.x.abs().max(position.y.abs()) < within
    };
    for process in ["geometry buffer", "transparency"] {
        let (all, before) = drawn(&mut renderer(None, 2, Granularity::default()), &scene, process);
        assert!(before.views.iter().all(|view| view.occluded == 0));
        let (remaining, statistics) = drawn(&mut renderer(Some(8), 2, Granularity::default()), &scene, process);
        assert_eq!(remaining[1], all[1], "nothing is hidden from the other side");
        assert_eq!(statistics.views[1].occluded, 0);
        assert!(remaining[0].is_subset(&all[0]) && remaining[0].len() < all[0].len() / 2 && !remaining[0].is_empty());
        let hidden: BTreeSet<u32> = all[0].difference(&remaining[0]).copied().collect();
        assert!(hidden.iter().all(|&object| is_behind(object, 8.0)), "{hidden:?}");
        assert!(remaining[0].iter().all(|&object| !is_behind(object, 6.5)), "{:?}", remaining[0]);
        let [without, with] = [&before.views[0], &statistics.views[0]];
        assert_eq!(with.visible + with.occluded, without.visible);
        assert!(with.occluded > hidden.len() && with.commands < without.commands, "{with:?}");
    }
}

#[test]
fn what_was_hidden_is_drawn_when_its_occluder_moves_away() {
    let mut scene = wall_and_cubes();
    let mut renderer = renderer(Some(8), 1, Granularity::default());
    let (behind_the_wall, _) = drawn(&mut renderer, &scene, "geometry buffer");
    let wall = scene.objects().next().unwrap();
    let moved = RenderObject { position: DVec3::X * 1e4, ..scene.object(wall).unwrap() };
    scene.replace_object(wall, moved).unwrap();
    drop(renderer.record(SceneRef { changes: Changes::Objects(&[0]), ..scene.as_scene_ref() }).unwrap());
    let found: BTreeSet<u32> = renderer.draw_list("geometry buffer", 0).unwrap().objects.iter().copied().collect();
    let (expected, _) = drawn(&mut self::renderer(None, 1, Granularity::default()), &scene, "geometry buffer");
    assert!(found == expected[0] && found.len() > 2 * behind_the_wall[0].len(), "{found:?}");
}

#[test]
fn workers_and_granularity_do_not_change_the_occluded_objects() {
    for scene in [wall_and_cubes(), field(3000)] {
        for side in Quality::OCCLUSION_TILE_SIZES {
            let first = |workers, granularity| {
                let (lists, statistics) =
                    drawn(&mut renderer(Some(side), workers, granularity), &scene, "geometry buffer");
                // The granularity decides how many draws are in a bundle.
                let views = statistics.views.into_iter().map(|view| ViewStatistics { bundles: 0, ..view });
                (lists, views.collect::<Vec<_>>())
            };
            let expected = first(1, Granularity::PerCamera);
            assert!(side > 8 || expected.1[0].occluded > 0, "{side}");
            for granularity in
                [Granularity::PerDraw, Granularity::Chunk(7), Granularity::Chunk(300), Granularity::Adaptive]
            {
                assert!(first(2, granularity) == expected, "{granularity:?} at {side}");
            }
        }
    }
}

#[test]
fn the_occlusion_policy_draws_frames_with_and_without_culling_that_differ_only_in_occluded_objects() {
    let scene = wall_and_cubes();
    let mut with = renderer(Some(4), 1, Granularity::default());
    let all = drawn(&mut renderer(None, 1, Granularity::default()), &scene, "geometry buffer").0;
    let remaining = drawn(&mut with, &scene, "geometry buffer").0;
    let mut lists = BTreeSet::new();
    for _ in 0..20 {
        let (drawn, statistics) = drawn(&mut with, &scene, "geometry buffer");
        let is_on = statistics.views[0].occluded > 0;
        assert_eq!(drawn, if is_on { remaining.clone() } else { all.clone() });
        lists.insert(is_on);
    }
    assert_eq!(lists.len(), 2, "frames with and without culling are tried");
}

#[test]
fn quality_changes_between_frames() {
    let scene = wall_and_cubes();
    let mut renderer = renderer(None, 2, Granularity::default());
    let mut occluded = |occlusion| {
        renderer.set_quality(Quality { occlusion, ..Quality::balanced() }).unwrap();
        drawn(&mut renderer, &scene, "geometry buffer").1.views[0].occluded
    };
    assert_eq!(occluded(None), 0);
    let coarse = occluded(Some(16));
    let fine = occluded(Some(1));
    assert!(0 < coarse && coarse < fine, "{coarse} {fine}");
    assert_eq!(occluded(None), 0);
}

/// Objects of layer 2 have another shape than their meshes.
struct Deformed;

impl Deformation for Deformed {
    fn name(&self) -> &str {
        "deformed"
    }

    fn layers(&self) -> LayerMask {
        LayerMask::layer(2)
    }

    fn declare(&self, _: &mut Declare) {}

    fn shader(&self) -> &str {
        ""
    }
}

#[test]
fn deformed_objects_hide_no_others() {
    let scene = wall_and_cubes();
    let quality = Quality { occlusion: Some(4), ..Quality::balanced() };
    let occluded = |layer_of_wall| {
        let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture().deformation(Deformed));
        let scheduler = Arc::new(Scheduler::new(2).unwrap());
        let mut renderer = builder.quality(quality).build(scheduler).unwrap().0;
        let mut layers = vec![LayerMask::layer(1); scene.as_scene_ref().positions.len()];
        layers[0] = LayerMask::layer(layer_of_wall);
        let scene = SceneRef { layers: &layers, ..scene.as_scene_ref() };
        renderer.record(scene).unwrap().statistics().views[0].occluded
    };
    assert_eq!(occluded(2), 0);
    assert!(occluded(1) > 0);
}

#[test]
fn shadow_maps_are_not_occlusion_culled() {
    let mut scene = wall_and_cubes();
    scene.cameras.truncate(1);
    scene.lights = vec![Light::Spot {
        position: DVec3::ZERO,
        direction: Vec3::NEG_Z,
        intensity: Vec3::splat(100.0),
        range: 60.0,
        inner_angle: 0.3,
        outer_angle: 0.4,
        casts_shadow: true,
    }];
    let views =
        |occlusion| drawn(&mut renderer(occlusion, 2, Granularity::default()), &scene, "geometry buffer").1.views;
    let (without, with) = (views(None), views(Some(4)));
    assert_eq!(with[1].kind, ViewKind::Shadow);
    assert_eq!(with[1], without[1]);
    assert!(with[0].occluded > 0);
}

/// Draws objects with the depth test that it declares.
struct OwnProcess(fn(&mut Declare));

impl RenderProcess for OwnProcess {
    fn name(&self) -> &str {
        "own"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.draws_over("radiance");
        (self.0)(declare);
        declare.after("transparency");
        declare.before("tone mapping");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws { selection: Selection::ALL, ..CommandDraws::default() })
    }
}

#[test]
fn nothing_is_culled_if_a_process_draws_without_the_depth_test() {
    let scene = wall_and_cubes();
    let occluded = |depth: fn(&mut Declare)| {
        let quality = Quality { occlusion: Some(4), ..Quality::balanced() };
        let builder =
            Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).process(OwnProcess(depth)).quality(quality);
        let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
        renderer.record(scene.as_scene_ref()).unwrap().statistics().views[0].occluded
    };
    assert!(occluded(|declare| declare.tests_depth("depth")) > 0);
    assert_eq!(occluded(|_| {}), 0, "without any depth");
    assert_eq!(occluded(|declare| declare.clears_depth("depth", Format::Depth32Float)), 0, "cleared again");
    assert_eq!(occluded(|declare| declare.clears_depth("another depth", Format::Depth32Float)), 0);
}

/// Draws the opaque objects of layer 1.
struct FirstLayer;

impl RenderProcess for FirstLayer {
    fn name(&self) -> &str {
        "first layer"
    }

    fn declare(&self, declare: &mut Declare) {
        Glass.declare(declare);
    }

    fn draws(&self) -> Draws<'_> {
        let selection = Selection::OPAQUE.in_layers(LayerMask(1));
        Draws::Commands(CommandDraws { selection, ..CommandDraws::default() })
    }
}

#[test]
fn objects_of_other_layers_occlude_nothing() {
    let quality = Quality { occlusion: Some(4), culling: CullingVolume::Sphere, ..Quality::balanced() };
    let scene = wall_and_cubes();
    let occluded = |wall: LayerMask| {
        let builder = Renderer::builder(NullBackend).process(FirstLayer).output("picture").quality(quality);
        let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
        let mut layers = vec![LayerMask(1); scene.object_count()];
        layers[0] = wall;
        let recorded = renderer.record(SceneRef { layers: &layers, ..scene.as_scene_ref() });
        recorded.unwrap().statistics().views[0].occluded
    };
    assert!(occluded(LayerMask(1)) > 100);
    assert_eq!(occluded(LayerMask(2)), 0, "nothing draws the wall");
}

/// Draws only glass, which occludes nothing.
struct Glass;

impl RenderProcess for Glass {
    fn name(&self) -> &str {
        "glass"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("picture", Format::Rgba8Srgb, drawloom::process::ClearColor::Background);
        declare.clears_depth("depth", Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        let selection = Selection::BLENDED;
        Draws::Commands(CommandDraws { selection, ..CommandDraws::default() })
    }
}

/// Draws all objects, perhaps with holes that only its shader knows.
struct Cutouts {
    discards: bool,
}

impl RenderProcess for Cutouts {
    fn name(&self) -> &str {
        "cutouts"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("picture", Format::Rgba8Srgb, drawloom::process::ClearColor::Background);
        declare.clears_depth("depth", Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        let discards = self.discards;
        Draws::Commands(CommandDraws { selection: Selection::ALL, discards, ..CommandDraws::default() })
    }
}

#[test]
fn objects_of_a_process_that_discards_pixels_occlude_nothing() {
    let occluded = |discards| {
        let quality = Quality { occlusion: Some(4), ..Quality::balanced() };
        let builder = Renderer::builder(NullBackend).process(Cutouts { discards }).output("picture").quality(quality);
        let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
        renderer.record(wall_and_cubes().as_scene_ref()).unwrap().statistics().views[0].occluded
    };
    assert!(occluded(false) > 0);
    assert_eq!(occluded(true), 0);
}

#[test]
fn masked_objects_occlude_nothing_and_are_occluded() {
    let mut scene = wall_and_cubes();
    let occluded = |scene: &Scene, deferred: Deferred| {
        let quality = Quality { occlusion: Some(4), ..Quality::balanced() };
        let builder = Renderer::builder(NullBackend).pipeline(deferred).quality(quality);
        let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
        renderer.record(scene.as_scene_ref()).unwrap().statistics().views[0].occluded
    };
    let opaque = occluded(&scene, Deferred::to_picture());
    // The cubes alone, then the wall with them.
    let objects: Vec<_> = scene.objects().collect();
    let mask = scene.add(Material { alpha_cutoff: Some(0.5), ..Material::default() }).unwrap();
    let masked = |scene: &mut Scene, objects: &[drawloom::scene::ObjectHandle]| {
        for &object in objects {
            let before = scene.object(object).unwrap();
            scene.replace_object(object, RenderObject { material: mask, ..before }).unwrap();
        }
    };
    masked(&mut scene, &objects[1..]);
    assert_eq!(occluded(&scene, Deferred::to_picture()), opaque);
    masked(&mut scene, &objects[..1]);
    for deferred in [Deferred::to_picture(), Deferred::to_picture().depth_pre_pass(true)] {
        assert_eq!(occluded(&scene, deferred), 0);
    }
}

#[test]
fn objects_that_are_not_drawn_occlude_nothing() {
    let quality = Quality { occlusion: Some(4), culling: CullingVolume::Sphere, ..Quality::balanced() };
    let builder = Renderer::builder(NullBackend).process(Glass).output("picture").quality(quality);
    let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    assert_eq!(renderer.record(wall_and_cubes().as_scene_ref()).unwrap().statistics().views[0].occluded, 0);
    assert!(!renderer.stage_graph_to_dot().unwrap().contains("coarse depth"), "no coarse depth buffer is drawn");
}
