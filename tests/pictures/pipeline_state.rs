//! Blend equations and face culling that a process sets, whatever the materials say.

use std::sync::Arc;

use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::command::Selection;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    BlendComponent, BlendEquation, BlendFactor, ClearColor, CommandDraws, CpuShader, Declare, Draws, FaceCulling,
    Format, FullScreen, FullScreenCpuShader, FullScreenPixel, ObjectCpuShader, ObjectPixel, PassInputs,
    ProceduralDraws, RenderProcess, ShaderObject, VARYINGS, VertexInput, VertexOutput,
};
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::{Blend, Camera, Material, Mesh, RenderObject, Scene, Topology};
use drawloom::task::Scheduler;
use drawloom::{Renderer, RendererBuilder};
use drawloom_testing::scenes::{as_list, cube, culled, field, sized, with_meshes};
use half::f16;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;

pub const CASES: &[Case] = &[
    ("colours_mix_by_the_equation_of_their_target", equations),
    ("objects_with_equations_write_depth_though_their_material_blends", depth_of_blended_objects),
    ("reversed_culling_draws_what_meshes_of_the_other_winding_show", reversed),
    ("without_culling_every_material_is_double_sided", without_culling),
];

const SOURCE: [f64; 4] = [0.75, 0.25, -0.5, 0.5];
const DESTINATION: [f64; 4] = [0.5, 1.0, 2.0, 0.25];

/// The targets: the equation of the first is tested, that of the second is [`BlendEquation::ADDITIVE`].
const TARGETS: [&str; 2] = ["mixed", "sum"];

/// Fills both targets with a colour.
#[derive(Clone, Copy)]
struct Fill;

impl RenderProcess for Fill {
    fn name(&self) -> &str {
        "fill"
    }

    fn declare(&self, declare: &mut Declare) {
        for target in TARGETS {
            declare.clears_color(target, Format::Rgba16Float, ClearColor::Value(DESTINATION));
        }
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws { shader: CONSTANT, ..CommandDraws::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(Constant))
    }
}

/// What a [`Mix`] draws.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Objects,
    FullScreen,
    Procedural,
}

/// Mixes the source with both targets.
#[derive(Clone, Copy)]
struct Mix {
    equation: BlendEquation,
    kind: Kind,
}

const CONSTANT: &str = "
    struct Colors {
        @location(0) first: vec4<f32>,
        @location(1) second: vec4<f32>,
    }

    @vertex
    fn vertex(in: VertexInput) -> @builtin(position) vec4<f32> {
        return clip_position(relative_position(drawn_object(in.instance), in.position));
    }

    @fragment
    fn fragment() -> Colors {
        let color = vec4<f32>(0.75, 0.25, -0.5, 0.5);
        return Colors(color, color);
    }
";

const TRIANGLE: &str = "
    struct Colors {
        @location(0) first: vec4<f32>,
        @location(1) second: vec4<f32>,
    }

    @vertex
    fn vertex(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4<f32> {
        return vec4<f32>(f32(vertex % 2u) * 4.0 - 1.0, f32(vertex / 2u) * 4.0 - 1.0, 0.5, 1.0);
    }

    @fragment
    fn fragment() -> Colors {
        let color = vec4<f32>(0.75, 0.25, -0.5, 0.5);
        return Colors(color, color);
    }
";

impl RenderProcess for Mix {
    fn name(&self) -> &str {
        "mix"
    }

    fn declare(&self, declare: &mut Declare) {
        for target in TARGETS {
            declare.draws_over(target);
        }
        declare.after("fill");
    }

    fn draws(&self) -> Draws<'_> {
        let blend_equations = vec![self.equation, BlendEquation::ADDITIVE];
        let shader = CONSTANT;
        match self.kind {
            Kind::Objects => Draws::Commands(CommandDraws {
                shader,
                selection: Selection::ALL,
                blend_equations,
                ..CommandDraws::default()
            }),
            Kind::FullScreen => Draws::FullScreen(FullScreen {
                shader: "
                    struct Colors {
                        @location(0) first: vec4<f32>,
                        @location(1) second: vec4<f32>,
                    }

                    @fragment
                    fn fragment(in: FullScreenPixel) -> Colors {
                        let color = vec4<f32>(0.75, 0.25, -0.5, 0.5);
                        return Colors(color, color);
                    }
                ",
                blend_equations,
                ..FullScreen::default()
            }),
            Kind::Procedural => Draws::Procedural(ProceduralDraws {
                shader: TRIANGLE,
                count: drawloom::process::DrawCount::Count { vertices: 3, instances: 1 },
                blend_equations,
                ..ProceduralDraws::default()
            }),
        }
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        match self.kind {
            Kind::Objects => Some(CpuShader::objects(Constant)),
            Kind::FullScreen => Some(CpuShader::full_screen(Constant)),
            Kind::Procedural => None,
        }
    }
}

