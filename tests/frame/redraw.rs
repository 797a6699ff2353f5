//! Views that are not drawn in every frame: which frames draw them, and what the others leave out.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::DVec3;
use drawloom::process::{
    ClearColor, CommandDraws, Declare, Deferred, Draws, Format, InjectionPoint, RenderProcess, ToneMapping,
};
use drawloom::quality::Quality;
use drawloom::scene::{Camera, MaterialPredicate, ObjectSet, Redraw, Scene, SceneError, ViewFilter, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{FrameError, Renderer, Submitter};
use drawloom_testing::scenes::field;

use crate::declaring::Declaring;

/// Samples the view `screen`, so that reflections are drawn.
struct Screens;

impl RenderProcess for Screens {
    fn name(&self) -> &str {
        "screens"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterLighting);
        declare.samples_view(ViewKind::Reflection, "screen 0", "radiance");
        declare.draws_over("radiance");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws::default())
    }
}

struct Fixture {
    renderer: Renderer<NullBackend>,
    submitter: Submitter<NullBackend>,
}

impl Fixture {
    fn new(workers: usize) -> Self {
        let scheduler = Arc::new(Scheduler::new(workers).unwrap());
        let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).process(Screens);
        let (renderer, submitter) = builder.build(scheduler).unwrap();
        Self { renderer, submitter }
    }

    /// Draws a frame, and returns for each view whether it has passes. Checks that the statistics say the same.
    fn drawn(&mut self, scene: &Scene) -> Vec<bool> {
        let recorded = self.renderer.record(scene.as_scene_ref()).unwrap();
        let ages: Vec<_> = recorded.statistics().views.iter().map(|view| view.age).collect();
        let passes = self.submitter.submit(recorded).unwrap().submission.passes;
        let drawn: Vec<_> = (0..ages.len()).map(|view| passes.iter().any(|pass| pass.view == view)).collect();
        assert_eq!(drawn, ages.iter().map(|age| *age == 0).collect::<Vec<_>>());
        drawn
    }
}

/// A main camera, and screens that are redrawn like this.
fn scene_with(redraws: &[Redraw]) -> Scene {
    let mut scene = field(60);
    scene.lights.clear();
    let main = Camera::looking_at("main", DVec3::new(0.0, 0.0, 30.0), DVec3::ZERO);
    scene.cameras = vec![main.clone()];
    for (index, &redraw) in redraws.iter().enumerate() {
        let name = format!("screen {index}");
        scene.cameras.push(Camera { name, kind: ViewKind::Reflection, redraw, ..main.clone() });
    }
    scene
}

#[test]
fn views_of_an_interval_take_turns() {
    for (interval, views) in [(2, 1), (3, 1), (2, 4), (3, 5), (4, 3), (5, 12), (100, 3)] {
        let (scene, mut fixture) = (scene_with(&vec![Redraw::Interval(interval); views]), Fixture::new(2));
        let interval = interval as usize;
        let frames: Vec<_> = (0..4 * interval).map(|_| fixture.drawn(&scene)).collect();
        assert!(frames.iter().all(|frame| frame[0]) && frames[0].iter().all(|drawn| *drawn));
        let steady = &frames[interval..];
        for view in 1..=views {
            let drawn = |frames: &[Vec<bool>]| frames.iter().filter(|frame| frame[view]).count();
            assert!(steady.windows(interval).all(|window| drawn(window) == 1), "view {view} of {views}, {interval}");
        }
        let loads: Vec<_> = steady.iter().map(|frame| frame[1..].iter().filter(|drawn| **drawn).count()).collect();
        let [min, max] = [loads.iter().min(), loads.iter().max()].map(|load| *load.unwrap());
        assert!(max - min <= 1, "{interval}: {loads:?}");
    }
}

#[test]
fn views_of_different_intervals_keep_to_theirs() {
    use Redraw::{EveryFrame, Interval, OnCameraChange};
    let redraws = [Interval(2), Interval(3), EveryFrame, Interval(2), OnCameraChange, Interval(1)];
    let (scene, mut fixture) = (scene_with(&redraws), Fixture::new(2));
    let frames: Vec<_> = (0..13).map(|_| fixture.drawn(&scene)).collect();
    let count = |view: usize| frames[1..].iter().filter(|frame| frame[view]).count();
    assert_eq!([1, 2, 3, 4, 5, 6].map(count), [6, 4, 12, 6, 0, 12]);
    assert!(frames[1..].iter().all(|frame| frame[1] != frame[4]), "views of interval 2 take turns");
}

