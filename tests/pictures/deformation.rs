//! Objects whose vertices the engine's own shader moves look like meshes whose vertices are there.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    CpuShader, Declare, Deferred, Deformation, DeformationCpuShader, Draws, GeometryBuffer, GeometryFormats,
    PassInputs, RenderProcess, ShaderObject, ShaderResource, VertexInput,
};
use drawloom::raster::{Real, Vector};
use drawloom::scene::{
    Blend, Bounds, Camera, LayerMask, Light, Material, MaterialType, Mesh, ObjectColumn, RenderObject, Scene, SceneRef,
    Topology, VERTEX_COLOR, Vertex, VertexAttribute,
};
use drawloom::task::Scheduler;
use drawloom_testing::scenes::{cube, sized};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;

pub const CASES: &[Case] = &[
    ("deformed_objects_look_like_meshes_of_that_shape", shape),
    ("an_object_is_drawn_by_the_first_deformation_of_its_layers_only", first_deformation),
    ("the_software_backend_deforms_objects", on_software),
    ("errors_in_a_deformation_are_at_its_lines", error_lines),
];

/// How far the top of an object is pushed down.
const PUSH: ObjectColumn<f32> = ObjectColumn::new("push");
/// Which vertices that moves.
const TOP: VertexAttribute<f32> = VertexAttribute::new("top");
const PUSHED: LayerMask = LayerMask::layer(5);
const OTHER: LayerMask = LayerMask::layer(6);
/// How far it moves them sideways, for each metre down.
const ASIDE: f32 = 0.25;

struct Push {
    name: &'static str,
    layers: LayerMask,
    aside: Arc<[u8]>,
}

impl Push {
    fn new(name: &'static str, layers: LayerMask, aside: f32) -> Self {
        Self { name, layers, aside: aside.to_ne_bytes().into() }
    }

    fn usual() -> Self {
        Self::new("push", PUSHED, ASIDE)
    }
}

impl Deformation for Push {
    fn name(&self) -> &str {
        self.name
    }

    fn layers(&self) -> LayerMask {
        self.layers
    }

    fn declare(&self, declare: &mut Declare) {
        declare.reads_column(PUSH);
        declare.reads_attribute(TOP, 0.0);
    }

    fn shader(&self) -> &str {
        "
            @group(3) @binding(0) var<storage, read> push: array<f32>;
            @group(3) @binding(FIRST_RESOURCE) var<storage, read> aside: array<f32>;

            fn deform(in: VertexInput, object: Object) -> VertexInput {
                var out = in;
                let down = push[object.index] * in.top;
                out.position.y -= down;
                out.position.x += aside[0] * down;
                return out;
            }
        "
    }

    fn resources(&self) -> Vec<ShaderResource<'_>> {
        vec![ShaderResource::SharedBytes(Arc::clone(&self.aside))]
    }

    fn cpu_shader(&self, process: CpuShader) -> Option<CpuShader> {
        Some(process.deformed(CpuPush))
    }
}

struct CpuPush;

