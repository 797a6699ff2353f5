//! Processes that are kept although nothing in the scene requires them change no byte of the picture.

use std::sync::Arc;

use drawloom::backend::{Backend, Picture, SoftwareBackend, WgpuBackend};
use drawloom::process::{
    ClearColor, CpuShader, Declare, Deferred, Draws, Format, FullScreen, FullScreenCpuShader, FullScreenPixel, Fxaa,
    LightVolumes, PassInputs, RenderProcess,
};
use drawloom::raster::{Real, Vector4};
use drawloom::scene::{Blend, Material, Scene, ViewKind};
use drawloom::task::Scheduler;
use drawloom::view::LightClass;
use drawloom::view::ShadowMaps;
use drawloom::{RecordedFrame, Renderer, RendererBuilder, Submitter};
use drawloom_testing::scenes::everything::{class_of, everything, everything_with_mirror, glasses, without_shadow};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;
use crate::sampled_views::{MIRROR, SURFACE};

pub const CASES: &[Case] = &[
    ("a_process_that_is_kept_changes_no_byte", each_on_wgpu),
    ("all_processes_that_are_kept_change_no_byte", all_on_wgpu),
    ("kept_processes_change_no_byte_of_the_software_backend", on_software),
    ("what_is_kept_is_there_when_the_scene_requires_it", no_new_plans),
    ("an_engines_process_that_is_kept_changes_no_byte", engines_process),
];

const TRANSPARENCY: &str = "transparency";
const SHADOW_CASTERS: &str = "shadow casters";

/// Each process that a scene may lack.
fn names() -> Vec<String> {
    let lights = LightClass::all().map(LightVolumes::name_of);
    lights.chain([TRANSPARENCY, SHADOW_CASTERS].map(str::to_owned)).collect()
}

fn deferred() -> Deferred {
    let maps = ShadowMaps { side: 64, max_distance: 20.0, ..ShadowMaps::default() };
    Deferred::to_picture().post(Fxaa::default()).shadow_maps(Some(maps))
}

/// The scene with everything and a mirror, but with nothing that requires the process called `name`.
fn scene_without(name: &str) -> Result<Scene, Failed> {
    let mut scene = everything_with_mirror(SURFACE);
    match name {
        TRANSPARENCY => {
            let glasses = glasses(&scene);
            for handle in scene.objects().collect::<Vec<_>>() {
                let material = scene.object(handle)?.material;
                if glasses.iter().any(|(glass, _)| *glass == material) {
                    scene.remove_object(handle)?;
                }
            }
        }
        // The shader of glass and those of lights with shadows read the maps.
        SHADOW_CASTERS => scene.lights = scene.lights.into_iter().map(without_shadow).collect(),
        _ => scene.lights.retain(|light| LightVolumes::name_of(class_of(light)) != name),
    }
    Ok(scene)
}

/// The scenes in which nothing requires any of the processes.
fn scenes_without_all() -> Result<[Scene; 2], Failed> {
    let mut empty = Scene::new();
    empty.cameras = everything().cameras;
    let mut bare = scene_without(TRANSPARENCY)?;
    bare.lights.clear();
    Ok([empty, bare])
}

/// A renderer on some backend, and what it draws.
struct Drawer<B: Backend> {
    renderer: Renderer<B>,
    submitter: Submitter<B>,
    read: fn(B::Submission) -> Result<Picture, Failed>,
}

impl<B: Backend> Drawer<B> {
    fn record(&mut self, scene: &Scene) -> Result<RecordedFrame<B>, Failed> {
        Ok(self.renderer.record(scene.as_scene_ref())?)
    }

    /// The picture of the first view, and the passes: the process and the view of each.
    fn draw(&mut self, scene: &Scene) -> Result<(Picture, Vec<(String, usize)>), Failed> {
        let recorded = self.record(scene)?;
        let name = |process: usize| self.renderer.plan().processes()[process].name.clone();
        let passes = recorded.queues().iter().flat_map(|queue| &queue.passes);
        let passes = passes.map(|(pass, _)| (name(pass.process_index), pass.view_index)).collect();
        Ok(((self.read)(self.submitter.submit(recorded)?.submission)?, passes))
    }
}

type Configure<'a, B> = &'a dyn Fn(RendererBuilder<B>) -> RendererBuilder<B>;

fn on_wgpu(configure: Configure<'_, WgpuBackend>) -> Result<Drawer<WgpuBackend>, Failed> {
    let Fixture { renderer, submitter } = Fixture::with(2, configure)?;
    Ok(Drawer { renderer, submitter, read: |submission| Ok(submission.read(0, "picture")?) })
}

fn in_software(configure: Configure<'_, SoftwareBackend>) -> Result<Drawer<SoftwareBackend>, Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler)));
    let (renderer, submitter) = configure(builder).build(scheduler)?;
    Ok(Drawer { renderer, submitter, read: |submission| Ok(submission.read(0, "picture")?) })
}

