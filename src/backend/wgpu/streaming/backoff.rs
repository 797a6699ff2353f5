//! What has no room, so that a frame need not look for room that it knows not to be there.

use std::collections::HashMap;

use super::request::Requested;
use crate::backend::wgpu::resources::Unplaced;
use crate::scene::{Assets, Mesh};
use crate::unwind::emit_unlocked;

/// The meshes that had no room in a frame, and how much looking for it has cost.
///
/// Requests come by importance. So what made no room for one makes none for a later one that takes as much or more.
#[derive(Default)]
pub(super) struct RefusedMeshes {
    /// Vertices and indices.
    sizes: Vec<[usize; 2]>,
    /// The number of candidates that were tried in vain.
    tried: usize,
}

impl RefusedMeshes {
    /// Once this number of candidates was tried in vain, the rest of a frame's requests have room that is free, or
    /// none.
    const MAX_TRIED: usize = 1024;

    /// Whether there is no room for a mesh of this size.
    pub(super) fn covers(&self, mesh: &Mesh) -> bool {
        let size = size_of_mesh(mesh);
        self.sizes.iter().any(|refused| refused[0] <= size[0] && refused[1] <= size[1])
    }

    /// Adds a mesh for which this number of candidates was tried.
    pub(super) fn add(&mut self, mesh: &Mesh, tried: usize) {
        let size = size_of_mesh(mesh);
        self.sizes.retain(|refused| refused[0] < size[0] || refused[1] < size[1]);
        self.sizes.push(size);
        self.tried += tried;
    }

    /// Whether candidates may be tried for a further mesh.
    pub(super) fn may_try(&self) -> bool {
        self.tried < Self::MAX_TRIED
    }
}

fn size_of_mesh(mesh: &Mesh) -> [usize; 2] {
    [
        mesh.vertices().len(),
        mesh.indices().len() + mesh.levels().iter().map(|level| level.indices().len()).sum::<usize>(),
    ]
}

/// The textures that had no room in a frame, by array. All textures of an array take the same.
#[derive(Default)]
pub(super) struct RefusedTextures {
    by_array: HashMap<usize, Unplaced>,
    /// Whether something is on its way to an array that has to move. An array moves when nothing is. So nothing else
    /// begins until then.
    awaits: bool,
}

impl RefusedTextures {
    /// Why there is no room for a texture of this array.
    pub(super) fn of(&self, array: usize) -> Option<Unplaced> {
        if self.awaits { Some(Unplaced::Awaited) } else { self.by_array.get(&array).copied() }
    }

    pub(super) fn add(&mut self, array: usize, unplaced: Unplaced) {
        match unplaced {
            Unplaced::Awaited => self.awaits = true,
            Unplaced::Full | Unplaced::LayerLimit => _ = self.by_array.insert(array, unplaced),
            Unplaced::TooLarge { .. } => {}
        }
    }
}

/// When candidates are tried again for meshes for which many were tried in vain: not in every frame, as that takes
/// long.
#[derive(Default)]
pub(super) struct Retries {
    frame: u64,
    /// By mesh slot, the first frame in which it is tried again.
    due: HashMap<u32, u64>,
}

impl Retries {
    /// The candidates that may be tried for a mesh in every frame.
    const MANY_CANDIDATES: usize = 256;
    const FRAMES_BETWEEN: u64 = 16;

    pub(super) fn begin_frame(&mut self, frame: u64) {
        self.frame = frame;
        self.due.retain(|_, due| *due > frame);
    }

    pub(super) fn is_due(&self, slot: u32) -> bool {
        !self.due.contains_key(&slot)
    }

    /// Counts candidates that were tried in vain.
    pub(super) fn add(&mut self, slot: u32, tried: usize) {
        if tried > Self::MANY_CANDIDATES {
            self.due.insert(slot, self.frame + Self::FRAMES_BETWEEN);
        }
    }
}

/// What can never be on the device. It is told once.
#[derive(Default)]
pub(super) struct TooLarge {
    /// By [key](Requested::key), the revision that is too large.
    told: HashMap<(bool, u32), u64>,
}

impl TooLarge {
    /// Forgets what is gone, or was replaced.
    pub(super) fn update(&mut self, assets: &Assets) {
        self.told.retain(|(is_mesh, slot), told| {
            let mesh = || assets.meshes.get_with_revision(*slot).map(|(revision, _)| revision);
            let texture = || assets.textures.get_with_revision(*slot).map(|(revision, _)| revision);
            Some(*told) == if *is_mesh { mesh() } else { texture() }
        });
    }

    /// Reports, once, that something takes more bytes than the limit of this name allows.
    pub(super) fn tell(&mut self, requested: &Requested<'_>, (bytes, limit, allowed): (u64, &'static str, u64)) {
        let (revision, name, kind) = match *requested {
            Requested::Mesh(_, revision, mesh) => (revision, mesh.name(), "mesh"),
            Requested::Texture(_, revision, texture) => (revision, texture.name(), "texture"),
        };
        if self.told.insert(requested.key(), revision) != Some(revision) {
            let name = name.to_owned();
            emit_unlocked(move || {
                tracing::warn!(target: "drawloom", kind, name, bytes, limit, allowed, "it is too large to be streamed: what it replaces stays, or nothing is drawn");
            });
        }
    }

    /// Something has room: in another format of vertices, for example.
    pub(super) fn remove(&mut self, requested: &Requested<'_>) {
        self.told.remove(&requested.key());
    }

    pub(super) fn count(&self) -> usize {
        self.told.len()
    }
}
