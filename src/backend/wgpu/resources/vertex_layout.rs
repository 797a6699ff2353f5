//! The layout of a mesh's vertices in the device's memory.

use crate::quality::VertexFormat;
use crate::scene::{Mesh, PackedVertex, Vertex};

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
