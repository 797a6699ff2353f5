//! The cache of meshes on the device.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::arena::Arena;
use super::attribute_arenas::{AttributeArenas, AttributeBuffers};
use super::imported_meshes::ImportedMeshes;
use super::upload_queue::UploadQueue;
use super::vertex_layout::{vertex_stride, with_vertex_bytes};
use crate::backend::BackendError;
use crate::backend::error::broken_rule;
use crate::backend::subdivision_cache::missing_mesh_error;
use crate::command::Batch;
use crate::process::DeclaredAttribute;
use crate::quality::VertexFormat;
use crate::scene::{Assets, AttributeLayout, LevelOfDetail, Mesh};
use crate::view::UsedMeshes;

/// The meshes of a frame. It stays valid while meshes change for later frames.
pub(crate) struct MeshSnapshot {
    pub(crate) vertices: wgpu::Buffer,
    pub(crate) indices: wgpu::Buffer,
    attributes: AttributeBuffers,
    /// By mesh slot.
    meshes: Vec<Option<MeshRange>>,
    coarser_levels: CoarserLevels,
    /// Those that are not in the arenas, but in buffers of the engine's own.
    pub(crate) imported_meshes: ImportedMeshes,
}

impl MeshSnapshot {
    /// The range of a batch's mesh in the arenas.
    ///
    /// # Errors
    /// If there is no such mesh. This is a bug in Drawloom.
    pub(crate) fn mesh_range(&self, batch: &Batch) -> Result<MeshRange, BackendError> {
        let mesh = self.meshes.get(batch.mesh as usize).copied().flatten().ok_or_else(missing_mesh_error)?;
        match batch.state.level_of_detail() as usize {
            0 => Ok(mesh),
            level => {
                let levels = self.coarser_levels.get(&batch.mesh);
                let indices = levels.and_then(|levels| levels.get(level - 1)).ok_or_else(missing_mesh_error)?;
                Ok(MeshRange { first_index: indices.start, index_count: indices.end - indices.start, ..mesh })
            }
        }
    }

    /// Whether one pipeline of each process draws both batches.
    pub(crate) fn share_pipeline(&self, one: &Batch, other: &Batch) -> bool {
        one.state.with_level_of_detail(0) == other.state.with_level_of_detail(0)
            && (self.imported_meshes.is_empty() || self.imported_meshes.have_equal_layouts(one.mesh, other.mesh))
    }

    /// The values of an attribute of all meshes in the arenas.
    ///
    /// # Errors
    /// If no plan has required it. This is a bug in Drawloom.
    pub(crate) fn attribute(&self, layout: AttributeLayout) -> Result<&wgpu::Buffer, BackendError> {
        attribute_of(&self.attributes, layout)
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

/// The range of a mesh in the arenas.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshRange {
    pub(crate) base_vertex: i32,
    pub(crate) first_index: u32,
    pub(crate) index_count: u32,
    revision: u64,
}

/// Of each mesh with coarser levels of detail, by slot: where the indices of these are in the arena.
type CoarserLevels = HashMap<u32, Vec<Range<u32>>>;

/// Keeps the meshes that objects use on the device, and uploads those that changed, or became used, since the last frame.
pub(crate) struct MeshCache {
    vertices: Arena,
    /// Of the vertices in the arena.
    format: VertexFormat,
    indices: Arena,
    attributes: AttributeArenas,
    meshes: Vec<Option<MeshRange>>,
    coarser_levels: CoarserLevels,
    imported_meshes: ImportedMeshes,
    /// What the snapshot is of.
    current: Option<MeshVersion>,
    snapshot: Option<Arc<MeshSnapshot>>,
}

/// What decides which meshes a frame has.
#[derive(Clone, Copy, PartialEq, Eq)]
struct MeshVersion {
    /// Of the assets' meshes.
    identity: u64,
    revision: u64,
    /// The revision of the meshes that are used.
    used: u64,
}

impl Default for MeshCache {
    fn default() -> Self {
        Self {
            vertices: new_vertex_arena(),
            format: VertexFormat::default(),
            indices: Arena::new("indices", wgpu::BufferUsages::INDEX),
            attributes: AttributeArenas::default(),
            meshes: Vec::new(),
            coarser_levels: CoarserLevels::default(),
            imported_meshes: ImportedMeshes::default(),
            current: None,
            snapshot: None,
        }
    }
}

impl MeshCache {
    /// Adds the attributes that a plan's processes read. Returns whether one of them is new.
    pub(crate) fn require_attributes(&mut self, attributes: &[DeclaredAttribute]) -> bool {
        let changed = self.attributes.require(attributes);
        if changed {
            // Nothing fits into an arena without room, so all meshes move to a new one, with all attributes.
            self.vertices = new_vertex_arena();
            self.current = None;
        }
        changed
    }

    /// The attributes of a mesh in buffers of its own.
    ///
    /// # Errors
    /// If the device has no room.
    pub(crate) fn attributes_of(
        &self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        mesh: &Mesh,
    ) -> Result<AttributeBuffers, BackendError> {
        self.attributes.of_mesh(device, uploads, mesh)
    }

