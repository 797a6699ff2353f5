//! Shared by the techniques that set no state between draws: all meshes in one buffer, all objects in another.

use drawloom::glam::Mat4;
use drawloom::scene::{Mesh, SceneRef};
use drawloom::wgpu;
use drawloom::wgpu::util::{DeviceExt, RenderEncoder};
use rayon::prelude::*;

use crate::fixture::Fixture;
use crate::objects::{GpuObject, Sphere, colors};

/// The state that is set once per pass, and the objects.
pub struct DrawOnly {
    pub fixture: Fixture,
    pipeline: wgpu::RenderPipeline,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    /// By slot.
    meshes: Vec<MeshRange>,
    objects: wgpu::Buffer,
    cameras: Vec<(wgpu::Buffer, wgpu::BindGroup)>,
    pub gpu_objects: Vec<GpuObject>,
    pub spheres: Vec<Sphere>,
}

/// Fewer are not worth another thread.
const MIN_OBJECTS_PER_JOB: usize = 512;

struct MeshRange {
    first_index: u32,
    index_count: u32,
    base_vertex: i32,
}

impl DrawOnly {
    pub fn new(fixture: Fixture, scene: &SceneRef<'_>) -> Self {
        let device = &fixture.device;
        let (mut vertices, mut indices, mut meshes) = (Vec::new(), Vec::new(), Vec::new());
        for (_, mesh) in scene.assets.iter::<Mesh>() {
            let (first_index, base_vertex) = (indices.len() as u32, vertices.len() as i32);
            meshes.push(MeshRange { first_index, index_count: mesh.indices().len() as u32, base_vertex });
            vertices.extend_from_slice(mesh.vertices());
            indices.extend_from_slice(mesh.indices());
        }
        let gpu_objects = vec![GpuObject::default(); scene.object_count()];
        let buffer = |usage: wgpu::BufferUsages, contents: &[u8]| {
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
        };
        let (vertices, indices) = (
            buffer(wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(&vertices)),
            buffer(wgpu::BufferUsages::INDEX, bytemuck::cast_slice(&indices)),
        );
        let objects = buffer(wgpu::BufferUsages::STORAGE, bytemuck::cast_slice(&gpu_objects));
        let colors = buffer(wgpu::BufferUsages::STORAGE, bytemuck::cast_slice(&colors(scene)));
        let layout = layout(device);
        let camera = |_| {
            let camera = buffer(wgpu::BufferUsages::UNIFORM, bytemuck::bytes_of(&Mat4::ZERO));
            let mut entries = Vec::new();
            for (binding, buffer) in (0..).zip([&camera, &objects, &colors]) {
                entries.push(wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() });
            }
            let descriptor = wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries };
            let group = device.create_bind_group(&descriptor);
            (camera, group)
        };
        let cameras = scene.cameras.iter().map(camera).collect();
        let pipeline = fixture.pipeline(&[&layout], include_str!("draw_only.wgsl"));
        let spheres = vec![Sphere::default(); scene.object_count()];
        Self { pipeline, vertices, indices, meshes, objects, cameras, gpu_objects, spheres, fixture }
    }

    /// Computes all objects on the threads of the current pool, and uploads them.
    pub fn prepare(&mut self, scene: &SceneRef<'_>) {
        let objects =
            self.gpu_objects.par_iter_mut().zip(&mut self.spheres).enumerate().with_min_len(MIN_OBJECTS_PER_JOB);
        objects.for_each(|(object, (gpu_object, sphere))| {
            (*gpu_object, *sphere) = (GpuObject::new(scene, object), Sphere::new(scene, object));
        });
        self.write_objects();
    }

    /// Uploads a camera.
    pub fn write_camera(&self, camera: usize, clip_from_world: &Mat4) {
        self.fixture.queue.write_buffer(&self.cameras[camera].0, 0, bytemuck::bytes_of(clip_from_world));
    }

    /// Uploads all objects.
    pub fn write_objects(&self) {
        self.fixture.queue.write_buffer(&self.objects, 0, bytemuck::cast_slice(&self.gpu_objects));
    }

    /// Sets the state that all draws share.
    pub fn set<'a>(&'a self, encoder: &mut impl RenderEncoder<'a>, camera: usize) {
        encoder.set_pipeline(&self.pipeline);
        encoder.set_bind_group(0, Some(&self.cameras[camera].1), &[]);
        encoder.set_vertex_buffer(0, Some(self.vertices.slice(..)));
        encoder.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
    }

    pub fn draw<'a>(&self, encoder: &mut impl RenderEncoder<'a>, scene: &SceneRef<'_>, object: usize) {
        let MeshRange { first_index, index_count, base_vertex } = self.meshes[scene.meshes[object].index() as usize];
        let instance = object as u32;
        encoder.draw_indexed(first_index..first_index + index_count, base_vertex, instance..instance + 1);
    }
}

fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    };
    let storage = wgpu::BufferBindingType::Storage { read_only: true };
    let entries = [entry(0, wgpu::BufferBindingType::Uniform), entry(1, storage), entry(2, storage)];
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}
