//! Meshes in the engine's own buffers.

use std::sync::Arc;

use drawloom::backend::{Picture, SoftwareBackend, WgpuBackend};
use drawloom::glam::Vec3;
use drawloom::process::{ClearColor, CommandDraws, Declare, Deferred, Draws, RenderProcess};
use drawloom::quality::{Quality, VertexFormat};
use drawloom::scene::{
    IndexBuffer, Material, Mesh, MeshBuffers, RenderObject, Scene, SceneError, StreamAttribute, StreamLayout, Topology,
    VERTEX_INDEX, Vertex, VertexAttribute, VertexStream,
};
use drawloom::task::Scheduler;
use drawloom::view::{IssueReason, SceneIssue};
use drawloom::wgpu::util::DeviceExt;
use drawloom::wgpu::{BufferUsages, IndexFormat, VertexFormat as Format};
use drawloom::{Renderer, wgpu};
use drawloom_testing::adapter;
use drawloom_testing::scenes::{field, with_meshes};
use libtest_mimic::Failed;

use crate::Case;
use crate::attributes::{COLOR, Colored, SHADE, STRENGTH, with_colors};
use crate::fixture::{Fixture, backend, device};
use crate::strategies::{expect, strategies};

pub const CASES: &[Case] = &[
    ("a_mesh_in_the_engines_buffers_looks_like_one_in_the_pages", same_picture),
    ("every_strategy_draws_meshes_in_the_engines_buffers", every_strategy),
    ("meshes_in_the_engines_buffers_come_and_go", replacing_meshes),
    ("without_normals_a_mesh_in_the_engines_buffers_is_flat", without_normals),
    ("another_layout_costs_a_pipeline_of_each_process", pipelines),
    ("buffers_that_no_mesh_can_have_are_named", invalid),
    ("objects_with_an_attribute_of_another_kind_are_left_out_and_named", another_kind),
    ("objects_without_the_index_of_vertices_are_left_out_and_named", without_index),
    ("meshes_in_buffers_of_another_device_are_left_out_and_named", another_device),
    ("a_frame_in_flight_whose_mesh_is_destroyed_is_an_error", destroyed),
    ("a_mesh_that_exceeds_the_devices_limits_is_left_out_and_named", too_large),
    ("a_mesh_of_positions_needs_two_vertex_buffers", few_vertex_buffers),
    ("the_software_backend_leaves_meshes_in_buffers_out_and_names_them", on_software),
];

/// How a mesh lies in an engine's buffers.
#[derive(Clone, Copy, Debug)]
enum BufferLayout {
    /// One buffer has everything: interleaved vertices with gaps behind some other bytes, then 16-bit indices.
    Interleaved,
    /// A stream for positions, one for the rest, and 32-bit indices.
    SeparateStreams,
    /// A vertex for each corner of each triangle.
    WithoutIndices,
    /// Interleaved, without the custom attributes: shaders read their defaults.
    WithoutColors,
}

const BUFFER_LAYOUTS: [BufferLayout; 4] = [
    BufferLayout::Interleaved,
    BufferLayout::SeparateStreams,
    BufferLayout::WithoutIndices,
    BufferLayout::WithoutColors,
];

/// The colour's bytes, and `Uint16x2`, of which the shader reads the first number.
const COLOR_AND_STRENGTH: [[u8; 4]; 2] = [[255, 128, 64, 255], [80, 0, 7, 0]];

