//! The tables that the stages of a frame fill for each other; which stages a pass has, and what its draw list is made
//! from.

use std::collections::HashMap;
use std::mem;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use drawloom_jobs::internal::ChunkedArray;
use glam::{DVec3, Quat};
use parking_lot::{Mutex, RwLock};

use super::culling::{CullingTables, PassTriangles};
use super::granularity::Granularity;
use crate::backend::SceneLimits;
use crate::bit_set::BitWord;
use crate::command::{
    BinnedSegment, Blending, Bucket, DrawList, DrawOrder, Partition, RenderCommand, Selection, SortScratch, Splitters,
    Version,
};
use crate::frame::FrameError;
use crate::frame::scene_check::BlendedTracker;
use crate::frame::static_groups::{ListConditions, StaticGroupTable};
use crate::frame::views::FrameViews;
use crate::frame::views::view_visibility::{Retest, ViewVisibility};
use crate::leaked_guards::unlock;
use crate::process::{Draws, FramePlan, ItemOrder, ItemSetId, Items, Pass, ProcessId};
use crate::quality::{CullingVolume, DepthPrecision};
use crate::scene::{Camera, Projection, SceneError, SceneRef};
use crate::view::{
    IssueReason, ItemColumns, ItemTable, ItemVisibility, LevelSelector, LightTable, MeshLevels, ObjectLevels,
    ObjectTable, PerView, RenderView,
};

/// The tables that the stages of a frame fill for each other. They keep their memory from frame to frame.
#[derive(Default)]
pub(in crate::frame) struct FrameTables {
    pub(in crate::frame) objects: ObjectTable,
    pub(in crate::frame) static_groups: StaticGroupTable,
    /// Whether an object needs transparency.
    pub(in crate::frame) blended_object: BlendedTracker,
    /// The thread time of each view.
    pub(in crate::frame) view_times: ViewTimes,
    pub(in crate::frame) visibility: PerView<ViewVisibility>,
    pub(in crate::frame) culling: CullingTables,
    /// The meshes that have levels of detail.
    pub(in crate::frame) mesh_levels: MeshLevels,
    /// Those of a frame that chooses levels of detail; otherwise there are none.
    pub(in crate::frame) levels: PerView<ViewLevels>,
    /// The lights that reach each view.
    pub(in crate::frame) lights: Vec<LightTable>,
    /// One for each set of items that the engine lends, and which one it was last.
    pub(in crate::frame) items: Vec<(ItemTable, Option<ItemSetId>)>,
    /// The items of each pass, by index; `None` for one that draws none.
    pub(in crate::frame) items_of_passes: Vec<Option<usize>>,
    /// One for each pass.
    pub(in crate::frame) passes: Vec<PassTable>,
    /// What each of these belongs to, and the passes that these keys were made of: those of a stage graph.
    pass_keys: Vec<PassKey>,
    keyed_passes: Option<Arc<[Pass]>>,
    /// One for each worker.
    pub(in crate::frame) sort_scratch: Vec<Mutex<SortScratch>>,
    /// The number of frames that began.
    frames: u64,
    is_in_frame: bool,
}

/// What a pass's table is kept under.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct PassKey {
    /// That of its view.
    slot: u32,
    process: ProcessId,
}

impl FrameTables {
    /// Begins a frame of these views and passes on `workers` workers. The object table has begun it already.
    ///
    /// Views and passes that the frame before had too go on with their tables, and others take tables that are left.
    /// That is safe, because a table records the inputs that it was made from.
    pub(in crate::frame) fn begin_frame(
        &mut self,
        plan: &FramePlan,
        views: &[RenderView],
        passes: &Arc<[Pass]>,
        workers: usize,
    ) {
        self.frames += 1;
        self.is_in_frame = true;
        self.view_times.reset(views.len());
        let are_same_views = self.visibility.set_views(views, |_| {});
        self.culling.set_views(views);
        self.lights.resize_with(views.len(), LightTable::default);
        self.sort_scratch.resize_with(workers, Mutex::default);
        if are_same_views && self.keyed_passes.as_ref().is_some_and(|keyed| Arc::ptr_eq(keyed, passes)) {
            return;
        }
        self.keyed_passes = Some(Arc::clone(passes));
        let key = |pass: &Pass| PassKey {
            slot: views[pass.view_index].id.slot,
            process: plan.processes()[pass.process_index].id,
        };
        let before: HashMap<_, _> = self.pass_keys.drain(..).zip(0..).collect();
        self.pass_keys.extend(passes.iter().map(key));
        let taken: Vec<_> = self.pass_keys.iter().map(|key| before.get(key).copied()).collect();
        rearrange(&mut self.passes, &taken);
    }

