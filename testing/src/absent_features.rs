//! Scenes in which nothing uses a feature, each with a renderer that has the feature and one that does not: a frame of
//! both should cost the same.

use std::sync::Arc;

use drawloom::backend::Backend;
use drawloom::glam::Vec3;
use drawloom::process::{
    ClearColor, Declare, Deferred, Draws, Format, FullScreen, GeometryBuffer, GeometryFormats, InjectionPoint,
    LightVolumes, RenderProcess, ShadowCasters, ToneMapping, Transparency,
};
use drawloom::quality::{Quality, ShadowQuality};
use drawloom::scene::{Camera, ClipPlane, LayerMask, LightKind, Redraw, Scene, ViewKind};
use drawloom::view::LightClass;
use drawloom::view::ShadowMaps;
use drawloom::{BudgetedView, Renderer, RendererBuilder};

use crate::scenes::everything::{class_of, everything, glasses, without_shadow};

/// A scene that does not use a feature.
pub struct AbsentFeature {
    pub name: String,
    pub scene: Scene,
    pub with: Setup,
    pub without: Setup,
}

/// What a renderer is built with.
#[derive(Clone, Default)]
pub struct Setup {
    pub deferred: Option<Deferred>,
    pub processes: Vec<Arc<dyn RenderProcess>>,
    pub quality: Option<Quality>,
    /// The cameras go through a [`ViewBudget`](drawloom::ViewBudget) that never reduces them.
    pub has_budget: bool,
    /// The cameras say that they are drawn in every frame, instead of saying nothing.
    pub interval_of_one: bool,
}

impl Setup {
    pub fn of(deferred: Deferred) -> Self {
        Self { deferred: Some(deferred), ..Self::default() }
    }

    fn with_quality(change: impl FnOnce(&mut Quality)) -> Self {
        let mut quality =
            Quality { shadows: ShadowQuality { side: 64, ..ShadowQuality::default() }, ..Quality::default() };
        change(&mut quality);
        Self { quality: Some(quality), ..Self::of(deferred()) }
    }

    fn and(mut self, process: impl RenderProcess + 'static) -> Self {
        self.processes.push(Arc::new(process));
        self
    }

    pub fn builder<B: Backend>(&self, backend: B) -> RendererBuilder<B> {
        let mut builder = Renderer::builder(backend).shadow_maps(MAPS);
        builder = match &self.deferred {
            Some(deferred) => builder.pipeline(deferred.clone()),
            None => builder.output("picture"),
        };
        if let Some(quality) = self.quality {
            builder = builder.quality(quality);
        }
        self.processes.iter().fold(builder, |builder, process| builder.process(Arc::clone(process)))
    }

    /// The cameras, as views of a budget.
    pub fn views(&self, scene: &Scene) -> Vec<BudgetedView> {
        let view = |camera: &Camera| {
            let (name, cameras) = (camera.name.clone(), vec![camera.clone()]);
            BudgetedView { name, priority: 0, cameras, levels: Vec::new() }
        };
        scene.cameras.iter().map(view).collect()
    }
}

const MAPS: ShadowMaps = ShadowMaps {
    side: 64,
    max_distance: 20.0,
    cascades: 1,
    split_lambda: 0.5,
    bias: 1.0,
    filter: 1,
    layers: LayerMask::ALL,
};

fn deferred() -> Deferred {
    Deferred::to_picture().shadow_maps(Some(MAPS))
}

/// All features.
pub fn absent_features() -> Vec<AbsentFeature> {
    let mut features: Vec<_> = LightClass::all().map(lights).collect();
    features.extend([
        shadows(),
        cascades(),
        shadow_interval(),
        transparency(),
        levels_of_detail(),
        occlusion(),
        requirements("requirements, with all of them", everything()),
        requirements("requirements, with none of them", bare()),
        reflections(),
        history(),
        mip_levels(),
        view_arrays(),
        budget(),
        redraw(),
    ]);
    features
}

fn feature(name: &str, scene: Scene, with: Setup, without: Setup) -> AbsentFeature {
    AbsentFeature { name: name.to_owned(), scene, with, without }
}

/// Six maps of a point light are not there with the light.
fn lights(class: LightClass) -> AbsentFeature {
    let mut scene = everything();
    scene.lights.retain(|light| class_of(light) != class);
    let name = LightVolumes::name_of(class);
    feature(&name, scene, Setup::of(deferred()), Setup::of(deferred().leave_out(&name)))
}

