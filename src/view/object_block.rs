//! A block of the object table: its objects are described in packets of eight, and tested against frustums in words.

use std::ops::{BitOrAssign, Range};

use multiversion::multiversion;
use parking_lot::RwLock;

use super::bounds4::{Bounds4, Overlap};
use super::draw_states::DrawStates;
use super::frustum::{BoundingSphere, BoundingSpheres, Classified};
use super::object_description::{
    GatheredColumns, LANES, Lanes, ObjectDescription, ObjectDraw, PacketColumns, PacketDescription, bounding_box,
    rejection_reason,
};
use super::{BoundingBoxes, Frustum, GpuObject, IssueReason, OrientedBox};
use crate::bit_set::{BITS_PER_WORD, set_bits};
use crate::command::{Bin, Bins};
use crate::quality::CullingVolume;
use crate::scene::{Blend, SceneRef};

/// [`ObjectBlock::SIZE`] objects of the object table; object `index` is at `index % SIZE`.
#[derive(Clone, Debug)]
pub struct ObjectBlock {
    /// The GPU layouts to upload.
    pub gpu_objects: [GpuObject; Self::SIZE],
    /// The bounding spheres.
    pub spheres: BoundingSpheres,
    /// The bounding boxes, if the culling volume is a box.
    pub boxes: Option<BoundingBoxes>,
    /// The meshes, materials and states.
    pub draws: [ObjectDraw; Self::SIZE],
    /// The number of each object's [bin](crate::command::Bins).
    pub bins: [u32; Self::SIZE],
    /// The objects without blending: a mask for each word.
    pub(crate) opaque: [u64; Self::WORDS],
    /// The objects that a view may see, because they are neither rejected nor removed: a mask for each word.
    drawable: [u64; Self::WORDS],
    /// The bounds of each word.
    pub(super) word_bounds: Bounds4,
    /// The table's epoch when an object of a packet of [`ObjectBlock::PACKET`] last changed.
    pub(super) changed_in: [u64; Self::SIZE / Self::PACKET],
    /// The number of objects that are rejected, and why they are.
    rejected_count: usize,
    rejected: [Option<IssueReason>; Self::SIZE],
}

impl ObjectBlock {
    /// The number of objects in a block.
    pub const SIZE: usize = BoundingSpheres::COUNT;

    /// The number of objects in a packet: whole packets are described together.
    pub(super) const PACKET: usize = LANES;

    /// The number of words in a block.
    pub(crate) const WORDS: usize = Self::SIZE / BITS_PER_WORD;

    /// Replaces eight objects, from `object` of the scene on, by their descriptions. Returns a mask of those whose
    /// mesh, material or state changed, and with them perhaps their bin.
    ///
    /// # Panics
    /// If not all of them are in the same block.
    #[inline(always)]
    pub(super) fn set_packet(&mut self, object: usize, packet: &PacketDescription, columns: &PacketColumns<'_>) -> u8 {
        if packet.valid != u8::MAX {
            return self.set_partly_valid(object, packet, columns);
        }
        let entry = object % Self::SIZE;
        let mut draws_changed = 0;
        self.spheres.set_packet(entry, &packet.centers, &packet.radii);
        let gpu_objects = self.gpu_objects[entry..].first_chunk_mut::<LANES>().expect("packets do not cross blocks");
        let draws = self.draws[entry..].first_chunk::<LANES>().expect("packets do not cross blocks");
        for lane in 0..LANES {
            gpu_objects[lane] = packet.gpu_object(columns, lane, object + lane);
            draws_changed |= u8::from(draws[lane] != packet.draws[lane]) << lane;
        }
        let (word, shift) = (entry / BITS_PER_WORD, entry % BITS_PER_WORD);
        self.drawable[word] |= u64::from(u8::MAX) << shift;
        if self.rejected_count > 0 {
            (0..LANES).for_each(|lane| self.set_rejected(entry + lane, None));
        }
        for lane in set_bits(draws_changed.into()) {
            self.set_draw(entry + lane, packet.draws[lane]);
        }
        draws_changed
    }

    #[cold]
    fn set_partly_valid(&mut self, object: usize, packet: &PacketDescription, columns: &PacketColumns<'_>) -> u8 {
        let set = |changed, lane| changed | u8::from(self.set_object(object + lane, packet, columns, lane)) << lane;
        (0..LANES).fold(0, set)
    }

