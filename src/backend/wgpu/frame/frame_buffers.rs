//! The buffers of one frame in flight, pooled for later frames.

use std::mem;
use std::ops::Range;
use std::sync::Arc;

use parking_lot::{Mutex, RwLock};

use super::material_buffer::MaterialBuffer;
use super::object_buffers::ObjectBuffers;
use super::pass_state::WgpuPassState;
use super::resource_bytes::ResourceBytes;
use crate::backend::subdivision_cache::SubdividedMeshes;
use crate::backend::wgpu::error_scope::poll;
use crate::backend::wgpu::resources::{
    ALIGNMENT, BindGroupLayouts, GrowingBuffer, MaterialSnapshot, MirroredBuffer, SubdividedMesh, UploadQueue,
    append_aligned, check_storage_binding_size, size_with_headroom,
};
use crate::backend::wgpu::timing::Timestamps;
use crate::backend::{BackendError, FrameRequest};
use crate::command::{DrawList, Version};
use crate::process::{Draws, Pass, PlannedProcess, ShaderResource};
use crate::view::GpuView;

/// A pool of frame buffers.
///
/// A frame owns its buffers from `begin` until it is submitted or dropped. Then the next frame may stage writes to them at once,
/// because wgpu orders these after earlier submissions. It may map them when the device is done with them.
pub(crate) struct BufferPool {
    free: Mutex<FreeBuffers>,
    /// Whether objects are written into mapped memory.
    maps_memory: bool,
}

#[derive(Default)]
struct FreeBuffers {
    #[expect(clippy::vec_box, reason = "they move in every frame, and are large")]
    buffers: Vec<Box<Buffers>>,
    /// How often the pool was cleared. Buffers of an earlier generation do not return.
    generation: u64,
}

impl BufferPool {
    /// Buffers that no frame has taken for this many frames lose their bundles and bind groups.
    const MAX_UNUSED_FRAMES: u32 = 8;

    /// Where objects are written into mapped memory, and while the device reads all free buffers, a frame takes new ones if there are
    /// fewer than these.
    const MAX_ROTATING: usize = 3;

    /// An empty pool. `maps_memory`: whether objects are written into mapped memory.
    pub(crate) fn new(maps_memory: bool) -> Self {
        Self { free: Mutex::default(), maps_memory }
    }

    /// The sizes of all pooled buffers in bytes; 0 for one that the device does not have yet.
    pub(crate) fn sizes(&self) -> Vec<u64> {
        let mut sizes = Vec::new();
        for buffers in &self.free.lock().buffers {
            sizes.extend(buffers.all().map(GrowingBuffer::size));
            sizes.extend(buffers.objects.sizes());
            sizes.extend(buffers.bytes.sizes());
            sizes.push(buffers.materials.size());
            sizes.extend(buffers.passes.iter().map(|pass| pass.partial_indices.read().size()));
        }
        sizes
    }

    /// Drops all buffers, and those of frames in flight when these end, because a device error may have left them unusable.
    pub(crate) fn clear(&self) {
        let mut free = self.free.lock();
        free.buffers.clear();
        free.generation += 1;
    }

    /// Takes buffers for a frame, with mapped memory for its objects if the device is done with free buffers.
    ///
    /// # Errors
    /// If the device is lost.
    pub(crate) fn take(self: &Arc<Self>, device: &wgpu::Device) -> Result<FrameBuffers, BackendError> {
        if self.maps_memory {
            // Runs callbacks, which may be the engine's own, so no lock is held meanwhile.
            poll(device, wgpu::PollType::Poll)?;
        }
        let (mut buffers, generation) = self.take_free();
        buffers.objects.map(device)?;
        buffers.unused = 0;
        Ok(FrameBuffers { buffers, pool: Arc::clone(self), generation, held_epoch: 0, objects_epoch: 0 })
    }

    fn take_free(&self) -> (Box<Buffers>, u64) {
        let mut free = self.free.lock();
        // Those that were used last, because they hold the newest objects.
        let ready = free.buffers.iter().rposition(|buffers| buffers.objects.are_ready());
        let taken = match ready {
            Some(index) => Some(free.buffers.remove(index)),
            None if self.maps_memory && free.buffers.len() < Self::MAX_ROTATING => None,
            None => free.buffers.pop(),
        };
        free.buffers.iter_mut().for_each(|idle| idle.unused += 1);
        if self.maps_memory {
            free.buffers.retain(|idle| idle.unused < Self::MAX_UNUSED_FRAMES);
        } else {
            let unused = free.buffers.iter_mut().filter(|idle| idle.unused == Self::MAX_UNUSED_FRAMES);
            unused.for_each(|idle| idle.passes.iter_mut().for_each(WgpuPassState::clear_caches));
        }
        (taken.unwrap_or_else(|| Box::new(Buffers::new(self.maps_memory))), free.generation)
    }
}