#[test]
fn a_view_whose_turn_moves_is_drawn_after_its_interval() {
    let (mut scene, mut fixture) = (scene_with(&[Redraw::Interval(4)]), Fixture::new(1));
    let frames: Vec<_> = (0..4).map(|_| fixture.drawn(&scene)[1]).collect();
    assert_eq!(frames, [true, false, false, false]);
    // The new view takes its turn.
    scene.cameras.insert(1, Camera { name: "screen 1".to_owned(), ..scene.cameras[1].clone() });
    assert_eq!(fixture.drawn(&scene), [true, true, true]);
}

/// A main camera and others of a renderer without a pipeline. They are drawn when they move.
fn still_views(declares: impl Fn(&mut Declare) + Send + Sync + 'static) -> (Scene, Fixture) {
    let builder = Renderer::builder(NullBackend).process(Declaring::new("own", declares));
    let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    let mut scene = scene_with(&[Redraw::OnCameraChange; 2]);
    scene.cameras[1..].iter_mut().for_each(|camera| camera.kind = ViewKind::Main);
    (scene, Fixture { renderer, submitter })
}

#[test]
fn another_quality_draws_all_views() {
    let (scene, mut fixture) = still_views(|declare| {
        declare.clears_color("picture", Format::Rgba8Unorm, ClearColor::Background);
        declare.keep();
    });
    assert_eq!([fixture.drawn(&scene), fixture.drawn(&scene)], [[true; 3], [true, false, false]]);
    fixture.renderer.set_quality(Quality::fast()).unwrap();
    assert_eq!([fixture.drawn(&scene), fixture.drawn(&scene)], [[true; 3], [true, false, false]]);
}

#[test]
fn views_that_get_other_layers_of_a_texture_are_drawn() {
    let (mut scene, mut fixture) = still_views(|declare| {
        declare.clears_depth_layer("layers", Format::Depth32Float);
        declare.keep();
    });
    assert_eq!([fixture.drawn(&scene), fixture.drawn(&scene)], [[true; 3], [true, false, false]]);
    scene.cameras.remove(1);
    assert_eq!([fixture.drawn(&scene), fixture.drawn(&scene)], [[true; 2], [true, false]]);
}

#[test]
fn a_cached_view_has_no_stages() {
    let (mut scene, mut fixture) = (scene_with(&[Redraw::Interval(3)]), Fixture::new(2));
    scene.lights = field(1).lights;
    fixture.drawn(&scene);
    assert!(fixture.renderer.stage_graph_to_dot().unwrap().contains("screen 0"));
    assert_eq!(fixture.drawn(&scene), [true, false]);
    assert!(!fixture.renderer.stage_graph_to_dot().unwrap().contains("screen 0"));
    assert!(fixture.renderer.draw_list("geometry buffer", 1).is_none());
    let recorded = fixture.renderer.record(scene.as_scene_ref()).unwrap();
    let [main, screen] = &recorded.statistics().views[..] else { panic!("two views") };
    assert!(main.age == 0 && main.visible > 0);
    assert_eq!((screen.age, screen.visible, screen.lights, screen.commands, screen.batches), (2, 0, 0, 0, 0));
}

#[test]
fn a_view_is_drawn_early_if_its_targets_do_not_hold_it() {
    let (mut scene, mut fixture) = (scene_with(&[Redraw::Interval(100); 2]), Fixture::new(2));
    assert_eq!(fixture.drawn(&scene), [true, true, true]);
    assert_eq!(fixture.drawn(&scene), [true, false, false]);
    scene.cameras[1].size = [40, 30];
    assert_eq!(fixture.drawn(&scene), [true, true, false], "another size");
    scene.cameras[2].redraw = Redraw::EveryFrame;
    assert_eq!(fixture.drawn(&scene), [true, false, true]);
    // Targets of views that are drawn in every frame may be transient.
    scene.cameras[2].redraw = Redraw::Interval(50);
    assert_eq!(fixture.drawn(&scene), [true, false, true], "drawn in every frame before");
    assert_eq!(fixture.drawn(&scene), [true, false, false]);
    let screen = scene.cameras.remove(1);
    assert_eq!(fixture.drawn(&scene), [true, false], "the other one is left out");
    scene.cameras.insert(0, screen);
    assert_eq!(fixture.drawn(&scene), [true, true, false], "it is back");
    scene.cameras.rotate_left(1);
    assert_eq!(fixture.drawn(&scene), [true, false, false], "another order");
    scene.cameras[1].name = "other".to_owned();
    assert_eq!(fixture.drawn(&scene), [true, true, false], "another name");
}

