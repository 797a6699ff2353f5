//! The levels of detail of a view's objects.

use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use parking_lot::RwLock;

use super::level_errors::MeshLevels;
use super::level_selector::LevelSelector;
use super::{ObjectBlock, ObjectTable};
use crate::bit_set::BitWord;
use crate::command::Version;
use crate::scene::SceneRef;

/// The level of detail of each object that a view sees. It is kept from frame to frame, because a level depends on the
/// one before.
#[derive(Debug, Default)]
pub(crate) struct ObjectLevels {
    /// By the index of an object. An object that the view does not see keeps the level that it had. When an object is
    /// removed, the last object takes its index and its level.
    levels: Vec<AtomicU8>,
    /// Whether a level changed since the latest [`ObjectLevels::complete`].
    has_changed: AtomicBool,
    version: RwLock<Version>,
}

/// Coarser than any level: of an object that has none yet.
const UNCHOSEN: u8 = u8::MAX;

impl ObjectLevels {
    /// Makes room for this number of objects.
    pub(crate) fn resize(&mut self, objects: usize) {
        self.levels.resize_with(objects, || AtomicU8::new(UNCHOSEN));
    }

    /// Chooses the levels of the `visible` objects of a word. Jobs that choose at the same time must have different
    /// words.
    pub(crate) fn choose(
        &self,
        selector: &LevelSelector,
        (scene, table, meshes): (&SceneRef<'_>, &ObjectTable, &MeshLevels),
        visible: BitWord,
    ) {
        if visible.mask == 0 {
            return;
        }
        let block = table.block(visible.index() / ObjectBlock::WORDS);
        for object in visible.indices() {
            let entry = object % ObjectBlock::SIZE;
            // Relaxed, here and below: jobs that read the levels depend on this job.
            let before = self.levels[object].load(Ordering::Relaxed);
            let level = meshes.get(block.draws[entry].mesh).map_or(0, |errors| {
                let scale = scene.scale_column().get(object).abs().max_element();
                selector.level(block.spheres.get(entry), scale, errors, before.into()) as u8
            });
            if level != before {
                self.levels[object].store(level, Ordering::Relaxed);
                self.has_changed.store(true, Ordering::Relaxed);
            }
        }
    }

    /// Call it once, after all levels have been chosen. If they differ from those before, they get `version`, which no
    /// others have.
    pub(crate) fn complete(&self, version: Version) {
        if self.has_changed.swap(false, Ordering::Relaxed) {
            *self.version.write() = version;
        }
    }

    /// The version that the latest different levels got.
    pub(crate) fn version(&self) -> Version {
        *self.version.read()
    }

    /// The level of an object that the view sees.
    #[inline]
    pub(crate) fn get(&self, object: usize) -> u32 {
        self.levels[object].load(Ordering::Relaxed).into()
    }
}
