//! What a view sees, kept from frame to frame: of single objects and of static groups, behind its filter.

use std::array;
use std::ops::Range;

use crate::bit_set::{BITS_PER_WORD, BitSet, BitWord, set_bits};
use crate::command::Version;
use crate::frame::static_groups::StaticGroupTable;
use crate::quality::CullingVolume;
use crate::scene::{Assets, FilteredObjects, Material, MaterialPredicate, SceneRef, ViewFilter};
use crate::task::{JobPanic, catch};
use crate::view::{
    Bounds4, Frustum, IssueReason, ObjectBlock, ObjectTable, Overlap, RenderView, SceneIssues, VisibleSet,
};

/// The visible set of a view, and what it was found with. While the view does not change, a frame tests the
/// objects that changed.
#[derive(Debug, Default)]
pub(in crate::frame) struct ViewVisibility {
    pub(in crate::frame) set: VisibleSet,
    /// `None` where the next frame must test all objects.
    tested_with: Option<TestedWith>,
    filter: ResolvedViewFilter,
    /// Whether all passes of the view may execute static groups.
    pub(in crate::frame) may_execute_static_groups: bool,
    pub(in crate::frame) static_groups: ViewStaticGroups,
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
pub(in crate::frame) enum Retest {
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
    pub(in crate::frame) fn word_count(self, set: &VisibleSet, table: &ObjectTable) -> usize {
        match self {
            Self::All => set.word_count(),
            Self::Changed => table.changed_word_count(),
            Self::None => 0,
        }
    }

