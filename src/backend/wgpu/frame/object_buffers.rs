//! The buffers of a frame's objects, and what is written to them.

use std::num::NonZeroU64;
use std::ops::Range;

use crate::backend::BackendError;
use crate::backend::wgpu::resources::{CountedQueue, ObjectBuffer, check_storage_binding_size};
use crate::scene::{ColumnLayout, SceneRef};
use crate::view::{GpuObject, ObjectTable};

/// The buffers of a frame's objects: one of their GPU layouts, and one of each column that a process reads. What
/// changed is written to all of them at the same time.
pub(crate) struct ObjectBuffers {
    gpu_objects: ObjectBuffer,
    columns: Vec<(ColumnLayout, ObjectBuffer)>,
    maps_memory: bool,
    /// The most bytes of a buffer that a shader can bind.
    max_binding: u64,
}

impl ObjectBuffers {
    /// Buffers without room. `maps_memory`: see [`shares_memory`](crate::backend::wgpu::resources::shares_memory).
    pub(crate) fn new(maps_memory: bool) -> Self {
        let gpu_objects = ObjectBuffer::new("objects", maps_memory);
        Self { gpu_objects, columns: Vec::new(), maps_memory, max_binding: 0 }
    }

    /// Their sizes in bytes.
    pub(crate) fn sizes(&self) -> impl Iterator<Item = u64> {
        self.all().map(|buffer| buffer.on_device().size())
    }

    /// Makes room for this many objects, and for these columns and no others. Returns whether a buffer was reallocated,
    /// and lost its contents.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn reserve(
        &mut self,
        device: &wgpu::Device,
        columns: &[ColumnLayout],
        objects: usize,
    ) -> Result<bool, BackendError> {
        self.max_binding = device.limits().max_storage_buffer_binding_size & !3;
        if !self.columns.iter().map(|(layout, _)| layout).eq(columns) {
            let new = |&layout: &ColumnLayout| (layout, ObjectBuffer::new(layout.name, self.maps_memory));
            self.columns = columns.iter().map(new).collect();
        }
        let mut reallocated = false;
        let strides = columns.iter().map(|layout| layout.stride);
        for (buffer, stride) in self.all_mut().zip(std::iter::once(size_of::<GpuObject>()).chain(strides)) {
            check_storage_binding_size(device, objects * stride)?;
            reallocated |= buffer.reserve(device, objects * stride)?;
        }
        Ok(reallocated)
    }

    /// Whether a frame can write at once: see [`ObjectBuffer::is_ready`].
    pub(crate) fn are_ready(&self) -> bool {
        self.all().all(ObjectBuffer::is_ready)
    }

    /// Maps the buffers that the device is done with.
    ///
    /// # Errors
    /// If the device is lost.
    pub(crate) fn map(&mut self, device: &wgpu::Device) -> Result<(), BackendError> {
        self.all_mut().try_for_each(|buffer| buffer.map(device))
    }

    /// Gives the buffers to the device, before a submission that reads them.
    pub(crate) fn unmap(&self) {
        self.all().for_each(ObjectBuffer::unmap);
    }

    /// Notices when the device is done with the submission, which was the latest one of the queue.
    pub(crate) fn await_submission(&self, queue: &wgpu::Queue) {
        self.all().for_each(|buffer| buffer.await_submission(queue));
    }

    /// The GPU layouts of the objects; `None` before [`ObjectBuffers::reserve`].
    pub(crate) fn gpu_objects(&self) -> Option<wgpu::BufferBinding<'_>> {
        self.binding(&self.gpu_objects)
    }

    /// The values of a column; `None` for one that the buffers do not have.
    pub(crate) fn column(&self, layout: ColumnLayout) -> Option<wgpu::BufferBinding<'_>> {
        self.columns.iter().find(|(known, _)| *known == layout).and_then(|(_, buffer)| self.binding(buffer))
    }

    /// As much of a buffer as a shader can bind, so that bindings change only with buffers.
    fn binding<'a>(&self, buffer: &'a ObjectBuffer) -> Option<wgpu::BufferBinding<'a>> {
        let buffer = buffer.on_device();
        buffer.binding(0, buffer.size().min(self.max_binding) as usize)
    }

    /// Writes what changed in blocks of objects since an epoch, which the buffers hold.
    ///
    /// # Errors
    /// If wgpu refuses.
    pub(crate) fn write(
        &self,
        uploads: &CountedQueue,
        objects: &ObjectTable,
        scene: &SceneRef<'_>,
        blocks: Range<usize>,
        held_epoch: u64,
    ) -> Result<(), BackendError> {
        let change = Changed { objects, blocks, held_epoch };
        change.write(uploads, &self.gpu_objects, size_of::<GpuObject>(), |run, visit| {
            for_each_part(objects, run, visit);
        })?;
        for (layout, buffer) in &self.columns {
            let Some(values) = scene.column(*layout) else { continue };
            let stride = layout.stride;
            change.write(uploads, buffer, stride, |run, visit| {
                let bytes = &values.bytes()[run.start * stride..run.end * stride];
                visit(run, bytes);
            })?;
        }
        Ok(())
    }

    fn all(&self) -> impl Iterator<Item = &ObjectBuffer> {
        std::iter::once(&self.gpu_objects).chain(self.columns.iter().map(|(_, buffer)| buffer))
    }

    fn all_mut(&mut self) -> impl Iterator<Item = &mut ObjectBuffer> {
        std::iter::once(&mut self.gpu_objects).chain(self.columns.iter_mut().map(|(_, buffer)| buffer))
    }
}

