//! The buffers of one frame in flight, pooled for later frames.

use std::collections::HashMap;
use std::mem;
use std::ops::Range;
use std::sync::Arc;

use parking_lot::{Mutex, RwLock};

use super::allotment::allot;
use super::item_data::ItemData;
use super::material_buffer::MaterialBuffer;
use super::object_buffers::{ObjectBuffers, ObjectLists};
use super::pass_state::{FrameRanges, PassId, WgpuPassState};
use super::previous_objects::{Contents, PreviousObjects};
use super::resource_bytes::ResourceBytes;
use crate::backend::subdivision_cache::SubdividedMeshes;
use crate::backend::wgpu::error_scope::poll;
use crate::backend::wgpu::resources::{
    ALIGNMENT, BindGroupLayouts, CountedQueue, GrowingBuffer, MaterialSnapshot, MirroredBuffer, SubdividedMesh,
    check_storage_binding_size, size_with_headroom,
};
use crate::backend::wgpu::timing::Timestamps;
use crate::backend::{BackendError, FrameRequest};
use crate::command::{DrawList, Version};
use crate::process::{Draws, Pass, PlannedProcess, ShaderResource};
use crate::scene::PREVIOUS_OBJECTS;
use crate::view::{GpuView, PerView};

/// A pool of frame buffers.
///
/// A frame owns its buffers from `begin` until it is submitted or dropped. Then the next frame may stage writes to them
/// at once, because wgpu orders these after earlier submissions. It may map them when the device is done with them.
pub(crate) struct BufferPool {
    free: Mutex<FreeBuffers>,
    previous_objects: Mutex<PreviousObjects>,
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

    /// Where objects are written into mapped memory, and while the device reads all free buffers, a frame takes new
    /// ones if there are fewer than these.
    const MAX_ROTATING: usize = 3;

    /// An empty pool. `maps_memory`: whether objects are written into mapped memory.
    pub(crate) fn new(maps_memory: bool) -> Self {
        Self { free: Mutex::default(), previous_objects: Mutex::new(PreviousObjects::new()), maps_memory }
    }

    /// The sizes of all pooled buffers in bytes; 0 for one that the device does not have yet.
    pub(crate) fn sizes(&self) -> Vec<u64> {
        let mut sizes = vec![self.previous_objects.lock().size()];
        for buffers in &self.free.lock().buffers {
            sizes.extend(buffers.all().map(GrowingBuffer::size));
            sizes.extend(buffers.objects.sizes());
            sizes.extend(buffers.object_lists.sizes());
            sizes.extend(buffers.bytes.sizes());
            sizes.extend(buffers.item_data.sizes());
            sizes.push(buffers.materials.size());
            sizes.extend(buffers.passes.iter().map(|pass| pass.partial_indices.read().size()));
        }
        sizes
    }

