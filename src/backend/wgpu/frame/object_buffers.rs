//! The buffers of a frame's objects and of the lists of objects that passes draw, and what is written to them.

use std::num::NonZeroU64;
use std::ops::Range;
use std::sync::Arc;

use parking_lot::Mutex;

use crate::backend::wgpu::error_scope::{poll, refused, with_error_scope};
use crate::backend::wgpu::resources::{
    ALIGNMENT, CountedQueue, GrowingBuffer, check_storage_binding_size, size_with_headroom,
};
use crate::backend::{BackendError, SceneLimits};
use crate::scene::{ColumnLayout, PREVIOUS_OBJECTS, SceneRef};
use crate::view::{GpuObject, ObjectTable};

/// The buffers of a frame's objects: one of their GPU layouts, and one of each column that a process reads. What
/// changed is written to all of them at the same time.
pub(crate) struct ObjectBuffers {
    gpu_objects: ObjectBuffer,
    columns: Vec<(ColumnLayout, ObjectBuffer)>,
    /// The values of [`PREVIOUS_OBJECTS`]; `None` if no process reads them.
    pub(super) previous: Option<wgpu::Buffer>,
    maps_memory: bool,
    /// The most bytes of a buffer that a shader can bind.
    max_binding: u64,
}

impl ObjectBuffers {
    /// Buffers without room. `maps_memory`: see [`shares_memory`].
    pub(crate) fn new(maps_memory: bool) -> Self {
        let gpu_objects = ObjectBuffer::new("objects", maps_memory);
        Self { gpu_objects, columns: Vec::new(), previous: None, maps_memory, max_binding: 0 }
    }

    /// Their sizes in bytes.
    pub(crate) fn sizes(&self) -> impl Iterator<Item = u64> {
        self.all().map(|buffer| buffer.on_device().size())
    }

    /// Makes room for this many objects, and for these columns and no others, but for [`PREVIOUS_OBJECTS`]. Returns
    /// whether a buffer was reallocated, and lost its contents.
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
        let columns = columns.iter().filter(|layout| **layout != PREVIOUS_OBJECTS.layout());
        if !self.columns.iter().map(|(layout, _)| layout).eq(columns.clone()) {
            let new = |&layout: &ColumnLayout| (layout, ObjectBuffer::new(layout.name, self.maps_memory));
            self.columns = columns.clone().map(new).collect();
        }
        let mut reallocated = false;
        let strides = columns.map(|layout| layout.stride);
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

    /// The buffer of the objects' GPU layouts; `None` before [`ObjectBuffers::reserve`].
    pub(super) fn gpu_objects_buffer(&self) -> Option<&wgpu::Buffer> {
        self.gpu_objects.on_device().buffer()
    }

    /// The values of a column; `None` for one that the buffers do not have.
    pub(crate) fn column(&self, layout: ColumnLayout) -> Option<wgpu::BufferBinding<'_>> {
        if layout == PREVIOUS_OBJECTS.layout() {
            let size = |buffer: &wgpu::Buffer| NonZeroU64::new(buffer.size().min(self.max_binding));
            let bound = |buffer| wgpu::BufferBinding { buffer, offset: 0, size: size(buffer) };
            return self.previous.as_ref().map(bound);
        }
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

/// A buffer with an element for each of a frame's objects. Where the device shares the CPU's memory, jobs write
/// straight into it while it is mapped, so nothing is staged, and nothing copied when the frame is submitted.
///
/// A mapping is requested only when the device is done with all submissions that use the buffer. wgpu would grant a
/// request that was made and cancelled before when the submission of that time is done, while a later one still reads
/// the buffer.
struct ObjectBuffer {
    label: &'static str,
    on_device: GrowingBuffer,
    /// `None` if writes are staged.
    usage: Option<Arc<Mutex<Usage>>>,
}

/// Who uses a buffer that can be mapped.
#[derive(Debug, Default)]
struct Usage {
    /// The number of submissions that use it, and the number of those that the device is done with.
    submitted: u64,
    done: u64,
    is_mapped: bool,
    /// Whether wgpu refused to map it.
    is_refused: bool,
}

impl Usage {
    /// Whether the buffer may be mapped. Before its first submission it may have writes that are staged, and not
    /// submitted.
    fn is_idle(&self) -> bool {
        self.submitted > 0 && self.done == self.submitted
    }
}

impl ObjectBuffer {
    /// A buffer without room. `maps_memory`: see [`shares_memory`].
    fn new(label: &'static str, maps_memory: bool) -> Self {
        use wgpu::BufferUsages;
        // Objects are copied for the next frame.
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let usage = if maps_memory { usage | BufferUsages::MAP_WRITE } else { usage };
        Self { label, on_device: GrowingBuffer::new(label, usage), usage: maps_memory.then(Arc::default) }
    }