/// A frame's buffers. They return to the pool when they are dropped.
pub(crate) struct FrameBuffers {
    buffers: Box<Buffers>,
    pool: Arc<BufferPool>,
    generation: u64,
    /// The epoch of the object table that the buffers held when the frame began; 0 for none.
    held_epoch: u64,
    /// The epoch of the frame's object table.
    objects_epoch: u64,
}

impl Drop for FrameBuffers {
    fn drop(&mut self) {
        // Subdivided meshes must not outlive the frame, however it ends.
        self.buffers.subdivided.get_mut().clear();
        let mut free = self.pool.free.lock();
        if free.generation == self.generation {
            free.buffers.push(mem::replace(&mut self.buffers, Box::new(Buffers::new(false))));
        }
    }
}

impl FrameBuffers {
    /// Makes room for a frame, and uploads its materials, views, lights and parameters. After an error the buffers are unusable.
    ///
    /// # Errors
    /// If the device has no room, or a camera is out of reach.
    pub(crate) fn begin(
        &mut self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        layouts: &BindGroupLayouts,
        materials: &MaterialSnapshot,
        request: &FrameRequest<'_>,
    ) -> Result<(), BackendError> {
        let buffers = &mut *self.buffers;
        // A frame that fails may have written some of its objects. Only its submission confirms that it wrote all.
        self.held_epoch = mem::take(&mut buffers.objects_epoch);
        self.objects_epoch = request.objects.epoch();
        buffers.set_passes(request);
        let limits = device.limits();
        let objects = request.scene.object_count().max(1);
        let light_bytes = request.light_tables.iter().map(|lights| size_of_val(lights.gpu_lights())).max().unwrap_or(0);
        for bytes in [objects * 4, light_bytes] {
            check_storage_binding_size(device, bytes)?;
        }
        write_views(buffers.views.rewrite(), request)?;
        buffers.next_key.passes.clear();
        buffers.next_key.passes.extend(buffers.passes.iter().map(|pass| (pass.pass, pass.command_pass_index)));
        buffers.set_light_ranges(request, limits.max_storage_buffer_binding_size);
        let command_passes = buffers.passes.iter().filter(|pass| pass.command_pass_index.is_some()).count();
        let max_stride =
            limits.max_storage_buffer_binding_size.min(limits.max_buffer_size / command_passes.max(1) as u64);
        let stride = size_with_headroom(buffers.key.object_indices_stride, objects * 4, max_stride);
        buffers.next_key.object_indices_stride = stride;

        let mut reallocated = buffers.objects.reserve(device, request.plan.columns(), objects)?;
        if reallocated {
            self.held_epoch = 0;
        }
        buffers.materials.update(device, uploads, layouts, materials)?;
        let processes = request.plan.processes().iter().zip(request.draws);
        let bytes = processes.map(|(planned, draws)| bytes_of_process(materials, planned, draws));
        buffers.bytes.update(device, uploads, bytes)?;
        reallocated |= buffers.object_indices.reserve(device, command_passes * stride)?;
        for mirrored in [&mut buffers.views, &mut buffers.lights, &mut buffers.parameters] {
            reallocated |= mirrored.upload(device, uploads)?;
        }
        if reallocated || buffers.key != buffers.next_key {
            mem::swap(&mut buffers.key, &mut buffers.next_key);
            for index in 0..buffers.passes.len() {
                let bind_group = buffers.new_frame_bind_group(device, layouts, index);
                let pass = &mut buffers.passes[index];
                pass.frame_bind_group = Some(bind_group);
                *pass.uploaded_list.get_mut() = Version::default();
            }
        }
        Ok(())
    }

    /// Makes room for timestamps of the frame's passes. After an error the buffers are unusable.
    ///
    /// # Errors
    /// If the device has no room.
    pub(crate) fn begin_timestamps(
        &mut self,
        device: &wgpu::Device,
        request: &FrameRequest<'_>,
        times_raw_passes: bool,
    ) -> Result<(), BackendError> {
        let Buffers { timestamps, passes, .. } = &mut *self.buffers;
        let is_timed = |process: usize| times_raw_passes || !matches!(request.draws[process], Draws::Raw(_));
        let mut timed_pass_indices = 0..;
        for pass in passes.iter_mut() {
            pass.timed_pass_index = if is_timed(pass.pass.process_index) { timed_pass_indices.next() } else { None };
        }
        let names =
            passes.iter().filter(|pass| pass.timed_pass_index.is_some()).map(|WgpuPassState { pass, .. }| {
                (request.plan.processes()[pass.process_index].name.as_str(), request.views[pass.view_index].name())
            });
        timestamps.get_or_insert_default().begin_frame(device, names)
    }