impl<R: Real> DeformationCpuShader<R> for CpuPush {
    fn deform(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexInput<R> {
        let mut moved = *vertex;
        let down = R::of(f64::from(pass.column(PUSH, object.index))) * vertex.attributes[0][0];
        let [x, y, z] = vertex.position.0;
        moved.position = Vector([x + R::of(f64::from(ASIDE)) * down, y - down, z]);
        moved
    }
}

/// A push beyond the bottom turns a cube inside out.
const PUSHES: [f32; 5] = [0.0, 0.5, 1.5, 2.5, 1.0];

/// A floor, four opaque cubes, a blended one that is pushed, and a blended one in front that is not. The cubes have the
/// shape of the frame if the pipeline does not give it to them.
fn scene(is_in_shape: bool) -> Result<(Scene, Vec<LayerMask>), Failed> {
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::new(1.0, 5.0, 11.0), DVec3::ZERO), [192, 108])];
    scene.ambient = Vec3::splat(0.2);
    scene.lights = vec![
        Light::Directional {
            direction: Vec3::new(-0.48, -0.8, -0.36),
            illuminance: Vec3::splat(2.0),
            casts_shadow: true,
        },
        Light::Hemispherical {
            position: DVec3::new(0.0, 6.0, 3.0),
            direction: Vec3::NEG_Y,
            intensity: Vec3::splat(20.0),
            range: 20.0,
            casts_shadow: true,
        },
    ];
    let stone = scene.add(Material::default())?;
    let glass = scene.add(Material { blend: Blend::Alpha, opacity: 0.5, ..Material::default() })?;
    let mut layers = Vec::new();
    for (index, push) in PUSHES.into_iter().enumerate() {
        let mesh = scene.add(with_top(&cube(), if is_in_shape { push } else { 0.0 })?)?;
        let material = if index == 4 { glass } else { stone };
        let position = DVec3::new(index as f64 * 2.6 - 5.2, 1.0, 0.0);
        scene.add_object(RenderObject::new(mesh, material, position))?;
        layers.push(if push == 0.0 { OTHER } else { PUSHED });
    }
    let floor = scene.add(cube())?;
    // Below each top that is pushed down.
    let object = RenderObject::new(floor, stone, DVec3::new(0.0, -0.7, 0.0));
    scene.add_object(RenderObject { scale: Vec3::new(9.0, 0.1, 4.0), ..object })?;
    let object = RenderObject::new(floor, glass, DVec3::new(2.0, 0.0, 3.5));
    scene.add_object(RenderObject { scale: Vec3::splat(0.3), ..object })?;
    layers.extend([OTHER, OTHER]);
    Ok((scene, layers))
}

/// The mesh with its top pushed down, its triangles culled on the CPU, colours, and the attribute that says what the
/// top is.
fn with_top(mesh: &Mesh, push: f32) -> Result<Mesh, Failed> {
    let top = |vertex: &Vertex| if vertex.position[1] > 0.0 { 1.0_f32 } else { 0.0 };
    let tops: Vec<_> = mesh.vertices().iter().map(top).collect();
    let moved = mesh.vertices().iter().zip(&tops).map(|(vertex, top)| {
        let ([x, y, z], down) = (vertex.position, push * top);
        Vertex { position: [x + ASIDE * down, y - down, z], ..*vertex }
    });
    let moved = Mesh::new(mesh.name(), Topology::TriangleList, moved.collect(), mesh.indices().to_vec())?;
    let color = |vertex: &Vertex| vertex.uv.map(|coordinate| coordinate.clamp(0.0, 1.0));
    let colors: Vec<_> = mesh.vertices().iter().map(color).map(|[u, v]| [u, v, 0.5]).collect();
    let moved = moved.with_attribute(TOP, &tops)?.with_attribute(VERTEX_COLOR, &colors)?;
    Ok(moved.with_triangle_culling(push == 0.0))
}

/// A process whose resources have other bindings than those of the others.
struct ReadsMaterials(GeometryBuffer);

impl RenderProcess for ReadsMaterials {
    fn name(&self) -> &str {
        self.0.name()
    }

    fn declare(&self, declare: &mut Declare) {
        self.0.declare(declare);
        declare.reads_materials(MaterialType::<u32>::new("unread"));
    }

    fn draws(&self) -> Draws<'_> {
        self.0.draws()
    }
}

fn pushes() -> Vec<f32> {
    PUSHES.into_iter().chain([100.0, 100.0]).collect()
}

fn picture_of(deferred: Deferred, scene: &Scene, layers: &[LayerMask], pushes: &[f32]) -> Result<Picture, Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(deferred))?;
    // What is pushed stays within this.
    let [low, high] = [-10.0, 10.0].map(Vec3::splat);
    let bounds = vec![Bounds::around([low, high].into_iter()); layers.len()];
    let columns = [PUSH.values(pushes)];
    let scene = SceneRef { layers, columns: &columns, bounds: &bounds, ..scene.as_scene_ref() };
    let recorded = fixture.renderer.record(scene)?;
    Ok(fixture.submit(recorded)?.read(0, "picture")?)
}

