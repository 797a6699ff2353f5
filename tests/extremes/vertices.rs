//! Vertices that are not those of a mesh on the CPU: moved by a deformation, made by nodes, and in the engine's own
//! buffers. Each looks like a mesh that has these vertices.

use std::ops::Range;

use drawloom::bytemuck;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::graph::NodeError;
use drawloom::process::{
    CpuShader, Declare, Deferred, Deformation, DeformationCpuShader, PassInputs, ShaderObject, VertexInput,
};
use drawloom::quality::Quality;
use drawloom::raster::Real;
use drawloom::scene::{
    Bounds, GeneratedBuffer, IndexBuffer, LayerMask, Light, Material, Mesh, MeshBuffers, ObjectColumn, RenderObject,
    Scene, SceneError, SceneRef, StreamAttribute, StreamLayout, Topology, Vertex, VertexStream,
};
use drawloom::task::Worker;
use drawloom::view::{IssueReason, SceneIssue};
use drawloom::wgpu::util::DeviceExt;
use drawloom::wgpu::{self, BufferUsages, IndexFormat, VertexFormat};
use drawloom::{CpuNode, NodeAccesses, NodeContext};
use drawloom_testing::adapter;
use drawloom_testing::scenes::cube;
use libtest_mimic::Failed;

use crate::Case;
use crate::derived::camera_at;
use crate::error_table::{EXTREMES, Extreme, TOUCHING, expect_within};
use crate::harness::{BackendName, Drawn, Harness, Setup};
use crate::special::SPECIAL;

pub const CASES: &[Case] = &[
    ("deformed_objects_look_like_meshes_of_that_shape_anywhere", deformed),
    ("deformations_that_return_no_numbers_draw_no_wrong_pixel", broken_deformations),
    ("generated_meshes_look_like_others_anywhere", generated),
    ("generated_vertices_that_are_no_numbers_are_an_error_or_not_drawn", broken_generated),
    ("meshes_in_the_engines_buffers_look_like_others_anywhere", imported),
    ("vertices_in_the_engines_buffers_that_are_no_numbers_are_not_drawn", broken_imported),
];

/// The extremes, and a camera whose near plane is at a corner of a cube.
fn places() -> impl Iterator<Item = Extreme> {
    EXTREMES.into_iter().chain([Extreme { name: TOUCHING, position: DVec3::ZERO, scale: 1.0 }])
}

/// Three objects with one mesh, which is as large as the extreme says or scaled to that.
fn scene_of(mesh: Mesh, extreme: &Extreme, scale: f64) -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    let mut camera = camera_at(extreme);
    let turn = camera.orientation.as_dquat().normalize();
    let mesh = scene.add(mesh)?;
    for (index, [x, y, z]) in [[-1.6, 0.2, -6.0], [1.1, -0.4, -5.0], [0.3, 1.0, -9.0]].into_iter().enumerate() {
        let color = Vec3::new(0.9, 0.2 + 0.3 * index as f32, 0.4);
        let material = scene.add(Material { diffuse: color, ..Material::default() })?;
        let position = extreme.position + turn * (DVec3::new(x, y, z) * extreme.scale);
        let orientation = Quat::from_rotation_y(0.7 * index as f32);
        let scale = Vec3::splat(scale as f32);
        scene.add_object(RenderObject { orientation, scale, ..RenderObject::new(mesh, material, position) })?;
    }
    if extreme.name == TOUCHING {
        camera.near = 4.2;
    }
    scene.cameras = vec![camera];
    let direction = Vec3::new(0.48, -0.6, -0.64);
    scene.lights = vec![Light::Directional { direction, illuminance: Vec3::splat(2.0), casts_shadow: false }];
    scene.ambient = Vec3::splat(0.2);
    Ok(scene)
}

/// Fails if a byte differs, or if the objects are not to be seen.
fn expect_same(feature: &'static str, column: &str, [found, expected]: [&Drawn; 2]) -> Result<(), Failed> {
    let (Some(one), Some(other)) = (&found.capture, &expected.capture) else { return Ok(()) };
    if other.covered() < 0.05 || found.visible != expected.visible {
        return Err(format!("{feature}, {column}: {} objects cover {}", found.visible, other.covered()).into());
    }
    expect_within((feature, column, "byte"), "three objects", [one.different_bytes(other) as f64, 0.0])
}