    /// Replaces an object of the scene by its description in a packet. Returns whether its mesh, material or state
    /// changed. If it is invalid, no view sees it.
    #[inline(always)]
    pub(super) fn set_object(
        &mut self,
        object: usize,
        packet: &PacketDescription,
        columns: &PacketColumns<'_>,
        lane: usize,
    ) -> bool {
        let entry = object % Self::SIZE;
        let (word, bit) = (entry / BITS_PER_WORD, 1 << (entry % BITS_PER_WORD));
        let Some(ObjectDescription { gpu_object, bounds, draw }) = packet.object(columns, lane, object) else {
            self.spheres.set(entry, BoundingSphere::EMPTY);
            self.drawable[word] &= !bit;
            return false;
        };
        self.spheres.set(entry, bounds);
        self.drawable[word] |= bit;
        self.gpu_objects[entry] = gpu_object;
        if self.rejected_count > 0 {
            self.set_rejected(entry, None);
        }
        let draw_changed = self.draws[entry] != draw;
        if draw_changed {
            self.set_draw(entry, draw);
        }
        draw_changed
    }

    fn set_draw(&mut self, entry: usize, draw: ObjectDraw) {
        self.draws[entry] = draw;
        let (word, bit) = (entry / BITS_PER_WORD, entry % BITS_PER_WORD);
        self.opaque[word] = self.opaque[word] & !(1 << bit) | u64::from(draw.state.blend() == Blend::None) << bit;
    }

    /// Replaces an object's box, if the culling volume is a box.
    pub(super) fn set_box(&mut self, entry: usize, make: impl FnOnce(BoundingSphere) -> OrientedBox) {
        if let Some(boxes) = &mut self.boxes {
            boxes.set(entry, &make(self.spheres.get(entry)));
        }
    }

    /// The description of an object, or why it is rejected.
    pub(super) fn description(&self, entry: usize) -> Result<ObjectDescription, IssueReason> {
        let (gpu_object, bounds, draw) = (self.gpu_objects[entry], self.spheres.get(entry), self.draws[entry]);
        self.rejected[entry].map_or(Ok(ObjectDescription { gpu_object, bounds, draw }), Err)
    }

    /// The rejected objects.
    pub(super) fn rejected(&self) -> impl Iterator<Item = (usize, IssueReason)> {
        let searched = if self.rejected_count > 0 { &self.rejected[..] } else { &[] };
        searched.iter().enumerate().filter_map(|(entry, reason)| reason.map(|reason| (entry, reason)))
    }

    /// Removes an object: no view sees it.
    pub(super) fn remove(&mut self, entry: usize) {
        self.spheres.set(entry, BoundingSphere::EMPTY);
        self.drawable[entry / BITS_PER_WORD] &= !(1 << (entry % BITS_PER_WORD));
        self.set_rejected(entry, None);
    }

    /// Rejects an object that its packet's description left empty: no view sees it.
    pub(super) fn reject(&mut self, entry: usize, reason: IssueReason) {
        self.set_rejected(entry, Some(reason));
    }

    fn set_rejected(&mut self, entry: usize, reason: Option<IssueReason>) {
        if self.rejected[entry] != reason {
            let before = std::mem::replace(&mut self.rejected[entry], reason);
            self.rejected_count = self.rejected_count - usize::from(before.is_some()) + usize::from(reason.is_some());
        }
    }

    /// Removes the objects from their bins, whose numbers are about to be given anew.
    pub(super) fn forget_bins(&mut self) {
        self.draws = [ObjectDraw::NONE; Self::SIZE];
        // Objects without a bin have a number as well, which must be one that exists.
        self.bins = [0; Self::SIZE];
    }

    /// Tests the words from `words.start` on, each of 64 objects, against a frustum: see
    /// [`ObjectBlock::visible`]. Calls `put` with each and a mask of the objects that a view may see. Words that lie
    /// outside or inside as a whole have the same masks as if their objects were tested.
    ///
    /// # Panics
    /// If `words` are not within the block.
    pub fn visible_words(
        &self,
        frustum: &Frustum,
        volume: CullingVolume,
        words: Range<usize>,
        mut put: impl FnMut(usize, u64),
    ) {
        let overlaps = match volume {
            CullingVolume::None => [Overlap::Inside; Self::WORDS],
            _ => frustum.overlaps(&self.word_bounds),
        };
        for word in words {
            let mask = match overlaps[word] {
                Overlap::Outside => 0,
                Overlap::Inside => self.drawable[word],
                Overlap::Partial => self.visible(frustum, volume, word * BITS_PER_WORD..(word + 1) * BITS_PER_WORD),
            };
            put(word, mask);
        }
    }

