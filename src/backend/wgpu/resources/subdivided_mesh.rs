//! Subdivided meshes on the device.

use super::attribute_set::AttributeBuffers;
use super::buffers::filled_buffer;
use super::counted_queue::CountedQueue;
use super::vertex_layout::with_vertex_bytes;
use crate::backend::BackendError;
use crate::quality::VertexFormat;
use crate::scene::Mesh;

/// A subdivided mesh on the device, in buffers of its own.
pub(crate) struct SubdividedMesh {
    pub(crate) vertices: wgpu::Buffer,
    pub(crate) indices: wgpu::Buffer,
    pub(crate) attributes: AttributeBuffers,
    pub(crate) index_count: u32,
}

impl SubdividedMesh {
    /// # Errors
    /// If the device has no room.
    pub(crate) fn new(
        device: &wgpu::Device,
        uploads: &CountedQueue,
        mesh: &Mesh,
        format: VertexFormat,
        attributes: AttributeBuffers,
    ) -> Result<Self, BackendError> {
        let upload = |label, bytes: &[u8], usage| filled_buffer(device, uploads, label, bytes, usage);
        let indices = bytemuck::cast_slice(mesh.indices());
        Ok(Self {
            vertices: with_vertex_bytes(mesh, format, |vertices| {
                upload("subdivided vertices", vertices, wgpu::BufferUsages::VERTEX)
            })?,
            indices: upload("subdivided indices", indices, wgpu::BufferUsages::INDEX)?,
            attributes,
            index_count: mesh.indices().len() as u32,
        })
    }
}
