//! The deferred pipeline: an engine's changes to it, and a scene's requirements.

use std::sync::Arc;

use drawloom::backend::{Backend, NullBackend, SceneLimits};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    ClearColor, CommandDraws, Declare, Deferred, Deformation, Draws, Format, Fxaa, GeometryFormats, InjectionPoint,
    LightVolumes, PlanError, RenderProcess, ToneMapping,
};
use drawloom::quality::{Quality, RadianceSum};
use drawloom::scene::{Camera, LayerMask, Light, LightKind, Scene, ViewKind};
use drawloom::task::Scheduler;
use drawloom::view::{IssueReason, ShadowMaps};
use drawloom::{BuildError, FrameError, Renderer, RendererBuilder};
use drawloom_testing::limited::LimitedBackend;
use drawloom_testing::scenes::everything::{dark, everything};
use drawloom_testing::scenes::sized;

/// An engine's own render process, declared by a closure.
struct OwnProcess<F> {
    name: &'static str,
    declare: F,
}

impl<F: Fn(&mut Declare) + Send + Sync> RenderProcess for OwnProcess<F> {
    fn name(&self) -> &str {
        self.name
    }

    fn declare(&self, declare: &mut Declare) {
        (self.declare)(declare);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws::default())
    }
}

fn own(name: &'static str, declare: impl Fn(&mut Declare) + Send + Sync + 'static) -> impl RenderProcess + 'static {
    OwnProcess { name, declare }
}

fn builder(deferred: Deferred) -> RendererBuilder<NullBackend> {
    Renderer::builder(NullBackend).pipeline(deferred)
}

fn build(builder: RendererBuilder<NullBackend>) -> Result<Renderer<NullBackend>, BuildError> {
    Ok(builder.build(Arc::new(Scheduler::new(1).unwrap()))?.0)
}

fn build_error(builder: RendererBuilder<NullBackend>) -> PlanError {
    match build(builder).err().expect("it should be refused") {
        BuildError::Plan(error) => error,
        other => panic!("{other}"),
    }
}

/// The names of the processes that draw a scene, in order.
fn processes<B: Backend>(renderer: &mut Renderer<B>, scene: &Scene) -> Vec<String> {
    drop(renderer.record(scene.as_scene_ref()).unwrap());
    renderer.plan().processes().iter().map(|planned| planned.name.clone()).collect()
}

fn empty() -> Scene {
    let mut scene = Scene::new();
    scene.cameras = everything().cameras;
    scene
}

fn spot() -> Light {
    Light::Spot {
        position: DVec3::Y * 5.0,
        direction: Vec3::NEG_Y,
        intensity: Vec3::ONE,
        range: 10.0,
        inner_angle: 0.3,
        outer_angle: 0.5,
        casts_shadow: true,
    }
}

#[test]
fn a_scene_with_everything_uses_every_process_in_order() {
    let deferred = Deferred::to_picture().depth_pre_pass(true).geometry_shares(2).post(Fxaa::default());
    let expected = [
        "shadow casters",
        "depth pre-pass",
        "geometry buffer 1 of 2",
        "geometry buffer 2 of 2",
        "directional lights",
        "shadowed directional lights",
        "point lights",
        "shadowed point lights",
        "spot lights",
        "shadowed spot lights",
        "hemispherical lights",
        "shadowed hemispherical lights",
        "transparency",
        "tone mapping",
        "fxaa",
    ];
    assert_eq!(deferred.names(), expected);
    let mut renderer = build(builder(deferred)).unwrap();
    assert_eq!(processes(&mut renderer, &everything()), expected);
    assert_eq!(renderer.plan().dropped(), [""; 0]);
}

#[test]
fn an_empty_scene_uses_only_the_required_processes() {
    let mut renderer = build(builder(Deferred::to_picture())).unwrap();
    let expected = ["geometry buffer", "tone mapping"];
    // Also before the first frame.
    let planned: Vec<_> = renderer.plan().processes().iter().map(|planned| planned.name.as_str()).collect();
    assert_eq!(planned, expected);
    assert_eq!(processes(&mut renderer, &empty()), expected);
    assert_eq!(renderer.plan_count(), 1);
}