fn imported(device: &wgpu::Device, mesh: &Mesh, layout: BufferLayout) -> Result<Mesh, SceneError> {
    let buffer = |bytes: &[u8], usage| {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents: bytes, usage })
    };
    let (vertices, indices) = (mesh.vertices(), mesh.indices());
    let (topology, geometry) = match layout {
        BufferLayout::Interleaved | BufferLayout::WithoutColors => {
            let mut bytes = vec![9; 64];
            for vertex in vertices {
                bytes.extend_from_slice(bytemuck::bytes_of(&vertex.uv));
                bytes.extend([7; 4]);
                bytes.extend_from_slice(bytemuck::bytes_of(&vertex.position));
                bytes.extend(COLOR_AND_STRENGTH.as_flattened());
                bytes.extend_from_slice(bytemuck::bytes_of(&vertex.normal));
                bytes.extend([7; 8]);
            }
            let start = bytes.len() as u64;
            indices.iter().for_each(|index| bytes.extend((*index as u16).to_ne_bytes()));
            bytes.resize(bytes.len().next_multiple_of(4), 0);
            let buffer = buffer(&bytes, BufferUsages::VERTEX | BufferUsages::INDEX);
            let attributes = vec![
                StreamAttribute::uv(Format::Float32x2, 0),
                StreamAttribute::position(Format::Float32x3, 12),
                StreamAttribute::of(COLOR, Format::Unorm8x4, 24),
                StreamAttribute::of(STRENGTH, Format::Uint16x2, 28),
                StreamAttribute::normal(Format::Float32x3, 32),
            ];
            let is_own = |attribute: &StreamAttribute| ["colour", "strength"].contains(&attribute.name());
            let has_colors = matches!(layout, BufferLayout::Interleaved);
            let attributes = attributes.into_iter().filter(|attribute| has_colors || !is_own(attribute)).collect();
            let layout = StreamLayout { stride: 52, attributes };
            let count = indices.len() as u32;
            let indices = IndexBuffer { buffer: buffer.clone(), offset: start, format: IndexFormat::Uint16, count };
            let streams = vec![VertexStream { buffer, offset: 64, layout }];
            let vertex_count = vertices.len() as u32;
            (mesh.topology(), MeshBuffers { streams, vertex_count, indices: Some(indices) })
        }
        BufferLayout::SeparateStreams => {
            let count = indices.len() as u32;
            let indices = buffer(bytemuck::cast_slice(indices), BufferUsages::INDEX);
            let indices = IndexBuffer { buffer: indices, offset: 0, format: IndexFormat::Uint32, count };
            let streams = separate_streams(vertices, buffer);
            let vertex_count = vertices.len() as u32;
            (mesh.topology(), MeshBuffers { streams, vertex_count, indices: Some(indices) })
        }
        BufferLayout::WithoutIndices => {
            let corners: Vec<_> = mesh.triangles().flatten().map(|corner| vertices[corner as usize]).collect();
            let streams = separate_streams(&corners, buffer);
            (Topology::TriangleList, MeshBuffers { streams, vertex_count: corners.len() as u32, indices: None })
        }
    };
    Mesh::from_buffers(mesh.name(), topology, mesh.corners(), geometry)
}

fn separate_streams(vertices: &[Vertex], buffer: impl Fn(&[u8], BufferUsages) -> wgpu::Buffer) -> Vec<VertexStream> {
    let positions: Vec<_> = vertices.iter().map(|vertex| vertex.position).collect();
    let rest: Vec<_> = vertices.iter().map(|vertex| (vertex.uv, vertex.normal)).collect();
    let rest: Vec<u8> =
        rest.iter().flat_map(|(uv, normal)| [bytemuck::bytes_of(uv), bytemuck::bytes_of(normal)].concat()).collect();
    // The default of an unused attribute is not read.
    const UNUSED: VertexAttribute<f32> = VertexAttribute::new("unused");
    let rest_attributes = vec![
        StreamAttribute::normal(Format::Float32x3, 8),
        StreamAttribute::uv(Format::Float32x2, 0),
        StreamAttribute::of(UNUSED, Format::Float32, 0),
    ];
    let positions_layout =
        StreamLayout { stride: 12, attributes: vec![StreamAttribute::position(Format::Float32x3, 0)] };
    let unused_layout = StreamLayout { stride: 4, attributes: vec![] };
    let stream = |bytes: &[u8], layout| VertexStream { buffer: buffer(bytes, BufferUsages::VERTEX), offset: 0, layout };
    vec![
        stream(&rest, StreamLayout { stride: 20, attributes: rest_attributes }),
        stream(&[0; 4], unused_layout),
        stream(bytemuck::cast_slice(&positions), positions_layout),
    ]
}

/// The meshes of a scene in the pages, with the colours that those of [`imported`] have, and others.
fn colored(scene: Scene) -> Scene {
    with_meshes(scene, |mesh| {
        let (count, plain) = (mesh.vertices().len(), mesh.clone());
        let [red, green, blue] = [1.0, 128.0 / 255.0, 64.0 / 255.0];
        let plain = plain.with_attribute(COLOR, &vec![[red, green, blue]; count]).unwrap();
        plain.with_attribute(STRENGTH, &vec![80; count]).unwrap()
    })
}

