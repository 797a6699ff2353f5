//! What a view sees, kept from frame to frame.

use std::ops::Range;

use crate::chunked_array::block_ranges;
use crate::command::Version;
use crate::quality::CullingVolume;
use crate::view::{Frustum, GroupBounds, ObjectTable, Overlap, RenderView, VisibleSet};

/// The visible set of a view, and what it was found with. While the view does not change, a frame tests the
/// objects that changed.
#[derive(Debug, Default)]
pub(super) struct ViewVisibility {
    pub(super) set: VisibleSet,
    /// `None` where the next frame must test all objects.
    tested_with: Option<TestedWith>,
    tests: TestScope,
}

/// The inputs of a visible set.
#[derive(Debug, PartialEq)]
struct TestedWith {
    frustum: Frustum,
    volume: CullingVolume,
    objects: usize,
    epoch: u64,
}

/// Which objects a frame tests against a view's frustum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum TestScope {
    /// All.
    #[default]
    All,
    /// Those that changed.
    Changed,
    /// None: the set of the last frame holds.
    None,
}

const WORDS_PER_BLOCK: usize = ObjectTable::BLOCK_SIZE / VisibleSet::OBJECTS_PER_WORD;

impl ViewVisibility {
    /// Begins a frame of a view that draws commands: decides which objects it tests.
    pub(super) fn begin_frame(
        &mut self,
        view: &RenderView,
        table: &ObjectTable,
        volume: CullingVolume,
        tests_occlusion: bool,
    ) {
        let now = TestedWith { frustum: view.frustum.clone(), volume, objects: table.len(), epoch: table.epoch() };
        let is_same_view = |before: &TestedWith| {
            (&before.frustum, before.volume, before.objects) == (&now.frustum, now.volume, now.objects)
        };
        self.tests = match &self.tested_with {
            _ if tests_occlusion => TestScope::All,
            Some(before) if *before == now => TestScope::None,
            Some(before) if is_same_view(before) && before.epoch + 1 == now.epoch && !table.all_changed() => {
                TestScope::Changed
            }
            _ => TestScope::All,
        };
        // Occlusion removes objects from the set, so it is not the result of the frustum's test.
        self.tested_with = (!tests_occlusion).then_some(now);
        if self.tests == TestScope::All {
            self.set.reset(table.len());
        }
    }

    /// Empties the set of a view that draws no commands.
    pub(super) fn clear(&mut self) {
        self.tested_with = None;
        self.set.reset(0);
    }

    /// Makes the next frame test all objects, because this one failed.
    pub(super) fn invalidate(&mut self) {
        self.tested_with = None;
    }

    /// The number of words with objects to test.
    pub(super) fn word_count(&self, table: &ObjectTable) -> usize {
        match self.tests {
            TestScope::All => self.set.word_count(),
            TestScope::Changed => table.changed_word_count(),
            TestScope::None => 0,
        }
    }

    /// Tests the objects of some words, by index among those that are tested.
    pub(super) fn test_words(
        &self,
        indices: Range<usize>,
        table: &ObjectTable,
        frustum: &Frustum,
        volume: CullingVolume,
    ) {
        if self.tests == TestScope::Changed {
            indices.for_each(|index| {
                let word = table.changed_word(index);
                self.test_block(word / WORDS_PER_BLOCK, word..word + 1, table, frustum, volume);
            });
        } else {
            let bounds = table.block_bounds();
            for (group, words) in block_ranges(indices, WORDS_PER_BLOCK * GroupBounds::GROUPS) {
                let overlaps = frustum.overlaps(&bounds[group]);
                for (block, words) in block_ranges(words, WORDS_PER_BLOCK) {
                    if overlaps[block % GroupBounds::GROUPS] == Overlap::Outside && volume != CullingVolume::None {
                        self.set.test(objects_of(words, table), |_| 0);
                    } else {
                        self.test_block(block, words, table, frustum, volume);
                    }
                }
            }
        }
    }

    /// Tests some words of a block.
    fn test_block(
        &self,
        index: usize,
        words: Range<usize>,
        table: &ObjectTable,
        frustum: &Frustum,
        volume: CullingVolume,
    ) {
        let first = index * WORDS_PER_BLOCK;
        table.block(index).visible_words(frustum, volume, words.start - first..words.end - first, |word, bits| {
            self.set.test(objects_of(first + word..first + word + 1, table), |_| bits);
        });
    }

    /// Completes the set when all tests are done and hidden objects removed.
    pub(super) fn compact(&self, version: Version) {
        if self.tests != TestScope::None {
            self.set.compact(version);
        }
    }
}

/// The objects of some words.
fn objects_of(words: Range<usize>, table: &ObjectTable) -> Range<usize> {
    let end = words.end * VisibleSet::OBJECTS_PER_WORD;
    words.start * VisibleSet::OBJECTS_PER_WORD..end.min(table.len())
}
