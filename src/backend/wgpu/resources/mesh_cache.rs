//! The cache of meshes on the device.

use std::collections::{BTreeSet, HashSet};
use std::sync::Arc;

use super::buffers::CountedQueue;
use super::imported_meshes::ImportedMeshes;
use super::mesh_pages::{MeshBytes, MeshLocation, MeshPages, MeshTarget, PageSizes};
use super::mesh_snapshot::{CoarserLevels, MeshPageIndices, MeshRange, MeshSnapshot};
use super::snapshot_lifetimes::SnapshotLifetimes;
use super::vertex_data::{AttributeBuffers, with_vertex_bytes};
use crate::backend::BackendError;
use crate::handle::Handle;
use crate::process::DeclaredAttribute;
use crate::quality::VertexFormat;
use crate::scene::{Assets, Mesh};
use crate::view::UsedMeshes;

/// Keeps the meshes that objects use on the device, and uploads those that changed, or became used, since the last
/// frame. What lies on the device stays where it is: where there is no room, pages are added.
#[derive(Default)]
pub(crate) struct MeshCache {
    pub(super) pages: MeshPages,
    /// By slot.
    pub(super) meshes: Vec<Option<ResidentMesh>>,
    pub(super) resident_count: usize,
    /// The slots of the meshes on the device that were replaced since. Without streaming there are none.
    pub(super) outdated: BTreeSet<u32>,
    /// The slots of the meshes that are to be streamed, and not on their way.
    pub(super) missing: BTreeSet<u32>,
    pub(super) coarser_levels: Arc<CoarserLevels>,
    /// The memory of meshes that are gone.
    pub(super) lifetimes: SnapshotLifetimes<MeshLocation>,
    pub(super) imported_meshes: ImportedMeshes,
    /// What the snapshot is of.
    pub(super) current: Option<MeshVersion>,
    /// The latest one, if nothing has changed since.
    pub(super) snapshot: Option<Arc<MeshSnapshot>>,
    /// Identifies the pages: another one after they were cleared.
    pub(super) epoch: Arc<()>,
    /// The slots of the meshes that jobs are uploading to these pages.
    pub(super) in_flight: HashSet<u32>,
}

/// A mesh on the device.
#[derive(Clone, Copy)]
pub(super) struct ResidentMesh {
    pub(super) handle: Handle<Mesh>,
    /// In the assets.
    pub(super) revision: u64,
    pub(super) location: MeshLocation,
    /// Of level 0.
    index_count: u32,
}

/// What decides which meshes a frame has.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct MeshVersion {
    /// Of the assets' meshes.
    identity: u64,
    revision: u64,
    /// The revision of the meshes that are used.
    used: u64,
}

impl MeshVersion {
    pub(super) fn new(assets: &Assets, used: &UsedMeshes) -> Self {
        let (identity, revision) = (assets.meshes.identity(), assets.meshes.revision());
        Self { identity, revision, used: used.revision() }
    }

    pub(super) fn has_same_assets(self, other: Self) -> bool {
        self.identity == other.identity
    }
}

impl MeshCache {
    /// Without streaming a scene at rest has few pages, whatever its size.
    const PAGE_SIZES: PageSizes = PageSizes { min: 1 << 16, max: 8 << 20 };

    /// Adds the attributes that a plan's processes read. Returns whether one of them is new.
    pub(crate) fn require_attributes(&mut self, attributes: &[DeclaredAttribute]) -> bool {
        let Some(changed) = self.pages.attributes.with(attributes) else { return false };
        self.clear_meshes();
        self.pages.attributes = Arc::new(changed);
        true
    }

    /// The attributes of a mesh in buffers of its own.
    ///
    /// # Errors
    /// If the device has no room.
    pub(crate) fn attributes_of(
        &self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        mesh: &Mesh,
    ) -> Result<AttributeBuffers, BackendError> {
        self.pages.attributes.of_mesh(device, uploads, mesh)
    }

