//! Many materials, each with three textures: by hand with a bind group a material, and by this crate.

use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::backend::{WgpuBackend, WgpuSubmission};
use drawloom::glam::Mat4;
use drawloom::process::{ClearColor, CommandDraws, Declare, Draws, Format, RenderProcess};
use drawloom::scene::{Material, RenderObject, Scene, SceneRef, Texture, TextureFormat};
use drawloom::task::Scheduler;
use drawloom::wgpu::util::DeviceExt;
use drawloom::{Renderer, Submitter, wgpu};
use drawloom_benches::backends::BackendName;
use drawloom_benches::clouds::around_one;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::moving::{Motion, Moving};
use drawloom_benches::statistics::median;
use drawloom_benches::stopwatch::mean_frame;
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use drawloom_output::print_line;
use drawloom_testing::random::Random;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::fixture::Fixture;
use crate::geometry::Geometry;
use crate::objects::{GpuObject, Sphere, clip_from_world};
use crate::spheres::{LANES, SphereGroup, append_visible, planes};
use crate::technique::Failure;
use crate::{CAMERAS, Extent};

/// A technique in a scene, on one thread.
#[derive(Serialize)]
pub struct TexturedRow {
    pub technique: &'static str,
    pub scene: &'static str,
    /// How many sizes the textures of each kind have.
    pub sizes: u32,
    pub microseconds_per_frame: f64,
}

const MATERIALS: usize = 1_000;
/// Colour, normal, roughness.
const FORMATS: [TextureFormat; 3] = [TextureFormat::Rgba8Srgb, TextureFormat::Rgba8Unorm, TextureFormat::R8Unorm];
/// All textures of a kind have one size, or many.
const SIZES: [u32; 2] = [1, 8];
const SCENES: [Motion; 2] = [Motion::Everything, Motion::Nothing];

const BY_HAND: &str = "a bind group a material";
const DRAWLOOM: &str = "drawloom";

/// The cloud that all cameras see, with these materials.
fn textured(objects: usize, sizes: u32) -> Result<Scene, Failure> {
    let (mut scene, mut random) = (around_one(CAMERAS, objects)?, Random::new());
    let mut materials = Vec::new();
    for index in 0..MATERIALS as u32 {
        let mut textures = Vec::new();
        for format in FORMATS {
            let side = 8 + 4 * (random.below(sizes as usize) as u32);
            let texels = vec![index as u8; (side * side * format.block_bytes()) as usize];
            textures.push(Some(scene.add(Texture::with_levels("texture", format, [side; 2], vec![texels])?)?));
        }
        let texture = textures.remove(0);
        materials.push(scene.add(Material { texture, textures, ..Material::default() })?);
    }
    let objects: Vec<_> = scene.objects().collect();
    for handle in objects {
        let material = materials[random.below(MATERIALS)];
        scene.replace_object(handle, RenderObject { material, ..scene.object(handle)? })?;
    }
    Ok(scene)
}

struct Contender {
    name: &'static str,
    sizes: u32,
    motion: Motion,
    world: Moving,
    technique: Box<dyn Technique>,
}