#[test]
fn each_class_of_lights_has_its_own_process() {
    let mut renderer = build(builder(Deferred::to_picture())).unwrap();
    let names = [
        "directional lights",
        "shadowed directional lights",
        "point lights",
        "shadowed point lights",
        "spot lights",
        "shadowed spot lights",
        "hemispherical lights",
        "shadowed hemispherical lights",
    ];
    let lights = everything().lights;
    assert_eq!(lights.len(), names.len());
    for (light, name) in lights.into_iter().zip(names) {
        let mut scene = empty();
        scene.lights = vec![light];
        let mut expected = vec!["geometry buffer", name, "tone mapping"];
        if name.starts_with("shadowed") {
            expected.insert(0, "shadow casters");
        }
        assert_eq!(processes(&mut renderer, &scene), expected);
    }
}

#[test]
fn invalid_shadow_maps_are_refused() {
    let good = ShadowMaps::default();
    let bad = [
        (ShadowMaps { side: 0, ..good }, "side"),
        (ShadowMaps { max_distance: f32::NAN, ..good }, "max_distance"),
        (ShadowMaps { max_distance: f32::INFINITY, ..good }, "max_distance"),
        (ShadowMaps { max_distance: 0.0, ..good }, "max_distance"),
        (ShadowMaps { cascades: 0, ..good }, "cascades"),
        (ShadowMaps { cascades: 5, ..good }, "cascades"),
        (ShadowMaps { split_lambda: 1.1, ..good }, "split_lambda"),
        (ShadowMaps { split_lambda: f32::NAN, ..good }, "split_lambda"),
        (ShadowMaps { bias: -0.1, ..good }, "bias"),
        (ShadowMaps { bias: f32::NAN, ..good }, "bias"),
        (ShadowMaps { filter: ShadowMaps::MAX_FILTER + 1, ..good }, "filter"),
    ];
    for (maps, named) in bad {
        let by_deferred = build_error(builder(Deferred::to_picture().shadow_maps(Some(maps))));
        let by_builder = build_error(builder(Deferred::to_picture()).shadow_maps(maps));
        for error in [by_deferred, by_builder] {
            let PlanError::ShadowMaps { problem } = error else { panic!("{error}") };
            assert!(problem.contains(named), "{problem}");
        }
    }
    let widest = ShadowMaps { filter: ShadowMaps::MAX_FILTER, bias: 0.0, side: 1, ..good };
    assert!(build(builder(Deferred::to_picture().shadow_maps(Some(widest)))).is_ok());
}

#[test]
fn unknown_names_are_refused_and_known_ones_are_listed() {
    let replaced = Deferred::to_picture().replace("fog", own("mist", |_| {}));
    // These processes exist only with their option.
    let no_maps = Deferred::to_picture().shadow_maps(None).leave_out("shadow casters");
    let no_pre_pass = Deferred::to_picture().leave_out("depth pre-pass");
    for (deferred, wrong) in [
        (Deferred::to_picture().leave_out("Transparency"), "Transparency"),
        (Deferred::to_picture().keep("Transparency"), "Transparency"),
        (Deferred::to_picture().shadow_maps(None).keep("shadowed point lights"), "shadowed point lights"),
        (replaced, "fog"),
        (no_maps, "shadow casters"),
        (no_pre_pass, "depth pre-pass"),
    ] {
        // Those of other qualities too.
        let sums = ["sum of lights", "sum of blended objects", "tiles of lights"].map(str::to_owned);
        let names = [deferred.names(), sums.to_vec()].concat();
        let PlanError::NoSuchProcess { name, known } = build_error(builder(deferred)) else { panic!("{wrong}") };
        assert_eq!((name.as_str(), known), (wrong, names.join(", ")));
    }
    let PlanError::NoSuchProcess { known, .. } = build_error(builder(Deferred::to_picture().keep("fog"))) else {
        panic!("fog is known")
    };
    for name in known.split(", ") {
        assert!(build(builder(Deferred::to_picture().keep(name))).is_ok(), "{name}");
    }
}

