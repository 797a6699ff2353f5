//! The bytes of the engine's own that processes read.

use std::ops::Range;

use crate::backend::BackendError;
use crate::backend::wgpu::resources::{MirroredBuffer, UploadQueue, check_storage_binding_size};
use crate::process::{Draws, ShaderResource};

/// The buffers of [`ShaderResource::Bytes`], which all views of a process share.
#[derive(Default)]
pub(crate) struct ResourceBytes {
    /// Each with the number of its bytes.
    buffers: Vec<(MirroredBuffer, usize)>,
    /// Those of each process.
    of_processes: Vec<Range<usize>>,
}

impl ResourceBytes {
    /// Uploads the bytes that changed.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn update(
        &mut self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        draws: &[Draws<'_>],
    ) -> Result<(), BackendError> {
        self.of_processes.clear();
        let mut count = 0;
        for draws in draws {
            let first = count;
            for resource in draws.resources() {
                let ShaderResource::Bytes(bytes) = resource else { continue };
                check_storage_binding_size(device, bytes.len())?;
                if count == self.buffers.len() {
                    self.buffers.push((MirroredBuffer::new("engine's bytes", wgpu::BufferUsages::STORAGE), 0));
                }
                let (buffer, length) = &mut self.buffers[count];
                buffer.set(device, uploads, bytes)?;
                *length = bytes.len();
                count += 1;
            }
            self.of_processes.push(first..count);
        }
        self.buffers.truncate(count);
        Ok(())
    }

    /// The buffers of a process, by index, in the order of its resources.
    pub(crate) fn of_process(&self, process: usize) -> impl Iterator<Item = wgpu::BufferBinding<'_>> + Clone {
        let buffers = &self.buffers[self.of_processes[process].clone()];
        buffers.iter().filter_map(|(buffer, length)| buffer.on_device.binding(0, *length))
    }

    /// Their size in bytes.
    pub(crate) fn size(&self) -> u64 {
        self.buffers.iter().map(|(buffer, _)| buffer.on_device.size()).sum()
    }
}
