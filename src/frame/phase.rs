//! The phases of a frame: what each job does.

use std::ops::Range;

use parking_lot::{Mutex, RwLock};

use super::Granularity;
use super::cost_model::CostModel;
use super::occlusion::{ViewOcclusion, choose_occluders};
use super::statistics::{Stage, StageClock};
use super::triangles::{AskingMeshes, PassTriangles};
use crate::backend::{Backend, BackendError, FrameRequest, PassRequest};
use crate::chunked_array::ChunkedArray;
use crate::command::RenderCommand;
use crate::command::{Bucket, DrawList, Selection, SortScratch, Splitters, instance, sort};
use crate::graph::{Node, NodeError};
use crate::task::Worker;
use crate::view::{Fill, LightTable, ObjectTable, OccluderMeshes, VisibleSet};

/// What a node of the frame's job graph does: one phase, of the frame, of a view, or of a pass (by index).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Phase {
    /// Checks every object and works out what all views need to know of it.
    Objects,
    /// Uploads what an object is.
    Upload,
    /// Finds what a view sees.
    Visibility { view: usize },
    /// Chooses what of it may hide the rest.
    Occluders { view: usize },
    /// Draws that.
    CoarseDepth { view: usize },
    /// Leaves out what is hidden.
    Occlusion { view: usize },
    /// Counts what is left.
    Compact { view: usize },
    /// Makes commands of it.
    Fill { pass: usize },
    /// Cuts them into parts.
    Split { pass: usize },
    /// Brings a part into order.
    Sort { pass: usize },
    /// Merges a part's equal runs.
    Instance { pass: usize },
    /// Joins the parts, in a scene with a mesh whose triangles are looked at; without one, that is not worth a phase.
    Join { pass: usize },
    /// Looks at the triangles of meshes that ask for it.
    Triangles { pass: usize },
    /// Joins the parts if nothing has yet, uploads which objects are drawn, and makes pipelines.
    Prepare { pass: usize },
    /// Records the pass's parts: bundles, say.
    Record { pass: usize },
    /// Finishes the pass.
    Finish { pass: usize },
}

/// What a frame's jobs share.
pub(super) struct FrameContext<'a, B: Backend> {
    pub(super) request: &'a FrameRequest<'a>,
    pub(super) tables: &'a FrameTables,
    pub(super) granularity: Granularity,
    /// Whether equal commands become one draw.
    pub(super) merges: bool,
    pub(super) backend: &'a B,
    pub(super) frame: &'a B::Frame,
    pub(super) recordings: &'a [Recording<B>],
    pub(super) clock: &'a StageClock,
    pub(super) costs: &'a CostModel,
    /// For each view, which objects hide others, if that is looked for.
    pub(super) occluders: &'a [Option<Vec<Selection>>],
    /// Whether triangles are looked at.
    pub(super) culls_triangles: bool,
    pub(super) workers: usize,
}

/// What a frame's parts leave for each other; kept from frame to frame so that its memory is reused.
#[derive(Debug, Default)]
pub(super) struct FrameTables {
    pub(super) objects: ObjectTable,
    /// One for each view.
    pub(super) visible: Vec<VisibleSet>,
    /// One for each view.
    pub(super) occlusion: Vec<ViewOcclusion>,
    /// What of meshes hides; of no use to frames without occlusion.
    pub(super) occluder_meshes: OccluderMeshes,
    /// The meshes whose triangles are looked at.
    pub(super) asking: AskingMeshes,
    /// One for each view.
    pub(super) lights: Vec<LightTable>,
    /// One for each pass.
    pub(super) passes: Vec<PassTable>,
    /// One for each worker.
    sort_memory: Vec<Mutex<SortScratch>>,
}

/// What one pass draws, on its way from slots to batches.
#[derive(Debug, Default)]
pub(super) struct PassTable {
    /// Which objects it draws; `None` for a pass without commands.
    pub(super) selection: Option<Selection>,
    commands: ChunkedArray<RenderCommand>,
    split: RwLock<Splitters>,
    /// As many as there may be at most.
    parts: Vec<RwLock<Bucket>>,
    pub(super) list: RwLock<DrawList>,
    pub(super) triangles: RwLock<PassTriangles>,
}

impl PassTable {
    /// Makes room for a frame of `objects` objects, of which the pass draws those of the selection.
    pub(super) fn reset(&mut self, selection: Option<Selection>, objects: usize, culls_triangles: bool) {
        self.selection = selection;
        // Another pass may have stood here in the frame before, and this frame may fail.
        self.list.get_mut().clear();
        if culls_triangles {
            self.triangles.get_mut().clear();
        } else {
            *self.triangles.get_mut() = PassTriangles::default();
        }
        if selection.is_some() {
            self.commands.grow(objects, RenderCommand::EMPTY);
            self.parts.resize_with(Splitters::MAX_BUCKETS, RwLock::default);
        }
    }
}

