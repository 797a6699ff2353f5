//! What a view's objects hide is left out of it, and of nothing else.

use std::collections::BTreeSet;
use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::command::{Blending, Selection};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{CommandDraws, Declare, Deferred, Draws, Format, RenderProcess};
use drawloom::quality::{CullingVolume, Quality};
use drawloom::scene::{Blend, Camera, Light, Material, RenderObject, Scene, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{FrameStatistics, Granularity, Renderer};
use drawloom_testing::scenes::{cube, field, sized};

/// Before the first camera and behind the second a wall; behind it, or before it, and beside it small cubes, one in four of which
/// is glass.
fn yard() -> Scene {
    let mut scene = Scene::new();
    let mesh = scene.add(cube()).unwrap();
    let stone = scene.add(Material::default()).unwrap();
    let glass = scene.add(Material { blend: Blend::Alpha, opacity: 0.5, ..Material::default() }).unwrap();
    let wall = RenderObject::new(mesh, stone, DVec3::Z * -10.0);
    scene.add_object(RenderObject { scale: Vec3::new(4.0, 4.0, 0.1), ..wall }).unwrap();
    for index in 0..300 {
        let place = DVec3::new(f64::from(index % 20) - 9.5, f64::from(index / 20) * 0.5 - 3.5, -20.0);
        let material = if index % 4 == 0 { glass } else { stone };
        let object = RenderObject::new(mesh, material, place);
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
    let builder = Renderer::builder(NullBackend).deferred(Deferred::to_picture()).quality(quality);
    builder.granularity(granularity).build(scheduler).unwrap().0
}

fn renderer(occlusion: Option<u32>, workers: usize, granularity: Granularity) -> Renderer<NullBackend> {
    with_quality(Quality { occlusion, ..Quality::balanced() }, workers, granularity)
}

/// What the next frame draws by a process, in each of the scene's cameras.
fn drawn(renderer: &mut Renderer<NullBackend>, scene: &Scene, process: &str) -> (Vec<BTreeSet<u32>>, FrameStatistics) {
    let statistics = renderer.record(scene.as_scene_ref()).unwrap().statistics().clone();
    let objects = |view| renderer.draw_list(process, view).unwrap().objects.iter().copied().collect();
    ((0..scene.cameras.len()).map(objects).collect(), statistics)
}

#[test]
fn what_is_hidden_is_not_drawn_and_all_else_is() {
    let scene = yard();
    // All of a cube is behind the wall that is 4 m wide to either side at 9.9 m: a metre of slack for squares of 8 pixels.
    let is_behind = |object: u32, within: f64| {
        let place = scene.as_scene_ref().positions[object as usize];
        object > 0 && place.x.abs().max(place.y.abs()) < within
    };
    for process in ["geometry buffer", "transparency"] {
        let (all, before) = drawn(&mut renderer(None, 2, Granularity::default()), &scene, process);
        assert!(before.views.iter().all(|view| view.occluded == 0));
        let (left, statistics) = drawn(&mut renderer(Some(8), 2, Granularity::default()), &scene, process);
        assert_eq!(left[1], all[1], "nothing is hidden from the other side");
        assert_eq!(statistics.views[1].occluded, 0);
        assert!(left[0].is_subset(&all[0]) && left[0].len() < all[0].len() / 2 && !left[0].is_empty());
        let hidden: BTreeSet<u32> = all[0].difference(&left[0]).copied().collect();
        assert!(hidden.iter().all(|&object| is_behind(object, 8.0)), "{hidden:?}");
        assert!(left[0].iter().all(|&object| !is_behind(object, 6.5)), "{:?}", left[0]);
        let [was, is] = [&before.views[0], &statistics.views[0]];
        assert_eq!(is.visible + is.occluded, was.visible);
        assert!(is.occluded > hidden.len() && is.commands < was.commands, "{is:?}");
    }
}

#[test]
fn whoever_does_the_work_the_same_is_hidden() {
    for scene in [yard(), field(3000)] {
        for side in Quality::OCCLUSION_TILE_SIZES {
            let first = |workers, granularity| {
                let (lists, statistics) =
                    drawn(&mut renderer(Some(side), workers, granularity), &scene, "geometry buffer");
                (lists, statistics.views)
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
fn it_is_left_out_now_and_then_and_that_changes_no_picture_list_but_by_what_is_hidden() {
    let scene = yard();
    let mut with = renderer(Some(4), 1, Granularity::default());
    let all = drawn(&mut renderer(None, 1, Granularity::default()), &scene, "geometry buffer").0;
    let left = drawn(&mut with, &scene, "geometry buffer").0;
    let mut lists = BTreeSet::new();
    for _ in 0..20 {
        let (drawn, statistics) = drawn(&mut with, &scene, "geometry buffer");
        let is_on = statistics.views[0].occluded > 0;
        assert_eq!(drawn, if is_on { left.clone() } else { all.clone() });
        lists.insert(is_on);
    }
    assert_eq!(lists.len(), 2, "it is tried, and so is to do without");
}

#[test]
fn quality_changes_between_frames() {
    let scene = yard();
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

#[test]
fn shadow_maps_keep_what_is_hidden_from_the_light() {
    let mut scene = yard();
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

/// Draws objects before the depth that it declares.
struct Own(fn(&mut Declare));

impl RenderProcess for Own {
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
fn where_something_is_drawn_whatever_is_before_it_nothing_is_left_out() {
    let scene = yard();
    let occluded = |depth: fn(&mut Declare)| {
        let quality = Quality { occlusion: Some(4), ..Quality::balanced() };
        let builder =
            Renderer::builder(NullBackend).deferred(Deferred::to_picture()).process(Own(depth)).quality(quality);
        let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
        renderer.record(scene.as_scene_ref()).unwrap().statistics().views[0].occluded
    };
    assert!(occluded(|declare| declare.tests_depth("depth")) > 0);
    assert_eq!(occluded(|_| {}), 0, "without any depth");
    assert_eq!(occluded(|declare| declare.clears_depth("depth", Format::Depth32Float)), 0, "cleared again");
    assert_eq!(occluded(|declare| declare.clears_depth("another depth", Format::Depth32Float)), 0);
}

/// Only glass is drawn, so that there is nothing to hide behind.
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
        let selection = Selection { blending: Blending::Blended, ..Selection::ALL };
        Draws::Commands(CommandDraws { selection, ..CommandDraws::default() })
    }
}

#[test]
fn what_is_not_drawn_hides_nothing() {
    let quality = Quality { occlusion: Some(4), culling: CullingVolume::Sphere, ..Quality::balanced() };
    let builder = Renderer::builder(NullBackend).process(Glass).output("picture").quality(quality);
    let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    assert_eq!(renderer.record(yard().as_scene_ref()).unwrap().statistics().views[0].occluded, 0);
    assert!(!renderer.jobs_to_dot().unwrap().contains("coarse depth"), "so nobody looks");
}