    /// Begins a frame of the items that the engine lends. The tables of these passes have begun it already.
    ///
    /// # Errors
    /// With debug assertions, if an item changed although the engine did not report it.
    pub(in crate::frame) fn begin_items(
        &mut self,
        items: &[Items<'_>],
        (plan, draws): (&FramePlan, &[Draws<'_>]),
        (passes, views): (&[Pass], &[RenderView]),
        volume: CullingVolume,
    ) -> Result<(), FrameError> {
        self.items.resize_with(items.len(), Default::default);
        let frame = self.frames;
        for (index, ((table, id), items)) in self.items.iter_mut().zip(items).enumerate() {
            let version = Version { frame, index };
            let pass = self.items_of_passes.iter().position(|own| *own == Some(index));
            let process = pass.map(|pass| passes[pass].process_index);
            let process = process.map(|process| (&plan.processes()[process], &draws[process]));
            let Some((planned, Draws::Items(draws))) = process else {
                *id = None;
                table.begin_frame(&ItemColumns::default(), false, version);
                continue;
            };
            if ItemSetId::replace(id, planned.id, items.views) {
                table.begin_set(version);
            }
            table.begin_frame(&items.columns(), draws.order == ItemOrder::ByKey, version);
            if cfg!(debug_assertions)
                && let Some(item) = table.unreported_change(&items.columns())
            {
                return Err(FrameError::UnreportedItemChange { process: planned.name.clone(), item });
            }
        }
        for ((pass, table), &index) in passes.iter().zip(&mut self.passes).zip(&self.items_of_passes) {
            if let Some(index) = index {
                let culls = volume != CullingVolume::None;
                table.visible_items.begin_frame(&self.items[index].0, &views[pass.view_index], culls);
            }
        }
        Ok(())
    }

    /// Begins a frame of a scene's static groups. The tables of these passes have begun it already.
    ///
    /// # Errors
    /// If the static groups contradict each other.
    pub(in crate::frame) fn begin_static_groups(
        &mut self,
        scene: &SceneRef<'_>,
        conditions: ListConditions,
        passes: &[Pass],
    ) -> Result<(), SceneError> {
        self.visibility.slots_mut().iter_mut().for_each(|view| view.may_execute_static_groups = true);
        for (pass, table) in passes.iter().zip(&self.passes) {
            let draws_in_order =
                |selection: Selection| !table.mode.orders_by_bin && selection.blending != Blending::Blended;
            self.visibility[pass.view_index].may_execute_static_groups &= !table.selection.is_some_and(draws_in_order);
        }
        let selections =
            self.passes.iter().filter(|table| table.mode.orders_by_bin).filter_map(|table| table.selection);
        self.static_groups.begin_frame(scene, self.objects.len(), conditions, selections)?;
        self.static_groups.count_unknown_objects(scene.object_count(), self.objects.scene_issues());
        Ok(())
    }

    /// Ends a frame that succeeded: what it derived holds for the next one.
    pub(in crate::frame) fn end_frame(&mut self) {
        self.objects.end_frame();
        self.is_in_frame = false;
    }

    /// Ends a frame that failed: the next one derives everything anew. The draw lists are empty if the frame had begun.
    pub(in crate::frame) fn abandon_frame(&mut self) {
        if mem::take(&mut self.is_in_frame) {
            self.passes.iter_mut().for_each(PassTable::clear_list);
            self.levels.clear();
        }
        self.invalidate();
    }

    /// Makes the next frame derive everything anew.
    pub(in crate::frame) fn invalidate(&mut self) {
        self.objects.invalidate();
        self.static_groups.invalidate();
        self.items.iter_mut().for_each(|(table, _)| table.invalidate());
        self.visibility.slots_mut().iter_mut().for_each(ViewVisibility::invalidate);
        self.passes.iter_mut().for_each(PassTable::invalidate);
    }

    /// How many objects all passes that sort put into their lists in the frame before.
    pub(in crate::frame) fn sorted_before(&self) -> usize {
        self.passes.iter().filter(|table| !table.mode.orders_by_bin).map(|table| table.listed_before).sum()
    }

    /// The version of what the frame makes for a view or pass, by index.
    pub(in crate::frame) fn version(&self, index: usize) -> Version {
        Version { frame: self.frames, index }
    }

    /// Finds the lights that reach each view that is drawn, within the limits of the backend: see [`LightTable::fill`].
    /// Counts those that a view has no room for.
    pub(in crate::frame) fn fill_lights(
        &mut self,
        frame: &FrameViews,
        separate_shadowed_lights: bool,
        limits: SceneLimits,
    ) {
        let FrameViews { views, lights, main_views, scene_indices, .. } = frame;
        let (mut left_out, mut room) = (Vec::new(), limits.buffer_bytes);
        for (view, table) in views.iter().zip(&mut self.lights) {
            let lights = if view.is_cached() { &[] } else { lights.as_slice() };
            let of_view = SceneLimits { binding_bytes: limits.binding_bytes.min(room), ..limits };
            let within = (of_view.max_lights(), &mut left_out);
            table.fill_within(view, (lights, main_views), views, separate_shadowed_lights, within);
            // Each view's lights begin where a binding can, and a view without lights has an empty one.
            let bytes = size_of_val(table.gpu_lights()).max(1) as u64;
            room = room.saturating_sub(bytes.next_multiple_of(LIGHT_ALIGNMENT));
        }
        let left_out = left_out.into_iter().map(|light| scene_indices[light]);
        self.objects.scene_issues().count_all_once(IssueReason::LightLimit, left_out);
    }
}

/// Makes `tables` those at the indices in `taken`, each at most once. Where there is none, one that is left, or a new
/// one.
fn rearrange<T: Default>(tables: &mut Vec<T>, taken: &[Option<usize>]) {
    let mut before: Vec<_> = tables.drain(..).map(Some).collect();
    let taken: Vec<_> = taken.iter().map(|index| before.get_mut((*index)?)?.take()).collect();
    let mut left = before.into_iter().flatten();
    tables.extend(taken.into_iter().map(|table| table.or_else(|| left.next()).unwrap_or_default()));
}

/// The most segments in which a pass orders its objects by bin with adaptive granularity: one job joins them.
pub(in crate::frame) const MAX_SEGMENTS: usize = 32;

/// The alignment of a view's lights in a buffer that all devices support, in bytes.
const LIGHT_ALIGNMENT: u64 = 256;

/// What one pass draws, from commands to the draw list.
#[derive(Debug, Default)]
pub(in crate::frame) struct PassTable {
    /// The objects that it draws; `None` for a pass without commands.
    pub(in crate::frame) selection: Option<Selection>,
    pub(in crate::frame) mode: PassMode,
    /// Whether triangles of meshes with triangle culling are culled.
    pub(in crate::frame) culls_triangles: bool,
    /// Whether later frames may keep the draw list, unless it has an object with too coarse edges.
    pub(in crate::frame) can_keep_list: bool,
    /// Whether this frame keeps the one of the frame before; empty until that is known.
    pub(in crate::frame) keeps_list: OnceLock<bool>,
    /// Set by a frame that finds an object whose edges are too coarse for a paraboloid. Each frame counts such objects,
    /// and it does so while it makes the list.
    pub(in crate::frame) has_coarse_edges: OnceLock<()>,
    /// How many objects it put into the list in the frame before; 0 if that kept its list.
    pub(in crate::frame) listed_before: usize,
    /// One command for each visible object, by rank.
    pub(in crate::frame) commands: ChunkedArray<RenderCommand>,
    /// What divides the commands into buckets. With a fixed number of draws in a job, the partition does.
    pub(in crate::frame) splitters: RwLock<Splitters>,
    pub(in crate::frame) partition: RwLock<Partition>,
    /// As many as a frame may have, in a pass with commands.
    pub(in crate::frame) buckets: Vec<RwLock<Bucket>>,
    /// As many as a frame may have, in a pass that orders objects by bin.
    pub(in crate::frame) segments: Vec<RwLock<BinnedSegment>>,
    pub(in crate::frame) list: RwLock<DrawList>,
    /// What the list was made from; `None` if the next frame has to make it anew.
    pub(in crate::frame) list_inputs: RwLock<Option<ListInputs>>,
    pub(in crate::frame) triangles: RwLock<PassTriangles>,
    /// Of the items, if it draws any, those that the view sees.
    pub(in crate::frame) visible_items: ItemVisibility,
}

impl PassTable {
    /// Begins the frame of this number, of `objects` objects. The list is kept as that of a frame with the same inputs.
    pub(in crate::frame) fn begin_frame(
        &mut self,
        frame: u64,
        (mode, selection, culls_triangles): (PassMode, Option<Selection>, bool),
        objects: usize,
        granularity: Granularity,
    ) {
        let parts = granularity.draws_per_job().map_or(0, |draws| objects.div_ceil(draws));
        unlock(&mut self.list);
        let list = self.list.get_mut();
        // A list that cannot be kept has no version.
        let was_made = list.version() == Version::default() || list.version().frame + 1 == frame;
        self.listed_before = if was_made { list.objects.len() } else { 0 };
        (self.mode, self.selection, self.culls_triangles) = (mode, selection, culls_triangles);
        self.can_keep_list = !culls_triangles;
        self.keeps_list.take();
        self.has_coarse_edges.take();
        if selection.is_none() || culls_triangles {
            let items = mem::take(&mut self.list.get_mut().items);
            self.clear_list();
            if mode.draws_items {
                self.list.get_mut().items = items;
            }
        }
        self.triangles.get_mut().begin_frame(culls_triangles);
        if mode.orders_by_bin {
            self.segments.resize_with(parts.max(MAX_SEGMENTS), RwLock::default);
        } else if selection.is_some() {
            self.commands.grow(objects, RenderCommand::EMPTY);
            self.buckets.resize_with(parts.max(Splitters::MAX_BUCKETS), RwLock::default);
        }
    }

    /// Makes the next frame make the list anew.
    fn invalidate(&mut self) {
        *self.list_inputs.get_mut() = None;
    }

    /// Empties the list.
    fn clear_list(&mut self) {
        self.list.get_mut().clear();
        self.invalidate();
    }
}

/// What a draw list is made from: equal inputs make equal lists.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::frame) struct ListInputs {
    /// The version of the view's visible set.
    pub(in crate::frame) visible: Version,
    /// The versions of the lists of static groups and of the static groups that the view executes; `None` for a scene
    /// without static groups, or a pass that orders its objects by depth.
    pub(in crate::frame) static_groups: Option<[Version; 2]>,
    /// The version of the levels of detail in the view; `None` if all are 0.
    pub(in crate::frame) levels: Option<Version>,
    pub(in crate::frame) selection: Selection,
    /// The epoch of the object table, if the layers of objects decide which are drawn.
    pub(in crate::frame) layers: Option<u64>,
    /// Counts how often the type of a material changed.
    pub(in crate::frame) material_types: u64,
    pub(in crate::frame) instancing: bool,
    pub(in crate::frame) order: OrderInputs,
}

/// What the order of a list depends on, beside the visible set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::frame) enum OrderInputs {
    /// By bin: the epoch in which an object was last drawn in another way.
    Bins { draws_changed_in: u64 },
    /// By depth: the epoch of the object table, and the camera. For a paraboloid, which subdivides meshes, their levels
    /// depend on the same.
    Depth { epoch: u64, position: DVec3, orientation: Quat, near: f32, far: f32, subdivides: bool },
}

impl OrderInputs {
    pub(in crate::frame) fn of_depth(epoch: u64, camera: &Camera) -> Self {
        let &Camera { position, orientation, near, far, projection, .. } = camera;
        Self::Depth { epoch, position, orientation, near, far, subdivides: projection == Projection::Paraboloid }
    }
}

/// The levels of detail in a view, and what they were chosen with.
#[derive(Debug, Default)]
pub(in crate::frame) struct ViewLevels {
    pub(in crate::frame) levels: ObjectLevels,
    /// `None` before the first frame.
    selector: Option<LevelSelector>,
    scope: Retest,
}

impl ViewLevels {
    /// Begins a frame in which the view's visible set is tested already: decides for which objects levels are chosen.
    pub(in crate::frame) fn begin_frame(
        &mut self,
        selector: LevelSelector,
        visibility: &ViewVisibility,
        objects: usize,
    ) {
        self.levels.resize(objects);
        let is_same = self.selector.replace(selector) == Some(selector);
        self.scope = if is_same { visibility.scope() } else { Retest::All };
    }

