//! The state of one pass in a frame's buffers: its bind groups, its strategy, its cached bundles, and what recording it
//! cost.

use std::mem;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::Instant;

use drawloom_jobs::internal::CostSample;
use parking_lot::{Mutex, RwLock};

use crate::backend::BackendError;
use crate::backend::subdivision_cache::{CachedSubdivision, SubdividedMeshes, subdivision_of};
use crate::backend::wgpu::pipelines::ProcessPipelines;
use crate::backend::wgpu::resources::{CachedBindGroup, CountedQueue, GrowingBuffer, SubdividedMesh};
use crate::backend::wgpu::strategy::{EncodingStrategy, PassStrategy, RecordingStrategy};
use crate::command::{Batch, ItemList, Version};
use crate::process::{Draws, FramePlan, Pass, ProcessId};
use crate::view::{RenderView, ViewId};

/// What a pass is known by from frame to frame, whatever its index.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct PassId {
    view: ViewId,
    process: ProcessId,
}

impl PassId {
    pub(super) fn new(plan: &FramePlan, views: &[RenderView], pass: &Pass) -> Self {
        Self { view: views[pass.view_index].id, process: plan.processes()[pass.process_index].id }
    }
}

/// The bytes that a pass binds in the frame's buffers, beside those of the objects.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct FrameRanges {
    pub(super) view: Range<usize>,
    pub(super) lights: Range<usize>,
    pub(super) object_indices: Range<usize>,
}

/// One pass of a frame, and what it caches for the next frame that uses the same buffers.
pub(crate) struct WgpuPassState {
    pub(crate) pass: Pass,
    pub(super) id: PassId,
    /// Process and view, for error messages.
    pub(crate) label: String,
    /// Whether it draws commands.
    pub(crate) draws_commands: bool,
    /// Whether it draws items of the engine's own.
    pub(crate) draws_items: bool,
    /// The number of encoders of a raw pass; 0 for another one.
    pub(crate) raw_encoders: usize,
    /// Whether it is recorded by the strategy that is measured to be the cheapest.
    pub(crate) is_tuned: bool,
    /// Whether it draws what is in front of the near plane as if it were on it, with pipelines of its own.
    pub(crate) clamps_depth: bool,
    /// The place of its list of objects in their buffer: a range of one place, empty for a pass without commands.
    pub(super) object_list: Range<usize>,
    /// Its index among the timed passes; `None` for a pass that is not timed.
    pub(crate) timed_pass_index: Option<usize>,
    /// The bytes allotted to its parameters, and the length of these.
    pub(super) parameters: Range<usize>,
    pub(super) parameters_length: usize,
    /// `@group(0)`, and what it binds.
    pub(crate) frame_bind_group: Option<wgpu::BindGroup>,
    pub(super) frame_ranges: FrameRanges,
    /// `@group(2)`: the parameters, and the targets that the process samples.
    pub(crate) process_bind_group: Option<CachedBindGroup>,
    /// `@group(3)`: the columns and the engine's own resources that the process reads.
    pub(crate) engine_bind_group: Option<CachedBindGroup>,
    /// The versions of the objects that the buffers hold: of those of static groups in the draw list, and of the
    /// others.
    pub(crate) uploaded_lists: RwLock<[Version; 2]>,
    pub(crate) strategy: PassStrategy,
    /// The strategy's index in the backend's set, and whether the frame only tries it.
    pub(crate) strategy_index: usize,
    pub(crate) is_trial: bool,
    /// Whether the strategy's cache was there when the frame began.
    is_warm: bool,
    /// The number of batches that it drew when a frame last recorded it with these buffers; `None` if none did.
    latest_batches: Option<usize>,
    /// Whether it may be encoded together with its neighbours.
    pub(crate) can_share_encoder: bool,
    /// Whether it is to be encoded in the encoder of the pass before it.
    pub(crate) shares_encoder: bool,
    /// Whether it is in the encoder of the pass before it.
    pub(crate) is_in_previous_encoder: AtomicBool,
    pub(crate) bundle_cache: BundleCache,
    /// The indices of partial batches' remaining triangles.
    pub(crate) partial_indices: RwLock<GrowingBuffer>,
    pub(crate) timing: PassTiming,
}

