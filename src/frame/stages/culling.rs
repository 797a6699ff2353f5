//! Culling beyond the view frustum (S 9.6): of objects that others hide, and of triangles that cover no pixel. If the
//! feature `occlusion` is off, `no_culling.rs` replaces this module.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use drawloom_jobs::internal::{CostSample, Tuner};
use parking_lot::Mutex;

use super::tables::FrameTables;
use crate::command::{Blending, DrawList, Selection};
use crate::process::{Access, AttachmentExtent, Draws, FramePlan, Pass};
use crate::quality::{Quality, TransformPrecision};
use crate::raster::CulledTriangles;
use crate::scene::{Assets, Mesh, SceneRef};
use crate::timeline::{Labels, TuningAlternative, TuningChoice, TuningSubject};
use crate::view::{OccluderMeshes, OcclusionCuller, PerView, RenderView, UsedMeshes};

/// The occlusion test of a view in one frame. It keeps its memory from frame to frame.
#[derive(Debug, Default)]
pub(in crate::frame) struct ViewOcclusion {
    pub(in crate::frame) occlusion: OcclusionCuller,
    is_on: bool,
    hidden: AtomicUsize,
    /// The thread time of the test, and of drawing what is left.
    nanoseconds: AtomicU64,
}

impl ViewOcclusion {
    /// Starts a frame. `tile` is the side of a tile of the coarse depth buffer in pixels; `None` turns the test off.
    pub(in crate::frame) fn reset(&mut self, view: &RenderView, tile: Option<u32>) {
        let tile = tile.filter(|side| has_room(view, *side));
        self.is_on = tile.is_some();
        *self.hidden.get_mut() = 0;
        *self.nanoseconds.get_mut() = 0;
        if let Some(side) = tile {
            self.occlusion.reset(view, side);
        }
    }

    /// Whether the view tests for occlusion in this frame.
    pub(in crate::frame) fn is_on(&self) -> bool {
        self.is_on
    }

    /// Counts hidden objects.
    pub(in crate::frame) fn add_hidden(&self, objects: usize) {
        // Relaxed, here and below: sums, read after the run.
        self.hidden.fetch_add(objects, Ordering::Relaxed);
    }

    /// The number of hidden objects.
    pub(in crate::frame) fn hidden(&self) -> usize {
        self.hidden.load(Ordering::Relaxed)
    }

    /// Adds the thread time of a job.
    pub(in crate::frame) fn add_time(&self, took: Duration) {
        self.nanoseconds.fetch_add(took.as_nanos() as u64, Ordering::Relaxed);
    }

    /// Takes away a time that a job spends on other views. It wraps below 0 until the job's own time is added.
    pub(in crate::frame) fn subtract_time(&self, took: Duration) {
        self.nanoseconds.fetch_sub(took.as_nanos() as u64, Ordering::Relaxed);
    }

    /// The thread time in nanoseconds.
    pub(in crate::frame) fn nanoseconds(&self) -> u64 {
        self.nanoseconds.load(Ordering::Relaxed)
    }
}

/// Whether the coarse depth buffer is of a reasonable size: no backend draws a picture of more than 2²⁴ tiles of 16
/// pixels, and finer tiles would take more memory than the picture.
fn has_room(view: &RenderView, side: u32) -> bool {
    let [columns, rows] = view.camera.size.map(|pixels| u64::from(pixels.div_ceil(side.max(1))));
    columns * rows <= 1 << 24
}

/// Whether a view tests for occlusion, and what may occlude there. The view tries frames with the test and frames
/// without it, and keeps what is cheaper. The measure is the thread time of the test and of drawing what is left,
/// divided by the number of objects in the frustum. The picture is the same either way.
#[derive(Clone, Debug)]
pub(in crate::frame) struct OcclusionControl {
    /// The objects that may occlude others; `None` where the view cannot test for occlusion.
    pub(in crate::frame) occluders: Option<Vec<Selection>>,
    tuner: Tuner,
    frames: u64,
    /// The alternative of the next frame, and whether it is a trial.
    chosen: usize,
    is_trial: bool,
    /// The alternative of the frame before.
    previous: Option<usize>,
}

