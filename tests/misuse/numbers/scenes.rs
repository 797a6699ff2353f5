//! Numbers of scenes that are no positions, colours or angles: those are in `tests/extremes`.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::{
    Bounds, Camera, Changes, IndexBuffer, LayerMask, LevelOfDetail, Light, Material, Mesh, MeshBuffers, ObjectSet,
    Sampler, StaticGroup, StreamAttribute, StreamLayout, Texture, TextureClass, TextureFormat, Topology, Vertex,
    VertexStream,
};
use drawloom::wgpu;
use drawloom_testing::adapter::noop_device;
use libtest_mimic::Failed;

use super::NumberCase;
use crate::fixture::{COUNTS, FLOATS, Fixture, ensure, refused, same, scene};

pub const CASES: &[NumberCase] = &[
    NumberCase {
        name: "textures_and_meshes_of_any_size",
        numbers: &[
            "scene::Texture::new",
            "scene::Texture::with_levels",
            "scene::TextureClass::height",
            "scene::TextureClass::mip_levels",
            "scene::TextureClass::width",
            "scene::Mesh::new",
            "scene::Mesh::cuboid",
            "scene::LevelOfDetail::new",
        ],
        check: assets,
    },
    NumberCase { name: "samplers_of_any_anisotropy", numbers: &["scene::Sampler::anisotropy"], check: samplers },
    NumberCase {
        name: "meshes_are_subdivided_to_any_length",
        numbers: &["scene::Mesh::subdivided"],
        check: subdivided,
    },
    NumberCase {
        name: "meshes_in_buffers_of_any_layout",
        numbers: &[
            "scene::IndexBuffer::count",
            "scene::IndexBuffer::offset",
            "scene::Mesh::from_buffers",
            "scene::MeshBuffers::vertex_count",
            "scene::StreamAttribute::normal",
            "scene::StreamAttribute::of",
            "scene::StreamAttribute::position",
            "scene::StreamAttribute::uv",
            "scene::StreamLayout::stride",
            "scene::VertexStream::offset",
        ],
        check: buffers,
    },
    NumberCase {
        name: "sets_of_objects_that_are_not_there",
        numbers: &[
            "scene::ObjectSet::contains",
            "scene::ObjectSet::new",
            "scene::Changes::Objects",
            "scene::Changes::Ranges",
            "scene::LayerMask::layer",
            "scene::Scene::duplicate_objects",
        ],
        check: sets,
    },
    NumberCase {
        name: "cameras_derived_by_any_number",
        numbers: &["scene::Camera::impostor", "scene::Camera::impostor_half_width", "scene::Camera::through_portal"],
        check: cameras,
    },
    NumberCase {
        name: "ranges_and_bounds_of_any_numbers",
        numbers: &["scene::Light::range_for", "scene::Bounds::around"],
        check: ranges,
    },
];

fn assets() -> Result<(), Failed> {
    for width in COUNTS {
        for height in COUNTS {
            let made = Texture::new("texture", width, height, vec![255; 4]);
            ensure(made.is_ok() == ([width, height] == [1, 1]), format_args!("{width} by {height}: {made:?}"))?;
            let levels = vec![vec![255; 2]; 1];
            let made = Texture::with_levels("texture", TextureFormat::R16Float, [width, height], levels);
            ensure(made.is_ok() == ([width, height] == [1, 1]), format_args!("{width} by {height}: {made:?}"))?;
            for mip_levels in COUNTS {
                let (format, sampler) = (TextureFormat::Bc7Srgb, Sampler::REPEAT);
                let class = TextureClass { width, height, format, mip_levels, sampler };
                ensure((class.bytes() == 0) == (mip_levels == 0), format_args!("{class:?}"))?;
            }
        }
    }
    for number in FLOATS {
        let made = Mesh::cuboid("box", Vec3::splat(number));
        ensure(made.is_ok() || !(number > 0.0 && number <= 1e7), format_args!("a box of {number}"))?;
        let levels = [LevelOfDetail::new(vec![0, 1, 2], number)];
        let made = Mesh::cuboid("box", Vec3::ONE)?.with_levels(levels);
        ensure(made.is_ok() == (number > 0.0 && number.is_finite()), format_args!("an error of {number}"))?;
    }
    for index in COUNTS {
        let made = Mesh::new("mesh", Topology::TriangleList, vec![Vertex::default(); 3], vec![0, 1, index]);
        ensure(made.is_ok() == (index < 3), format_args!("an index of {index}: {made:?}"))?;
        let made = Mesh::cuboid("box", Vec3::ONE)?.with_levels([LevelOfDetail::new(vec![0, 1, index], 1.0)]);
        ensure(made.is_ok() == (index < 24), format_args!("an index of {index} in a level"))?;
    }
    Ok(())
}