struct Constant;

impl<R: Real> ObjectCpuShader<R> for Constant {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let clip = pass.view.clip_position(object.relative_position(vertex.position));
        VertexOutput { clip, varyings: [R::zero(); VARYINGS] }
    }

    fn fragment(&self, _: &PassInputs<'_, R>, _: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        targets.fill(Vector(SOURCE.map(R::of)));
        true
    }
}

impl<R: Real> FullScreenCpuShader<R> for Constant {
    fn fragment(&self, _: &PassInputs<'_, R>, _: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        targets.fill(Vector(SOURCE.map(R::of)));
        true
    }
}

fn on_wgpu<const T: usize>(
    scene: &Scene,
    targets: [&str; T],
    build: impl FnOnce(RendererBuilder<drawloom::backend::WgpuBackend>) -> RendererBuilder<drawloom::backend::WgpuBackend>,
) -> Result<Vec<Picture>, Failed> {
    let mut fixture = Fixture::with(2, build)?;
    let recorded = fixture.record(scene)?;
    let submission = fixture.submit(recorded)?;
    targets.into_iter().map(|target| Ok(submission.read(0, target)?)).collect()
}

fn on_software<const T: usize>(
    scene: &Scene,
    targets: [&str; T],
    build: impl FnOnce(RendererBuilder<SoftwareBackend>) -> RendererBuilder<SoftwareBackend>,
) -> Result<Vec<Picture>, Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    let (mut renderer, submitter) =
        build(Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler)))).build(scheduler)?;
    let recorded = renderer.record(scene.as_scene_ref())?;
    let submission = submitter.submit(recorded)?.submission;
    targets.into_iter().map(|target| Ok(submission.read(0, target)?)).collect()
}

/// One cube that covers the picture, with a blending material, so that only a mixing process draws it.
fn covering_cube() -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::new(0.0, 0.0, 1.2), DVec3::ZERO), [4, 4])];
    let (mesh, glass) = (scene.add(cube())?, scene.add(Material { blend: Blend::Subtractive, ..Material::default() })?);
    scene.add_object(RenderObject::new(mesh, glass, DVec3::ZERO))?;
    Ok(scene)
}

/// What a blend equation makes of a source and a destination, in the channel of this index.
type Blended = fn([f64; 4], [f64; 4], usize) -> f64;

fn equations_and_results() -> Vec<(BlendEquation, Blended)> {
    use BlendFactor::*;
    let all = BlendEquation::same_for_all_channels;
    let sum = |source, destination| all(BlendComponent::Add { source, destination });
    vec![
        (BlendEquation::REPLACE, |s, _, c| s[c]),
        (BlendEquation::MULTIPLY, |s, d, c| s[c] * d[c]),
        (BlendEquation::PREMULTIPLIED_ALPHA, |s, d, c| s[c] + d[c] * (1.0 - s[3])),
        (Blend::Alpha.into(), |s, d, c| s[c] * if c == 3 { 1.0 } else { s[3] } + d[c] * (1.0 - s[3])),
        (Blend::Subtractive.into(), |s, d, c| d[c] - s[c]),
        (sum(Zero, Source), |s, d, c| d[c] * s[c]),
        (sum(OneMinusSource, One), |s, d, c| s[c] * (1.0 - s[c]) + d[c]),
        (sum(SourceAlpha, OneMinusSource), |s, d, c| s[c] * s[3] + d[c] * (1.0 - s[c])),
        (sum(OneMinusSourceAlpha, DestinationAlpha), |s, d, c| s[c] * (1.0 - s[3]) + d[c] * d[3]),
        (sum(OneMinusDestination, OneMinusDestinationAlpha), |s, d, c| s[c] * (1.0 - d[c]) + d[c] * (1.0 - d[3])),
        (all(BlendComponent::Subtract { source: Destination, destination: SourceAlpha }), |s, d, c| {
            s[c] * d[c] - d[c] * s[3]
        }),
        (all(BlendComponent::ReverseSubtract { source: Destination, destination: SourceAlpha }), |s, d, c| {
            d[c] * s[3] - s[c] * d[c]
        }),
        (all(BlendComponent::Min), |s, d, c| s[c].min(d[c])),
        (all(BlendComponent::Max), |s, d, c| s[c].max(d[c])),
        (BlendEquation { color: BlendComponent::Max, ..BlendEquation::ADDITIVE }, |s, d, c| {
            if c == 3 { s[c] + d[c] } else { s[c].max(d[c]) }
        }),
    ]
}