    /// The objects of a word that a view may see, whatever its frustum: a mask.
    pub(crate) fn drawable(&self, word: usize) -> u64 {
        self.drawable[word]
    }

    /// Tests objects of a word against a frustum: see [`ObjectBlock::visible`]. The mask that it returns is among
    /// `tested`; bit 0 of both is the word's first object.
    pub(crate) fn visible_among(&self, frustum: &Frustum, volume: CullingVolume, word: usize, tested: u64) -> u64 {
        let first = word * BITS_PER_WORD;
        if tested.count_ones() as usize >= WORD_TEST_THRESHOLD {
            return self.visible(frustum, volume, first..first + BITS_PER_WORD) & tested;
        }
        set_bits(tested).fold(0, |mask, bit| mask | self.visible(frustum, volume, first + bit..first + bit + 1) << bit)
    }

    /// Tests the objects `entries`, all in one word of 64 objects, against a frustum. Returns a mask of
    /// the objects that a view may see; bit 0 is `entries.start`. The mask contains every visible object and no
    /// rejected one; it may contain a few invisible ones.
    ///
    /// Spheres are tested first, whatever the volume: they decide most objects to be entirely outside or inside. Only
    /// the others' boxes are tested.
    ///
    /// # Panics
    /// If `entries` is empty or not within the block.
    pub fn visible(&self, frustum: &Frustum, volume: CullingVolume, entries: Range<usize>) -> u64 {
        let offset = entries.start % BITS_PER_WORD;
        let first = entries.start - offset;
        let tested = (u64::MAX >> (BITS_PER_WORD - entries.len())) << offset;
        if volume == CullingVolume::None {
            return (self.drawable[first / BITS_PER_WORD] & tested) >> offset;
        }
        if entries.len() < WORD_TEST_THRESHOLD {
            let intersects = |entry: usize| {
                let BoundingSphere { center, radius } = self.spheres.get(entry);
                frustum.intersects_sphere(center, radius)
            };
            let test = |mask, entry: usize| mask | u64::from(intersects(entry)) << (entry - entries.start);
            return self.test_boxes(frustum, first, entries.clone().fold(0, test) << offset) >> offset;
        }
        match &self.boxes {
            None => (frustum.intersects_spheres(&self.spheres, first) & tested) >> offset,
            Some(_) => {
                let Classified { intersecting, inside } = frustum.classify_spheres(&self.spheres, first);
                let intersecting = intersecting & tested;
                (intersecting & inside | self.test_boxes(frustum, first, intersecting & !inside)) >> offset
            }
        }
    }

    /// The `candidates`, in the word from `first` on, whose boxes intersect the frustum; all of them if there are no
    /// boxes.
    fn test_boxes(&self, frustum: &Frustum, first: usize, candidates: u64) -> u64 {
        self.boxes
            .as_ref()
            .map_or(candidates, |boxes| frustum.intersects_boxes(&self.spheres, boxes, first, candidates))
    }
}

/// Fewer objects than this are tested one by one, which takes less time than testing a whole word.
const WORD_TEST_THRESHOLD: usize = 12;

impl Default for ObjectBlock {
    fn default() -> Self {
        Self {
            gpu_objects: [bytemuck::Zeroable::zeroed(); Self::SIZE],
            spheres: BoundingSpheres::default(),
            boxes: None,
            draws: [ObjectDraw::NONE; Self::SIZE],
            bins: [0; Self::SIZE],
            opaque: [0; Self::WORDS],
            drawable: [0; Self::WORDS],
            word_bounds: Bounds4::default(),
            changed_in: [0; Self::SIZE / Self::PACKET],
            rejected_count: 0,
            rejected: [None; Self::SIZE],
        }
    }
}

/// Changed objects of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ChangedBlock {
    /// The index of the block.
    pub(super) block: usize,
    /// A mask for each of its words.
    pub(super) masks: [u64; ObjectBlock::WORDS],
}