type NewDrawer<B> = fn(Configure<'_, B>) -> Result<Drawer<B>, Failed>;

/// Compares a scene's picture with that of the same pipeline if it keeps these processes, none of which the scene
/// requires. The kept processes have passes in each view, which the scene alone does not have.
fn expect_same<B: Backend>(drawer: &mut Drawer<B>, scene: &Scene, kept: &[String]) -> Result<(), Failed> {
    let mut drawn = |pipeline: Deferred| {
        drawer.renderer.set_pipeline(pipeline)?;
        let drawn = drawer.draw(scene)?;
        let is_planned =
            |name: &&String| drawer.renderer.plan().processes().iter().any(|planned| planned.name == **name);
        Ok::<_, Failed>((drawn, kept.iter().filter(is_planned).count()))
    };
    let ((expected, passes), planned) = drawn(deferred())?;
    let ((found, mut more), kept_count) = drawn(kept.iter().fold(deferred(), Deferred::keep))?;
    if (planned, kept_count) != (0, kept.len()) {
        return Err(format!("{kept:?}: {planned} are planned, with `keep` {kept_count}").into());
    }
    let cameras = 0..scene.cameras.len();
    // No light has a shadow map.
    let added = kept.iter().filter(|name| *name != SHADOW_CASTERS);
    let mut added: Vec<_> = added.flat_map(|name| cameras.clone().map(|view| (name.clone(), view))).collect();
    added.extend(passes);
    added.sort();
    more.sort();
    if more != added {
        return Err(format!("{kept:?}: the passes are {more:?}, and should be {added:?}").into());
    }
    if found == expected { Ok(()) } else { Err(format!("{kept:?}: the picture differs").into()) }
}

/// Compiling pipelines takes most of the time of a new renderer, so one draws all scenes.
fn with_mirror<B: Backend>(new: NewDrawer<B>) -> Result<Drawer<B>, Failed> {
    new(&|builder| builder.pipeline(deferred()).process(MIRROR))
}

fn each<B: Backend>(new: NewDrawer<B>) -> Result<(), Failed> {
    let mut drawer = with_mirror(new)?;
    names().iter().try_for_each(|name| expect_same(&mut drawer, &scene_without(name)?, std::slice::from_ref(name)))
}

fn all<B: Backend>(new: NewDrawer<B>) -> Result<(), Failed> {
    let mut drawer = with_mirror(new)?;
    scenes_without_all()?.iter().try_for_each(|scene| expect_same(&mut drawer, scene, &names()))
}

fn each_on_wgpu() -> Result<(), Failed> {
    each(on_wgpu)
}

fn all_on_wgpu() -> Result<(), Failed> {
    all(on_wgpu)
}

fn on_software() -> Result<(), Failed> {
    all(in_software)?;
    each(in_software)
}

/// With everything kept a scene that grows needs no other plan. Pipelines of processes that draw no objects are there
/// from the start.
fn no_new_plans() -> Result<(), Failed> {
    let keeping = names().into_iter().fold(deferred(), Deferred::keep);
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(keeping))?;
    let [empty, mut bare] = scenes_without_all()?;
    fixture.draw(&empty)?;
    let mut kept = Vec::new();
    let full = everything();
    bare.cameras = full.cameras.clone();
    let mut counts = |fixture: &Fixture| {
        kept.push((fixture.renderer.plan_count(), fixture.renderer.backend().resources().pipelines));
    };
    counts(&fixture);
    for lights in [0, 1, 8] {
        bare.lights = full.lights[..lights].to_vec();
        fixture.draw(&bare)?;
        counts(&fixture);
    }
    for handle in bare.objects().collect::<Vec<_>>() {
        let mut object = bare.object(handle)?;
        object.material = bare.add(Material { blend: Blend::Alpha, opacity: 0.5, ..Material::default() })?;
        bare.replace_object(handle, object)?;
    }
    fixture.draw(&bare)?;
    counts(&fixture);
    let plans: Vec<_> = kept.iter().map(|(plans, _)| *plans).collect();
    // Directional lights and those with a range, both without and with shadow maps; tone mapping and anti-aliasing;
    // opaque objects in three draw states; in maps in four, as subdivision converts one of them; and three of these
    // once more for the sun's map, which clamps depth.
    let pipelines: Vec<_> = kept[..4].iter().map(|(_, pipelines)| *pipelines).collect();
    if plans == [1; 5] && pipelines == [6, 9, 9, 16] {
        return Ok(());
    }
    Err(format!("plans and pipelines: {kept:?}").into())
}

/// An engine's process on whose target nothing depends.
#[derive(Clone, Copy)]
struct Overlay {
    views: ViewKind,
    keep: bool,
}

impl RenderProcess for Overlay {
    fn name(&self) -> &str {
        "overlay"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(self.views);
        declare.clears_color("overlay", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.samples("radiance");
        if self.keep {
            declare.keep();
        }
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var radiance: texture_2d<f32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return textureLoad(radiance, vec2<i32>(in.position.xy), 0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(*self))
    }
}

impl<R: Real> FullScreenCpuShader<R> for Overlay {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        targets[0] = pass.sampled[0].load(pixel.coordinates, 0);
        true
    }
}

fn engines_process() -> Result<(), Failed> {
    with_overlay(on_wgpu)?;
    with_overlay(in_software)
}

fn with_overlay<B: Backend>(new: NewDrawer<B>) -> Result<(), Failed> {
    let [_, scene] = scenes_without_all()?;
    let expected = with_mirror(new)?.draw(&scene)?;
    for (views, index) in [(ViewKind::Main, 0), (ViewKind::Reflection, 1)] {
        for keep in [false, true] {
            let overlay = Overlay { views, keep };
            let (picture, passes) =
                new(&|builder| builder.pipeline(deferred()).process(MIRROR).process(overlay))?.draw(&scene)?;
            let own: Vec<_> = passes.iter().filter(|(name, _)| name == "overlay").map(|(_, view)| *view).collect();
            if own != if keep { vec![index] } else { Vec::new() } || passes.len() - own.len() != expected.1.len() {
                return Err(format!("{:?}: {passes:?}", (views, keep)).into());
            }
            if picture != expected.0 {
                return Err(format!("{:?}: the picture differs", (views, keep)).into());
            }
        }
    }
    Ok(())
}
