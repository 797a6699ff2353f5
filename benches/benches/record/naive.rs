//! A plain engine: draws the visible objects in the order of the scene, and sets all state for each.

use std::num::NonZeroU64;

use drawloom::glam::Mat4;
use drawloom::scene::{Mesh, SceneRef};
use drawloom::view::internal::Frustum;
use drawloom::wgpu;
use drawloom::wgpu::util::DeviceExt;

use crate::fixture::Fixture;
use crate::objects::{GpuObject, Sphere, clip_from_world, colors};
use crate::technique::{Failure, Technique};

pub struct Naive {
    fixture: Fixture,
    pipeline: wgpu::RenderPipeline,
    /// By slot: vertices, indices, and the number of indices.
    meshes: Vec<(wgpu::Buffer, wgpu::Buffer, u32)>,
    /// By camera.
    cameras: Vec<(wgpu::Buffer, wgpu::BindGroup)>,
    /// By slot.
    materials: Vec<wgpu::BindGroup>,
    objects: wgpu::Buffer,
    /// All objects; each draw passes the dynamic offset of its object.
    object_group: wgpu::BindGroup,
    /// Bytes from one object to the next.
    stride: usize,
    bytes: Vec<u8>,
    spheres: Vec<Sphere>,
    drawn: usize,
}

impl Naive {
    pub fn new(fixture: Fixture, scene: &SceneRef<'_>) -> Self {
        let device = &fixture.device;
        let layout = |has_dynamic_offset, visibility| fixture.uniform_layout(has_dynamic_offset, visibility);
        let camera_layout = layout(false, wgpu::ShaderStages::VERTEX);
        let material_layout = layout(false, wgpu::ShaderStages::FRAGMENT);
        let object_layout = layout(true, wgpu::ShaderStages::VERTEX);
        let layouts = [&camera_layout, &material_layout, &object_layout];
        let pipeline = fixture.pipeline(&layouts, None, include_str!("naive.wgsl"));

        let buffer = |usage: wgpu::BufferUsages, contents: &[u8]| {
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
        };
        let mesh = |mesh: &Mesh| {
            let vertices = buffer(wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(mesh.vertices()));
            let indices = buffer(wgpu::BufferUsages::INDEX, bytemuck::cast_slice(mesh.indices()));
            (vertices, indices, mesh.indices().len() as u32)
        };
        let meshes = scene.assets.iter::<Mesh>().map(|(_, one)| mesh(one)).collect();
        let uniform = |contents: &[u8]| buffer(wgpu::BufferUsages::UNIFORM, contents);
        let group = |layout: &wgpu::BindGroupLayout, buffer: &wgpu::Buffer, size: usize| {
            let size = NonZeroU64::new(size as u64);
            let resource = wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size });
            let entries = &[wgpu::BindGroupEntry { binding: 0, resource }];
            device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries })
        };
        let camera = |_| {
            let buffer = uniform(bytemuck::bytes_of(&Mat4::ZERO));
            let group = group(&camera_layout, &buffer, size_of::<Mat4>());
            (buffer, group)
        };
        let cameras = scene.cameras.iter().map(camera).collect();
        let material = |color: [f32; 4]| {
            let buffer = uniform(bytemuck::bytes_of(&color));
            group(&material_layout, &buffer, size_of_val(&color))
        };
        let materials = colors(scene).into_iter().map(material).collect();

        let alignment = device.limits().min_uniform_buffer_offset_alignment as usize;
        let stride = size_of::<GpuObject>().next_multiple_of(alignment);
        let bytes = vec![0; stride * scene.object_count()];
        let objects = uniform(&bytes);
        let object_group = group(&object_layout, &objects, size_of::<GpuObject>());
        let spheres = Vec::new();
        Self { pipeline, meshes, cameras, materials, objects, object_group, stride, bytes, spheres, drawn: 0, fixture }
    }
}

impl Technique for Naive {
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<(), Failure> {
        let Fixture { queue, .. } = &self.fixture;
        self.spheres.clear();
        for (object, bytes) in self.bytes.chunks_exact_mut(self.stride).enumerate() {
            let gpu_object = GpuObject::new(&scene, object);
            bytes[..size_of::<GpuObject>()].copy_from_slice(bytemuck::bytes_of(&gpu_object));
            self.spheres.push(Sphere::new(&scene, object));
        }
        queue.write_buffer(&self.objects, 0, &self.bytes);
        let mut encoder = self.fixture.encoder();
        self.drawn = 0;
        for (index, (camera, (buffer, camera_group))) in scene.cameras.iter().zip(&self.cameras).enumerate() {
            queue.write_buffer(buffer, 0, bytemuck::bytes_of(&clip_from_world(camera)));
            let frustum = Frustum::new(camera);
            let mut pass = self.fixture.pass(&mut encoder, index);
            for object in (0..scene.object_count()).filter(|&object| self.spheres[object].is_visible(&frustum)) {
                let (vertices, indices, count) = &self.meshes[scene.meshes[object].index() as usize];
                pass.set_pipeline(&self.pipeline);
                pass.set_bind_group(0, camera_group, &[]);
                pass.set_bind_group(1, &self.materials[scene.materials[object].index() as usize], &[]);
                pass.set_bind_group(2, &self.object_group, &[(object * self.stride) as u32]);
                pass.set_vertex_buffer(0, vertices.slice(..));
                pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(0..*count, 0, 0..1);
                self.drawn += 1;
            }
        }
        queue.submit([encoder.finish()]);
        Ok(())
    }

    fn wait(&mut self) -> Result<(), Failure> {
        self.fixture.wait()
    }

    fn drawn(&self) -> usize {
        self.drawn
    }

    fn picture(&mut self, camera: usize) -> Result<Vec<u8>, Failure> {
        self.fixture.read(camera)
    }
}
