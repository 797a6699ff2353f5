//! The stages that make the draw list of a pass: from visible objects to batches.

use std::array;
use std::ops::Range;

use parking_lot::RwLock;

use super::super::context::FrameContext;
use super::super::granularity::Granularity;
use super::super::stage::{Chunking, Stage, StageInfo, StageJob, StageNeeds};
use super::super::stage_clock::StageGroup;
use super::super::tables::MAX_SEGMENTS;
use crate::backend::{Backend, BackendError};
use crate::command::{instance, sort};
use crate::view::{self, DrawFilter};

/// Makes a command for each visible object (M 10.3).
pub(super) struct Fill {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Fill {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "fill",
            after: &["compact"],
            group: StageGroup::Fill,
            chunking: Chunking::ByDraws { draws_per_item: 1 },
            cost_kind: "fill",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.sorts_commands()
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        if frame.keeps_list(self.pass) { 0 } else { frame.visible_count(self.pass) }
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let (table, view_index) = (&frame.tables.passes[self.pass], frame.view_index_of(self.pass));
        let selection = table.selection.unwrap_or_default();
        let fill = view::Fill {
            table: &frame.tables.objects,
            view: &frame.request.views[view_index],
            visible: &frame.tables.visibility[view_index].set,
            selection,
            filter: DrawFilter::new(&frame.tables.objects, frame.request.scene, selection),
            levels: frame.levels_of_detail(view_index),
            scene: frame.request.scene,
            quality: frame.request.quality,
        };
        fill.run(job.items, &table.commands);
        Ok(())
    }
}

/// Divides the pass's commands into buckets.
pub(super) struct Split {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Split {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "split",
            after: &["fill"],
            group: StageGroup::Sort,
            chunking: Chunking::PerItem,
            // It shares the estimate of sort, because it chooses the size of the sort jobs.
            cost_kind: "sort",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.sorts_commands()
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        usize::from(!frame.keeps_list(self.pass))
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let table = &frame.tables.passes[self.pass];
        let count = frame.visible_count(self.pass);
        if let Some(draws) = frame.granularity.draws_per_job() {
            table.partition.write().divide(&table.commands, count, draws);
            return Ok(());
        }
        let mut splitters = table.splitters.write();
        let buckets = match frame.granularity {
            Granularity::Adaptive => {
                count.div_ceil(frame.items_per_job_by_cost(job.node, count)).min(frame.max_buckets(self.pass))
            }
            _ => 1,
        };
        splitters.choose(&table.commands, count, buckets);
        frame.report_job_size(job.node, count, count.div_ceil(splitters.bucket_count()));
        Ok(())
    }
}

/// Sorts the commands of each bucket (M 10.5). An item is a bucket.
pub(super) struct Sort {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Sort {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "sort",
            after: &["split"],
            group: StageGroup::Sort,
            chunking: Chunking::PerItem,
            cost_kind: "sort",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.sorts_commands()
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        if frame.keeps_list(self.pass) { 0 } else { frame.bucket_count(self.pass) }
    }

    /// The bucket's share of the visible objects, drawn or not: the split knows only their number.
    fn measured_items(&self, frame: &FrameContext<'_, B>, items: Range<usize>) -> Option<usize> {
        Some(frame.visible_count(self.pass) * items.len() / frame.bucket_count(self.pass))
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let table = &frame.tables.passes[self.pass];
        if frame.granularity.draws_per_job().is_some() {
            let partition = table.partition.read();
            for part in job.items {
                partition.sort(part, &mut table.buckets[part].write().commands);
            }
            return Ok(());
        }
        let (count, splitters) = (frame.visible_count(self.pass), table.splitters.read());
        let mut scratch = frame.tables.sort_scratch[job.worker.index()].lock();
        for bucket in job.items {
            let sorted = &mut table.buckets[bucket].write().commands;
            sort(&table.commands, count, splitters.key_range(bucket), &mut scratch, sorted);
        }
        Ok(())
    }
}