    /// The snapshot of those of the assets' meshes that are used, with vertices of this format: the latest one if nothing changed.
    ///
    /// # Errors
    /// If the device has no room for them.
    pub(crate) fn update(
        &mut self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        assets: &Assets,
        used: &UsedMeshes,
        vertices: VertexFormat,
    ) -> Result<Arc<MeshSnapshot>, BackendError> {
        let (identity, revision) = (assets.meshes.identity(), assets.meshes.revision());
        let requested = MeshVersion { identity, revision, used: used.revision() };
        if let Some(snapshot) = &self.snapshot
            && self.current == Some(requested)
            && self.format == vertices
        {
            return Ok(Arc::clone(snapshot));
        }
        if self.format != vertices {
            // `base_vertex` counts in vertices, so all vertices in an arena have one size.
            (self.vertices, self.format) = (new_vertex_arena(), vertices);
            self.clear_meshes();
        }
        if self.current.is_none_or(|current| current.identity != identity) {
            self.clear_meshes();
        }
        // No snapshot is current until the new one is complete, so an error leaves no partial one behind.
        self.current = None;
        self.update_meshes(device, uploads, assets, used)?;
        let meshes = assets.iter::<Mesh>().map(|(handle, mesh)| (handle.index(), mesh));
        self.imported_meshes = self.imported_meshes.updated(device, meshes)?;
        let (Some(vertices), Some(indices)) = (self.vertices.buffer(), self.indices.buffer()) else {
            return Err(broken_rule("arenas have buffers"));
        };
        let snapshot = Arc::new(MeshSnapshot {
            vertices: vertices.clone(),
            indices: indices.clone(),
            attributes: self.attributes.buffers().clone(),
            meshes: self.meshes.clone(),
            coarser_levels: self.coarser_levels.clone(),
            imported_meshes: self.imported_meshes.clone(),
        });
        self.current = Some(requested);
        self.snapshot = Some(Arc::clone(&snapshot));
        Ok(snapshot)
    }

    fn clear_meshes(&mut self) {
        self.meshes.clear();
        self.coarser_levels.clear();
    }

    fn update_meshes(
        &mut self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        assets: &Assets,
        used: &UsedMeshes,
    ) -> Result<(), BackendError> {
        let used = || assets.meshes.iter_with_revision().filter(|(handle, ..)| used.contains(*handle));
        self.meshes.resize(assets.meshes.slot_count(), None);
        let mut live = vec![false; self.meshes.len()];
        let mut changed = Vec::new();
        for (handle, revision, mesh) in used() {
            let slot = handle.index() as usize;
            live[slot] = true;
            if self.meshes[slot].is_none_or(|range| range.revision != revision) {
                changed.push((slot, revision, mesh));
            }
        }
        for (range, live) in self.meshes.iter_mut().zip(live) {
            if !live {
                *range = None;
            }
        }
        self.coarser_levels.retain(|slot, _| self.meshes[*slot as usize].is_some());
        let format = self.format;
        let bytes = changed.iter().map(|(_, _, mesh)| bytes_of(mesh, format));
        let (vertex_bytes, index_bytes) = bytes.fold((0, 0), |sum, bytes| (sum.0 + bytes.0, sum.1 + bytes.1));
        if !self.vertices.fits(vertex_bytes) || !self.indices.fits(index_bytes) {
            // All used meshes move to new buffers, which leaves the garbage behind.
            let bytes = used().map(|(.., mesh)| bytes_of(mesh, format));
            let (vertex_bytes, index_bytes) = bytes.fold((0, 0), |sum, bytes| (sum.0 + bytes.0, sum.1 + bytes.1));
            self.vertices.reallocate(device, vertex_bytes)?;
            self.indices.reallocate(device, index_bytes)?;
            self.attributes.reallocate(device, self.vertices.size() / vertex_stride(format))?;
            changed = used().map(|(handle, revision, mesh)| (handle.index() as usize, revision, mesh)).collect();
        }
        for (slot, revision, mesh) in changed {
            let vertices = with_vertex_bytes(mesh, format, |bytes| self.vertices.append(uploads, bytes));
            let indices = self.indices.append(uploads, bytemuck::cast_slice(mesh.indices()));
            self.attributes.write(uploads, mesh, vertices / vertex_stride(format));
            self.coarser_levels.remove(&(slot as u32));
            if !mesh.levels().is_empty() {
                let append = |level: &LevelOfDetail| {
                    let first = (self.indices.append(uploads, bytemuck::cast_slice(level.indices())) / 4) as u32;
                    first..first + level.indices().len() as u32
                };
                self.coarser_levels.insert(slot as u32, mesh.levels().iter().map(append).collect());
            }
            self.meshes[slot] = Some(MeshRange {
                base_vertex: (vertices / vertex_stride(format)) as i32,
                first_index: (indices / 4) as u32,
                index_count: mesh.indices().len() as u32,
                revision,
            });
        }
        Ok(())
    }
}

fn new_vertex_arena() -> Arena {
    Arena::new("vertices", wgpu::BufferUsages::VERTEX)
}

fn bytes_of(mesh: &Mesh, format: VertexFormat) -> (u64, u64) {
    let levels = mesh.levels().iter().map(|level| size_of_val(level.indices()));
    let indices = size_of_val(mesh.indices()) + levels.sum::<usize>();
    (mesh.vertices().len() as u64 * vertex_stride(format), indices as u64)
}
