//! Meshes that are streamed: they come to the device by background jobs, and make room for others.

use std::collections::BTreeSet;
use std::iter;
use std::sync::Arc;

use super::buffers::CountedQueue;
use super::mesh_cache::{MeshCache, MeshVersion};
use super::mesh_pages::{MeshLocation, MeshTarget, PageSizes};
use super::mesh_snapshot::MeshSnapshot;
use super::snapshot_lifetimes::LastReader;
use crate::backend::BackendError;
use crate::handle::Handle;
use crate::quality::VertexFormat;
use crate::scene::{Assets, Mesh};
use crate::view::UsedMeshes;

/// Where something that is streamed will lie.
pub(crate) struct Placed<T> {
    pub(crate) target: T,
    /// It may be written to when that is gone.
    pub(crate) last_reader: LastReader,
}

/// Why something that is streamed has no room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unplaced {
    /// It will have as soon as what is on its way to the same texture array has arrived.
    Awaited,
    /// What could make room for it is not enough.
    Full,
    /// Its texture array has as many layers as the device allows, and none can make room.
    LayerLimit,
    /// It can never have any: the bytes that it takes, and the limit of this name with the bytes that it allows.
    TooLarge { bytes: u64, limit: &'static str, allowed: u64 },
}

/// What became of an upload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EndOfUpload {
    /// It is on the device.
    Resident,
    /// It is not needed any more, or could not be uploaded.
    Dropped,
    /// It belongs to what was cleared since.
    Stale,
}

impl MeshCache {
    /// Begins a frame with meshes that are streamed. Meshes that replace others on the device are uploaded at once, if
    /// there is room, up to a number of bytes. Otherwise the one before stays, and is drawn, until the new one arrives.
    ///
    /// # Errors
    /// If the device has no room.
    pub(crate) fn begin_streamed_frame(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        (assets, used): (&Assets, &UsedMeshes),
        vertices: VertexFormat,
        (budget, mut bytes_at_once): (u64, u64),
    ) -> Result<(), BackendError> {
        self.release_unread();
        let requested = MeshVersion::new(assets, used);
        if self.pages.format != vertices || self.current.is_some_and(|current| !current.has_same_assets(requested)) {
            self.clear_meshes();
            self.pages.format = vertices;
        }
        if self.current == Some(requested) {
            return Ok(());
        }
        self.current = None;
        self.meshes.resize(assets.meshes.slot_count().max(self.meshes.len()), None);
        for slot in 0..self.meshes.len() as u32 {
            let Some(resident) = self.meshes[slot as usize] else { continue };
            match self.used_mesh(assets, used, slot) {
                Some((_, revision, _)) if revision == resident.revision => {}
                Some((handle, revision, mesh)) if handle == resident.handle => {
                    self.snapshot = None;
                    self.outdated.insert(slot);
                    let bytes = self.pages.bytes_of(mesh).total();
                    if bytes <= bytes_at_once
                        && self.replace_at_once(device, uploads, (handle, revision, mesh), budget)?
                    {
                        bytes_at_once -= bytes;
                    }
                }
                _ => self.take_off(slot),
            }
        }
        self.meshes.truncate(assets.meshes.slot_count());
        let is_missing = |slot: &u32| self.is_missing(*slot) && self.used_mesh(assets, used, *slot).is_some();
        let missing: BTreeSet<_> = (0..self.meshes.len() as u32).filter(is_missing).collect();
        self.missing = missing;
        let imported = assets.iter::<Mesh>().map(|(handle, mesh)| (handle.index(), mesh));
        let imported = imported.filter(|(slot, _)| used.can_be_used(*slot));
        self.imported_meshes = self.imported_meshes.updated(device, imported)?;
        // Meshes in the engine's own buffers may have come or gone.
        self.snapshot = None;
        self.current = Some(requested);
        Ok(())
    }