    /// Drops all buffers, and those of frames in flight when these end, because a device error may have left them
    /// unusable.
    pub(crate) fn clear(&self) {
        let mut free = self.free.lock();
        free.buffers.clear();
        free.generation += 1;
        *self.previous_objects.lock() = PreviousObjects::new();
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
        Ok(FrameBuffers { buffers, pool: Arc::clone(self), generation, held_epoch: 0, objects: Contents::default() })
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
    /// The frame's objects.
    objects: Contents,
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
    /// Makes room for a frame, and uploads its materials, views, lights and parameters. After an error the buffers are
    /// unusable.
    ///
    /// # Errors
    /// If the device has no room, or a camera is out of reach.
    pub(crate) fn begin(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        layouts: &BindGroupLayouts,
        materials: &MaterialSnapshot,
        request: &FrameRequest<'_>,
    ) -> Result<(), BackendError> {
        let buffers = &mut *self.buffers;
        // A frame that fails may have written some of its objects. Only its submission confirms that it wrote all.
        self.held_epoch = mem::take(&mut buffers.objects_epoch);
        self.objects = Contents { objects: request.objects.len(), epoch: request.objects.epoch() };
        buffers.set_passes(request);
        let objects = request.objects.len().max(1);
        let listed = request.list_capacity.max(1);
        let light_bytes = request.light_tables.iter().map(|lights| size_of_val(lights.gpu_lights())).max().unwrap_or(0);
        for bytes in [listed * size_of::<u32>(), light_bytes] {
            check_storage_binding_size(device, bytes)?;
        }
        buffers.set_views(request)?;
        let lists = buffers.allot_object_lists(ObjectLists::max_in_one_buffer(listed, request.limits));

        let mut reallocated = buffers.objects.reserve(device, request.plan.columns(), objects)?;
        if reallocated {
            self.held_epoch = 0;
        }
        let reads_previous = request.plan.columns().contains(&PREVIOUS_OBJECTS.layout());
        let previous = reads_previous.then(|| self.pool.previous_objects.lock().reserve(device, objects));
        buffers.objects.previous = previous.transpose()?.flatten();
        buffers.materials.update(device, uploads, layouts, materials)?;
        let processes = request.plan.processes().iter().zip(request.draws);
        let bytes = processes.map(|(planned, draws)| bytes_of_process(materials, planned, draws));
        buffers.bytes.update(device, uploads, bytes)?;
        buffers.item_data.update(device, uploads, request)?;
        let lost_lists = buffers.object_lists.reserve(device, lists, listed, request.limits)?;
        reallocated |= lost_lists;
        for mirrored in [&mut buffers.views, &mut buffers.lights] {
            reallocated |= mirrored.upload(device, uploads)?;
        }
        // The bind groups of processes compare their buffer.
        buffers.parameters.upload(device, uploads)?;
        for index in 0..buffers.passes.len() {
            let ranges = buffers.frame_ranges(index);
            let before = &buffers.passes[index];
            let is_bound = before.frame_bind_group.is_some() && before.frame_ranges == ranges;
            let has_list = !lost_lists && before.frame_ranges.object_indices == ranges.object_indices;
            if is_bound && !reallocated {
                continue;
            }
            let bind_group = buffers.new_frame_bind_group(device, layouts, &ranges);
            let pass = &mut buffers.passes[index];
            pass.frame_bind_group = Some(bind_group);
            pass.frame_ranges = ranges;
            if !has_list {
                *pass.uploaded_lists.get_mut() = [Version::default(); 2];
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

    /// What the frame copies before its passes and behind them, for processes that read its objects in the next frame.
    ///
    /// # Errors
    /// If wgpu refuses.
    pub(crate) fn copies_of_objects(
        &self,
        device: &wgpu::Device,
    ) -> Result<[Option<wgpu::CommandBuffer>; 2], BackendError> {
        let objects = &self.buffers.objects;
        match objects.gpu_objects_buffer().zip(objects.previous.as_ref()) {
            Some((source, bound)) => self.pool.previous_objects.lock().copies(device, source, self.objects, bound),
            None => Ok([None, None]),
        }
    }

    /// The frame was submitted, so the buffers hold its objects for the next frame.
    pub(crate) fn keep_objects(&mut self) {
        self.buffers.objects_epoch = self.objects.epoch;
        let mut previous_objects = self.pool.previous_objects.lock();
        match self.buffers.objects.previous {
            Some(_) => previous_objects.set_held(self.objects),
            None if previous_objects.size() > 0 => *previous_objects = PreviousObjects::new(),
            None => {}
        }
    }

    /// The passes in submission order.
    pub(crate) fn passes(&self) -> &[WgpuPassState] {
        &self.buffers.passes
    }

    /// The passes, and what their bind groups bind.
    pub(crate) fn passes_mut(&mut self) -> (&mut [WgpuPassState], PassResources<'_>) {
        let Buffers { passes, parameters, objects, materials, bytes, item_data, .. } = &mut *self.buffers;
        let materials_bind_groups = materials.bind_groups();
        (passes, PassResources { parameters: &parameters.on_device, objects, bytes, item_data, materials_bind_groups })
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

    /// The data of items.
    pub(crate) fn item_data(&self) -> &ItemData {
        &self.buffers.item_data
    }

    /// `@group(1)` for each set of textures; none before the frame begins.
    pub(crate) fn materials_bind_groups(&self) -> &[wgpu::BindGroup] {
        self.buffers.materials.bind_groups()
    }

    /// Uploads what changed in blocks of objects since [`FrameBuffers::held_epoch`].
    ///
    /// # Errors
    /// If wgpu refuses.
    pub(crate) fn write_objects(
        &self,
        uploads: &CountedQueue,
        request: &FrameRequest<'_>,
        blocks: Range<usize>,
    ) -> Result<(), BackendError> {
        self.buffers.objects.write(uploads, request.objects, request.scene, blocks, self.held_epoch)
    }

    /// Uploads the objects that a pass draws, in the order of instances, unless the buffer holds them already.
    pub(crate) fn write_object_indices(&self, uploads: &CountedQueue, pass: usize, list: &DrawList) {
        let state = &self.buffers.passes[pass];
        if !state.draws_commands {
            return;
        }
        let mut uploaded = state.uploaded_lists.write();
        let start = state.frame_ranges.object_indices.start;
        let parts =
            [(list.static_groups().version(), 0..list.own_objects().start), (list.version(), list.own_objects())];
        for (uploaded, (version, objects)) in uploaded.iter_mut().zip(parts) {
            if version == Version::default() || *uploaded != version {
                *uploaded = version;
                if objects.is_empty() {
                    continue;
                }
                let bytes = bytemuck::cast_slice(&list.objects[objects.clone()]);
                self.buffers.object_lists.write(uploads, start, objects.start * size_of::<u32>(), bytes);
            }
        }
    }
}

/// What the bind groups of passes bind.
pub(crate) struct PassResources<'a> {
    pub(crate) parameters: &'a GrowingBuffer,
    pub(crate) objects: &'a ObjectBuffers,
    pub(crate) bytes: &'a ResourceBytes,
    pub(crate) item_data: &'a ItemData,
    pub(crate) materials_bind_groups: &'a Arc<[wgpu::BindGroup]>,
}

struct Buffers {
    objects: ObjectBuffers,
    materials: MaterialBuffer,
    /// One [`GpuView`] per view.
    views: MirroredBuffer,
    /// The lights that reach each view, relative to its camera.
    lights: MirroredBuffer,
    /// For each pass of commands the objects that it draws.
    object_lists: ObjectLists,
    /// Each pass's parameters.
    parameters: MirroredBuffer,
    /// What processes read of the engine's own.
    bytes: ResourceBytes,
    item_data: ItemData,
    passes: Vec<WgpuPassState>,
    view_ranges: PerView<ViewRanges>,
    subdivided: RwLock<SubdividedMeshes<SubdividedMesh>>,
    timestamps: Option<Timestamps>,
    /// For how many frames no frame has taken them.
    unused: u32,
    /// The epoch of the object table that `objects` holds; 0 for none.
    objects_epoch: u64,
}

impl Buffers {
    fn new(maps_memory: bool) -> Self {
        use wgpu::BufferUsages;
        Self {
            objects: ObjectBuffers::new(maps_memory),
            materials: MaterialBuffer::new(),
            views: MirroredBuffer::new("views", BufferUsages::UNIFORM),
            lights: MirroredBuffer::new("lights", BufferUsages::STORAGE),
            object_lists: ObjectLists::new(),
            parameters: MirroredBuffer::new("parameters", BufferUsages::UNIFORM),
            bytes: ResourceBytes::default(),
            item_data: ItemData::default(),
            passes: Vec::new(),
            view_ranges: PerView::default(),
            subdivided: RwLock::default(),
            timestamps: None,
            unused: 0,
            objects_epoch: 0,
        }
    }

    /// All but those of objects, their lists and materials, and the bytes of the engine's own.
    fn all(&self) -> [&GrowingBuffer; 3] {
        let Self { views, lights, parameters, .. } = self;
        [&views.on_device, &lights.on_device, &parameters.on_device]
    }

    /// Sets the passes of this frame, and collects their parameters. A pass that the latest frame with these buffers
    /// had keeps what it has cached, whatever its index.
    fn set_passes(&mut self, request: &FrameRequest<'_>) {
        let FrameRequest { plan, draws, views, passes, .. } = *request;
        let id = |pass: &Pass| PassId::new(plan, views, pass);
        if !self.passes.iter().map(|state| state.id).eq(passes.iter().map(id)) {
            let mut before: HashMap<_, _> = self.passes.drain(..).map(|state| (state.id, state)).collect();
            let new = |pass: &Pass| WgpuPassState::new(plan, views, pass);
            self.passes.extend(passes.iter().map(|pass| before.remove(&id(pass)).unwrap_or_else(|| new(pass))));
        }
        for (state, &pass) in self.passes.iter_mut().zip(passes) {
            state.begin_frame(pass, &draws[pass.process_index]);
        }
        let length = |pass: &WgpuPassState| pass.parameters_length.next_multiple_of(ALIGNMENT);
        let end = allot(&mut self.passes, |pass| &mut pass.parameters, length);
        let bytes = self.parameters.rewrite();
        bytes.resize(end, 0);
        for state in &self.passes {
            if let Some(range) = state.parameter_bytes() {
                bytes[range].copy_from_slice(draws[state.pass.process_index].parameters());
            }
        }
    }

    /// Allots each view its ranges, and collects the views and their lights. A view that the latest frame with these
    /// buffers had keeps its ranges, whatever its index; another one takes those that are left in its slot.
    ///
    /// # Errors
    /// If a camera is out of reach.
    fn set_views(&mut self, request: &FrameRequest<'_>) -> Result<(), BackendError> {
        let FrameRequest { views, light_tables, limits, .. } = *request;
        let all = &mut self.view_ranges;
        all.set_views(views, |_| {});
        for (view, lights) in light_tables.iter().enumerate() {
            let ranges = &mut all[view];
            // The layout requires a binding even if no light reaches the view.
            let needed = size_of_val(lights.gpu_lights());
            ranges.lights_length = size_with_headroom(ranges.lights.len(), needed, limits.binding_bytes);
            ranges.view_length = GPU_VIEW_BYTES;
        }
        let end_of_views = allot(all.slots_mut(), |ranges| &mut ranges.view, |ranges| ranges.view_length);
        let allot_lights = |all: &mut PerView<ViewRanges>| {
            allot(all.slots_mut(), |ranges| &mut ranges.lights, |ranges| ranges.lights_length)
        };
        let mut end_of_lights = allot_lights(all);
        if end_of_lights as u64 > limits.buffer_bytes {
            // Without headroom, and without what belongs to nobody.
            for (view, lights) in light_tables.iter().enumerate() {
                let ranges = &mut all[view];
                ranges.lights = 0..0;
                ranges.lights_length = size_of_val(lights.gpu_lights()).max(1).next_multiple_of(ALIGNMENT);
            }
            end_of_lights = allot_lights(all);
        }
        let (view_bytes, light_bytes) = (self.views.rewrite(), self.lights.rewrite());
        view_bytes.resize(end_of_views, 0);
        light_bytes.resize(end_of_lights, 0);
        for (index, (ranges, lights)) in all.iter().zip(light_tables).enumerate() {
            let gpu_view = request.view(index).gpu_view()?;
            view_bytes[ranges.view.start..][..size_of::<GpuView>()].copy_from_slice(bytemuck::bytes_of(&gpu_view));
            let lights: &[u8] = bytemuck::cast_slice(lights.gpu_lights());
            light_bytes[ranges.lights.start..][..lights.len()].copy_from_slice(lights);
        }
        Ok(())
    }

    /// Allots each pass of commands a place for its list of objects. Returns the number of places, which is at most
    /// `max` if that many are enough.
    fn allot_object_lists(&mut self, max: u64) -> usize {
        let allot_lists = |passes: &mut [WgpuPassState]| {
            allot(passes, |pass| &mut pass.object_list, |pass| usize::from(pass.draws_commands))
        };
        let lists = allot_lists(&mut self.passes);
        if lists as u64 <= max {
            return lists;
        }
        // Without the places that belong to nobody.
        self.passes.iter_mut().for_each(|pass| pass.object_list = 0..0);
        allot_lists(&mut self.passes)
    }

    /// What a pass binds in these buffers, by index.
    fn frame_ranges(&self, pass: usize) -> FrameRanges {
        let state = &self.passes[pass];
        let ViewRanges { view, lights, .. } = &self.view_ranges[state.pass.view_index];
        let object_indices = self.object_lists.bytes_of(&state.object_list);
        FrameRanges { view: view.clone(), lights: lights.clone(), object_indices }
    }

    fn new_frame_bind_group(
        &self,
        device: &wgpu::Device,
        layouts: &BindGroupLayouts,
        FrameRanges { view, lights, object_indices }: &FrameRanges,
    ) -> wgpu::BindGroup {
        let bindings = [
            self.views.on_device.binding(view.start, size_of::<GpuView>()),
            self.objects.gpu_objects(),
            self.object_lists.binding(object_indices),
            self.lights.on_device.binding(lights.start, lights.len()),
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

/// The bytes of a view in the frame's buffers.
#[derive(Default)]
struct ViewRanges {
    /// Those of its [`GpuView`], and the length that these need: 0 where no view is.
    view: Range<usize>,
    view_length: usize,
    /// Those of the lights that reach it.
    lights: Range<usize>,
    lights_length: usize,
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

/// What a view takes in the buffer of views.
const GPU_VIEW_BYTES: usize = size_of::<GpuView>().next_multiple_of(ALIGNMENT);

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::backend::SceneLimits;
    use crate::backend::wgpu::noop_device::noop_device;
    use crate::backend::wgpu::resources::MaterialCache;
    use crate::process::{CommandDraws, Declare, Format, FramePlan, RenderProcess, SampledViews};
    use crate::quality::Quality;
    use crate::scene::{Camera, Light, Material, Mesh, RenderObject, Scene, Topology, Vertex};
    use crate::view::{LightTable, ObjectTable, RenderView, SceneIssues, ViewRegistry};

    /// Draws objects into a depth target of its own.
    struct Depth(&'static str);

    impl RenderProcess for Depth {
        fn name(&self) -> &str {
            self.0
        }

        fn declare(&self, declare: &mut Declare) {
            declare.clears_depth(self.0, Format::Depth32Float);
            declare.keep();
        }

        fn draws(&self) -> Draws<'_> {
            Draws::Commands(CommandDraws::default())
        }
    }

    /// What a frame asks for.
    #[derive(Clone, Copy)]
    struct Asked {
        views: usize,
        /// Those that reach the first view.
        lights: usize,
        /// The passes, of at most two in each view.
        passes: usize,
        objects: usize,
        limits: SceneLimits,
    }

    const ASKED: Asked = Asked { views: 1, lights: 0, passes: 1, objects: 10, limits: SceneLimits::NONE };

    /// What frames have in common: their plan, and their views.
    struct Frames {
        plan: FramePlan,
        registry: ViewRegistry,
    }

    fn frames() -> Frames {
        let plan = FramePlan::new(vec![Arc::new(Depth("one")), Arc::new(Depth("other"))], &[]).unwrap();
        Frames { plan, registry: ViewRegistry::default() }
    }

    /// Calls `begin` with the request for a frame, whose draw lists have 1,000 objects at most.
    fn with_request<R>(
        Frames { plan, registry }: &mut Frames,
        asked: Asked,
        begin: impl FnOnce(&FrameRequest<'_>) -> R,
    ) -> R {
        let mut scene = Scene::new();
        let vertices = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let vertices = vertices.map(|position| Vertex { position, normal: [0.0, 0.0, 1.0], uv: [0.0; 2] });
        let mesh = Mesh::new("triangle", Topology::TriangleList, vertices.to_vec(), vec![0, 1, 2]).unwrap();
        let (mesh, material) = (scene.add(mesh).unwrap(), scene.add(Material::default()).unwrap());
        for _ in 0..asked.objects {
            scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO)).unwrap();
        }
        let camera = |index: usize| Camera::looking_at(format!("view {index}"), DVec3::Z * 9.0, DVec3::ZERO);
        let mut views: Vec<_> = (0..asked.views).map(|index| RenderView::new(&camera(index))).collect();
        registry.begin_frame(&mut views);
        registry.end_frame();
        let (position, intensity) = (DVec3::ZERO, Vec3::ONE);
        let light = Light::Point { position, intensity, range: 1.0, casts_shadow: false };
        let lights = vec![light; asked.lights];
        let mut light_tables: Vec<_> = views.iter().map(|_| LightTable::default()).collect();
        light_tables[0].fill(&views[0], &lights, &views, false);
        let passes = plan.passes(&views).unwrap().passes;
        let mut objects = ObjectTable::default();
        objects.update(&scene.as_scene_ref());
        begin(&FrameRequest {
            plan,
            draws: &plan.draws().unwrap(),
            views: &views,
            lights: &lights,
            light_tables: &light_tables,
            passes: &passes[..asked.passes],
            sampled_views: &SampledViews::default(),
            scene: &scene.as_scene_ref(),
            items: &[],
            items_of_passes: &[],
            objects: &objects,
            list_capacity: 1_000,
            generated: &[],
            records_bundles: false,
            workers: 1,
            quality: &Quality::balanced(),
            limits: asked.limits,
            scene_issues: &SceneIssues::default(),
        })
    }

    #[test]
    fn a_pass_is_bound_again_when_several_buffers_are_replaced_at_once() {
        let (device, queue) = noop_device();
        let (uploads, layouts) = (CountedQueue::new(queue), BindGroupLayouts::new(&device));
        // The lights of the first view leave room for those of eight others.
        let many_lights = Asked { lights: 1_000, ..ASKED };
        for (before, after) in [
            // The lists, and the views.
            (many_lights, Asked { views: 9, passes: 18, ..many_lights }),
            // The objects, and the lists.
            (ASKED, Asked { passes: 2, objects: 1_000, ..ASKED }),
        ] {
            let (mut cache, mut frames) = (MaterialCache::default(), frames());
            let mut buffers = Arc::new(BufferPool::new(false)).take(&device).unwrap();
            let mut bound = |asked| {
                with_request(&mut frames, asked, |request| {
                    let (limits, assets) = (
                        (SceneLimits::NONE, request.scene_issues),
                        (request.scene.assets, request.objects.texture_sets()),
                    );
                    cache.begin_frame(&device, &uploads, assets, false).unwrap();
                    let materials = cache.snapshot(&device, assets, &[], limits);
                    buffers.begin(&device, &uploads, &layouts, &materials, request).unwrap();
                    let of_first_view = buffers.passes().iter().find(|state| state.pass.view_index == 0).unwrap();
                    (of_first_view.frame_ranges.clone(), of_first_view.frame_bind_group.clone())
                })
            };
            let first = bound(before);
            assert!(bound(before) == first, "nothing changed");
            let second = bound(after);
            assert!(second.0 == first.0, "the ranges are the same: {:?} {:?}", first.0, second.0);
            assert!(second.1 != first.1, "but not the buffers");
        }
    }

    #[test]
    fn lights_have_headroom_if_a_buffer_holds_it() {
        let exact = with_request(&mut frames(), Asked { lights: 100, ..ASKED }, |request| {
            size_of_val(request.light_tables[0].gpu_lights()).next_multiple_of(ALIGNMENT)
        });
        let roomy = (exact + exact / 4).next_multiple_of(ALIGNMENT);
        for (buffer_bytes, expected) in [(u64::MAX, roomy), (roomy as u64, roomy), (roomy as u64 - 1, exact)] {
            let limits = SceneLimits { buffer_bytes, ..SceneLimits::NONE };
            let asked = Asked { lights: 100, limits, ..ASKED };
            let mut buffers = Buffers::new(false);
            with_request(&mut frames(), asked, |request| buffers.set_views(request).unwrap());
            assert_eq!(buffers.view_ranges[0].lights.len(), expected, "in a buffer of {buffer_bytes} bytes");
        }
    }

    #[test]
    fn lists_move_together_only_if_one_buffer_does_not_hold_them() {
        for (max, expected) in [(u64::MAX, 5), (5, 5), (4, 3)] {
            let mut buffers = Buffers::new(false);
            for object_list in [0..1, 1..2, 4..5] {
                let mut pass = WgpuPassState::default();
                (pass.draws_commands, pass.object_list) = (true, object_list);
                buffers.passes.push(pass);
            }
            assert_eq!(buffers.allot_object_lists(max), expected, "of at most {max}");
        }
    }

    #[test]
    fn buffers_that_are_in_flight_when_the_pool_is_cleared_do_not_return() {
        let (device, _) = noop_device();
        let pool = Arc::new(BufferPool::new(false));
        let free = || pool.free.lock().buffers.len();
        drop(pool.take(&device).unwrap());
        assert_eq!(free(), 1);
        pool.clear();
        assert_eq!(free(), 0);
        for _ in 0..2 {
            let in_flight = pool.take(&device).unwrap();
            pool.clear();
            drop(in_flight);
            assert_eq!(free(), 0);
        }
        drop(pool.take(&device).unwrap());
        assert_eq!(free(), 1);
    }
}