trait Technique {
    /// Draws a frame, from visibility to submit, and returns the number of objects drawn.
    fn frame(&mut self, scene: &SceneRef<'_>, motion: Motion) -> Result<usize, Failure>;

    /// Waits until the device is idle.
    fn wait(&self) -> Result<(), Failure>;
}

/// # Errors
/// Returns an error if a frame cannot be drawn, or if techniques do not draw the same number of objects.
pub fn measure(extent: &Extent, progress: &ProgressBar) -> Result<Vec<TexturedRow>, Failure> {
    let mut contenders = Vec::new();
    for (motion, sizes) in SCENES.into_iter().flat_map(|motion| SIZES.map(|sizes| (motion, sizes))) {
        for name in [BY_HAND, DRAWLOOM] {
            let (scene, backend) = (textured(extent.objects, sizes)?, BackendName::Noop.open()?);
            let technique: Box<dyn Technique> = match name {
                BY_HAND => Box::new(ByHand::new(&backend, &scene.as_scene_ref())?),
                _ => Box::new(Drawloom::new(backend)?),
            };
            let mut contender = Contender { name, sizes, motion, world: Moving::new(scene, motion), technique };
            let (drawn, all) = (contender.draw()?, extent.objects * CAMERAS);
            if drawn != all {
                return Err(format!("{name}, {}: draws {drawn} objects instead of {all}", motion.name()).into());
            }
            contenders.push(contender);
        }
    }
    progress.set_message("textured");
    let rounds = Rounds { warm_up: extent.warm_up[0], measured: extent.rounds[0] };
    let times =
        Harness::new(rounds, progress).measure(&mut contenders, |contender, _| contender.sample(extent.sample[0]))?;
    let row = |(contender, times): (&Contender, Vec<f64>)| TexturedRow {
        technique: contender.name,
        scene: contender.motion.name(),
        sizes: contender.sizes,
        microseconds_per_frame: median(times) * 1e6,
    };
    Ok(contenders.iter().zip(times).map(row).collect())
}

pub fn print(rows: &[TexturedRow]) {
    print_line!("{MATERIALS} materials with {} textures each, one thread, noop\n", FORMATS.len());
    let mut table = Table::new(&["technique", "scene", "sizes of textures", "µs a frame", "÷ by hand"]);
    for row in rows {
        table.row([
            row.technique.to_owned(),
            row.scene.to_owned(),
            row.sizes.to_string(),
            format!("{:.1}", row.microseconds_per_frame),
            format!("{:.2}", row.microseconds_per_frame / microseconds(rows, BY_HAND, row.scene, row.sizes)),
        ]);
    }
    table.print();
    print_line!();
}

/// Adds the targets, and what was reached.
pub fn add_targets(rows: &[TexturedRow], targets: &mut Targets) {
    for (scene, sizes) in SCENES.into_iter().flat_map(|scene| SIZES.map(|sizes| (scene.name(), sizes))) {
        let ratio = microseconds(rows, DRAWLOOM, scene, sizes) / microseconds(rows, BY_HAND, scene, sizes);
        let noun = if sizes == 1 { "size" } else { "sizes" };
        let figure = format!("{MATERIALS} textured materials ÷ by hand, {scene}, textures of {sizes} {noun}");
        targets.at_most(figure, 0.7, ratio);
    }
}

/// NaN if that was not measured.
fn microseconds(rows: &[TexturedRow], technique: &str, scene: &str, sizes: u32) -> f64 {
    let row = rows.iter().find(|row| (row.technique, row.scene, row.sizes) == (technique, scene, sizes));
    row.map_or(f64::NAN, |row| row.microseconds_per_frame)
}

impl Contender {
    fn draw(&mut self) -> Result<usize, Failure> {
        self.world.step();
        let drawn = self.technique.frame(&self.world.as_scene_ref(), self.motion)?;
        self.technique.wait()?;
        Ok(drawn)
    }

    /// Draws frames until they have taken `at_least`, and at least one. Returns seconds a frame.
    fn sample(&mut self, at_least: Duration) -> Result<f64, Failure> {
        mean_frame(at_least, || {
            self.world.step();
            let start = Instant::now();
            self.technique.frame(&self.world.as_scene_ref(), self.motion)?;
            let elapsed = start.elapsed();
            self.technique.wait()?;
            Ok(elapsed)
        })
    }
}

/// Objects in the order of their materials, and of their meshes within. It sets a bind group where the material
/// changes, and draws neighbours of one mesh together.
struct ByHand {
    fixture: Fixture,
    geometry: Geometry,
    pipeline: wgpu::RenderPipeline,
    cameras: Vec<(wgpu::Buffer, wgpu::BindGroup)>,
    /// By slot; `None` for those of the cloud, which have no textures.
    materials: Vec<Option<wgpu::BindGroup>>,
    /// Objects in draw order.
    objects: Vec<u32>,
    groups: Vec<SphereGroup>,
    /// In draw order: an instance buffer.
    transforms: wgpu::Buffer,
    staged: Vec<Mat4>,
    visible: Vec<u32>,
}

impl ByHand {
    fn new(backend: &WgpuBackend, scene: &SceneRef<'_>) -> Result<Self, Failure> {
        let fixture = Fixture::new(backend, scene)?;
        let (device, queue) = (&fixture.device, &fixture.queue);
        let camera_layout = fixture.uniform_layout(false, wgpu::ShaderStages::VERTEX);
        let camera = |_| {
            let contents = bytemuck::bytes_of(&Mat4::ZERO);
            let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
            let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage });
            let entries = &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }];
            let layout = &camera_layout;
            let group = device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries });
            (buffer, group)
        };
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let texture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: true },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let entries = [
            entry(0, texture),
            entry(1, texture),
            entry(2, texture),
            entry(3, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
        ];
        let layout =
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor::default());
        let mut materials = Vec::new();
        for (_, material) in scene.assets.iter::<Material>() {
            let mut views = Vec::new();
            for (_, texture) in material.all_textures() {
                views.push(upload(device, queue, scene.assets.get(texture)?));
            }
            if views.is_empty() {
                materials.push(None);
                continue;
            }
            let mut bound: Vec<_> = views.iter().map(wgpu::BindingResource::TextureView).collect();
            bound.push(wgpu::BindingResource::Sampler(&sampler));
            let entries: Vec<_> =
                (0..).zip(bound).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
            let descriptor = wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries };
            materials.push(Some(device.create_bind_group(&descriptor)));
        }
        let mut objects: Vec<_> = (0..scene.object_count() as u32).collect();
        let key = |object: &u32| {
            let object = *object as usize;
            (scene.materials[object].index(), scene.meshes[object].index())
        };
        objects.sort_by_key(key);
        let attributes = wgpu::vertex_attr_array![2 => Float32x4, 3 => Float32x4, 4 => Float32x4, 5 => Float32x4];
        let instances = wgpu::VertexBufferLayout {
            array_stride: size_of::<Mat4>() as u64,
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &attributes,
        };
        let shader = include_str!("textured.wgsl");
        Ok(Self {
            pipeline: fixture.pipeline(&[&camera_layout, &layout], Some(instances), shader),
            geometry: Geometry::new(device, scene),
            cameras: scene.cameras.iter().map(camera).collect(),
            materials,
            groups: vec![SphereGroup::EMPTY; objects.len().div_ceil(LANES)],
            transforms: device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: (objects.len() * size_of::<Mat4>()) as u64,
                usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            staged: Vec::new(),
            visible: Vec::new(),
            objects,
            fixture,
        })
    }

    /// The objects that have moved, and their spheres.
    fn update(&mut self, scene: &SceneRef<'_>) {
        self.staged.clear();
        for (objects, group) in self.objects.chunks(LANES).zip(&mut self.groups) {
            for (lane, &object) in objects.iter().enumerate() {
                group.set(lane, &Sphere::new(scene, object as usize));
                self.staged.push(GpuObject::new(scene, object as usize).world_from_object);
            }
        }
        self.fixture.queue.write_buffer(&self.transforms, 0, bytemuck::cast_slice(&self.staged));
    }
}

