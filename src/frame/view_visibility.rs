//! What a view sees, kept from frame to frame.

use std::array;
use std::ops::Range;

use super::resolved_view_filter::ResolvedViewFilter;
use super::static_groups::StaticGroupTable;
use super::view_static_groups::ViewStaticGroups;
use crate::bit_set::BitWord;
use crate::command::Version;
use crate::quality::CullingVolume;
use crate::scene::{Assets, FilteredObjects};
use crate::task::JobPanic;
use crate::view::{Frustum, ObjectBlock, ObjectTable, Overlap, RenderView, VisibleSet};

/// The visible set of a view, and what it was found with. While the view does not change, a frame tests the
/// objects that changed.
#[derive(Debug, Default)]
pub(super) struct ViewVisibility {
    pub(super) set: VisibleSet,
    /// `None` where the next frame must test all objects.
    tested_with: Option<TestedWith>,
    filter: ResolvedViewFilter,
    /// Whether all passes of the view may execute static groups.
    pub(super) may_execute_static_groups: bool,
    pub(super) static_groups: ViewStaticGroups,
    tests: Retest,
}

/// The inputs of a visible set.
#[derive(Debug, PartialEq)]
struct TestedWith {
    frustum: Frustum,
    volume: CullingVolume,
    /// The revision of the view's filter.
    filter: u64,
    /// The revision of the objects that static groups exclude.
    excluded: u64,
    objects: usize,
    epoch: u64,
}

/// Which objects a frame tests against a view's frustum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Retest {
    /// All.
    #[default]
    All,
    /// Those that changed.
    Changed,
    /// None: the set of the last frame holds.
    None,
}

impl Retest {
    /// The number of words with objects to test.
    pub(super) fn word_count(self, set: &VisibleSet, table: &ObjectTable) -> usize {
        match self {
            Self::All => set.word_count(),
            Self::Changed => table.changed_word_count(),
            Self::None => 0,
        }
    }

    /// One of these words, by its index among them, and a mask of the objects to test.
    pub(super) fn word(self, index: usize, table: &ObjectTable) -> BitWord {
        match self {
            Self::Changed => table.changed_word(index),
            Self::All | Self::None => BitWord::new(index, u64::MAX),
        }
    }
}

impl ViewVisibility {
    /// Begins a frame of a view that draws commands: decides which static groups it executes, and which objects it
    /// tests. The version is one that no other view gets.
    ///
    /// # Errors
    /// If the predicate of the view's filter panics.
    pub(super) fn begin_frame(
        &mut self,
        view: &RenderView,
        (table, static_groups): (&ObjectTable, &StaticGroupTable),
        assets: &Assets,
        volume: CullingVolume,
        tests_occlusion: bool,
        version: Version,
    ) -> Result<(), JobPanic> {
        self.filter.update(&view.camera.filter, assets)?;
        if self.may_execute_static_groups && !tests_occlusion && !static_groups.is_empty() {
            self.static_groups.find(static_groups, &view.frustum, volume, &self.filter, version);
        } else {
            self.static_groups.clear(version);
        }
        let (frustum, filter, excluded) =
            (view.frustum.clone(), self.filter.revision(), self.static_groups.excluded_revision());
        let now = TestedWith { frustum, volume, filter, excluded, objects: table.len(), epoch: table.epoch() };
        let is_same_view = |before: &TestedWith| {
            (&before.frustum, before.volume, before.filter, before.excluded, before.objects)
                == (&now.frustum, now.volume, now.filter, now.excluded, now.objects)
        };
        self.tests = match &self.tested_with {
            _ if tests_occlusion => Retest::All,
            Some(before) if *before == now => Retest::None,
            Some(before) if is_same_view(before) && before.epoch + 1 == now.epoch && !table.all_changed() => {
                Retest::Changed
            }
            _ => Retest::All,
        };
        // Occlusion removes objects from the set, so it is not the result of the frustum's test.
        self.tested_with = (!tests_occlusion).then_some(now);
        if self.tests == Retest::All {
            self.set.reset(table.len());
        }
        Ok(())
    }

    /// Empties the set of a view that draws no commands.
    pub(super) fn clear(&mut self, version: Version) {
        self.static_groups.clear(version);
        self.tested_with = None;
        self.set.reset(0);
    }

    /// Makes the next frame test all objects, because this one failed.
    pub(super) fn invalidate(&mut self) {
        self.tested_with = None;
    }

    /// Which objects the frame tests.
    pub(super) fn scope(&self) -> Retest {
        self.tests
    }

    /// The number of words with objects to test.
    pub(super) fn word_count(&self, table: &ObjectTable) -> usize {
        self.tests.word_count(&self.set, table)
    }

    /// Tests the objects of some words, by index among those that are tested.
    pub(super) fn test_words(
        &self,
        indices: Range<usize>,
        table: &ObjectTable,
        frustum: &Frustum,
        volume: CullingVolume,
    ) {
        if self.tests == Retest::Changed {
            for word in indices.map(|index| self.tests.word(index, table)) {
                self.set.replace(word.index(), word.mask, self.visible_among(word, table, frustum, volume));
            }
            return;
        }
        if let FilteredObjects::Only(set) = self.filter.objects() {
            // Words without listed objects stay empty, and need no work.
            for word in set.words(indices) {
                self.set.replace(word.index(), u64::MAX, self.visible_among(word, table, frustum, volume));
            }
            return;
        }
        let blocks = indices.start / ObjectBlock::WORDS..indices.end.div_ceil(ObjectBlock::WORDS);
        let test_block = |index: usize, overlap: Overlap| {
            let first = index * ObjectBlock::WORDS;
            let excluded: [_; ObjectBlock::WORDS] = array::from_fn(|word| self.static_groups.excluded(first + word));
            if excluded == [u64::MAX; ObjectBlock::WORDS] {
                return;
            }
            let block = table.block(index);
            let words = indices.start.max(first) - first..(indices.end - first).min(ObjectBlock::WORDS);
            let put = |word: usize, bits: u64| {
                self.set.replace(first + word, u64::MAX, self.filter.pass(bits, first + word, &block));
            };
            if overlap == Overlap::Inside {
                words.for_each(|word| put(word, block.drawable(word) & !excluded[word]));
            } else if excluded == [0; ObjectBlock::WORDS] {
                block.visible_words(frustum, volume, words, put);
            } else {
                words.for_each(|word| put(word, block.visible_among(frustum, volume, word, !excluded[word])));
            }
        };
        // The set is empty, so blocks outside need no more work.
        if volume == CullingVolume::None {
            blocks.for_each(|block| test_block(block, Overlap::Inside));
        } else {
            table.block_bounds().visit_overlapping(frustum, blocks, test_block);
        }
    }

    /// The visible ones of a word's objects that no executed static group has.
    fn visible_among(&self, objects: BitWord, table: &ObjectTable, frustum: &Frustum, volume: CullingVolume) -> u64 {
        let word = objects.index();
        let block = table.block(word / ObjectBlock::WORDS);
        let tested = objects.mask & !self.static_groups.excluded(word);
        let visible = block.visible_among(frustum, volume, word % ObjectBlock::WORDS, tested);
        self.filter.pass(visible, word, &block)
    }

    /// Completes the set when all tests are done and hidden objects removed.
    pub(super) fn compact(&self, version: Version) {
        if self.tests != Retest::None {
            self.set.compact(version);
        }
    }
}