#[test]
fn a_replacement_takes_the_position_of_the_replaced_process() {
    let glow = own("glow", |declare| declare.draws_over("radiance"));
    let curve = own("curve", |declare| {
        declare.samples("radiance");
        declare.clears_color("picture", Format::Rgba8Srgb, ClearColor::Background);
    });
    let deferred = Deferred::to_picture().replace("point lights", glow).replace("tone mapping", curve);
    // A process declared after the replaced one comes after the replacement.
    let fog = own("fog", |declare| {
        declare.draws_over("radiance");
        declare.after("point lights");
        declare.before("shadowed point lights");
    });
    let mut renderer = build(builder(deferred).process(fog)).unwrap();
    let names = processes(&mut renderer, &everything());
    let expected = [
        "shadow casters",
        "geometry buffer",
        "directional lights",
        "shadowed directional lights",
        "glow",
        "fog",
        "shadowed point lights",
        "spot lights",
        "shadowed spot lights",
        "hemispherical lights",
        "shadowed hemispherical lights",
        "transparency",
        "curve",
    ];
    assert_eq!(names, expected);
    // If the scene does not require the replaced process, the replacement is left out too.
    assert_eq!(processes(&mut renderer, &empty()), ["geometry buffer", "fog", "curve"]);
}

#[test]
fn a_left_out_process_is_in_no_plan() {
    let deferred = Deferred::to_picture().leave_out("point lights").leave_out("transparency");
    let mut renderer = build(builder(deferred)).unwrap();
    let names = processes(&mut renderer, &everything());
    assert_eq!(names.len(), 10);
    assert!(names.iter().all(|name| name != "point lights" && name != "transparency"), "{names:?}");
    // A process cannot be left out if others read its targets.
    let error = build_error(builder(Deferred::to_picture().leave_out("geometry buffer"))).to_string();
    assert!(error.contains("no process writes target \"depth\"") && error.contains("lights"), "{error}");
}

#[test]
fn a_kept_process_is_in_every_plan() {
    let mut renderer = build(builder(Deferred::to_picture().keep("point lights").keep("transparency"))).unwrap();
    let expected = ["geometry buffer", "point lights", "transparency", "tone mapping"];
    let planned: Vec<_> = renderer.plan().processes().iter().map(|planned| planned.name.as_str()).collect();
    assert_eq!(planned, expected);
    assert_eq!(processes(&mut renderer, &empty()), expected);
    let mut lit = empty();
    let lamp = |light: &&Light| matches!(light, Light::Point { casts_shadow: false, .. });
    lit.lights.extend(everything().lights.iter().filter(lamp).copied());
    assert_eq!(processes(&mut renderer, &lit), expected);
    assert_eq!((lit.lights.len(), renderer.plan_count()), (1, 1));
    // Lights with shadows need maps.
    let mut renderer = build(builder(Deferred::to_picture().keep("shadowed spot lights"))).unwrap();
    let expected = ["shadow casters", "geometry buffer", "shadowed spot lights", "tone mapping"];
    assert_eq!(processes(&mut renderer, &empty()), expected);
    // What is left out stays out.
    let left_out = ["shadow casters", "transparency"]
        .into_iter()
        .fold(Deferred::to_picture(), |deferred, name| deferred.keep(name).leave_out(name));
    let mut renderer = build(builder(left_out.keep("shadowed spot lights"))).unwrap();
    assert_eq!(processes(&mut renderer, &empty()), ["geometry buffer", "tone mapping"]);
}

#[test]
fn a_kept_sum_of_lights_is_in_every_plan_of_a_quality_that_has_it() {
    let planned = |sum: RadianceSum, deferred: Deferred| {
        let quality = Quality { radiance_sum: sum, ..Quality::balanced() };
        processes(&mut build(builder(deferred).quality(quality)).unwrap(), &empty())
    };
    let pipeline = || Deferred::new().keep("sum of lights");
    let geometry = ["geometry buffer"];
    assert_eq!(planned(RadianceSum::HalfFloat, pipeline()), geometry);
    let summed = ["geometry buffer", "tiles of lights", "sum of lights"];
    for kept in ["tiles of lights", "sum of lights"] {
        assert_eq!(planned(RadianceSum::Shader, Deferred::new().keep(kept)), summed, "{kept}");
        assert_eq!(planned(RadianceSum::HalfFloat, Deferred::new().keep(kept)), geometry, "{kept}");
    }
    // The backend blends floats, which needs no tiles.
    assert_eq!(planned(RadianceSum::Float, Deferred::new().keep("tiles of lights")), geometry);
    let in_floats = planned(RadianceSum::Float, pipeline());
    assert_eq!([&in_floats[0], &in_floats[2]], ["geometry buffer", "sum of lights"]);
    assert!(in_floats.len() == 3 && in_floats[1].ends_with(" lights"), "{in_floats:?}");
    // A process of the engine's draws over radiance, so it adds nothing to the sum.
    let own = LightVolumes::new(LightKind::Point, GeometryFormats::default());
    let in_floats = planned(RadianceSum::Float, pipeline().replace("point lights", own));
    assert!(in_floats.len() == 3 && in_floats[1] != "point lights", "{in_floats:?}");
    let classes = ["directional", "point", "spot", "hemispherical"];
    let names = || classes.iter().flat_map(|kind| [format!("{kind} lights"), format!("shadowed {kind} lights")]);
    let all_but_spots = names().filter(|name| name != "spot lights").fold(pipeline(), Deferred::leave_out);
    assert_eq!(planned(RadianceSum::Shader, all_but_spots), summed);
    assert_eq!(planned(RadianceSum::Shader, names().fold(pipeline(), Deferred::leave_out)), geometry);
    let blended = |sum| planned(sum, Deferred::new().keep("sum of blended objects"));
    assert_eq!(blended(RadianceSum::HalfFloat), geometry);
    assert_eq!(blended(RadianceSum::Shader), ["geometry buffer", "transparency", "sum of blended objects"]);
}