impl Technique for ByHand {
    fn frame(&mut self, scene: &SceneRef<'_>, motion: Motion) -> Result<usize, Failure> {
        if motion != Motion::Nothing || self.staged.is_empty() {
            self.update(scene);
        }
        let (mut drawn, mut commands) = (0, Vec::new());
        for (index, camera) in scene.cameras.iter().enumerate() {
            let matrix = clip_from_world(camera);
            self.fixture.queue.write_buffer(&self.cameras[index].0, 0, bytemuck::bytes_of(&matrix));
            self.visible.clear();
            append_visible(&self.groups, 0, &planes(&matrix), &mut self.visible);
            drawn += self.visible.len();
            let mut encoder = self.fixture.encoder();
            let mut pass = self.fixture.pass(&mut encoder, index);
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.cameras[index].1, &[]);
            self.geometry.set(&mut pass);
            pass.set_vertex_buffer(1, self.transforms.slice(..));
            let key = |position: u32| {
                let object = self.objects[position as usize] as usize;
                (scene.materials[object].index(), scene.meshes[object].index())
            };
            let mut bound = None;
            let joins = |one: &u32, next: &u32| one + 1 == *next && key(*one) == key(*next);
            for run in self.visible.chunk_by(joins) {
                let (material, mesh) = key(run[0]);
                if bound != Some(material) {
                    bound = Some(material);
                    pass.set_bind_group(1, self.materials[material as usize].as_ref(), &[]);
                }
                self.geometry.draw(&mut pass, mesh as usize, run[0]..run[0] + run.len() as u32);
            }
            drop(pass);
            commands.push(encoder.finish());
        }
        self.fixture.queue.submit(commands);
        Ok(drawn)
    }

    fn wait(&self) -> Result<(), Failure> {
        self.fixture.wait()
    }
}

/// The first level: what a sampler reads of it costs a CPU nothing.
fn upload(device: &wgpu::Device, queue: &wgpu::Queue, texture: &Texture) -> wgpu::TextureView {
    let format = match texture.class().format {
        TextureFormat::Rgba8Srgb => wgpu::TextureFormat::Rgba8UnormSrgb,
        TextureFormat::Rgba8Unorm => wgpu::TextureFormat::Rgba8Unorm,
        _ => wgpu::TextureFormat::R8Unorm,
    };
    let descriptor = wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: texture.width(), height: texture.height(), depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    };
    let order = wgpu::util::TextureDataOrder::LayerMajor;
    let on_device = device.create_texture_with_data(queue, &descriptor, order, texture.pixels());
    on_device.create_view(&wgpu::TextureViewDescriptor::default())
}

struct Drawloom {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    last: Option<WgpuSubmission>,
}

impl Drawloom {
    fn new(backend: WgpuBackend) -> Result<Self, Failure> {
        let builder = Renderer::builder(backend).process(Textured).output(COLOR);
        let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(1)?))?;
        Ok(Self { renderer, submitter, last: None })
    }
}

impl Technique for Drawloom {
    fn frame(&mut self, scene: &SceneRef<'_>, _: Motion) -> Result<usize, Failure> {
        let submitted = self.submitter.submit(self.renderer.record(*scene)?)?;
        self.last = Some(submitted.submission);
        Ok(submitted.statistics.views.iter().map(|view| view.visible).sum())
    }

    fn wait(&self) -> Result<(), Failure> {
        Ok(self.last.as_ref().map_or(Ok(()), WgpuSubmission::wait)?)
    }
}

const COLOR: &str = "color";

struct Textured;

impl RenderProcess for Textured {
    fn name(&self) -> &str {
        "textured"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color(COLOR, Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.clears_depth("depth", Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws { shader: include_str!("textured_surface.wgsl"), ..CommandDraws::default() })
    }
}