fn quality() -> Quality {
    Quality { vertices: VertexFormat::Full, ..Quality::balanced() }
}

fn pictures(fixture: &mut Fixture, scene: &Scene) -> Result<Vec<Picture>, Failed> {
    let recorded = fixture.record(scene)?;
    let submission = fixture.submit(recorded)?;
    let targets = (0..scene.cameras.len()).flat_map(|view| ["picture", "coloured"].map(|target| (view, target)));
    targets.map(|(view, target)| Ok(submission.read(view, target)?)).collect()
}

fn fixture() -> Result<Fixture, Failed> {
    fixture_of(backend()?)
}

fn fixture_of(backend: WgpuBackend) -> Result<Fixture, Failed> {
    let builder = Renderer::builder(backend).pipeline(Deferred::to_picture()).process(Colored).output("coloured");
    let (renderer, submitter) = builder.quality(quality()).build(Arc::new(Scheduler::new(2)?))?;
    Ok(Fixture { renderer, submitter })
}

/// The scene with meshes in the engine's buffers, from the `first` one on.
fn moved_to_device(scene: Scene, layout: BufferLayout, first: usize) -> Result<Scene, Failed> {
    let (device, _) = device()?;
    let number = std::cell::Cell::new(0);
    Ok(with_meshes(scene, |mesh| {
        number.set(number.get() + 1);
        if number.get() <= first { mesh.clone() } else { imported(&device, mesh, layout).unwrap() }
    }))
}

fn same_picture() -> Result<(), Failed> {
    for layout in BUFFER_LAYOUTS {
        let mut in_pages = field(300);
        if let BufferLayout::Interleaved = layout {
            in_pages = colored(in_pages);
        }
        let expected = pictures(&mut fixture()?, &in_pages)?;
        for first in [0, 1, 2] {
            let scene = moved_to_device(with_meshes(field(300), Mesh::clone), layout, first)?;
            // Meshes that are not moved keep the colours of the others.
            let scene = if first > 0 && matches!(layout, BufferLayout::Interleaved) {
                with_meshes(scene, |mesh| match mesh.buffers() {
                    Some(_) => mesh.clone(),
                    None => {
                        let count = mesh.vertices().len();
                        let color = vec![[1.0, 128.0 / 255.0, 64.0 / 255.0]; count];
                        let mesh = mesh.clone().with_attribute(COLOR, &color).unwrap();
                        mesh.with_attribute(STRENGTH, &vec![80; count]).unwrap()
                    }
                })
            } else {
                scene
            };
            if pictures(&mut fixture()?, &scene)? != expected {
                return Err(format!("{layout:?} from mesh {first} on differs").into());
            }
        }
    }
    Ok(())
}

/// Every mesh three times, so that there are several layouts of each state. The first of the three is in the pages.
fn with_copies(layouts: Option<[BufferLayout; 2]>) -> Result<Scene, Failed> {
    let (device, _) = device()?;
    let mut scene = field(90);
    let meshes: Vec<_> = scene.assets().iter::<Mesh>().map(|(handle, mesh)| (handle, mesh.clone())).collect();
    let mut copies = Vec::new();
    for (handle, mesh) in &meshes {
        let mut of_mesh = vec![*handle];
        for copy in 0..2 {
            let copied = match layouts {
                None => mesh.clone(),
                Some(layouts) => imported(&device, mesh, layouts[copy])?,
            };
            of_mesh.push(scene.add(copied)?);
        }
        copies.push((*handle, of_mesh));
    }
    for (index, object) in scene.objects().collect::<Vec<_>>().into_iter().enumerate() {
        let before = scene.object(object)?;
        let (_, of_mesh) = copies.iter().find(|(handle, _)| *handle == before.mesh).ok_or("it is one of them")?;
        scene.replace_object(object, RenderObject { mesh: of_mesh[index / 5 % 3], ..before })?;
    }
    Ok(scene)
}

fn every_strategy() -> Result<(), Failed> {
    let expected = pictures(&mut fixture()?, &with_copies(None)?)?;
    let scene = with_copies(Some([BufferLayout::SeparateStreams, BufferLayout::WithoutColors]))?;
    for (recording, encoding) in strategies() {
        let backend = backend()?.recording_strategy(recording).encoding_strategy(encoding);
        let mut fixture = fixture_of(backend)?;
        for frame in 0..2 {
            if pictures(&mut fixture, &scene)? != expected {
                return Err(format!("frame {frame} of {recording:?} and {encoding:?} differs").into());
            }
        }
    }
    Ok(())
}

