//! When meshes and textures were drawn last, and what follows from it.

use std::collections::BinaryHeap;

use super::frame_use::FrameUse;
use super::request::{Request, Requested};
use super::victims::{Victim, Victims};
use crate::backend::wgpu::resources::{MeshCache, TextureArrays};
use crate::scene::{Assets, Material, Mesh, Texture};
use crate::view::UsedMeshes;

/// When the meshes and textures of a frame were drawn last, as it begins.
pub(super) struct Uses<'a> {
    frame_use: &'a FrameUse,
    /// By texture slot, the latest frame that drew a material with it; `None` for a texture that no material has.
    textures: Vec<Option<u64>>,
    /// What this frame or a later one drew is in sight.
    in_sight_from: u64,
}

impl<'a> Uses<'a> {
    /// For a frame that is about to draw. What one of so many frames before it drew is in sight.
    pub(super) fn new(assets: &Assets, frame_use: &'a FrameUse, frames_in_sight: u64) -> Self {
        let mut textures = vec![None; assets.textures.slot_count()];
        for (handle, material) in assets.iter::<Material>() {
            let Some(texture) = material.texture.filter(|texture| assets.get(*texture).is_ok()) else { continue };
            let latest = frame_use.materials.latest_use(handle.index());
            let entry = &mut textures[texture.index() as usize];
            *entry = (*entry).max(Some(latest));
        }
        Self { frame_use, textures, in_sight_from: frame_use.frame.saturating_sub(frames_in_sight).max(1) }
    }

    /// What is used, but neither on the device nor on its way.
    pub(super) fn requests<'b>(
        &self,
        meshes: &MeshCache,
        textures: &TextureArrays,
        assets: &'b Assets,
        used: &UsedMeshes,
    ) -> BinaryHeap<Request<'b>> {
        let meshes = meshes.missing(assets, used).map(|(slot, revision, mesh)| Request {
            is_wanted: self.is_in_sight(self.frame_use.meshes.latest_use(slot)),
            priority: assets.priority_of_slot::<Mesh>(slot),
            requested: Requested::Mesh(slot, revision, mesh),
        });
        let textures = assets.textures.iter_with_revision().filter_map(|(handle, revision, texture)| {
            let latest_use = self.textures[handle.index() as usize]?;
            textures.is_missing(handle, revision).then(|| Request {
                is_wanted: self.is_in_sight(latest_use),
                priority: assets.priority_of_slot::<Texture>(handle.index()),
                requested: Requested::Texture(handle, revision, texture),
            })
        });
        meshes.chain(textures).collect()
    }

    pub(super) fn mesh_victims(&self, meshes: &MeshCache, assets: &Assets) -> Victims {
        Victims::new(meshes.resident().map(|(slot, bytes)| {
            self.victim(slot, bytes, self.frame_use.meshes.latest_use(slot), assets.priority_of_slot::<Mesh>(slot))
        }))
    }

    pub(super) fn texture_victims(&self, textures: &TextureArrays, assets: &Assets) -> Victims {
        Victims::new(textures.resident().map(|(slot, bytes)| {
            let latest_use = self.textures.get(slot as usize).copied().flatten().unwrap_or(0);
            self.victim(slot, bytes, latest_use, assets.priority_of_slot::<Texture>(slot))
        }))
    }

    fn victim(&self, slot: u32, bytes: u64, latest_use: u64, priority: i32) -> Victim {
        Victim { slot, bytes, latest_use, priority, is_in_sight: self.is_in_sight(latest_use) }
    }

    fn is_in_sight(&self, latest_use: u64) -> bool {
        latest_use >= self.in_sight_from
    }
}
