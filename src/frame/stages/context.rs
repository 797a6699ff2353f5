//! What the jobs of a frame share.

use std::time::Duration;

use super::culling::OcclusionControls;
use super::granularity::{CostModel, Granularity, StageClock};
use super::tables::{FrameTables, ListInputs, MAX_SEGMENTS, OrderInputs, PassTable};
use crate::backend::{Backend, FrameRequest, PassRequest};
use crate::command::{DrawList, Splitters};
use crate::frame::encoders::{FrameEncoders, PassRecording};
use crate::frame::nodes::borrowed_nodes::BorrowedNodes;
use crate::process::Items;
use crate::view::{DrawFilter, ItemTable, ObjectLevels, VisibleRange};

/// Fewer visible objects than this cost less than a job and the copy that joins its segment.
const MIN_OBJECTS_PER_SEGMENT: usize = 4096;

/// What the jobs of a frame share.
pub(in crate::frame) struct FrameContext<'a, B: Backend> {
    pub(in crate::frame) request: &'a FrameRequest<'a>,
    pub(in crate::frame) tables: &'a FrameTables,
    pub(in crate::frame) granularity: Granularity,
    /// Whether equal commands become one instanced draw.
    pub(in crate::frame) instancing: bool,
    pub(in crate::frame) backend: &'a B,
    pub(in crate::frame) backend_frame: &'a B::Frame,
    /// One for each pass.
    pub(in crate::frame) recordings: &'a [PassRecording<B>],
    pub(in crate::frame) encoders: &'a FrameEncoders,
    /// The engine's own nodes.
    pub(in crate::frame) nodes: BorrowedNodes<'a>,
    pub(in crate::frame) clock: &'a StageClock<'a>,
    pub(in crate::frame) costs: &'a CostModel,
    pub(in crate::frame) occlusion: &'a OcclusionControls,
    /// Whether the triangles of meshes with triangle culling are culled.
    pub(in crate::frame) culls_triangles: bool,
    pub(in crate::frame) workers: usize,
    /// The number of passes that order their objects by bin.
    pub(in crate::frame) binning_passes: usize,
    /// How many objects all passes that sort put into their lists in the frame before: when one is sorted, others may
    /// not be counted yet.
    pub(in crate::frame) sorted_before: usize,
}

