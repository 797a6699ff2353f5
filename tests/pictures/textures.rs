//! Textures keep their size, their format and their texels, however many there are of how many sizes.

use std::error::Error;
use std::sync::{Arc, OnceLock};

use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::command::Selection;
use drawloom::glam::{DVec3, Vec3};
use drawloom::handle::Handle;
use drawloom::process::{
    ClearColor, CommandDraws, Declare, Deferred, Draws, Format, InjectionPoint, ItemContext, ItemDraws, ItemRange,
    ItemRecorder, Items, RecordItems, RenderProcess, SHADER_PRELUDE,
};
use drawloom::scene::{
    AddressMode, Blend, Camera, Changes, Filter, Material, MaterialType, Mesh, Projection, RenderObject, Sampler,
    Scene, SceneRef, StaticGroup, Texture, TextureFormat, Topology, Vertex,
};
use drawloom::task::Scheduler;
use drawloom::wgpu::util::RenderEncoder;
use drawloom::{FrameInputs, wgpu};
use drawloom_testing::random::Random;
use drawloom_testing::scenes::{sized, square};
use half::f16;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, draw_on_processor, half_floats, pixel};
use crate::strategies::{few_strategies, fixture_with};

pub const CASES: &[Case] = &[
    ("a_texture_shows_its_texels_whatever_its_size_and_format", texels),
    ("textures_of_many_sizes_are_each_on_their_object_with_every_strategy", many_sizes),
    ("textures_that_are_replaced_by_others_of_other_sizes_are_drawn", replaced),
    ("static_groups_show_textures_that_are_replaced", static_groups),
    ("a_shader_finds_each_texture_of_a_material_in_its_place", places),
    ("textures_are_read_as_their_samplers_say", samplers),
    ("code_that_records_items_binds_the_textures_of_each_material", of_items),
];

/// Pixels to a side of a tile, which one object covers.
const TILE: u32 = 4;

/// A wall of square tiles, `columns` in a row, that fills the picture; each has its own texture, and shows it in the
/// colour of the texture's texels.
fn wall(columns: u32, textures: &[Texture], blend: Blend) -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    let mesh = scene.add(square(Topology::TriangleList))?;
    let rows = (textures.len() as u32).div_ceil(columns);
    let projection = Projection::Orthographic { height: f64::from(2 * rows) as f32 };
    let center = DVec3::new(f64::from(columns) - 1.0, f64::from(rows) - 1.0, 0.0);
    let camera = Camera::looking_at("main", center + DVec3::Z * 5.0, center);
    scene.cameras = vec![Camera { projection, far: 100.0, ..sized(camera, [columns * TILE, rows * TILE]) }];
    scene.ambient = Vec3::ONE;
    for (index, texture) in (0..).zip(textures) {
        let texture = scene.add(texture.clone())?;
        let material = Material { texture: Some(texture), diffuse: Vec3::ONE, blend, ..Material::default() };
        let material = scene.add(material)?;
        let place = DVec3::new(f64::from(2 * (index % columns)), f64::from(2 * (index / columns)), 0.0);
        scene.add_object(RenderObject::new(mesh, material, place))?;
    }
    Ok(scene)
}

/// The colour of what is in the middle of a tile, from the lower left on, in sRGB. `radiance` is a picture of half
/// floats.
fn tile(radiance: &Picture, columns: u32, index: u32) -> [u8; 3] {
    let (column, row) = (index % columns, index / columns);
    let [x, y] = [column * TILE + TILE / 2, radiance.height - 1 - (row * TILE + TILE / 2)];
    half_floats(radiance)[(y * radiance.width + x) as usize].map(|linear| {
        let encoded = if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
        (encoded * 255.0).round() as u8
    })
}

/// The first view's radiance.
fn draw(fixture: &mut Fixture, scene: &Scene) -> Result<Picture, Failed> {
    let recorded = fixture.record(scene)?;
    Ok(fixture.submit(recorded)?.read(0, "radiance")?)
}