/// A cube with vertices that are `half` times as far from the origin.
fn cube_of(half: f64) -> Result<Mesh, SceneError> {
    changed(&cube(), |position| position.map(|number| number * half as f32))
}

fn changed(mesh: &Mesh, change: impl Fn([f32; 3]) -> [f32; 3]) -> Result<Mesh, SceneError> {
    let moved = |vertex: &Vertex| Vertex { position: change(vertex.position), ..*vertex };
    let vertices = mesh.vertices().iter().map(moved).collect();
    Mesh::new(mesh.name(), mesh.topology(), vertices, mesh.indices().to_vec())
}

/// What an object's vertices are multiplied by, before a quarter of it is added.
const FACTOR: ObjectColumn<f32> = ObjectColumn::new("factor");
const DEFORMED: LayerMask = LayerMask::layer(5);

#[derive(Clone, Copy)]
struct Inflate;

impl Deformation for Inflate {
    fn name(&self) -> &str {
        "inflate"
    }

    fn layers(&self) -> LayerMask {
        DEFORMED
    }

    fn declare(&self, declare: &mut Declare) {
        declare.reads_column(FACTOR);
    }

    fn shader(&self) -> &str {
        "
            @group(3) @binding(0) var<storage, read> factors: array<f32>;

            fn deform(in: VertexInput, object: Object) -> VertexInput {
                var out = in;
                out.position = in.position * factors[object.index] + 0.25 * factors[object.index];
                return out;
            }
        "
    }

    fn cpu_shader(&self, process: CpuShader) -> Option<CpuShader> {
        Some(process.deformed(*self))
    }
}

impl<R: Real> DeformationCpuShader<R> for Inflate {
    fn deform(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexInput<R> {
        let factor = R::of(f64::from(pass.column(FACTOR, object.index)));
        let quarter = R::of(0.25) * factor;
        let mut moved = *vertex;
        moved.position.0 = moved.position.0.map(|number| number * factor + quarter);
        moved
    }
}

fn harness_with(harness: &Harness, deferred: Deferred) -> Result<Harness, Failed> {
    let quality = harness.name().affordable(Quality::balanced());
    harness.with(Setup { deferred, ..quality.into() }).map_err(|error| error.to_string().into())
}

fn draw_deformed(harness: &mut Harness, scene: &Scene, factors: &[f32]) -> Result<Drawn, Failed> {
    // Cubes of twice the size are within it.
    let bounds = vec![Bounds { center: Vec3::ZERO, radius: 5.0 }; factors.len()];
    let columns = [FACTOR.values(factors)];
    let layers = vec![DEFORMED; factors.len()];
    let frame = SceneRef { bounds: &bounds, columns: &columns, layers: &layers, ..scene.as_scene_ref() };
    harness.outcome(&frame)?.drawn()
}

fn deformed(harness: &mut Harness) -> Result<(), Failed> {
    let mut plain = harness_with(harness, Deferred::to_picture())?;
    let mut deforming = harness_with(harness, Deferred::to_picture().deformation(Inflate))?;
    for place in places() {
        // Both are exact: 1 · 0.5 + 0.125.
        let shape = changed(&cube(), |position| position.map(|number| number * 0.5 + 0.125))?;
        let scale = place.scale * 1.3;
        let expected = draw_deformed(&mut plain, &scene_of(shape, &place, scale)?, &[9.0; 3])?;
        let found = draw_deformed(&mut deforming, &scene_of(cube(), &place, scale)?, &[0.5; 3])?;
        expect_same("deformation", place.name, [&found, &expected])?;
    }
    Ok(())
}

fn broken_deformations(harness: &mut Harness) -> Result<(), Failed> {
    let mut deforming = harness_with(harness, Deferred::to_picture().deformation(Inflate))?;
    let place = Extreme { name: TOUCHING, position: DVec3::ZERO, scale: 1.0 };
    let scene = scene_of(cube(), &place, 1.0)?;
    // Without size, the others cover nothing.
    let expected = draw_deformed(&mut deforming, &scene, &[0.5, 0.0, 0.0])?;
    for special in SPECIAL {
        let found = draw_deformed(&mut deforming, &scene, &[0.5, special, special])?;
        let (Some(one), Some(other)) = (&found.capture, &expected.capture) else { continue };
        // What is larger than all that is finite may cover anything; whatever else is drawn, the first cube is.
        if special.abs() < 1.0 || special.is_nan() {
            let different = one.different_bytes(other) as f64;
            expect_within(("deformation", TOUCHING, "byte"), &format!("{special:e}"), [different, 0.0])?;
        }
    }
    Ok(())
}

/// Makes the vertices of a mesh.
struct Fill<'a> {
    buffer: &'a GeneratedBuffer<Vertex>,
    vertices: &'a [Vertex],
}