impl<B: Backend> FrameContext<'_, B> {
    /// The index of a pass's view.
    pub(in crate::frame) fn view_index_of(&self, pass: usize) -> usize {
        self.request.passes[pass].view_index
    }

    /// The number of objects that a pass's view sees.
    pub(in crate::frame) fn visible_count(&self, pass: usize) -> usize {
        self.tables.visibility[self.view_index_of(pass)].set.count()
    }

    /// The levels of detail in a view, by index; `None` if all are 0.
    pub(in crate::frame) fn levels_of_detail(&self, view: usize) -> Option<&ObjectLevels> {
        self.tables.levels.get(view).map(|view| &view.levels)
    }

    /// What the draw list of a pass is made from, once its view's visible set is complete.
    pub(in crate::frame) fn list_inputs(&self, pass: usize) -> ListInputs {
        let view_index = self.view_index_of(pass);
        let objects = &self.tables.objects;
        let PassTable { mode, selection, .. } = &self.tables.passes[pass];
        let selection = selection.unwrap_or_default();
        let filter = DrawFilter::new(objects, self.request.scene, selection);
        ListInputs {
            visible: self.tables.visibility[view_index].set.version(),
            static_groups: mode.lists_static_groups().then(|| {
                [
                    self.tables.static_groups.version(selection),
                    self.tables.visibility[view_index].static_groups.version(),
                ]
            }),
            levels: self.levels_of_detail(view_index).map(ObjectLevels::version),
            selection,
            layers: (!filter.ignores_layers()).then(|| objects.epoch()),
            material_types: objects.material_types_revision(),
            instancing: self.instancing,
            order: if mode.orders_by_bin {
                OrderInputs::Bins { draws_changed_in: objects.draws_changed_in() }
            } else {
                OrderInputs::of_depth(objects.epoch(), &self.request.views[view_index].camera)
            },
        }
    }

    /// Whether last frame's draw list of a pass can be reused: decided when it is first asked, which is once its view's
    /// visible set is complete.
    pub(in crate::frame) fn keeps_list(&self, pass: usize) -> bool {
        let table = &self.tables.passes[pass];
        let is_same = || *table.list_inputs.read() == Some(self.list_inputs(pass));
        *table.keeps_list.get_or_init(|| table.can_keep_list && is_same())
    }

    /// The number of segments in which a pass orders its objects by bin. Passes run in parallel already, so they share
    /// the workers.
    pub(in crate::frame) fn segment_count(&self, pass: usize) -> usize {
        let count = self.visible_count(pass);
        match self.granularity.draws_per_job() {
            Some(draws) => count.div_ceil(draws).max(1),
            None if self.granularity == Granularity::PerCamera => 1,
            None => {
                let by_workers = self.workers.div_ceil(self.binning_passes.max(1));
                (count / MIN_OBJECTS_PER_SEGMENT).min(by_workers).clamp(1, MAX_SEGMENTS)
            }
        }
    }

    /// The visible objects that a pass bins in one of its segments, by index.
    pub(in crate::frame) fn range_of_segment(&self, pass: usize, segment: usize) -> VisibleRange {
        match self.granularity.draws_per_job() {
            Some(draws) => {
                let end = self.visible_count(pass);
                VisibleRange::Ranks(end.min(segment * draws)..end.min((segment + 1).saturating_mul(draws)))
            }
            None => VisibleRange::Share { index: segment, count: self.segment_count(pass) },
        }
    }

    /// The most buckets that are worth their cost in a pass, which shares the workers with the other passes that sort.
    pub(in crate::frame) fn max_buckets(&self, pass: usize) -> usize {
        let count = match self.tables.passes[pass].listed_before {
            0 => self.visible_count(pass),
            listed => listed,
        };
        Splitters::max_buckets(self.workers, count, self.sorted_before)
    }

    /// The number of buckets in which a pass sorts and merges its commands, once they are divided.
    pub(in crate::frame) fn bucket_count(&self, pass: usize) -> usize {
        let table = &self.tables.passes[pass];
        match self.granularity.draws_per_job() {
            Some(_) => table.partition.read().part_count(),
            None => table.splitters.read().bucket_count(),
        }
    }

    /// What the backend records of a pass.
    pub(in crate::frame) fn pass_request<'b>(&'b self, pass: usize, list: &'b DrawList) -> PassRequest<'b> {
        PassRequest { frame: self.request, index: pass, pass: self.request.passes[pass], list }
    }

    /// The items that a pass draws, in draw order and as the engine lends them; `None` if it draws none.
    pub(in crate::frame) fn items_of(&self, pass: usize) -> Option<(&ItemTable, &Items<'_>)> {
        let index = self.tables.items_of_passes[pass]?;
        Some((&self.tables.items[index].0, &self.request.items[index]))
    }

    /// The number of parts that the backend records a pass in.
    pub(in crate::frame) fn part_count(&self, pass: usize) -> usize {
        self.backend.part_count(self.backend_frame, &self.pass_request(pass, &self.tables.passes[pass].list.read()))
    }

    /// Whether equal commands of the mesh in a slot become one draw. Objects whose triangles are culled are drawn one
    /// by one.
    pub(in crate::frame) fn can_merge(&self, pass: usize, mesh: u32) -> bool {
        self.instancing && !(self.tables.passes[pass].culls_triangles && self.tables.culling.is_cullable(mesh))
    }

    /// The number of a node's `width` items that are worth a job.
    pub(in crate::frame) fn items_per_job_by_cost(&self, node: usize, width: usize) -> usize {
        self.costs.items_per_job(node, width, self.workers)
    }

    /// Adds a time that a job of another pass spent on a pass.
    pub(in crate::frame) fn add_view_time(&self, pass: usize, took: Duration) {
        let view = self.view_index_of(pass);
        self.tables.view_times.add(view, took);
        if self.depends_on_occlusion(pass) {
            self.tables.culling.add_time(view, took);
        }
    }

    /// Takes away a time that the job of a pass spends on other passes.
    pub(in crate::frame) fn subtract_view_time(&self, pass: usize, took: Duration) {
        let view = self.view_index_of(pass);
        self.tables.view_times.subtract(view, took);
        if self.depends_on_occlusion(pass) {
            self.tables.culling.subtract_time(view, took);
        }
    }

    /// Whether what a pass costs depends on the occlusion tests of its view.
    fn depends_on_occlusion(&self, pass: usize) -> bool {
        self.tables.passes[pass].selection.is_some() && self.occlusion.is_possible(self.view_index_of(pass))
    }

    /// Overrides the job size that is reported for a node.
    pub(in crate::frame) fn report_job_size(&self, node: usize, width: usize, items_per_job: usize) {
        if self.granularity == Granularity::Adaptive {
            self.costs.report_size(node, width, items_per_job);
        }
    }
}
