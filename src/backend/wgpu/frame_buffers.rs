//! The buffers of one frame on its way, and what is kept with them until the next.

use std::mem;
use std::num::NonZeroU64;
use std::ops::Range;
use std::sync::Arc;

use parking_lot::{Mutex, RwLock};

use super::frame_pass::FramePass;
use super::growing_buffer::{ALIGNMENT, GrowingBuffer, MirroredBuffer, append_aligned, check_storage, roomy};
use super::layouts::Layouts;
use super::subdivided_mesh::SubdividedMesh;
use super::timestamps::Timestamps;
use super::uploads::Uploads;
use crate::backend::subdivisions::SubdividedMeshes;
use crate::backend::{BackendError, FrameRequest};
use crate::process::{Draws, Pass};
use crate::view::{GpuObject, GpuView, ObjectTable};

/// Buffers that no frame uses at present.
///
/// A frame has its buffers for itself from `begin` until it was submitted, or dropped. After that the next frame may write
/// them at once: wgpu puts those writes behind what was submitted before.
#[derive(Default)]
pub(super) struct BufferPool {
    free: Mutex<Free>,
}

#[derive(Default)]
struct Free {
    buffers: Vec<Buffers>,
    /// How often everything was forgotten. What was lent before does not come back.
    generation: u64,
}

impl BufferPool {
    /// For so many frames the pool keeps bundles and bindings of buffers that no frame has taken.
    const KEPT_UNUSED: u32 = 8;

    /// The bytes of all buffers that no frame uses.
    pub(super) fn bytes(&self) -> u64 {
        let of_passes = |buffers: &Buffers| buffers.passes.iter().map(|pass| pass.indices.read().size()).sum::<u64>();
        let of = |buffers: &Buffers| buffers.all().map(GrowingBuffer::size).iter().sum::<u64>() + of_passes(buffers);
        self.free.lock().buffers.iter().map(of).sum()
    }

    /// Drops everything, and what frames on their way have when they end, because a device error may have left it unusable.
    pub(super) fn forget(&self) {
        let mut free = self.free.lock();
        free.buffers.clear();
        free.generation += 1;
    }

    pub(super) fn take(self: &Arc<Self>) -> FrameBuffers {
        let mut free = self.free.lock();
        let mut buffers = free.buffers.pop().unwrap_or_default();
        buffers.unused = 0;
        for idle in &mut free.buffers {
            idle.unused += 1;
            if idle.unused == Self::KEPT_UNUSED {
                idle.passes.iter_mut().for_each(FramePass::forget);
            }
        }
        FrameBuffers { buffers, pool: Arc::clone(self), generation: free.generation }
    }
}

/// A frame's buffers, which return to the pool when they are dropped.
pub(super) struct FrameBuffers {
    buffers: Buffers,
    pool: Arc<BufferPool>,
    generation: u64,
}

impl Drop for FrameBuffers {
    fn drop(&mut self) {
        // The frame may have ended early, or late. What it has subdivided is not to outlive it.
        self.buffers.subdivided.get_mut().clear();
        let mut free = self.pool.free.lock();
        if free.generation == self.generation {
            free.buffers.push(mem::take(&mut self.buffers));
        }
    }
}

impl FrameBuffers {
    /// Makes room for a frame, and uploads its views, lights and parameters.
    ///
    /// # Errors
    /// If the device has no room, or a camera is out of reach. Then they are not to be used any more.
    pub(super) fn begin(
        &mut self,
        device: &wgpu::Device,
        uploads: &Uploads,
        layouts: &Layouts,
        request: &FrameRequest<'_>,
    ) -> Result<(), BackendError> {
        let buffers = &mut self.buffers;
        buffers.set_passes(request);
        let limits = device.limits();
        let objects = request.scene.object_count().max(1);
        let object_bytes = objects * size_of::<GpuObject>();
        let longest = request.lights.iter().map(|lights| size_of_val(lights.gpu_lights())).max().unwrap_or(0);
        for bytes in [object_bytes, objects * 4, longest] {
            check_storage(device, bytes)?;
        }
        write_views(buffers.views.rewrite(), request)?;
        buffers.next_key.passes.clear();
        buffers.next_key.passes.extend(buffers.passes.iter().map(|pass| (pass.pass, pass.drawn_place)));
        buffers.set_light_ranges(request, limits.max_storage_buffer_binding_size);
        let drawn_count = buffers.passes.iter().filter(|pass| pass.drawn_place.is_some()).count();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size / drawn_count.max(1) as u64);
        let stride = roomy(buffers.key.drawn_stride, objects * 4, most);
        buffers.next_key.drawn_stride = stride;

