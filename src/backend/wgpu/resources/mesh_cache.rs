//! The cache of meshes on the device.

use std::iter;
use std::sync::Arc;

use super::buffers::CountedQueue;
use super::imported_meshes::ImportedMeshes;
use super::mesh_pages::{MeshBytes, MeshLocation, MeshTarget, PageSizes, ResidentMeshes};
use super::mesh_snapshot::{CoarserLevels, MeshPageIndices, MeshRange, MeshSnapshot};
use super::residents::{EndOfUpload, InFlight, Placed, Unplaced};
use super::vertex_data::{AttributeBuffers, with_vertex_bytes};
use crate::backend::BackendError;
use crate::backend::error::broken_rule;
use crate::handle::Handle;
use crate::process::DeclaredAttribute;
use crate::quality::VertexFormat;
use crate::scene::{Assets, Mesh};
use crate::view::UsedMeshes;

/// Keeps the meshes that objects use on the device. What lies on the device stays where it is: where there is no room,
/// pages are added.
#[derive(Default)]
pub(crate) struct MeshCache {
    pub(crate) residents: ResidentMeshes,
    /// A mesh that is gone keeps its entry until another one is in its slot.
    coarser_levels: Arc<CoarserLevels>,
    imported_meshes: ImportedMeshes,
    /// The latest one, with the number of changes at that time.
    snapshot: Option<(u64, Arc<MeshSnapshot>)>,
}

/// What meshes that are streamed may take, in bytes.
#[derive(Clone, Copy)]
pub(crate) struct MeshBudget {
    /// Of all pages.
    pub(crate) pages: u64,
    /// Of the meshes that a frame itself uploads, because they replace others on the device.
    pub(crate) at_once: u64,
}

impl MeshCache {
    /// Adds the attributes that a plan's processes read. Returns whether one of them is new.
    pub(crate) fn require_attributes(&mut self, attributes: &[DeclaredAttribute]) -> bool {
        let Some(changed) = self.residents.memory.attributes.with(attributes) else { return false };
        self.residents.clear();
        self.residents.memory.attributes = Arc::new(changed);
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
        self.residents.memory.attributes.of_mesh(device, uploads, mesh)
    }

    /// Begins a frame with those of the assets' meshes that are used, with vertices of this format. Without a budget,
    /// meshes that changed, or became used, since the last frame are uploaded at once. With one, only those are that
    /// replace others on the device and have room beside them; the one before stays, and is drawn, until then.
    ///
    /// # Errors
    /// If the device has no room for them. The next frame uploads all meshes anew.
    pub(crate) fn begin_frame(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        (assets, used): (&Assets, &UsedMeshes),
        vertices: VertexFormat,
        budget: Option<MeshBudget>,
    ) -> Result<(), BackendError> {
        if self.residents.memory.format != vertices {
            // All vertices in a page have one size.
            self.residents.clear();
            self.residents.memory.format = vertices;
        }
        if !self.residents.begin_frame(&assets.meshes, (used.revision(), lies_in_pages(used)), budget.is_some()) {
            return Ok(());
        }
        // Its memory may be written now, unless a frame in flight has it too.
        self.snapshot = None;
        let mut upload = || {
            match budget {
                Some(budget) => self.replace_outdated(device, uploads, assets, budget)?,
                None => self.upload_missing(device, uploads, assets)?,
            }
            let meshes = assets.iter::<Mesh>().map(|(handle, mesh)| (handle.index(), mesh));
            let meshes = meshes.filter(|(slot, _)| used.can_be_used(*slot));
            self.imported_meshes = self.imported_meshes.updated(device, meshes)?;
            Ok(())
        };
        upload().inspect_err(|_| self.residents.clear())
    }

