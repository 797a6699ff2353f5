//! The table of a scene's objects, which all views share.

use std::ops::Range;

use multiversion::multiversion;
use parking_lot::{MappedRwLockReadGuard, RwLock, RwLockReadGuard};

use super::block_bounds::BlockBounds;
use super::changed_objects::{ChangedObjects, ChangedWord};
use super::draw_states::DrawStates;
use super::object_block::ObjectBlock;
use super::object_description::{ObjectDraw, PacketDescription, bounding_box, rejection_reason};
use super::packet_columns::{LANES, PacketColumns};
use super::{BoundingBoxes, Frustum, GpuObject, Rejections, set_bits};
use crate::chunked_array::block_ranges;
use crate::command::{Bin, Bins};
use crate::quality::CullingVolume;
use crate::scene::{Changes, SceneRef};

/// A scene's objects: their GPU layout, their bounds, and how they are drawn. Objects that cannot be drawn are rejected.
///
/// The table is kept from frame to frame, and a frame describes the objects that changed. [`ObjectTable::epoch`] counts the
/// frames with changes; what else is kept from frame to frame compares epochs.
///
/// Objects are in blocks, each with its own lock: jobs that fill different blocks never wait for each other, and one
/// uncontended lock per block costs a fraction of a nanosecond per object.
#[derive(Debug, Default)]
pub struct ObjectTable {
    blocks: Vec<RwLock<Box<ObjectBlock>>>,
    block_bounds: RwLock<BlockBounds>,
    bins: RwLock<Bins>,
    rejections: Rejections,
    length: usize,
    /// The culling volume from the next [`ObjectTable::begin_frame`] on.
    culling: CullingVolume,
    /// The culling volume that the blocks' boxes are for.
    boxes_volume: CullingVolume,
    changed: ChangedObjects,
    draw_states: DrawStates,
    /// Whether the table is that of the last frame; if not, the next frame describes all objects.
    is_current: bool,
    epoch: u64,
    summary: RwLock<Summary>,
}

/// What jobs find out about the objects that they describe.
#[derive(Clone, Copy, Debug, Default)]
struct Summary {
    /// The epoch in which an object was last drawn in another way than before.
    draws_changed_in: u64,
    /// Whether an object may be rejected.
    has_rejected: bool,
}

impl ObjectTable {
    /// Objects in a block.
    pub const BLOCK_SIZE: usize = ObjectBlock::SIZE;

    /// Sets the bounding volume that culling tests, from the next [`ObjectTable::begin_frame`] on. The default is spheres.
    pub fn configure(&mut self, volume: CullingVolume) {
        self.culling = volume;
    }

