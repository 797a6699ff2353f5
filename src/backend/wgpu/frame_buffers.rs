//! The buffers of one frame on its way.

use std::mem;
use std::sync::Arc;

use parking_lot::Mutex;

use super::arena::new_buffer;
use super::layouts::Layouts;
use crate::backend::{BackendError, FrameRequest};
use crate::process::{Draws, Pass};
use crate::view::{LightTable, ObjectRecord, ViewRecord};

/// Buffers that no frame uses at present.
///
/// A frame has its buffers for itself from `begin` until it was submitted, or dropped. After that the next frame may write
/// them at once: wgpu puts those writes behind what was submitted before.
#[derive(Default)]
pub(super) struct BufferPool {
    free: Mutex<Vec<Buffers>>,
}

impl BufferPool {
    /// The bytes of all buffers that no frame uses.
    pub(super) fn bytes(&self) -> u64 {
        let size = |buffer: &GrowingBuffer| buffer.buffer.as_ref().map_or(0, wgpu::Buffer::size);
        self.free.lock().iter().flat_map(|buffers| buffers.all().map(size)).sum()
    }

    /// Drops what is free, because a device error may have left it unusable.
    pub(super) fn forget(&self) {
        self.free.lock().clear();
    }

    pub(super) fn take(self: &Arc<Self>) -> FrameBuffers {
        let buffers = self.free.lock().pop().unwrap_or_default();
        FrameBuffers { buffers, pool: Arc::clone(self) }
    }
}

/// A frame's buffers, which return to the pool when they are dropped.
pub(super) struct FrameBuffers {
    buffers: Buffers,
    pool: Arc<BufferPool>,
}

impl Drop for FrameBuffers {
    fn drop(&mut self) {
        self.pool.free.lock().push(mem::take(&mut self.buffers));
    }
}

impl FrameBuffers {
    /// Makes room for a frame, and uploads its views, lights and parameters.
    ///
    /// # Errors
    /// If the device has no room, or a camera is out of reach.
    pub(super) fn begin(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        layouts: &Layouts,
        request: &FrameRequest<'_>,
    ) -> Result<(), BackendError> {
        let views = view_bytes(request)?;
        let (lights, light_ranges) = light_bytes(request);
        let (parameters, parameter_ranges) = parameter_bytes(request.passes, request.draws);
        let objects = request.scene.object_count().max(1);
        let drawn_stride = aligned(objects * 4);
        let drawn_places = drawn_places(request);
        let drawn_count = drawn_places.iter().flatten().count();

        let longest = light_ranges.iter().map(|(_, bytes)| *bytes).max().unwrap_or(0);
        for bytes in [objects * size_of::<ObjectRecord>(), drawn_stride, longest] {
            check_storage(device, bytes)?;
        }
        let buffers = &mut self.buffers;
        let sizes = [
            objects * size_of::<ObjectRecord>(),
            views.len(),
            lights.len(),
            drawn_count * drawn_stride,
            parameters.len(),
        ];
        // If this ends early, what the groups were made for is forgotten, and so are they.
        let groups_key = buffers.groups_key.take();
        let mut renewed = false;
        for (buffer, size) in buffers.all_mut().into_iter().zip(sizes) {
            renewed |= buffer.reserve(device, size)?;
        }
        buffers.views.write(queue, 0, &views);
        buffers.lights.write(queue, 0, &lights);
        buffers.parameters.write(queue, 0, &parameters);

        let passes = request.passes.iter().copied().zip(drawn_places.iter().copied()).collect();
        let key = GroupsKey { passes, objects, light_ranges, drawn_stride };
        if renewed || groups_key.as_ref() != Some(&key) {
            buffers.groups = (0..request.passes.len()).map(|pass| buffers.group(device, layouts, &key, pass)).collect();
        }
        buffers.groups_key = Some(key);
        buffers.drawn_stride = drawn_stride;
        buffers.drawn_places = drawn_places;
        buffers.parameter_ranges = parameter_ranges;
        Ok(())
    }

    /// `@group(0)` of a pass.
    pub(super) fn group(&self, pass: usize) -> &wgpu::BindGroup {
        &self.buffers.groups[pass]
    }

