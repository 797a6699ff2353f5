//! Views that are sampled as the layers of one texture: their order, and what is refused.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::DVec3;
use drawloom::process::internal::SampledShape;
use drawloom::process::{ClearColor, Declare, Deferred, Draws, Format, FullScreen, PlanError, RenderProcess};
use drawloom::scene::{Camera, Scene, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{BuildError, FrameError, Renderer, Submitter};
use drawloom_testing::scenes::field;

use crate::declaring::Declaring;

/// Samples views with names that begin with `probe`, as layers, or as a cube map if `layers` is `None`.
struct Reader {
    /// The kind of views that it samples.
    views: ViewKind,
    layers: Option<u32>,
    multisampled: bool,
}

const CUBE: Reader = Reader { views: ViewKind::Reflection, layers: None, multisampled: false };

const fn layers(count: u32) -> Reader {
    Reader { layers: Some(count), ..CUBE }
}

impl RenderProcess for Reader {
    fn name(&self) -> &str {
        "reader"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.also_views(ViewKind::Reflection);
        let target = if self.multisampled { "multisampled" } else { "radiance" };
        match self.layers {
            Some(layers) => declare.samples_view_layers(self.views, "probe", target, layers),
            None => declare.samples_view_cube(self.views, "probe", target),
        }
        declare.clears_color("read", Format::Rgba16Float, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen::default())
    }
}

fn built(reader: Reader) -> Result<(Renderer<NullBackend>, Submitter<NullBackend>), BuildError> {
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).process(Declaring::multisampled());
    builder.process(reader).output("read").build(Arc::new(Scheduler::new(1).unwrap()))
}

fn scene() -> Scene {
    let mut scene = field(20);
    scene.lights.clear();
    scene.cameras = vec![Camera::looking_at("main", DVec3::new(0.0, 0.0, 30.0), DVec3::ZERO)];
    scene
}

/// The views of the passes in the order in which they are submitted.
fn view_order(reader: Reader, scene: &Scene) -> Vec<String> {
    let (mut renderer, submitter) = built(reader).unwrap();
    let submitted = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
    let mut views: Vec<_> = submitted.submission.passes.iter().map(|pass| pass.view).collect();
    views.dedup();
    views.into_iter().map(|view| scene.cameras[view].name.clone()).collect()
}

fn error(reader: Reader, scene: &Scene) -> FrameError {
    built(reader).unwrap().0.record(scene.as_scene_ref()).err().unwrap()
}

#[test]
fn the_views_of_all_layers_come_first() {
    let mut scene = scene();
    scene.cameras.extend(Camera::cube_faces("probe", DVec3::ZERO, 16, 0.1));
    let order = view_order(CUBE, &scene);
    assert_eq!(order.len(), 7);
    assert_eq!(order[6], "main");
}

#[test]
fn a_layer_that_samples_its_own_array_is_no_circle() {
    // Each face would sample all six.
    let mut scene = scene();
    scene.cameras.extend(Camera::cube_faces("probe", DVec3::ZERO, 16, 0.1));
    scene.cameras.truncate(4);
    assert_eq!(view_order(CUBE, &scene).len(), 4);
}

#[test]
fn the_children_of_a_view_come_before_the_views_that_all_share() {
    let mut scene = scene();
    let view = |name: &str| Camera::looking_at(name, DVec3::Z, DVec3::ZERO);
    scene.cameras.extend(["main/probe/1", "probe/0", "probe/1"].map(view));
    let reader = || Reader { views: ViewKind::Main, ..layers(2) };
    // The child samples the shared ones itself.
    assert_eq!(view_order(reader(), &scene), ["probe/0", "probe/1", "main/probe/1", "main"].map(String::from));
    scene.cameras.remove(1);
    assert_eq!(view_order(reader(), &scene), ["probe/0", "probe/1", "main"].map(String::from));
}

