//! Meshes that are larger than a buffer.

use drawloom::backend::SceneLimits;
use drawloom::glam::{DVec3, Vec3};
use drawloom::handle::Handle;
use drawloom::quality::{Quality, VertexFormat};
use drawloom::scene::{
    Blend, Camera, GeneratedBuffer, IndexBuffer, LevelOfDetail, Light, Material, Mesh, MeshBuffers, RenderObject,
    Scene, StreamAttribute, StreamLayout, Topology, Vertex, VertexStream,
};
use drawloom::view::IssueReason;
use drawloom::wgpu;
use drawloom_testing::adapter;
use drawloom_testing::scenes::{field, sized, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Device, Options, expect_pictures, expect_same, expect_scene_issues, renderer, small};

pub const CASES: &[Case] = &[
    ("a_mesh_beyond_a_buffer_is_left_out", Device::ALL, beyond_a_buffer),
    ("a_mesh_that_is_replaced_is_left_out_while_it_is_too_large", Device::ALL, replaced),
    ("packed_vertices_may_fit_where_full_ones_do_not", &[Device::Noop], packed),
    ("a_mesh_beyond_the_devices_own_limits_is_left_out", &[Device::Noop, Device::Streamed], of_the_device),
    ("a_mesh_that_is_too_large_once_subdivided_is_left_out_where_it_is", &[Device::Adapter], subdivided),
    ("a_mesh_in_buffers_is_left_out_where_they_cannot_be_read", &[Device::Software, Device::Noop], foreign_buffers),
];

/// A room of 4 KiB for each buffer: 128 vertices, or 1,024 indices.
const ROOM: SceneLimits = SceneLimits { buffer_bytes: 4096, binding_bytes: 4096, ..SceneLimits::NONE };

/// Some triangles in a plane, of this number of vertices and indices.
fn sheet(name: &str, topology: Topology, vertices: usize, indices: usize) -> Mesh {
    let vertex = |index: usize| Vertex {
        position: [(index % 7) as f32 * 0.2, (index % 5) as f32 * 0.3, 0.0],
        normal: [0.0, 0.0, 1.0],
        ..Vertex::default()
    };
    let indices = (0..indices).map(|index| (index * 3 % vertices) as u32).collect();
    Mesh::new(name, topology, (0..vertices).map(vertex).collect(), indices).unwrap()
}

/// The field with objects of a mesh, some of them in sight, or none.
fn with_mesh(mesh: Mesh, is_seen: bool) -> Result<(Scene, Handle<Mesh>), Failed> {
    let mut scene = small(field(20));
    let mesh = scene.add(mesh)?;
    let material = scene.as_scene_ref().materials[0];
    for number in 0..3 {
        let position = if is_seen { DVec3::X * f64::from(number) } else { DVec3::splat(1e6) };
        scene.add_object(RenderObject::new(mesh, material, position))?;
    }
    Ok((scene, mesh))
}

/// The scene without its last three objects.
fn without_last(scene: &Scene) -> drawloom::scene::SceneRef<'_> {
    crate::objects::first_objects(scene.as_scene_ref(), scene.object_count() - 3)
}