    /// The snapshot of those of the assets' meshes that are used, with vertices of this format: the latest one if
    /// nothing changed.
    ///
    /// # Errors
    /// If the device has no room for them.
    pub(crate) fn update(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        assets: &Assets,
        used: &UsedMeshes,
        vertices: VertexFormat,
    ) -> Result<Arc<MeshSnapshot>, BackendError> {
        self.free_unread();
        let requested = MeshVersion::new(assets, used);
        if let Some(snapshot) = &self.snapshot
            && self.current == Some(requested)
            && self.pages.format == vertices
        {
            return Ok(Arc::clone(snapshot));
        }
        if self.pages.format != vertices || self.current.is_none_or(|current| !current.has_same_assets(requested)) {
            // All vertices in a page have one size.
            self.clear_meshes();
            self.pages.format = vertices;
        }
        // No snapshot is current until the new one is complete, so an error leaves no partial one behind.
        (self.current, self.snapshot) = (None, None);
        self.retire_changed(assets, used);
        self.free_unread();
        self.upload_missing(device, uploads, assets, used)?;
        let meshes = assets.iter::<Mesh>().map(|(handle, mesh)| (handle.index(), mesh));
        let meshes = meshes.filter(|(slot, _)| used.can_be_used(*slot));
        self.imported_meshes = self.imported_meshes.updated(device, meshes)?;
        let snapshot = Arc::new(self.new_snapshot());
        self.current = Some(requested);
        self.snapshot = Some(Arc::clone(&snapshot));
        Ok(snapshot)
    }

    /// The size of all pages in bytes.
    pub(crate) fn resident_bytes(&self) -> u64 {
        self.pages.page_bytes()
    }

    /// Moves to new pages. Snapshots keep those that they refer to.
    pub(super) fn clear_meshes(&mut self) {
        (self.current, self.snapshot) = (None, None);
        (self.epoch, self.in_flight) = (Arc::default(), HashSet::new());
        self.pages.clear();
        self.meshes.clear();
        self.resident_count = 0;
        (self.outdated, self.missing) = (BTreeSet::new(), BTreeSet::new());
        self.coarser_levels = Arc::default();
        self.lifetimes = SnapshotLifetimes::following(&self.lifetimes);
    }

    /// Frees the memory of meshes that are gone, as soon as no frame in flight may read it.
    pub(super) fn free_unread(&mut self) {
        for location in self.lifetimes.reclaim() {
            self.pages.free(location);
        }
    }

    /// Retires the meshes that changed, or were removed, since they were uploaded.
    fn retire_changed(&mut self, assets: &Assets, used: &UsedMeshes) {
        self.meshes.resize(assets.meshes.slot_count().max(self.meshes.len()), None);
        for slot in 0..self.meshes.len() as u32 {
            let Some(mesh) = self.meshes[slot as usize] else { continue };
            let current = assets.meshes.get_with_revision(slot).map(|(revision, _)| revision);
            if (current != Some(mesh.revision) || !used.contains_slot(slot))
                && let Some(location) = self.remove_resident(slot)
            {
                self.lifetimes.retire(location);
            }
        }
        self.meshes.truncate(assets.meshes.slot_count());
    }

    /// Forgets the mesh in a slot. Returns where it lay.
    pub(super) fn remove_resident(&mut self, slot: u32) -> Option<MeshLocation> {
        let mesh = self.meshes.get_mut(slot as usize).and_then(Option::take)?;
        self.resident_count -= 1;
        self.outdated.remove(&slot);
        if self.coarser_levels.contains_key(&slot) {
            Arc::make_mut(&mut self.coarser_levels).remove(&slot);
        }
        self.snapshot = None;
        Some(mesh.location)
    }

