//! Attributes of the engine's own that meshes have for each vertex.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::command::Selection;
use drawloom::glam::DVec3;
use drawloom::process::{
    ClearColor, CommandDraws, CpuShader, Declare, Deferred, Draws, Format, ObjectCpuShader, ObjectPixel, PassInputs,
    RenderProcess, ShaderObject, VARYINGS, VertexInput, VertexOutput,
};
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::{
    Blend, Camera, Changes, Material, Mesh, RenderObject, Scene, SceneRef, Topology, VERTEX_INDEX, Vertex,
    VertexAttribute,
};
use drawloom::task::Scheduler;
use drawloom_testing::scenes::{cube, sized, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, backend, pixel};
use crate::image_distance::assert_color;
use crate::strategies::strategies;

pub const CASES: &[Case] = &[
    ("attributes_are_interpolated_and_meshes_without_them_have_the_default", interpolated),
    ("attributes_are_those_of_their_mesh_when_meshes_come_and_go", changing_meshes),
    ("a_process_that_begins_to_read_an_attribute_reads_that_of_every_mesh", read_later),
    ("every_strategy_and_the_software_backend_read_the_same_attributes", same_everywhere),
    ("every_vertex_has_its_index_in_its_mesh", vertex_indices),
];

pub const COLOR: VertexAttribute<[f32; 3]> = VertexAttribute::new("colour");
pub const STRENGTH: VertexAttribute<u32> = VertexAttribute::new("strength");
pub const SHADE: VertexAttribute<[u8; 4]> = VertexAttribute::new("shade");

pub const SHADER: &str = "
    struct Corner {
        @builtin(position) position: vec4<f32>,
        @location(0) color: vec3<f32>,
    }

    @vertex
    fn vertex(in: VertexInput) -> Corner {
        let object = drawn_object(in.instance);
        let position = clip_position(relative_position(object, in.position));
        return Corner(position, in.colour * f32(in.strength) / 100.0 * in.shade.g);
    }

    @fragment
    fn fragment(in: Corner) -> @location(0) vec4<f32> {
        return vec4<f32>(in.color, 1.0);
    }
";

fn reads_attributes(declare: &mut Declare) {
    declare.reads_attribute(COLOR, [0.0, 0.0, 1.0]);
    declare.reads_attribute(STRENGTH, 50);
    declare.reads_attribute(SHADE, [0, 255, 0, 0]);
}

/// Draws the product of three attributes into the target "coloured".
#[derive(Clone, Copy)]
pub struct Colored;

impl RenderProcess for Colored {
    fn name(&self) -> &str {
        "coloured"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("coloured", Format::Rgba8Unorm, ClearColor::Value([0.0, 0.0, 0.0, 1.0]));
        declare.clears_depth("depth of coloured", Format::Depth32Float);
        reads_attributes(declare);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws { shader: SHADER, selection: Selection::ALL, ..CommandDraws::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(*self))
    }
}

impl<R: Real> ObjectCpuShader<R> for Colored {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let [color, strength, shade, _] = vertex.attributes;
        let mut varyings = [R::zero(); VARYINGS];
        for channel in 0..3 {
            varyings[channel] = color[channel] * strength[0] / R::of(100.0) * shade[1];
        }
        VertexOutput { clip: pass.view.clip_position(object.relative_position(vertex.position)), varyings }
    }

    fn fragment(&self, _: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [red, green, blue, ..] = pixel.varyings;
        targets[0] = Vector([red, green, blue, R::one()]);
        true
    }
}

/// A square whose left side is red and whose right side is green.
fn two_colored() -> Result<Mesh, Failed> {
    let mesh = square(Topology::TriangleList);
    let color = |vertex: &Vertex| if vertex.position[0] < 0.0 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let colors: Vec<_> = mesh.vertices().iter().map(color).collect();
    let count = mesh.vertices().len();
    Ok(mesh.with_attribute(COLOR, &colors)?.with_attribute(STRENGTH, &vec![100; count])?)
}

fn scene_of(meshes: Vec<Mesh>) -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO), [128, 32])];
    let material = scene.add(Material::default())?;
    for (index, mesh) in meshes.into_iter().enumerate() {
        let mesh = scene.add(mesh)?;
        scene.add_object(RenderObject::new(mesh, material, DVec3::X * (index as f64 * 4.0 - 4.0)))?;
    }
    Ok(scene)
}

fn draw(fixture: &mut Fixture, scene: &Scene) -> Result<Picture, Failed> {
    let recorded = fixture.record(scene)?;
    Ok(fixture.submit(recorded)?.read(0, "coloured")?)
}

