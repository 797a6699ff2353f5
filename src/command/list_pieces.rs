//! What a draw list has of pieces.

use std::ops::Range;

use super::Version;

/// What a draw list has of [pieces](crate::scene::Piece): the objects of all of them, and the batches of those that the view executes. Both come
/// before those of other objects, and stay as they are while these change.
#[derive(Clone, Debug, Default)]
pub struct ListPieces {
    /// The version of the objects.
    version: Version,
    /// The number of objects, and of bundles that all pieces may have.
    objects: usize,
    slots: usize,
    /// The version of the executed pieces.
    executed: Version,
    /// The number of objects that are drawn.
    drawn: usize,
    /// The bundles of the executed pieces, in order.
    bundles: Vec<PieceBundle>,
}

/// A bundle of a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct PieceBundle {
    /// The end of its batches. They begin where those of the bundle before end.
    end: u32,
    slot: u32,
}

/// The number of batches in a bundle.
pub(super) const BATCHES_PER_BUNDLE: usize = 256;

impl ListPieces {
    /// The version of the objects of pieces: a backend that holds those of this version need not upload them again.
    pub fn version(&self) -> Version {
        self.version
    }

    /// The number of objects of all pieces, executed or not.
    pub fn object_count(&self) -> usize {
        self.objects
    }

    /// The number of objects that are drawn.
    pub fn drawn_count(&self) -> usize {
        self.drawn
    }

    /// The number of batches that are drawn.
    pub fn batch_count(&self) -> usize {
        self.bundles.last().map_or(0, |bundle| bundle.end as usize)
    }

    /// The number of bundles that are drawn.
    pub fn bundle_count(&self) -> usize {
        self.bundles.len()
    }

    /// The number of bundles that a piece of so many objects has at most.
    pub(crate) fn max_bundles(objects: usize) -> usize {
        objects.div_ceil(BATCHES_PER_BUNDLE)
    }

    pub(super) fn clear(&mut self) {
        *self = Self { bundles: std::mem::take(&mut self.bundles), ..Self::default() };
        self.bundles.clear();
    }

    /// Prepares for other objects and returns whether there are others: then none is executed.
    pub(super) fn set_objects(&mut self, version: Version, (objects, slots): (usize, usize)) -> bool {
        if self.version == version {
            return false;
        }
        self.clear();
        (self.version, self.objects, self.slots) = (version, objects, slots);
        true
    }

    /// Prepares for other executed pieces, and returns whether there are others.
    pub(super) fn set_executed(&mut self, version: Version) -> bool {
        let differs = self.executed != version;
        if differs {
            self.executed = version;
            self.drawn = 0;
            self.bundles.clear();
        }
        differs
    }

    /// Appends an executed piece, the number of whose first bundle is `slot`.
    pub(super) fn push(&mut self, objects: usize, batches: usize, slot: usize) {
        self.drawn += objects;
        let (first, end) = (self.batch_count(), self.batch_count() + batches);
        let ends = (first..end).step_by(BATCHES_PER_BUNDLE).map(|start| end.min(start + BATCHES_PER_BUNDLE));
        self.bundles.extend(ends.zip(slot..).map(|(end, slot)| PieceBundle { end: end as u32, slot: slot as u32 }));
    }

    /// The indices of the batches of a bundle.
    pub(super) fn bundle_range(&self, index: usize) -> Range<usize> {
        let start = index.checked_sub(1).map_or(0, |before| self.bundles[before].end);
        start as usize..self.bundles[index].end as usize
    }

    pub(super) fn bundle_slot(&self, index: usize) -> usize {
        self.bundles[index].slot as usize
    }

    /// More than the number of every bundle of a piece.
    pub(super) fn slot_count(&self) -> usize {
        self.slots
    }
}

/// Lists are equal whatever they were made from.
impl PartialEq for ListPieces {
    fn eq(&self, other: &Self) -> bool {
        (self.objects, self.drawn, &self.bundles) == (other.objects, other.drawn, &other.bundles)
    }
}

impl Eq for ListPieces {}
