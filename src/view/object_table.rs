//! The table of a scene's objects, which all views share, and which of them a frame describes anew.

use std::ops::Range;

use drawloom_jobs::internal::{ChunkedArray, block_ranges};
use parking_lot::{MappedRwLockReadGuard, RwLock, RwLockReadGuard};

use super::bounds4::BlockBounds;
use super::draw_states::{DrawStates, UsedMeshes};
use super::object_block::{ChangedBlock, DescriptionInputs, Findings, ObjectBlock, describe_block};
use super::object_description::{GatheredColumns, PacketDescription, rejection_reason};
use super::{BoundingBoxes, GpuObject, IssueReason, SceneIssues, TableLimits, TextureSets};
use crate::bit_set::{BITS_PER_WORD, BitWord};
use crate::command::{BinnedSegment, Bins};
use crate::leaked_guards::unlock;
use crate::quality::CullingVolume;
use crate::scene::{Changes, MaterialLayout, SceneRef};

/// A scene's objects: their GPU layout, their bounds, and how they are drawn. Objects that cannot be drawn are
/// rejected.
///
/// The table is kept from frame to frame, and a frame describes the objects that changed. [`ObjectTable::epoch`] counts
/// the frames with changes; what else is kept from frame to frame compares epochs.
///
/// Objects are in blocks, each with its own lock: jobs that fill different blocks never wait for each other, and one
/// uncontended lock per block costs a fraction of a nanosecond per object.
#[derive(Debug, Default)]
pub struct ObjectTable {
    blocks: Vec<RwLock<Box<ObjectBlock>>>,
    block_bounds: RwLock<BlockBounds>,
    bins: RwLock<Bins>,
    scene_issues: SceneIssues,
    length: usize,
    /// The number of objects of the scene: more than `length` if some are beyond the limits.
    scene_length: usize,
    /// The culling volume from the next [`ObjectTable::begin_frame`] on.
    culling: CullingVolume,
    /// The culling volume that the blocks' boxes are for.
    boxes_volume: CullingVolume,
    changed: ChangedObjects,
    draw_states: DrawStates,
    used_meshes: UsedMeshes,
    /// Whether the table is that of the last frame; if not, the next frame describes all objects.
    is_current: bool,
    epoch: u64,
    summary: RwLock<Summary>,
    by_bin: RwLock<ObjectsByBin>,
}

/// All objects ordered by bin, and what the order depends on.
#[derive(Debug, Default)]
struct ObjectsByBin {
    /// What the order is of; `None` before the objects are ordered.
    made_for: Option<BinInputs>,
    /// The inputs in the latest frame that asked for the order.
    latest: Option<BinInputs>,
    objects: BinnedSegment,
}

/// What the bins of a scene's objects follow from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct BinInputs {
    /// The epoch in which an object was last drawn in another way.
    draws_changed_in: u64,
    /// The number of objects.
    objects: usize,
}

/// What jobs find out about the objects that they describe.
#[derive(Clone, Copy, Debug, Default)]
struct Summary {
    /// The epoch in which an object was last drawn in another way than before.
    draws_changed_in: u64,
    /// Whether an object may be rejected.
    has_rejected: bool,
}

// Sizes of jobs are whole blocks of both, so that jobs share none.
const _: () = assert!(ObjectBlock::SIZE == ChunkedArray::<()>::BLOCK_SIZE);

impl ObjectTable {
    /// Objects in a block.
    pub const BLOCK_SIZE: usize = ObjectBlock::SIZE;

    /// Sets the bounding volume that culling tests, from the next [`ObjectTable::begin_frame`] on. The default is
    /// spheres.
    pub fn configure(&mut self, volume: CullingVolume) {
        self.culling = volume;
    }

    /// Makes room for a scene's objects, and finds out which of them have to be described, those that changed or all,
    /// and which meshes they use.
    pub fn begin_frame(&mut self, scene: &SceneRef<'_>) {
        self.begin_frame_within(scene, &TableLimits::NONE);
    }

