//! What other views held in the frame before: what is drawn for it, in which order, and what is refused.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{CommandDraws, Declare, Deferred, Draws, InjectionPoint, PlanError, RenderProcess, targets};
use drawloom::scene::{Camera, ClipPlane, Scene, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{BuildError, FrameError, Renderer, Submitter};
use drawloom_testing::scenes::field;

use crate::declaring::Declaring;

/// Draws mirrors with a target of the view `mirror`, of this frame or of the frame before.
#[derive(Clone, Copy)]
struct Mirror {
    target: &'static str,
    is_previous: bool,
    views: ViewKind,
}

const LATE: Mirror = Mirror { target: "radiance", is_previous: true, views: ViewKind::Reflection };

impl RenderProcess for Mirror {
    fn name(&self) -> &str {
        "mirror"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.also_views(ViewKind::Reflection);
        declare.at(InjectionPoint::AfterLighting);
        if self.is_previous {
            declare.samples_view_previous(self.views, "mirror", self.target);
        } else {
            declare.samples_view(self.views, "mirror", self.target);
        }
        declare.draws_over("radiance");
        declare.matches_depth("depth");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws::default())
    }
}

fn built(mirror: Mirror) -> Result<(Renderer<NullBackend>, Submitter<NullBackend>), BuildError> {
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).process(Declaring::multisampled());
    builder.process(mirror).build(Arc::new(Scheduler::new(2).unwrap()))
}

/// A main camera and views with these names.
fn scene(names: &[&str]) -> Scene {
    let mut scene = field(20);
    scene.lights.clear();
    let main = Camera::looking_at("main", DVec3::new(0.0, 0.0, 30.0), DVec3::ZERO);
    let named = |name: &&str| Camera { name: (*name).to_owned(), kind: ViewKind::Reflection, ..main.clone() };
    scene.cameras = std::iter::once(main.clone()).chain(names.iter().map(named)).collect();
    scene
}

/// The passes in the order in which they are submitted, without those of what each view draws anyway.
fn passes(mirror: Mirror, scene: &Scene) -> Vec<(String, usize)> {
    let (mut renderer, submitter) = built(mirror).unwrap();
    let submitted = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
    let passes = submitted.submission.passes.into_iter().map(|pass| (pass.process, pass.view));
    passes.filter(|(process, _)| process != "transparency" && process != "multisampled").collect()
}

fn named(expected: &[(&str, usize)]) -> Vec<(String, usize)> {
    expected.iter().map(|(process, view)| ((*process).to_owned(), *view)).collect()
}

#[test]
fn views_that_show_each_other_one_frame_late_are_no_circle() {
    // The view `mirror` shows its child, and the child, which has none, shows the view.
    let scene = scene(&["mirror", "mirror/mirror"]);
    let ordered = Mirror { is_previous: false, ..LATE };
    let error = built(ordered).unwrap().0.record(scene.as_scene_ref()).err();
    assert!(matches!(&error, Some(FrameError::CircularViews(_))), "{error:?}");
    // Nothing orders the views: reflections come first, as their kind does, in the order of the cameras.
    let drawn = |view| ["geometry buffer", "mirror"].map(|process| (process, view));
    let expected = [&drawn(1)[..], &drawn(2), &drawn(0), &[("tone mapping", 0)]].concat();
    assert_eq!(passes(LATE, &scene), named(&expected));
}

/// Draws in main views and reflections what the view `lamp` has in this frame.
struct Lamp;

impl RenderProcess for Lamp {
    fn name(&self) -> &str {
        "lamp"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.also_views(ViewKind::Reflection);
        declare.at(InjectionPoint::AfterTransparency);
        declare.samples_view(ViewKind::Reflection, "lamp", "radiance");
        declare.draws_over("radiance");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws::default())
    }
}

