//! The meshes of a frame.

use std::collections::{BTreeSet, HashMap};
use std::ops::Range;
use std::sync::Arc;

use super::imported_meshes::ImportedMeshes;
use super::mesh_pages::VertexBuffers;
use super::snapshot_lifetimes::SnapshotToken;
use super::vertex_data::AttributeBuffers;
use crate::backend::BackendError;
use crate::backend::error::broken_rule;
use crate::backend::subdivision_cache::missing_mesh_error;
use crate::command::{Batch, DrawList};
use crate::scene::AttributeLayout;

/// The meshes of a frame. It stays valid while meshes change for later frames.
pub(crate) struct MeshSnapshot {
    /// Keeps what it refers to from being overwritten.
    pub(super) token: Arc<SnapshotToken>,
    /// The pages that meshes of the snapshot lie in, by index.
    pub(super) vertex_pages: Vec<Option<VertexBuffers>>,
    pub(super) index_pages: Vec<Option<wgpu::Buffer>>,
    /// By mesh slot.
    pub(super) meshes: Vec<Option<MeshRange>>,
    pub(super) coarser_levels: Arc<CoarserLevels>,
    /// The slots of meshes that were replaced since: the ones before are drawn.
    pub(super) outdated: BTreeSet<u32>,
    /// Those that are not in the pages, but in buffers of the engine's own.
    pub(crate) imported_meshes: ImportedMeshes,
    /// Whether meshes that are used may be missing.
    pub(super) is_streamed: bool,
}

/// The range of a mesh in its pages.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshRange {
    pub(crate) base_vertex: i32,
    pub(crate) first_index: u32,
    pub(crate) index_count: u32,
    pub(crate) pages: MeshPageIndices,
}

/// The pages that a mesh lies in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MeshPageIndices {
    pub(super) vertices: u32,
    pub(super) indices: u32,
}

/// Of each mesh with coarser levels of detail, by slot: where the indices of these are in the page.
pub(super) type CoarserLevels = HashMap<u32, Arc<[Range<u32>]>>;

impl MeshSnapshot {
    /// The number of the snapshot: no other one of the same cache has it.
    pub(crate) fn number(&self) -> u64 {
        self.token.number()
    }

    /// The range of a batch's mesh in its pages; `None` if it is not on the device, or not in pages.
    ///
    /// # Errors
    /// If there is no such mesh. This is a bug in Drawloom.
    pub(crate) fn mesh_range(&self, batch: &Batch) -> Result<Option<MeshRange>, BackendError> {
        let Some(mesh) = self.meshes.get(batch.mesh as usize).copied().flatten() else {
            let may_be_missing = self.is_streamed || self.imported_meshes.get(batch.mesh).is_some();
            return if may_be_missing { Ok(None) } else { Err(missing_mesh_error()) };
        };
        match batch.state.level_of_detail() as usize {
            0 => Ok(Some(mesh)),
            level => {
                let levels = self.coarser_levels.get(&batch.mesh);
                if levels.is_none() && self.outdated.contains(&batch.mesh) {
                    return Ok(Some(mesh));
                }
                let found = levels.and_then(|levels| {
                    // The mesh before may have fewer levels.
                    let coarsest = if self.outdated.contains(&batch.mesh) { levels.last() } else { None };
                    levels.get(level - 1).or(coarsest)
                });
                let indices = found.ok_or_else(missing_mesh_error)?;
                Ok(Some(MeshRange { first_index: indices.start, index_count: indices.end - indices.start, ..mesh }))
            }
        }
    }

    /// The range of the remaining indices that a batch of a list draws; `None` where it draws its whole mesh. A mesh
    /// that was replaced, and is drawn nevertheless, is drawn as a whole: what remains is of the new one.
    pub(crate) fn remaining(&self, list: &DrawList, batch: usize) -> Option<Range<u32>> {
        list.remaining(batch).filter(|_| !self.outdated.contains(&list.batches[batch].mesh))
    }

    /// Whether a batch's mesh is used, but not on the device.
    pub(crate) fn is_missing(&self, batch: &Batch) -> bool {
        self.is_streamed
            && self.meshes.get(batch.mesh as usize).is_none_or(Option::is_none)
            && self.imported_meshes.get(batch.mesh).is_none()
    }

    /// The pages of a batch's mesh; `None` if it is not on the device, or not in pages.
    pub(crate) fn pages(&self, batch: &Batch) -> Option<MeshPageIndices> {
        self.meshes.get(batch.mesh as usize).copied().flatten().map(|range| range.pages)
    }

    /// Whether all meshes lie in the same pages, and none is missing.
    pub(crate) fn has_one_page(&self) -> bool {
        !self.is_streamed && self.vertex_pages.len() == 1 && self.index_pages.len() == 1
    }

    /// Whether one pipeline of each process draws both batches.
    pub(crate) fn share_pipeline(&self, one: &Batch, other: &Batch) -> bool {
        one.state.with_level_of_detail(0) == other.state.with_level_of_detail(0)
            && (self.imported_meshes.is_empty() || self.imported_meshes.have_equal_layouts(one.mesh, other.mesh))
    }

    /// The buffers of a page of vertices.
    ///
    /// # Errors
    /// If there are none. This is a bug in Drawloom.
    pub(crate) fn vertex_buffers(&self, pages: MeshPageIndices) -> Result<&VertexBuffers, BackendError> {
        let page = self.vertex_pages.get(pages.vertices as usize).and_then(Option::as_ref);
        page.ok_or_else(|| broken_rule("a mesh lies in a page of its snapshot"))
    }

    /// The buffer of a page of indices.
    ///
    /// # Errors
    /// If there is none. This is a bug in Drawloom.
    pub(crate) fn index_buffer(&self, pages: MeshPageIndices) -> Result<&wgpu::Buffer, BackendError> {
        let page = self.index_pages.get(pages.indices as usize).and_then(Option::as_ref);
        page.ok_or_else(|| broken_rule("a mesh lies in a page of its snapshot"))
    }
}

/// The buffer of an attribute.
///
/// # Errors
/// If there is none. This is a bug in Drawloom.
pub(crate) fn attribute_of(
    attributes: &AttributeBuffers,
    layout: AttributeLayout,
) -> Result<&wgpu::Buffer, BackendError> {
    let found = attributes.iter().find(|(known, _)| *known == layout);
    found.map(|(_, buffer)| buffer).ok_or_else(|| broken_rule("attributes are uploaded before they are drawn"))
}
