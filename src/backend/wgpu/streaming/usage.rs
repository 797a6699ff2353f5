//! When meshes and textures were drawn last, and what follows from it.

use std::collections::BinaryHeap;

use super::eviction_order::{EvictionCandidate, EvictionOrder};
use super::frame_use::FrameUse;
use super::request::{Request, Requested};
use crate::backend::wgpu::resources::{ResidentMeshes, ResidentTextures};
use crate::handle::Handle;
use crate::scene::{Assets, Material, Mesh, Texture};

/// The materials that have textures, by texture.
#[derive(Default)]
pub(super) struct TextureUsers {
    /// Identity and revision of the materials.
    version: Option<(u64, u64)>,
    /// Textures and the slots of their materials, by the textures' slots.
    users: Vec<(Handle<Texture>, u32)>,
}

impl TextureUsers {
    /// Brings it up to date, if materials changed.
    pub(super) fn update(&mut self, assets: &Assets) {
        let version = Some((assets.materials.identity(), assets.materials.revision()));
        if self.version == version {
            return;
        }
        self.version = version;
        self.users.clear();
        let materials = assets.iter::<Material>();
        self.users.extend(
            materials.flat_map(|(handle, material)| {
                material.all_textures().map(move |(_, texture)| (texture, handle.index()))
            }),
        );
        self.users.sort_unstable_by_key(|(texture, _)| texture.index());
    }

    /// The slots of a texture's materials.
    fn of(&self, texture: Handle<Texture>) -> impl Iterator<Item = u32> {
        let first = self.users.partition_point(|(user, _)| user.index() < texture.index());
        let same_slot = self.users[first..].iter().take_while(move |(user, _)| user.index() == texture.index());
        same_slot.filter(move |(user, _)| *user == texture).map(|(_, material)| *material)
    }
}

/// When the meshes and textures of a frame were drawn last, as it begins.
pub(super) struct Usage<'a> {
    assets: &'a Assets,
    frame_use: &'a FrameUse,
    users: &'a TextureUsers,
    /// What this frame or a later one drew is in sight.
    in_sight_from: u64,
}

impl<'a> Usage<'a> {
    /// For a frame that is about to draw. Everything that one of the latest frames drew is in sight.
    pub(super) fn new(
        assets: &'a Assets,
        (frame_use, users): (&'a FrameUse, &'a TextureUsers),
        frames_in_sight: u64,
    ) -> Self {
        Self { assets, frame_use, users, in_sight_from: frame_use.frame.saturating_sub(frames_in_sight).max(1) }
    }

    /// What is used, but neither on the device nor on its way.
    pub(super) fn requests(&self, meshes: &ResidentMeshes, textures: &ResidentTextures) -> BinaryHeap<Request<'a>> {
        let meshes = meshes.missing(&self.assets.meshes).map(|(handle, revision, mesh)| Request {
            is_wanted: self.is_in_sight(self.frame_use.meshes.latest_use(handle.index())),
            priority: self.assets.priority_of_slot::<Mesh>(handle.index()),
            requested: Requested::Mesh(handle, revision, mesh),
        });
        let textures = textures.missing(&self.assets.textures).filter_map(|(handle, revision, texture)| {
            Some(Request {
                is_wanted: self.is_in_sight(self.latest_use_of(handle)?),
                priority: self.assets.priority_of_slot::<Texture>(handle.index()),
                requested: Requested::Texture(handle, revision, texture),
            })
        });
        meshes.chain(textures).collect()
    }

    pub(super) fn mesh_evictions(&self, meshes: &ResidentMeshes) -> EvictionOrder {
        EvictionOrder::new(meshes.resident().map(|slot| {
            self.candidate(slot, self.frame_use.meshes.latest_use(slot), self.assets.priority_of_slot::<Mesh>(slot))
        }))
    }

    pub(super) fn texture_evictions(&self, textures: &ResidentTextures) -> EvictionOrder {
        EvictionOrder::new(textures.resident().map(|slot| {
            let entry = self.assets.textures.entry(slot);
            let latest_use = entry.and_then(|(texture, ..)| self.latest_use_of(texture)).unwrap_or(0);
            self.candidate(slot, latest_use, self.assets.priority_of_slot::<Texture>(slot))
        }))
    }

    /// The latest frame that drew a material with a texture; `None` for a texture that no material has.
    fn latest_use_of(&self, texture: Handle<Texture>) -> Option<u64> {
        self.users.of(texture).map(|material| self.frame_use.materials.latest_use(material)).max()
    }

    fn candidate(&self, slot: u32, latest_use: u64, priority: i32) -> EvictionCandidate {
        EvictionCandidate { slot, latest_use, priority, is_in_sight: self.is_in_sight(latest_use) }
    }

    fn is_in_sight(&self, latest_use: u64) -> bool {
        latest_use >= self.in_sight_from
    }
}