impl FrameTables {
    /// Makes room for what `views` views see of the objects, for which there is room already, and for so many workers.
    pub(super) fn reset(&mut self, views: usize, workers: usize) {
        let objects = self.objects.len();
        self.visible.resize_with(views, VisibleSet::default);
        self.occlusion.resize_with(views, ViewOcclusion::default);
        self.lights.resize_with(views, LightTable::default);
        self.sort_memory.resize_with(workers, Mutex::default);
        for visible in &mut self.visible {
            visible.reset(objects);
        }
    }
}

/// What one pass records: its parts as they come, and itself when it is finished. Its memory is kept from frame to frame.
pub(super) struct Recording<B: Backend> {
    parts: Mutex<Vec<Option<B::Part>>>,
    /// The same when all are there.
    in_order: Mutex<Vec<B::Part>>,
    finished: Mutex<Option<B::Commands>>,
}

impl<B: Backend> Default for Recording<B> {
    fn default() -> Self {
        Self { parts: Mutex::default(), in_order: Mutex::default(), finished: Mutex::default() }
    }
}

impl<B: Backend> Recording<B> {
    /// Takes what was recorded, if it was finished, and drops what an unfinished frame has left.
    pub(super) fn take(&mut self) -> Option<B::Commands> {
        self.parts.get_mut().clear();
        self.in_order.get_mut().clear();
        self.finished.get_mut().take()
    }
}

/// A phase as a node of the frame's job graph.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameNode {
    pub(super) phase: Phase,
    /// Its place among the nodes.
    pub(super) node: usize,
    /// What an item of it is like, as the [`CostModel`] knows it.
    pub(super) kind: usize,
}

impl<B: Backend> Node<FrameContext<'_, B>> for FrameNode {
    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        self.phase.width(frame)
    }

    fn chunk(&self, frame: &FrameContext<'_, B>) -> usize {
        if self.phase.can_be_cut() { self.job_size(frame, self.phase.width(frame)) } else { 1 }
    }

    fn run(&self, frame: &FrameContext<'_, B>, range: Range<usize>, worker: &Worker) -> Result<(), NodeError> {
        let chunk = range.clone();
        let (result, took) = frame.clock.measure(self.phase.stage(), || self.work(frame, chunk, worker));
        if let Some(view) = self.phase.paid_by(frame) {
            frame.tables.occlusion[view].note(took);
        }
        if frame.granularity == Granularity::Adaptive
            && let Some(items) = self.phase.known_items(frame, range)
        {
            frame.costs.note(self.kind, items, took);
        }
        Ok(result?)
    }
}

impl FrameNode {
    /// How many of `width` items make a job.
    fn job_size<B: Backend>(&self, frame: &FrameContext<'_, B>, width: usize) -> usize {
        let learnt = || frame.costs.items(self.kind, self.node, width, frame.workers);
        frame.granularity.parts(self.phase.items_per_part()).unwrap_or_else(learnt)
    }
}

