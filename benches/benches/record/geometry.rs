//! All meshes of a scene in one buffer of vertices and one of indices.

use std::ops::Range;

use drawloom::scene::{Mesh, SceneRef};
use drawloom::wgpu;
use drawloom::wgpu::util::{DeviceExt, RenderEncoder};

pub struct Geometry {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    /// By slot.
    meshes: Vec<MeshRange>,
}

struct MeshRange {
    first_index: u32,
    index_count: u32,
    base_vertex: i32,
}

impl Geometry {
    pub fn new(device: &wgpu::Device, scene: &SceneRef<'_>) -> Self {
        let (mut vertices, mut indices, mut meshes) = (Vec::new(), Vec::new(), Vec::new());
        for (_, mesh) in scene.assets.iter::<Mesh>() {
            let (first_index, base_vertex) = (indices.len() as u32, vertices.len() as i32);
            meshes.push(MeshRange { first_index, index_count: mesh.indices().len() as u32, base_vertex });
            vertices.extend_from_slice(mesh.vertices());
            indices.extend_from_slice(mesh.indices());
        }
        let buffer = |usage: wgpu::BufferUsages, contents: &[u8]| {
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
        };
        Self {
            vertices: buffer(wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(&vertices)),
            indices: buffer(wgpu::BufferUsages::INDEX, bytemuck::cast_slice(&indices)),
            meshes,
        }
    }

    pub fn mesh_count(&self) -> usize {
        self.meshes.len()
    }

    /// Sets the buffers that all draws share.
    pub fn set<'a>(&'a self, encoder: &mut (impl RenderEncoder<'a> + ?Sized)) {
        encoder.set_vertex_buffer(0, Some(self.vertices.slice(..)));
        encoder.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
    }

    /// Draws some instances of the mesh in a slot.
    pub fn draw<'a>(&self, encoder: &mut (impl RenderEncoder<'a> + ?Sized), mesh: usize, instances: Range<u32>) {
        let MeshRange { first_index, index_count, base_vertex } = self.meshes[mesh];
        encoder.draw_indexed(first_index..first_index + index_count, base_vertex, instances);
    }
}