fn beyond_a_buffer(device: Device) -> Result<(), Failed> {
    let list = |vertices, indices| sheet("statue", Topology::TriangleList, vertices, indices);
    let level = |indices: u32, error| LevelOfDetail::new((0..indices).map(|index| index % 30).collect(), error);
    let meshes = [
        (list(128, 300), true),
        (list(129, 300), false),
        (list(128, 1023), true),
        (list(128, 1026), false),
        (sheet("statue", Topology::TriangleStrip, 60, 1024), true),
        (sheet("statue", Topology::TriangleStrip, 60, 1025), false),
        // The indices of levels follow in the same buffer.
        (list(128, 600).with_levels(vec![level(300, 0.1), level(120, 0.2)])?, true),
        (list(128, 600).with_levels(vec![level(300, 0.1), level(126, 0.2)])?, false),
    ];
    let options = Options { limits: Some(ROOM), ..Options::default() };
    for (index, (mesh, fits)) in meshes.into_iter().enumerate() {
        for is_seen in [true, false] {
            let (scene, _) = with_mesh(mesh.clone(), is_seen)?;
            let expected = if fits { scene.as_scene_ref() } else { without_last(&scene) };
            let mut frames = renderer(device, options)?;
            let scene_issues = expect_same(&mut *frames, device, options, [scene.as_scene_ref(), expected])?;
            let left_out = [(IssueReason::UndrawableMesh, 3, 20, Some("statue"))];
            expect_scene_issues(&scene_issues, &left_out[..usize::from(!fits)])
                .map_err(|failed| format!("mesh {index}, seen: {is_seen}: {failed:?}"))?;
        }
    }
    Ok(())
}

fn replaced(device: Device) -> Result<(), Failed> {
    let options = Options { limits: Some(ROOM), ..Options::default() };
    let sized = |vertices| sheet("statue", Topology::TriangleList, vertices, 300);
    let (mut scene, mesh) = with_mesh(sized(100), true)?;
    let mut frames = renderer(device, options)?;
    for vertices in [100, 200, 200, 90, 300, 128] {
        scene.replace(mesh, sized(vertices))?;
        let fits = vertices <= 128;
        let expected = if fits { scene.as_scene_ref() } else { without_last(&scene) };
        let scene_issues = expect_same(&mut *frames, device, options, [scene.as_scene_ref(), expected])?;
        let is_undrawable = scene_issues.iter().any(|known| known.reason == IssueReason::UndrawableMesh);
        if is_undrawable == fits {
            return Err(format!("{vertices} vertices: {scene_issues:?}").into());
        }
    }
    Ok(())
}

/// A mesh of zeros that no buffer of the device holds, as far as possible without memory.
fn of_the_device(device: Device) -> Result<(), Failed> {
    let max = wgpu::Limits::default().max_buffer_size as usize;
    let generated = |vertices: usize, indices: usize| {
        let buffer = GeneratedBuffer::with_chunk("vertices of a sea", vertices, 1 << 20);
        let indices = GeneratedBuffer::<u32>::with_chunk("indices of a sea", indices, 1 << 20);
        Mesh::generated("statue", Topology::TriangleList, [Vec3::ZERO, Vec3::ONE], &buffer, &indices)
    };
    let mut meshes = vec![generated(max / 32 + 1, 300)?, generated(300, max / 4 / 3 * 3 + 3)?];
    // Those that take memory and time, once.
    if device == Device::Noop {
        meshes.extend([
            Mesh::new("statue", Topology::TriangleList, vec![Vertex::default(); 3], vec![0; max / 4 / 3 * 3 + 3])?,
            Mesh::new("statue", Topology::TriangleList, vec![Vertex::default(); max / 32 + 1], vec![0, 1, 2])?,
        ]);
    }
    let mut frames = renderer(device, Options::default())?;
    for (index, mesh) in meshes.into_iter().enumerate() {
        let (scene, _) = with_mesh(mesh, index % 2 == 0)?;
        let scene_issues = frames.frame(scene.as_scene_ref())?.scene_issues;
        let expected = [(IssueReason::UndrawableMesh, 3, 20, Some("statue"))];
        expect_scene_issues(&scene_issues, &expected).map_err(|failed| format!("mesh {index}: {failed:?}"))?;
    }
    Ok(())
}