impl Phase {
    /// What it is called in timelines.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Objects => "objects",
            Self::Upload => "upload",
            Self::Visibility { .. } => "visibility",
            Self::Occluders { .. } => "occluders",
            Self::CoarseDepth { .. } => "coarse depth",
            Self::Occlusion { .. } => "occlusion",
            Self::Compact { .. } => "compact",
            Self::Fill { .. } => "fill",
            Self::Split { .. } => "split",
            Self::Sort { .. } => "sort",
            Self::Instance { .. } => "instance",
            Self::Join { .. } => "join",
            Self::Triangles { .. } => "triangles",
            Self::Prepare { .. } => "prepare",
            Self::Record { .. } => "record",
            Self::Finish { .. } => "finish",
        }
    }

    fn width<B: Backend>(self, frame: &FrameContext<'_, B>) -> usize {
        let tables = frame.tables;
        match self {
            Self::Objects | Self::Visibility { .. } => tables.objects.len(),
            Self::Upload => tables.objects.block_count(),
            Self::Occluders { view } => usize::from(tables.occlusion[view].is_on()),
            Self::CoarseDepth { view } if tables.occlusion[view].is_on() => {
                tables.occlusion[view].occlusion.strip_count()
            }
            Self::Occlusion { view } if tables.occlusion[view].is_on() => tables.objects.len(),
            Self::CoarseDepth { .. } | Self::Occlusion { .. } => 0,
            Self::Fill { pass } => visible_count(frame, pass),
            Self::Sort { pass } | Self::Instance { pass } => tables.passes[pass].split.read().bucket_count(),
            Self::Triangles { pass } => tables.passes[pass].triangles.read().len(),
            Self::Record { pass } => part_count(frame, pass),
            Self::Compact { .. }
            | Self::Split { .. }
            | Self::Join { .. }
            | Self::Prepare { .. }
            | Self::Finish { .. } => 1,
        }
    }

    /// How many objects or draws are in the smallest part that can be a job.
    fn items_per_part(self) -> usize {
        match self {
            Self::Upload => ObjectTable::BLOCK_SIZE,
            Self::Record { .. } => DrawList::BATCHES_PER_BUNDLE,
            _ => 1,
        }
    }

    /// Whether it is cut into jobs. What is sorted and merged was cut before, when it was split.
    fn can_be_cut(self) -> bool {
        matches!(
            self,
            Self::Objects
                | Self::Upload
                | Self::Visibility { .. }
                | Self::CoarseDepth { .. }
                | Self::Occlusion { .. }
                | Self::Fill { .. }
                | Self::Triangles { .. }
                | Self::Record { .. }
        )
    }

    /// The view that looks for what is hidden to save this, or to do it.
    fn paid_by<B: Backend>(self, frame: &FrameContext<'_, B>) -> Option<usize> {
        let view = match self {
            Self::Objects | Self::Upload | Self::Visibility { .. } | Self::Compact { .. } => return None,
            Self::Occluders { view } | Self::CoarseDepth { view } | Self::Occlusion { view } => view,
            Self::Fill { pass }
            | Self::Split { pass }
            | Self::Sort { pass }
            | Self::Instance { pass }
            | Self::Join { pass }
            | Self::Triangles { pass }
            | Self::Prepare { pass }
            | Self::Record { pass }
            | Self::Finish { pass } => frame.request.passes[pass].view,
        };
        frame.occluders[view].as_ref().map(|_| view)
    }

    /// How many items lie in a range, where jobs are made as large as what their items are known to cost. To sort, a part's
    /// share of the visible objects counts, drawn or not, since as much is known when they are split.
    fn known_items<B: Backend>(self, frame: &FrameContext<'_, B>, range: Range<usize>) -> Option<usize> {
        if let Self::Sort { pass } = self {
            let parts = frame.tables.passes[pass].split.read().bucket_count();
            return Some(visible_count(frame, pass) * range.len() / parts);
        }
        self.can_be_cut().then(|| range.len())
    }

    fn stage(self) -> Stage {
        match self {
            Self::Objects
            | Self::Visibility { .. }
            | Self::Occluders { .. }
            | Self::CoarseDepth { .. }
            | Self::Occlusion { .. }
            | Self::Compact { .. } => Stage::Visibility,
            Self::Fill { .. } => Stage::Fill,
            Self::Split { .. } | Self::Sort { .. } => Stage::Sort,
            Self::Instance { .. } | Self::Join { .. } | Self::Triangles { .. } => Stage::Instance,
            Self::Upload | Self::Prepare { .. } | Self::Record { .. } | Self::Finish { .. } => Stage::Record,
        }
    }
}

impl FrameNode {
    fn work<B: Backend>(
        &self,
        frame: &FrameContext<'_, B>,
        range: Range<usize>,
        worker: &Worker,
    ) -> Result<(), BackendError> {
        let tables = frame.tables;
        match self.phase {
            Phase::Objects => tables.objects.fill(frame.request.scene, range),
            Phase::Upload => {
                return frame.backend.upload_objects(worker, frame.frame, &tables.objects, range);
            }
            Phase::Visibility { view } => see(frame, view, range),
            Phase::Occluders { view } => choose_occluders(frame, view),
            Phase::CoarseDepth { view } => {
                range.for_each(|strip| tables.occlusion[view].occlusion.draw_occluders(strip))
            }
            Phase::Occlusion { view } => {
                let occlusion = &tables.occlusion[view].occlusion;
                let hides = |first, seen| occlusion.hidden(frame.request.scene, &tables.objects, first, seen);
                tables.occlusion[view].hide(tables.visible[view].remove_hidden(range, hides));
            }
            Phase::Compact { view } => tables.visible[view].compact(),
            Phase::Fill { pass } => fill(frame, pass, range),
            Phase::Split { pass } => {
                let table = &tables.passes[pass];
                let count = visible_count(frame, pass);
                // Each part reads every key of the view, so there are no more than there are workers.
                let parts = count.div_ceil(self.job_size(frame, count)).min(frame.workers);
                table.split.write().choose(&table.commands, count, parts);
            }
            Phase::Sort { pass } => {
                let table = &tables.passes[pass];
                let (count, split) = (visible_count(frame, pass), table.split.read());
                let mut memory = tables.sort_memory[worker.index()].lock();
                for part in range {
                    let sorted = &mut table.parts[part].write().commands;
                    sort(&table.commands, count, split.key_range(part), &mut memory, sorted);
                }
            }
            Phase::Instance { pass } => {
                range.for_each(|part| {
                    instance(&mut tables.passes[pass].parts[part].write(), |mesh| merges(frame, pass, mesh))
                });
            }
            Phase::Join { pass } => {
                join(frame, pass);
                let table = &tables.passes[pass];
                if looks_at_triangles(frame, pass) {
                    table.triangles.write().find(&table.list.read(), &tables.asking, frame.request.scene.assets);
                }
            }
            Phase::Triangles { pass } => {
                let table = &tables.passes[pass];
                let (triangles, list) = (table.triangles.read(), table.list.read());
                let view = &frame.request.views[frame.request.passes[pass].view];
                triangles.look_at(range, view, frame.request.scene, &list);
            }
            Phase::Prepare { pass } => {
                let table = &tables.passes[pass];
                if frame.culls_triangles {
                    table.triangles.read().put(&mut table.list.write());
                } else {
                    join(frame, pass);
                }
                frame.recordings[pass].parts.lock().resize_with(part_count(frame, pass), || None);
                let list = table.list.read();
                return frame.backend.prepare(worker, frame.frame, &pass_request(frame, pass, &list));
            }
            Phase::Record { pass } => return record(frame, pass, range, worker),
            Phase::Finish { pass } => return finish(frame, pass, worker),
        }
        Ok(())
    }
}

