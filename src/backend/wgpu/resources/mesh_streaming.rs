//! Meshes that are streamed: they come to the device by background jobs, and make room for others.

use std::sync::Arc;

use super::mesh_cache::{MeshCache, MeshVersion};
use super::mesh_pages::{MeshTarget, PageSizes};
use super::mesh_snapshot::MeshSnapshot;
use super::upload_queue::UploadQueue;
use crate::backend::BackendError;
use crate::quality::VertexFormat;
use crate::scene::{Assets, Mesh};
use crate::view::UsedMeshes;

/// Whether something that is streamed has room.
pub(crate) enum Room<T> {
    /// It has.
    Found(T),
    /// It will have as soon as no frame in flight reads what was evicted.
    Awaited,
    /// Others have to be evicted: at least so many bytes.
    Missing(u64),
}

impl MeshCache {
    /// Begins a frame with meshes that are streamed. A mesh that replaces one on the device is uploaded at once, if there is room: otherwise
    /// what is in sight would vanish.
    ///
    /// # Errors
    /// If the device has no room.
    pub(crate) fn begin_streamed_frame(
        &mut self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        (assets, used): (&Assets, &UsedMeshes),
        vertices: VertexFormat,
        budget: u64,
    ) -> Result<(), BackendError> {
        self.free_unread();
        let requested = MeshVersion::new(assets, used);
        if self.pages.format != vertices || self.current.is_some_and(|current| !current.has_same_assets(requested)) {
            self.clear_meshes();
            self.pages.format = vertices;
        }
        if self.current == Some(requested) {
            return Ok(());
        }
        self.current = None;
        for slot in self.retire_changed(assets, used) {
            self.snapshot = None;
            let replaced = assets.meshes.get_with_revision(slot).filter(|(_, mesh)| mesh.has_triangles());
            let Some((revision, mesh)) = replaced.filter(|_| used.contains_slot(slot)) else { continue };
            if let Room::Found(target) = self.find_room(mesh, budget)? {
                self.write(device, uploads, (slot, revision, mesh), &target)?;
            }
        }
        let imported = assets.iter::<Mesh>().map(|(handle, mesh)| (handle.index(), mesh));
        self.imported_meshes = self.imported_meshes.updated(device, imported)?;
        // Meshes in the engine's own buffers may have come or gone.
        self.snapshot = None;
        self.current = Some(requested);
        Ok(())
    }

    /// The meshes that are used, and neither on the device nor on their way: slot, revision and mesh.
    pub(crate) fn missing<'a>(
        &self,
        assets: &'a Assets,
        used: &UsedMeshes,
    ) -> impl Iterator<Item = (u32, u64, &'a Mesh)> {
        let slots = 0..self.meshes.len() as u32;
        let is_missing = |slot: &u32| {
            self.meshes[*slot as usize].is_none() && used.contains_slot(*slot) && !self.in_flight.contains(slot)
        };
        slots.filter(is_missing).filter_map(|slot| {
            let (revision, mesh) = assets.meshes.get_with_revision(slot)?;
            mesh.has_triangles().then_some((slot, revision, mesh))
        })
    }

    /// Finds room for a mesh in the pages, or adds pages if the budget allows.
    ///
    /// # Errors
    /// If there is no such page. This is a bug in Drawloom.
    pub(crate) fn find_room(&mut self, mesh: &Mesh, budget: u64) -> Result<Room<MeshTarget>, BackendError> {
        let sizes = PageSizes { min: 1 << 16, max: (budget / 16).clamp(1 << 16, 4 << 20) };
        if let Some(location) = self.pages.allocate_within(mesh, sizes, budget) {
            return Ok(Room::Found(self.pages.target(location)?));
        }
        let needed = self.pages.bytes_of(mesh).total();
        let retired: u64 = self.lifetimes.retired().map(|location| self.pages.bytes_in(*location)).sum();
        Ok(if retired >= needed { Room::Awaited } else { Room::Missing(needed - retired) })
    }

    /// The slots of the meshes on the device, with their bytes.
    pub(crate) fn resident(&self) -> impl Iterator<Item = (u32, u64)> {
        let meshes = (0..).zip(&self.meshes);
        meshes.filter_map(|(slot, mesh)| mesh.map(|mesh| (slot, self.pages.bytes_in(mesh.location))))
    }

    /// Takes a mesh off the device.
    pub(crate) fn evict(&mut self, slot: u32) {
        if let Some(mesh) = self.meshes.get_mut(slot as usize).and_then(Option::take) {
            self.lifetimes.retire(mesh.location);
            self.coarser_levels.remove(&slot);
            self.snapshot = None;
        }
    }

    /// A job is about to upload the mesh in a slot.
    pub(crate) fn begin_upload(&mut self, slot: u32) -> Arc<()> {
        self.in_flight.insert(slot);
        Arc::clone(&self.epoch)
    }

    /// A job has uploaded a mesh, or could not. Nothing is drawn with it if it changed meanwhile. Returns whether it is on the device.
    pub(crate) fn end_upload(
        &mut self,
        epoch: &Arc<()>,
        (slot, revision, mesh): (u32, u64, &Mesh),
        target: &MeshTarget,
        (assets, is_complete): (&Assets, bool),
    ) -> bool {
        if !Arc::ptr_eq(epoch, &self.epoch) {
            return false;
        }
        self.in_flight.remove(&slot);
        let current = assets.meshes.get_with_revision(slot).map(|(revision, _)| revision);
        let is_needed = is_complete && current == Some(revision) && self.meshes[slot as usize].is_none();
        if is_needed {
            self.add_resident(slot, revision, mesh, target.location);
            self.snapshot = None;
        } else {
            // No snapshot refers to it.
            self.pages.free(target.location);
        }
        is_needed
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