/// The alternatives, by index.
const WITH_TEST: usize = 0;
const WITHOUT_TEST: usize = 1;

/// The longest pauses between two trials in frames. A trial without the test is the slow one where the test is worth
/// its time, so it is rare. A trial with it is cheap, and comes soon after the camera has moved behind a wall.
const MAX_PAUSES: [u64; 2] = [64, 512];

impl OcclusionControl {
    /// The control of a view, by index, in a frame with these passes. `is_enabled` is the quality's setting.
    pub(in crate::frame) fn new(
        is_enabled: bool,
        plan: &FramePlan,
        draws: &[Draws<'_>],
        passes: &[Pass],
        view: (usize, &RenderView),
    ) -> Self {
        let occluders = is_enabled.then(|| occluders(plan, draws, passes, view)).flatten();
        Self::with_occluders(occluders)
    }

    fn with_occluders(occluders: Option<Vec<Selection>>) -> Self {
        Self { occluders, tuner: Tuner::new(MAX_PAUSES), frames: 0, chosen: WITH_TEST, is_trial: false, previous: None }
    }

    /// Takes over what was measured of the same view in the frames of another graph.
    pub(in crate::frame) fn inherit_measurements(&mut self, before: &Self) {
        if self.is_possible() && before.is_possible() {
            // The tables of the other graph may be gone, so the first frame does not count as warm.
            *self = Self { occluders: self.occluders.take(), previous: None, ..before.clone() };
        }
    }

    /// The number of frames in which the view had objects.
    pub(in crate::frame) fn frames(&self) -> u64 {
        self.frames
    }

    /// Whether the view can test for occlusion.
    pub(in crate::frame) fn is_possible(&self) -> bool {
        self.occluders.is_some()
    }

    /// Whether the view tests for occlusion in the next frame.
    pub(in crate::frame) fn is_on(&self) -> bool {
        self.is_possible() && self.chosen == WITH_TEST
    }

    /// The choice for the frame that was recorded, before [`update`](Self::update) chooses for the next one; `None`
    /// where the view cannot test for occlusion, or did not though it was chosen, because its picture is too large.
    pub(in crate::frame) fn choice(&self, has_tested: bool, labels: &Arc<Labels>) -> Option<TuningChoice> {
        let alternative = |(name, nanoseconds): (&'static str, _)| TuningAlternative { name: name.into(), nanoseconds };
        (self.is_possible() && has_tested == self.is_on()).then(|| TuningChoice {
            subject: TuningSubject::OcclusionTest,
            labels: Arc::clone(labels),
            alternatives: ["on", "off"].into_iter().zip(self.tuner.costs()).map(alternative).collect(),
            chosen: self.chosen,
            is_trial: self.is_trial,
        })
    }

    /// Reports the thread time of the frame, which had `objects` in the view's frustum and tested them or not, and
    /// chooses for the next frame.
    pub(in crate::frame) fn update(&mut self, nanoseconds: u64, objects: usize, has_tested: bool, may_try: &mut bool) {
        if objects == 0 {
            return;
        }
        let used = if has_tested { WITH_TEST } else { WITHOUT_TEST };
        let is_warm = self.previous == Some(used);
        self.tuner.report(self.frames, used, CostSample { nanoseconds: nanoseconds as f64, units: objects, is_warm });
        self.previous = Some(used);
        self.frames += 1;
        (self.chosen, self.is_trial) = self.tuner.choose(self.frames, may_try, |_, _| true);
    }
}

/// Which views of a stage graph test for occlusion, by measurement.
#[derive(Debug)]
pub(in crate::frame) struct OcclusionControls {
    options: CullingOptions,
    of_views: Vec<OcclusionControl>,
}

impl OcclusionControls {
    /// The controls of views in frames with these passes.
    pub(in crate::frame) fn new(
        options: CullingOptions,
        plan: &FramePlan,
        draws: &[Draws<'_>],
        passes: &[Pass],
        views: &[RenderView],
    ) -> Self {
        let control_of = |view: (usize, &RenderView)| {
            // What is behind a clip plane hides nothing.
            let is_enabled = options.occlusion_tile.is_some() && !view.1.has_oblique_near_plane();
            OcclusionControl::new(is_enabled, plan, draws, passes, view)
        };
        Self { options, of_views: views.iter().enumerate().map(control_of).collect() }
    }

    /// Whether a view can test for occlusion.
    pub(in crate::frame) fn is_possible(&self, view: usize) -> bool {
        self.of_views[view].is_possible()
    }

    /// The objects that may occlude others in a view.
    pub(in crate::frame) fn occluders(&self, view: usize) -> &[Selection] {
        self.of_views[view].occluders.as_deref().unwrap_or_default()
    }

    /// Takes over what was measured in the frames of another graph. `kept` has the index of each view there; `None` for
    /// a view that it does not have.
    pub(in crate::frame) fn inherit_measurements(&mut self, before: &Self, kept: impl Iterator<Item = Option<usize>>) {
        for (control, kept) in self.of_views.iter_mut().zip(kept) {
            if let Some(index) = kept {
                control.inherit_measurements(&before.of_views[index]);
            }
        }
    }

    /// Begins a frame of these views in the tables.
    pub(in crate::frame) fn begin_frame(&self, tables: &mut FrameTables, assets: &Assets, views: &[RenderView]) {
        if self.of_views.iter().any(OcclusionControl::is_possible) {
            tables.culling.occluder_meshes.sync(assets, tables.objects.used_meshes());
        }
        let tile = self.options.occlusion_tile;
        for (index, (control, view)) in self.of_views.iter().zip(views).enumerate() {
            tables.culling.occlusion[index].reset(view, tile.filter(|_| control.is_on()));
        }
    }

    /// The choices for a frame that was recorded, of views that have these labels.
    pub(in crate::frame) fn choices<'a>(
        &'a self,
        tables: &'a FrameTables,
        labels: &'a [Arc<Labels>],
    ) -> impl Iterator<Item = TuningChoice> + 'a {
        let views = self.of_views.iter().zip(labels).zip(tables.culling.occlusion.iter());
        views.filter_map(|((control, labels), occlusion)| control.choice(occlusion.is_on(), labels))
    }

    /// Updates the control of each view with the times of a frame that was recorded.
    pub(in crate::frame) fn update(&mut self, tables: &FrameTables) {
        // Of all views at most one begins a trial in a frame. Another one is first in each frame, so that none waits
        // forever.
        let (count, mut may_try) = (self.of_views.len().max(1), true);
        let first = self.of_views.iter().map(|control| control.frames() as usize).max().unwrap_or(0) % count;
        let (before, after) = self.of_views.split_at_mut(first);
        for (view, control) in
            (first..).zip(after).chain((0..).zip(before)).filter(|(_, control)| control.is_possible())
        {
            let occlusion = &tables.culling.occlusion[view];
            let visibility = &tables.visibility[view];
            let objects = visibility.set.count() + visibility.static_groups.object_count() + occlusion.hidden();
            control.update(occlusion.nanoseconds(), objects, occlusion.is_on(), &mut may_try);
        }
    }
}

/// The meshes that ask for triangle culling, and that objects use.
#[derive(Debug, Default)]
pub(in crate::frame) struct CullableMeshes {
    /// The identity and revision of the mesh collection that this was built from, and the revision of the used meshes.
    version: Option<(u64, u64, u64)>,
    /// For each slot, up to the last cullable one.
    is_cullable: Vec<bool>,
}

impl CullableMeshes {
    /// Rebuilds the set if the meshes have changed, or others are used.
    pub(in crate::frame) fn update(&mut self, assets: &Assets, used: &UsedMeshes) {
        let version = (assets.meshes.identity(), assets.meshes.revision(), used.revision());
        if self.version == Some(version) {
            return;
        }
        self.version = Some(version);
        self.is_cullable.clear();
        let is_cullable = |(handle, mesh): &(_, &Mesh)| mesh.culls_triangles() && used.contains(*handle);
        for (handle, _) in assets.iter::<Mesh>().filter(is_cullable) {
            self.is_cullable.resize(handle.index() as usize, false);
            self.is_cullable.push(true);
        }
    }