        let mut renewed = buffers.objects.reserve(device, object_bytes)?;
        renewed |= buffers.drawn.reserve(device, drawn_count * stride)?;
        for mirrored in [&mut buffers.views, &mut buffers.lights, &mut buffers.parameters] {
            renewed |= mirrored.upload(device, uploads)?;
        }
        if renewed || buffers.key != buffers.next_key {
            mem::swap(&mut buffers.key, &mut buffers.next_key);
            let objects_bound = buffers.objects.size().min(limits.max_storage_buffer_binding_size & !3) as usize;
            for index in 0..buffers.passes.len() {
                buffers.passes[index].frame_group = Some(buffers.group(device, layouts, index, objects_bound));
            }
        }
        Ok(())
    }

    /// Has the frame's passes timed.
    ///
    /// # Errors
    /// If the device has no room. Then they are not to be used any more.
    pub(super) fn begin_timestamps(
        &mut self,
        device: &wgpu::Device,
        request: &FrameRequest<'_>,
        times_raw: bool,
    ) -> Result<(), BackendError> {
        let Buffers { timestamps, passes, .. } = &mut self.buffers;
        timestamps.get_or_insert_default().begin(device, request, passes, times_raw)
    }

    /// `None` where passes are not timed.
    pub(super) fn timestamps(&self) -> Option<&Timestamps> {
        self.buffers.timestamps.as_ref()
    }

    /// The passes in the order they are submitted.
    pub(super) fn passes(&self) -> &[FramePass] {
        &self.buffers.passes
    }

    /// The same, with the buffer of parameters.
    pub(super) fn passes_mut(&mut self) -> (&mut [FramePass], &GrowingBuffer) {
        (&mut self.buffers.passes, &self.buffers.parameters.on_device)
    }

    /// The meshes that the frame draws subdivided.
    pub(super) fn subdivided(&self) -> &RwLock<SubdividedMeshes<SubdividedMesh>> {
        &self.buffers.subdivided
    }

    /// Uploads blocks of objects at once: every write costs the same again, however small.
    pub(super) fn write_objects(&self, uploads: &Uploads, objects: &ObjectTable, blocks: Range<usize>) {
        let first = blocks.start * ObjectTable::BLOCK_SIZE;
        let end = objects.len().min(blocks.end * ObjectTable::BLOCK_SIZE);
        let bytes = |objects: usize| objects * size_of::<GpuObject>();
        let size = NonZeroU64::new(bytes(end - first) as u64);
        let Some((buffer, size)) = self.buffers.objects.buffer().zip(size) else { return };
        let Some(mut staged) = uploads.write_buffer_with(buffer, bytes(first) as u64, size) else { return };
        for block in blocks {
            let (start, records) = objects.gpu_objects(block);
            let place = bytes(start - first)..bytes(start - first + records.len());
            staged.slice(place).copy_from_slice(bytemuck::cast_slice(&records));
        }
    }

    pub(super) fn write_drawn(&self, uploads: &Uploads, pass: usize, objects: &[u32]) {
        if let Some(place) = self.buffers.passes[pass].drawn_place {
            self.buffers.drawn.write(uploads, place * self.buffers.key.drawn_stride, bytemuck::cast_slice(objects));
        }
    }
}

struct Buffers {
    objects: GrowingBuffer,
    /// A [`GpuView`] a view.
    views: MirroredBuffer,
    /// The lights that reach each view, relative to its camera.
    lights: MirroredBuffer,
    /// For each pass of commands, which objects it draws; `drawn_stride` bytes apart.
    drawn: GrowingBuffer,
    /// Each pass's parameters.
    parameters: MirroredBuffer,
    passes: Vec<FramePass>,
    /// What the passes' bind groups were made for, and what this frame's are to be for.
    key: GroupsKey,
    next_key: GroupsKey,
    subdivided: RwLock<SubdividedMeshes<SubdividedMesh>>,
    timestamps: Option<Timestamps>,
    /// How many frames went by that had others.
    unused: u32,
}

