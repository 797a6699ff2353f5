//! The bytes of the engine's own that processes read.

use std::ops::Range;

use crate::backend::BackendError;
use crate::backend::wgpu::resources::{CountedQueue, MirroredBuffer, check_storage_binding_size};

/// The buffers of [`ShaderResource::Bytes`](crate::process::ShaderResource::Bytes),
/// [`ShaderResource::SharedBytes`](crate::process::ShaderResource::SharedBytes), and the values of material types,
/// which all views of a process share.
#[derive(Default)]
pub(crate) struct ResourceBytes {
    /// Each with the number of its bytes.
    buffers: Vec<(MirroredBuffer, usize)>,
    /// The index of the buffer of each such resource of each process.
    bound: Vec<usize>,
    /// The part of `bound` of each process.
    of_processes: Vec<Range<usize>>,
}

impl ResourceBytes {
    /// Uploads the bytes that changed; those at the same place in the CPU's memory once.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn update<'a, B: Iterator<Item = &'a [u8]>>(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        bytes_of_processes: impl Iterator<Item = B>,
    ) -> Result<(), BackendError> {
        self.bound.clear();
        self.of_processes.clear();
        let mut uploaded: Vec<&[u8]> = Vec::new();
        for bytes_of_process in bytes_of_processes {
            let first = self.bound.len();
            for bytes in bytes_of_process {
                // All of them are alive, so bytes at the same place are the same.
                let index = uploaded.iter().position(|other| std::ptr::eq(*other, bytes)).unwrap_or(uploaded.len());
                self.bound.push(index);
                if index < uploaded.len() {
                    continue;
                }
                uploaded.push(bytes);
                check_storage_binding_size(device, bytes.len())?;
                if index == self.buffers.len() {
                    self.buffers.push((MirroredBuffer::new("engine's bytes", wgpu::BufferUsages::STORAGE), 0));
                }
                let (buffer, length) = &mut self.buffers[index];
                buffer.set(device, uploads, bytes)?;
                *length = bytes.len();
            }
            self.of_processes.push(first..self.bound.len());
        }
        self.buffers.truncate(uploaded.len());
        Ok(())
    }

    /// The buffers of a process, by index, in the order of its bytes.
    pub(crate) fn of_process(&self, process: usize) -> impl Iterator<Item = wgpu::BufferBinding<'_>> + Clone {
        let buffers = self.bound[self.of_processes[process].clone()].iter().map(|index| &self.buffers[*index]);
        buffers.filter_map(|(buffer, length)| buffer.on_device.binding(0, *length))
    }

    /// Their sizes in bytes.
    pub(crate) fn sizes(&self) -> impl Iterator<Item = u64> {
        self.buffers.iter().map(|(buffer, _)| buffer.on_device.size())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::backend::wgpu::noop_device::noop_device;
    use crate::process::ShaderResource;

    #[test]
    fn the_same_bytes_have_one_buffer_and_equal_bytes_have_two() {
        let (device, queue) = noop_device();
        let uploads = CountedQueue::new(queue);
        let shared: Arc<[u8]> = vec![1; 64].into();
        let own = || ShaderResource::Bytes(vec![1; 64].into());
        let same = || ShaderResource::SharedBytes(Arc::clone(&shared));
        let resources = [vec![own(), same()], Vec::new(), vec![same(), own(), same()]];
        let mut bytes = ResourceBytes::default();
        let of_processes = resources.iter().map(|of_process| of_process.iter().filter_map(ShaderResource::bytes));
        bytes.update(&device, &uploads, of_processes).unwrap();
        assert_eq!(bytes.buffers.len(), 3);
        let of_process = |process| bytes.of_process(process).map(|binding| binding.buffer.clone()).collect::<Vec<_>>();
        let [first, second, third] = [0, 1, 2].map(of_process);
        assert_eq!([first.len(), second.len(), third.len()], [2, 0, 3]);
        assert!(first[1] == third[0] && third[0] == third[2], "the same bytes");
        assert!(first[0] != third[1] && first[0] != first[1], "equal bytes at other places");
    }
}
