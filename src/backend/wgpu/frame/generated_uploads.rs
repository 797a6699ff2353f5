//! What CPU nodes fill in a frame, on its way to the device.

use std::sync::Arc;

use crate::backend::FrameRequest;
use crate::backend::wgpu::resources::{ImportedMeshes, StorageBuffers};
use crate::process::BufferLayout;
use crate::scene::{GeneratedContents, Topology};

/// The contents that CPU nodes fill in a frame, with the buffers that they are for.
///
/// They are uploaded right before the frame is submitted, on the device thread. Frames share the buffers on the device,
/// and a frame that is recorded before another one is submitted must not write what that one draws.
pub(crate) struct GeneratedUploads {
    uploads: Vec<GeneratedUpload>,
}

struct GeneratedUpload {
    contents: Arc<GeneratedContents>,
    buffer: wgpu::Buffer,
    /// If it has indices, what triangles these form. The device reads all that the buffer has room for.
    indices_of: Option<Topology>,
}

impl GeneratedUploads {
    pub(crate) fn new(request: &FrameRequest<'_>, buffers: &StorageBuffers, meshes: &ImportedMeshes) -> Self {
        let mut uploads = Vec::new();
        for contents in request.generated {
            let layout = contents.layout();
            let mut add = |buffer: &wgpu::Buffer, indices_of| {
                uploads.push(GeneratedUpload { contents: Arc::clone(contents), buffer: buffer.clone(), indices_of });
            };
            meshes.filled_by(layout.identity).for_each(|(buffer, indices_of)| add(buffer, indices_of));
            let (name, bytes) = (layout.name, layout.bytes() as u64);
            let storage = BufferLayout { name, bytes, is_filled_by_nodes: true };
            if let Some(buffer) = buffers.find(storage).filter(|_| layout.fills_storage) {
                add(buffer, None);
            }
        }
        Self { uploads }
    }

    /// Uploads them, ahead of the next submission.
    pub(crate) fn write(&self, queue: &wgpu::Queue) {
        for GeneratedUpload { contents, buffer, indices_of } in &self.uploads {
            contents.for_each_part(|offset, bytes| queue.write_buffer(buffer, offset as u64, bytes));
            if let Some(topology) = *indices_of {
                let (count, last) = contents.whole_triangles(topology);
                let padding = [last; 1024];
                let capacity = contents.layout().capacity;
                for start in (count..capacity).step_by(padding.len()) {
                    let indices = &padding[..padding.len().min(capacity - start)];
                    queue.write_buffer(buffer, (start * size_of::<u32>()) as u64, bytemuck::cast_slice(indices));
                }
            }
        }
    }
}
