//! The tables that the stages of a frame fill for each other.

use parking_lot::{Mutex, RwLock};

use super::triangle_culling::{CullableMeshes, PassTriangles};
use super::view_occlusion::ViewOcclusion;
use crate::chunked_array::ChunkedArray;
use crate::command::{Bucket, DrawList, RenderCommand, Selection, SortScratch, Splitters};
use crate::scene::Light;
use crate::view::{LightTable, ObjectTable, OccluderMeshes, RenderView, VisibleSet};

/// The tables that the stages of a frame fill for each other. They keep their memory from frame to frame.
#[derive(Debug, Default)]
pub(super) struct FrameTables {
    pub(super) objects: ObjectTable,
    /// One for each view.
    pub(super) visible: Vec<VisibleSet>,
    /// One for each view.
    pub(super) occlusion: Vec<ViewOcclusion>,
    /// The convex parts of meshes, for views that test for occlusion.
    pub(super) occluder_meshes: OccluderMeshes,
    /// The meshes whose triangles are culled.
    pub(super) cullable_meshes: CullableMeshes,
    /// The lights that reach each view.
    pub(super) lights: Vec<LightTable>,
    /// One for each pass.
    pub(super) passes: Vec<PassTable>,
    /// One for each worker.
    pub(super) sort_scratch: Vec<Mutex<SortScratch>>,
}

impl FrameTables {
    /// Empties the tables for a frame of `views` views on `workers` workers. The object table has its size already.
    pub(super) fn reset(&mut self, views: usize, workers: usize) {
        let objects = self.objects.len();
        self.visible.resize_with(views, VisibleSet::default);
        self.occlusion.resize_with(views, ViewOcclusion::default);
        self.lights.resize_with(views, LightTable::default);
        self.sort_scratch.resize_with(workers, Mutex::default);
        for visible in &mut self.visible {
            visible.reset(objects);
        }
    }

    /// Finds the lights that reach each view: see [`LightTable::fill`].
    pub(super) fn fill_lights(&mut self, views: &[RenderView], lights: &[Light], separate_shadowed_lights: bool) {
        for (view, table) in views.iter().zip(&mut self.lights) {
            table.fill(view, lights, views, separate_shadowed_lights);
        }
    }
}

/// What one pass draws, from commands to the draw list.
#[derive(Debug, Default)]
pub(super) struct PassTable {
    /// The objects that it draws; `None` for a pass without commands.
    pub(super) selection: Option<Selection>,
    /// One command for each visible object, by rank.
    pub(super) commands: ChunkedArray<RenderCommand>,
    pub(super) splitters: RwLock<Splitters>,
    /// [`Splitters::MAX_BUCKETS`] of them, in a pass with commands.
    pub(super) buckets: Vec<RwLock<Bucket>>,
    pub(super) list: RwLock<DrawList>,
    pub(super) triangles: RwLock<PassTriangles>,
}

impl PassTable {
    /// Empties the table for a frame of `objects` objects.
    pub(super) fn reset(&mut self, selection: Option<Selection>, objects: usize, culls_triangles: bool) {
        self.selection = selection;
        // The list may be that of another pass of the previous frame, and this frame may fail before it is joined.
        self.list.get_mut().clear();
        if culls_triangles {
            self.triangles.get_mut().clear();
        } else {
            *self.triangles.get_mut() = PassTriangles::default();
        }
        if selection.is_some() {
            self.commands.grow(objects, RenderCommand::EMPTY);
            self.buckets.resize_with(Splitters::MAX_BUCKETS, RwLock::default);
        }
    }
}