fn replacing_meshes() -> Result<(), Failed> {
    let (device, _) = device()?;
    let mut scene = field(60);
    let handles: Vec<_> = scene.assets().iter::<Mesh>().map(|(handle, mesh)| (handle, mesh.clone())).collect();
    let mut kept = fixture()?;
    for step in 0..12 {
        let (handle, mesh) = &handles[step % handles.len()];
        let is_moved = step / handles.len() % 2 == 0;
        let mesh = match is_moved {
            true => imported(&device, mesh, BUFFER_LAYOUTS[step % 2 + step / 6])?,
            false => with_colors(mesh.clone(), 0.1 * step as f32)?,
        };
        scene.replace(*handle, mesh)?;
        if pictures(&mut kept, &scene)? != pictures(&mut fixture()?, &scene)? {
            return Err(format!("step {step} differs from a new renderer").into());
        }
    }
    Ok(())
}

fn without_normals() -> Result<(), Failed> {
    let (device, _) = device()?;
    let flat = |mesh: &Mesh| {
        let vertices = mesh.vertices().iter().map(|vertex| Vertex { normal: [0.0; 3], uv: [0.0; 2], ..*vertex });
        Mesh::new(mesh.name(), mesh.topology(), vertices.collect(), mesh.indices().to_vec()).unwrap()
    };
    let expected = pictures(&mut fixture()?, &with_meshes(field(100), flat))?;
    let only_positions = |mesh: &Mesh| {
        let moved = imported(&device, mesh, BufferLayout::SeparateStreams).unwrap();
        let geometry = MeshBuffers::clone(moved.buffers().unwrap());
        let streams = geometry.streams[2..].to_vec();
        Mesh::from_buffers(mesh.name(), mesh.topology(), mesh.corners(), MeshBuffers { streams, ..geometry }).unwrap()
    };
    if pictures(&mut fixture()?, &with_meshes(field(100), only_positions))? == expected {
        Ok(())
    } else {
        Err("it differs".into())
    }
}

fn pipelines() -> Result<(), Failed> {
    let count = |scene: &Scene| -> Result<usize, Failed> {
        let mut fixture = Fixture::with(2, |builder| builder.process(Colored).output("coloured"))?;
        let recorded = fixture.record(scene)?;
        fixture.submit(recorded)?;
        Ok(fixture.renderer.backend().resources().pipelines)
    };
    let (device, _) = device()?;
    // Only lists of one material, so that there is one state.
    let scene = |layouts: &[BufferLayout]| -> Result<Scene, Failed> {
        let mut scene = field(0);
        let material = scene.add(Material::default())?;
        let cube = drawloom_testing::scenes::cube();
        for mesh in std::iter::once(Ok(cube.clone())).chain(layouts.iter().map(|one| imported(&device, &cube, *one))) {
            let mesh = scene.add(mesh?)?;
            scene.add_object(RenderObject::new(mesh, material, drawloom::glam::DVec3::ZERO))?;
        }
        Ok(scene)
    };
    let counts = [
        count(&scene(&[])?)?,
        count(&scene(&[BufferLayout::SeparateStreams])?)?,
        count(&scene(&[BufferLayout::SeparateStreams, BufferLayout::SeparateStreams, BufferLayout::WithoutIndices])?)?,
        count(&scene(&[BufferLayout::SeparateStreams, BufferLayout::Interleaved])?)?,
    ];
    if counts == [1, 2, 2, 3] { Ok(()) } else { Err(format!("{counts:?} pipelines").into()) }
}