/// Every format that each device has, each with a size that was once scaled: red, green and blue where the format has
/// them.
fn texels() -> Result<(), Failed> {
    let half = |values: &[f32]| values.iter().flat_map(|value| f16::from_f32(*value).to_le_bytes()).collect::<Vec<_>>();
    // 0.5 is 188 in sRGB.
    let formats = [
        (TextureFormat::Rgba8Srgb, vec![188, 0, 255, 255], [188, 0, 255]),
        (TextureFormat::Rgba8Unorm, vec![0, 128, 255, 255], [0, 188, 255]),
        (TextureFormat::R8Unorm, vec![128], [188, 0, 0]),
        (TextureFormat::Rg8Unorm, vec![255, 128], [255, 188, 0]),
        (TextureFormat::R16Float, half(&[0.5]), [188, 0, 0]),
        (TextureFormat::Rg16Float, half(&[0.0, 0.5]), [0, 188, 0]),
        (TextureFormat::Rgba16Float, half(&[0.5, 0.5, 0.0, 1.0]), [188, 188, 0]),
    ];
    for size in [[1, 1], [16, 16], [300, 7], [3, 500], [1, 2100]] {
        let texture = |(format, texel, _): &(TextureFormat, Vec<u8>, _)| {
            let texels = texel.repeat(size[0] as usize * size[1] as usize);
            Texture::with_levels(format!("{format:?}"), *format, size, vec![texels])
        };
        let textures = formats.iter().map(texture).collect::<Result<Vec<_>, _>>()?;
        let picture = draw(&mut Fixture::new()?, &wall(7, &textures, Blend::None)?)?;
        for (index, (format, _, expected)) in (0..).zip(&formats) {
            let found = tile(&picture, 7, index);
            if found.iter().zip(expected).any(|(found, expected)| found.abs_diff(*expected) > 1) {
                return Err(format!("{format:?} of {size:?}: {found:?}, not {expected:?}").into());
            }
        }
    }
    Ok(())
}

/// 60 textures of different sizes, each of one colour. Every fourth one has a size that another one has too.
fn colored(random: &mut Random, index: u32) -> Result<(Texture, [u8; 3]), Failed> {
    let color = [random.below(256), random.below(256), random.below(256)].map(|channel| channel as u8);
    let number = if index.is_multiple_of(4) { index / 8 } else { index };
    let (width, height) = (1 + number * 3, 1 + (number * 7) % 40);
    let texels = [color[0], color[1], color[2], 255].repeat((width * height) as usize);
    Ok((Texture::new(format!("texture {index}"), width, height, texels)?, color))
}

fn many_sizes() -> Result<(), Failed> {
    let mut random = Random::stream(5);
    let colored = (0..60).map(|index| colored(&mut random, index)).collect::<Result<Vec<_>, _>>()?;
    let textures: Vec<_> = colored.iter().map(|(texture, _)| texture.clone()).collect();
    for blend in [Blend::None, Blend::Alpha] {
        let scene = wall(10, &textures, blend)?;
        let check = |picture: &Picture, what: &str| {
            let wrong = (0..).zip(&colored).find(|(index, (_, color))| {
                tile(picture, 10, *index).iter().zip(color).any(|(found, expected)| found.abs_diff(*expected) > 1)
            });
            wrong.map_or(Ok(()), |(index, (_, color))| {
                Err(Failed::from(format!("{what}: tile {index} is {:?}, not {color:?}", tile(picture, 10, index))))
            })
        };
        let mut first = None;
        for (recording, encoding) in few_strategies() {
            let mut fixture = fixture_with(recording, encoding)?;
            for _ in 0..3 {
                let picture = draw(&mut fixture, &scene)?;
                check(&picture, &format!("{blend:?} with {recording:?} and {encoding:?}"))?;
                if *first.get_or_insert_with(|| picture.clone()) != picture {
                    return Err(format!("{blend:?}: {recording:?} and {encoding:?} draw something else").into());
                }
            }
        }
        let scheduler = Arc::new(Scheduler::new(1)?);
        let software = SoftwareBackend::new(Arc::clone(&scheduler));
        let picture = draw_on_processor((software, scheduler), Deferred::to_picture(), &scene, "radiance")?;
        check(&picture, "software")?;
    }
    Ok(())
}