fn shadows() -> AbsentFeature {
    let mut scene = everything();
    scene.lights = scene.lights.into_iter().map(without_shadow).collect();
    feature("shadow maps", scene, Setup::of(deferred()), Setup::of(Deferred::to_picture().shadow_maps(None)))
}

fn without_directional_shadows() -> Scene {
    let mut scene = everything();
    scene.lights.retain(|light| class_of(light) != LightClass { kind: LightKind::Directional, shadowed: true });
    scene
}

fn cascades() -> AbsentFeature {
    let with = |cascades| Setup::of(deferred().shadow_maps(Some(ShadowMaps { cascades, ..MAPS })));
    feature("cascades", without_directional_shadows(), with(4), with(1))
}

fn shadow_interval() -> AbsentFeature {
    let mut scene = everything();
    scene.lights = scene.lights.into_iter().map(without_shadow).collect();
    let with = |interval| Setup::with_quality(|quality| quality.shadows.interval = interval);
    feature("cached shadow maps", scene, with(4), with(1))
}

fn transparency() -> AbsentFeature {
    let with = Setup::of(deferred());
    feature("transparency", without_glass(), with, Setup::of(deferred().leave_out("transparency")))
}

/// The assets still have the materials.
fn without_glass() -> Scene {
    let mut scene = everything();
    let glasses = glasses(&scene);
    for handle in scene.objects().collect::<Vec<_>>() {
        let material = scene.object(handle).unwrap().material;
        if glasses.iter().any(|(glass, _)| *glass == material) {
            scene.remove_object(handle).unwrap();
        }
    }
    scene
}

/// No mesh has levels.
fn levels_of_detail() -> AbsentFeature {
    let with = |error| Setup::with_quality(|quality| quality.level_of_detail = error);
    feature("levels of detail", everything(), with(2.0), with(0.0))
}

/// What is behind an oblique near plane hides nothing, so views with one have no occlusion tests.
fn occlusion() -> AbsentFeature {
    let mut scene = everything();
    scene.lights.clear();
    let camera = &mut scene.cameras[0];
    let normal = camera.orientation * Vec3::NEG_Z;
    camera.clip_plane = Some(ClipPlane { point: camera.position + normal.as_dvec3(), normal });
    let with = |occlusion| Setup::with_quality(|quality| quality.occlusion = occlusion);
    feature("occlusion where it cannot be", scene, with(Some(8)), with(None))
}

/// Without lights and glass.
fn bare() -> Scene {
    let mut scene = without_glass();
    scene.lights.clear();
    scene
}

/// A pipeline that asks what a scene requires, and the same processes in a list of the engine's own.
fn requirements(name: &str, scene: Scene) -> AbsentFeature {
    let without = by_hand(&scene);
    feature(name, scene, Setup::of(deferred()), without)
}

/// No camera is a reflection.
fn reflections() -> AbsentFeature {
    let with = |declare| Setup::of(deferred()).and(Own { name: "fog", declare });
    let in_both = |declare: &mut Declare| {
        declare.also_views(ViewKind::Reflection);
        draws_over(declare);
    };
    feature("reflections", everything(), with(in_both), with(draws_over))
}

/// The processes for a scene, in their order.
fn by_hand(scene: &Scene) -> Setup {
    let formats = GeometryFormats::default();
    let has = |class: &LightClass| scene.lights.iter().any(|light| class_of(light) == *class);
    let classes: Vec<_> = LightClass::all().filter(has).collect();
    let maps = classes.iter().any(|class| class.shadowed).then_some(&MAPS);
    let glasses = glasses(scene);
    let has_glass =
        scene.as_scene_ref().materials.iter().any(|material| glasses.iter().any(|(glass, _)| glass == material));
    let mut processes: Vec<Arc<dyn RenderProcess>> = Vec::new();
    let hemispheres = classes.contains(&LightClass { kind: LightKind::Hemispherical, shadowed: true });
    processes.extend(maps.map(|_| Arc::new(ShadowCasters { hemispheres }) as _));
    processes.push(Arc::new(GeometryBuffer::new(formats)));
    for class in classes {
        processes.push(Arc::new(match maps.filter(|_| class.shadowed) {
            Some(maps) => LightVolumes::shadowed(class.kind, formats, maps),
            None => LightVolumes::new(class.kind, formats),
        }));
    }
    processes.extend(has_glass.then(|| Arc::new(Transparency::new(maps)) as _));
    processes.push(Arc::new(ToneMapping::default()));
    let mut setup = Setup::default();
    for (index, process) in processes.iter().enumerate() {
        // Those of one kind of views follow each other.
        let before = processes[..index].last().filter(|before| before.name() != "shadow casters");
        setup =
            setup.and(After { process: Arc::clone(process), before: before.map(|before| before.name().to_owned()) });
    }
    setup
}