fn expect(picture: &Picture, mixed: Blended, of: &str) -> Result<(), Failed> {
    let expected: Vec<_> = (0..4).map(|channel| mixed(SOURCE, DESTINATION, channel)).collect();
    for pixel in picture.bytes.chunks_exact(8) {
        let found: Vec<_> =
            pixel.chunks_exact(2).map(|bytes| f16::from_le_bytes([bytes[0], bytes[1]]).to_f64()).collect();
        // The colours and products are exact in half floats; a device may still round on the way.
        if found.iter().zip(&expected).any(|(found, expected)| (found - expected).abs() > 1e-3) {
            return Err(format!("{of}: {found:?} instead of {expected:?}").into());
        }
    }
    Ok(())
}

fn equations() -> Result<(), Failed> {
    let scene = covering_cube()?;
    for kind in [Kind::Objects, Kind::FullScreen, Kind::Procedural] {
        for (equation, mixed) in equations_and_results() {
            let mix = Mix { equation, kind };
            let mut found = vec![(
                "wgpu",
                on_wgpu(&scene, TARGETS, |builder| {
                    builder.process(Fill).process(mix).output(TARGETS[0]).output(TARGETS[1])
                })?,
            )];
            if kind != Kind::Procedural {
                let pictures = on_software(&scene, TARGETS, |builder| {
                    builder.process(Fill).process(mix).output(TARGETS[0]).output(TARGETS[1])
                })?;
                found.push(("software", pictures));
            }
            for (backend, pictures) in found {
                expect(&pictures[0], mixed, &format!("{equation:?} of {kind:?} on {backend}"))?;
                expect(&pictures[1], |s, d, c| s[c] + d[c], &format!("the second target of {kind:?} on {backend}"))?;
            }
        }
    }
    Ok(())
}

/// Draws all objects in the colour of their index, over everything.
#[derive(Clone)]
struct Numbered {
    face_culling: FaceCulling,
    blend_equations: Vec<BlendEquation>,
}

impl RenderProcess for Numbered {
    fn name(&self) -> &str {
        "numbered"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("numbers", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.clears_depth("depth of numbers", Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws {
            shader: "
                struct Corner {
                    @builtin(position) position: vec4<f32>,
                    @location(0) @interpolate(flat) object: u32,
                }

                @vertex
                fn vertex(in: VertexInput) -> Corner {
                    let object = drawn_object(in.instance);
                    return Corner(clip_position(relative_position(object, in.position)), object.index);
                }

                @fragment
                fn fragment(in: Corner) -> @location(0) vec4<f32> {
                    return vec4<f32>(f32(in.object % 15u) / 15.0, f32(in.object / 15u % 15u) / 15.0, 1.0, 1.0);
                }
            ",
            selection: Selection::ALL,
            face_culling: self.face_culling,
            blend_equations: self.blend_equations.clone(),
            ..CommandDraws::default()
        })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(CpuNumbered))
    }
}

struct CpuNumbered;

impl<R: Real> ObjectCpuShader<R> for CpuNumbered {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        ObjectCpuShader::vertex(&Constant, pass, object, vertex)
    }

    fn fragment(&self, _: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let share = |number: u32| R::of(f64::from(number % 15) / 15.0);
        targets[0] = Vector([share(pixel.object), share(pixel.object / 15), R::one(), R::one()]);
        true
    }
}

fn numbers(scene: &Scene, numbered: &Numbered) -> Result<[Vec<Picture>; 2], Failed> {
    let target = ["numbers"];
    Ok([
        on_wgpu(scene, target, |builder| builder.process(numbered.clone()).output(target[0]))?,
        on_software(scene, target, |builder| builder.process(numbered.clone()).output(target[0]))?,
    ])
}

/// One camera of the [field], whose meshes are lists.
fn lists() -> Scene {
    let mut scene = with_meshes(field(200), as_list);
    scene.cameras.truncate(1);
    scene
}