fn invalid() -> Result<(), Failed> {
    let (device, _) = device()?;
    let valid = imported(&device, &drawloom_testing::scenes::cube(), BufferLayout::Interleaved)?;
    let corners = [Vec3::splat(-1.0), Vec3::splat(1.0)];
    let usage = |usage| {
        device.create_buffer(&wgpu::BufferDescriptor { label: None, size: 4096, usage, mapped_at_creation: false })
    };
    type Break = fn(&mut MeshBuffers);
    let broken: [(&str, Break); 15] = [
        ("no positions", |geometry| _ = geometry.streams[0].layout.attributes.remove(1)),
        ("\"normal\" is there twice", |geometry| {
            geometry.streams[0].layout.attributes.push(StreamAttribute::normal(Format::Float32x3, 0));
        }),
        ("\"position\" has Uint32x3", |geometry| {
            geometry.streams[0].layout.attributes[1] = StreamAttribute::position(Format::Uint32x3, 12);
        }),
        ("\"position\" has Float32x2, but needs 3", |buffers| {
            buffers.streams[0].layout.attributes[1] = StreamAttribute::position(Format::Float32x2, 12);
        }),
        ("\"normal\" has Snorm16x2, but needs 3", |buffers| {
            buffers.streams[0].layout.attributes[4] = StreamAttribute::normal(Format::Snorm16x2, 32);
        }),
        ("\"uv\" has Float32, but needs 2", |buffers| {
            buffers.streams[0].layout.attributes[0] = StreamAttribute::uv(Format::Float32, 0);
        }),
        ("stride of 50 bytes", |geometry| geometry.streams[0].layout.stride = 50),
        ("stride of 0 bytes", |geometry| geometry.streams[0].layout.stride = 0),
        ("begins at byte 66", |geometry| geometry.streams[0].offset = 66),
        ("up to byte 44 of vertices that have 40", |geometry| geometry.streams[0].layout.stride = 40),
        ("\"uv\" at byte 2 of a vertex, which is not a multiple of 4", |geometry| {
            geometry.streams[0].layout.attributes[0] = StreamAttribute::uv(Format::Float32x2, 2);
        }),
        ("for 1000 vertices", |buffers| buffers.vertex_count = 1000),
        ("index buffer ends at byte", |geometry| geometry.indices.as_mut().unwrap().count = 999),
        ("index buffer begins at byte 3", |geometry| geometry.indices.as_mut().unwrap().offset = 3),
        ("18446744073709551615", |geometry| geometry.streams[0].offset = u64::MAX - 3),
    ];
    let geometry = || MeshBuffers::clone(valid.buffers().unwrap());
    let error_of = |geometry, corners| {
        let mesh = Mesh::from_buffers("rock", Topology::TriangleList, corners, geometry);
        mesh.err().map(|error| error.to_string()).unwrap_or_default()
    };
    let mut found: Vec<(String, &str)> = broken
        .into_iter()
        .map(|(part, break_it)| {
            let mut geometry = geometry();
            break_it(&mut geometry);
            (error_of(geometry, corners), part)
        })
        .collect();
    let mut without_vertex_usage = geometry();
    without_vertex_usage.streams[0].buffer = usage(BufferUsages::INDEX);
    let mut without_index_usage = geometry();
    without_index_usage.indices.as_mut().unwrap().buffer = usage(BufferUsages::VERTEX);
    let mut partial = geometry();
    partial.indices.as_mut().unwrap().count = 4;
    let restart = |vertex_count| {
        let mut long = geometry();
        long.streams[0].buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: 52 * 70_000,
            usage: BufferUsages::VERTEX,
            mapped_at_creation: false,
        });
        long.vertex_count = vertex_count;
        Mesh::from_buffers("rock", Topology::TriangleStrip, corners, long)
    };
    restart(65_535)?;
    let mut empty = geometry();
    (empty.indices, empty.vertex_count) = (None, 0);
    let begins_strip = restart(65_536).err().map(|error| error.to_string()).unwrap_or_default();
    found.push((begins_strip, "index 65535 begins another strip"));
    found.push((error_of(without_vertex_usage, corners), "without the usage VERTEX"));
    found.push((error_of(without_index_usage, corners), "without the usage INDEX"));
    found.push((error_of(partial, corners), "not a multiple of 3"));
    found.push((error_of(empty, corners), "no triangle"));
    found.push((error_of(geometry(), [Vec3::ONE, Vec3::ZERO]), "is inverted or not finite"));
    found.push((error_of(geometry(), [Vec3::NAN, Vec3::ZERO]), "is inverted or not finite"));
    found.push((error_of(geometry(), [Vec3::splat(-3e38), Vec3::splat(3e38)]), "too large"));
    for (error, part) in found {
        if !error.contains("`rock`") || !error.contains(part) {
            return Err(format!("{error:?} lacks {part:?}").into());
        }
    }
    let late = valid.with_attribute(SHADE, &[[0; 4]; 24]).err().map(|error| error.to_string()).unwrap_or_default();
    if late.contains("must be in one of the mesh's vertex streams") { Ok(()) } else { Err(late.into()) }
}