    /// `None` if passes are not timed.
    pub(crate) fn timestamps(&self) -> Option<&Timestamps> {
        self.buffers.timestamps.as_ref()
    }

    /// The epoch of the object table that the buffers held when the frame began; 0 for none.
    pub(crate) fn held_epoch(&self) -> u64 {
        self.held_epoch
    }

    /// The frame was submitted, so the buffers hold its objects for the next frame.
    pub(crate) fn keep_objects(&mut self) {
        self.buffers.objects_epoch = self.objects_epoch;
    }

    /// The passes in submission order.
    pub(crate) fn passes(&self) -> &[WgpuPassState] {
        &self.buffers.passes
    }

    /// The passes, and what their bind groups bind.
    pub(crate) fn passes_mut(&mut self) -> (&mut [WgpuPassState], PassResources<'_>) {
        let Buffers { passes, parameters, objects, materials, bytes, .. } = &mut *self.buffers;
        let materials_bind_group = materials.bind_group();
        (passes, PassResources { parameters: &parameters.on_device, objects, bytes, materials_bind_group })
    }

    /// The meshes that the frame draws subdivided.
    pub(crate) fn subdivided(&self) -> &RwLock<SubdividedMeshes<SubdividedMesh>> {
        &self.buffers.subdivided
    }

    /// The buffers of the frame's objects.
    pub(crate) fn objects(&self) -> &ObjectBuffers {
        &self.buffers.objects
    }

    /// The bytes of the engine's own that each process reads.
    pub(crate) fn resource_bytes(&self) -> &ResourceBytes {
        &self.buffers.bytes
    }

    /// `@group(1)`; `None` before the frame begins.
    pub(crate) fn materials_bind_group(&self) -> Option<&wgpu::BindGroup> {
        self.buffers.materials.bind_group()
    }

    /// Uploads what changed in blocks of objects since [`FrameBuffers::held_epoch`].
    ///
    /// # Errors
    /// If wgpu refuses.
    pub(crate) fn write_objects(
        &self,
        uploads: &UploadQueue,
        request: &FrameRequest<'_>,
        blocks: Range<usize>,
    ) -> Result<(), BackendError> {
        self.buffers.objects.write(uploads, request.objects, request.scene, blocks, self.held_epoch)
    }

    /// Uploads the objects that a pass draws, in the order of instances, unless the buffer holds them already.
    pub(crate) fn write_object_indices(&self, uploads: &UploadQueue, pass: usize, list: &DrawList) {
        let state = &self.buffers.passes[pass];
        let Some(index) = state.command_pass_index else { return };
        let mut uploaded = state.uploaded_list.write();
        if list.version() != Version::default() && *uploaded == list.version() {
            return;
        }
        *uploaded = list.version();
        let offset = index * self.buffers.key.object_indices_stride;
        self.buffers.object_indices.write(uploads, offset, bytemuck::cast_slice(&list.objects));
    }
}

/// What the bind groups of passes bind.
pub(crate) struct PassResources<'a> {
    pub(crate) parameters: &'a GrowingBuffer,
    pub(crate) objects: &'a ObjectBuffers,
    pub(crate) bytes: &'a ResourceBytes,
    pub(crate) materials_bind_group: Option<&'a wgpu::BindGroup>,
}

struct Buffers {
    objects: ObjectBuffers,
    materials: MaterialBuffer,
    /// One [`GpuView`] per view.
    views: MirroredBuffer,
    /// The lights that reach each view, relative to its camera.
    lights: MirroredBuffer,
    /// For each pass of commands the objects that it draws, `object_indices_stride` bytes apart.
    object_indices: GrowingBuffer,
    /// Each pass's parameters.
    parameters: MirroredBuffer,
    /// What processes read of the engine's own.
    bytes: ResourceBytes,
    passes: Vec<WgpuPassState>,
    /// The key of the passes' bind groups, and the key of this frame.
    key: BindGroupKey,
    next_key: BindGroupKey,
    subdivided: RwLock<SubdividedMeshes<SubdividedMesh>>,
    timestamps: Option<Timestamps>,
    /// For how many frames no frame has taken them.
    unused: u32,
    /// The epoch of the object table that `objects` holds; 0 for none.
    objects_epoch: u64,
}

/// The key of bind groups, beside the buffers themselves.
#[derive(Default, PartialEq)]
struct BindGroupKey {
    /// Each with its index in `object_indices`.
    passes: Vec<(Pass, Option<usize>)>,
    /// Offset and size of each view's lights in their buffer.
    light_ranges: Vec<(usize, usize)>,
    object_indices_stride: usize,
}