impl ChangedBlock {
    /// The first object of one of the block's words.
    pub(super) fn first_object(&self, word: usize) -> usize {
        self.block * ObjectBlock::SIZE + word * BITS_PER_WORD
    }
}

/// What the description of an object depends on.
pub(super) struct DescriptionInputs<'a> {
    pub(super) scene: &'a SceneRef<'a>,
    pub(super) draw_states: &'a DrawStates,
    /// The bins that are known. Others are added.
    pub(super) bins: &'a RwLock<Bins>,
    /// The epoch of the frame.
    pub(super) epoch: u64,
}

/// What is found out about changed objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Findings {
    /// Whether one is drawn in another way than before.
    pub(super) draws_changed: bool,
    /// Whether one is rejected.
    pub(super) rejects: bool,
}

impl BitOrAssign for Findings {
    fn bitor_assign(&mut self, other: Self) {
        self.draws_changed |= other.draws_changed;
        self.rejects |= other.rejects;
    }
}

/// If fewer objects of a word change, its bounds are extended. Otherwise they are computed anew.
const EXTENSION_LIMIT: u32 = 16;

/// After this many frames with changes, the bounds of a word are computed anew in any case: objects that travel would
/// leave them large.
const EXTENDED_FRAMES: u64 = 32;

/// Describes the changed objects of a block.
///
/// Packets that changed as a whole are read directly from the columns. The other objects are gathered: scattered
/// changes share packets, so eight of them cost one packet, not eight.
pub(super) fn describe_block(inputs: &DescriptionInputs, block: &mut ObjectBlock, changed: &ChangedBlock) -> Findings {
    let (mut findings, mut gathered) = (Findings::default(), [0; ObjectBlock::WORDS]);
    for (word, &mask) in changed.masks.iter().enumerate().filter(|(_, mask)| **mask != 0) {
        let first = changed.first_object(word);
        let mut whole = 0_u64;
        for packet in (0..BITS_PER_WORD).step_by(LANES) {
            let changed_in_packet = (mask >> packet) as u8;
            if changed_in_packet != 0 {
                block.changed_in[(word * BITS_PER_WORD + packet) / LANES] = inputs.epoch;
            }
            if changed_in_packet == u8::MAX {
                whole |= u64::from(u8::MAX) << packet;
            }
        }
        gathered[word] = mask & !whole;
        if whole != 0 {
            findings |= describe_packets(inputs, block, first, whole);
        }
        // While its spheres are in the nearest cache.
        if gathered[word] == 0 {
            update_word_bounds(inputs.epoch, block, first, mask);
        }
    }
    if gathered != [0; ObjectBlock::WORDS] {
        findings |= describe_gathered(inputs, block, changed, &gathered);
    }
    findings
}

/// Describes the objects of a word, whose first one is `first`, that are in a mask of whole packets.
#[multiversion(targets("x86_64+avx2"))]
fn describe_packets(inputs: &DescriptionInputs, block: &mut ObjectBlock, first: usize, mask: u64) -> Findings {
    let mut findings = Findings::default();
    for packet in (0..BITS_PER_WORD).step_by(LANES) {
        if mask >> packet & 1 == 0 {
            continue;
        }
        let object = first + packet;
        let columns = PacketColumns::new(inputs.scene, object);
        let described = PacketDescription::new(&columns, inputs.draw_states);
        let draws_changed = block.set_packet(object, &described, &columns);
        let remaining = RemainingWork::new(block, &described, u8::MAX, draws_changed);
        if remaining.any() {
            let mut objects = [object; LANES];
            (0..LANES).for_each(|lane| objects[lane] += lane);
            remaining.complete(inputs, block, &objects, &described.draws);
        }
        findings |= remaining.findings();
    }
    findings
}