impl Default for WgpuPassState {
    fn default() -> Self {
        Self {
            pass: Pass { process_index: 0, view_index: 0 },
            id: PassId::default(),
            label: String::new(),
            draws_commands: false,
            draws_items: false,
            raw_encoders: 0,
            is_tuned: false,
            clamps_depth: false,
            object_list: 0..0,
            timed_pass_index: None,
            parameters: 0..0,
            parameters_length: 0,
            frame_bind_group: None,
            frame_ranges: FrameRanges::default(),
            process_bind_group: None,
            engine_bind_group: None,
            uploaded_lists: RwLock::default(),
            strategy: PassStrategy { recording: RecordingStrategy::Direct, encoding: EncodingStrategy::PerPass },
            strategy_index: 0,
            is_trial: false,
            is_warm: false,
            latest_batches: None,
            can_share_encoder: false,
            shares_encoder: false,
            is_in_previous_encoder: AtomicBool::new(false),
            bundle_cache: BundleCache::default(),
            partial_indices: RwLock::new(new_index_buffer()),
            timing: PassTiming::default(),
        }
    }
}

impl WgpuPassState {
    /// A batch takes some 0.1 µs to record, and an encoder 4 to 5 µs to make, finish and submit.
    const MAX_BATCHES_OF_SMALL_PASS: usize = 64;

    /// The state of a new pass.
    pub(super) fn new(plan: &FramePlan, views: &[RenderView], pass: &Pass) -> Self {
        let (process, view) = (&plan.processes()[pass.process_index].name, views[pass.view_index].name());
        let label = format!("{process:?} in view {view:?}");
        Self { id: PassId::new(plan, views, pass), label, ..Self::default() }
    }

    /// The bytes of its parameters in their buffer; `None` for a pass without.
    pub(crate) fn parameter_bytes(&self) -> Option<Range<usize>> {
        (self.parameters_length > 0).then(|| self.parameters.start..self.parameters.start + self.parameters_length)
    }

    /// Sets the frame's strategy. Unless it is a trial, drops the caches of other strategies.
    pub(crate) fn set_strategy(&mut self, strategy: PassStrategy, strategy_index: usize, is_trial: bool) {
        (self.strategy, self.strategy_index, self.is_trial) = (strategy, strategy_index, is_trial);
        self.is_warm = match strategy.recording {
            RecordingStrategy::CachedBundles => self.bundle_cache.is_warm(),
            RecordingStrategy::Direct | RecordingStrategy::Bundles => true,
        };
        if !is_trial && strategy.recording != RecordingStrategy::CachedBundles {
            self.bundle_cache.clear();
        }
        self.timing = PassTiming::default();
        self.is_in_previous_encoder = AtomicBool::new(false);
    }

    /// Begins a frame, in which the pass has these indices and draws this.
    pub(super) fn begin_frame(&mut self, pass: Pass, draws: &Draws<'_>) {
        self.pass = pass;
        self.latest_batches = self.timing.latest_batches();
        self.draws_commands = matches!(draws, Draws::Commands(_));
        self.draws_items = matches!(draws, Draws::Items(_));
        if !self.draws_commands {
            self.clear_partial_indices();
        }
        self.parameters_length = draws.parameters().len();
    }

    /// Whether the pass probably takes about as long to encode as an encoder of its own, or less.
    pub(crate) fn is_small(&self, draws: &Draws<'_>) -> bool {
        match draws {
            // The engine's own code, which may do anything.
            Draws::Raw(_) => false,
            Draws::Commands(_) | Draws::Items(_) => {
                self.latest_batches.is_some_and(|batches| batches <= Self::MAX_BATCHES_OF_SMALL_PASS)
            }
            _ => true,
        }
    }