#[test]
fn layers_that_no_texture_has_are_refused_by_name() {
    let problem = |reader: Reader| match built(reader).err() {
        Some(BuildError::Plan(PlanError::SampledLayers { process, view, target, problem }))
            if process == "reader" && view == "probe" && target.ends_with(['e', 'd']) =>
        {
            problem
        }
        other => panic!("{other:?}"),
    };
    assert_eq!(problem(layers(0)), "no layer is asked for");
    assert_eq!(problem(layers(SampledShape::MAX_LAYERS + 1)), "a texture has at most 256 layers");
    assert_eq!(problem(Reader { multisampled: true, ..CUBE }), "it is multisampled");
    assert!(built(layers(SampledShape::MAX_LAYERS)).is_ok());
}

#[test]
fn views_of_one_array_have_one_size_and_faces_are_square() {
    let mut scene = scene();
    scene.cameras.extend(Camera::cube_faces("probe", DVec3::ZERO, 16, 0.1));
    scene.cameras[3].size = [16, 17];
    let message = error(CUBE, &scene).to_string();
    assert_eq!(message, r#"views "probe/0" and "probe/2" share the target "radiance", but differ in size"#);
    scene.cameras[1..].iter_mut().for_each(|camera| camera.size = [16, 17]);
    let message = error(CUBE, &scene).to_string();
    assert_eq!(message, r#"view "probe/0" is a face of a cube map, and has 16x17 pixels"#);
    // As an array they may be oblong.
    assert_eq!(view_order(layers(6), &scene).len(), 7);
}

#[test]
fn an_array_has_as_many_layers_as_any_process_samples() {
    for counts in [[1, 2], [2, 1]] {
        let process = |name: &'static str, layers| {
            Declaring::new(name, move |declare| {
                declare.samples_view_layers(ViewKind::Main, "probe", "first", layers);
                declare.clears_color(name, Format::Rgba8Unorm, ClearColor::Background);
                declare.keep();
            })
        };
        let builder = Renderer::builder(NullBackend).process(process("first", counts[0]));
        let builder = builder.process(process("second", counts[1]));
        let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
        let mut scene = scene();
        scene.cameras.extend(["probe/0", "probe/1"].map(|name| Camera::looking_at(name, DVec3::Z, DVec3::ZERO)));
        drop(renderer.record(scene.as_scene_ref()).unwrap());
        scene.cameras[2].size = [16, 17];
        let message = renderer.record(scene.as_scene_ref()).map(drop).unwrap_err().to_string();
        assert!(message.contains(r#"views "probe/0" and "probe/1" share the target "first""#), "{message}");
    }
}

#[test]
fn ten_thousand_views_are_an_error_that_says_the_limit() {
    let mut scene = scene();
    scene.cameras[0].size = [1, 1];
    scene.cameras = vec![scene.cameras[0].clone(); 10_000];
    assert_eq!(error(CUBE, &scene).to_string(), "10000 views are more than the 4096 of a frame");
}

#[test]
fn a_camera_that_samples_no_views_ends_a_circle() {
    let mut scene = scene();
    // Each of the two samples the other as `probe/0`: one is shared, and the other is its child.
    scene.cameras.extend(["probe/0", "probe/0/probe/0"].map(|name| Camera::looking_at(name, DVec3::Z, DVec3::ZERO)));
    let reader = || Reader { views: ViewKind::Main, ..layers(1) };
    let circle = error(reader(), &scene);
    assert!(matches!(circle, FrameError::CircularViews(_)), "{circle}");
    scene.cameras[2].samples_views = false;
    assert_eq!(view_order(reader(), &scene), ["probe/0/probe/0", "probe/0", "main"].map(String::from));
    // It may change from frame to frame.
    let (mut renderer, submitter) = built(reader()).unwrap();
    drop(submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap());
    scene.cameras[2].samples_views = true;
    assert!(renderer.record(scene.as_scene_ref()).is_err());
}