fn shape() -> Result<(), Failed> {
    let (moved, _) = scene(true)?;
    let (scene, layers) = scene(false)?;
    for pipeline in [
        Deferred::to_picture(),
        Deferred::to_picture().depth_pre_pass(true),
        Deferred::to_picture().geometry_shares(2),
        Deferred::to_picture().vertex_colors(true),
        Deferred::to_picture().shadow_maps(None),
        Deferred::to_picture().replace("geometry buffer", GeometryBuffer::new(GeometryFormats::default())),
        Deferred::to_picture()
            .replace("geometry buffer", ReadsMaterials(GeometryBuffer::new(GeometryFormats::default()))),
    ] {
        let expected = picture_of(pipeline.clone(), &moved, &layers, &pushes())?;
        if expected == picture_of(pipeline.clone(), &scene, &layers, &pushes())? {
            return Err("the deformation changes nothing".into());
        }
        let found = picture_of(pipeline.deformation(Push::usual()), &scene, &layers, &pushes())?;
        if found != expected {
            let differing = found.bytes.iter().zip(&expected.bytes).filter(|(one, other)| one != other).count();
            return Err(format!("{differing} bytes differ").into());
        }
    }
    Ok(())
}

fn first_deformation() -> Result<(), Failed> {
    let (scene, mut layers) = scene(false)?;
    layers[1] = PUSHED | OTHER;
    let pushes: Vec<_> = PUSHES.into_iter().chain([0.0, 0.0]).collect();
    let once = picture_of(Deferred::to_picture().deformation(Push::usual()), &scene, &layers, &pushes)?;
    let second = Push::new("second", OTHER | PUSHED, 7.0);
    let both = Deferred::to_picture().deformation(Push::usual()).deformation(second);
    if picture_of(both, &scene, &layers, &pushes)? != once {
        return Err("the second deformation draws objects of the first".into());
    }
    Ok(())
}

fn on_software() -> Result<(), Failed> {
    let (moved, _) = scene(true)?;
    let (scene, layers) = scene(false)?;
    let draw = |deferred: Deferred, scene: &Scene| -> Result<Picture, Failed> {
        let scheduler = Arc::new(Scheduler::new(2)?);
        let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler))).pipeline(deferred);
        let (mut renderer, submitter) = builder.build(scheduler)?;
        let pushes = pushes();
        let columns = [PUSH.values(&pushes)];
        let scene = SceneRef { layers: &layers, columns: &columns, ..scene.as_scene_ref() };
        Ok(submitter.submit(renderer.record(scene)?)?.submission.read(0, "picture")?)
    };
    for colors in [false, true] {
        let pipeline = Deferred::to_picture().vertex_colors(colors);
        let expected = draw(pipeline.clone(), &moved)?;
        if draw(pipeline.deformation(Push::usual()), &scene)? != expected {
            return Err("the software backend draws another shape".into());
        }
    }
    Ok(())
}

/// A deformation with a mistake in its third line.
struct Broken;

impl Deformation for Broken {
    fn name(&self) -> &str {
        "broken"
    }

    fn layers(&self) -> LayerMask {
        PUSHED
    }

    fn declare(&self, _: &mut Declare) {}

    fn shader(&self) -> &str {
        "fn deform(in: VertexInput, object: Object) -> VertexInput {
            var out = in;
            out.position.y -= unknown;
            return out;
        }"
    }
}

fn error_lines() -> Result<(), Failed> {
    let (scene, layers) = scene(false)?;
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture().deformation(Broken)))?;
    let broken = SceneRef { layers: &layers, ..scene.as_scene_ref() };
    let error = fixture.renderer.record(broken).err().ok_or("it is drawn")?;
    let found = error.to_string();
    let is_complete = ["the deformation of \"broken: ", "line 3", "out.position.y -= unknown"]
        .iter()
        .all(|part| found.contains(part));
    if is_complete { Ok(()) } else { Err(found.into()) }
}
