//! Whether a device can draw a mesh.

use super::mesh_pages::{INDEX, index_count};
use super::vertex_data::vertex_stride;
use crate::backend::BackendError;
use crate::backend::wgpu::error_scope::{catch_wgpu_panic, with_error_scope};
use crate::quality::VertexFormat;
use crate::scene::{GeneratedGeometry, IndexSource, Mesh, MeshBuffers};

/// Checks that a device can draw a mesh with vertices in this format.
///
/// # Errors
/// If the mesh exceeds a limit of the device, or has buffers of another one.
pub(crate) fn check_mesh(device: &wgpu::Device, mesh: &Mesh, format: VertexFormat) -> Result<(), BackendError> {
    if let Some(buffers) = mesh.buffers() {
        check_streams(device, mesh.name(), buffers)?;
        return check_device(device, mesh.name(), buffers);
    }
    let [vertices, indices] = match mesh.generated_geometry() {
        Some(generated) => bytes_of_generated(generated),
        None => bytes_in_pages(mesh, format),
    };
    // Draws count vertices from the start of a buffer as signed numbers.
    let max_vertices = i32::MAX as u64;
    let vertex_count = (mesh.vertices().len() as u64).max(generated_vertices(mesh));
    if vertex_count > max_vertices {
        return Err(BackendError::Limit { limit: "vertices of a mesh", allowed: max_vertices, needed: vertex_count });
    }
    check_buffer(vertices.max(indices), device.limits().max_buffer_size)
}

/// # Errors
/// If a buffer of `needed` bytes is larger than the device allows.
fn check_buffer(needed: u64, allowed: u64) -> Result<(), BackendError> {
    if needed > allowed { Err(BackendError::Limit { limit: "max_buffer_size", allowed, needed }) } else { Ok(()) }
}

/// The size of the longest buffers of vertices and of indices in a page that holds nothing but a mesh. An attribute of
/// the engine's own takes no more than the vertices: 16 bytes each at most.
fn bytes_in_pages(mesh: &Mesh, format: VertexFormat) -> [u64; 2] {
    const MAX_ATTRIBUTE_BYTES: u64 = 16;
    let stride = vertex_stride(format).max(MAX_ATTRIBUTE_BYTES);
    [mesh.vertices().len() as u64 * stride, index_count(mesh) as u64 * INDEX]
}

/// Whether a mesh fits in buffers of its own that are no larger than that.
pub(crate) fn fits_in_buffers(mesh: &Mesh, format: VertexFormat, buffer_bytes: u64) -> bool {
    bytes_in_pages(mesh, format).into_iter().all(|bytes| bytes <= buffer_bytes)
}

fn bytes_of_generated(GeneratedGeometry { vertices, indices, .. }: &GeneratedGeometry) -> [u64; 2] {
    let of_indices = match &indices.0 {
        IndexSource::Fixed(indices) => size_of_val(&**indices),
        IndexSource::Generated(source) => source.layout.bytes(),
    };
    [vertices.layout.bytes() as u64, of_indices as u64]
}

fn generated_vertices(mesh: &Mesh) -> u64 {
    mesh.generated_geometry().map_or(0, |generated| generated.vertices.layout.capacity as u64)
}

/// Checks that pipelines of this device can read the streams of a mesh.
///
/// # Errors
/// If there are too many, or a vertex of one has too many bytes.
fn check_streams(device: &wgpu::Device, mesh: &str, buffers: &MeshBuffers) -> Result<(), BackendError> {
    let limits = device.limits();
    let refused = |problem: String| BackendError::Validation { label: format!("mesh `{mesh}`"), message: problem };
    let (streams, most) = (buffers.streams.len(), limits.max_vertex_buffers as usize);
    if streams > most {
        return Err(refused(format!("it has {streams} streams, and the device allows {most} vertex buffers")));
    }
    let most = u64::from(limits.max_vertex_buffer_array_stride);
    match buffers.streams.iter().map(|stream| stream.layout.stride).find(|stride| *stride > most) {
        Some(stride) => Err(refused(format!("it has vertices of {stride} bytes, and the device allows {most}"))),
        None => Ok(()),
    }
}

/// Checks that buffers belong to `device`: wgpu checks that only when a command uses them.
///
/// # Errors
/// If one does not.
fn check_device(device: &wgpu::Device, mesh: &str, buffers: &MeshBuffers) -> Result<(), BackendError> {
    let label = format!("the buffers of mesh `{mesh}`");
    let check = || {
        let mut encoder = device.create_render_bundle_encoder(&wgpu::RenderBundleEncoderDescriptor {
            color_formats: &[Some(wgpu::TextureFormat::Rgba8Unorm)],
            sample_count: 1,
            ..wgpu::RenderBundleEncoderDescriptor::default()
        });
        for stream in &buffers.streams {
            encoder.set_vertex_buffer(0, Some(stream.buffer.slice(..)));
        }
        if let Some(indices) = &buffers.indices {
            encoder.set_index_buffer(indices.buffer.slice(..), indices.format);
        }
        encoder.finish(&wgpu::RenderBundleDescriptor::default())
    };
    match with_error_scope(device, &label, || catch_wgpu_panic(&label, check)).flatten() {
        // That is no fault of the mesh, and the frame finds it too.
        Err(BackendError::DeviceLost { .. } | BackendError::OutOfMemory { .. }) | Ok(_) => Ok(()),
        Err(problem) => Err(problem),
    }
}