fn samplers() -> Result<(), Failed> {
    let mut fixture = Fixture::noop(1, Deferred::to_picture())?;
    for anisotropy in [0, 1, 2, 3, 16, 17, u8::MAX] {
        let mut scene = scene();
        let sampler = Sampler { anisotropy, ..Sampler::REPEAT };
        let texture = scene.add(Texture::new("texture", 1, 1, vec![255; 4])?.sampled_by(sampler))?;
        let materials: Vec<_> = scene.assets().iter::<Material>().map(|(handle, _)| handle).collect();
        for material in materials {
            let textured = Material { texture: Some(texture), ..scene.assets().get(material)?.clone() };
            scene.replace(material, textured)?;
        }
        fixture.draw(&scene)?;
    }
    Ok(())
}

fn subdivided() -> Result<(), Failed> {
    let mesh = Mesh::cuboid("box", Vec3::ONE)?;
    for number in FLOATS {
        for limit in [0, 1, 12, 1_000] {
            let fine = mesh.subdivided(number, limit);
            ensure(fine.triangle_count() <= limit.max(12), format_args!("{number} {limit}"))?;
        }
    }
    for limit in [usize::MAX, 1 << 63] {
        ensure(mesh.subdivided(0.5, limit).longest_edge() <= 0.5, "no limit is no limit")?;
    }
    Ok(())
}

fn buffers() -> Result<(), Failed> {
    let (device, _) = noop_device()?;
    let buffer = |usage| {
        device.create_buffer(&wgpu::BufferDescriptor { label: None, size: 1_200, usage, mapped_at_creation: false })
    };
    let (vertices, indices) = (buffer(wgpu::BufferUsages::VERTEX), buffer(wgpu::BufferUsages::INDEX));
    let usual = || {
        let float3 = wgpu::VertexFormat::Float32x3;
        let attributes = vec![StreamAttribute::position(float3, 0), StreamAttribute::normal(float3, 12)];
        let layout = StreamLayout { stride: 24, attributes };
        MeshBuffers {
            streams: vec![VertexStream { buffer: vertices.clone(), offset: 0, layout }],
            vertex_count: 10,
            indices: Some(IndexBuffer {
                buffer: indices.clone(),
                offset: 0,
                format: wgpu::IndexFormat::Uint32,
                count: 9,
            }),
        }
    };
    let make = |change: &dyn Fn(&mut MeshBuffers)| {
        let mut buffers = usual();
        change(&mut buffers);
        Mesh::from_buffers("mesh", Topology::TriangleList, [Vec3::NEG_ONE, Vec3::ONE], buffers).map(drop)
    };
    make(&|_| ())?;
    for number in [u64::MAX, u64::MAX - 3, u64::MAX - 15, 1 << 63, (1 << 63) + 8, 1 << 32, 1_200] {
        refused(make(&|buffers| buffers.streams[0].offset = number), "mesh")?;
        refused(make(&|buffers| buffers.indices.as_mut().unwrap().offset = number), "mesh")?;
        let attributes = [
            StreamAttribute::position(wgpu::VertexFormat::Float32x3, number),
            StreamAttribute::normal(wgpu::VertexFormat::Float32x3, number),
            StreamAttribute::uv(wgpu::VertexFormat::Float32x2, number),
            StreamAttribute::of(drawloom::scene::VERTEX_COLOR, wgpu::VertexFormat::Float32x4, number),
        ];
        for attribute in attributes {
            let stride_of = [24, number, u64::MAX - 3];
            for stride in stride_of {
                let made = make(&|buffers| {
                    let layout = &mut buffers.streams[0].layout;
                    layout.stride = stride;
                    layout.attributes.retain(|known| known.name() != attribute.name());
                    layout.attributes.push(attribute);
                });
                refused(made, "mesh")?;
            }
        }
        refused(make(&|buffers| buffers.streams[0].layout.stride = number), "mesh")?;
    }
    for count in COUNTS {
        let made = make(&|buffers| buffers.vertex_count = count);
        ensure(made.is_ok() == (count <= 50 && count > 0) || count == 0, format_args!("{count} vertices: {made:?}"))?;
        refused(make(&|buffers| buffers.indices.as_mut().unwrap().count = count), "mesh")?;
    }
    Ok(())
}