fn interpolated() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.process(Colored).output("coloured"))?;
    let plain = square(Topology::TriangleList);
    let shades = vec![[0, 51, 0, 0]; plain.vertices().len()];
    let shaded = plain.clone().with_attribute(SHADE, &shades)?;
    let picture = draw(&mut fixture, &scene_of(vec![two_colored()?, plain, shaded])?)?;
    // The pixel left of the middle of the first square, whose sides are 5.5 pixels away.
    let [red, green, blue] = pixel(&picture, 41, 16);
    if red.abs_diff(131) > 15 || green.abs_diff(124) > 15 || blue != 0 {
        return Err(format!("{red}, {green}, {blue} between red and green").into());
    }
    assert_color(pixel(&picture, 64, 16), [0, 0, 128])?;
    assert_color(pixel(&picture, 86, 16), [0, 0, 26])
}

/// The mesh with one colour.
pub fn with_colors(mesh: Mesh, red: f32) -> Result<Mesh, Failed> {
    let count = mesh.vertices().len();
    Ok(mesh.with_attribute(COLOR, &vec![[red, 0.5, 0.25]; count])?.with_attribute(STRENGTH, &vec![100; count])?)
}

fn changing_meshes() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.process(Colored).output("coloured"))?;
    let mut scene = scene_of(vec![two_colored()?, square(Topology::TriangleList)])?;
    let material = scene.as_scene_ref().materials[0];
    for step in 0..10 {
        let mesh = match step {
            // There are further pages.
            4 => cube().subdivided(0.02, 100_000),
            _ if step % 2 == 0 => cube(),
            _ => square(Topology::TriangleList),
        };
        let mesh = with_colors(mesh, step as f32 * 0.1)?;
        if step == 5 {
            let replaced = scene.as_scene_ref().meshes[0];
            scene.replace(replaced, mesh)?;
        } else {
            let mesh = scene.add(mesh)?;
            let position = DVec3::new(f64::from(step) * 2.0 - 9.0, 0.0, 0.1 * f64::from(step));
            scene.add_object(RenderObject::new(mesh, material, position))?;
        }
        if step == 7 {
            let removed = scene.as_scene_ref().meshes[1];
            scene.remove(removed)?;
        }
        let found = draw(&mut fixture, &scene)?;
        let mut new = Fixture::with(2, |builder| builder.process(Colored).output("coloured"))?;
        if found != draw(&mut new, &scene)? {
            return Err(format!("step {step} differs from a new renderer").into());
        }
    }
    Ok(())
}

/// Draws blended objects in their colours. The plan has it only while an object is blended.
struct ColoredTransparency;

impl RenderProcess for ColoredTransparency {
    fn name(&self) -> &str {
        "transparency"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.draws_over("radiance");
        declare.tests_depth("depth");
        reads_attributes(declare);
    }

    fn draws(&self) -> Draws<'_> {
        let selection = Selection::BLENDED;
        Draws::Commands(CommandDraws { shader: SHADER, selection, writes_depth: false, ..CommandDraws::default() })
    }
}

fn read_later() -> Result<(), Failed> {
    let fixture = || {
        Fixture::with(2, |builder| {
            builder.pipeline(Deferred::to_picture().replace("transparency", ColoredTransparency))
        })
    };
    let mut scene = scene_of(vec![two_colored()?, square(Topology::TriangleList), cube()])?;
    let blended = scene.add(Material { blend: Blend::Alpha, opacity: 0.5, ..Material::default() })?;
    let opaque = scene.as_scene_ref().materials[0];
    let mut kept = fixture()?;
    for (frame, materials) in [[opaque; 3], [blended, opaque, blended], [opaque; 3], [blended; 3]].iter().enumerate() {
        let lent = SceneRef { materials, changes: Changes::Unknown, ..scene.as_scene_ref() };
        let found = kept.renderer.record(lent)?;
        let found = kept.submit(found)?.read(0, "picture")?;
        let mut new = fixture()?;
        let expected = new.renderer.record(lent)?;
        if found != new.submit(expected)?.read(0, "picture")? {
            return Err(format!("frame {frame} differs from that of a new renderer").into());
        }
    }
    Ok(())
}