    fn on_device(&self) -> &GrowingBuffer {
        &self.on_device
    }

    /// Makes room for `bytes`. Returns whether the buffer was reallocated, and lost its contents.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    fn reserve(&mut self, device: &wgpu::Device, bytes: usize) -> Result<bool, BackendError> {
        let reallocated = self.on_device.reserve(device, bytes)?;
        if reallocated {
            // Submissions of the earlier buffer say nothing about this one.
            self.usage = self.usage.as_ref().map(|_| Arc::default());
        }
        Ok(reallocated)
    }

    /// Whether a frame can write at once: the buffer is mapped, or can be, or is not meant to be.
    fn is_ready(&self) -> bool {
        self.usage.as_ref().is_none_or(|usage| {
            let usage = usage.lock();
            usage.is_mapped || usage.is_idle()
        })
    }

    /// Maps the buffer if the device is done with it. Otherwise writes are staged.
    ///
    /// # Errors
    /// If the device is lost.
    fn map(&mut self, device: &wgpu::Device) -> Result<(), BackendError> {
        let Some((usage, buffer)) = self.usage.as_ref().zip(self.on_device.buffer()) else { return Ok(()) };
        if self.is_mapped() || !usage.lock().is_idle() {
            return Ok(());
        }
        let in_callback = Arc::clone(usage);
        let mapped = move |result: Result<_, _>| {
            let mut usage = in_callback.lock();
            (usage.is_mapped, usage.is_refused) = (result.is_ok(), result.is_err());
        };
        with_error_scope(device, self.label, || buffer.map_async(wgpu::MapMode::Write, .., mapped))?;
        poll(device, wgpu::PollType::Poll)?;
        let maps_memory = !usage.lock().is_refused;
        if !self.is_mapped() {
            // A new buffer, without the request. It is pending if a frame was dropped whose staged writes the device
            // still executes.
            *self = Self::new(self.label, maps_memory);
        }
        Ok(())
    }

    /// A view of a range in bytes, to write through; `None` if writes are staged. Views at the same time must not
    /// overlap.
    ///
    /// # Errors
    /// If wgpu refuses.
    fn mapped(&self, bytes: Range<usize>) -> Result<Option<wgpu::BufferViewMut>, BackendError> {
        let Some(buffer) = self.on_device.buffer().filter(|_| self.is_mapped()) else { return Ok(None) };
        let view = buffer.get_mapped_range_mut(bytes.start as u64..bytes.end as u64);
        view.map(Some).map_err(|error| refused(self.label, error.to_string()))
    }

    /// Gives the buffer to the device, before a submission that reads it.
    fn unmap(&self) {
        let Some((usage, buffer)) = self.usage.as_ref().zip(self.on_device.buffer()) else { return };
        let mut usage = usage.lock();
        usage.submitted += 1;
        if std::mem::take(&mut usage.is_mapped) {
            buffer.unmap();
        }
    }

    /// Notices when the device is done with the submission, which was the latest one of the queue.
    fn await_submission(&self, queue: &wgpu::Queue) {
        let Some(usage) = &self.usage else { return };
        let (usage, number) = (Arc::clone(usage), usage.lock().submitted);
        queue.on_submitted_work_done(move || {
            let mut usage = usage.lock();
            usage.done = usage.done.max(number);
        });
    }

    fn is_mapped(&self) -> bool {
        self.usage.as_ref().is_some_and(|usage| usage.lock().is_mapped)
    }
}