    /// Whether there are none.
    pub(in crate::frame) fn is_empty(&self) -> bool {
        self.is_cullable.is_empty()
    }

    /// Whether the mesh in a slot is one of them.
    pub(in crate::frame) fn contains(&self, slot: u32) -> bool {
        self.is_cullable.get(slot as usize).is_some_and(|is_cullable| *is_cullable)
    }
}

/// What culling keeps from frame to frame.
#[derive(Default)]
pub(in crate::frame) struct CullingTables {
    pub(in crate::frame) occlusion: PerView<ViewOcclusion>,
    /// The convex parts of meshes, for views that test for occlusion.
    pub(in crate::frame) occluder_meshes: OccluderMeshes,
    /// The meshes whose triangles are culled.
    cullable_meshes: CullableMeshes,
}

impl CullingTables {
    /// Finds the meshes that ask for triangle culling, and that objects use.
    pub(in crate::frame) fn update(&mut self, assets: &Assets, used: &UsedMeshes) {
        self.cullable_meshes.update(assets, used);
    }

    /// The number of objects that a view leaves out as hidden.
    pub(in crate::frame) fn hidden(&self, view: usize) -> usize {
        self.occlusion[view].hidden()
    }

    /// Begins a frame of these views.
    pub(in crate::frame) fn set_views(&mut self, views: &[RenderView]) {
        self.occlusion.set_views(views, |_| {});
    }