impl CpuNode for Fill<'_> {
    fn name(&self) -> &str {
        "make vertices"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        accesses.fills(self.buffer);
    }

    fn width(&self, _: &NodeContext<'_>) -> usize {
        self.buffer.chunk_count()
    }

    fn run(&self, frame: &NodeContext<'_>, chunks: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        for chunk in chunks {
            let numbers = self.buffer.chunk_range(chunk);
            frame.fill(self.buffer, chunk)?.copy_from_slice(&self.vertices[numbers]);
        }
        Ok(())
    }
}

fn generated(harness: &mut Harness) -> Result<(), Failed> {
    for place in places() {
        for half in [place.scale * 0.5, place.scale * 1e-3, 1.0] {
            let mesh = cube_of(half)?;
            let scale = place.scale * 0.7 / half;
            let buffer = GeneratedBuffer::with_chunk("vertices", mesh.vertices().len(), 5);
            let indices = mesh.indices().to_vec();
            let made = Mesh::generated("cube", Topology::TriangleList, mesh.corners(), &buffer, indices)?;
            let node = Fill { buffer: &buffer, vertices: mesh.vertices() };
            let scene = scene_of(made, &place, scale)?;
            let found = harness.outcome_with(&scene.as_scene_ref(), &[&node])?.drawn()?;
            let expected = harness.draw_whole(&scene_of(mesh.clone(), &place, scale)?)?;
            expect_same("generated mesh", place.name, [&found, &expected])?;
        }
    }
    Ok(())
}

/// A cube with one vertex that is not finite, or too large.
fn broken_vertices(special: f32) -> Vec<Vertex> {
    let mut vertices = cube().vertices().to_vec();
    vertices[3].position[1] = special;
    vertices
}

/// The numbers that no vertex has, and some that f32 cannot multiply.
const NO_COORDINATES: [f32; 5] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN];

fn broken_generated(harness: &mut Harness) -> Result<(), Failed> {
    let place = Extreme { name: TOUCHING, position: DVec3::ZERO, scale: 1.0 };
    let mesh = cube();
    for special in NO_COORDINATES {
        let buffer = GeneratedBuffer::with_chunk("vertices", mesh.vertices().len(), 5);
        let indices = mesh.indices().to_vec();
        let made = Mesh::generated("broken", Topology::TriangleList, mesh.corners(), &buffer, indices)?;
        let scene = scene_of(made, &place, 0.7)?;
        let mut frame =
            |vertices: &[Vertex]| harness.outcome_with(&scene.as_scene_ref(), &[&Fill { buffer: &buffer, vertices }]);
        // The harness fails if a pixel is not a number.
        frame(&broken_vertices(special))?.drawn().map_err(|failed| format!("{special}: {failed:?}"))?;
        let found = frame(mesh.vertices())?.drawn()?;
        let expected = harness.draw_whole(&scene_of(mesh.clone(), &place, 0.7)?)?;
        expect_same("generated mesh", TOUCHING, [&found, &expected])?;
    }
    Ok(())
}