/// Textures are replaced by others of other sizes, and materials exchange theirs, from frame to frame.
fn replaced() -> Result<(), Failed> {
    let mut random = Random::stream(6);
    let (textures, mut colors): (Vec<_>, Vec<_>) =
        (0..24).map(|index| colored(&mut random, index)).collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
    let mut scene = wall(6, &textures, Blend::None)?;
    let handles: Vec<_> = scene.assets().iter::<Texture>().map(|(handle, _)| handle).collect();
    let mut fixture = Fixture::new()?;
    for frame in 0..40 {
        let picture = draw(&mut fixture, &scene)?;
        for (index, color) in (0..).zip(&colors) {
            let found = tile(&picture, 6, index);
            if found.iter().zip(color).any(|(found, expected)| found.abs_diff(*expected) > 1) {
                return Err(format!("frame {frame}: tile {index} is {found:?}, not {color:?}").into());
            }
        }
        for _ in 0..random.below(4) {
            let (slot, number) = (random.below(24), random.below(60) as u32);
            let (texture, color) = colored(&mut random, number)?;
            scene.replace(handles[slot], texture)?;
            colors[slot] = color;
        }
    }
    Ok(())
}

/// Objects that never change, while their textures, and those of others, do: materials come into other sets.
fn static_groups() -> Result<(), Failed> {
    let mut random = Random::stream(9);
    let (textures, mut colors): (Vec<_>, Vec<_>) =
        (0..30).map(|index| colored(&mut random, index)).collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
    let mut scene = wall(6, &textures, Blend::None)?;
    let objects: Vec<_> = scene.objects().take(20).collect();
    scene.static_groups = vec![StaticGroup::new("wall", scene.object_set(objects)?)];
    let handles: Vec<_> = scene.assets().iter::<Texture>().map(|(handle, _)| handle).collect();
    let mut fixture = Fixture::new()?;
    let mut executed = 0;
    for frame in 0..40 {
        let changes = if frame == 0 { Changes::Unknown } else { Changes::NONE };
        let recorded = fixture.renderer.record(SceneRef { changes, ..scene.as_scene_ref() })?;
        executed += usize::from(recorded.statistics().views.iter().any(|view| view.static_groups > 0));
        let picture = fixture.submit(recorded)?.read(0, "radiance")?;
        for (index, color) in (0..).zip(&colors) {
            let found = tile(&picture, 6, index);
            if found.iter().zip(color).any(|(found, expected)| found.abs_diff(*expected) > 1) {
                return Err(format!("frame {frame}: tile {index} is {found:?}, not {color:?}").into());
            }
        }
        for _ in 0..if frame % 4 == 3 { 2 } else { 0 } {
            let (slot, number) = (random.below(30), random.below(60) as u32);
            let (texture, color) = colored(&mut random, number)?;
            scene.replace(handles[slot], texture)?;
            colors[slot] = color;
        }
    }
    if executed > 20 { Ok(()) } else { Err(format!("static groups are executed in {executed} frames").into()) }
}

/// Materials of this type have up to six textures.
const LAYERED: MaterialType<[f32; 4]> = MaterialType::new("layered");

/// Adds the textures of a material, weighted by powers of two.
struct Layered;

impl RenderProcess for Layered {
    fn name(&self) -> &str {
        "layered"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterLighting);
        declare.draws_over("radiance");
        declare.draws_depth("depth");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws {
            shader: "
                struct Corner {
                    @builtin(position) position: vec4<f32>,
                    @location(0) uv: vec2<f32>,
                    @location(1) @interpolate(flat) material: u32,
                }

                @vertex
                fn vertex(in: VertexInput) -> Corner {
                    let object = drawn_object(in.instance);
                    return Corner(clip_position(relative_position(object, in.position)), in.uv, object.material);
                }

                @fragment
                fn fragment(in: Corner) -> @location(0) vec4<f32> {
                    let material = materials[in.material];
                    let across = dpdx(in.uv);
                    let down = dpdy(in.uv);
                    var sum = vec4<f32>(0.0);
                    for (var place = 0u; place < 6u; place++) {
                        if has_texture(material, place) {
                            sum += texture_at(material, place, in.uv, across, down) * f32(1u << place);
                        }
                    }
                    return sum;
                }
            ",
            selection: Selection::OPAQUE.of_material_type(LAYERED),
            ..CommandDraws::default()
        })
    }
}