fn sets() -> Result<(), Failed> {
    for index in [1, 1 << 31, u32::MAX - 1, u32::MAX] {
        let set = ObjectSet::new([0, index]);
        ensure(set.contains(index as usize) && !set.contains(usize::MAX), "what it was made of")?;
        same(set.iter().last(), Some(index), "the last one")?;
        let mut scene = scene();
        scene.static_groups.push(StaticGroup::new("a static group", set));
        let drawn = Fixture::null(2).draw(&scene)?;
        ensure(!drawn.statistics.scene_issues.is_empty(), "an object that is not there is counted")?;
        let mut fixture = Fixture::null(2);
        fixture.expect_usual("the first frame")?;
        let scene = self::scene();
        let range = index..u32::MAX;
        for changes in [Changes::Objects(&[index]), Changes::Ranges(std::slice::from_ref(&range))] {
            let mut parts = scene.as_scene_ref();
            parts.changes = changes;
            let recorded = fixture.renderer.record(parts)?;
            same(recorded.statistics().views[0].visible, 1, "the object")?;
        }
    }
    for layer in [32, u32::MAX] {
        // It says so in its documentation, and does not compile in a constant.
        ensure(drawloom::task::catch(|| LayerMask::layer(layer)).is_err(), "there is no such layer")?;
    }
    let mut scene = scene();
    for (copies, expected) in [(0, 1), (1, 1), (3, 3)] {
        scene.duplicate_objects(copies);
        same(scene.object_count(), expected, "objects")?;
    }
    Ok(())
}

fn cameras() -> Result<(), Failed> {
    let draw = |camera: Camera| {
        let mut scene = scene();
        scene.cameras[0] = camera;
        Fixture::null(1).draw(&scene).map(drop)
    };
    let camera = scene().cameras.remove(0);
    for number in FLOATS {
        let wide = f64::from(number);
        for (center, radius, side, angle) in [
            (DVec3::splat(wide), 1.0, 16, 0.1),
            (DVec3::ZERO, wide, 16, 0.1),
            (DVec3::ZERO, 1.0, 16, wide),
            (DVec3::ZERO, 1.0, u32::MAX, 0.1),
        ] {
            let impostor = camera.impostor("impostor", (center, radius), side, None, angle);
            if let Some(impostor) = impostor {
                let again = camera.impostor("impostor", (center, radius), side, Some(&impostor), angle);
                again.into_iter().chain([impostor]).for_each(|camera| drop(draw(camera)));
            }
            camera.impostor_half_width(center);
        }
        for entry in [(DVec3::splat(wide), Quat::IDENTITY), (DVec3::ZERO, Quat::from_xyzw(number, 0.0, 0.0, number))] {
            let exit = (DVec3::X, Quat::IDENTITY);
            for seen in [camera.through_portal("portal", entry, exit), camera.through_portal("portal", exit, entry)] {
                drop(draw(seen));
            }
        }
    }
    draw(camera)
}

fn ranges() -> Result<(), Failed> {
    for number in FLOATS {
        let range = Light::range_for(Vec3::splat(number));
        ensure(range >= 0.0 || number < 0.0 || number.is_nan(), format_args!("the range for {number} is {range}"))?;
        let bounds = Bounds::around([Vec3::splat(number), Vec3::ONE].into_iter());
        ensure(bounds.radius >= 0.0 || !number.is_finite(), format_args!("the bounds of {number}: {bounds:?}"))?;
    }
    Ok(())
}
