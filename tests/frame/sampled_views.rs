//! Views that other views sample: which passes they have, and in which order they are submitted.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::command::Selection;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    ClearColor, CommandDraws, Declare, Deferred, Draws, Format, FullScreen, InjectionPoint, PlanError, PostStep,
    RenderProcess, StorageBuffer, ToneMapping,
};
use drawloom::scene::{Camera, ClipPlane, LayerMask, Light, RenderObject, Scene, ViewKind};
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom::{BuildError, FrameError, Renderer, Submitter};
use drawloom_testing::scenes::field;

use crate::declaring::Declaring;

/// The layer of mirrors.
pub const MIRROR: LayerMask = LayerMask::layer(3);

/// Draws mirrors with what the view `mirror` has in a target.
pub struct Mirror {
    target: &'static str,
    place: InjectionPoint,
}

impl RenderProcess for Mirror {
    fn name(&self) -> &str {
        "mirror"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.also_views(ViewKind::Reflection);
        declare.at(self.place);
        declare.samples_view(ViewKind::Reflection, "mirror", self.target);
        declare.draws_over("radiance");
        declare.matches_depth("depth");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws { selection: Selection::ALL.in_layers(MIRROR), ..CommandDraws::default() })
    }
}

/// Draws mirrors with the light of their views.
pub const RADIANCE: Mirror = Mirror { target: "radiance", place: InjectionPoint::AfterLighting };

fn renderer(mirror: Mirror) -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    let scheduler = Arc::new(Scheduler::new(2).unwrap());
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).process(mirror);
    builder.build(scheduler).unwrap()
}

fn scene() -> Scene {
    let mut scene = field(60);
    scene.lights.clear();
    scene.cameras = vec![Camera::looking_at("main", DVec3::new(0.0, 0.0, 30.0), DVec3::ZERO)];
    scene
}

const PLANE: ClipPlane = ClipPlane { point: DVec3::new(0.0, 0.0, -40.0), normal: Vec3::Z };

/// The passes in the order in which they are submitted, without transparency.
fn passes(mirror: Mirror, scene: &Scene) -> Vec<(String, usize)> {
    let (mut renderer, submitter) = renderer(mirror);
    let submitted = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
    let passes = submitted.submission.passes.into_iter().map(|pass| (pass.process, pass.view));
    passes.filter(|(process, _)| process != "transparency").collect()
}

fn named(expected: &[(&str, usize)]) -> Vec<(String, usize)> {
    expected.iter().map(|(process, view)| ((*process).to_owned(), *view)).collect()
}

#[test]
fn a_reflection_draws_what_is_sampled_of_it_and_comes_first() {
    let mut scene = scene();
    scene.cameras.push(scene.cameras[0].reflected("mirror", PLANE));
    let expected = [("geometry buffer", 1), ("mirror", 1), ("geometry buffer", 0), ("mirror", 0), ("tone mapping", 0)];
    assert_eq!(passes(RADIANCE, &scene), named(&expected));

    let of_picture = Mirror { target: "picture", place: InjectionPoint::AfterLighting };
    let expected = [
        ("geometry buffer", 1),
        ("mirror", 1),
        ("tone mapping", 1),
        ("geometry buffer", 0),
        ("mirror", 0),
        ("tone mapping", 0),
    ];
    assert_eq!(passes(of_picture, &scene), named(&expected));

    // Normals are there before the mirror's own process and lights.
    let of_normals = Mirror { target: "normal", place: InjectionPoint::AfterLighting };
    let expected = [("geometry buffer", 1), ("geometry buffer", 0), ("mirror", 0), ("tone mapping", 0)];
    assert_eq!(passes(of_normals, &scene), named(&expected));
}

#[test]
fn without_reflections_a_frame_has_no_pass_more() {
    let expected = [("geometry buffer", 0), ("mirror", 0), ("tone mapping", 0)];
    assert_eq!(passes(RADIANCE, &scene()), named(&expected));
}

