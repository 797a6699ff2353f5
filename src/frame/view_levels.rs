//! The levels of detail in a view, kept from frame to frame.

use std::ops::Range;

use super::view_visibility::{Retest, ViewVisibility};
use crate::backend::kept_views;
use crate::scene::{SceneRef, ViewKind};
use crate::view::{LevelSelector, MeshLevels, ObjectLevels, ObjectTable, RenderView};

/// The levels of detail in a view, and what they were chosen with.
#[derive(Debug)]
pub(super) struct ViewLevels {
    /// The view that they are of.
    kind: ViewKind,
    name: String,
    pub(super) levels: ObjectLevels,
    /// `None` before the first frame.
    selector: Option<LevelSelector>,
    scope: Retest,
}

impl ViewLevels {
    fn new(view: &RenderView) -> Self {
        Self {
            kind: view.kind(),
            name: view.name().to_owned(),
            levels: ObjectLevels::default(),
            selector: None,
            scope: Retest::None,
        }
    }

    fn is_of(&self, view: &RenderView) -> bool {
        (self.kind, self.name.as_str()) == (view.kind(), view.name())
    }

    /// Makes `levels` one for each view. A view of the same kind and name as one of the frame before keeps its levels.
    pub(super) fn keep(levels: &mut Vec<Self>, views: &[RenderView]) {
        if levels.len() == views.len() && levels.iter().zip(views).all(|(levels, view)| levels.is_of(view)) {
            return;
        }
        let kept = kept_views(levels.iter().map(|levels| (levels.kind, levels.name.as_str())), views);
        let mut before: Vec<_> = levels.drain(..).map(Some).collect();
        levels.extend(kept.iter().zip(views).map(|(kept, view)| {
            let same = kept.filter(|kept| kept.is_same).and_then(|kept| before[kept.index].take());
            same.unwrap_or_else(|| Self::new(view))
        }));
    }

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
            let (word, mask) = self.scope.word(index, table);
            self.levels.choose(selector, (scene, table, meshes), word, visibility.set.word(word) & mask);
        }
    }
}