/// Describes the changed objects of a block that are in a mask for each of its words, and completes the bounds of these
/// words.
#[multiversion(targets("x86_64+avx2"))]
fn describe_gathered(
    inputs: &DescriptionInputs,
    block: &mut ObjectBlock,
    changed: &ChangedBlock,
    masks: &[u64; ObjectBlock::WORDS],
) -> Findings {
    let (mut findings, mut objects, mut count) = (Findings::default(), [0; LANES], 0);
    for (word, &mask) in masks.iter().enumerate() {
        let first = changed.first_object(word);
        for bit in set_bits(mask) {
            objects[count] = first + bit;
            count += 1;
            if count == LANES {
                findings |= describe_objects(inputs, block, &objects);
                count = 0;
            }
        }
    }
    if count > 0 {
        findings |= describe_objects(inputs, block, &objects[..count]);
    }
    for (word, _) in masks.iter().enumerate().filter(|(_, mask)| **mask != 0) {
        update_word_bounds(inputs.epoch, block, changed.first_object(word), changed.masks[word]);
    }
    findings
}

/// Describes up to eight objects of a block.
#[inline(always)]
fn describe_objects(inputs: &DescriptionInputs, block: &mut ObjectBlock, objects: &[usize]) -> Findings {
    let gathered = GatheredColumns::new(inputs.scene, objects);
    let columns = gathered.columns();
    let described = PacketDescription::new(&columns, inputs.draw_states);
    let (mut used, mut draws_changed) = (0, 0);
    for (lane, &object) in objects.iter().enumerate() {
        used |= 1 << lane;
        draws_changed |= u8::from(block.set_object(object, &described, &columns, lane)) << lane;
    }
    let remaining = RemainingWork::new(block, &described, used, draws_changed);
    if remaining.any() {
        remaining.complete(inputs, block, objects, &described.draws);
    }
    remaining.findings()
}

/// What objects of a packet need besides their description: a mask for each need.
#[derive(Clone, Copy)]
struct RemainingWork {
    bin: u8,
    rejection_reason: u8,
    bounding_box: u8,
}

impl RemainingWork {
    /// What the lanes in the mask `used` need.
    #[inline(always)]
    fn new(block: &ObjectBlock, described: &PacketDescription, used: u8, draws_changed: u8) -> Self {
        let bounding_box = if block.boxes.is_some() { used & described.valid } else { 0 };
        Self { bin: draws_changed, rejection_reason: used & !described.valid, bounding_box }
    }

    #[inline(always)]
    fn any(self) -> bool {
        self.bin | self.rejection_reason | self.bounding_box != 0
    }

    #[inline(always)]
    fn findings(self) -> Findings {
        Findings { draws_changed: self.bin != 0, rejects: self.rejection_reason != 0 }
    }

    /// Completes the objects, which are drawn as `draws` says.
    #[inline(never)]
    fn complete(
        self,
        inputs: &DescriptionInputs,
        block: &mut ObjectBlock,
        objects: &[usize],
        draws: &Lanes<ObjectDraw>,
    ) {
        for lane in set_bits(self.bin.into()) {
            block.bins[objects[lane] % ObjectBlock::SIZE] = bin_of(inputs.bins, draws[lane]);
        }
        for lane in set_bits(self.rejection_reason.into()) {
            let reason = rejection_reason(inputs.scene, inputs.draw_states, objects[lane]);
            block.reject(objects[lane] % ObjectBlock::SIZE, reason);
        }
        for lane in set_bits(self.bounding_box.into()) {
            let object = objects[lane];
            block.set_box(object % ObjectBlock::SIZE, |sphere| bounding_box(inputs.scene, object, sphere));
        }
    }
}

fn bin_of(bins: &RwLock<Bins>, draw: ObjectDraw) -> u32 {
    let bin = Bin { state: draw.state, mesh: draw.mesh };
    let known = bins.read().find(bin);
    known.unwrap_or_else(|| bins.write().insert(bin))
}

/// Makes the bounds of a word, whose first object is `first`, contain its changed objects, which are in the mask.
#[multiversion(targets("x86_64+avx2"))]
fn update_word_bounds(epoch: u64, block: &mut ObjectBlock, first: usize, changed: u64) {
    let word = first / BITS_PER_WORD % ObjectBlock::WORDS;
    let ObjectBlock { spheres, word_bounds, .. } = block;
    // Words take turns.
    let is_due = (epoch + (first / BITS_PER_WORD) as u64).is_multiple_of(EXTENDED_FRAMES);
    if changed.count_ones() < EXTENSION_LIMIT && !is_due {
        let entries = set_bits(changed).map(|bit| word * BITS_PER_WORD + bit);
        entries.for_each(|entry| word_bounds.extend_word(word, spheres.get(entry)));
    } else {
        word_bounds.set_word(word, spheres);
    }
}
