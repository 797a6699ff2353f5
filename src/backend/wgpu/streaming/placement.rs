//! Where what is requested will lie, and what makes room for it.

use std::cell::Cell;
use std::iter;

use super::backoff::{RefusedMeshes, RefusedTextures, Retries};
use super::budget::StreamingBudget;
use super::eviction_order::EvictionOrder;
use super::mesh_upload::MeshUpload;
use super::request::{Request, Requested};
use super::residency::{HeldUpload, Residency};
use super::texture_upload::TextureUpload;
use super::upload_jobs::Upload;
use super::usage::Usage;
use crate::backend::BackendError;
use crate::backend::wgpu::resources::{ArrayBudget, MeshTarget, Placed, TextureLocation, Unplaced};
use crate::handle::Handle;
use crate::scene::{Mesh, Texture};

/// Gives room to the requests of a frame, the most important ones first.
pub(super) struct Placement<'a, 'b> {
    residency: &'a mut Residency<'b>,
    budget: &'a StreamingBudget,
    usage: &'a Usage<'a>,
    retries: &'a mut Retries,
    /// Made when something has to make room.
    mesh_evictions: Option<EvictionOrder>,
    texture_evictions: Option<EvictionOrder>,
    refused_meshes: RefusedMeshes,
    refused_textures: RefusedTextures,
    /// The number of those that made room.
    pub(super) evictions: usize,
}

impl<'a, 'b> Placement<'a, 'b> {
    pub(super) fn new(
        residency: &'a mut Residency<'b>,
        budget: &'a StreamingBudget,
        usage: &'a Usage<'a>,
        retries: &'a mut Retries,
    ) -> Self {
        Self {
            residency,
            budget,
            usage,
            retries,
            mesh_evictions: None,
            texture_evictions: None,
            refused_meshes: RefusedMeshes::default(),
            refused_textures: RefusedTextures::default(),
            evictions: 0,
        }
    }

    /// Finds room for what is requested. It is on its way from then on.
    ///
    /// # Errors
    /// If a page is missing. This is a bug in Drawloom.
    pub(super) fn place(&mut self, request: &Request<'_>) -> Result<Result<HeldUpload, Unplaced>, BackendError> {
        let importance = (request.is_wanted, request.priority);
        let placed = match request.requested {
            Requested::Mesh(handle, revision, mesh) => self.place_mesh(handle, mesh, importance)?.map(|placed| {
                let Placed { target, last_reader } = placed;
                let meshes = &mut self.residency.meshes.residents;
                let in_flight = meshes.begin_upload((handle, revision), target.location);
                let upload = Upload::Mesh(MeshUpload::new(in_flight, mesh.clone(), target));
                HeldUpload { upload, last_reader }
            }),
            Requested::Texture(handle, revision, texture) => self.place_texture(handle, importance).map(|placed| {
                let Placed { target: (location, array), last_reader } = placed;
                let textures = &mut self.residency.materials.textures;
                let in_flight = textures.begin_upload((handle, revision), location);
                let upload = TextureUpload::new(in_flight, texture.clone(), array, location);
                HeldUpload { upload: Upload::Texture(upload), last_reader }
            }),
        };
        Ok(placed)
    }

    fn place_mesh(
        &mut self,
        handle: Handle<Mesh>,
        mesh: &Mesh,
        importance: (bool, i32),
    ) -> Result<Result<Placed<MeshTarget>, Unplaced>, BackendError> {
        let Self { residency, usage, retries, refused_meshes, .. } = self;
        let (device, budget, slot) = (residency.device, self.budget.mesh_bytes, handle.index());
        let meshes = &mut residency.meshes.residents;
        // A mesh that replaces one may take the place of that.
        let replaces = meshes.is_resident(slot);
        if refused_meshes.covers(mesh) && !replaces {
            return Ok(Err(Unplaced::Full));
        }
        let beside = meshes.place(device, mesh, budget, iter::empty(), &mut 0)?;
        if !matches!(beside, Err(Unplaced::Full)) {
            return Ok(beside);
        }
        if !refused_meshes.may_try() || !retries.is_due(slot) {
            refused_meshes.add(mesh, 0);
            return Ok(beside);
        }
        let eviction_order = self.mesh_evictions.get_or_insert_with(|| usage.mesh_evictions(meshes));
        let tried = Cell::new(0);
        let candidates = eviction_order.candidates(importance, slot).inspect(|_| tried.set(tried.get() + 1));
        let placed = meshes.place(device, mesh, budget, candidates, &mut self.evictions)?;
        if placed.is_err() {
            refused_meshes.add(mesh, tried.get());
            retries.add(slot, tried.get());
        }
        Ok(placed)
    }

    fn place_texture(
        &mut self,
        handle: Handle<Texture>,
        importance: (bool, i32),
    ) -> Result<Placed<(TextureLocation, wgpu::Texture)>, Unplaced> {
        let Self { residency, usage, refused_textures, .. } = self;
        let (budget, slot) = (self.budget.texture_bytes, handle.index());
        let array = residency.materials.textures.array_of(slot).ok_or(Unplaced::Full)?;
        let replaces = residency.materials.textures.is_resident(slot);
        if let Some(refused) = refused_textures.of(array).filter(|refused| !replaces || *refused == Unplaced::Awaited) {
            return Err(refused);
        }
        let textures = &mut residency.materials.textures;
        let budget = ArrayBudget::new(residency.device, residency.uploads, budget);
        let mut placed = textures.place_beside(array, budget);
        if matches!(placed, Err(Unplaced::Full)) {
            let eviction_order = self.texture_evictions.get_or_insert_with(|| usage.texture_evictions(textures));
            placed = textures.place_instead(
                array,
                budget,
                || eviction_order.candidates(importance, slot),
                &mut self.evictions,
            );
        }
        if let Err(unplaced) = &placed {
            refused_textures.add(array, *unplaced);
        }
        placed
    }
}