fn same_everywhere() -> Result<(), Failed> {
    let culled = with_colors(cube(), 0.75)?.with_triangle_culling(true);
    let scene = scene_of(vec![two_colored()?, square(Topology::TriangleList), culled])?;
    let scheduler = Arc::new(Scheduler::new(2)?);
    let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler))).process(Colored).output("coloured");
    let (mut renderer, submitter) = builder.build(scheduler)?;
    let by_software = submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission.read(0, "coloured")?;
    let mut first = None;
    for (recording, encoding) in strategies() {
        let backend = backend()?.recording_strategy(recording).encoding_strategy(encoding);
        let builder = Renderer::builder(backend).process(Colored).output("coloured");
        let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(2)?))?;
        let mut fixture = Fixture { renderer, submitter };
        for _frame in 0..2 {
            let picture = draw(&mut fixture, &scene)?;
            let expected = first.get_or_insert_with(|| picture.clone());
            if picture != *expected {
                return Err(format!("{recording:?}, {encoding:?} differs").into());
            }
        }
    }
    let by_wgpu = first.ok_or("nothing was drawn")?;
    let pairs = by_wgpu.bytes.chunks_exact(4).zip(by_software.bytes.chunks_exact(4));
    let differs = |(one, other): &(&[u8], &[u8])| one.iter().zip(*other).any(|(one, other)| one.abs_diff(*other) > 2);
    let differing = pairs.filter(differs).count();
    if differing * 100 > by_wgpu.bytes.len() / 4 { Err(format!("{differing} pixels differ").into()) } else { Ok(()) }
}

/// What meshes bring themselves in place of [`VERTEX_INDEX`].
const OWN_INDEX: VertexAttribute<u32> = VertexAttribute::new("own_index");

/// Draws vertices in the colour of their index into the target "coloured".
#[derive(Clone)]
struct Indexed {
    attribute: VertexAttribute<u32>,
    shader: String,
}

impl Indexed {
    fn new(attribute: VertexAttribute<u32>, name: &str) -> Self {
        Self {
            attribute,
            shader: SHADER.replace(
                "in.colour * f32(in.strength) / 100.0 * in.shade.g",
                &format!("vec3<f32>(f32(in.{name}) / 25.0, 0.0, 0.0)"),
            ),
        }
    }
}

impl RenderProcess for Indexed {
    fn name(&self) -> &str {
        "indexed"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("coloured", Format::Rgba8Unorm, ClearColor::Value([0.0, 0.0, 0.0, 1.0]));
        declare.clears_depth("depth of coloured", Format::Depth32Float);
        declare.reads_attribute(self.attribute, 0);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws { shader: &self.shader, selection: Selection::ALL, ..CommandDraws::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(self.clone()))
    }
}

impl<R: Real> ObjectCpuShader<R> for Indexed {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let mut varyings = [R::zero(); VARYINGS];
        varyings[0] = vertex.attributes[0][0] / R::of(25.0);
        VertexOutput { clip: pass.view.clip_position(object.relative_position(vertex.position)), varyings }
    }

    fn fragment(&self, _: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        targets[0] = Vector([pixel.varyings[0], R::zero(), R::zero(), R::one()]);
        true
    }
}

fn vertex_indices() -> Result<(), Failed> {
    let with_index = |mesh: Mesh| {
        let indices: Vec<_> = (0..mesh.vertices().len() as u32).collect();
        mesh.with_attribute(OWN_INDEX, &indices)
    };
    let mut fixtures = [(VERTEX_INDEX, "vertex_index"), (OWN_INDEX, "own_index")]
        .map(|(attribute, name)| Indexed::new(attribute, name))
        .map(|process| Fixture::with(2, |builder| builder.process(process).output("coloured")));
    let mut scene = scene_of(vec![with_index(square(Topology::TriangleList))?, with_index(cube())?])?;
    let material = scene.as_scene_ref().materials[0];
    // In the last frame meshes lie elsewhere.
    for step in 0..3 {
        if step == 1 {
            let mesh = scene.add(with_index(cube())?)?;
            scene.add_object(RenderObject::new(mesh, material, DVec3::X * 4.0))?;
        }
        if step == 2 {
            let removed = scene.as_scene_ref().meshes[0];
            scene.remove(removed)?;
        }
        let mut pictures = Vec::new();
        for fixture in &mut fixtures {
            let fixture = fixture.as_mut().map_err(|error| format!("{error:?}"))?;
            pictures.push(draw(fixture, &scene)?);
        }
        let reds = pictures[0].bytes.iter().step_by(4).filter(|red| **red > 0).count();
        if pictures[0] != pictures[1] || reds < 100 {
            return Err(format!("step {step} has other indices, or {reds} are few").into());
        }
        let scheduler = Arc::new(Scheduler::new(2)?);
        let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler)));
        let (mut renderer, submitter) =
            builder.process(Indexed::new(VERTEX_INDEX, "vertex_index")).output("coloured").build(scheduler)?;
        let found = submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission.read(0, "coloured")?;
        let differing =
            found.bytes.iter().zip(&pictures[0].bytes).filter(|(one, other)| one.abs_diff(**other) > 2).count();
        if differing * 100 > found.bytes.len() {
            return Err(format!("step {step}: {differing} bytes differ in software").into());
        }
    }
    Ok(())
}