    /// The same within limits: leaves out the objects that are beyond them.
    pub(crate) fn begin_frame_within(&mut self, scene: &SceneRef<'_>, limits: &TableLimits<'_>) {
        unlock(&mut self.bins);
        self.blocks.iter_mut().for_each(unlock);
        self.scene_length = scene.object_count();
        let objects = self.scene_length.min(limits.objects);
        let assets_changed = self.draw_states.update(scene.assets, limits);
        if assets_changed && self.bins.get_mut().len() > MIN_UNUSED_BINS + 2 * objects {
            // Most of them belong to meshes that are gone.
            self.bins.get_mut().clear();
            self.blocks.iter_mut().for_each(|block| block.get_mut().forget_bins());
        }
        let length_before = std::mem::replace(&mut self.length, objects);
        self.scene_issues = SceneIssues::default();
        if self.is_current && !assets_changed && self.boxes_volume == self.culling {
            self.changed.set(scene.changes, length_before, objects);
        } else {
            self.changed.set_all(objects);
        }
        let changed = (0..self.changed.word_count()).map(|index| self.changed.word(index));
        self.used_meshes.update(scene, changed, &self.draw_states);
        self.is_current = false;
        if self.changed.word_count() > 0 || objects != length_before {
            self.epoch += 1;
        }
        self.resize_blocks(length_before);
    }

    /// How textures are bound.
    pub fn texture_sets(&self) -> &TextureSets {
        self.draw_states.texture_sets()
    }

    /// Begins the frame that it has begun anew, within other limits. What is rejected already stays so.
    pub(crate) fn begin_frame_anew(&mut self, scene: &SceneRef<'_>, limits: &TableLimits<'_>) {
        let scene_issues = std::mem::take(&mut self.scene_issues);
        self.begin_frame_within(scene, limits);
        self.scene_issues = scene_issues;
    }

    fn resize_blocks(&mut self, length_before: usize) {
        let old_count = self.blocks.len();
        let blocks = self.block_count().max(old_count);
        self.blocks.resize_with(blocks, RwLock::default);
        self.block_bounds.get_mut().resize(blocks);
        // Blocks whose boxes are already right stay untouched.
        let up_to_date = if self.boxes_volume == self.culling { old_count } else { 0 };
        for block in &mut self.blocks[up_to_date..] {
            block.get_mut().boxes = BoundingBoxes::new(self.culling);
        }
        self.boxes_volume = self.culling;
        // Removed objects are neither seen nor counted as rejected, also when others are added after them.
        for object in self.length..length_before {
            self.blocks[object / Self::BLOCK_SIZE].get_mut().remove(object % Self::BLOCK_SIZE);
        }
    }

    /// The meshes that the scene's objects use. They are known from [`ObjectTable::begin_frame`] on.
    pub fn used_meshes(&self) -> &UsedMeshes {
        &self.used_meshes
    }

    /// The type of each material, by slot; empty if none has one.
    pub(crate) fn material_type_of_slots(&self) -> &[Option<MaterialLayout>] {
        self.draw_states.types()
    }

    /// The scene's material types, each once.
    pub(crate) fn material_types(&self) -> &[MaterialLayout] {
        self.draw_states.layouts()
    }

    /// Counts how often the type of a material changed.
    pub(crate) fn material_types_revision(&self) -> u64 {
        self.draw_states.types_revision()
    }

    /// Ends a frame that succeeded: the next one describes the objects that change until then. Without this call it
    /// describes all.
    pub fn end_frame(&mut self) {
        self.is_current = true;
    }

    /// Makes the next frame describe all objects.
    pub fn invalidate(&mut self) {
        self.is_current = false;
    }

    /// The number of blocks in which an object has to be described.
    pub fn changed_block_count(&self) -> usize {
        self.changed.block_count()
    }

    /// The number of words in which an object has to be described.
    pub(crate) fn changed_word_count(&self) -> usize {
        self.changed.word_count()
    }

    /// One of the words in which an object has to be described, by its index among them. They ascend.
    ///
    /// # Panics
    /// If `index` is not below [`ObjectTable::changed_word_count`].
    pub(crate) fn changed_word(&self, index: usize) -> BitWord {
        self.changed.word(index)
    }

    /// Whether all objects have to be described.
    pub(crate) fn all_changed(&self) -> bool {
        self.changed.are_all()
    }

    /// Describes the objects that changed in some blocks, which are counted as [`ObjectTable::changed_block_count`]
    /// counts them.
    pub fn describe(&self, scene: &SceneRef<'_>, blocks: Range<usize>) {
        let Self { draw_states, bins, epoch, .. } = self;
        let inputs = DescriptionInputs { scene, draw_states, bins, epoch: *epoch };
        let mut findings = Findings::default();
        for changed in blocks.clone().map(|index| self.changed.block(index)) {
            findings |= describe_block(&inputs, &mut self.blocks[changed.block].write(), &changed);
        }
        // One lock a job.
        let mut block_bounds = self.block_bounds.write();
        for block in blocks.map(|index| self.changed.block(index).block) {
            block_bounds.set(block, &self.block(block).word_bounds);
        }
        drop(block_bounds);
        if findings != Findings::default() {
            let mut summary = self.summary.write();
            if findings.draws_changed {
                summary.draws_changed_in = self.epoch;
            }
            summary.has_rejected |= findings.rejects;
        }
    }