    /// Whether it draws a list, of commands or items.
    pub(crate) fn has_list(&self) -> bool {
        self.draws_commands || self.draws_items
    }

    /// Drops the caches that keep other resources alive.
    pub(crate) fn clear_caches(&mut self) {
        (self.process_bind_group, self.engine_bind_group) = (None, None);
        self.bundle_cache.clear();
    }

    /// Uploads the remaining triangles of partial batches; drops the buffer if there are none.
    ///
    /// # Errors
    /// If the device has no room.
    pub(crate) fn upload_partial_indices(
        &self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        indices: &[u32],
    ) -> Result<(), BackendError> {
        let mut buffer = self.partial_indices.write();
        if indices.is_empty() {
            *buffer = new_index_buffer();
        } else {
            buffer.reserve(device, size_of_val(indices))?;
            buffer.write(uploads, 0, bytemuck::cast_slice(indices));
        }
        Ok(())
    }

    /// Drops the index buffer that it has left when it drew commands.
    fn clear_partial_indices(&mut self) {
        *self.partial_indices.get_mut() = new_index_buffer();
    }

    /// How the pass was recorded.
    pub(crate) fn statistics(&self, process: String) -> WgpuPassStatistics {
        WgpuPassStatistics {
            process,
            view: self.pass.view_index,
            recording: self.strategy.recording,
            encoding: self.strategy.encoding,
            encoders: if self.is_in_previous_encoder.load(Ordering::Relaxed) {
                0
            } else {
                self.strategy.encoder_count(self.timing.bundles())
            },
            batches: self.timing.batches(),
            recorded_bundles: self.timing.recorded_bundles(),
            replayed_bundles: self.timing.replayed_bundles(),
        }
    }

    /// The pass's cost in a frame whose passes cost `all` nanoseconds in total, on `workers` workers. If the other
    /// passes cannot keep the workers busy for as long as the pass's critical path, the idle time counts as its cost.
    pub(crate) fn cost_sample(&self, all: f64, workers: usize) -> CostSample {
        let own = self.timing.total();
        let cost = own.max(self.timing.critical_path(workers) * workers as f64 - (all - own));
        let is_warm = self.is_warm && !self.timing.is_cold.load(Ordering::Relaxed);
        CostSample { nanoseconds: cost, units: self.timing.batches(), is_warm }
    }
}

fn new_index_buffer() -> GrowingBuffer {
    GrowingBuffer::new("remaining triangles", wgpu::BufferUsages::INDEX)
}

/// The inputs that all bundles of a pass have in common. Pipelines determine the formats of targets; the snapshot
/// determines the meshes' ranges in their pages.
#[derive(Clone)]
pub(crate) struct BundleKey {
    pub(crate) frame_bind_group: wgpu::BindGroup,
    /// Of each set of textures.
    pub(crate) materials_bind_groups: Arc<[wgpu::BindGroup]>,
    pub(crate) process_bind_group: Option<wgpu::BindGroup>,
    pub(crate) engine_bind_group: Option<wgpu::BindGroup>,
    /// The buffer with the data of its items.
    pub(crate) item_data: Option<wgpu::Buffer>,
    /// The number of the snapshot. The bundles keep the pages that they draw from, but do not keep them from being
    /// overwritten: they are not replayed with another snapshot.
    pub(crate) meshes: u64,
    pub(crate) pipelines: Arc<ProcessPipelines>,
    /// See [`WgpuPassState`].
    pub(crate) clamps_depth: bool,
}

impl PartialEq for BundleKey {
    fn eq(&self, other: &Self) -> bool {
        self.frame_bind_group == other.frame_bind_group
            && Arc::ptr_eq(&self.materials_bind_groups, &other.materials_bind_groups)
            && self.process_bind_group == other.process_bind_group
            && self.engine_bind_group == other.engine_bind_group
            && self.item_data == other.item_data
            && (self.meshes, self.clamps_depth) == (other.meshes, other.clamps_depth)
            && Arc::ptr_eq(&self.pipelines, &other.pipelines)
    }
}