#[test]
fn a_view_is_redrawn_if_its_filter_is_not_equal() {
    let (mut scene, mut fixture) = (scene_with(&[Redraw::OnCameraChange]), Fixture::new(2));
    let predicate = || MaterialPredicate::new(|material| material.double_sided);
    let (one, other) = (predicate(), predicate());
    let mut is_drawn = |filter: ViewFilter| {
        scene.cameras[1].filter = filter;
        fixture.drawn(&scene)[1]
    };
    assert!(is_drawn(ViewFilter::ALL) && !is_drawn(ViewFilter::ALL));
    assert!(is_drawn(ViewFilter::only(ObjectSet::new([1, 7]))));
    assert!(!is_drawn(ViewFilter::only(ObjectSet::new([7, 1]))), "the same objects");
    assert!(is_drawn(ViewFilter::except(ObjectSet::new([1, 7]))));
    assert!(is_drawn(ViewFilter::ALL.of_materials(one.clone())) && !is_drawn(ViewFilter::ALL.of_materials(one)));
    assert!(is_drawn(ViewFilter::ALL.of_materials(other)), "another function");
}

#[test]
fn all_views_are_drawn_after_a_change_of_the_plan_or_a_lost_frame() {
    let (mut scene, mut fixture) = (scene_with(&[Redraw::Interval(100), Redraw::OnCameraChange]), Fixture::new(2));
    let (all, main) = ([true; 3], [true, false, false]);
    assert_eq!(fixture.drawn(&scene), all);
    assert_eq!(fixture.drawn(&scene), main);
    scene.lights = field(1).lights;
    assert_eq!(fixture.drawn(&scene), all, "another plan");
    fixture.renderer.set_quality(Quality::fast()).unwrap();
    assert_eq!(fixture.drawn(&scene), all, "another quality");
    fixture.renderer.set_pipeline(Deferred::new().post(ToneMapping::default())).unwrap();
    assert_eq!(fixture.drawn(&scene), all, "another pipeline");
    assert_eq!(fixture.drawn(&scene), main);
    drop(fixture.renderer.record(scene.as_scene_ref()).unwrap());
    assert_eq!(fixture.drawn(&scene), all, "after a frame that was dropped");
    assert_eq!(fixture.drawn(&scene), main);
    let position = std::mem::replace(&mut scene.cameras[0].position, DVec3::splat(1e300));
    assert!(fixture.renderer.record(scene.as_scene_ref()).is_err());
    scene.cameras[0].position = position;
    assert_eq!(fixture.drawn(&scene), all, "after a frame that failed");
    assert_eq!(fixture.drawn(&scene), main);
}

#[test]
fn a_view_that_waits_for_its_camera_is_drawn_when_that_changes() {
    let (mut scene, mut fixture) = (scene_with(&[Redraw::OnCameraChange]), Fixture::new(2));
    fixture.drawn(&scene);
    let changes: [&dyn Fn(&mut Camera); 3] =
        [&|camera| camera.position.x += 0.5, &|camera| camera.near *= 2.0, &|camera| camera.size = [30, 20]];
    for change in changes {
        assert_eq!(fixture.drawn(&scene), [true, false]);
        scene.cameras[0].position.x += 1.0;
        assert_eq!(fixture.drawn(&scene), [true, false], "another camera");
        change(&mut scene.cameras[1]);
        assert_eq!(fixture.drawn(&scene), [true, true]);
    }
}

#[test]
fn workers_do_not_change_which_views_are_drawn() {
    let scene = scene_with(&[Redraw::Interval(2), Redraw::Interval(3), Redraw::Interval(3)]);
    let frames = |workers| {
        let mut fixture = Fixture::new(workers);
        (0..7).map(|_| fixture.drawn(&scene)).collect::<Vec<_>>()
    };
    assert_eq!(frames(1), frames(2));
    assert_eq!(frames(1), frames(4));
}

#[test]
fn a_frame_may_have_only_cached_views() {
    let mut scene = scene_with(&[]);
    scene.cameras[0].redraw = Redraw::Interval(2);
    let mut fixture = Fixture::new(2);
    let frames: Vec<_> = (0..4).flat_map(|_| fixture.drawn(&scene)).collect();
    assert_eq!(frames, [true, false, true, false]);
}

#[test]
fn an_interval_of_0_frames_is_an_error() {
    let (scene, mut fixture) = (scene_with(&[Redraw::Interval(0)]), Fixture::new(1));
    let error = fixture.renderer.record(scene.as_scene_ref()).err().unwrap();
    let is_named =
        matches!(&error, FrameError::Scene(SceneError::InvalidCamera { camera, .. }) if camera == "screen 0");
    assert!(is_named && error.to_string().contains("0 frames"), "{error}");
}