/// Materials with textures of many sizes in some of their places: each shows their sum.
fn places() -> Result<(), Failed> {
    let mut random = Random::stream(7);
    let (columns, count) = (8, 40);
    let plain = Texture::new("plain", 1, 1, vec![255; 4])?;
    let mut scene = wall(columns, &vec![plain; count as usize], Blend::None)?;
    let materials: Vec<_> = scene.assets().iter::<Material>().map(|(handle, _)| handle).collect();
    // Each material shares its textures with the one before, or has new ones.
    let (mut places, mut sum) = (Vec::new(), 0.0);
    let mut expected = Vec::new();
    for (index, material) in materials.iter().enumerate() {
        if index % 3 != 2 {
            (places, sum) = (Vec::new(), 0.0);
            for place in 0..Material::MAX_TEXTURES {
                if random.below(3) == 0 {
                    places.push(None);
                    continue;
                }
                let (width, height, value) = (1 + random.below(9), 1 + random.below(4), random.below(256));
                let texels = vec![value as u8; width * height];
                let size = [width as u32, height as u32];
                let texture = Texture::with_levels("value", TextureFormat::R8Unorm, size, vec![texels])?;
                places.push(Some(scene.add(texture)?));
                sum += value as f64 / 255.0 * f64::from(1_u32 << place);
            }
        }
        let (texture, textures) = (places[0], places[1..].to_vec());
        let values = Some(LAYERED.values([0.0; 4]));
        scene.replace(*material, Material { texture, textures, values, ..Material::default() })?;
        expected.push(sum);
    }
    for (recording, encoding) in few_strategies() {
        let backend = crate::fixture::backend()?.recording_strategy(recording).encoding_strategy(encoding);
        let mut fixture =
            Fixture::on_backend(backend, 2, |builder| builder.pipeline(Deferred::to_picture()).process(Layered))?;
        let picture = draw(&mut fixture, &scene)?;
        let found = half_floats(&picture);
        for (index, expected) in (0..).zip(&expected) {
            let (column, row) = (index % columns, index / columns);
            let [x, y] = [column * TILE + TILE / 2, picture.height - 1 - (row * TILE + TILE / 2)];
            let [red, ..] = found[(y * picture.width + x) as usize];
            if (red - expected).abs() > expected / 1000.0 + 1e-6 {
                return Err(format!("{recording:?}: material {index} shows {red}, not {expected}").into());
            }
        }
    }
    Ok(())
}

struct TileProcess;

/// Draws a tile for each material, with a pipeline of its own and the prelude.
struct Tiles {
    materials: Vec<Handle<Material>>,
    pipeline: OnceLock<wgpu::RenderPipeline>,
}

const TILE_SHADER: &str = "
    struct Corner {
        @builtin(position) position: vec4<f32>,
        @location(0) @interpolate(flat) material: u32,
    }

    @vertex
    fn vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) material: u32) -> Corner {
        let at = vec2(f32(material % 4u), f32(material / 4u)) + vec2(f32(corner & 1u), f32(corner >> 1u));
        return Corner(vec4(at / 2.0 - 1.0, 0.5, 1.0), material);
    }

    @fragment
    fn fragment(in: Corner) -> @location(0) vec4<f32> {
        return texture_level_0(materials[in.material], 0u, vec2(0.5));
    }
";

impl RenderProcess for TileProcess {
    fn name(&self) -> &str {
        "tiles"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("picture", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Items(ItemDraws::default())
    }
}

impl Tiles {
    fn pipeline(&self, context: &ItemContext<'_>) -> &wgpu::RenderPipeline {
        self.pipeline.get_or_init(|| {
            let device = context.resources.device;
            let shader = ["const ABSOLUTE_TRANSFORMS: bool = false;", &SHADER_PRELUDE, TILE_SHADER].concat();
            let source = wgpu::ShaderSource::Wgsl(shader.into());
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
            let bind_group_layouts = context.resources.bind_group_layouts.map(Some);
            let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                bind_group_layouts: &bind_group_layouts,
                ..wgpu::PipelineLayoutDescriptor::default()
            });
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("tiles"),
                layout: Some(&layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("vertex"),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    buffers: &[],
                },
                primitive: wgpu::PrimitiveState {
                    topology: wgpu::PrimitiveTopology::TriangleStrip,
                    ..wgpu::PrimitiveState::default()
                },
                depth_stencil: None,
                multisample: wgpu::MultisampleState::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some("fragment"),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    targets: &[context.color_formats[0].map(Into::into)],
                }),
                multiview_mask: None,
                cache: None,
            })
        })
    }
}