/// The bundles of a pass, as the latest frame with these buffers drew them.
///
/// A bundle's inputs are compared as a whole. The cache keeps them alive, so that no other object can get their
/// identity.
#[derive(Default)]
pub(crate) struct BundleCache {
    key: Option<BundleKey>,
    bundles: Mutex<Vec<Option<CachedBundle>>>,
    /// Those of a pass that draws items.
    of_items: Mutex<CachedItemBundles>,
}

#[derive(Default)]
struct CachedItemBundles {
    bundles: Vec<Option<CachedItems>>,
    /// The set of items, and the size of the groups that they draw.
    of: (Version, usize),
    /// Those that this frame replaces. The frames that the device has not drawn yet keep them alive, so the next frame
    /// with these buffers drops them: on workers, and in the time of the pass, which the tuner sees.
    replaced: Vec<wgpu::RenderBundle>,
    /// Those that earlier frames have replaced.
    unused: Vec<wgpu::RenderBundle>,
}

/// A bundle of items: each item, with its key and its version.
struct CachedItems {
    items: Vec<(u32, u64, u64)>,
    /// The versions of the latest list that the bundle was found to draw a part of.
    list: [Version; 2],
    bundle: wgpu::RenderBundle,
    /// Of the bundle's commands; 0 without debug assertions.
    digest: u64,
}

struct CachedBundle {
    batches: Vec<Batch>,
    /// The subdivided meshes that the batches draw, in order.
    subdivided: Vec<Arc<CachedSubdivision<SubdividedMesh>>>,
    bundle: wgpu::RenderBundle,
}

impl BundleCache {
    /// Whether an earlier frame has left bundles.
    pub(crate) fn is_warm(&mut self) -> bool {
        self.key.is_some() && !(self.bundles.get_mut().is_empty() && self.of_items.get_mut().bundles.is_empty())
    }

    /// Drops everything.
    pub(crate) fn clear(&mut self) {
        self.key = None;
        *self.bundles.get_mut() = Vec::new();
        *self.of_items.get_mut() = CachedItemBundles::default();
    }

    /// Begins a frame: drops all bundles if the key changed.
    pub(crate) fn begin_frame(&mut self, key: BundleKey) {
        if self.key.as_ref() != Some(&key) {
            self.bundles.get_mut().clear();
            self.of_items.get_mut().bundles.clear();
            self.key = Some(key);
        }
        let CachedItemBundles { replaced, unused, .. } = self.of_items.get_mut();
        if replaced.is_empty() {
            unused.clear();
        }
        unused.append(replaced);
    }

    /// Makes room for this many bundles, and drops further ones.
    pub(crate) fn set_bundle_count(&self, bundles: usize) {
        self.bundles.lock().resize_with(bundles, || None);
    }

    /// Makes room for the bundles of a list. Drops further ones, and all if they are of another set of items, or of
    /// groups of another size. Returns whether it drops all.
    pub(crate) fn begin_items(&self, list: &ItemList) -> bool {
        let CachedItemBundles { bundles, of: before, .. } = &mut *self.of_items.lock();
        let of = (list.set, list.group_size());
        let drops_all = mem::replace(before, of) != of;
        if drops_all {
            bundles.clear();
        }
        bundles.resize_with(list.slot_count(), || None);
        drops_all
    }

    /// The bundle of items at an index, with its digest, if it draws these, of a list of these versions: each with its
    /// key and its version.
    pub(crate) fn get_items(
        &self,
        index: usize,
        list: [Version; 2],
        items: impl Iterator<Item = (u32, u64, u64)>,
    ) -> Option<(wgpu::RenderBundle, u64)> {
        // Workers compare at the same time. A frame has one job for each bundle.
        let mut cached = self.of_items.lock().bundles.get_mut(index)?.take()?;
        let is_same = cached.list == list || items.eq(cached.items.iter().copied());
        if is_same {
            cached.list = list;
        }
        let found = is_same.then(|| (cached.bundle.clone(), cached.digest));
        if let Some(slot) = self.of_items.lock().bundles.get_mut(index) {
            *slot = Some(cached);
        }
        found
    }