    /// Whether a view tests for occlusion in this frame.
    pub(in crate::frame) fn tests_occlusion(&self, view: usize) -> bool {
        self.occlusion[view].is_on()
    }

    /// Adds the thread time of a job whose work depends on the occlusion tests of a view.
    pub(in crate::frame) fn add_time(&self, view: usize, took: Duration) {
        self.occlusion[view].add_time(took);
    }

    /// Takes away a time that such a job spends on other views.
    pub(in crate::frame) fn subtract_time(&self, view: usize, took: Duration) {
        self.occlusion[view].subtract_time(took);
    }

    /// Whether objects use a mesh that asks for triangle culling.
    pub(in crate::frame) fn has_cullable_meshes(&self) -> bool {
        !self.cullable_meshes.is_empty()
    }

    /// Whether the mesh in a slot asks for triangle culling.
    pub(in crate::frame) fn is_cullable(&self, mesh: u32) -> bool {
        self.cullable_meshes.contains(mesh)
    }
}

/// The objects that may occlude others in a view, as the selections of the passes that draw them. Those of them with a
/// mask do not.
///
/// `None` where a hidden object could still be visible in the picture, so that no object may be removed:
/// - in shadow maps, which show objects that are hidden from elsewhere;
/// - where a pass changes the stencil of pixels that are hidden;
/// - where a pass draws without testing the view's single depth target, or tests its stencil alone;
/// - where an object is tested before all occluders are drawn, or after the depth is cleared again;
/// - where occluders are drawn into different colour targets.
pub(in crate::frame) fn occluders(
    plan: &FramePlan,
    draws: &[Draws<'_>],
    passes: &[Pass],
    (index, view): (usize, &RenderView),
) -> Option<Vec<Selection>> {
    if !view.kind().rules().culls_hidden {
        return None;
    }
    // Passes are in draw order.
    let of_view = || passes.iter().filter(|pass| pass.view_index == index);
    let depth_of = |pass: &Pass| plan.processes()[pass.process_index].declaration.depth();
    let colors_of = |pass: &Pass| -> Vec<&str> {
        plan.processes()[pass.process_index].declaration.colors().map(|(target, _)| target).collect()
    };
    let (mut depth, mut colors, mut tests_only, mut occluders) = (None, Vec::new(), false, Vec::new());
    for pass in of_view() {
        let Some(selection) = draws[pass.process_index].selection() else { continue };
        if draws[pass.process_index].draws_where_hidden() {
            return None;
        }
        let (target, access) = depth_of(pass)?;
        if access == Access::TestStencil {
            return None;
        }
        if *depth.get_or_insert(target) != target {
            return None;
        }
        if access.writes_depth() && draws[pass.process_index].hides() && selection.blending != Blending::Blended {
            let own = colors_of(pass);
            if tests_only || !(colors.is_empty() || own.is_empty() || own == colors) {
                return None;
            }
            if !own.is_empty() {
                colors = own;
            }
            occluders.push(view.selection_of(selection));
        } else {
            tests_only = true;
        }
    }
    let clears = |pass: &&Pass| depth_of(pass).is_some_and(|(target, access)| depth == Some(target) && !access.reads());
    (of_view().filter(clears).count() <= 1 && !occluders.is_empty()).then_some(occluders)
}

/// What culling a frame does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::frame) struct CullingOptions {
    /// The side of a tile of the coarse depth buffers in pixels; `None` without occlusion tests.
    pub(in crate::frame) occlusion_tile: Option<u32>,
    culls_triangles: bool,
}

impl CullingOptions {
    /// The options of a frame whose meshes the tables have.
    pub(in crate::frame) fn new(quality: &Quality, tables: &CullingTables) -> Self {
        // The bounds of triangle culling hold only for camera-relative transforms.
        let is_exact = quality.transforms == TransformPrecision::CameraRelative;
        Self { occlusion_tile: quality.occlusion, culls_triangles: tables.has_cullable_meshes() && is_exact }
    }