    /// One of these words, by its index among them, and a mask of the objects to test.
    pub(in crate::frame) fn word(self, index: usize, table: &ObjectTable) -> BitWord {
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
    pub(in crate::frame) fn begin_frame(
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
    pub(in crate::frame) fn clear(&mut self, version: Version) {
        self.static_groups.clear(version);
        self.tested_with = None;
        self.set.reset(0);
    }

    /// Makes the next frame test all objects, because this one failed.
    pub(in crate::frame) fn invalidate(&mut self) {
        self.tested_with = None;
    }

    /// Which objects the frame tests.
    pub(in crate::frame) fn scope(&self) -> Retest {
        self.tests
    }

    /// The number of words with objects to test.
    pub(in crate::frame) fn word_count(&self, table: &ObjectTable) -> usize {
        self.tests.word_count(&self.set, table)
    }

    /// Tests the objects of some words, by index among those that are tested.
    pub(in crate::frame) fn test_words(
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
    pub(in crate::frame) fn compact(&self, version: Version) {
        if self.tests != Retest::None {
            self.set.compact(version);
        }
    }
}

/// The filter of a view, with what its predicate said of the scene's materials.
#[derive(Debug, Default)]
pub(in crate::frame) struct ResolvedViewFilter {
    objects: FilteredObjects,
    /// `None` if all materials pass.
    materials: Option<PassingMaterials>,
    revision: u64,
}

/// The materials that a predicate contains.
#[derive(Debug)]
struct PassingMaterials {
    predicate: MaterialPredicate,
    /// The materials of which it was asked: the identity of their collection, and its revision.
    version: (u64, u64),
    /// Their slots.
    slots: BitSet,
}

impl ResolvedViewFilter {
    /// Makes it this filter for these materials. Asks the predicate if it is another one than before, or a material may
    /// have changed.
    ///
    /// # Errors
    /// If the predicate panics; then nothing changes.
    pub(in crate::frame) fn update(&mut self, filter: &ViewFilter, assets: &Assets) -> Result<(), JobPanic> {
        let materials = &assets.materials;
        let version = (materials.identity(), materials.revision());
        let mut changed = self.objects != filter.objects;
        match (&filter.materials, &mut self.materials) {
            (None, known) => changed |= known.take().is_some(),
            (Some(predicate), Some(known)) if known.predicate == *predicate && known.version == version => {}
            (Some(predicate), known) => {
                let slots = catch(|| passing_slots(predicate, assets))?;
                changed |= known.as_ref().is_none_or(|known| known.slots != slots);
                *known = Some(PassingMaterials { predicate: predicate.clone(), version, slots });
            }
        }
        if changed {
            self.objects.clone_from(&filter.objects);
            self.revision += 1;
        }
        Ok(())
    }

    /// Counts the changes after which other objects may pass.
    pub(in crate::frame) fn revision(&self) -> u64 {
        self.revision
    }

    /// Whether no material is left out.
    pub(in crate::frame) fn passes_all_materials(&self) -> bool {
        self.materials.is_none()
    }

    /// The list of objects.
    pub(in crate::frame) fn objects(&self) -> &FilteredObjects {
        &self.objects
    }

    /// Those of a word's objects that pass. The word is in this block, and its objects are drawable.
    #[inline]
    pub(in crate::frame) fn pass(&self, objects: u64, word: usize, block: &ObjectBlock) -> u64 {
        match (&self.objects, &self.materials, objects) {
            (FilteredObjects::All, None, _) | (_, _, 0) => objects,
            _ => self.pass_by_material(objects & self.objects.mask(word), word, block),
        }
    }

    /// Those that pass by their materials.
    fn pass_by_material(&self, objects: u64, word: usize, block: &ObjectBlock) -> u64 {
        let Some(PassingMaterials { slots, .. }) = &self.materials else { return objects };
        let first = word * BITS_PER_WORD % ObjectBlock::SIZE;
        let passes = |bit: &usize| slots.contains(block.draws[first + bit].material as usize);
        set_bits(objects).filter(passes).fold(0, |passing, bit| passing | 1 << bit)
    }
}

/// The slots whose material the predicate contains.
fn passing_slots(predicate: &MaterialPredicate, assets: &Assets) -> BitSet {
    let mut slots = BitSet::default();
    slots.resize(assets.materials.slot_count());
    let passing = assets.iter::<Material>().filter(|(_, material)| predicate.contains(material));
    passing.for_each(|(handle, _)| slots.insert(handle.index() as usize));
    slots
}

/// Counts the indices that the cameras' filters list and at which the scene has no object, each once.
pub(in crate::frame) fn count_unknown_objects(scene: &SceneRef<'_>, scene_issues: &SceneIssues) {
    for set in scene.cameras.iter().filter_map(|camera| camera.filter.objects.set()) {
        for index in set.iter_from(scene.object_count()) {
            scene_issues.count_once(IssueReason::UnknownObject, index as usize);
        }
    }
}

/// The static groups that a view executes, and the objects that it need not test because a recorded static group that
/// lies outside or is executed has them.
#[derive(Debug, Default)]
pub(in crate::frame) struct ViewStaticGroups {
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
    pub(in crate::frame) fn find(
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
    pub(in crate::frame) fn clear(&mut self, version: Version) {
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
    pub(in crate::frame) fn executed(&self) -> &[u32] {
        &self.executed
    }

    /// Whether it executes a static group, by index.
    #[inline]
    pub(in crate::frame) fn executes(&self, static_group: u32) -> bool {
        self.executed_set.contains(static_group as usize)
    }

    /// The number of objects that are executed.
    pub(in crate::frame) fn object_count(&self) -> usize {
        self.object_count
    }

    /// The version that the latest executed static groups got.
    pub(in crate::frame) fn version(&self) -> Version {
        self.version
    }

    /// The objects of a word that are not tested: a mask.
    #[inline]
    pub(in crate::frame) fn excluded(&self, word: usize) -> u64 {
        self.excluded.mask(word)
    }

    /// Counts how often the objects that are not tested changed.
    pub(in crate::frame) fn excluded_revision(&self) -> u64 {
        self.excluded_revision
    }
}

impl ResolvedViewFilter {
    /// Whether it lets all objects pass.
    fn passes_all(&self) -> bool {
        *self.objects() == FilteredObjects::All && self.passes_all_materials()
    }
}