impl Buffers {
    fn new(maps_memory: bool) -> Self {
        use wgpu::BufferUsages;
        Self {
            objects: ObjectBuffers::new(maps_memory),
            materials: MaterialBuffer::new(),
            views: MirroredBuffer::new("views", BufferUsages::UNIFORM),
            lights: MirroredBuffer::new("lights", BufferUsages::STORAGE),
            object_indices: GrowingBuffer::new("object indices", BufferUsages::STORAGE),
            parameters: MirroredBuffer::new("parameters", BufferUsages::UNIFORM),
            bytes: ResourceBytes::default(),
            passes: Vec::new(),
            key: BindGroupKey::default(),
            next_key: BindGroupKey::default(),
            subdivided: RwLock::default(),
            timestamps: None,
            unused: 0,
            objects_epoch: 0,
        }
    }

    /// All but those of objects and materials, and the bytes of the engine's own.
    fn all(&self) -> [&GrowingBuffer; 4] {
        let Self { views, lights, object_indices, parameters, .. } = self;
        [&views.on_device, &lights.on_device, object_indices, &parameters.on_device]
    }

    /// Sets the passes of this frame, and collects their parameters.
    fn set_passes(&mut self, request: &FrameRequest<'_>) {
        let bytes = self.parameters.rewrite();
        self.passes.resize_with(request.passes.len(), WgpuPassState::default);
        let mut command_pass_indices = 0..;
        for (state, &pass) in self.passes.iter_mut().zip(request.passes) {
            let draws = &request.draws[pass.process_index];
            state.set_pass(pass);
            state.set_label(
                request.plan.processes()[pass.process_index].name.as_str(),
                request.views[pass.view_index].name(),
            );
            state.command_pass_index =
                if matches!(draws, Draws::Commands(_)) { command_pass_indices.next() } else { None };
            if state.command_pass_index.is_none() {
                state.clear_partial_indices();
            }
            let parameters = draws.parameters();
            state.parameters = (!parameters.is_empty()).then_some((bytes.len(), parameters.len()));
            append_aligned(bytes, parameters);
        }
    }

    /// Allots each view a range for its lights, and collects them.
    fn set_light_ranges(&mut self, request: &FrameRequest<'_>, max: u64) {
        let bytes = self.lights.rewrite();
        let ranges = &mut self.next_key.light_ranges;
        ranges.clear();
        for (view, lights) in request.light_tables.iter().enumerate() {
            let before = self.key.light_ranges.get(view).map_or(0, |(_, length)| *length);
            // The layout requires a binding even if no light reaches the view.
            let size = size_with_headroom(before, size_of_val(lights.gpu_lights()), max);
            let start = bytes.len();
            bytes.extend_from_slice(bytemuck::cast_slice(lights.gpu_lights()));
            bytes.resize(start + size, 0);
            ranges.push((start, size));
        }
    }

    fn new_frame_bind_group(&self, device: &wgpu::Device, layouts: &BindGroupLayouts, pass: usize) -> wgpu::BindGroup {
        let WgpuPassState { pass: Pass { view_index: view, .. }, command_pass_index, .. } = self.passes[pass];
        // The layout requires a binding even if the pass draws no commands; it reads nothing from it.
        let stride = self.key.object_indices_stride;
        let (offset, size) = command_pass_index.map_or((0, ALIGNMENT), |index| (index * stride, stride));
        let bindings = [
            self.views.on_device.binding(view * ALIGNMENT, size_of::<GpuView>()),
            self.objects.gpu_objects(),
            self.object_indices.binding(offset, size),
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

/// The bytes that a process's shader reads: the values of materials, then resources.
fn bytes_of_process<'a>(
    materials: &'a MaterialSnapshot,
    planned: &'a PlannedProcess,
    draws: &'a Draws<'_>,
) -> impl Iterator<Item = &'a [u8]> {
    let of_materials = planned.declaration.material_types.iter().filter_map(|layout| materials.values(*layout));
    of_materials.chain(draws.resources().iter().filter_map(ShaderResource::bytes))
}

/// Appends the views' GPU layouts.
///
/// # Errors
/// If a camera is out of reach.
fn write_views(bytes: &mut Vec<u8>, request: &FrameRequest<'_>) -> Result<(), BackendError> {
    for (view, lights) in request.views.iter().zip(request.light_tables) {
        let record = GpuView::new(view, request.scene, lights.light_count())
            .ok_or_else(|| BackendError::ViewOutOfReach { view: view.name().to_owned() })?;
        append_aligned(bytes, bytemuck::bytes_of(&record));
    }
    Ok(())
}