    /// Completes the table when all changed objects are described: orders new bins, and counts the objects that are
    /// rejected.
    pub fn finish(&self) {
        self.bins.write().sort();
        self.scene_issues.count_range(IssueReason::ObjectLimit, self.length..self.scene_length);
        if self.summary.read().has_rejected {
            let mut has_rejected = false;
            for (index, block) in self.blocks[..self.block_count()].iter().enumerate() {
                for (entry, reason) in block.read().rejected() {
                    has_rejected = true;
                    self.scene_issues.count(reason, index * Self::BLOCK_SIZE + entry);
                }
            }
            self.summary.write().has_rejected = has_rejected;
        }
    }

    /// Orders the objects by bin, unless they are, for passes that use [`ObjectTable::objects_by_bin`]. Call it once a
    /// frame, when the table is complete.
    ///
    /// It waits for a frame with the same inputs as the one before: where an object is drawn in another way in every
    /// frame, or their number changes, ordering all of them each time would cost more than it saves.
    pub(crate) fn order_by_bin(&self) {
        let by_bin = &mut *self.by_bin.write();
        let inputs = Some(self.bin_inputs());
        if std::mem::replace(&mut by_bin.latest, inputs) != inputs || by_bin.made_for == inputs {
            return;
        }
        let bins = self.bins.read();
        by_bin.objects.clear();
        let with_bins = if bins.len() > 0 { self.length } else { 0 };
        for (index, objects) in Self::block_ranges(0..with_bins) {
            objects.zip(&self.block(index).bins).for_each(|(object, &bin)| by_bin.objects.push(object as u32, bin));
        }
        by_bin.objects.order(&bins);
        by_bin.made_for = inputs;
    }

