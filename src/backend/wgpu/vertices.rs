//! How a mesh's vertices lie in the device's memory.

use crate::quality::VertexFormat;
use crate::scene::{Mesh, PackedVertex, Vertex};

/// Bytes a vertex.
pub(super) fn stride(format: VertexFormat) -> u64 {
    let bytes = match format {
        VertexFormat::Full => size_of::<Vertex>(),
        VertexFormat::Packed => size_of::<PackedVertex>(),
    };
    bytes as u64
}

/// `VertexInput` in `drawloom.wgsl`: whatever the format, shaders are given floats. The fourth number of a packed normal is left
/// out.
pub(super) fn attributes(format: VertexFormat) -> &'static [wgpu::VertexAttribute] {
    const FULL: [wgpu::VertexAttribute; 3] = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2];
    const PACKED: [wgpu::VertexAttribute; 3] = wgpu::vertex_attr_array![0 => Float32x3, 1 => Snorm8x4, 2 => Float16x2];
    match format {
        VertexFormat::Full => &FULL,
        VertexFormat::Packed => &PACKED,
    }
}

/// Hands on a mesh's vertices as they are to lie there.
pub(super) fn with_bytes<T>(mesh: &Mesh, format: VertexFormat, take: impl FnOnce(&[u8]) -> T) -> T {
    match format {
        VertexFormat::Full => take(bytemuck::cast_slice(mesh.vertices())),
        VertexFormat::Packed => take(bytemuck::cast_slice(&mesh.packed_vertices())),
    }
}
