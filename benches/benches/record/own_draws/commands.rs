//! The engine's own pipelines, bind groups and buffers, and the commands of its draws, which all techniques share.

use std::sync::atomic::{AtomicUsize, Ordering};

use drawloom::glam::Mat4;
use drawloom::wgpu;
use drawloom::wgpu::util::{DeviceExt, RenderEncoder};
use drawloom_benches::clouds::around_one;
use drawloom_testing::random::Random;

use super::world::{MATERIALS, PIPELINES, World, material_of, pipeline_of};
use crate::CAMERAS;
use crate::fixture::Fixture;
use crate::geometry::Geometry;
use crate::objects::clip_from_world;
use crate::technique::Failure;
use crate::threads::Threads;

pub struct Commands {
    pub fixture: Fixture,
    geometry: Geometry,
    pipelines: Vec<wgpu::RenderPipeline>,
    materials: Vec<OwnMaterial>,
    cameras: Vec<(wgpu::Buffer, wgpu::BindGroup)>,
    /// The transform of each item, an instance buffer.
    transforms: wgpu::Buffer,
    /// How each item is drawn.
    items: Vec<ItemDraw>,
    /// The number of draws that were recorded.
    recorded: AtomicUsize,
}

struct OwnMaterial {
    pipeline: u32,
    bind_group: wgpu::BindGroup,
}

struct ItemDraw {
    material: u32,
    mesh: u32,
}

impl Commands {
    /// # Errors
    /// Returns an error if the meshes are invalid.
    pub fn new(fixture: Fixture, world: &World) -> Result<Self, Failure> {
        let (device, mut random) = (&fixture.device, Random::new());
        let buffer = |usage: wgpu::BufferUsages, contents: &[u8]| {
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
        };
        let camera_layout = fixture.uniform_layout(false, wgpu::ShaderStages::VERTEX);
        let material_layout = fixture.uniform_layout(false, wgpu::ShaderStages::FRAGMENT);
        let uniform = |layout: &wgpu::BindGroupLayout, contents: &[u8]| {
            let buffer = buffer(wgpu::BufferUsages::UNIFORM, contents);
            let entries = &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }];
            let group = device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries });
            (buffer, group)
        };
        let attributes = wgpu::vertex_attr_array![2 => Float32x4, 3 => Float32x4, 4 => Float32x4, 5 => Float32x4];
        let pipeline = |index| {
            let instances = wgpu::VertexBufferLayout {
                array_stride: size_of::<Mat4>() as u64,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &attributes,
            };
            let ambient = f64::from(index) / f64::from(PIPELINES);
            let shader = format!("const AMBIENT = {ambient:?};\n{}", include_str!("own_draws.wgsl"));
            fixture.pipeline(&[&camera_layout, &material_layout], Some(instances), &shader)
        };
        let material = |index| {
            let color = random.vector(0.2, 0.9).extend(1.0);
            let (_, bind_group) = uniform(&material_layout, bytemuck::bytes_of(&color));
            OwnMaterial { pipeline: pipeline_of(index), bind_group }
        };
        let camera = |camera| uniform(&camera_layout, bytemuck::bytes_of(&clip_from_world(camera)));
        let item = |(key, &mesh): (&u64, _)| ItemDraw { material: material_of(*key), mesh };
        Ok(Self {
            geometry: Geometry::new(device, &around_one(CAMERAS, 0)?.as_scene_ref()),
            pipelines: (0..PIPELINES).map(pipeline).collect(),
            materials: (0..MATERIALS).map(material).collect(),
            cameras: world.cameras().iter().map(camera).collect(),
            transforms: buffer(wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(&world.transforms)),
            items: world.keys.iter().zip(&world.meshes).map(item).collect(),
            recorded: AtomicUsize::new(0),
            fixture,
        })
    }

    /// Uploads what moved in the latest step: transforms in chunks, each on any thread.
    pub fn upload(&self, world: &World, threads: &Threads) {
        self.upload_cameras(world);
        let mut chunks: Vec<_> = (0..Self::chunk_count(world, threads.count())).collect();
        let count = chunks.len();
        threads.for_each(&mut chunks, |chunk| self.upload_chunk(world, *chunk, count));
    }

    /// The number of chunks that transforms are uploaded in by a number of threads: 0 if none moved.
    pub fn chunk_count(world: &World, threads: usize) -> usize {
        match (world.kind().moves_items(), threads) {
            (false, _) => 0,
            (true, 1) => 1,
            (true, threads) => 2 * threads,
        }
    }

    /// Uploads one of several chunks of the transforms.
    pub fn upload_chunk(&self, world: &World, chunk: usize, count: usize) {
        let items = world.transforms.len();
        let [start, end] = [chunk, chunk + 1].map(|chunk| chunk * items / count);
        let offset = (start * size_of::<Mat4>()) as u64;
        self.fixture.queue.write_buffer(&self.transforms, offset, bytemuck::cast_slice(&world.transforms[start..end]));
    }

    /// Uploads the matrices of cameras that turned in the latest step.
    pub fn upload_cameras(&self, world: &World) {
        let queue = &self.fixture.queue;
        if world.kind().moves_cameras() {
            for (camera, (buffer, _)) in world.cameras().iter().zip(&self.cameras) {
                queue.write_buffer(buffer, 0, bytemuck::bytes_of(&clip_from_world(camera)));
            }
        }
    }

    /// Records the draws of items in this order. A pipeline or a bind group is set where it changes.
    pub fn record<'a>(&'a self, encoder: &mut (impl RenderEncoder<'a> + ?Sized), camera: usize, items: &[u32]) {
        encoder.set_bind_group(0, Some(&self.cameras[camera].1), &[]);
        self.geometry.set(encoder);
        encoder.set_vertex_buffer(1, Some(self.transforms.slice(..)));
        let (mut latest_pipeline, mut latest_material) = (None, None);
        for &item in items {
            let ItemDraw { material, mesh } = self.items[item as usize];
            if latest_material != Some(material) {
                latest_material = Some(material);
                let OwnMaterial { pipeline, bind_group } = &self.materials[material as usize];
                if latest_pipeline != Some(*pipeline) {
                    latest_pipeline = Some(*pipeline);
                    encoder.set_pipeline(&self.pipelines[*pipeline as usize]);
                }
                encoder.set_bind_group(1, Some(bind_group), &[]);
            }
            self.geometry.draw(encoder, mesh as usize, item..item + 1);
        }
        self.recorded.fetch_add(items.len(), Ordering::Relaxed);
    }

    /// The number of draws that were recorded since this was called last.
    pub fn take_recorded(&self) -> usize {
        self.recorded.swap(0, Ordering::Relaxed)
    }
}