    /// All objects ordered by bin, those that no view sees among them; `None` in a frame for which they are not
    /// ordered.
    pub(crate) fn objects_by_bin(&self) -> Option<MappedRwLockReadGuard<'_, BinnedSegment>> {
        let by_bin = self.by_bin.read();
        let is_current = by_bin.made_for == Some(self.bin_inputs());
        is_current.then(|| RwLockReadGuard::map(by_bin, |by_bin| &by_bin.objects))
    }

    fn bin_inputs(&self) -> BinInputs {
        BinInputs { draws_changed_in: self.draws_changed_in(), objects: self.length }
    }

    /// Whether an object counts as changed in this frame, because the engine reported it or all objects do.
    pub(crate) fn is_reported(&self, object: usize) -> bool {
        self.changed.contains(object)
    }

    /// An object that changed although it was not reported; `None` if there is none. Call it when the table is
    /// complete.
    pub(crate) fn unreported_change(&self, scene: &SceneRef<'_>) -> Option<usize> {
        let is_as_before = |&object: &usize| {
            let before = self.block(object / Self::BLOCK_SIZE).description(object % Self::BLOCK_SIZE);
            let gathered = GatheredColumns::new(scene, &[object]);
            let columns = gathered.columns();
            let now = PacketDescription::new(&columns, &self.draw_states).object(&columns, 0, object);
            now.ok_or_else(|| rejection_reason(scene, &self.draw_states, object)) == before
        };
        let unreported = |object: &usize| !self.is_reported(*object);
        (0..self.length).filter(unreported).find(|object| !is_as_before(object))
    }

    /// Begins a frame, and describes all its objects.
    pub fn update(&mut self, scene: &SceneRef<'_>) {
        self.begin_frame(&SceneRef { changes: Changes::Unknown, ..*scene });
        self.describe(scene, 0..self.changed_block_count());
        self.finish();
        self.end_frame();
    }

    /// The number of objects, without those beyond the backend's limits.
    pub fn len(&self) -> usize {
        self.length
    }

    /// Whether there are no objects.
    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// A number that grows with each frame in which an object changed.
    pub fn epoch(&self) -> u64 {
        self.epoch
    }

    /// The epoch in which the latest object was drawn in another way than before: with another mesh, material or state.
    pub(crate) fn draws_changed_in(&self) -> u64 {
        self.summary.read().draws_changed_in
    }

    /// The number of blocks that the objects fill.
    pub fn block_count(&self) -> usize {
        self.length.div_ceil(Self::BLOCK_SIZE)
    }

    /// Cuts a range of objects at the borders of blocks: the index of each block, and the objects of the range in it.
    pub fn block_ranges(objects: Range<usize>) -> impl Iterator<Item = (usize, Range<usize>)> {
        block_ranges(objects, Self::BLOCK_SIZE)
    }

    /// Calls `visit` with ranges of objects that contain all objects of some blocks that changed after an epoch. The
    /// ranges ascend; between two of them are at least `gap` objects.
    pub fn for_each_change(&self, blocks: Range<usize>, epoch: u64, gap: usize, visit: impl FnMut(Range<usize>)) {
        let mut ranges = RangeMerger { merged: 0..0, gap, visit };
        if epoch + 1 == self.epoch && self.changed.word_count() > 0 && !self.all_changed() {
            // This frame began the epoch, so its changes are all there are, and they are known one by one.
            self.changed.objects_of_blocks(blocks).for_each(|object| ranges.add(object..object + 1));
        } else {
            for index in blocks {
                let changed_in = self.block(index).changed_in;
                for (packet, _) in changed_in.iter().enumerate().filter(|(_, changed_in)| **changed_in > epoch) {
                    let first = index * Self::BLOCK_SIZE + packet * ObjectBlock::PACKET;
                    ranges.add(first..(first + ObjectBlock::PACKET).min(self.length));
                }
            }
        }
        ranges.end();
    }

    /// The first object of a block, and the GPU layouts of all its objects, 64 bytes each.
    ///
    /// # Panics
    /// If `block` is not below [`ObjectTable::block_count`].
    pub fn gpu_objects(&self, block: usize) -> (usize, MappedRwLockReadGuard<'_, [GpuObject]>) {
        let first = block * Self::BLOCK_SIZE;
        let count = (self.length - first).min(Self::BLOCK_SIZE);
        (first, RwLockReadGuard::map(self.block(block), |block| &block.gpu_objects[..count]))
    }

    /// A block of objects. A guard that is leaked locks it until the next [`ObjectTable::begin_frame`]. Hold none while
    /// objects are described.
    ///
    /// # Panics
    /// If `index` is not below [`ObjectTable::block_count`].
    pub fn block(&self, index: usize) -> RwLockReadGuard<'_, Box<ObjectBlock>> {
        self.blocks[index].read()
    }

    /// The bounds of the blocks.
    pub(crate) fn block_bounds(&self) -> RwLockReadGuard<'_, BlockBounds> {
        self.block_bounds.read()
    }

    /// The bins of the objects. A guard that is leaked locks them until the next [`ObjectTable::begin_frame`].
    pub fn bins(&self) -> RwLockReadGuard<'_, Bins> {
        self.bins.read()
    }

    /// What the frame rejects. Objects are among it after [`ObjectTable::finish`].
    pub fn scene_issues(&self) -> &SceneIssues {
        &self.scene_issues
    }
}

/// Merges ranges that ascend, and are less than `gap` apart.
struct RangeMerger<V> {
    merged: Range<usize>,
    gap: usize,
    visit: V,
}

impl<V: FnMut(Range<usize>)> RangeMerger<V> {
    fn add(&mut self, range: Range<usize>) {
        if !self.merged.is_empty() && range.start < self.merged.end + self.gap {
            self.merged.end = self.merged.end.max(range.end);
        } else {
            let before = std::mem::replace(&mut self.merged, range);
            self.visit(before);
        }
    }

    fn end(mut self) {
        let last = self.merged.clone();
        self.visit(last);
    }

    fn visit(&mut self, range: Range<usize>) {
        if !range.is_empty() {
            (self.visit)(range);
        }
    }
}

/// Unused bins that are not worth removing.
const MIN_UNUSED_BINS: usize = 64;

/// Reads blocks of an object table. The block that was read last stays locked, because what comes next is mostly in the
/// same one.
pub(super) struct BlockReader<'a> {
    table: &'a ObjectTable,
    /// With its index.
    open: Option<(usize, RwLockReadGuard<'a, Box<ObjectBlock>>)>,
}

impl<'a> BlockReader<'a> {
    pub(super) fn new(table: &'a ObjectTable) -> Self {
        Self { table, open: None }
    }