/// A process that comes after another one.
struct After {
    process: Arc<dyn RenderProcess>,
    before: Option<String>,
}

impl RenderProcess for After {
    fn name(&self) -> &str {
        self.process.name()
    }

    fn declare(&self, declare: &mut Declare) {
        self.process.declare(declare);
        self.before.iter().for_each(|before| declare.after(before));
    }

    fn draws(&self) -> Draws<'_> {
        self.process.draws()
    }
}

/// Nothing reads what a process makes of the frame before.
fn history() -> AbsentFeature {
    let declare = |declare: &mut Declare| {
        declare.views(ViewKind::Reflection);
        declare.keep();
        declare.samples_previous("radiance");
        declare.samples_previous("mean");
        declare.clears_color("mean", Format::Rgba16Float, ClearColor::Value([0.0; 4]));
    };
    let with = Setup::of(deferred()).and(Own { name: "mean", declare });
    feature("history", everything(), with, Setup::of(deferred()))
}

/// Nothing samples a target with mip levels.
fn mip_levels() -> AbsentFeature {
    let declare = |declare: &mut Declare| {
        declare.views(ViewKind::Reflection);
        declare.keep();
        declare.samples("radiance");
        declare.clears_color("blurred", Format::Rgba16Float, ClearColor::Value([0.0; 4]));
        declare.mipmapped("blurred");
    };
    let with = Setup::of(deferred()).and(Own { name: "blurred", declare });
    feature("mip levels", everything(), with, Setup::of(deferred()))
}

/// No camera fills the cube map that a process samples.
fn view_arrays() -> AbsentFeature {
    let with = |declare| Setup::of(deferred()).and(Own { name: "environment", declare });
    let samples = |declare: &mut Declare| {
        draws_over(declare);
        declare.samples("normal");
    };
    let samples_cube = |declare: &mut Declare| {
        draws_over(declare);
        declare.samples("normal");
        declare.samples_view_cube(ViewKind::Reflection, "environment", "radiance");
    };
    feature(VIEW_ARRAYS, everything(), with(samples_cube), with(samples))
}

/// The one feature that costs something: a pixel of zeros has to be bound where there is no view.
pub const VIEW_ARRAYS: &str = "arrays of views";

fn draws_over(declare: &mut Declare) {
    declare.at(InjectionPoint::AfterLighting);
    declare.draws_over("radiance");
}

/// A process of the engine's own that draws black.
struct Own {
    name: &'static str,
    declare: fn(&mut Declare),
}

impl RenderProcess for Own {
    fn name(&self) -> &str {
        self.name
    }

    fn declare(&self, declare: &mut Declare) {
        (self.declare)(declare);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return vec4<f32>(0.0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

fn budget() -> AbsentFeature {
    let with = Setup { has_budget: true, ..Setup::of(deferred()) };
    feature("a budget of views", everything(), with, Setup::of(deferred()))
}

/// All cameras are drawn in every frame.
fn redraw() -> AbsentFeature {
    let mut scene = everything();
    let second = Camera { name: "second".to_owned(), ..scene.cameras[0].clone() };
    scene.cameras.push(second);
    let with = Setup { interval_of_one: true, ..Setup::of(deferred()) };
    feature("cached views", scene, with, Setup::of(deferred()))
}

impl AbsentFeature {
    /// The cameras of a frame of one of the setups.
    pub fn cameras(&self, setup: &Setup) -> Vec<Camera> {
        let redraw = if setup.interval_of_one { Redraw::Interval(1) } else { Redraw::EveryFrame };
        self.scene.cameras.iter().map(|camera| Camera { redraw, ..camera.clone() }).collect()
    }
}