    /// The number of words of objects for which levels are chosen.
    pub(in crate::frame) fn word_count(&self, visibility: &ViewVisibility, table: &ObjectTable) -> usize {
        self.scope.word_count(&visibility.set, table)
    }

    /// Chooses the levels of the visible objects of some words, by index among those for which they are chosen.
    pub(in crate::frame) fn choose(
        &self,
        indices: Range<usize>,
        (scene, table, meshes): (&SceneRef<'_>, &ObjectTable, &MeshLevels),
        visibility: &ViewVisibility,
    ) {
        let Some(selector) = &self.selector else { return };
        for index in indices {
            let word = self.scope.word(index, table);
            let mask = visibility.set.word(word.index()) & word.mask;
            self.levels.choose(selector, (scene, table, meshes), BitWord { mask, ..word });
        }
    }
}

/// Sums up the thread time of each view's stages while jobs run. It keeps its memory from frame to frame.
#[derive(Debug, Default)]
pub(in crate::frame) struct ViewTimes {
    /// By view index.
    nanoseconds: Vec<AtomicU64>,
}

impl ViewTimes {
    /// Begins a frame of this many views.
    pub(in crate::frame) fn reset(&mut self, views: usize) {
        self.nanoseconds.clear();
        self.nanoseconds.resize_with(views, AtomicU64::default);
    }