impl RecordItems for Tiles {
    fn record<'e>(
        &'e self,
        encoder: &mut dyn RenderEncoder<'e>,
        items: ItemRange<'e>,
        context: &'e ItemContext<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        encoder.set_pipeline(self.pipeline(context));
        encoder.set_bind_group(0, Some(context.resources.bind_groups[0]), &[]);
        for &item in items.items() {
            let material = self.materials[item as usize];
            encoder.set_bind_group(1, Some(context.resources.bind_group_of_material(material)), &[]);
            encoder.draw(0..4, material.index()..material.index() + 1);
        }
        Ok(())
    }
}

/// Materials whose textures have more sizes than are bound together.
fn of_items() -> Result<(), Failed> {
    let mut scene = Scene::new();
    let mut materials = Vec::new();
    for index in 0..16 {
        let texels = [index * 10, 255 - index, index, 255].repeat(usize::from(index) + 1);
        let format = TextureFormat::Rgba8Unorm;
        let texture = Texture::with_levels("color", format, [u32::from(index) + 1, 1], vec![texels])?;
        let texture = scene.add(texture)?;
        materials.push(scene.add(Material { texture: Some(texture), ..Material::default() })?);
    }
    let tiles = Tiles { materials, pipeline: OnceLock::new() };
    let mut fixture = Fixture::with(2, |builder| builder.process(TileProcess).output("picture"))?;
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z), [16, 16])];
    let lent = [Items::new("tiles", &[0; 16], ItemRecorder::Any(&tiles))];
    let recorded =
        fixture.renderer.record_with(FrameInputs { items: &lent, ..FrameInputs::new(scene.as_scene_ref()) })?;
    let picture = fixture.submit(recorded)?.read(0, "picture")?;
    for index in 0..16 {
        let found = pixel(&picture, index % 4 * 4 + 1, 15 - (index / 4 * 4 + 1));
        let index = index as u8;
        assert_eq!(found, [index * 10, 255 - index, index], "material {index}");
    }
    Ok(())
}

/// A texture of a few texels on a square that shows more than it, magnified, and one of many texels, reduced, with every
/// kind of sampler: on the device and in software.
fn samplers() -> Result<(), Failed> {
    // No pixel's centre is where two texels are equally near.
    let corner = |x: f32, y: f32| Vertex {
        position: [x, y, 0.0],
        normal: [0.0, 0.0, 1.0],
        uv: [x * 1.713 + 0.459, y * 1.877 + 0.731],
    };
    let corners = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
    let mesh = Mesh::new("square", Topology::TriangleList, corners, vec![0, 1, 2, 2, 1, 3])?;
    let mut random = Random::stream(8);
    for (width, height) in [(3, 2), (80, 70)] {
        let texels: Vec<u8> = (0..width * height * 4).map(|_| random.below(256) as u8).collect();
        let texture = Texture::new("noise", width, height, texels)?;
        for mode in [AddressMode::Repeat, AddressMode::Mirror, AddressMode::Clamp] {
            for (filter, mip_filter) in [
                (Filter::Linear, Some(Filter::Linear)),
                (Filter::Nearest, Some(Filter::Nearest)),
                (Filter::Linear, None),
            ] {
                let sampler = Sampler {
                    address_modes: [mode, AddressMode::Repeat],
                    mag_filter: filter,
                    min_filter: filter,
                    mip_filter,
                    anisotropy: 1,
                };
                let mut scene = wall(1, &[texture.clone().sampled_by(sampler)], Blend::None)?;
                scene.cameras[0].size = [60, 60];
                let handle = scene.assets().iter::<Mesh>().map(|(handle, _)| handle).next();
                scene.replace(handle.ok_or("the wall has a mesh")?, mesh.clone())?;
                let device = half_floats(&draw(&mut Fixture::new()?, &scene)?);
                let scheduler = Arc::new(Scheduler::new(1)?);
                let software = SoftwareBackend::new(Arc::clone(&scheduler));
                let deferred = Deferred::to_picture();
                let software = half_floats(&draw_on_processor((software, scheduler), deferred, &scene, "radiance")?);
                let differs = |(one, other): &(&[f64; 3], &[f64; 3])| {
                    one.iter().zip(*other).any(|(one, other)| (one - other).abs() > 0.02)
                };
                let different = device.iter().zip(&software).filter(differs).count();
                if different > 60 {
                    return Err(format!("{sampler:?}, {width} x {height}: {different} of 3600 pixels differ").into());
                }
            }
        }
    }
    Ok(())
}
