//! The errors of all meshes' levels of detail, in a small table.

use super::UsedMeshes;
use crate::scene::{Assets, LevelOfDetail, Mesh};

/// The errors of the levels of the meshes that objects use, by slot. The meshes themselves are much larger.
#[derive(Debug, Default)]
pub(crate) struct MeshLevels {
    /// The identity and revision of the mesh collection that this was built from, and the revision of the used meshes.
    version: Option<(u64, u64, u64)>,
    /// For each slot, up to the last mesh with levels.
    errors: Vec<LevelErrors>,
}

/// The errors of a mesh's coarser levels, in metres in object space. They ascend.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LevelErrors {
    count: usize,
    errors: [f32; LevelOfDetail::MAX_COUNT],
}

impl LevelErrors {
    /// Those of at most [`LevelOfDetail::MAX_COUNT`] levels, the finest first.
    pub(super) fn of(errors: impl ExactSizeIterator<Item = f32>) -> Self {
        let mut levels = Self { count: errors.len(), ..Self::default() };
        levels.errors.iter_mut().zip(errors).for_each(|(own, error)| *own = error);
        levels
    }

    /// The coarsest level whose error is at most `largest` metres in object space.
    pub(super) fn coarsest(&self, largest: f64) -> u32 {
        let errors = &self.errors[..self.count];
        errors.iter().take_while(|error| f64::from(**error) <= largest).count() as u32
    }
}

impl MeshLevels {
    /// Rebuilds the table if the meshes have changed, or others are used.
    pub(crate) fn update(&mut self, assets: &Assets, used: &UsedMeshes) {
        let version = (assets.meshes.identity(), assets.meshes.revision(), used.revision());
        if self.version == Some(version) {
            return;
        }
        self.version = Some(version);
        self.errors.clear();
        for (handle, mesh) in
            assets.iter::<Mesh>().filter(|(handle, mesh)| !mesh.levels().is_empty() && used.contains(*handle))
        {
            self.errors.resize(handle.index() as usize, LevelErrors::default());
            self.errors.push(LevelErrors::of(mesh.levels().iter().map(LevelOfDetail::error)));
        }
    }

    /// Whether no mesh has levels.
    pub(crate) fn is_empty(&self) -> bool {
        self.errors.is_empty()
    }

    /// Whether the mesh in a slot has levels.
    pub(crate) fn contains(&self, slot: u32) -> bool {
        self.get(slot).is_some()
    }

    /// The errors of the mesh in a slot; `None` if it has no levels.
    pub(super) fn get(&self, slot: u32) -> Option<&LevelErrors> {
        self.errors.get(slot as usize).filter(|levels| levels.count > 0)
    }
}