/// Whether a device reads the CPU's own memory as fast as any other. Devices with memory of their own read the CPU's
/// through a bus.
pub(crate) fn shares_memory(adapter: &wgpu::AdapterInfo) -> bool {
    use wgpu::{Backend, DeviceType};
    adapter.backend == Backend::Noop || matches!(adapter.device_type, DeviceType::IntegratedGpu | DeviceType::Cpu)
}

/// The lists of objects that passes of commands draw, one after the other: in one buffer, or in several of equal size
/// where one would be larger than the device allows. A list lies in one of them.
pub(super) struct ObjectLists {
    /// At least one.
    buffers: Vec<GrowingBuffer>,
    /// The size of a list, in bytes.
    stride: usize,
    /// The lists in a buffer.
    per_buffer: usize,
}

impl ObjectLists {
    pub(super) fn new() -> Self {
        Self { buffers: vec![new_buffer()], stride: 0, per_buffer: usize::MAX }
    }

    /// Makes room for `lists` lists of `objects` objects each. Returns whether what the lists held is lost.
    ///
    /// # Errors
    /// If the device has no room.
    pub(super) fn reserve(
        &mut self,
        device: &wgpu::Device,
        lists: usize,
        objects: usize,
        limits: SceneLimits,
    ) -> Result<bool, BackendError> {
        let needed = objects * size_of::<u32>();
        // Headroom is for what fits beside it.
        let max_stride = limits.binding_bytes.min(limits.buffer_bytes / lists.max(1) as u64);
        let stride = size_with_headroom(self.stride, needed, max_stride);
        let per_buffer = usize::try_from(limits.buffer_bytes / stride as u64).unwrap_or(usize::MAX).max(1);
        let mut is_lost = (self.stride, self.per_buffer) != (stride, per_buffer);
        (self.stride, self.per_buffer) = (stride, per_buffer);
        let count = lists.div_ceil(per_buffer).max(1);
        is_lost |= count > self.buffers.len();
        self.buffers.resize_with(count, new_buffer);
        for (index, buffer) in self.buffers.iter_mut().enumerate() {
            let lists = lists.saturating_sub(index * per_buffer).min(per_buffer);
            is_lost |= buffer.reserve(device, (lists * stride).max(ALIGNMENT))?;
        }
        Ok(is_lost)
    }

    /// The maximum number of lists of `objects` objects each that one buffer holds without headroom.
    pub(super) fn max_in_one_buffer(objects: usize, limits: SceneLimits) -> u64 {
        limits.buffer_bytes / (objects * size_of::<u32>()).next_multiple_of(ALIGNMENT) as u64
    }

    /// The bytes of a list, by its place among all lists, as if these were in one buffer. The layout requires a binding
    /// even if a pass has no list; it reads nothing from it.
    pub(super) fn bytes_of(&self, list: &Range<usize>) -> Range<usize> {
        if list.is_empty() { 0..ALIGNMENT } else { list.start * self.stride..list.end * self.stride }
    }

    /// Those bytes, to be bound.
    pub(super) fn binding(&self, bytes: &Range<usize>) -> Option<wgpu::BufferBinding<'_>> {
        let (buffer, offset) = self.position(bytes.start);
        self.buffers.get(buffer)?.binding(offset, bytes.len())
    }

    /// Writes to a list that begins at `start`.
    pub(super) fn write(&self, uploads: &CountedQueue, start: usize, offset: usize, bytes: &[u8]) {
        let (buffer, start) = self.position(start);
        if let Some(buffer) = self.buffers.get(buffer) {
            buffer.write(uploads, start + offset, bytes);
        }
    }

    /// Their sizes in bytes.
    pub(super) fn sizes(&self) -> impl Iterator<Item = u64> {
        self.buffers.iter().map(GrowingBuffer::size)
    }

    /// The buffer in which a list begins, and where.
    fn position(&self, start: usize) -> (usize, usize) {
        let bytes_per_buffer = self.per_buffer.saturating_mul(self.stride.max(1));
        (start / bytes_per_buffer, start % bytes_per_buffer)
    }
}