    /// Uploads the used meshes that are not on the device.
    ///
    /// # Errors
    /// If the device has no room for them.
    fn upload_missing(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        assets: &Assets,
        used: &UsedMeshes,
    ) -> Result<(), BackendError> {
        let resident = &self.meshes;
        let is_missing = |slot: u32| used.contains_slot(slot) && resident[slot as usize].is_none();
        let meshes = assets.meshes.iter_with_revision();
        let missing: Vec<_> =
            meshes.filter(|(handle, _, mesh)| mesh.has_triangles() && is_missing(handle.index())).collect();
        let mut expected: MeshBytes = missing.iter().map(|(.., mesh)| self.pages.bytes_of(mesh)).sum();
        for (handle, revision, mesh) in missing {
            let location = self.pages.allocate(mesh, expected, Self::PAGE_SIZES);
            let bytes = self.pages.bytes_of(mesh);
            expected.vertices -= bytes.vertices;
            expected.indices -= bytes.indices;
            let target = self.pages.target(location)?;
            self.write(device, uploads, (handle, revision, mesh), &target)?;
        }
        Ok(())
    }

    /// Uploads a mesh to its location.
    ///
    /// # Errors
    /// If the device has no room for its page.
    pub(super) fn write(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        (handle, revision, mesh): (Handle<Mesh>, u64, &Mesh),
        target: &MeshTarget,
    ) -> Result<(), BackendError> {
        target.create_buffers(device)?;
        with_vertex_bytes(mesh, target.format, |vertices| {
            target.for_each_write(mesh, vertices, |buffer, offset, bytes| uploads.write_buffer(buffer, offset, bytes))
        })?;
        self.add_resident((handle, revision, mesh), target.location);
        Ok(())
    }

    /// Adds a mesh that was written to its location.
    pub(super) fn add_resident(
        &mut self,
        (handle, revision, mesh): (Handle<Mesh>, u64, &Mesh),
        location: MeshLocation,
    ) {
        let slot = handle.index();
        let index_count = mesh.indices().len() as u32;
        let mut end = location.indices.start + index_count;
        let ranges = mesh.levels().iter().map(|level| {
            let start = end;
            end += level.indices().len() as u32;
            start..end
        });
        let ranges: Arc<[_]> = ranges.collect();
        if !ranges.is_empty() {
            Arc::make_mut(&mut self.coarser_levels).insert(slot, ranges);
        }
        self.resident_count += 1;
        self.meshes[slot as usize] = Some(ResidentMesh { handle, revision, location, index_count });
    }

    pub(super) fn new_snapshot(&mut self) -> MeshSnapshot {
        let (mut vertex_pages, mut index_pages) = (Vec::new(), Vec::new());
        let mut add = |MeshLocation { vertices, indices }: MeshLocation| {
            add_page(&mut vertex_pages, vertices.page, |page| self.pages.vertex_buffers(page).cloned());
            add_page(&mut index_pages, indices.page, |page| self.pages.index_buffer(page).cloned());
        };
        let mut range = |mesh: ResidentMesh| {
            let ResidentMesh { location, index_count, .. } = mesh;
            add(location);
            MeshRange {
                base_vertex: location.vertices.start as i32,
                first_index: location.indices.start,
                index_count,
                pages: MeshPageIndices { vertices: location.vertices.page, indices: location.indices.page },
            }
        };
        let meshes = self.meshes.iter().copied().map(|mesh| mesh.map(&mut range)).collect();
        MeshSnapshot {
            token: self.lifetimes.begin_snapshot(),
            vertex_pages,
            index_pages,
            meshes,
            coarser_levels: Arc::clone(&self.coarser_levels),
            outdated: self.outdated.clone(),
            imported_meshes: self.imported_meshes.clone(),
            is_streamed: false,
        }
    }
}

/// Adds the buffers of a page to those by index, if they are not there.
fn add_page<B>(pages: &mut Vec<Option<B>>, page: u32, buffers: impl FnOnce(u32) -> Option<B>) {
    let index = page as usize;
    if pages.len() <= index {
        pages.resize_with(index + 1, || None);
    }
    if pages[index].is_none() {
        pages[index] = buffers(page);
    }
}
