//! What techniques have in common that set nothing between draws: all meshes in one buffer, all objects in another.

use drawloom::glam::Mat4;
use drawloom::scene::{Mesh, SceneRef};
use drawloom::wgpu;
use drawloom::wgpu::util::{DeviceExt, RenderEncoder};
use rayon::prelude::*;

use crate::objects::{ObjectRecord, Sphere, colors};
use crate::studio::Studio;

/// All that is set once, and what objects are.
pub struct DrawOnly {
    pub studio: Studio,
    pipeline: wgpu::RenderPipeline,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    /// By slot.
    meshes: Vec<MeshPlace>,
    objects: wgpu::Buffer,
    cameras: Vec<(wgpu::Buffer, wgpu::BindGroup)>,
    pub records: Vec<ObjectRecord>,
    pub spheres: Vec<Sphere>,
}

/// Fewer are not worth another thread.
const OBJECTS_AT_ONCE: usize = 512;

struct MeshPlace {
    first_index: u32,
    index_count: u32,
    base_vertex: i32,
}

impl DrawOnly {
    pub fn new(studio: Studio, scene: &SceneRef<'_>) -> Self {
        let device = &studio.device;
        let (mut vertices, mut indices, mut meshes) = (Vec::new(), Vec::new(), Vec::new());
        for (_, mesh) in scene.assets.iter::<Mesh>() {
            let (first_index, base_vertex) = (indices.len() as u32, vertices.len() as i32);
            meshes.push(MeshPlace { first_index, index_count: mesh.indices().len() as u32, base_vertex });
            vertices.extend_from_slice(mesh.vertices());
            indices.extend_from_slice(mesh.indices());
        }
        let records = vec![ObjectRecord::default(); scene.object_count()];
        let buffer = |usage: wgpu::BufferUsages, contents: &[u8]| {
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
        };
        let (vertices, indices) = (
            buffer(wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(&vertices)),
            buffer(wgpu::BufferUsages::INDEX, bytemuck::cast_slice(&indices)),
        );
        let objects = buffer(wgpu::BufferUsages::STORAGE, bytemuck::cast_slice(&records));
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
        let pipeline = studio.pipeline(&[&layout], include_str!("draw_only.wgsl"));
        let spheres = vec![Sphere::default(); scene.object_count()];
        Self { pipeline, vertices, indices, meshes, objects, cameras, records, spheres, studio }
    }

    /// Works out what the objects are, on all threads of the pool that this is called in, and uploads it.
    pub fn prepare(&mut self, scene: &SceneRef<'_>) {
        let objects = self.records.par_iter_mut().zip(&mut self.spheres).enumerate().with_min_len(OBJECTS_AT_ONCE);
        objects.for_each(|(object, (record, sphere))| {
            (*record, *sphere) = (ObjectRecord::new(scene, object), Sphere::new(scene, object));
        });
        self.write_objects();
    }

    /// Uploads a camera.
    pub fn write_camera(&self, camera: usize, clip_from_world: &Mat4) {
        self.studio.queue.write_buffer(&self.cameras[camera].0, 0, bytemuck::bytes_of(clip_from_world));
    }

    /// Uploads all objects.
    pub fn write_objects(&self) {
        self.studio.queue.write_buffer(&self.objects, 0, bytemuck::cast_slice(&self.records));
    }

    /// Sets what draws have in common.
    pub fn set<'a>(&'a self, encoder: &mut impl RenderEncoder<'a>, camera: usize) {
        encoder.set_pipeline(&self.pipeline);
        encoder.set_bind_group(0, Some(&self.cameras[camera].1), &[]);
        encoder.set_vertex_buffer(0, Some(self.vertices.slice(..)));
        encoder.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
    }

    /// Draws an object.
    pub fn draw<'a>(&self, encoder: &mut impl RenderEncoder<'a>, scene: &SceneRef<'_>, object: usize) {
        let MeshPlace { first_index, index_count, base_vertex } = self.meshes[scene.meshes[object].index() as usize];
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