    /// Replaces the bundle of items at an index.
    pub(crate) fn insert_items(
        &self,
        index: usize,
        list: [Version; 2],
        items: impl Iterator<Item = (u32, u64, u64)>,
        (bundle, digest): (wgpu::RenderBundle, u64),
    ) {
        let before = self.of_items.lock().bundles.get_mut(index).and_then(Option::take);
        let (mut cached, replaced) = before.map_or_else(Default::default, |before| (before.items, Some(before.bundle)));
        cached.clear();
        cached.extend(items);
        let unused = {
            let of_items = &mut *self.of_items.lock();
            of_items.replaced.extend(replaced);
            if let Some(slot) = of_items.bundles.get_mut(index) {
                *slot = Some(CachedItems { items: cached, list, bundle, digest });
            }
            [of_items.unused.pop(), of_items.unused.pop()]
        };
        drop(unused);
    }

    /// The bundle at an index, if it draws these batches.
    pub(crate) fn get(
        &self,
        index: usize,
        batches: &[Batch],
        subdivided: &SubdividedMeshes<SubdividedMesh>,
    ) -> Option<wgpu::RenderBundle> {
        let bundles = self.bundles.lock();
        let cached = bundles.get(index)?.as_ref()?;
        let draws_same =
            drawn_subdivisions(batches, subdivided).map(Arc::as_ptr).eq(cached.subdivided.iter().map(Arc::as_ptr));
        (cached.batches == batches && draws_same).then(|| cached.bundle.clone())
    }

    /// Replaces the bundle at an index.
    pub(crate) fn insert(
        &self,
        index: usize,
        batches: &[Batch],
        subdivided: &SubdividedMeshes<SubdividedMesh>,
        bundle: wgpu::RenderBundle,
    ) {
        let subdivisions = drawn_subdivisions(batches, subdivided).cloned();
        let mut bundles = self.bundles.lock();
        let Some(slot) = bundles.get_mut(index) else { return };
        match slot {
            Some(cached) => {
                cached.batches.clear();
                cached.batches.extend_from_slice(batches);
                cached.subdivided.clear();
                cached.subdivided.extend(subdivisions);
                cached.bundle = bundle;
            }
            None => {
                *slot = Some(CachedBundle { batches: batches.to_vec(), subdivided: subdivisions.collect(), bundle })
            }
        }
    }
}

fn drawn_subdivisions<'a>(
    batches: &'a [Batch],
    subdivided: &'a SubdividedMeshes<SubdividedMesh>,
) -> impl Iterator<Item = &'a Arc<CachedSubdivision<SubdividedMesh>>> {
    let subdivided_batches = batches.iter().filter(|batch| batch.state.subdivision_level() > 0);
    subdivided_batches.filter_map(|batch| subdivided.get(&subdivision_of(batch)))
}

/// What recording a pass cost. The frame's jobs write it, with relaxed atomics; the thread that submits the frame reads
/// it, and the hand-over of the frame to that thread orders both.
#[derive(Default)]
pub(crate) struct PassTiming {
    /// In nanoseconds, summed over all workers: the recording of parts.
    parallel_time: AtomicU64,
    parts: AtomicUsize,
    /// In nanoseconds: the work of one thread.
    serial_time: AtomicU64,
    batches: AtomicUsize,
    bundles: AtomicUsize,
    recorded_bundles: AtomicUsize,
    replayed_bundles: AtomicUsize,
    /// Whether the cost is no sample of the strategy's, because the caches were dropped.
    is_cold: AtomicBool,
    /// What cached bundles are divided by, in a pass of items: see [`ItemList`].
    group_size: AtomicUsize,
}

impl PassTiming {
    /// Says that caches were dropped, so that the cost is no sample of the strategy's.
    pub(crate) fn set_cold(&self) {
        self.is_cold.store(true, Ordering::Relaxed);
    }