fn flipped(mesh: &Mesh) -> Mesh {
    let indices = mesh.triangles().flat_map(|[a, b, c]| [a, c, b]).collect();
    Mesh::new(mesh.name(), Topology::TriangleList, mesh.vertices().to_vec(), indices).unwrap()
}

fn reversed() -> Result<(), Failed> {
    let by = |face_culling| Numbered { face_culling, blend_equations: vec![BlendEquation::REPLACE] };
    let expected = numbers(&with_meshes(lists(), flipped), &by(FaceCulling::ByMaterial))?;
    if expected == numbers(&lists(), &by(FaceCulling::ByMaterial))? {
        return Err("the winding changes nothing".into());
    }
    for scene in [lists(), with_meshes(lists(), culled)] {
        let found = numbers(&scene, &by(FaceCulling::Reversed))?;
        for (backend, (found, expected)) in ["wgpu", "software"].into_iter().zip(found.iter().zip(&expected)) {
            if found != expected {
                return Err(format!("it differs on {backend}").into());
            }
        }
    }
    Ok(())
}

fn without_culling() -> Result<(), Failed> {
    let by = |face_culling| Numbered { face_culling, blend_equations: Vec::new() };
    let mut double_sided = lists();
    let materials: Vec<_> =
        double_sided.assets().iter::<Material>().map(|(handle, one)| (handle, one.clone())).collect();
    for (handle, material) in materials {
        double_sided.replace(handle, Material { double_sided: true, ..material })?;
    }
    let expected = numbers(&double_sided, &by(FaceCulling::ByMaterial))?;
    if expected == numbers(&lists(), &by(FaceCulling::ByMaterial))? {
        return Err("no object shows its back".into());
    }
    for scene in [lists(), with_meshes(lists(), culled)] {
        if numbers(&scene, &by(FaceCulling::Nothing))? != expected {
            return Err("it differs".into());
        }
    }
    Ok(())
}

/// Two panes, the nearer one drawn first: the farther one is hidden if that writes depth.
fn depth_of_blended_objects() -> Result<(), Failed> {
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::new(0.0, 0.0, 9.0), DVec3::ZERO), [32, 32])];
    let (mesh, glass) = (scene.add(cube())?, scene.add(Material { blend: Blend::Alpha, ..Material::default() })?);
    for z in [0.0, -6.0] {
        let object = RenderObject::new(mesh, glass, DVec3::new(0.0, 0.0, z));
        scene.add_object(RenderObject { scale: Vec3::new(1.0, 1.0, 0.1), ..object })?;
    }
    let numbered = |blend_equations| Numbered { face_culling: FaceCulling::ByMaterial, blend_equations };
    let sum_of = |pictures: &[Picture]| pictures[0].bytes.iter().map(|byte| u64::from(*byte)).sum::<u64>();
    // Front to back, so that the depth of the nearer pane hides the farther one. Back to front would draw both.
    let front_to_back = FrontToBack(numbered(vec![BlendEquation::ADDITIVE]));
    let [by_wgpu, by_software] = [
        on_wgpu(&scene, ["numbers"], |builder| builder.process(front_to_back.clone()).output("numbers"))?,
        on_software(&scene, ["numbers"], |builder| builder.process(front_to_back.clone()).output("numbers"))?,
    ];
    let mut alone = scene;
    let last = alone.objects().last().ok_or("there are two objects")?;
    alone.remove_object(last)?;
    let expected = numbers(&alone, &numbered(vec![BlendEquation::ADDITIVE]))?;
    for (backend, found, expected) in [("wgpu", by_wgpu, &expected[0]), ("software", by_software, &expected[1])] {
        if sum_of(&found) != sum_of(expected) || sum_of(&found) == 0 {
            return Err(format!("the hidden pane is drawn on {backend}").into());
        }
    }
    Ok(())
}

/// The same, the nearest object first.
#[derive(Clone)]
struct FrontToBack(Numbered);

impl RenderProcess for FrontToBack {
    fn name(&self) -> &str {
        self.0.name()
    }

    fn declare(&self, declare: &mut Declare) {
        self.0.declare(declare);
    }

    fn draws(&self) -> Draws<'_> {
        match self.0.draws() {
            Draws::Commands(draws) => Draws::Commands(CommandDraws {
                selection: draws.selection.in_order(drawloom::command::DrawOrder::FrontToBack),
                ..draws
            }),
            other => other,
        }
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        self.0.cpu_shader()
    }
}