/// A backend that can blend floats or cannot.
fn backend(blends_floats: bool) -> LimitedBackend<NullBackend> {
    let backend = LimitedBackend::new(NullBackend, SceneLimits::NONE);
    if blends_floats { backend } else { backend.without_float_blending() }
}

fn with_sum(radiance_sum: RadianceSum) -> Quality {
    Quality { radiance_sum, ..Quality::balanced() }
}

#[test]
fn what_is_kept_follows_a_backend_that_is_replaced() {
    let build = |kept: &str, blends_floats| {
        let deferred = Deferred::new().keep(kept);
        let builder = Renderer::builder(backend(blends_floats)).pipeline(deferred);
        builder.quality(with_sum(RadianceSum::Float)).build(Arc::new(Scheduler::new(1).unwrap())).unwrap()
    };
    for kept in ["tiles of lights", "sum of lights", "sum of blended objects"] {
        let expected = [false, true].map(|blends_floats| processes(&mut build(kept, blends_floats).0, &empty()));
        assert_ne!(expected[0], expected[1], "{kept}");
        let (mut renderer, mut submitter) = build(kept, true);
        for blends_floats in [true, false, true, false] {
            submitter = renderer.replace_backend(backend(blends_floats));
            assert_eq!(processes(&mut renderer, &empty()), expected[usize::from(blends_floats)], "{kept}");
        }
        drop(submitter);
    }
}

/// On a device on which they would have no effect as well: the backend may be replaced.
#[test]
fn tiles_of_lights_are_left_out_only_without_the_sum_that_reads_them() {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let build = |deferred: Deferred, sum, blends_floats| {
        let builder = Renderer::builder(backend(blends_floats)).pipeline(deferred).quality(with_sum(sum));
        builder.build(Arc::clone(&scheduler))
    };
    let without_tiles = || Deferred::new().leave_out("tiles of lights");
    let is_named = |error: String| error.contains("\"light tiles\"") && error.contains("sum of lights");
    for (sum, blends_floats) in [
        (RadianceSum::Float, true),
        (RadianceSum::Float, false),
        (RadianceSum::Shader, true),
        (RadianceSum::Shader, false),
    ] {
        let error = build(without_tiles(), sum, blends_floats).err().expect("it is refused").to_string();
        assert!(is_named(error), "{sum:?} {blends_floats}");
        let (mut renderer, submitter) = build(without_tiles().leave_out("sum of lights"), sum, blends_floats).unwrap();
        drop(submitter);
        for blends_floats in [!blends_floats, blends_floats] {
            drop(renderer.replace_backend(backend(blends_floats)));
            let names = processes(&mut renderer, &everything());
            assert!(names.iter().all(|name| name != "tiles of lights" && name != "sum of lights"), "{names:?}");
        }
    }
    // Nothing reads them, until the quality changes.
    let (mut renderer, submitter) = build(without_tiles(), RadianceSum::HalfFloat, true).unwrap();
    drop(submitter);
    let before = processes(&mut renderer, &everything());
    for sum in [RadianceSum::Float, RadianceSum::Shader] {
        assert!(is_named(renderer.set_quality(with_sum(sum)).unwrap_err().to_string()), "{sum:?}");
        drop(renderer.replace_backend(backend(false)));
        assert_eq!(processes(&mut renderer, &everything()), before);
    }
}