    /// Uploads the meshes that are missing.
    ///
    /// # Errors
    /// If the device has no room for them.
    fn upload_missing(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        assets: &Assets,
    ) -> Result<(), BackendError> {
        self.residents.release_unread(false);
        let missing: Vec<_> = self.residents.missing(&assets.meshes).collect();
        let mut expected: MeshBytes = missing.iter().map(|(.., mesh)| self.residents.memory.bytes_of(mesh)).sum();
        for (handle, revision, mesh) in missing {
            let pages = &mut self.residents.memory;
            let sizes = pages.sizes_for(expected);
            let bytes = pages.bytes_of(mesh);
            expected.vertices -= bytes.vertices;
            expected.indices -= bytes.indices;
            let room = pages.find_room(mesh, (sizes, u64::MAX), iter::empty());
            let room = room.ok_or_else(|| broken_rule("without a budget there is room"))?;
            let target = pages.target(room.location)?;
            self.write(device, uploads, (handle, revision, mesh), &target)?;
        }
        Ok(())
    }

    /// Uploads meshes that replace others on the device, where there is room that no frame in flight reads.
    ///
    /// # Errors
    /// If the device has no room.
    fn replace_outdated(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        assets: &Assets,
        mut budget: MeshBudget,
    ) -> Result<(), BackendError> {
        let outdated = self.residents.outdated.iter().filter_map(|slot| assets.meshes.entry(*slot));
        for (handle, revision, mesh) in outdated.collect::<Vec<_>>() {
            let bytes = self.residents.memory.bytes_of(mesh).total();
            if bytes > budget.at_once {
                continue;
            }
            let placed = self.residents.place(device, mesh, budget.pages, iter::empty(), &mut 0)?;
            let Ok(Placed { target, last_reader }) = placed else { continue };
            if self.residents.is_gone(last_reader) {
                self.residents.take_off(handle.index());
                self.write(device, uploads, (handle, revision, mesh), &target)?;
                budget.at_once -= bytes;
            } else {
                self.residents.free(target.location);
            }
        }
        Ok(())
    }

    /// Uploads a mesh to its location.
    ///
    /// # Errors
    /// If the device has no room for its page.
    fn write(
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
        self.residents.add((handle, revision), target.location);
        self.set_coarser_levels(handle.index(), mesh, target.location);
        Ok(())
    }

    /// A job has uploaded a mesh, or could not.
    pub(crate) fn end_upload(
        &mut self,
        (upload, mesh): (&InFlight<Mesh>, &Mesh),
        location: MeshLocation,
        (assets, used, is_complete): (&Assets, &UsedMeshes, bool),
    ) -> EndOfUpload {
        let end = self.residents.end_upload(upload, &assets.meshes, lies_in_pages(used), is_complete);
        if end == EndOfUpload::Resident {
            self.set_coarser_levels(upload.handle.index(), mesh, location);
        }
        end
    }

    /// Sets the coarser levels of the mesh in a slot.
    fn set_coarser_levels(&mut self, slot: u32, mesh: &Mesh, location: MeshLocation) {
        let mut end = location.indices.start + location.index_count;
        let ranges = mesh.levels().iter().map(|level| {
            let start = end;
            end += level.indices().len() as u32;
            start..end
        });
        let ranges: Arc<[_]> = ranges.collect();
        if !ranges.is_empty() {
            Arc::make_mut(&mut self.coarser_levels).insert(slot, ranges);
        } else if self.coarser_levels.contains_key(&slot) {
            Arc::make_mut(&mut self.coarser_levels).remove(&slot);
        }
    }

    /// The snapshot of what is on the device: the latest one if nothing changed.
    pub(crate) fn snapshot(&mut self, is_streamed: bool) -> Arc<MeshSnapshot> {
        let changes = self.residents.changes();
        self.snapshot.take_if(|(of, _)| *of != changes);
        match &self.snapshot {
            Some((_, snapshot)) => Arc::clone(snapshot),
            None => {
                let snapshot = Arc::new(self.new_snapshot(is_streamed));
                self.snapshot = Some((changes, Arc::clone(&snapshot)));
                snapshot
            }
        }
    }

