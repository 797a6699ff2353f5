//! Views that are layers of one texture and are not drawn in every frame, while other layers come and go.

use std::sync::Arc;

use drawloom::backend::{Backend, Picture, SoftwareBackend};
use drawloom::process::{
    ClearColor, CpuShader, Declare, Deferred, Draws, Format, FullScreen, FullScreenCpuShader, FullScreenPixel,
    PassInputs, RenderProcess,
};
use drawloom::raster::{Real, Vector4};
use drawloom::scene::{Camera, Redraw, Scene, SceneRef, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{Renderer, RendererBuilder};
use drawloom_testing::scenes::sized;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;
use crate::sampled_layers::{CENTER, DIRECTIONS, Environment, inside, world};
use crate::strategies::expect;

pub const CASES: &[Case] = &[
    ("cached_layers_stay_while_others_come_and_go", plain),
    ("cached_layers_and_small_targets_stay_while_others_come_and_go", transient),
    ("cached_layers_stay_in_software_while_others_come_and_go", software),
];

/// Small enough for targets that are layers of a texture with those of other views.
const SIDE: u32 = 64;
const LAYERS: u32 = 8;
const TARGETS: [&str; 2] = ["columns", "environment"];

/// Draws some columns of each layer of the array `probe`, whose first six are a cube map too.
#[derive(Clone, Copy)]
struct Columns;

impl RenderProcess for Columns {
    fn name(&self) -> &str {
        "columns"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples_view_layers(ViewKind::Reflection, "probe", "radiance", LAYERS);
        declare.clears_color("columns", Format::Rgba16Float, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var layers: texture_2d_array<f32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                let pixel = vec2<u32>(in.position.xy);
                return textureLoad(layers, pixel, pixel.x / 8u, 0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(*self))
    }
}

impl<R: Real> FullScreenCpuShader<R> for Columns {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        targets[0] = pass.sampled[0].load(pixel.coordinates, pixel.coordinates[0] / 8);
        true
    }
}

fn build<B: Backend>(builder: RendererBuilder<B>) -> RendererBuilder<B> {
    let builder = builder.pipeline(Deferred::to_picture()).process(Columns).process(Environment);
    builder.output("columns").output("environment")
}

/// The camera of a layer: of a face of the cube map, or of one of the layers behind them.
fn layer(index: u32, redraw: Redraw) -> Camera {
    let camera = match Camera::cube_faces("probe", CENTER, SIDE, 0.05).get(index as usize) {
        Some(face) => face.clone(),
        None => {
            let (name, kind) = (format!("probe/{index}"), ViewKind::Reflection);
            Camera { name, kind, ..sized(inside(DIRECTIONS[index as usize]), [SIDE; 2]) }
        }
    };
    Camera { redraw, ..camera }
}

/// Draws frames, and compares each with what is drawn of the same world if no view is cached. `draw` returns the
/// pictures of the main camera, which is the first one, and how many frames ago each other view was drawn.
fn check(
    mut draw: impl FnMut(SceneRef<'_>) -> Result<(Vec<Picture>, Vec<u32>), Failed>,
    mut draw_all: impl FnMut(SceneRef<'_>) -> Result<(Vec<Picture>, Vec<u32>), Failed>,
) -> Result<(), Failed> {
    let mut scene = world()?;
    scene.cameras = vec![sized(inside(DIRECTIONS[6]), [SIDE; 2])];
    scene.cameras.extend([layer(6, Redraw::OnCameraChange), layer(7, Redraw::Interval(100))]);
    let mut check = |step: &str, scene: &Scene, expected: &[u32]| {
        let (found, ages) = draw(scene.as_scene_ref())?;
        let of_every_frame = |camera: &Camera| Camera { redraw: Redraw::EveryFrame, ..camera.clone() };
        let cameras: Vec<_> = scene.cameras.iter().map(of_every_frame).collect();
        let (all, _) = draw_all(SceneRef { cameras: &cameras, ..scene.as_scene_ref() })?;
        expect(ages == expected, || format!("{step}: drawn {ages:?} frames ago, not {expected:?}"))?;
        for ((found, all), target) in found.iter().zip(&all).zip(TARGETS) {
            expect(found == all, || format!("{step}: {target} differs"))?;
        }
        Ok::<_, Failed>(())
    };
    check("the first frame", &scene, &[0, 0])?;
    check("the same again", &scene, &[1, 1])?;
    // Only now, the texture is a cube map too.
    scene.cameras.extend((0..6).map(|face| layer(face, Redraw::OnCameraChange)));
    check("with a cube map", &scene, &[0; 8])?;
    check("with the same cube map", &scene, &[1; 8])?;
    scene.cameras[1].orientation = layer(7, Redraw::EveryFrame).orientation;
    check("after a camera turned", &scene, &[0, 2, 2, 2, 2, 2, 2, 2])?;
    let face = scene.cameras.remove(6);
    check("without a face", &scene, &[0; 7])?;
    scene.cameras.push(face);
    check("with the face again", &scene, &[1, 1, 1, 1, 1, 1, 1, 0])?;
    scene.cameras.truncate(3);
    check("without the cube map", &scene, &[0, 0])
}

fn in_fixture(fixture: &mut Fixture, scene: SceneRef<'_>) -> Result<(Vec<Picture>, Vec<u32>), Failed> {
    let recorded = fixture.renderer.record(scene)?;
    let ages = recorded.statistics().views[1..].iter().map(|view| view.age).collect();
    let submission = fixture.submit(recorded)?;
    let pictures = TARGETS.map(|target| submission.read(0, target)).into_iter().collect::<Result<_, _>>()?;
    Ok((pictures, ages))
}

fn plain() -> Result<(), Failed> {
    let [mut fixture, mut every_frame] = [Fixture::with(2, build)?, Fixture::with(1, build)?];
    check(|scene| in_fixture(&mut fixture, scene), |scene| in_fixture(&mut every_frame, scene))
}

fn transient() -> Result<(), Failed> {
    let [mut fixture, mut every_frame] = [Fixture::with_transient_targets(2, build)?, Fixture::with(1, build)?];
    check(|scene| in_fixture(&mut fixture, scene), |scene| in_fixture(&mut every_frame, scene))
}

fn software() -> Result<(), Failed> {
    let renderer = |workers| {
        let scheduler = Arc::new(Scheduler::new(workers)?);
        let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler)));
        let (mut renderer, submitter) = build(builder).build(scheduler)?;
        let draw = move |scene: SceneRef<'_>| {
            let recorded = renderer.record(scene)?;
            let ages = recorded.statistics().views[1..].iter().map(|view| view.age).collect();
            let submission = submitter.submit(recorded)?.submission;
            let pictures = TARGETS.map(|target| submission.read(0, target)).into_iter().collect::<Result<_, _>>()?;
            Ok::<_, Failed>((pictures, ages))
        };
        Ok::<_, Failed>(draw)
    };
    check(renderer(2)?, renderer(1)?)
}