    /// Whether triangles of meshes with triangle culling are culled.
    pub(in crate::frame) fn culls_triangles(self) -> bool {
        self.culls_triangles
    }
}

/// Whether the triangles of meshes with triangle culling may be culled in a pass.
pub(in crate::frame) fn allows_triangle_culling(
    plan: &FramePlan,
    draws: &[Draws<'_>],
    view: &RenderView,
    pass: &Pass,
) -> bool {
    // Triangle culling tests undeformed triangles against the centres of the picture's pixels.
    draws[pass.process_index].allows_triangle_culling()
        && plan.attachment_extent(pass.process_index) == AttachmentExtent::PICTURE
        && view.can_cull_triangles()
}

/// The triangles of a pass that are tested.
#[derive(Debug, Default)]
pub(in crate::frame) struct PassTriangles {
    items: Vec<Item>,
    /// The indices of the triangles that remain of each item; longer than `items`, to keep memory.
    remaining: Vec<Mutex<Vec<u32>>>,
    culled: Mutex<CulledTriangles>,
}

/// Some triangles of a batch of one object. A large mesh makes several items, so that several workers cull it.
#[derive(Debug)]
struct Item {
    /// The batch's index in the draw list.
    batch: u32,
    triangles: Range<usize>,
}

/// The most triangles in an item.
const MAX_ITEM_TRIANGLES: usize = 256;

/// The most triangles that a pass tests. Their indices take 128 MiB, half of what every device allows in a buffer.
const MAX_PASS_TRIANGLES: usize = (1 << 25) / 3;

impl PassTriangles {
    /// Begins a frame. One that culls no triangles gives the memory back.
    pub(in crate::frame) fn begin_frame(&mut self, culls_triangles: bool) {
        if culls_triangles {
            self.clear();
        } else {
            *self = Self::default();
        }
    }

    /// Lists the triangles of cullable meshes in a draw list, in its order, up to [`MAX_PASS_TRIANGLES`].
    pub(in crate::frame) fn find(&mut self, list: &DrawList, tables: &CullingTables, assets: &Assets) {
        self.clear();
        let mut room = MAX_PASS_TRIANGLES;
        let cullable_batches = (0..).zip(&list.batches).filter(|(_, batch)| tables.is_cullable(batch.mesh));
        for (batch, drawn) in cullable_batches {
            let level = drawn.state.level_of_detail();
            let mesh = assets.meshes.get_with_revision(drawn.mesh);
            let count = mesh.map_or(0, |(_, mesh)| mesh.triangle_count_of(level));
            let Some(left) = room.checked_sub(count) else { continue };
            room = left;
            let starts = (0..count).step_by(MAX_ITEM_TRIANGLES);
            self.items
                .extend(starts.map(|start| Item { batch, triangles: start..count.min(start + MAX_ITEM_TRIANGLES) }));
        }
        // Keeps the memory of up to twice as many items for the next frame.
        self.remaining.truncate(self.items.len() * 2);
        if self.remaining.len() < self.items.len() {
            self.remaining.resize_with(self.items.len(), Mutex::default);
        }
    }

    /// Removes all items. The memory stays until the next [`PassTriangles::find`].
    fn clear(&mut self) {
        self.items.clear();
        *self.culled.get_mut() = CulledTriangles::default();
    }

    /// The number of items.
    pub(in crate::frame) fn len(&self) -> usize {
        self.items.len()
    }

    /// Culls the triangles of some items.
    pub(in crate::frame) fn cull(&self, items: Range<usize>, view: &RenderView, scene: &SceneRef<'_>, list: &DrawList) {
        let mut culled = CulledTriangles::default();
        for (item, remaining) in self.items[items.clone()].iter().zip(&self.remaining[items]) {
            let batch = &list.batches[item.batch as usize];
            let drawn = (list.objects[batch.first as usize] as usize, batch.state.level_of_detail());
            let mut remaining = remaining.lock();
            remaining.clear();
            culled += view.cull_triangle_range(scene, drawn, item.triangles.clone(), &mut remaining);
        }
        *self.culled.lock() += culled;
    }

    /// Makes the draw list draw what remains. A batch that lost no triangle stays whole.
    pub(in crate::frame) fn apply(&self, list: &mut DrawList) {
        let mut first = 0;
        for items in self.items.chunk_by(|one, next| one.batch == next.batch) {
            let remaining = &self.remaining[first..first + items.len()];
            first += items.len();
            let all: usize = items.iter().map(|item| item.triangles.len() * 3).sum();
            let count: usize = remaining.iter().map(|remaining| remaining.lock().len()).sum();
            if count < all {
                list.make_partial(items[0].batch, |indices| {
                    remaining.iter().for_each(|remaining| indices.extend_from_slice(&remaining.lock()));
                });
            }
        }
    }

    /// How many triangles were tested and culled.
    pub(in crate::frame) fn culled(&self) -> CulledTriangles {
        *self.culled.lock()
    }
}

#[cfg(test)]
mod tests {
    use drawloom_signal::{ControllerBounds, Signal, check_controller};
    use glam::DVec3;

    use super::*;
    use crate::process::{ClearColor, CommandDraws, Declare, Format, RenderProcess};
    use crate::scene::Camera;

    /// Draws objects after another process.
    struct Drawing {
        name: String,
        follows: Option<String>,
        declares: fn(&mut Declare),
    }

    impl RenderProcess for Drawing {
        fn name(&self) -> &str {
            &self.name
        }

        fn declare(&self, declare: &mut Declare) {
            (self.declares)(declare);
            self.follows.iter().for_each(|before| declare.after(before));
            declare.keep();
        }

        fn draws(&self) -> Draws<'_> {
            Draws::Commands(CommandDraws::default())
        }
    }

    /// How many of the processes that declare this, one after the other, draw what may occlude; `None` if no object of
    /// their view may be removed.
    fn occluding(declares: &[fn(&mut Declare)]) -> Option<usize> {
        let name = |index: usize| format!("process {index}");
        let process = |(index, declares): (usize, &fn(&mut Declare))| {
            let follows = index.checked_sub(1).map(name);
            Arc::new(Drawing { name: name(index), follows, declares: *declares }) as Arc<dyn RenderProcess>
        };
        let plan = FramePlan::new(declares.iter().enumerate().map(process).collect(), &[]).unwrap();
        let view = RenderView::new(&Camera::looking_at("main", DVec3::Z, DVec3::ZERO));
        let passes = plan.passes(std::slice::from_ref(&view)).unwrap().passes;
        occluders(&plan, &plan.draws().unwrap(), &passes, (0, &view)).map(|occluders| occluders.len())
    }

    fn clears_depth(declare: &mut Declare) {
        declare.clears_depth("depth", Format::Depth32Float);
    }

    fn clears_color(declare: &mut Declare, target: &str) {
        declare.clears_color(target, Format::Rgba8Unorm, ClearColor::Background);
    }

    #[test]
    fn occluders_are_drawn_before_all_else_into_the_same_targets() {
        let colored = |declare: &mut Declare| {
            clears_depth(declare);
            clears_color(declare, "color");
        };
        let more = |declare: &mut Declare| {
            declare.draws_depth("depth");
            declare.draws_over("color");
        };
        let elsewhere = |declare: &mut Declare| {
            declare.draws_depth("depth");
            clears_color(declare, "other color");
        };
        let depth_alone = |declare: &mut Declare| declare.draws_depth("depth");
        let tests = |declare: &mut Declare| {
            declare.tests_depth("depth");
            clears_color(declare, "tested color");
        };
        assert_eq!(occluding(&[colored, more, tests]), Some(2));
        assert_eq!(occluding(&[clears_depth, elsewhere, depth_alone]), Some(3), "depth alone has no colour target");
        assert_eq!(occluding(&[colored, elsewhere]), None, "other targets");
        assert_eq!(occluding(&[clears_depth, tests, depth_alone]), None, "an object is tested before all are drawn");
        assert_eq!(occluding(&[colored, clears_depth]), None, "the depth is cleared again");
    }

    fn control() -> OcclusionControl {
        OcclusionControl::with_occluders(Some(Vec::new()))
    }

    /// Runs a frame that takes these times an object with and without the test, and returns whether it was with.
    fn frame(control: &mut OcclusionControl, [with, without]: [f32; 2], signal: &mut Signal) -> bool {
        let is_on = control.is_on();
        let cost = signal.sample(if is_on { with } else { without });
        control.update((cost * 1000.0) as u64, 1000, is_on, &mut true);
        is_on
    }

    /// Returns how many of some frames were with the test.
    fn frames_with(control: &mut OcclusionControl, frames: usize, costs: [f32; 2]) -> usize {
        (0..frames).filter(|_| frame(control, costs, &mut Signal::new(1))).count()
    }

    #[test]
    fn it_settles_does_not_flap_and_recovers() {
        let bounds = ControllerBounds { settles_within: [20, 70, 80], max_wrong: 60, max_changes: 60 };
        check_controller(
            &bounds,
            control,
            |control, is_after, signal| frame(control, if is_after { [300.0, 100.0] } else { [100.0, 300.0] }, signal),
            |&is_on, is_after| is_on != is_after,
        );
    }

    #[test]
    fn both_ways_are_tried_at_first_and_the_cheaper_one_is_kept() {
        let mut control = control();
        assert_eq!(frames_with(&mut control, 10, [100.0, 300.0]), 6);
        assert!(frames_with(&mut control, 5000, [100.0, 300.0]) > 4950);
        let mut control = super::tests::control();
        frames_with(&mut control, 10, [300.0, 100.0]);
        let tried = frames_with(&mut control, 6000, [300.0, 100.0]);
        assert!((150..300).contains(&tried), "2 in 66 are tried: {tried}");
    }

    #[test]
    fn a_wall_in_front_of_the_camera_is_noticed_within_eighty_frames() {
        let mut control = control();
        frames_with(&mut control, 1000, [130.0, 100.0]);
        // The frames without the test cost what they did.
        frames_with(&mut control, 80, [20.0, 100.0]);
        assert!(frames_with(&mut control, 60, [20.0, 100.0]) >= 58);
    }

    #[test]
    fn an_empty_view_changes_nothing() {
        let mut control = control();
        (0..100).for_each(|_| control.update(1_000_000, 0, true, &mut true));
        assert!(control.is_on() && control.tuner.costs().all(|cost| cost.is_none()));
    }

    #[test]
    fn a_test_that_was_chosen_but_did_not_run_is_no_choice() {
        let control = control();
        assert!(control.choice(true, &Arc::default()).is_some());
        assert_eq!(control.choice(false, &Arc::default()), None);
    }
}