fn visible_count<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> usize {
    frame.tables.visible[frame.request.passes[pass].view].count()
}

fn pass_request<'a, B: Backend>(frame: &FrameContext<'a, B>, pass: usize, list: &'a DrawList) -> PassRequest<'a> {
    PassRequest { frame: frame.request, pass: frame.request.passes[pass], list }
}

fn part_count<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> usize {
    frame.backend.part_count(frame.frame, &pass_request(frame, pass, &frame.tables.passes[pass].list.read()))
}

/// Whether a pass looks at the triangles of meshes that ask.
fn looks_at_triangles<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> bool {
    frame.culls_triangles && frame.request.views[frame.request.passes[pass].view].can_cull_triangles()
}

/// Whether equal commands of the mesh in a slot become one draw. What is looked at is drawn by itself.
fn merges<B: Backend>(frame: &FrameContext<'_, B>, pass: usize, mesh: u32) -> bool {
    frame.merges && !(looks_at_triangles(frame, pass) && frame.tables.asking.contains(mesh))
}

fn join<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) {
    let table = &frame.tables.passes[pass];
    let mut list = table.list.write();
    list.clear();
    for part in &table.parts[..table.split.read().bucket_count()] {
        list.append(&mut part.write(), |mesh| merges(frame, pass, mesh));
    }
}

fn see<B: Backend>(frame: &FrameContext<'_, B>, view: usize, range: Range<usize>) {
    let frustum = &frame.request.views[view].frustum;
    frame.tables.visible[view].test(range, |objects| {
        let block = frame.tables.objects.block(objects.start / ObjectTable::BLOCK_SIZE);
        let first = objects.start % ObjectTable::BLOCK_SIZE;
        block.visible(frustum, frame.request.quality.culling, first..first + objects.len())
    });
}

fn fill<B: Backend>(frame: &FrameContext<'_, B>, pass: usize, ranks: Range<usize>) {
    let table = &frame.tables.passes[pass];
    let view = frame.request.passes[pass].view;
    let fill = Fill {
        table: &frame.tables.objects,
        view: &frame.request.views[view],
        visible: &frame.tables.visible[view],
        selection: table.selection.unwrap_or_default(),
        scene: frame.request.scene,
        quality: frame.request.quality,
    };
    fill.run(ranks, &table.commands);
}

fn record<B: Backend>(
    frame: &FrameContext<'_, B>,
    index: usize,
    parts: Range<usize>,
    worker: &Worker,
) -> Result<(), BackendError> {
    let list = frame.tables.passes[index].list.read();
    let mut place = parts.start;
    let mut put = |part| {
        frame.recordings[index].parts.lock()[place] = Some(part);
        place += 1;
    };
    frame.backend.record(worker, frame.frame, &pass_request(frame, index, &list), parts, &mut put)
}

fn finish<B: Backend>(frame: &FrameContext<'_, B>, index: usize, worker: &Worker) -> Result<(), BackendError> {
    let recording = &frame.recordings[index];
    let (mut parts, mut in_order) = (recording.parts.lock(), recording.in_order.lock());
    let count = parts.len();
    in_order.extend(parts.drain(..).flatten());
    if in_order.len() < count {
        return Err(BackendError::BrokenRule { rule: "every part is recorded before its pass is finished".to_owned() });
    }
    let list = frame.tables.passes[index].list.read();
    let finished = frame.backend.finish(worker, frame.frame, &pass_request(frame, index, &list), &mut in_order)?;
    *recording.finished.lock() = Some(finished);
    Ok(())
}
