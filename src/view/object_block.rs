//! A block of the object table.

use std::ops::Range;

use super::bounding_spheres::{BoundingSphere, BoundingSpheres};
use super::bounds4::{Bounds4, Overlap};
use super::frustum::Classified;
use super::object_description::{ObjectDescription, ObjectDraw, PacketDescription};
use super::packet_columns::{LANES, PacketColumns};
use super::{BoundingBoxes, Frustum, GpuObject, IssueReason, OrientedBox};
use crate::bit_set::{BITS_PER_WORD, set_bits};
use crate::quality::CullingVolume;
use crate::scene::Blend;

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