fn packed(device: Device) -> Result<(), Failed> {
    let max = wgpu::Limits::default().max_buffer_size as usize;
    let mesh = Mesh::new("statue", Topology::TriangleList, vec![Vertex::default(); max / 32 + 1], vec![0, 1, 2])?;
    let (scene, _) = with_mesh(mesh, false)?;
    for (vertices, count) in [(VertexFormat::Full, 3), (VertexFormat::Packed, 0)] {
        let quality = Some(Quality { vertices, ..Quality::default() });
        let frame = renderer(device, Options { quality, ..Options::default() })?.frame(scene.as_scene_ref())?;
        let reasons = frame.scene_issues.iter().filter(|known| known.reason == IssueReason::UndrawableMesh);
        let found = reasons.map(|known| known.count).sum::<usize>();
        if found != count {
            return Err(format!("{vertices:?}: {found} objects are left out").into());
        }
    }
    Ok(())
}

/// Subdivision makes so much of a floor beside a hemispherical light that its map lacks it; the views of cameras have
/// it.
fn subdivided(_: Device) -> Result<(), Failed> {
    let mut scene = Scene::new();
    let material = scene.add(Material { blend: Blend::None, ..Material::default() })?;
    let floor = scene.add(square(Topology::TriangleList))?;
    scene.add_object(RenderObject { scale: Vec3::splat(4.0), ..RenderObject::new(floor, material, DVec3::ZERO) })?;
    scene.lights = vec![Light::Hemispherical {
        position: DVec3::Z * 3.0,
        direction: Vec3::NEG_Z,
        intensity: Vec3::ONE,
        range: 20.0,
        casts_shadow: true,
    }];
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 8.0, DVec3::ZERO), [64, 64])];
    let options = Options { shadows: true, ..Options::default() };
    let draw = |limits| renderer(Device::Adapter, Options { limits, ..options })?.frame(scene.as_scene_ref());
    let (limited, free) = (draw(Some(ROOM))?, draw(None)?);
    // A floor shades nothing that is in sight.
    expect_pictures(&limited, &free)?;
    let expected = [(IssueReason::UndrawableMesh, 1, 0, Some("square"))];
    expect_scene_issues(&free.scene_issues, &[])?;
    expect_scene_issues(&limited.scene_issues, &expected)
}

fn foreign_buffers(device: Device) -> Result<(), Failed> {
    let (other, _queue) = adapter::noop_device().map_err(|error| error.to_string())?;
    let buffer = other.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 1 << 16,
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::INDEX,
        mapped_at_creation: false,
    });
    let imported = |stride: u64, streams: usize, indices: Option<u32>| {
        let stream = |index: usize| {
            let position = StreamAttribute::position(wgpu::VertexFormat::Float32x3, 0);
            let attributes = if index == 0 { vec![position] } else { Vec::new() };
            VertexStream { buffer: buffer.clone(), offset: 0, layout: StreamLayout { stride, attributes } }
        };
        let buffers = MeshBuffers {
            streams: (0..streams).map(stream).collect(),
            vertex_count: 9,
            indices: indices.map(|count| IndexBuffer {
                buffer: buffer.clone(),
                offset: 60_000,
                format: wgpu::IndexFormat::Uint16,
                count,
            }),
        };
        Mesh::from_buffers("statue", Topology::TriangleList, [Vec3::NEG_ONE, Vec3::ONE], buffers)
    };
    // The software backend reads no buffers, and a device none with such vertices, or with so many of them.
    let meshes = match device {
        Device::Software => [imported(12, 1, Some(9))?, imported(24, 1, None)?],
        _ => [imported(4096, 1, Some(9))?, imported(12, 9, None)?],
    };
    let options = Options { limits: None, ..Options::default() };
    for mesh in meshes {
        for is_seen in [true, false] {
            let (scene, _) = with_mesh(mesh.clone(), is_seen)?;
            let mut frames = renderer(device, options)?;
            let scene_issues =
                expect_same(&mut *frames, device, options, [scene.as_scene_ref(), without_last(&scene)])?;
            expect_scene_issues(&scene_issues, &[(IssueReason::UndrawableMesh, 3, 20, Some("statue"))])?;
        }
    }
    Ok(())
}