    /// The block that has a word of objects.
    ///
    /// # Panics
    /// As [`BlockReader::block`].
    #[inline]
    pub(super) fn block_of_word(&mut self, word: usize) -> &ObjectBlock {
        self.block(word / ObjectBlock::WORDS)
    }

    /// A block, by index.
    ///
    /// # Panics
    /// If `index` is not below [`ObjectTable::block_count`].
    #[inline]
    pub(super) fn block(&mut self, index: usize) -> &ObjectBlock {
        let (_, block) = match self.open.take() {
            Some((current, block)) if current == index => self.open.insert((current, block)),
            _ => self.open.insert((index, self.table.block(index))),
        };
        block
    }
}

/// The objects that a frame describes anew: all of them, or those that changed.
#[derive(Debug, Default)]
pub(super) struct ChangedObjects {
    /// The number of objects if all of them are described.
    all: Option<usize>,
    /// Otherwise each word with changed objects, ascending.
    words: Vec<BitWord>,
    /// For each block with changed objects, ascending, where its words are in `words`.
    blocks: Vec<Range<usize>>,
    /// While changes are collected, a mask for each word; zeros otherwise.
    masks: Vec<u64>,
}

/// The index of the block that has a word.
fn block_of(word: &BitWord) -> usize {
    word.index() / ObjectBlock::WORDS
}

impl ChangedObjects {
    /// All objects of a scene.
    pub(super) fn set_all(&mut self, objects: usize) {
        self.all = Some(objects);
        self.words.clear();
        self.blocks.clear();
    }

    /// The reported objects, and those at indices that the last frame did not have. Indices beyond `objects` are
    /// ignored.
    pub(super) fn set(&mut self, changes: Changes<'_>, objects_before: usize, objects: usize) {
        self.all = None;
        self.words.clear();
        self.blocks.clear();
        self.masks.resize(objects.div_ceil(BITS_PER_WORD), 0);
        match changes {
            Changes::Unknown => return self.set_all(objects),
            Changes::Objects(indices) => {
                indices.iter().map(|&index| index as usize).filter(|&index| index < objects).for_each(|index| {
                    self.mark(index / BITS_PER_WORD, 1 << (index % BITS_PER_WORD));
                });
            }
            Changes::Ranges(ranges) => {
                ranges.iter().for_each(|range| self.mark_range(range.start as usize, (range.end as usize).min(objects)))
            }
        }
        self.mark_range(objects_before, objects);
        self.words.sort_unstable_by_key(|changed| changed.word);
        for changed in &mut self.words {
            changed.mask = std::mem::take(&mut self.masks[changed.index()]);
        }
        let mut end = 0;
        for words in self.words.chunk_by(|one, next| block_of(one) == block_of(next)) {
            self.blocks.push(end..end + words.len());
            end += words.len();
        }
    }

    fn mark_range(&mut self, start: usize, end: usize) {
        if start < end {
            for word in start / BITS_PER_WORD..end.div_ceil(BITS_PER_WORD) {
                let first = start.saturating_sub(word * BITS_PER_WORD);
                let excess = ((word + 1) * BITS_PER_WORD).saturating_sub(end);
                self.mark(word, (u64::MAX << first) & (u64::MAX >> excess));
            }
        }
    }

    fn mark(&mut self, word: usize, mask: u64) {
        if self.masks[word] == 0 {
            // The mask follows when all are marked.
            self.words.push(BitWord::new(word, 0));
        }
        self.masks[word] |= mask;
    }

    /// The number of words with changed objects.
    pub(super) fn word_count(&self) -> usize {
        self.all.map_or(self.words.len(), |objects| objects.div_ceil(BITS_PER_WORD))
    }

    /// The number of blocks with changed objects.
    pub(super) fn block_count(&self) -> usize {
        self.all.map_or(self.blocks.len(), |objects| objects.div_ceil(ObjectBlock::SIZE))
    }

    /// A block with changed objects, by its index among them. They ascend.
    ///
    /// # Panics
    /// If `index` is not below [`ChangedObjects::block_count`].
    pub(super) fn block(&self, index: usize) -> ChangedBlock {
        let words = if self.are_all() {
            let first = index * ObjectBlock::WORDS;
            first..self.word_count().min(first + ObjectBlock::WORDS)
        } else {
            self.blocks[index].clone()
        };
        let mut changed = ChangedBlock { block: block_of(&self.word(words.start)), masks: [0; ObjectBlock::WORDS] };
        for word in words.map(|index| self.word(index)) {
            changed.masks[word.index() % ObjectBlock::WORDS] = word.mask;
        }
        changed
    }