    fn new_snapshot(&mut self, is_streamed: bool) -> MeshSnapshot {
        let token = self.residents.lifetimes.begin_snapshot();
        let pages = &self.residents.memory;
        let (mut vertex_pages, mut index_pages) = (Vec::new(), Vec::new());
        let mut range = |MeshLocation { vertices, indices, index_count }: MeshLocation| {
            add_page(&mut vertex_pages, vertices.page, |page| pages.vertex_buffers(page).cloned());
            add_page(&mut index_pages, indices.page, |page| pages.index_buffer(page).cloned());
            MeshRange {
                base_vertex: vertices.start as i32,
                first_index: indices.start,
                index_count,
                pages: MeshPageIndices { vertices: vertices.page, indices: indices.page },
            }
        };
        let meshes = self.residents.slots.iter();
        let meshes = meshes.map(|mesh| mesh.as_ref().map(|mesh| range(mesh.location))).collect();
        MeshSnapshot {
            token,
            vertex_pages,
            index_pages,
            meshes,
            coarser_levels: Arc::clone(&self.coarser_levels),
            outdated: self.residents.outdated.clone(),
            imported_meshes: self.imported_meshes.clone(),
            is_streamed,
        }
    }
}

impl ResidentMeshes {
    /// Finds room for a mesh in the pages, or adds pages if the budget allows. Otherwise the candidates make room, the
    /// first ones first. `evictions` counts them.
    ///
    /// # Errors
    /// If there is no such page. This is a bug in Drawloom.
    pub(crate) fn place(
        &mut self,
        device: &wgpu::Device,
        mesh: &Mesh,
        budget: u64,
        candidates: impl Iterator<Item = u32>,
        evictions: &mut usize,
    ) -> Result<Result<Placed<MeshTarget>, Unplaced>, BackendError> {
        let max_buffer_size = device.limits().max_buffer_size;
        if let Some(too_large) = self.exceeded_limit(mesh, budget) {
            return Ok(Err(too_large));
        }
        let max = (budget / 16).clamp(1 << 16, (4 << 20).min(max_buffer_size));
        let sizes = PageSizes { min: 1 << 16, max: MeshBytes { vertices: max, indices: max } };
        let (meshes, pages) = (&self.slots, &mut self.memory);
        let candidates = candidates.filter_map(|slot| Some((slot, meshes.get(slot as usize)?.as_ref()?.location)));
        let Some(room) = pages.find_room(mesh, (sizes, budget), candidates) else { return Ok(Err(Unplaced::Full)) };
        *evictions += room.evicted.len();
        // Their memory is the mesh's already.
        room.evicted.iter().for_each(|slot| self.retire(*slot));
        let target = self.memory.target(room.location)?;
        // The memory of pages that were released is free when nothing reads them any more.
        let is_written = |retired: &MeshLocation| room.releases_pages || retired.overlaps(room.location);
        let last_reader = self.lifetimes.last_reader(is_written);
        Ok(Ok(Placed { target, last_reader }))
    }

    /// A frame uses no mesh that is larger than a buffer of the device, but it may be larger than the budget.
    fn exceeded_limit(&self, mesh: &Mesh, budget: u64) -> Option<Unplaced> {
        let bytes = self.memory.bytes_of(mesh).total();
        (bytes > budget).then_some(Unplaced::TooLarge { bytes, limit: "mesh_bytes", allowed: budget })
    }
}

/// Whether a mesh in a slot is used, and not in buffers of its own.
fn lies_in_pages(used: &UsedMeshes) -> impl Fn(u32, &Mesh) -> bool {
    |slot, mesh| mesh.has_triangles() && used.contains_slot(slot)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Topology, Vertex};

    #[test]
    fn a_mesh_is_too_large_for_the_budget_by_name() {
        let mesh = Mesh::new("sheet", Topology::TriangleList, vec![Vertex::default(); 100], vec![0; 300]).unwrap();
        let meshes = ResidentMeshes::default();
        let too_large = Unplaced::TooLarge { bytes: 4400, limit: "mesh_bytes", allowed: 4399 };
        assert_eq!(meshes.exceeded_limit(&mesh, 4400), None);
        assert_eq!(meshes.exceeded_limit(&mesh, 4399), Some(too_large));
    }
}