struct Wind;

impl Deformation for Wind {
    fn name(&self) -> &str {
        "wind"
    }

    fn layers(&self) -> LayerMask {
        LayerMask::layer(3)
    }

    fn declare(&self, _declare: &mut Declare) {}

    fn shader(&self) -> &str {
        ""
    }
}

#[test]
fn a_process_of_deformed_objects_is_kept_with_the_one_that_it_draws_over() {
    let deferred = Deferred::to_picture().deformation(Wind).keep("wind: transparency");
    let names = processes(&mut build(builder(deferred)).unwrap(), &empty());
    assert!(
        ["transparency", "wind: transparency"].iter().all(|name| names.iter().any(|found| found == name)),
        "{names:?}"
    );
    let error = build_error(builder(Deferred::to_picture().keep("wind: transparency")));
    assert!(matches!(error, PlanError::NoSuchProcess { .. }), "{error}");
}

#[test]
fn processes_may_be_ordered_relative_to_an_absent_one() {
    let after = own("rain", |declare| {
        declare.draws_over("radiance");
        declare.after("transparency");
    });
    let before = own("fog", |declare| {
        declare.draws_over("radiance");
        declare.before("transparency");
        declare.after("shadowed hemispherical lights");
    });
    let mut renderer = build(builder(Deferred::to_picture()).process(after).process(before)).unwrap();
    let names = processes(&mut renderer, &everything());
    assert_eq!(names[9..], ["shadowed hemispherical lights", "fog", "transparency", "rain", "tone mapping"][..]);

    let mut scene = empty();
    scene.lights = vec![spot()];
    let expected = ["shadow casters", "geometry buffer", "shadowed spot lights", "fog", "rain", "tone mapping"];
    assert_eq!(processes(&mut renderer, &scene), expected);
    assert_eq!(processes(&mut renderer, &empty()), ["geometry buffer", "fog", "rain", "tone mapping"]);
}

#[test]
fn every_frame_has_every_place() {
    let at = |name: &'static str, place, target: &'static str| {
        own(name, move |declare| {
            if target == "before" {
                declare.clears_color(target, Format::Rgba8Unorm, ClearColor::Background);
                declare.keep();
            } else {
                declare.draws_over(target);
            }
            declare.at(place);
        })
    };
    let builder = builder(Deferred::to_picture())
        .process(at("overlay", InjectionPoint::AfterPostProcessing, "picture"))
        .process(at("bloom", InjectionPoint::AfterTransparency, "radiance"))
        .process(at("fog", InjectionPoint::AfterLighting, "radiance"))
        .process(at("decals", InjectionPoint::AfterGeometry, "radiance"))
        .process(at("sky", InjectionPoint::BeforeGeometry, "before"))
        .process(own("haze", |declare| {
            declare.draws_over("radiance");
            declare.at(InjectionPoint::AfterLighting);
            declare.after("fog");
        }));
    let mut renderer = build(builder).unwrap();
    let own_ones = ["sky", "decals", "fog", "haze", "bloom", "overlay"];
    let pipeline = |name: &&String| !own_ones.contains(&name.as_str());
    for scene in [everything(), empty()] {
        let names = processes(&mut renderer, &scene);
        let found: Vec<_> = names.iter().filter(|name| !pipeline(name)).map(String::as_str).collect();
        assert_eq!(found, own_ones, "{names:?}");
        let index = |name: &str| names.iter().position(|other| other == name).unwrap();
        assert!(index("geometry buffer") < index("decals") && index("bloom") < index("tone mapping"), "{names:?}");
        let lights = names.iter().filter(|name| name.ends_with("lights"));
        assert!(lights.clone().all(|lights| (index("decals")..index("fog")).contains(&index(lights))), "{names:?}");
        assert!(names.iter().all(|name| name != "transparency" || index("haze") < index(name)), "{names:?}");
    }
    let error =
        build_error(Renderer::builder(NullBackend).process(at("fog", InjectionPoint::AfterLighting, "radiance")));
    assert_eq!(error, PlanError::UnknownProcess { process: "fog".into(), other: "the place after lighting".into() });
}

