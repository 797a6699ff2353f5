//! What CPU nodes fill in a frame, on its way to the device.

use std::sync::Arc;

use crate::backend::FrameRequest;
use crate::backend::wgpu::resources::{ImportedMeshes, StorageBuffers};
use crate::process::BufferLayout;
use crate::scene::GeneratedContents;

/// The contents that CPU nodes fill in a frame, with the buffers that they are for.
///
/// They are uploaded right before the frame is submitted, on the device thread. Frames share the buffers on the device, and a frame that
/// is recorded before another one is submitted must not write what that one draws.
pub(crate) struct GeneratedUploads {
    uploads: Vec<GeneratedUpload>,
}

struct GeneratedUpload {
    contents: Arc<GeneratedContents>,
    buffer: wgpu::Buffer,
    /// Whether zeros follow the content, because the device reads the whole buffer.
    is_padded: bool,
}

impl GeneratedUploads {
    pub(crate) fn new(request: &FrameRequest<'_>, buffers: &StorageBuffers, meshes: &ImportedMeshes) -> Self {
        let mut uploads = Vec::new();
        for contents in request.generated {
            let layout = contents.layout();
            let mut add = |buffer: &wgpu::Buffer, is_padded| {
                uploads.push(GeneratedUpload { contents: Arc::clone(contents), buffer: buffer.clone(), is_padded });
            };
            meshes.filled_by(layout.identity).for_each(|(buffer, is_index)| add(buffer, is_index));
            let (name, bytes) = (layout.name, layout.bytes() as u64);
            let storage = BufferLayout { name, bytes, is_filled_by_nodes: true };
            if let Some(buffer) = buffers.find(storage).filter(|_| layout.fills_storage) {
                add(buffer, false);
            }
        }
        Self { uploads }
    }

    /// Uploads them, ahead of the next submission.
    pub(crate) fn write(&self, queue: &wgpu::Queue) {
        for GeneratedUpload { contents, buffer, is_padded } in &self.uploads {
            contents.for_each_part(|offset, bytes| queue.write_buffer(buffer, offset as u64, bytes));
            if *is_padded {
                let end = contents.layout().bytes();
                for start in (contents.byte_count()..end).step_by(ZEROS.len()) {
                    queue.write_buffer(buffer, start as u64, &ZEROS[..ZEROS.len().min(end - start)]);
                }
            }
        }
    }
}

static ZEROS: [u8; 4096] = [0; 4096];