fn new_buffer() -> GrowingBuffer {
    GrowingBuffer::new("object indices", wgpu::BufferUsages::STORAGE)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::backend::wgpu::noop_device::{noop_device, noop_device_with};
    use crate::scene::{Material, Mesh, ObjectColumn, RenderObject, Scene, Topology, Vertex};

    fn submit(buffer: &ObjectBuffer, queue: &wgpu::Queue) {
        buffer.unmap();
        queue.submit([]);
        buffer.await_submission(queue);
    }

    fn can_write(buffer: &ObjectBuffer, bytes: Range<usize>) -> bool {
        buffer.mapped(bytes).unwrap().is_some()
    }

    #[test]
    fn a_buffer_is_mapped_when_the_device_is_done_with_it() {
        let (device, queue) = noop_device();
        let mut buffer = ObjectBuffer::new("objects", true);
        for bytes in [1_000, 4_000] {
            buffer.reserve(&device, bytes).unwrap();
            buffer.map(&device).unwrap();
            assert!(!buffer.is_ready() && !can_write(&buffer, 0..64), "new, so the first frame is staged");
            for _frame in 0..3 {
                submit(&buffer, &queue);
                assert!(!buffer.is_ready());
                buffer.map(&device).unwrap();
                assert!(!can_write(&buffer, 0..64), "nobody has polled");
                poll(&device, wgpu::PollType::Poll).unwrap();
                assert!(buffer.is_ready());
                buffer.map(&device).unwrap();
                let views = [0..64, 64..bytes].map(|bytes| buffer.mapped(bytes).unwrap());
                assert!(views.iter().all(Option::is_some));
                assert!(buffer.mapped(32..96).is_err(), "views must not overlap");
            }
        }
    }

    #[test]
    fn the_end_of_an_earlier_submission_does_not_free_the_buffer() {
        let (device, queue) = noop_device();
        let mut buffer = ObjectBuffer::new("objects", true);
        buffer.reserve(&device, 64).unwrap();
        submit(&buffer, &queue);
        buffer.unmap();
        poll(&device, wgpu::PollType::Poll).unwrap();
        assert!(!buffer.is_ready());
        queue.submit([]);
        buffer.await_submission(&queue);
        poll(&device, wgpu::PollType::Poll).unwrap();
        assert!(buffer.is_ready());
        submit(&buffer, &queue);
        buffer.reserve(&device, 1 << 20).unwrap();
        poll(&device, wgpu::PollType::Poll).unwrap();
        assert!(!buffer.is_ready(), "the submission read another buffer");
    }

    #[test]
    fn without_mapping_writes_are_staged() {
        let (device, queue) = noop_device();
        let mut buffer = ObjectBuffer::new("objects", false);
        buffer.reserve(&device, 64).unwrap();
        submit(&buffer, &queue);
        buffer.map(&device).unwrap();
        assert!(buffer.is_ready() && !can_write(&buffer, 0..64));
    }

    const NUMBER: ObjectColumn<u32> = ObjectColumn::new("number");

    #[test]
    fn there_is_a_buffer_for_the_objects_and_one_for_each_column() {
        const LIMIT: u64 = 10_000;
        let (device, _) =
            noop_device_with(wgpu::Limits { max_storage_buffer_binding_size: LIMIT + 2, ..wgpu::Limits::default() });
        let columns = [NUMBER.layout()];
        let mut buffers = ObjectBuffers::new(false);
        assert!(buffers.reserve(&device, &columns, 10).unwrap(), "both are new");
        assert!(!buffers.reserve(&device, &columns, 10).unwrap());
        assert_eq!(buffers.sizes().count(), 2);
        let max = LIMIT as usize / size_of::<GpuObject>();
        assert!(buffers.reserve(&device, &columns, max).unwrap());
        // With headroom it is larger than what a shader can bind.
        let bound = buffers.gpu_objects().and_then(|binding| binding.size).map(NonZeroU64::get);
        assert!(buffers.gpu_objects.on_device.size() > LIMIT && bound == Some(LIMIT), "{bound:?}");
        assert!(matches!(buffers.reserve(&device, &columns, max + 1), Err(BackendError::Limit { .. })));
    }

    #[test]
    fn all_buffers_are_mapped_when_the_device_is_done_with_them() {
        let (device, queue) = noop_device();
        let mut buffers = ObjectBuffers::new(true);
        buffers.reserve(&device, &[NUMBER.layout()], 10).unwrap();
        assert!(!buffers.are_ready());
        buffers.unmap();
        queue.submit([]);
        buffers.await_submission(&queue);
        poll(&device, wgpu::PollType::Poll).unwrap();
        assert!(buffers.are_ready());
        buffers.map(&device).unwrap();
        assert!(buffers.all().count() == 2 && buffers.all().all(ObjectBuffer::is_mapped));
    }

    /// The bytes of a buffer.
    fn read(device: &wgpu::Device, queue: &wgpu::Queue, buffer: &wgpu::Buffer) -> Vec<u8> {
        let copy = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: buffer.size(),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
        queue.submit([encoder.finish()]);
        copy.map_async(wgpu::MapMode::Read, .., |_| ());
        poll(device, wgpu::PollType::Poll).unwrap();
        copy.get_mapped_range(..).unwrap().to_vec()
    }

    /// Two blocks and a part of a third one, which are written one after the other. The column's values are so large
    /// that a block takes several staged writes.
    #[test]
    fn each_block_is_written_to_its_place() {
        const LARGE: ObjectColumn<[u32; 2048]> = ObjectColumn::new("large");
        const OBJECTS: usize = 2 * ObjectTable::BLOCK_SIZE + 10;
        let mut scene = Scene::new();
        let vertices = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let vertices = vertices.map(|position| Vertex { position, normal: [0.0, 0.0, 1.0], uv: [0.0; 2] });
        let mesh = Mesh::new("triangle", Topology::TriangleList, vertices.to_vec(), vec![0, 1, 2]).unwrap();
        let (mesh, material) = (scene.add(mesh).unwrap(), scene.add(Material::default()).unwrap());
        for object in 0..OBJECTS {
            scene.add_object(RenderObject::new(mesh, material, DVec3::X * object as f64)).unwrap();
        }
        let values: Vec<_> = (0..OBJECTS as u32).map(|object| [object + 1; 2048]).collect();
        let columns = [LARGE.values(&values)];
        let scene = SceneRef { columns: &columns, ..scene.as_scene_ref() };
        let mut objects = ObjectTable::default();
        objects.begin_frame(&scene);
        objects.describe(&scene, 0..objects.changed_block_count());
        objects.finish();
        let (device, queue) = noop_device();
        for maps_memory in [false, true] {
            let mut buffers = ObjectBuffers::new(maps_memory);
            buffers.reserve(&device, &[LARGE.layout()], OBJECTS).unwrap();
            if maps_memory {
                buffers.unmap();
                queue.submit([]);
                buffers.await_submission(&queue);
                poll(&device, wgpu::PollType::Poll).unwrap();
                buffers.map(&device).unwrap();
            }
            let uploads = CountedQueue::new(queue.clone());
            for block in [1, 2, 0] {
                // Another job may write its own block meanwhile.
                let other = (block > 0).then(|| buffers.columns[0].1.mapped(0..8).unwrap());
                buffers.write(&uploads, &objects, &scene, block..block + 1, 0).unwrap();
                drop(other);
            }
            assert_eq!(uploads.bytes() as usize, OBJECTS * (size_of::<GpuObject>() + LARGE.layout().stride));
            buffers.unmap();
            let written = buffers.all().map(|buffer| read(&device, &queue, buffer.on_device.buffer().unwrap()));
            let [gpu_objects, large] = &written.collect::<Vec<_>>()[..] else { panic!() };
            let mut expected = Vec::new();
            for_each_part(&objects, 0..OBJECTS, &mut |_, bytes| expected.extend_from_slice(bytes));
            assert!(gpu_objects[..expected.len()] == expected, "maps memory: {maps_memory}");
            let expected: &[u8] = bytemuck::cast_slice(&values);
            assert!(large[..expected.len()] == *expected, "maps memory: {maps_memory}");
        }
    }

    #[test]
    fn lists_have_room_for_all_objects_and_do_not_overlap() {
        let (device, _) = noop_device();
        let mut lists = ObjectLists::new();
        assert!(lists.reserve(&device, 3, 1000, SceneLimits::NONE).unwrap());
        let [first, second] = [0..1, 1..2].map(|list| lists.bytes_of(&list));
        assert!(first.len() >= 4000 && first.end <= second.start && second.len() >= 4000, "{first:?} {second:?}");
        assert!(lists.sizes().sum::<u64>() >= 12_000);
    }
}