    /// Makes room for a scene's objects, and finds out which of them have to be described: those that changed, or all.
    pub fn begin_frame(&mut self, scene: &SceneRef<'_>) {
        let objects = scene.object_count();
        let assets_changed = self.draw_states.update(scene.assets);
        if assets_changed && self.bins.get_mut().len() > MIN_UNUSED_BINS + 2 * objects {
            // Most of them belong to meshes that are gone.
            self.bins.get_mut().clear();
            self.blocks.iter_mut().for_each(|block| block.get_mut().forget_bins());
        }
        let length_before = std::mem::replace(&mut self.length, objects);
        self.rejections = Rejections::default();
        if self.is_current && !assets_changed && self.boxes_volume == self.culling {
            self.changed.set(scene.changes, length_before, objects);
        } else {
            self.changed.set_all(objects);
        }
        self.is_current = false;
        if self.changed.word_count() > 0 || objects != length_before {
            self.epoch += 1;
        }
        self.resize_blocks(length_before);
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

    /// Ends a frame that succeeded: the next one describes the objects that change until then. Without this call it describes all.
    pub fn end_frame(&mut self) {
        self.is_current = true;
    }

    /// Makes the next frame describe all objects.
    pub fn invalidate(&mut self) {
        self.is_current = false;
    }

    /// The number of words of [`Frustum::WORD`] objects in which an object has to be described.
    pub fn changed_word_count(&self) -> usize {
        self.changed.word_count()
    }

    /// One of the words in which an object has to be described, by its index among them. They ascend.
    ///
    /// # Panics
    /// If `index` is not below [`ObjectTable::changed_word_count`].
    pub(crate) fn changed_word(&self, index: usize) -> ChangedWord {
        self.changed.word(index)
    }

    /// Whether all objects have to be described.
    pub(crate) fn all_changed(&self) -> bool {
        self.changed.are_all()
    }

    /// Describes the objects that changed in a range of words, which are counted as [`ObjectTable::changed_word_count`] counts
    /// them.
    pub fn describe(&self, scene: &SceneRef<'_>, words: Range<usize>) {
        let (mut draws_changed, mut rejects) = (false, false);
        for ChangedWord { word, mask } in words.map(|index| self.changed.word(index)) {
            let found = describe_word(self, scene, word, mask);
            draws_changed |= found.draws_changed;
            rejects |= found.rejects;
        }
        if draws_changed || rejects {
            let mut summary = self.summary.write();
            if draws_changed {
                summary.draws_changed_in = self.epoch;
            }
            summary.has_rejected |= rejects;
        }
    }

    fn bin_of(&self, draw: ObjectDraw) -> u32 {
        let bin = Bin { state: draw.state, mesh: draw.mesh };
        let known = self.bins.read().find(bin);
        known.unwrap_or_else(|| self.bins.write().insert(bin))
    }

    /// Completes the table when all changed objects are described: orders new bins, updates the bounds of blocks, and counts the
    /// objects that are rejected.
    pub fn finish(&self) {
        self.bins.write().sort();
        let mut bounds = self.block_bounds.write();
        let mut latest = None;
        for index in 0..self.changed.word_count() {
            let block = self.changed.word(index).word * Frustum::WORD / Self::BLOCK_SIZE;
            if latest.replace(block) != Some(block) {
                bounds.set(block, &self.blocks[block].read().word_bounds);
            }
        }
        drop(bounds);
        if self.summary.read().has_rejected {
            let mut has_rejected = false;
            for (index, block) in self.blocks[..self.block_count()].iter().enumerate() {
                for (entry, reason) in block.read().rejected() {
                    has_rejected = true;
                    self.rejections.count(reason, index * Self::BLOCK_SIZE + entry);
                }
            }
            self.summary.write().has_rejected = has_rejected;
        }
    }

    /// An object that changed although it was not reported; `None` if there is none. Call it when the table is complete.
    pub(crate) fn unreported_change(&self, scene: &SceneRef<'_>) -> Option<usize> {
        let is_as_before = |&object: &usize| {
            let before = self.block(object / Self::BLOCK_SIZE).description(object % Self::BLOCK_SIZE);
            let mut padded = None;
            let columns = PacketColumns::new(scene, object, &mut padded);
            let now = PacketDescription::new(&columns, &self.draw_states).object(&columns, 0);
            now.ok_or_else(|| rejection_reason(scene, object)) == before
        };
        let unreported = |object: &usize| !self.changed.contains(*object);
        (0..self.length).filter(unreported).find(|object| !is_as_before(object))
    }

    /// Begins a frame, and describes all its objects.
    pub fn update(&mut self, scene: &SceneRef<'_>) {
        self.begin_frame(&SceneRef { changes: Changes::Unknown, ..*scene });
        self.describe(scene, 0..self.changed_word_count());
        self.finish();
        self.end_frame();
    }

    /// The number of objects.
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

    /// Calls `visit` with ranges of objects that contain all objects of some blocks that changed after an epoch. The ranges ascend;
    /// between two of them are at least `gap` objects.
    pub fn for_each_change(&self, blocks: Range<usize>, epoch: u64, gap: usize, mut visit: impl FnMut(Range<usize>)) {
        let mut run = 0..0;
        for index in blocks {
            let changed_in = self.block(index).changed_in;
            for (packet, _) in changed_in.iter().enumerate().filter(|(_, changed_in)| **changed_in > epoch) {
                let first = index * Self::BLOCK_SIZE + packet * ObjectBlock::PACKET;
                if first >= self.length {
                    break;
                }
                if run.is_empty() || first >= run.end + gap {
                    let before = std::mem::replace(&mut run, first..first);
                    if !before.is_empty() {
                        visit(before);
                    }
                }
                run.end = (first + ObjectBlock::PACKET).min(self.length);
            }
        }
        if !run.is_empty() {
            visit(run);
        }
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

    /// A block of objects.
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

    /// The bins of the objects.
    pub fn bins(&self) -> RwLockReadGuard<'_, Bins> {
        self.bins.read()
    }

    /// What the frame rejects. Objects are among it after [`ObjectTable::finish`].
    pub fn rejections(&self) -> &Rejections {
        &self.rejections
    }
}

/// What is found out about the objects of a word.
#[derive(Clone, Copy, Debug, Default)]
struct WordSummary {
    /// Whether one is drawn in another way than before.
    draws_changed: bool,
    /// Whether one is rejected.
    rejects: bool,
}

/// Unused bins that are not worth removing.
const MIN_UNUSED_BINS: usize = 64;

/// If fewer objects of a word change, its bounds are extended. Otherwise they are computed anew.
const EXTENSION_LIMIT: u32 = 16;

/// After this many frames with changes, the bounds of a word are computed anew in any case: objects that travel would leave them large.
const EXTENDED_FRAMES: u64 = 32;

/// Describes the objects of a word that are in the mask.
#[multiversion(targets("x86_64+avx2"))]
fn describe_word(table: &ObjectTable, scene: &SceneRef, word: usize, mask: u64) -> WordSummary {
    let mut found = WordSummary::default();
    let first = word * Frustum::WORD;
    let mut block = table.blocks[first / ObjectTable::BLOCK_SIZE].write();
    for packet in (0..Frustum::WORD).step_by(LANES) {
        let changed = (mask >> packet) as u8;
        if changed == 0 {
            continue;
        }
        block.changed_in[(first + packet) % ObjectTable::BLOCK_SIZE / ObjectBlock::PACKET] = table.epoch;
        let (object, entry) = (first + packet, (first + packet) % ObjectTable::BLOCK_SIZE);
        let mut padded = None;
        let columns = PacketColumns::new(scene, object, &mut padded);
        let described = PacketDescription::new(&columns, &table.draw_states);
        let draws_changed = block.set_packet(entry, changed, &described, &columns);
        found.draws_changed |= draws_changed != 0;
        for lane in set_bits(draws_changed.into()) {
            block.bins[entry + lane] = table.bin_of(described.draws[lane]);
        }
        let rejected = changed & !described.valid;
        found.rejects |= rejected != 0;
        for lane in set_bits(rejected.into()) {
            block.reject(entry + lane, rejection_reason(scene, object + lane));
        }
        let boxed = if block.boxes.is_some() { changed & described.valid } else { 0 };
        for lane in set_bits(boxed.into()) {
            block.set_box(entry + lane, |sphere| bounding_box(scene, object + lane, sphere));
        }
    }
    let word = first % ObjectTable::BLOCK_SIZE / Frustum::WORD;
    let ObjectBlock { spheres, word_bounds, .. } = &mut **block;
    // Words take turns.
    let is_due = (table.epoch + first as u64 / Frustum::WORD as u64).is_multiple_of(EXTENDED_FRAMES);
    if mask.count_ones() < EXTENSION_LIMIT && !is_due {
        let entries = set_bits(mask).map(|bit| word * Frustum::WORD + bit);
        entries.for_each(|entry| word_bounds.extend_word(word, spheres.get(entry)));
    } else {
        word_bounds.set_word(word, spheres);
    }
    found
}