    /// The changed objects of a range of blocks, where not all objects changed. They ascend.
    pub(super) fn objects_of_blocks(&self, blocks: Range<usize>) -> impl Iterator<Item = usize> {
        debug_assert!(!self.are_all());
        let index_of = |block: usize| self.words.partition_point(|word| block_of(word) < block);
        let words = &self.words[index_of(blocks.start)..index_of(blocks.end)];
        words.iter().flat_map(|word| word.indices())
    }

    /// Whether all objects are described, reported or not.
    pub(super) fn are_all(&self) -> bool {
        self.all.is_some()
    }

    /// A word with changed objects, by index.
    ///
    /// # Panics
    /// If `index` is not below [`ChangedObjects::word_count`].
    pub(super) fn word(&self, index: usize) -> BitWord {
        match self.all {
            Some(objects) => {
                let excess = ((index + 1) * BITS_PER_WORD).saturating_sub(objects);
                BitWord::new(index, u64::MAX >> excess)
            }
            None => self.words[index],
        }
    }

    /// Whether an object is described.
    pub(super) fn contains(&self, object: usize) -> bool {
        let is_marked = |index: usize| self.words[index].contains(object);
        let word = object / BITS_PER_WORD;
        self.are_all() || self.words.binary_search_by_key(&word, |changed| changed.index()).is_ok_and(is_marked)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    fn objects_of(changed: &ChangedObjects) -> Vec<usize> {
        let words = (0..changed.word_count()).map(|index| changed.word(index));
        words
            .flat_map(|BitWord { word, mask }| {
                (0..64).filter(move |bit| mask >> bit & 1 == 1).map(move |bit| word as usize * 64 + bit)
            })
            .collect()
    }

    /// The changed objects, as the blocks have them.
    fn objects_by_block(changed: &ChangedObjects) -> Vec<usize> {
        let blocks: Vec<_> = (0..changed.block_count()).map(|index| changed.block(index)).collect();
        assert!(blocks.is_sorted_by(|one, next| one.block < next.block), "{blocks:?}");
        assert!(blocks.iter().all(|block| block.masks != [0; 4]), "{blocks:?}");
        let bits = |block: &ChangedBlock| {
            let ChangedBlock { block, masks } = *block;
            (0..256).filter(move |bit| masks[bit / 64] >> (bit % 64) & 1 == 1).map(move |bit| block * 256 + bit)
        };
        blocks.iter().flat_map(bits).collect()
    }

    proptest! {
        #[test]
        fn reported_and_new_objects_are_found_once_each(
            indices in prop::collection::vec(0_u32..700, 0..40),
            ranges in prop::collection::vec((0_u32..700, 0_u32..200), 0..5),
            before in 0_usize..600,
            objects in 0_usize..600,
            blocks in (0_usize..3, 0_usize..3).prop_map(|(start, length)| start..start + length),
        ) {
            // A range that ends before it starts is empty.
            let ranges: Vec<Range<u32>> = ranges.iter().map(|&(start, length)| start..start + length.saturating_sub(5)).collect();
            let mut changed = ChangedObjects::default();
            let new: BTreeSet<_> = (before..objects).collect();
            for (changes, reported) in [
                (Changes::Objects(&indices), indices.clone()),
                (Changes::Ranges(&ranges), ranges.iter().cloned().flatten().collect()),
            ] {
                changed.set(changes, before, objects);
                let reported = reported.into_iter().map(|index| index as usize).filter(|&index| index < objects);
                let expected: BTreeSet<_> = reported.chain(new.iter().copied()).collect();
                prop_assert_eq!(objects_of(&changed), expected.iter().copied().collect::<Vec<_>>());
                prop_assert_eq!(objects_by_block(&changed), objects_of(&changed));
                let of_blocks: Vec<_> = changed.objects_of_blocks(blocks.clone()).collect();
                let expected_of_blocks = expected.iter().copied().filter(|object| blocks.contains(&(object / 256)));
                prop_assert_eq!(of_blocks, expected_of_blocks.collect::<Vec<_>>());
                prop_assert!((0..objects).all(|object| changed.contains(object) == expected.contains(&object)));
            }
            changed.set(Changes::Unknown, before, objects);
            prop_assert_eq!(objects_of(&changed), (0..objects).collect::<Vec<_>>());
            prop_assert_eq!(objects_by_block(&changed), objects_of(&changed));
        }
    }
}