    /// Adds the time of a job of one of a view's stages.
    pub(in crate::frame) fn add(&self, view: usize, took: Duration) {
        // Relaxed: a sum, read after the run.
        self.nanoseconds[view].fetch_add(took.as_nanos() as u64, Ordering::Relaxed);
    }

    /// Takes away a time that the job of one of the view's stages spends on other views. The job's own time is added
    /// when it ends; until then the sum may be below 0, and wraps.
    pub(in crate::frame) fn subtract(&self, view: usize, took: Duration) {
        // Relaxed: a sum, read after the run.
        self.nanoseconds[view].fetch_sub(took.as_nanos() as u64, Ordering::Relaxed);
    }

    pub(in crate::frame) fn times(&self) -> impl Iterator<Item = Duration> {
        self.nanoseconds.iter().map(|view| Duration::from_nanos(view.load(Ordering::Relaxed)))
    }
}

/// What decides which stages a pass has, and its view: fixed for a stage graph. The frame has a mode of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::frame) struct PassMode {
    /// Whether it draws objects.
    pub(in crate::frame) draws_objects: bool,
    /// Whether it draws items of the engine's own.
    pub(in crate::frame) draws_items: bool,
    /// Whether the engine encodes it.
    pub(in crate::frame) is_raw: bool,
    /// Whether it orders its objects by bin, and so makes no commands.
    pub(in crate::frame) orders_by_bin: bool,
    /// Whether the scene has static groups.
    pub(in crate::frame) has_static_groups: bool,
    /// Whether views choose levels of detail.
    pub(in crate::frame) chooses_levels: bool,
    /// Whether the view can test for occlusion.
    pub(in crate::frame) tests_occlusion: bool,
    /// Whether the scene has meshes whose triangles are culled.
    pub(in crate::frame) has_cullable_meshes: bool,
}

impl PassMode {
    pub(in crate::frame) fn always(self) -> bool {
        true
    }