fn another_kind() -> Result<(), Failed> {
    let (device, _) = device()?;
    let moved = imported(&device, &drawloom_testing::scenes::cube(), BufferLayout::Interleaved)?;
    let with_color = |format| {
        let mut geometry = MeshBuffers::clone(moved.buffers().unwrap());
        geometry.streams[0].layout.attributes[2] = StreamAttribute::of(COLOR, format, 24);
        Mesh::from_buffers("rock", Topology::TriangleList, moved.corners(), geometry).unwrap()
    };
    let mut fixture = fixture()?;
    let expected = pictures(&mut fixture, &with_meshes(field(30), |_| with_color(Format::Unorm8x4)))?;
    // The process that reads it leaves such objects out, and all others draw them.
    let nothing = pictures(&mut fixture, &field(0))?;
    let refused = with_meshes(field(30), |_| with_color(Format::Uint8x4));
    for _ in 0..2 {
        let recorded = fixture.record(&refused)?;
        let scene_issues = &recorded.statistics().scene_issues;
        let is_it =
            |known: &SceneIssue| (known.reason, known.name.as_deref()) == (IssueReason::UndrawableMesh, Some("rock"));
        expect(scene_issues.len() == 1 && is_it(&scene_issues[0]), || format!("{scene_issues:?}"))?;
        let found = pictures(&mut fixture, &refused)?;
        for (index, picture) in found.iter().enumerate() {
            let of_both = if index % 2 == 0 { &expected } else { &nothing };
            expect(*picture == of_both[index], || format!("picture {index} differs"))?;
        }
    }
    let next = pictures(&mut fixture, &with_meshes(field(30), |_| with_color(Format::Unorm8x4)))?;
    if next == expected { Ok(()) } else { Err("the next frame differs".into()) }
}

/// Draws vertices in the colour of their index into the target "coloured".
struct ReadsIndex;

impl RenderProcess for ReadsIndex {
    fn name(&self) -> &str {
        "index"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("coloured", drawloom::process::Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.clears_depth("depth of coloured", drawloom::process::Format::Depth32Float);
        declare.reads_attribute(VERTEX_INDEX, 0);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            struct Corner {
                @builtin(position) position: vec4<f32>,
                @location(0) index: f32,
            }

            @vertex
            fn vertex(in: VertexInput) -> Corner {
                let object = drawn_object(in.instance);
                return Corner(clip_position(relative_position(object, in.position)), f32(in.vertex_index));
            }

            @fragment
            fn fragment(in: Corner) -> @location(0) vec4<f32> {
                return vec4<f32>(in.index / 25.0);
            }
        ";
        Draws::Commands(CommandDraws { shader, ..CommandDraws::default() })
    }
}

fn without_index() -> Result<(), Failed> {
    let builder = Renderer::builder(backend()?).pipeline(Deferred::to_picture()).process(ReadsIndex).output("coloured");
    let (renderer, submitter) = builder.quality(quality()).build(Arc::new(Scheduler::new(2)?))?;
    let mut fixture = Fixture { renderer, submitter };
    let (device, _) = device()?;
    let [of_pages, nothing] = [field(30), field(0)].map(|scene| pictures(&mut fixture, &scene));
    let moved = with_meshes(field(30), |mesh| imported(&device, mesh, BufferLayout::SeparateStreams).unwrap());
    for _ in 0..2 {
        let issues = fixture.record(&moved)?.statistics().scene_issues.clone();
        let is_it = |known: &SceneIssue| known.reason == IssueReason::UndrawableMesh;
        expect(issues.len() == 1 && is_it(&issues[0]), || format!("{issues:?}"))?;
        let found = pictures(&mut fixture, &moved)?;
        let (of_pages, nothing) = (of_pages.as_ref().unwrap(), nothing.as_ref().unwrap());
        expect(found[0] == of_pages[0] && found[1] == nothing[1], || "it is drawn".into())?;
    }
    let with_index = |mesh: &Mesh| {
        let moved = imported(&device, mesh, BufferLayout::SeparateStreams).unwrap();
        let mut geometry = MeshBuffers::clone(moved.buffers().unwrap());
        let indices: Vec<_> = (0..geometry.vertex_count).collect();
        let (contents, usage) = (bytemuck::cast_slice(&indices), BufferUsages::VERTEX);
        let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage });
        let attributes = vec![StreamAttribute::of(VERTEX_INDEX, Format::Uint32, 0)];
        let layout = StreamLayout { stride: 4, attributes };
        geometry.streams.push(VertexStream { buffer, offset: 0, layout });
        Mesh::from_buffers("rock", moved.topology(), moved.corners(), geometry).unwrap()
    };
    let found = pictures(&mut fixture, &with_meshes(field(30), with_index))?;
    expect(found == *of_pages.as_ref().unwrap(), || "it is not drawn".into())
}