    /// A pass's parameters; `None` where it has none.
    pub(super) fn parameters(&self, pass: usize) -> Option<wgpu::BufferBinding<'_>> {
        let (offset, length) = self.buffers.parameter_ranges[pass]?;
        self.buffers.parameters.binding(offset, length)
    }

    pub(super) fn write_objects(&self, queue: &wgpu::Queue, first: usize, records: &[ObjectRecord]) {
        self.buffers.objects.write(queue, first * size_of::<ObjectRecord>(), bytemuck::cast_slice(records));
    }

    pub(super) fn write_drawn(&self, queue: &wgpu::Queue, pass: usize, objects: &[u32]) {
        if let Some(place) = self.buffers.drawn_places[pass] {
            self.buffers.drawn.write(queue, place * self.buffers.drawn_stride, bytemuck::cast_slice(objects));
        }
    }
}

struct Buffers {
    objects: GrowingBuffer,
    /// A [`ViewRecord`] a view.
    views: GrowingBuffer,
    /// The lights that reach each view, relative to its camera.
    lights: GrowingBuffer,
    /// For each pass of commands, which objects it draws; `drawn_stride` bytes apart.
    drawn: GrowingBuffer,
    drawn_stride: usize,
    /// For each pass, its place in `drawn`; none for a pass without commands.
    drawn_places: Vec<Option<usize>>,
    /// Each pass's parameters, and where in the buffer they are.
    parameters: GrowingBuffer,
    parameter_ranges: Vec<Option<(usize, usize)>>,
    /// `@group(0)` of each pass, and what it was made for.
    groups: Vec<wgpu::BindGroup>,
    groups_key: Option<GroupsKey>,
}

/// What bind groups depend on, beside the buffers themselves.
#[derive(PartialEq)]
struct GroupsKey {
    /// Each with its place in `drawn`.
    passes: Vec<(Pass, Option<usize>)>,
    objects: usize,
    /// Each view's place and length in the buffer of lights.
    light_ranges: Vec<(usize, usize)>,
    drawn_stride: usize,
}

impl Default for Buffers {
    fn default() -> Self {
        let storage = |label| GrowingBuffer::new(label, wgpu::BufferUsages::STORAGE);
        let uniform = |label| GrowingBuffer::new(label, wgpu::BufferUsages::UNIFORM);
        Self {
            objects: storage("objects"),
            views: uniform("views"),
            lights: storage("lights"),
            drawn: storage("drawn objects"),
            drawn_stride: 0,
            drawn_places: Vec::new(),
            parameters: uniform("parameters"),
            parameter_ranges: Vec::new(),
            groups: Vec::new(),
            groups_key: None,
        }
    }
}

impl Buffers {
    fn all(&self) -> [&GrowingBuffer; 5] {
        [&self.objects, &self.views, &self.lights, &self.drawn, &self.parameters]
    }

    fn all_mut(&mut self) -> [&mut GrowingBuffer; 5] {
        [&mut self.objects, &mut self.views, &mut self.lights, &mut self.drawn, &mut self.parameters]
    }