#[test]
fn a_process_after_lighting_may_draw_depth_with_every_sum_of_lights() {
    for radiance_sum in [RadianceSum::HalfFloat, RadianceSum::Float, RadianceSum::Shader] {
        let trees = own("trees", |declare| {
            declare.draws_over("radiance");
            declare.draws_depth("depth");
            declare.at(InjectionPoint::AfterLighting);
        });
        let quality = Quality { radiance_sum, ..Quality::balanced() };
        let mut renderer = build(builder(Deferred::to_picture()).quality(quality).process(trees)).unwrap();
        let names = processes(&mut renderer, &everything());
        let index = |name: &str| names.iter().position(|other| other == name).unwrap();
        let lights: Vec<_> = names.iter().filter(|name| name.contains("lights")).collect();
        assert!(!lights.is_empty() && lights.iter().all(|name| index(name) < index("trees")), "{names:?}");
    }
}

#[test]
fn an_ambiguous_order_or_an_unknown_name_is_refused() {
    let after = |name: &'static str, other: &'static str| {
        own(name, move |declare| {
            declare.draws_over("radiance");
            declare.after(other);
        })
    };
    let error = build_error(builder(Deferred::to_picture()).process(after("rain", "clouds")));
    assert_eq!(error, PlanError::UnknownProcess { process: "rain".into(), other: "clouds".into() });

    let two =
        builder(Deferred::to_picture()).process(after("rain", "transparency")).process(after("snow", "transparency"));
    let error = build_error(two).to_string();
    for part in ["\"rain\"", "\"snow\"", "\"radiance\"", "put them in order"] {
        assert!(error.contains(part), "{error}");
    }
    // Only the pipeline's own processes have an implicit order; this one declares none relative to lights.
    let error = build_error(builder(Deferred::to_picture()).process(after("rain", "geometry buffer"))).to_string();
    assert!(error.contains("\"rain\"") && error.contains("put them in order"), "{error}");
}

#[test]
fn shadow_views_follow_the_cameras_and_are_named_after_their_light() {
    let mut scene = everything();
    scene.cameras.push(sized(Camera::looking_at("side", DVec3::X * 9.0, DVec3::ZERO), [20, 30]));
    let invalid = Light::Point { position: DVec3::NAN, intensity: Vec3::ONE, range: 1.0, casts_shadow: false };
    // A left-out light keeps its number.
    scene.lights.insert(0, invalid);
    let mut renderer = build(builder(Deferred::to_picture())).unwrap();
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let views = &recorded.statistics().views;
    let found: Vec<_> = views.iter().map(|view| (view.name.as_str(), view.kind, view.lights)).collect();
    let expected = [
        ("main", ViewKind::Main, 8),
        ("side", ViewKind::Main, 8),
        ("shadow of light 2", ViewKind::Shadow, 0),
        ("shadow of light 2 for side", ViewKind::Shadow, 0),
        ("shadow of light 4, +X", ViewKind::Shadow, 0),
        ("shadow of light 4, -X", ViewKind::Shadow, 0),
        ("shadow of light 4, +Y", ViewKind::Shadow, 0),
        ("shadow of light 4, -Y", ViewKind::Shadow, 0),
        ("shadow of light 4, +Z", ViewKind::Shadow, 0),
        ("shadow of light 4, -Z", ViewKind::Shadow, 0),
        ("shadow of light 6", ViewKind::Shadow, 0),
        ("shadow of light 8", ViewKind::Shadow, 0),
    ];
    assert_eq!(found, expected);
    let queues: Vec<_> = recorded.queues().iter().map(|queue| (queue.view, queue.passes.len())).collect();
    assert_eq!(queues, [[(0, 11), (1, 11)].as_slice(), &std::array::from_fn::<_, 10, _>(|map| (2 + map, 1))].concat());
}