    pub(in crate::frame) fn draws_objects(self) -> bool {
        self.draws_objects
    }

    pub(in crate::frame) fn draws_items(self) -> bool {
        self.draws_items
    }

    /// Whether the pass may be recorded in parts: those of its draw list, or the encoders of a raw pass.
    pub(in crate::frame) fn has_parts(self) -> bool {
        self.has_list() || self.is_raw
    }

    /// Whether the pass has a draw list.
    pub(in crate::frame) fn has_list(self) -> bool {
        self.draws_objects || self.draws_items
    }

    /// Whether the pass makes commands of its objects, and sorts them.
    pub(in crate::frame) fn sorts_commands(self) -> bool {
        self.draws_objects && !self.orders_by_bin
    }

    pub(in crate::frame) fn orders_by_bin(self) -> bool {
        self.draws_objects && self.orders_by_bin
    }

    pub(in crate::frame) fn has_static_groups(self) -> bool {
        self.has_static_groups
    }

    /// Whether the pass's draw list has a place for static groups.
    pub(in crate::frame) fn lists_static_groups(self) -> bool {
        self.orders_by_bin() && self.has_static_groups
    }

    pub(in crate::frame) fn chooses_levels(self) -> bool {
        self.draws_objects && self.chooses_levels
    }

    #[cfg(feature = "occlusion")]
    pub(in crate::frame) fn tests_occlusion(self) -> bool {
        self.draws_objects && self.tests_occlusion
    }