#[test]
fn views_are_ordered_by_what_they_sample_of_the_same_frame_alone() {
    let scene = scene(&["mirror", "mirror/mirror", "lamp"]);
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).process(LATE).process(Lamp);
    let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    let submitted = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
    let mut views: Vec<_> = submitted.submission.passes.iter().map(|pass| pass.view).collect();
    views.dedup();
    // The lamp shows the mirrors, and the mirrors show each other.
    assert_eq!(views, [3, 1, 2, 0]);
}

#[test]
fn a_view_that_shows_itself_one_frame_late_is_no_circle() {
    let scene = scene(&["mirror"]);
    let expected = [("geometry buffer", 1), ("mirror", 1), ("geometry buffer", 0), ("mirror", 0), ("tone mapping", 0)];
    assert_eq!(passes(LATE, &scene), named(&expected));
}

#[test]
fn a_reflection_draws_only_what_is_sampled_of_the_frame_before() {
    let mut scene = scene(&[]);
    let plane = ClipPlane { point: DVec3::new(0.0, 0.0, -40.0), normal: Vec3::Z };
    scene.cameras.push(scene.cameras[0].reflected("mirror", plane));
    let of_normals = passes(Mirror { target: "normal", ..LATE }, &scene);
    let expected = [("geometry buffer", 1), ("geometry buffer", 0), ("mirror", 0), ("tone mapping", 0)];
    assert_eq!(of_normals, named(&expected));
    let of_picture = passes(Mirror { target: "picture", ..LATE }, &scene);
    assert!(of_picture.contains(&("tone mapping".to_owned(), 1)), "{of_picture:?}");
    // Only the views that are sampled have a copy.
    let (mut renderer, _) = built(LATE).unwrap();
    drop(renderer.record(scene.as_scene_ref()).unwrap());
    let copies: Vec<_> = renderer.plan().targets().iter().filter(|target| target.copy_of.is_some()).collect();
    assert_eq!(copies.len(), 1);
    assert_eq!((copies[0].name.as_str(), copies[0].views), ("radiance of the frame before", ViewKind::Reflection));
}

#[test]
fn without_reflections_nothing_is_copied() {
    let (mut renderer, _) = built(LATE).unwrap();
    drop(renderer.record(scene(&[]).as_scene_ref()).unwrap());
    assert!(renderer.plan().targets().iter().all(|target| target.copy_of.is_none()));
}

#[test]
fn targets_without_a_history_are_refused_by_name() {
    let error = |target, views| match built(Mirror { target, views, ..LATE }).err() {
        Some(BuildError::Plan(error)) => error,
        other => panic!("{other:?}"),
    };
    let unknown = error("albedo", ViewKind::Reflection);
    let is_named = matches!(
        &unknown,
        PlanError::UnknownSampledTarget { process, view, target, .. }
            if process == "mirror" && view == "mirror" && target == "albedo"
    );
    assert!(is_named, "{unknown}");
    let multisampled = error("multisampled", ViewKind::Reflection);
    let is_named = matches!(
        &multisampled,
        PlanError::Multisampling { process, target, .. } if process == "mirror" && target == "multisampled"
    );
    assert!(is_named, "{multisampled}");
    let layered = error(targets::SHADOW_MAP.name(), ViewKind::Shadow);
    let is_named = matches!(
        &layered,
        PlanError::LayeringMismatch { process, target } if process == "mirror" && target == targets::SHADOW_MAP.name()
    );
    assert!(is_named, "{layered}");
}

#[test]
fn the_name_of_a_history_is_no_target_of_another_view() {
    let named = Mirror { target: "radiance of the frame before", is_previous: false, ..LATE };
    // The lamp has reflections draw what the history would be copied from.
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).process(Lamp).process(named);
    let error = builder.build(Arc::new(Scheduler::new(1).unwrap())).err();
    let is_named = matches!(
        &error,
        Some(BuildError::Plan(PlanError::UnknownSampledTarget { process, .. })) if process == "mirror"
    );
    assert!(is_named, "{error:?}");
}