/// Merges equal commands of each bucket into instanced draws (M 10.5). An item is a bucket.
pub(super) struct Instance {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Instance {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "instance",
            after: &["sort"],
            group: StageGroup::Instance,
            chunking: Chunking::PerItem,
            cost_kind: "instance",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.sorts_commands()
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        if frame.keeps_list(self.pass) { 0 } else { frame.bucket_count(self.pass) }
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        for bucket in job.items {
            let mut bucket = frame.tables.passes[self.pass].buckets[bucket].write();
            instance(&mut bucket, |mesh| frame.can_merge(self.pass, mesh));
        }
        Ok(())
    }
}

/// Orders the pass's objects by bin, where their depth does not matter. An item is a segment of the visible objects.
pub(super) struct Bin {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Bin {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "bin",
            after: &["compact"],
            group: StageGroup::Sort,
            chunking: Chunking::PerItem,
            cost_kind: "bin",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.draws_commands && needs.orders_by_bin
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        if frame.keeps_list(self.pass) { 0 } else { frame.segment_count(self.pass) }
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let (table, objects) = (&frame.tables.passes[self.pass], &frame.tables.objects);
        let view_index = frame.view_index_of(self.pass);
        let (visible, levels) = (&frame.tables.visibility[view_index].set, frame.levels_of_detail(view_index));
        let selection = table.selection.unwrap_or_default();
        let filter = DrawFilter::new(objects, frame.request.scene, selection);
        for index in job.items {
            let range = frame.range_of_segment(self.pass, index);
            let mut segment = table.segments[index].write();
            view::bin_visible(objects, visible, selection, filter, &range, &mut segment);
            if let Some(levels) = levels {
                let bins = objects.bins();
                let has_levels = |bin| frame.tables.mesh_levels.contains(bins.get(bin).mesh);
                segment.divide_by_level(has_levels, |object| levels.get(object as usize));
            }
        }
        Ok(())
    }
}

/// Joins the buckets, or segments, to the pass's draw list.
pub(super) struct Join {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Join {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "join",
            after: &["instance", "execute static groups", "bin"],
            group: StageGroup::Instance,
            chunking: Chunking::PerItem,
            cost_kind: "join",
            depends_on_occlusion: true,
        }
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        usize::from(!frame.keeps_list(self.pass))
    }

    fn run(&self, frame: &FrameContext<'_, B>, _: StageJob<'_>) -> Result<(), BackendError> {
        let table = &frame.tables.passes[self.pass];
        let can_merge = |mesh| frame.can_merge(self.pass, mesh);
        let mut list = table.list.write();
        list.set_batches_per_bundle(frame.granularity.batches_per_bundle());
        if frame.has_static_groups(self.pass) {
            list.clear_own();
        } else {
            list.clear();
        }
        *table.list_inputs.write() = None;
        if frame.orders_by_bin(self.pass) {
            let (bins, count) = (frame.tables.objects.bins(), frame.segment_count(self.pass));
            if count <= MAX_SEGMENTS {
                // An array, so that no frame allocates for it.
                let mut segments = array::from_fn::<_, MAX_SEGMENTS, _>(|index| table.segments[index].write());
                list.join_bins(&mut segments[..count], &bins, can_merge);
            } else {
                let mut segments: Vec<_> = table.segments[..count].iter().map(RwLock::write).collect();
                list.join_bins(&mut segments, &bins, can_merge);
            }
        } else {
            for bucket in &table.buckets[..frame.bucket_count(self.pass)] {
                list.append(&mut bucket.write(), can_merge);
            }
        }
        if frame.pass_culls_triangles(self.pass) {
            table.triangles.write().find(&list, &frame.tables.culling, frame.request.scene.assets);
        }
        if frame.can_keep_list(self.pass) {
            list.set_version(frame.tables.version(self.pass));
            *table.list_inputs.write() = Some(frame.list_inputs(self.pass));
        }
        Ok(())
    }
}