    fn group(&self, device: &wgpu::Device, layouts: &Layouts, key: &GroupsKey, pass: usize) -> wgpu::BindGroup {
        let (Pass { view, .. }, drawn_place) = key.passes[pass];
        // A pass without commands reads nothing there, but its layout has the binding: any part will do.
        let drawn = drawn_place.map_or((0, ALIGNMENT), |place| (place * key.drawn_stride, key.drawn_stride));
        let bindings = [
            self.views.binding(view * ALIGNMENT, size_of::<ViewRecord>()),
            self.objects.binding(0, key.objects * size_of::<ObjectRecord>()),
            self.drawn.binding(drawn.0, drawn.1),
            self.lights.binding(key.light_ranges[view].0, key.light_ranges[view].1),
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

/// A buffer that is replaced by a larger one when it is too small.
struct GrowingBuffer {
    label: &'static str,
    usage: wgpu::BufferUsages,
    buffer: Option<wgpu::Buffer>,
}

impl GrowingBuffer {
    fn new(label: &'static str, usage: wgpu::BufferUsages) -> Self {
        Self { label, usage: usage | wgpu::BufferUsages::COPY_DST, buffer: None }
    }

    /// Makes room for `bytes`, and says whether that took another buffer.
    fn reserve(&mut self, device: &wgpu::Device, bytes: usize) -> Result<bool, BackendError> {
        let needed = (bytes as u64).max(ALIGNMENT as u64);
        if self.buffer.as_ref().is_some_and(|buffer| buffer.size() >= needed) {
            return Ok(false);
        }
        // Half as much again, so that a scene that grows by one object a frame does not move every frame.
        let size = (needed + needed / 2).min(device.limits().max_buffer_size & !3).max(needed);
        self.buffer = Some(new_buffer(device, self.label, size, self.usage)?);
        Ok(true)
    }

    fn write(&self, queue: &wgpu::Queue, offset: usize, bytes: &[u8]) {
        if let Some(buffer) = self.buffer.as_ref().filter(|_| !bytes.is_empty()) {
            queue.write_buffer(buffer, offset as u64, bytes);
        }
    }

    /// A part of the buffer; `None` before [`GrowingBuffer::reserve`].
    fn binding(&self, offset: usize, bytes: usize) -> Option<wgpu::BufferBinding<'_>> {
        let size = std::num::NonZeroU64::new(bytes as u64);
        self.buffer.as_ref().map(|buffer| wgpu::BufferBinding { buffer, offset: offset as u64, size })
    }
}

/// # Errors
/// If a shader on this device cannot read a storage buffer of that many bytes.
pub(super) fn check_storage(device: &wgpu::Device, bytes: usize) -> Result<(), BackendError> {
    let (allowed, needed) = (device.limits().max_storage_buffer_binding_size, bytes as u64);
    if needed > allowed {
        return Err(BackendError::Limit { limit: "max_storage_buffer_binding_size", allowed, needed });
    }
    Ok(())
}

/// Every device takes multiples of this as offsets into uniform and storage buffers.
const ALIGNMENT: usize = 256;

fn aligned(bytes: usize) -> usize {
    bytes.max(1).next_multiple_of(ALIGNMENT)
}

fn view_bytes(request: &FrameRequest<'_>) -> Result<Vec<u8>, BackendError> {
    let mut bytes = Vec::with_capacity(request.views.len() * ALIGNMENT);
    for (view, lights) in request.views.iter().zip(request.lights) {
        let record = ViewRecord::new(view, request.scene, lights.records().len())
            .ok_or_else(|| BackendError::ViewOutOfReach { view: view.name().to_owned() })?;
        append_aligned(&mut bytes, bytemuck::bytes_of(&record));
    }
    Ok(bytes)
}

fn light_bytes(request: &FrameRequest<'_>) -> (Vec<u8>, Vec<(usize, usize)>) {
    let mut bytes = Vec::new();
    let append = |lights: &LightTable| {
        let offset = bytes.len();
        append_aligned(&mut bytes, bytemuck::cast_slice(lights.records()));
        // A view that no light reaches reads nothing there, but its layout has the binding.
        bytes.resize(bytes.len().max(offset + ALIGNMENT), 0);
        (offset, bytes.len() - offset)
    };
    let ranges = request.lights.iter().map(append).collect();
    (bytes, ranges)
}

fn parameter_bytes(passes: &[Pass], draws: &[Draws<'_>]) -> (Vec<u8>, Vec<Option<(usize, usize)>>) {
    let mut bytes = Vec::new();
    let mut append = |pass: &Pass| {
        let parameters = draws[pass.process].parameters();
        let offset = bytes.len();
        append_aligned(&mut bytes, parameters);
        (!parameters.is_empty()).then_some((offset, parameters.len()))
    };
    let ranges = passes.iter().map(&mut append).collect();
    (bytes, ranges)
}

fn drawn_places(request: &FrameRequest<'_>) -> Vec<Option<usize>> {
    let mut next = 0..;
    let of_pass = |pass: &Pass| match request.draws[pass.process] {
        Draws::Commands(_) => next.next(),
        _ => None,
    };
    request.passes.iter().map(of_pass).collect()
}

fn append_aligned(bytes: &mut Vec<u8>, more: &[u8]) {
    bytes.extend_from_slice(more);
    bytes.resize(bytes.len().next_multiple_of(ALIGNMENT), 0);
}