fn another_device() -> Result<(), Failed> {
    let [(device, queue), (other, _)] = adapter::two_devices()?;
    let mut fixture = fixture_of(WgpuBackend::new(device.clone(), queue)?)?;
    let moved_to = |device: &wgpu::Device| {
        with_meshes(field(30), |mesh| imported(device, mesh, BufferLayout::SeparateStreams).unwrap())
    };
    let expected = pictures(&mut fixture, &moved_to(&device))?;
    expect_left_out(&mut fixture, &moved_to(&other), "cube")?;
    if pictures(&mut fixture, &moved_to(&device))? == expected { Ok(()) } else { Err("the next frame differs".into()) }
}

fn too_large() -> Result<(), Failed> {
    let (device, _) = device()?;
    let moved = imported(&device, &drawloom_testing::scenes::cube(), BufferLayout::SeparateStreams)?;
    let limits = device.limits();
    let mut wide = MeshBuffers::clone(moved.buffers().unwrap());
    let stride = u64::from(limits.max_vertex_buffer_array_stride) + 4;
    wide.streams[0].layout.stride = stride;
    (wide.vertex_count, wide.indices) = (3, None);
    let size = stride * 3;
    let usage = BufferUsages::VERTEX;
    let buffer = device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false });
    wide.streams.iter_mut().for_each(|stream| stream.buffer = buffer.clone());
    let mut many = MeshBuffers::clone(moved.buffers().unwrap());
    many.streams.extend(vec![many.streams[1].clone(); limits.max_vertex_buffers as usize]);
    let mut fixture = fixture()?;
    let expected = pictures(&mut fixture, &field(30))?;
    for buffers in [wide, many] {
        let mesh = Mesh::from_buffers("rock", Topology::TriangleList, moved.corners(), buffers)?;
        expect_left_out(&mut fixture, &with_meshes(field(30), |_| mesh.clone()), "rock")?;
        expect(pictures(&mut fixture, &field(30))? == expected, || "the next frame differs".into())?;
    }
    Ok(())
}

/// Draws a scene of which no mesh can be drawn.
///
/// # Errors
/// If its 30 objects are not counted, with the name of the first mesh.
fn expect_left_out(fixture: &mut Fixture, scene: &Scene, name: &str) -> Result<(), Failed> {
    let recorded = fixture.renderer.record(scene.as_scene_ref())?;
    let scene_issues = recorded.statistics().scene_issues.clone();
    let expected = [(IssueReason::UndrawableMesh, 30, 0, Some(name))];
    let found = scene_issues.iter().map(|known| (known.reason, known.count, known.first, known.name.as_deref()));
    expect(found.eq(expected), || format!("{scene_issues:?}"))?;
    fixture.submit(recorded).map(drop)
}

/// Reads seven attributes, which meshes in the pages have in eight vertex buffers, and draws one of them as a colour.
struct Seven;

const SEVEN: [VertexAttribute<[f32; 3]>; 7] = [
    VertexAttribute::new("first"),
    VertexAttribute::new("second"),
    VertexAttribute::new("third"),
    VertexAttribute::new("fourth"),
    VertexAttribute::new("fifth"),
    VertexAttribute::new("sixth"),
    VertexAttribute::new("seventh"),
];