    #[cfg(feature = "occlusion")]
    pub(in crate::frame) fn has_cullable_meshes(self) -> bool {
        self.draws_objects && self.has_cullable_meshes
    }
}

/// Whether a pass orders its objects by bin, and not by depth: it draws opaque ones alone, nothing asks for an order,
/// and the view is not a paraboloid, where the subdivision level gives an object another state.
pub(in crate::frame) fn orders_by_bin(selection: Selection, view: &RenderView, opaque_order: DepthPrecision) -> bool {
    (selection.order, selection.blending) == (DrawOrder::ByState, Blending::Opaque)
        && opaque_order.bits == 0
        && view.camera.projection != Projection::Paraboloid
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_go_where_they_are_wanted_and_others_are_used_again() {
        let mut tables = vec![10, 11, 12, 13];
        rearrange(&mut tables, &[Some(2), None, Some(0), None]);
        assert_eq!(tables, [12, 11, 10, 13]);
        rearrange(&mut tables, &[None, Some(0), None, None, None]);
        assert_eq!(tables, [11, 12, 10, 13, 0]);
        rearrange(&mut tables, &[Some(9)]);
        assert_eq!(tables, [11]);
    }

    #[test]
    fn a_list_counts_in_the_frame_after_it_was_made_and_not_while_it_is_kept() {
        let mut table = PassTable::default();
        let begin = |table: &mut PassTable, frame| {
            let draws = (PassMode::default(), Some(Selection::default()), false);
            table.begin_frame(frame, draws, 10, Granularity::Adaptive);
            table.listed_before
        };
        table.list.get_mut().objects.extend(0..10);
        table.list.get_mut().set_version(Version { frame: 3, index: 0 });
        assert_eq!([4, 5, 6].map(|frame| begin(&mut table, frame)), [10, 0, 0]);
        // One that is made anew in each frame.
        table.list.get_mut().set_version(Version::default());
        assert_eq!([7, 8].map(|frame| begin(&mut table, frame)), [10, 10]);
    }

    #[test]
    fn a_job_gives_time_away_before_its_own_is_known() {
        let mut times = ViewTimes::default();
        times.reset(2);
        let nanoseconds = Duration::from_nanos;
        times.subtract(0, nanoseconds(700));
        times.add(0, nanoseconds(300));
        times.add(1, nanoseconds(400));
        times.add(0, nanoseconds(1000));
        assert_eq!(times.times().collect::<Vec<_>>(), [600, 400].map(nanoseconds));
    }
}
