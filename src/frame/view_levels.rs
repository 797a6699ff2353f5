//! The levels of detail in a view, kept from frame to frame.

use std::ops::Range;

use super::view_visibility::{Retest, ViewVisibility};
use crate::bit_set::BitWord;
use crate::scene::SceneRef;
use crate::view::{LevelSelector, MeshLevels, ObjectLevels, ObjectTable};

/// The levels of detail in a view, and what they were chosen with.
#[derive(Debug, Default)]
pub(super) struct ViewLevels {
    pub(super) levels: ObjectLevels,
    /// `None` before the first frame.
    selector: Option<LevelSelector>,
    scope: Retest,
}

impl ViewLevels {
    /// Begins a frame in which the view's visible set is tested already: decides for which objects levels are chosen.
    pub(super) fn begin_frame(&mut self, selector: LevelSelector, visibility: &ViewVisibility, objects: usize) {
        self.levels.resize(objects);
        let is_same = self.selector.replace(selector) == Some(selector);
        self.scope = if is_same { visibility.scope() } else { Retest::All };
    }

    /// The number of words of objects for which levels are chosen.
    pub(super) fn word_count(&self, visibility: &ViewVisibility, table: &ObjectTable) -> usize {
        self.scope.word_count(&visibility.set, table)
    }

    /// Chooses the levels of the visible objects of some words, by index among those for which they are chosen.
    pub(super) fn choose(
        &self,
        indices: Range<usize>,
        (scene, table, meshes): (&SceneRef<'_>, &ObjectTable, &MeshLevels),
        visibility: &ViewVisibility,
    ) {
        let Some(selector) = &self.selector else { return };
        for index in indices {
            let word = self.scope.word(index, table);
            let mask = visibility.set.word(word.index()) & word.mask;
            self.levels.choose(selector, (scene, table, meshes), BitWord { mask, ..word });
        }
    }
}
