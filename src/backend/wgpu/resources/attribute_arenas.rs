//! Vertex attributes on the device: a buffer for each attribute that processes read.

use super::arena::{filled_buffer, new_buffer};
use super::upload_queue::UploadQueue;
use crate::backend::BackendError;
use crate::process::DeclaredAttribute;
use crate::scene::{AttributeFormat, AttributeLayout, Mesh};

/// The attributes of the vertices of all meshes: a buffer for each attribute that a process has read so far. A vertex has the same
/// index there as in the arena of vertices.
#[derive(Default)]
pub(crate) struct AttributeArenas {
    attributes: Vec<DeclaredAttribute>,
    buffers: AttributeBuffers,
}

/// A buffer for each attribute.
pub(crate) type AttributeBuffers = Vec<(AttributeLayout, wgpu::Buffer)>;

impl AttributeArenas {
    /// Adds the attributes that a plan's processes read. Returns whether one of them is new: then all meshes have to be written anew.
    pub(crate) fn require(&mut self, attributes: &[DeclaredAttribute]) -> bool {
        let mut changed = false;
        for attribute in attributes.iter().filter(|attribute| !self.attributes.contains(attribute)).collect::<Vec<_>>()
        {
            self.attributes.retain(|known| known.layout.name != attribute.layout.name);
            self.attributes.push(attribute.clone());
            changed = true;
        }
        changed
    }

    /// Moves to new, empty buffers with room for this many vertices.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn reallocate(&mut self, device: &wgpu::Device, vertices: u64) -> Result<(), BackendError> {
        self.buffers.clear();
        for DeclaredAttribute { layout, .. } in &self.attributes {
            let (size, usage) = (vertices * layout.format.bytes() as u64, wgpu::BufferUsages::VERTEX);
            let buffer = new_buffer(device, layout.name, size.max(16), usage | wgpu::BufferUsages::COPY_DST)?;
            self.buffers.push((*layout, buffer));
        }
        Ok(())
    }

    /// Writes the attributes of a mesh whose first vertex has this index in the arena of vertices.
    pub(crate) fn write(&self, uploads: &UploadQueue, mesh: &Mesh, first_vertex: u64) {
        for (attribute, (layout, buffer)) in self.attributes.iter().zip(&self.buffers) {
            let offset = first_vertex * layout.format.bytes() as u64;
            with_values(mesh, attribute, |bytes| uploads.write_buffer(buffer, offset, bytes));
        }
    }

    /// The attributes of a mesh in buffers of its own.
    ///
    /// # Errors
    /// If the device has no room.
    pub(crate) fn of_mesh(
        &self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        mesh: &Mesh,
    ) -> Result<AttributeBuffers, BackendError> {
        let upload = |attribute: &DeclaredAttribute| {
            let (layout, usage) = (attribute.layout, wgpu::BufferUsages::VERTEX);
            let buffer = |bytes: &[u8]| filled_buffer(device, uploads, layout.name, bytes, usage);
            Ok((layout, with_values(mesh, attribute, buffer)?))
        };
        self.attributes.iter().map(upload).collect()
    }

    pub(crate) fn buffers(&self) -> &AttributeBuffers {
        &self.buffers
    }
}

/// Calls `visit` with the values that a mesh has for an attribute.
fn with_values<T>(mesh: &Mesh, attribute: &DeclaredAttribute, visit: impl FnOnce(&[u8]) -> T) -> T {
    match mesh.attribute(attribute.layout) {
        Some(values) => visit(values),
        None => visit(&attribute.default.repeat(mesh.vertices().len())),
    }
}

/// The format of an attribute as wgpu's.
pub(crate) fn vertex_format(format: AttributeFormat) -> wgpu::VertexFormat {
    use wgpu::VertexFormat;
    match format {
        AttributeFormat::Float32(1) => VertexFormat::Float32,
        AttributeFormat::Float32(2) => VertexFormat::Float32x2,
        AttributeFormat::Float32(3) => VertexFormat::Float32x3,
        AttributeFormat::Float32(_) => VertexFormat::Float32x4,
        AttributeFormat::Uint32(1) => VertexFormat::Uint32,
        AttributeFormat::Uint32(2) => VertexFormat::Uint32x2,
        AttributeFormat::Uint32(3) => VertexFormat::Uint32x3,
        AttributeFormat::Uint32(_) => VertexFormat::Uint32x4,
        AttributeFormat::Unorm8x4 => VertexFormat::Unorm8x4,
    }
}