#[test]
fn nested_views_are_submitted_innermost_first_in_any_order_of_cameras() {
    let back = ClipPlane { point: DVec3::new(0.0, 0.0, 40.0), normal: Vec3::NEG_Z };
    let main = scene().cameras.remove(0);
    let mut nested = vec![main];
    for depth in 0..6 {
        let plane = if depth % 2 == 0 { PLANE } else { back };
        nested.push(nested[depth].reflected("mirror", plane));
    }
    for rotation in 0..nested.len() {
        let mut scene = scene();
        scene.cameras = nested.clone();
        scene.cameras.rotate_left(rotation);
        scene.cameras[1..5].reverse();
        let passes = passes(RADIANCE, &scene);
        let mut views: Vec<_> = passes.iter().map(|(_, view)| scene.cameras[*view].name.len()).collect();
        views.dedup();
        assert_eq!(views.len(), nested.len(), "the passes of a view are not apart");
        assert!(views.is_sorted_by(|one, next| one > next), "{views:?}");
    }
}

#[test]
fn many_nested_views_are_ordered_without_recursion() {
    let (mut renderer, submitter) = renderer(RADIANCE);
    let mut scene = scene();
    scene.cameras[0].size = [1, 1];
    for depth in 0..1000 {
        let mut camera = scene.cameras[depth].clone();
        camera.name = camera.child_name("mirror");
        camera.kind = ViewKind::Reflection;
        scene.cameras.push(camera);
    }
    let submitted = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
    assert_eq!(submitted.submission.passes.first().unwrap().view, 1000);
    assert_eq!(submitted.submission.passes.last().unwrap().view, 0);
}

#[test]
fn a_view_shows_only_the_layers_of_its_camera() {
    let mut scene = scene();
    let (mesh, material) = {
        let object = scene.object(scene.objects().next().unwrap()).unwrap();
        (object.mesh, object.material)
    };
    let mut mirror = RenderObject::new(mesh, material, DVec3::ZERO);
    mirror.layers = MIRROR;
    scene.add_object(mirror).unwrap();
    let mut other = scene.cameras[0].clone();
    other.name = "other".to_owned();
    // Objects without layers of their own belong to all.
    other.layers = LayerMask(!MIRROR.0);
    scene.cameras.push(other);
    let mut nothing = scene.cameras[0].clone();
    (nothing.name, nothing.layers) = ("nothing".to_owned(), LayerMask::NONE);
    scene.cameras.push(nothing);
    let (mut renderer, submitter) = renderer(RADIANCE);
    let count = |renderer: &mut Renderer<NullBackend>, scene: &Scene| {
        drop(submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap());
        [0, 1, 2].map(|view| renderer.draw_list("geometry buffer", view).unwrap().objects.len())
    };
    let [all, shown, none] = count(&mut renderer, &scene);
    assert_eq!((all, none), (shown + 1, 0));
    // A camera's layers may change from frame to frame.
    scene.cameras[1].layers = MIRROR;
    scene.cameras[2].layers = LayerMask::ALL;
    let counts = count(&mut renderer, &scene);
    assert_eq!(counts, [all, all, all], "objects in all layers are in this one too");
}

#[test]
fn a_target_that_no_process_writes_is_an_error() {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let unknown = Mirror { target: "albedo", place: InjectionPoint::AfterLighting };
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).process(unknown);
    let error = builder.build(scheduler).err().unwrap();
    let named = matches!(
        &error,
        BuildError::Plan(PlanError::UnknownSampledTarget { process, view, target, .. })
            if process == "mirror" && view == "mirror" && target == "albedo"
    );
    assert!(named, "{error}");
}

#[test]
fn a_reflection_that_nothing_samples_is_refused_by_name() {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let (mut renderer, _) = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).build(scheduler).unwrap();
    let mut scene = scene();
    scene.cameras.push(scene.cameras[0].reflected("mirror", PLANE));
    let error = renderer.record(scene.as_scene_ref()).err().unwrap();
    assert!(matches!(&error, FrameError::NoProcess { view, .. } if view == "main/mirror"), "{error}");
}

const PARTICLES: StorageBuffer<[f32; 4]> = StorageBuffer::new("particles", 64);

/// Moves particles once a frame.
struct Simulate;

impl RenderProcess for Simulate {
    fn name(&self) -> &str {
        "simulate"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.once_a_frame();
        declare.also_views(ViewKind::Reflection);
        declare.changes_buffer(PARTICLES);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws::default())
    }
}

/// Draws particles in every view.
struct DrawParticles;

impl RenderProcess for DrawParticles {
    fn name(&self) -> &str {
        "draw particles"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.also_views(ViewKind::Reflection);
        declare.at(InjectionPoint::BeforeGeometry);
        declare.reads_buffer(PARTICLES);
        declare.clears_color("particles", Format::Rgba8Unorm, ClearColor::Background);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws::default())
    }
}

