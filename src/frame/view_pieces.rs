//! The pieces that a view executes, kept from frame to frame.

use super::pieces::PieceTable;
use super::view_filter::ViewFilter;
use crate::command::Version;
use crate::quality::CullingVolume;
use crate::scene::ObjectList;
use crate::view::{Frustum, GroupBounds, Overlap};

/// The pieces that a view executes, and the objects that it need not test because a recorded piece that lies outside or
/// is executed has them.
#[derive(Debug, Default)]
pub(super) struct ViewPieces {
    /// What it was found with; `None` if the view executes no pieces.
    found_with: Option<FoundWith>,
    executed: Vec<u32>,
    /// The same as bits.
    executed_words: Vec<u64>,
    /// The number of objects that are executed.
    object_count: usize,
    /// The version of the executed pieces.
    version: Version,
    /// The recorded pieces whose objects are tested all the same.
    opened: Vec<u32>,
    /// What the filter says of each piece, and the revisions of filter and pieces.
    by_filter: Vec<Passing>,
    filtered_with: Option<(u64, u64)>,
    /// A mask for each word of objects; empty for no objects.
    excluded: Vec<u64>,
    excluded_revision: u64,
    scratch: Vec<u32>,
}

/// The inputs of the test of a view's pieces.
#[derive(Debug, PartialEq)]
struct FoundWith {
    frustum: Frustum,
    volume: CullingVolume,
    pieces: u64,
    filter: u64,
}

/// How many of a piece's objects pass a filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Passing {
    None,
    Some,
    All,
}

impl ViewPieces {
    /// Finds the pieces that a view executes. If these are others than before, their version is `version`, which no
    /// other view's are.
    pub(super) fn find(
        &mut self,
        table: &PieceTable,
        frustum: &Frustum,
        volume: CullingVolume,
        filter: &ViewFilter,
        version: Version,
    ) {
        let is_same = |before: &FoundWith| {
            (before.pieces, before.filter, before.volume) == (table.revision(), filter.revision(), volume)
                && before.frustum == *frustum
        };
        if self.found_with.as_ref().is_some_and(is_same) {
            return;
        }
        let is_other = self.found_with.as_ref().is_none_or(|before| before.pieces != table.revision());
        let (pieces, filter_revision) = (table.revision(), filter.revision());
        self.found_with = Some(FoundWith { frustum: frustum.clone(), volume, pieces, filter: filter_revision });
        self.filter(table, filter);
        let executed_before = std::mem::replace(&mut self.executed, std::mem::take(&mut self.scratch));
        let opened_before = self.opened.len();
        self.executed.clear();
        let mut overlaps = [Overlap::Inside; GroupBounds::GROUPS];
        let mut group_of_overlaps = usize::MAX;
        for piece in table.recorded() {
            let (group, place) = (piece / GroupBounds::GROUPS, piece % GroupBounds::GROUPS);
            if group != group_of_overlaps && volume != CullingVolume::None {
                overlaps = frustum.overlaps(&table.bounds()[group]);
                group_of_overlaps = group;
            }
            let passing = self.by_filter.get(piece).copied().unwrap_or(Passing::All);
            if overlaps[place] == Overlap::Outside || passing == Passing::None {
                continue;
            }
            let is_cut =
                || overlaps[place] == Overlap::Partial && frustum.may_end_before(&table.bounds()[group], place);
            if passing == Passing::Some || is_cut() {
                self.opened.push(piece as u32);
            } else {
                self.executed.push(piece as u32);
            }
        }
        if is_other || self.executed != executed_before {
            self.version = version;
            self.object_count = self.executed.iter().map(|piece| table.object_count(*piece)).sum();
            self.executed_words.clear();
            self.executed_words.resize(table.len().div_ceil(WORD), 0);
            self.executed
                .iter()
                .for_each(|&piece| self.executed_words[piece as usize / WORD] |= 1 << (piece as usize % WORD));
        }
        self.scratch = executed_before;
        let (before, now) = self.opened.split_at(opened_before);
        let opens_others = before != now;
        self.opened.drain(..opened_before);
        if is_other || opens_others {
            self.exclude(table);
        }
    }

    /// Makes the view execute no pieces, and test all objects.
    pub(super) fn clear(&mut self, version: Version) {
        if self.found_with.take().is_some() {
            self.executed.clear();
            self.executed_words.clear();
            self.object_count = 0;
            self.opened.clear();
            self.excluded.clear();
            self.version = version;
            self.excluded_revision += 1;
        }
    }

    /// Asks the filter of each piece, if one of both is another than before.
    fn filter(&mut self, table: &PieceTable, filter: &ViewFilter) {
        let revisions = Some((filter.revision(), table.revision()));
        if std::mem::replace(&mut self.filtered_with, revisions) == revisions {
            return;
        }
        self.by_filter.clear();
        if filter.passes_all() {
            return;
        }
        for piece in table.recorded() {
            self.by_filter.resize(piece + 1, Passing::All);
            let (mut some, mut all) = (false, true);
            table.visit_words(piece, |&(word, mask)| {
                let passing = filter.objects().mask(word) & mask;
                some |= passing != 0;
                all &= passing == mask;
            });
            self.by_filter[piece] = match (some, all && filter.passes_all_materials()) {
                (false, _) => Passing::None,
                (true, false) => Passing::Some,
                (true, true) => Passing::All,
            };
        }
    }

    fn exclude(&mut self, table: &PieceTable) {
        self.excluded_revision += 1;
        self.excluded.clear();
        self.excluded.extend_from_slice(table.recorded_words());
        for &piece in &self.opened {
            table.visit_words(piece as usize, |&(word, mask)| self.excluded[word] &= !mask);
        }
    }

    /// The executed pieces, by index.
    pub(super) fn executed(&self) -> &[u32] {
        &self.executed
    }

    /// Whether it executes a piece, by index.
    #[inline]
    pub(super) fn executes(&self, piece: u32) -> bool {
        self.executed_words.get(piece as usize / WORD).is_some_and(|word| word >> (piece as usize % WORD) & 1 == 1)
    }

    /// The number of objects that are executed.
    pub(super) fn object_count(&self) -> usize {
        self.object_count
    }

    /// The version that the latest executed pieces got.
    pub(super) fn version(&self) -> Version {
        self.version
    }

    /// The objects of a word that are not tested: a mask.
    #[inline]
    pub(super) fn excluded(&self, word: usize) -> u64 {
        self.excluded.get(word).copied().unwrap_or(0)
    }

    /// Counts how often the objects that are not tested changed.
    pub(super) fn excluded_revision(&self) -> u64 {
        self.excluded_revision
    }
}

impl ViewFilter {
    /// Whether it lets all objects pass.
    fn passes_all(&self) -> bool {
        *self.objects() == ObjectList::All && self.passes_all_materials()
    }
}

const WORD: usize = u64::BITS as usize;