    /// Sets the size of the pass.
    pub(crate) fn set_size(&self, batches: usize, bundles: usize, parts: usize) {
        self.batches.store(batches, Ordering::Relaxed);
        self.bundles.store(bundles, Ordering::Relaxed);
        self.parts.store(parts, Ordering::Relaxed);
    }

    /// Sets the size of the groups that bundles of items draw.
    pub(crate) fn set_group_size(&self, ranks: usize) {
        self.group_size.store(ranks, Ordering::Relaxed);
    }

    /// The size of the groups that bundles of items draw; 0 in a pass without items.
    pub(crate) fn group_size(&self) -> usize {
        self.group_size.load(Ordering::Relaxed)
    }

    /// Times work that several workers may do at once.
    pub(crate) fn time_parallel<R>(&self, work: impl FnOnce() -> R) -> R {
        time(&self.parallel_time, work)
    }

    /// Times work that only one thread does.
    pub(crate) fn time_serial<R>(&self, work: impl FnOnce() -> R) -> R {
        time(&self.serial_time, work)
    }

    /// Adds a time in nanoseconds that one thread spent on the pass, measured with that of other passes.
    pub(crate) fn add_serial(&self, nanoseconds: u64) {
        self.serial_time.fetch_add(nanoseconds, Ordering::Relaxed);
    }

    pub(crate) fn count_bundle(&self, is_replayed: bool) {
        let counter = if is_replayed { &self.replayed_bundles } else { &self.recorded_bundles };
        counter.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn batches(&self) -> usize {
        self.batches.load(Ordering::Relaxed)
    }

    /// The batches of the pass; `None` if it was not recorded.
    pub(crate) fn latest_batches(&self) -> Option<usize> {
        (self.total() > 0.0).then(|| self.batches())
    }

    pub(crate) fn bundles(&self) -> usize {
        self.bundles.load(Ordering::Relaxed)
    }

    pub(crate) fn recorded_bundles(&self) -> usize {
        self.recorded_bundles.load(Ordering::Relaxed)
    }

    pub(crate) fn replayed_bundles(&self) -> usize {
        self.replayed_bundles.load(Ordering::Relaxed)
    }

    /// In nanoseconds, summed over all workers.
    pub(crate) fn total(&self) -> f64 {
        (self.parallel_time.load(Ordering::Relaxed) + self.serial_time.load(Ordering::Relaxed)) as f64
    }

    /// The critical path in nanoseconds, on `workers` workers that do nothing else.
    pub(crate) fn critical_path(&self, workers: usize) -> f64 {
        let shared = self.parts.load(Ordering::Relaxed).min(workers).max(1);
        self.parallel_time.load(Ordering::Relaxed) as f64 / shared as f64
            + self.serial_time.load(Ordering::Relaxed) as f64
    }
}

fn time<R>(counter: &AtomicU64, work: impl FnOnce() -> R) -> R {
    let start = Instant::now();
    let result = work();
    counter.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
    result
}

/// How one pass of the frame that was submitted last was recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WgpuPassStatistics {
    /// The render process's name.
    pub process: String,
    /// The view's index.
    pub view: usize,
    /// How its batches were recorded.
    pub recording: RecordingStrategy,
    /// How it was encoded.
    pub encoding: EncodingStrategy,
    /// The number of encoders that it was split over; 0 if it is in the encoder of the pass before it.
    pub encoders: usize,
    /// The number of batches that it draws.
    pub batches: usize,
    /// The number of bundles recorded for it.
    pub recorded_bundles: usize,
    /// The number of cached bundles that it replays.
    pub replayed_bundles: usize,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::wgpu::noop_device::noop_device;
    use crate::backend::wgpu::pipelines::SharedPipelines;
    use crate::backend::wgpu::resources::BindGroupLayouts;
    use crate::command::{Cull, DrawState};
    use crate::process::{GeometryBuffer, GeometryFormats};
    use crate::quality::Quality;
    use crate::scene::{Blend, Topology};

