//! The vertices and vertex attributes of meshes in the device's memory.

use super::buffers::{CountedQueue, filled_buffer, new_buffer};
use crate::backend::BackendError;
use crate::process::DeclaredAttribute;
use crate::quality::VertexFormat;
use crate::scene::{AttributeFormat, AttributeLayout, Mesh, PackedVertex, VERTEX_INDEX, Vertex};

/// Bytes per vertex.
pub(crate) fn vertex_stride(format: VertexFormat) -> u64 {
    let bytes = match format {
        VertexFormat::Full => size_of::<Vertex>(),
        VertexFormat::Packed => size_of::<PackedVertex>(),
    };
    bytes as u64
}

/// `VertexInput` in `drawloom.wgsl`. Shaders read floats in either format, and ignore the fourth component of a packed
/// normal.
pub(crate) fn vertex_attributes(format: VertexFormat) -> &'static [wgpu::VertexAttribute] {
    const FULL: [wgpu::VertexAttribute; 3] = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2];
    const PACKED: [wgpu::VertexAttribute; 3] = wgpu::vertex_attr_array![0 => Float32x3, 1 => Snorm8x4, 2 => Float16x2];
    match format {
        VertexFormat::Full => &FULL,
        VertexFormat::Packed => &PACKED,
    }
}

/// Calls `upload` with the bytes of a mesh's vertices in this format.
pub(crate) fn with_vertex_bytes<T>(mesh: &Mesh, format: VertexFormat, upload: impl FnOnce(&[u8]) -> T) -> T {
    match format {
        VertexFormat::Full => upload(bytemuck::cast_slice(mesh.vertices())),
        VertexFormat::Packed => upload(bytemuck::cast_slice(&mesh.packed_vertices())),
    }
}

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
    match mesh.attribute_of(attribute.layout) {
        Some(values) => visit(values),
        None if attribute.layout == VERTEX_INDEX.layout() => {
            let indices: Vec<_> = (0..mesh.vertices().len() as u32).collect();
            visit(bytemuck::cast_slice(&indices))
        }
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
