//! Vertex attributes on the device: a buffer for each attribute that processes read.

use super::buffers::{filled_buffer, new_buffer};
use super::counted_queue::CountedQueue;
use crate::backend::BackendError;
use crate::process::DeclaredAttribute;
use crate::scene::{AttributeFormat, AttributeLayout, Mesh};

/// The attributes that processes have read so far. A page of vertices has a buffer for each of them, in which a vertex
/// has the same index as in the buffer of vertices.
#[derive(Clone, Default)]
pub(crate) struct AttributeSet {
    attributes: Vec<DeclaredAttribute>,
}

/// A buffer for each attribute.
pub(crate) type AttributeBuffers = Vec<(AttributeLayout, wgpu::Buffer)>;

impl AttributeSet {
    /// With the attributes that a plan's processes read; `None` if they are there already. If one is new, all meshes
    /// have to be written anew.
    pub(crate) fn with(&self, attributes: &[DeclaredAttribute]) -> Option<Self> {
        let is_new = |attribute: &&DeclaredAttribute| !self.attributes.contains(attribute);
        let mut changed = None;
        for attribute in attributes.iter().filter(is_new) {
            let Self { attributes } = changed.get_or_insert_with(|| self.clone());
            attributes.retain(|known| known.layout.name != attribute.layout.name);
            attributes.push(attribute.clone());
        }
        changed
    }

    /// Buffers with room for this many vertices.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn new_buffers(&self, device: &wgpu::Device, vertices: u64) -> Result<AttributeBuffers, BackendError> {
        let new = |DeclaredAttribute { layout, .. }: &DeclaredAttribute| {
            let (size, usage) = (vertices * layout.format.bytes() as u64, wgpu::BufferUsages::VERTEX);
            Ok((*layout, new_buffer(device, layout.name, size.max(16), usage | wgpu::BufferUsages::COPY_DST)?))
        };
        self.attributes.iter().map(new).collect()
    }

    /// Calls `visit` with the buffer of each attribute, the size of a value, and the values that a mesh has.
    pub(crate) fn for_each_value(
        &self,
        mesh: &Mesh,
        buffers: &AttributeBuffers,
        mut visit: impl FnMut(&wgpu::Buffer, u64, &[u8]),
    ) {
        for (attribute, (layout, buffer)) in self.attributes.iter().zip(buffers) {
            with_values(mesh, attribute, |bytes| visit(buffer, layout.format.bytes() as u64, bytes));
        }
    }

    /// The size of a vertex's values of all attributes.
    pub(crate) fn bytes_per_vertex(&self) -> u64 {
        self.attributes.iter().map(|attribute| attribute.layout.format.bytes() as u64).sum()
    }

    /// The attributes of a mesh in buffers of its own.
    ///
    /// # Errors
    /// If the device has no room.
    pub(crate) fn of_mesh(
        &self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        mesh: &Mesh,
    ) -> Result<AttributeBuffers, BackendError> {
        let upload = |attribute: &DeclaredAttribute| {
            let (layout, usage) = (attribute.layout, wgpu::BufferUsages::VERTEX);
            let buffer = |bytes: &[u8]| filled_buffer(device, uploads, layout.name, bytes, usage);
            Ok((layout, with_values(mesh, attribute, buffer)?))
        };
        self.attributes.iter().map(upload).collect()
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