/// A mesh in buffers of the harness's device.
fn in_buffers(mesh: &Mesh, vertices: &[Vertex]) -> Result<Mesh, Failed> {
    let (device, _) = adapter::shared_device()?;
    let buffer = |contents: &[u8], usage| {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
    };
    let attributes = vec![
        StreamAttribute::position(VertexFormat::Float32x3, 0),
        StreamAttribute::normal(VertexFormat::Float32x3, 12),
        StreamAttribute::uv(VertexFormat::Float32x2, 24),
    ];
    let bytes: Vec<u8> = vertices
        .iter()
        .flat_map(|vertex| {
            [&vertex.position[..], &vertex.normal[..], &vertex.uv[..]].concat().into_iter().flat_map(f32::to_ne_bytes)
        })
        .collect();
    let vertex_buffer = buffer(&bytes, BufferUsages::VERTEX);
    let index_buffer = buffer(bytemuck::cast_slice(mesh.indices()), BufferUsages::INDEX);
    let streams =
        vec![VertexStream { buffer: vertex_buffer, offset: 0, layout: StreamLayout { stride: 32, attributes } }];
    let indices = Some(IndexBuffer {
        buffer: index_buffer,
        offset: 0,
        format: IndexFormat::Uint32,
        count: mesh.indices().len() as u32,
    });
    let buffers = MeshBuffers { streams, vertex_count: vertices.len() as u32, indices };
    Ok(Mesh::from_buffers("cube", mesh.topology(), mesh.corners(), buffers)?)
}

/// Whether the backend draws what is in wgpu buffers. The others need no adapter.
fn has_buffers(harness: &mut Harness) -> Result<bool, Failed> {
    if matches!(harness.name(), BackendName::Software | BackendName::Reference) && adapter::shared_device().is_ok() {
        let place = Extreme { name: TOUCHING, position: DVec3::ZERO, scale: 1.0 };
        let scene = scene_of(in_buffers(&cube(), cube().vertices())?, &place, 0.7)?;
        let left_out = harness.draw(&scene)?.scene_issues;
        let is_named =
            |issue: &SceneIssue| issue.reason == IssueReason::UndrawableMesh && issue.name.as_deref() == Some("cube");
        if !left_out.iter().any(is_named) {
            return Err(format!("buffers of a device in software: {left_out:?}").into());
        }
    }
    Ok(harness.name() == BackendName::Wgpu)
}

fn imported(harness: &mut Harness) -> Result<(), Failed> {
    if !has_buffers(harness)? {
        return Ok(());
    }
    for place in places() {
        for half in [place.scale * 0.5, place.scale * 1e-3, 1.0] {
            let mesh = cube_of(half)?;
            let scale = place.scale * 0.7 / half;
            let found = harness.draw_whole(&scene_of(in_buffers(&mesh, mesh.vertices())?, &place, scale)?)?;
            let expected = harness.draw_whole(&scene_of(mesh, &place, scale)?)?;
            expect_same("mesh in buffers", place.name, [&found, &expected])?;
        }
    }
    Ok(())
}

fn broken_imported(harness: &mut Harness) -> Result<(), Failed> {
    if !has_buffers(harness)? {
        return Ok(());
    }
    let place = Extreme { name: TOUCHING, position: DVec3::ZERO, scale: 1.0 };
    for special in NO_COORDINATES {
        // The harness fails if a pixel is not a number.
        harness.draw_whole(&scene_of(in_buffers(&cube(), &broken_vertices(special))?, &place, 0.7)?)?;
        let found = harness.draw_whole(&scene_of(in_buffers(&cube(), cube().vertices())?, &place, 0.7)?)?;
        let expected = harness.draw_whole(&scene_of(cube(), &place, 0.7)?)?;
        expect_same("mesh in buffers", TOUCHING, [&found, &expected])?;
    }
    let corners = [Vec3::NAN, Vec3::INFINITY, Vec3::splat(f32::MAX)];
    for corner in corners {
        let mesh = in_buffers(&cube(), cube().vertices())?;
        let buffers = MeshBuffers::clone(mesh.buffers().ok_or("it has no buffers")?);
        match Mesh::from_buffers("cube", Topology::TriangleList, [-corner, corner], buffers) {
            Err(error) if error.to_string().contains("mesh `cube`") => {}
            Err(error) => return Err(format!("{corner}: {error}").into()),
            Ok(_) => return Err(format!("{corner}: it was accepted").into()),
        }
    }
    Ok(())
}