#[test]
fn an_engines_shadow_camera_shares_the_maps_if_its_size_matches() {
    let maps = ShadowMaps { side: 64, ..ShadowMaps::default() };
    let deferred = || Deferred::to_picture().shadow_maps(Some(maps));
    let mut scene = empty();
    scene.lights = vec![spot()];
    let own = Camera { kind: ViewKind::Shadow, ..Camera::looking_at("own", DVec3::Y * 9.0, DVec3::ZERO) };
    scene.cameras.push(sized(own, [64; 2]));
    let mut renderer = build(builder(deferred())).unwrap();
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let names: Vec<_> = recorded.statistics().views.iter().map(|view| view.name.clone()).collect();
    assert_eq!(names, ["main", "own", "shadow of light 0"]);
    drop(recorded);

    scene.cameras[1].size = [64, 32];
    match renderer.record(scene.as_scene_ref()).err() {
        Some(FrameError::UnequalLayers { target, views }) => {
            assert_eq!((target.as_str(), views), ("shadow map", ["own".to_owned(), "shadow of light 0".to_owned()]));
        }
        other => panic!("{:?}", other.map(|error| error.to_string())),
    }
    // Without a shadow-casting light no process draws shadow views.
    scene.lights.clear();
    let error = renderer.record(scene.as_scene_ref()).err().unwrap();
    assert!(matches!(&error, FrameError::NoProcess { view, kind: ViewKind::Shadow } if view == "own"), "{error}");
}

#[test]
fn dark_and_invalid_lights_require_no_process() {
    let mut scene = empty();
    scene.lights = everything().lights.into_iter().map(dark).collect();
    let broken = [f32::NAN, f32::INFINITY, -1.0].map(|range| match spot() {
        Light::Spot { position, direction, intensity, inner_angle, outer_angle, casts_shadow, .. } => {
            Light::Spot { position, direction, intensity, range, inner_angle, outer_angle, casts_shadow }
        }
        other => other,
    });
    scene.lights.extend(broken);
    scene.lights.push(Light::Directional { direction: Vec3::NAN, illuminance: Vec3::ONE, casts_shadow: true });
    let mut renderer = build(builder(Deferred::to_picture())).unwrap();
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let statistics = recorded.statistics();
    let scene_issues = statistics.scene_issues.iter();
    let found: Vec<_> = scene_issues.map(|issue| (issue.reason, issue.count, issue.first)).collect();
    let mut expected = [(IssueReason::DarkLight, 8, 0), (IssueReason::InvalidLight, 4, 8)];
    expected.sort_by_key(|(reason, ..)| *reason as usize);
    assert_eq!(found, expected);
    assert_eq!((statistics.lights, statistics.views.len(), statistics.views[0].lights), (0, 1, 0));
    drop(recorded);
    assert_eq!(processes(&mut renderer, &scene), ["geometry buffer", "tone mapping"]);
    assert_eq!(renderer.plan_count(), 1);
}

#[test]
fn plans_are_cached_by_requirements() {
    let mut renderer =
        build(builder(Deferred::to_picture().post(ToneMapping::default()).leave_out("transparency"))).err();
    // Two processes of the same name are refused.
    assert!(renderer.take().unwrap().to_string().contains("\"tone mapping\""));

    let mut renderer = build(builder(Deferred::to_picture())).unwrap();
    let mut scene = empty();
    let mut identities = Vec::new();
    for lights in [vec![], vec![spot()], vec![spot(); 3], vec![], vec![spot()]] {
        scene.lights = lights;
        drop(renderer.record(scene.as_scene_ref()).unwrap());
        identities.push(renderer.plan().identity());
    }
    assert_eq!(identities[1..3], [identities[1]; 2]);
    assert_eq!((identities[3], identities[4]), (identities[0], identities[1]));
    assert_eq!(renderer.plan_count(), 2);
}

#[test]
fn lights_of_a_left_out_class_are_not_drawn_by_another() {
    let mut scene = empty();
    let unshadowed = match spot() {
        Light::Spot { position, direction, intensity, range, inner_angle, outer_angle, .. } => {
            Light::Spot { position, direction, intensity, range, inner_angle, outer_angle, casts_shadow: false }
        }
        other => other,
    };
    scene.lights = vec![spot(), unshadowed];
    // Nothing samples the shadow map, so it is not drawn. The light still belongs to the shadowed class.
    let deferred = Deferred::to_picture().leave_out("shadowed spot lights");
    let (mut renderer, submitter) = builder(deferred).build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let passes = submitter.submit(recorded).unwrap().submission.passes;
    let lit: Vec<_> = passes.iter().map(|pass| (pass.process.as_str(), pass.lights)).collect();
    assert_eq!(lit, [("geometry buffer", 0), ("spot lights", 1), ("tone mapping", 0)]);
}