/// What bind groups depend on, beside the buffers themselves.
#[derive(Default, PartialEq)]
struct GroupsKey {
    /// Each with its place in `drawn`.
    passes: Vec<(Pass, Option<usize>)>,
    /// Each view's place and length in the buffer of lights.
    light_ranges: Vec<(usize, usize)>,
    drawn_stride: usize,
}

impl Default for Buffers {
    fn default() -> Self {
        use wgpu::BufferUsages;
        Self {
            objects: GrowingBuffer::new("objects", BufferUsages::STORAGE),
            views: MirroredBuffer::new("views", BufferUsages::UNIFORM),
            lights: MirroredBuffer::new("lights", BufferUsages::STORAGE),
            drawn: GrowingBuffer::new("drawn objects", BufferUsages::STORAGE),
            parameters: MirroredBuffer::new("parameters", BufferUsages::UNIFORM),
            passes: Vec::new(),
            key: GroupsKey::default(),
            next_key: GroupsKey::default(),
            subdivided: RwLock::default(),
            timestamps: None,
            unused: 0,
        }
    }
}

impl Buffers {
    fn all(&self) -> [&GrowingBuffer; 5] {
        let Self { objects, views, lights, drawn, parameters, .. } = self;
        [objects, &views.on_device, &lights.on_device, drawn, &parameters.on_device]
    }

    /// Makes the passes those of this frame, and collects their parameters.
    fn set_passes(&mut self, request: &FrameRequest<'_>) {
        let bytes = self.parameters.rewrite();
        self.passes.resize_with(request.passes.len(), FramePass::default);
        let mut drawn_places = 0..;
        for (kept, &pass) in self.passes.iter_mut().zip(request.passes) {
            let draws = &request.draws[pass.process];
            kept.pass = pass;
            kept.set_label(request.plan.processes()[pass.process].process.name(), request.views[pass.view].name());
            kept.drawn_place = if matches!(draws, Draws::Commands(_)) { drawn_places.next() } else { None };
            if kept.drawn_place.is_none() {
                kept.forget_indices();
            }
            let parameters = draws.parameters();
            kept.parameters = (!parameters.is_empty()).then_some((bytes.len(), parameters.len()));
            append_aligned(bytes, parameters);
        }
    }

    /// Gives each view room for its lights, and collects them.
    fn set_light_ranges(&mut self, request: &FrameRequest<'_>, most: u64) {
        let bytes = self.lights.rewrite();
        let ranges = &mut self.next_key.light_ranges;
        ranges.clear();
        for (view, lights) in request.lights.iter().enumerate() {
            let before = self.key.light_ranges.get(view).map_or(0, |(_, length)| *length);
            // A view that no light reaches reads nothing there, but its layout has the binding.
            let room = roomy(before, size_of_val(lights.gpu_lights()), most);
            let start = bytes.len();
            bytes.extend_from_slice(bytemuck::cast_slice(lights.gpu_lights()));
            bytes.resize(start + room, 0);
            ranges.push((start, room));
        }
    }

    fn group(&self, device: &wgpu::Device, layouts: &Layouts, pass: usize, objects_bound: usize) -> wgpu::BindGroup {
        let FramePass { pass: Pass { view, .. }, drawn_place, .. } = self.passes[pass];
        // A pass without commands reads nothing there, but its layout has the binding: any part will do.
        let stride = self.key.drawn_stride;
        let drawn = drawn_place.map_or((0, ALIGNMENT), |place| (place * stride, stride));
        let bindings = [
            self.views.on_device.binding(view * ALIGNMENT, size_of::<GpuView>()),
            self.objects.binding(0, objects_bound),
            self.drawn.binding(drawn.0, drawn.1),
            self.lights.on_device.binding(self.key.light_ranges[view].0, self.key.light_ranges[view].1),
        ];
        let entries: Vec<_> = (0..)
            .zip(bindings.into_iter().flatten())
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: wgpu::BindingResource::Buffer(buffer) })
            .collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("frame"),
            layout: &layouts.frame,
            entries: &entries,
        })
    }
}

/// # Errors
/// If a camera is out of reach.
fn write_views(bytes: &mut Vec<u8>, request: &FrameRequest<'_>) -> Result<(), BackendError> {
    for (view, lights) in request.views.iter().zip(request.lights) {
        let record = GpuView::new(view, request.scene, lights.gpu_lights().len())
            .ok_or_else(|| BackendError::ViewOutOfReach { view: view.name().to_owned() })?;
        append_aligned(bytes, bytemuck::bytes_of(&record));
    }
    Ok(())
}
