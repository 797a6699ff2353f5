//! Describes the changed objects of a block, in packets of eight.

use std::ops::BitOrAssign;

use multiversion::multiversion;
use parking_lot::RwLock;

use super::changed_objects::ChangedBlock;
use super::draw_states::DrawStates;
use super::object_block::ObjectBlock;
use super::object_description::{ObjectDraw, PacketDescription, bounding_box, rejection_reason};
use super::packet_columns::{GatheredColumns, LANES, Lanes, PacketColumns};
use crate::bit_set::{BITS_PER_WORD, set_bits};
use crate::command::{Bin, Bins};
use crate::scene::SceneRef;

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