    /// Uploads a mesh that replaces one on the device, if there is room that no frame in flight reads. Returns whether
    /// there is.
    ///
    /// # Errors
    /// If the device has no room.
    fn replace_at_once(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        (handle, revision, mesh): (Handle<Mesh>, u64, &Mesh),
        budget: u64,
    ) -> Result<bool, BackendError> {
        let Ok(Placed { target, last_reader }) = self.place(device, mesh, budget, iter::empty(), &mut 0)? else {
            return Ok(false);
        };
        let is_free = self.lifetimes.is_gone(last_reader);
        if is_free {
            self.take_off(handle.index());
            self.write(device, uploads, (handle, revision, mesh), &target)?;
        } else {
            self.pages.free(target.location);
        }
        Ok(is_free)
    }

    /// The mesh in a slot if it is used and lies in pages, with its handle and revision.
    fn used_mesh<'a>(&self, assets: &'a Assets, used: &UsedMeshes, slot: u32) -> Option<(Handle<Mesh>, u64, &'a Mesh)> {
        let found = assets.meshes.entry(slot).filter(|(.., mesh)| mesh.has_triangles());
        found.filter(|_| used.contains_slot(slot))
    }

    /// Whether the slot has no mesh that is on the device unchanged, or on its way.
    fn is_missing(&self, slot: u32) -> bool {
        let is_resident = self.meshes[slot as usize].is_some() && !self.outdated.contains(&slot);
        !is_resident && !self.in_flight.contains(&slot)
    }

    /// The meshes that are used, and neither on the device, unchanged, nor on their way: with handle and revision.
    pub(crate) fn missing<'a>(&self, assets: &'a Assets) -> impl Iterator<Item = (Handle<Mesh>, u64, &'a Mesh)> {
        self.missing.iter().filter_map(|slot| assets.meshes.entry(*slot))
    }

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
        let sizes = PageSizes { min: 1 << 16, max: (budget / 16).clamp(1 << 16, (4 << 20).min(max_buffer_size)) };
        let (meshes, pages) = (&self.meshes, &mut self.pages);
        let candidates = candidates.filter_map(|slot| Some((slot, meshes.get(slot as usize)?.as_ref()?.location)));
        let Some(room) = pages.find_room(mesh, (sizes, budget), candidates) else { return Ok(Err(Unplaced::Full)) };
        *evictions += room.evicted.len();
        for slot in &room.evicted {
            if let Some(location) = self.remove_resident(*slot) {
                self.lifetimes.retire(location);
                // One that is being uploaded, in place of this version, is not missing.
                if !self.in_flight.contains(slot) {
                    self.missing.insert(*slot);
                }
            }
        }
        let target = self.pages.target(room.location)?;
        // The memory of pages that were released is free when nothing reads them any more.
        let is_written = |retired: &MeshLocation| room.releases_pages || retired.overlaps(room.location);
        let last_reader = self.lifetimes.last_reader(is_written);
        Ok(Ok(Placed { target, last_reader }))
    }

    /// A frame uses no mesh that is larger than a buffer of the device, but it may be larger than the budget.
    fn exceeded_limit(&self, mesh: &Mesh, budget: u64) -> Option<Unplaced> {
        let bytes = self.pages.bytes_of(mesh).total();
        (bytes > budget).then_some(Unplaced::TooLarge { bytes, limit: "mesh_bytes", allowed: budget })
    }

    /// The slots of the meshes on the device, with their bytes.
    pub(crate) fn resident(&self) -> impl Iterator<Item = u32> {
        (0..).zip(&self.meshes).filter(|(_, mesh)| mesh.is_some()).map(|(slot, _)| slot)
    }

    /// Whether a mesh in a slot is on the device, be it the current one or one that it replaced.
    pub(crate) fn is_resident(&self, slot: u32) -> bool {
        self.meshes.get(slot as usize).is_some_and(Option::is_some)
    }

    /// The number of meshes on the device.
    pub(crate) fn resident_count(&self) -> usize {
        self.resident_count
    }

    /// Whether what may be written once this reader is gone may be written now.
    pub(crate) fn is_gone(&self, last_reader: LastReader) -> bool {
        self.lifetimes.is_gone(last_reader)
    }

    /// Takes a mesh off the device. Its memory is free for those whose upload waits until nothing reads it.
    fn take_off(&mut self, slot: u32) {
        if let Some(location) = self.remove_resident(slot) {
            self.lifetimes.retire(location);
            self.pages.vacate(location);
        }
    }

    /// Releases pages that are empty, and that no frame in flight reads any more.
    fn release_unread(&mut self) {
        for MeshLocation { vertices, indices } in self.lifetimes.reclaim() {
            let reads =
                |page: fn(&MeshLocation) -> u32, index| self.lifetimes.retired().any(|other| page(other) == index);
            if !reads(|location| location.vertices.page, vertices.page) {
                self.pages.vertices.release_if_empty(vertices.page);
            }
            if !reads(|location| location.indices.page, indices.page) {
                self.pages.indices.release_if_empty(indices.page);
            }
        }
    }

    /// A job is about to upload the mesh in a slot.
    pub(crate) fn begin_upload(&mut self, slot: u32) -> Arc<()> {
        self.in_flight.insert(slot);
        self.missing.remove(&slot);
        Arc::clone(&self.epoch)
    }

    /// Identifies the pages.
    pub(crate) fn epoch(&self) -> &Arc<()> {
        &self.epoch
    }

    /// Whether these are the pages of this cache.
    pub(crate) fn is_current(&self, epoch: &Arc<()>) -> bool {
        Arc::ptr_eq(epoch, &self.epoch)
    }

    /// A job has uploaded a mesh, or could not. Nothing is drawn with it if it is gone meanwhile; if it changed, it is
    /// drawn until the next one arrives.
    pub(crate) fn end_upload(
        &mut self,
        epoch: &Arc<()>,
        (handle, revision, mesh): (Handle<Mesh>, u64, &Mesh),
        target: &MeshTarget,
        (assets, used, is_complete): (&Assets, &UsedMeshes, bool),
    ) -> EndOfUpload {
        if !self.is_current(epoch) {
            return EndOfUpload::Stale;
        }
        let slot = handle.index();
        self.in_flight.remove(&slot);
        let current = self.used_mesh(assets, used, slot).filter(|(current, ..)| *current == handle);
        let before = self.meshes.get(slot as usize).copied().flatten();
        let is_newer = before.is_none_or(|before| before.handle != handle || before.revision < revision);
        let is_needed = is_complete && is_newer && current.is_some();
        if is_needed {
            self.take_off(slot);
            self.add_resident((handle, revision, mesh), target.location);
            self.snapshot = None;
        } else {
            // No snapshot refers to it.
            self.pages.free(target.location);
        }
        if current.is_some_and(|(_, current, _)| current != revision) {
            self.outdated.extend(self.meshes[slot as usize].map(|_| slot));
        }
        if self.used_mesh(assets, used, slot).is_some() && self.is_missing(slot) {
            self.missing.insert(slot);
        }
        if is_needed { EndOfUpload::Resident } else { EndOfUpload::Dropped }
    }

    /// The snapshot of what is on the device: the latest one if nothing changed.
    pub(crate) fn streamed_snapshot(&mut self) -> Arc<MeshSnapshot> {
        if let Some(snapshot) = &self.snapshot {
            return Arc::clone(snapshot);
        }
        let snapshot = Arc::new(MeshSnapshot { is_streamed: true, ..self.new_snapshot() });
        self.snapshot = Some(Arc::clone(&snapshot));
        snapshot
    }

    /// The number of meshes on the way.
    pub(crate) fn in_flight(&self) -> usize {
        self.in_flight.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Topology, Vertex};

    #[test]
    fn a_mesh_is_too_large_for_the_budget_by_name() {
        let mesh = Mesh::new("sheet", Topology::TriangleList, vec![Vertex::default(); 100], vec![0; 300]).unwrap();
        let cache = MeshCache::default();
        let too_large = Unplaced::TooLarge { bytes: 4400, limit: "mesh_bytes", allowed: 4399 };
        assert_eq!(cache.exceeded_limit(&mesh, 4400), None);
        assert_eq!(cache.exceeded_limit(&mesh, 4399), Some(too_large));
    }
}
