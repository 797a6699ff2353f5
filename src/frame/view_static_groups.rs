//! The static groups that a view executes, kept from frame to frame.

use super::resolved_view_filter::ResolvedViewFilter;
use super::static_groups::StaticGroupTable;
use crate::bit_set::BitSet;
use crate::command::Version;
use crate::quality::CullingVolume;
use crate::scene::FilteredObjects;
use crate::view::{Bounds4, Frustum, Overlap};

/// The static groups that a view executes, and the objects that it need not test because a recorded static group that
/// lies outside or is executed has them.
#[derive(Debug, Default)]
pub(super) struct ViewStaticGroups {
    /// What it was found with; `None` if the view executes no static groups.
    found_with: Option<FoundWith>,
    executed: Vec<u32>,
    /// The same as a set.
    executed_set: BitSet,
    /// The number of objects that are executed.
    object_count: usize,
    /// The version of the executed static groups.
    version: Version,
    /// The recorded static groups whose objects are tested all the same.
    opened: Vec<u32>,
    /// What the filter says of each static group, and the revisions of filter and static groups.
    by_filter: Vec<Passing>,
    filtered_with: Option<(u64, u64)>,
    /// Objects; without room for any if there are none.
    excluded: BitSet,
    excluded_revision: u64,
    scratch: Vec<u32>,
}

/// The inputs of the test of a view's static groups.
#[derive(Debug, PartialEq)]
struct FoundWith {
    frustum: Frustum,
    volume: CullingVolume,
    static_groups: u64,
    filter: u64,
}

/// How many of a static group's objects pass a filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Passing {
    None,
    Some,
    All,
}

impl ViewStaticGroups {
    /// Finds the static groups that a view executes. If these are others than before, their version is `version`, which
    /// no other view's are.
    pub(super) fn find(
        &mut self,
        table: &StaticGroupTable,
        frustum: &Frustum,
        volume: CullingVolume,
        filter: &ResolvedViewFilter,
        version: Version,
    ) {
        let is_same = |before: &FoundWith| {
            (before.static_groups, before.filter, before.volume) == (table.revision(), filter.revision(), volume)
                && before.frustum == *frustum
        };
        if self.found_with.as_ref().is_some_and(is_same) {
            return;
        }
        let is_other = self.found_with.as_ref().is_none_or(|before| before.static_groups != table.revision());
        let (static_groups, filter_revision) = (table.revision(), filter.revision());
        self.found_with = Some(FoundWith { frustum: frustum.clone(), volume, static_groups, filter: filter_revision });
        self.filter(table, filter);
        let executed_before = std::mem::replace(&mut self.executed, std::mem::take(&mut self.scratch));
        let opened_before = self.opened.len();
        self.executed.clear();
        let mut overlaps = [Overlap::Inside; Bounds4::GROUPS];
        let mut group_of_overlaps = usize::MAX;
        for static_group in table.recorded() {
            let (group, place) = (static_group / Bounds4::GROUPS, static_group % Bounds4::GROUPS);
            if group != group_of_overlaps && volume != CullingVolume::None {
                overlaps = frustum.overlaps(&table.bounds()[group]);
                group_of_overlaps = group;
            }
            let passing = self.by_filter.get(static_group).copied().unwrap_or(Passing::All);
            if overlaps[place] == Overlap::Outside || passing == Passing::None {
                continue;
            }
            let is_cut =
                || overlaps[place] == Overlap::Partial && frustum.may_end_before(&table.bounds()[group], place);
            if passing == Passing::Some || is_cut() {
                self.opened.push(static_group as u32);
            } else {
                self.executed.push(static_group as u32);
            }
        }
        if is_other || self.executed != executed_before {
            self.version = version;
            self.object_count = self.executed.iter().map(|static_group| table.object_count(*static_group)).sum();
            self.executed_set.clear();
            self.executed_set.resize(table.len());
            self.executed.iter().for_each(|static_group| self.executed_set.insert(*static_group as usize));
        }
        self.scratch = executed_before;
        let (before, now) = self.opened.split_at(opened_before);
        let opens_others = before != now;
        self.opened.drain(..opened_before);
        if is_other || opens_others {
            self.exclude(table);
        }
    }

    /// Makes the view execute no static groups, and test all objects.
    pub(super) fn clear(&mut self, version: Version) {
        if self.found_with.take().is_some() {
            self.executed.clear();
            self.executed_set.clear();
            self.object_count = 0;
            self.opened.clear();
            self.excluded.clear();
            self.version = version;
            self.excluded_revision += 1;
        }
    }

    /// Asks the filter of each static group, if one of both is another than before.
    fn filter(&mut self, table: &StaticGroupTable, filter: &ResolvedViewFilter) {
        let revisions = Some((filter.revision(), table.revision()));
        if std::mem::replace(&mut self.filtered_with, revisions) == revisions {
            return;
        }
        self.by_filter.clear();
        if filter.passes_all() {
            return;
        }
        for static_group in table.recorded() {
            self.by_filter.resize(static_group + 1, Passing::All);
            let (mut some, mut all) = (false, true);
            table.visit_words(static_group, |word| {
                let passing = filter.objects().mask(word.index()) & word.mask;
                some |= passing != 0;
                all &= passing == word.mask;
            });
            self.by_filter[static_group] = match (some, all && filter.passes_all_materials()) {
                (false, _) => Passing::None,
                (true, false) => Passing::Some,
                (true, true) => Passing::All,
            };
        }
    }

    fn exclude(&mut self, table: &StaticGroupTable) {
        self.excluded_revision += 1;
        self.excluded.copy_from(table.recorded_objects());
        for &static_group in &self.opened {
            table.visit_words(static_group as usize, |word| self.excluded.remove_word(*word));
        }
    }

    /// The executed static groups, by index.
    pub(super) fn executed(&self) -> &[u32] {
        &self.executed
    }

    /// Whether it executes a static group, by index.
    #[inline]
    pub(super) fn executes(&self, static_group: u32) -> bool {
        self.executed_set.contains(static_group as usize)
    }

    /// The number of objects that are executed.
    pub(super) fn object_count(&self) -> usize {
        self.object_count
    }

    /// The version that the latest executed static groups got.
    pub(super) fn version(&self) -> Version {
        self.version
    }

    /// The objects of a word that are not tested: a mask.
    #[inline]
    pub(super) fn excluded(&self, word: usize) -> u64 {
        self.excluded.mask(word)
    }

    /// Counts how often the objects that are not tested changed.
    pub(super) fn excluded_revision(&self) -> u64 {
        self.excluded_revision
    }
}

impl ResolvedViewFilter {
    /// Whether it lets all objects pass.
    fn passes_all(&self) -> bool {
        *self.objects() == FilteredObjects::All && self.passes_all_materials()
    }
}