    fn pipelines(device: &wgpu::Device) -> Arc<ProcessPipelines> {
        let process = Arc::new(GeometryBuffer::new(GeometryFormats::default()));
        let plan = FramePlan::new(vec![process], &["diffuse".to_owned()]).unwrap();
        let draws = plan.draws().unwrap();
        let (layouts, shared, quality) =
            (BindGroupLayouts::new(device), SharedPipelines::new(false), Quality::balanced());
        let planned = &plan.processes()[0];
        Arc::new(ProcessPipelines::new(device, (&shared, &layouts), &plan, planned, &draws[0], &quality).unwrap())
    }

    fn bind_group(device: &wgpu::Device) -> wgpu::BindGroup {
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &[] });
        device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &[] })
    }

    fn key(device: &wgpu::Device) -> BundleKey {
        BundleKey {
            frame_bind_group: bind_group(device),
            materials_bind_groups: [bind_group(device)].into(),
            process_bind_group: None,
            engine_bind_group: None,
            item_data: None,
            meshes: 1,
            pipelines: pipelines(device),
            clamps_depth: false,
        }
    }

    fn batch(mesh: u32, subdivision_level: u32) -> Batch {
        let state = DrawState::new(Topology::TriangleList, Cull::Back, Blend::None);
        Batch { mesh, state: state.with_subdivision_level(subdivision_level), first: 0, count: 1 }
    }

    fn bundle(device: &wgpu::Device) -> wgpu::RenderBundle {
        let descriptor = wgpu::RenderBundleEncoderDescriptor {
            color_formats: &[Some(wgpu::TextureFormat::Rgba8Unorm)],
            sample_count: 1,
            ..wgpu::RenderBundleEncoderDescriptor::default()
        };
        device.create_render_bundle_encoder(&descriptor).finish(&wgpu::RenderBundleDescriptor::default())
    }

    #[test]
    fn bundles_are_replayed_only_with_all_of_their_inputs() {
        let (device, _) = noop_device();
        let key = key(&device);
        let others = [
            BundleKey { frame_bind_group: bind_group(&device), ..key.clone() },
            BundleKey { materials_bind_groups: [bind_group(&device)].into(), ..key.clone() },
            BundleKey { process_bind_group: Some(bind_group(&device)), ..key.clone() },
            BundleKey { engine_bind_group: Some(bind_group(&device)), ..key.clone() },
            BundleKey { meshes: 2, ..key.clone() },
            BundleKey { clamps_depth: true, ..key.clone() },
            BundleKey { pipelines: pipelines(&device), ..key.clone() },
        ];
        assert!(key == key.clone());
        let equal: Vec<_> = (0..others.len()).filter(|index| others[*index] == key).collect();
        assert!(equal.is_empty(), "{equal:?}");
    }

    #[test]
    fn a_bundle_is_replayed_with_the_batches_and_the_subdivided_meshes_that_it_draws() {
        let (device, _) = noop_device();
        let mut cache = BundleCache::default();
        assert!(!cache.is_warm());
        cache.begin_frame(key(&device));
        cache.set_bundle_count(1);
        let batches = [batch(1, 0), batch(2, 3)];
        let subdivided = || SubdividedMeshes::from([((2, 0, 3), Arc::new(CachedSubdivision::without_geometry()))]);
        let drawn = subdivided();
        cache.insert(0, &batches, &drawn, bundle(&device));
        assert!(cache.is_warm() && cache.get(0, &batches, &drawn).is_some());
        assert!(cache.get(1, &batches, &drawn).is_none(), "there is no such bundle");
        assert!(cache.get(0, &[batch(7, 0), batch(2, 3)], &drawn).is_none(), "another mesh");
        assert!(cache.get(0, &batches, &subdivided()).is_none(), "the mesh was subdivided again");
        assert!(cache.get(0, &batches, &SubdividedMeshes::new()).is_none());
        cache.clear();
        assert!(!cache.is_warm());
    }
}