#[test]
fn what_is_drawn_once_a_frame_comes_before_all_views_that_use_it() {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).process(RADIANCE);
    let (mut renderer, submitter) = builder.process(Simulate).process(DrawParticles).build(scheduler).unwrap();
    let mut scene = scene();
    scene.cameras.push(scene.cameras[0].reflected("mirror", PLANE));
    let submitted = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
    let passes: Vec<_> = submitted.submission.passes.iter().map(|pass| (pass.process.as_str(), pass.view)).collect();
    assert_eq!(passes[0], ("simulate", 0));
    assert_eq!(passes.iter().filter(|(process, _)| *process == "simulate").count(), 1);
    let first_of = |view: usize| passes[1..].iter().position(|pass| pass.1 == view);
    assert!(first_of(1) < first_of(0), "{passes:?}");
    assert!(passes.contains(&("draw particles", 0)) && passes.contains(&("draw particles", 1)));
}

/// Main views read the layers of all shadow maps, and one of these shows a picture that is drawn later otherwise.
#[test]
fn views_that_read_all_layers_come_after_views_that_sample() {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let builder = Renderer::builder(NullBackend).output("picture").process(Declaring::new("gobo", |declare| {
        declare.views(ViewKind::Post);
        declare.clears_color("gobo", Format::Rgba8Unorm, ClearColor::Background);
    }));
    let builder = builder.process(Declaring::new("caster", |declare| {
        declare.views(ViewKind::Shadow);
        declare.samples_view(ViewKind::Post, "gobo", "gobo");
        declare.clears_depth_layer("maps", Format::Depth32Float);
    }));
    let builder = builder.process(Declaring::new("lit", |declare| {
        declare.samples_layers(ViewKind::Shadow, "maps");
        declare.clears_color("picture", Format::Rgba8Unorm, ClearColor::Background);
    }));
    let (mut renderer, submitter) = builder.build(scheduler).unwrap();
    let mut scene = scene();
    for (name, kind) in [("map", ViewKind::Shadow), ("gobo", ViewKind::Post)] {
        scene.cameras.push(Camera { name: name.to_owned(), kind, ..scene.cameras[0].clone() });
    }
    let submitted = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
    let passes: Vec<_> = submitted.submission.passes.iter().map(|pass| pass.process.as_str()).collect();
    assert_eq!(passes, ["gobo", "caster", "lit"]);
}

/// Mixes a picture with its own of the frame before, as a motion in main views says.
struct TemporalFilter;

impl PostStep for TemporalFilter {
    fn process(&self, source: &str, target: &str) -> Arc<dyn RenderProcess> {
        Arc::new(Filter { source: source.to_owned(), target: target.to_owned() })
    }
}

struct Filter {
    source: String,
    target: String,
}

impl RenderProcess for Filter {
    fn name(&self) -> &str {
        "temporal filter"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples(&self.source);
        declare.samples("motion");
        declare.samples_previous(&self.target);
        declare.clears_color(&self.target, Format::Rgba8Srgb, ClearColor::Background);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen::default())
    }
}

#[test]
fn reflections_have_no_steps_that_nothing_samples_though_these_have_a_history() {
    let motion = |declare: &mut Declare| {
        declare.at(InjectionPoint::AfterGeometry);
        declare.clears_color("motion", Format::Rg16Float, ClearColor::Background);
    };
    let build = |mirror: Mirror| {
        let deferred = Deferred::new().post(ToneMapping::default()).post(TemporalFilter);
        let builder = Renderer::builder(NullBackend).pipeline(deferred).process(mirror);
        builder.process(Declaring::new("motion", motion)).build(Arc::new(Scheduler::new(1).unwrap()))
    };
    let (mut renderer, submitter) = build(RADIANCE).unwrap();
    let mut scene = scene();
    scene.cameras.push(scene.cameras[0].reflected("mirror", PLANE));
    let submitted = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
    let passes: Vec<_> = submitted.submission.passes.iter().map(|pass| (pass.process.as_str(), pass.view)).collect();
    assert!(passes.contains(&("temporal filter", 0)) && !passes.contains(&("temporal filter", 1)), "{passes:?}");
    // The filter has no motion in reflections, which only main views have.
    let error = build(Mirror { target: "picture", place: InjectionPoint::AfterLighting }).err().unwrap().to_string();
    assert!(error.contains("temporal filter") && error.contains("motion"), "{error}");
}

/// Draws over reflections only.
struct Tint;