impl RenderProcess for Seven {
    fn name(&self) -> &str {
        "seven"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("coloured", drawloom::process::Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.clears_depth("own depth", drawloom::process::Format::Depth32Float);
        for (index, attribute) in (0..).zip(SEVEN) {
            declare.reads_attribute(attribute, [0.125 * index as f32, 0.5, 1.0]);
        }
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            struct Corner {
                @builtin(position) clip: vec4<f32>,
                @location(0) color: vec3<f32>,
            }

            @vertex
            fn vertex(in: VertexInput) -> Corner {
                let color = vec3<f32>(in.first.x, in.fifth.x, in.seventh.x) + vec3<f32>(in.uv, in.normal.z) * 0.1;
                return Corner(clip_position(relative_position(drawn_object(in.instance), in.position)), color);
            }

            @fragment
            fn fragment(in: Corner) -> @location(0) vec4<f32> {
                return vec4<f32>(in.color, 1.0);
            }
        ";
        Draws::Commands(CommandDraws { shader, ..CommandDraws::default() })
    }
}

fn few_vertex_buffers() -> Result<(), Failed> {
    let (device, queue) = adapter::device_with_limits(wgpu::Limits::default())?;
    let builder = Renderer::builder(WgpuBackend::new(device.clone(), queue)?).process(Seven).output("coloured");
    let (renderer, submitter) = builder.quality(quality()).build(Arc::new(Scheduler::new(2)?))?;
    let mut fixture = Fixture { renderer, submitter };
    // As meshes in the pages with normals and texture coordinates of 0.
    let bare = |mesh: &Mesh| {
        let vertices = mesh.vertices().iter().map(|vertex| Vertex { normal: [0.0; 3], uv: [0.0; 2], ..*vertex });
        Mesh::new(mesh.name(), mesh.topology(), vertices.collect(), mesh.indices().to_vec()).unwrap()
    };
    let mut draw = |scene: &Scene| -> Result<Picture, Failed> {
        let recorded = fixture.record(scene)?;
        Ok(fixture.submit(recorded)?.read(0, "coloured")?)
    };
    let expected = draw(&with_meshes(field(60), bare))?;
    let found = draw(&with_meshes(field(60), |mesh| {
        let moved = imported(&device, mesh, BufferLayout::SeparateStreams).unwrap();
        let mut buffers = MeshBuffers::clone(moved.buffers().unwrap());
        buffers.streams.drain(..2);
        Mesh::from_buffers(mesh.name(), mesh.topology(), mesh.corners(), buffers).unwrap()
    }))?;
    expect(found == expected, || "it differs".into())
}

fn destroyed() -> Result<(), Failed> {
    let (device, queue) = adapter::device()?;
    let mut fixture = fixture_of(WgpuBackend::new(device.clone(), queue)?)?;
    let moved = || with_meshes(field(30), |mesh| imported(&device, mesh, BufferLayout::SeparateStreams).unwrap());
    let expected = pictures(&mut fixture, &moved())?;
    let scene = moved();
    let recorded = fixture.record(&scene)?;
    for (_, mesh) in scene.assets().iter::<Mesh>() {
        mesh.buffers().ok_or("it is in buffers")?.streams[0].buffer.destroy();
    }
    let refused = fixture.submitter.submit(recorded).err().map(|error| error.to_string()).unwrap_or_default();
    if !refused.contains("destroyed") {
        return Err(refused.into());
    }
    if pictures(&mut fixture, &moved())? == expected { Ok(()) } else { Err("the next frame differs".into()) }
}

fn on_software() -> Result<(), Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler))).pipeline(Deferred::to_picture());
    let (mut renderer, _) = builder.build(scheduler)?;
    let mut scene_issues = |scene: Scene| {
        let recorded = renderer.record(scene.as_scene_ref())?;
        Ok::<_, Failed>(recorded.statistics().scene_issues.clone())
    };
    let found = scene_issues(moved_to_device(field(30), BufferLayout::SeparateStreams, 2)?)?;
    let names: Vec<_> = found.iter().map(|known| (known.reason, known.count, known.name.as_deref())).collect();
    expect(names == [(IssueReason::UndrawableMesh, 10, Some("square"))], || format!("{found:?}"))?;
    // No object of this one has the mesh in buffers.
    for scene in [moved_to_device(field(2), BufferLayout::SeparateStreams, 2)?, field(30)] {
        let found = scene_issues(scene)?;
        expect(found.is_empty(), || format!("{found:?}"))?;
    }
    Ok(())
}