/// What changed in some blocks of objects.
struct Changed<'a> {
    objects: &'a ObjectTable,
    blocks: Range<usize>,
    /// Since this epoch.
    held_epoch: u64,
}

/// Is given the bytes of some consecutive objects.
type Visit<'v> = &'v mut dyn FnMut(Range<usize>, &[u8]);

impl Changed<'_> {
    /// Writes it to a buffer with `stride` bytes for each object. `for_each_part` calls its argument with the bytes of
    /// a run of objects, in one part or several.
    fn write(
        &self,
        uploads: &CountedQueue,
        buffer: &ObjectBuffer,
        stride: usize,
        for_each_part: impl Fn(Range<usize>, Visit<'_>),
    ) -> Result<(), BackendError> {
        let Self { objects, ref blocks, held_epoch } = *self;
        let bytes_of = |objects: Range<usize>| objects.start * stride..objects.end * stride;
        let first = blocks.start * ObjectTable::BLOCK_SIZE;
        let end = (blocks.end * ObjectTable::BLOCK_SIZE).min(objects.len());
        if let Some(mut mapped) = buffer.mapped(bytes_of(first..end))? {
            let mut written = 0;
            objects.for_each_change(blocks.clone(), held_epoch, 1, |run| {
                written += run.len();
                for_each_part(run, &mut |part, bytes| {
                    mapped.slice(bytes_of(part.start - first..part.end - first)).copy_from_slice(bytes);
                });
            });
            uploads.count((written * stride) as u64);
            return Ok(());
        }
        // One write for each run of objects, because each write has a fixed cost.
        objects.for_each_change(blocks.clone(), held_epoch, MIN_UNCHANGED, |run| {
            let objects_per_write = (MAX_STAGED_BYTES / stride).max(1);
            for start in run.clone().step_by(objects_per_write) {
                let run = start..run.end.min(start + objects_per_write);
                let size = NonZeroU64::new((run.len() * stride) as u64);
                let Some((buffer, size)) = buffer.on_device().buffer().zip(size) else { continue };
                let offset = (run.start * stride) as u64;
                let Some(mut staged) = uploads.write_buffer_with(buffer, offset, size) else { continue };
                for_each_part(run, &mut |part, bytes| {
                    staged.slice(bytes_of(part.start - start..part.end - start)).copy_from_slice(bytes);
                });
            }
        });
        Ok(())
    }
}

/// Fewer unchanged objects between two runs are uploaded with them: that takes less time than another write.
const MIN_UNCHANGED: usize = 64;

/// The most bytes in one staged write: larger staging memory is mapped by the system anew in each frame.
const MAX_STAGED_BYTES: usize = 1 << 20;

/// Calls `visit` with the parts of a range of objects that lie in one block each, and the bytes of their GPU layouts.
fn for_each_part(objects: &ObjectTable, range: Range<usize>, visit: Visit<'_>) {
    for (block, part) in ObjectTable::block_ranges(range) {
        let gpu_objects = &objects.block(block).gpu_objects[part.start % ObjectTable::BLOCK_SIZE..][..part.len()];
        visit(part, bytemuck::cast_slice(gpu_objects));
    }
}