impl RenderProcess for Tint {
    fn name(&self) -> &str {
        "tint"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(ViewKind::Reflection);
        declare.at(InjectionPoint::AfterTransparency);
        declare.draws_over("radiance");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws::default())
    }
}

#[test]
fn a_process_of_reflections_alone_has_no_pass_without_one() {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).process(RADIANCE).process(Tint);
    let (mut renderer, submitter) = builder.build(scheduler).unwrap();
    let mut scene = scene();
    for has_mirror in [false, true, false] {
        scene.cameras.truncate(1);
        if has_mirror {
            scene.cameras.push(scene.cameras[0].reflected("mirror", PLANE));
        }
        let submitted = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
        let tints: Vec<_> = submitted.submission.passes.iter().filter(|pass| pass.process == "tint").collect();
        assert_eq!(tints.len(), usize::from(has_mirror));
        assert!(tints.iter().all(|pass| pass.view == 1));
    }
}

/// Writes a target that main views do not have.
struct OnlyInReflections;

impl RenderProcess for OnlyInReflections {
    fn name(&self) -> &str {
        "only in reflections"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(ViewKind::Reflection);
        declare.clears_color("own", Format::Rgba8Unorm, ClearColor::Background);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws::default())
    }
}

/// Samples that target of a main view.
struct OfMain;

impl RenderProcess for OfMain {
    fn name(&self) -> &str {
        "of main"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples_view(ViewKind::Main, "other", "own");
        declare.clears_color("shown", Format::Rgba8Unorm, ClearColor::Background);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws::default())
    }
}

#[test]
fn a_target_of_another_kind_of_view_is_no_target_of_this_one() {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).process(OnlyInReflections);
    let error = builder.process(RADIANCE).process(OfMain).build(scheduler).err().unwrap();
    let named = matches!(&error, BuildError::Plan(PlanError::UnknownSampledTarget { target, .. }) if target == "own");
    assert!(named, "{error}");
}

#[test]
fn only_objects_of_the_layers_of_shadow_maps_cast_shadows() {
    let mut scene = field(60);
    scene.lights = vec![Light::Directional { direction: Vec3::NEG_Y, illuminance: Vec3::ONE, casts_shadow: true }];
    scene.cameras = vec![Camera::looking_at("main", DVec3::new(0.0, 0.0, 30.0), DVec3::ZERO)];
    for (index, handle) in scene.objects().collect::<Vec<_>>().into_iter().enumerate() {
        let object = scene.object(handle).unwrap();
        let layers = if index % 2 == 0 { LayerMask::layer(0) } else { MIRROR };
        scene.replace_object(handle, RenderObject { layers, ..object }).unwrap();
    }
    let casters = |layers: LayerMask| {
        let maps = ShadowMaps { layers, ..ShadowMaps::default() };
        let deferred = Deferred::to_picture().shadow_maps(Some(maps));
        let scheduler = Arc::new(Scheduler::new(1).unwrap());
        let (mut renderer, _) = Renderer::builder(NullBackend).pipeline(deferred).build(scheduler).unwrap();
        drop(renderer.record(scene.as_scene_ref()).unwrap());
        renderer.draw_list("shadow casters", 1).unwrap().objects.len()
    };
    let counts = [LayerMask::ALL, LayerMask::layer(0), MIRROR, LayerMask::NONE].map(casters);
    assert_eq!((counts[0], counts[3]), (counts[1] + counts[2], 0));
    assert!(counts[1] > 0 && counts[2] > 0, "{counts:?}");
}

/// Draws a colour of its own in main views and reflections, without a pipeline.
struct Flat;

impl RenderProcess for Flat {
    fn name(&self) -> &str {
        "flat"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.also_views(ViewKind::Reflection);
        declare.clears_color("flat", Format::Rgba8Unorm, ClearColor::Background);
        declare.samples_view(ViewKind::Reflection, "mirror", "flat");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws::default())
    }
}

#[test]
fn processes_without_a_pipeline_draw_in_several_kinds_of_views() {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let builder = Renderer::builder(NullBackend).process(Flat).output("flat");
    let (mut renderer, submitter) = builder.build(scheduler).unwrap();
    let mut scene = scene();
    scene.cameras.push(scene.cameras[0].reflected("mirror", PLANE));
    let submitted = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
    let views: Vec<_> = submitted.submission.passes.iter().map(|pass| pass.view).collect();
    assert_eq!(views, [1, 0]);
}
