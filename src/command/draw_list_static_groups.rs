//! What a draw list has of static groups.

use std::ops::Range;

use super::Version;

/// What a draw list has of [static groups](crate::scene::StaticGroup): the objects of all of them, and the batches of
/// those that the view executes. Both come before those of other objects, and do not change with these.
#[derive(Clone, Copy, Debug, Default)]
pub struct DrawListStaticGroups {
    /// The version of the objects.
    version: Version,
    /// The number of objects.
    objects: usize,
    /// The version of the executed static groups.
    executed: Version,
    /// The number of objects that are drawn, and of their batches.
    drawn: usize,
    batches: usize,
}

/// The number of batches in a bundle.
pub(super) const BATCHES_PER_BUNDLE: usize = 256;

impl DrawListStaticGroups {
    /// The version of the objects of static groups: a backend that holds those of this version need not upload them
    /// again.
    pub fn version(&self) -> Version {
        self.version
    }

    /// The number of objects of all static groups, executed or not.
    pub fn object_count(&self) -> usize {
        self.objects
    }

    /// The number of objects that are drawn.
    pub fn drawn_count(&self) -> usize {
        self.drawn
    }

    /// The number of batches that are drawn.
    pub fn batch_count(&self) -> usize {
        self.batches
    }

    /// The number of bundles that are drawn.
    pub fn bundle_count(&self) -> usize {
        self.batches.div_ceil(BATCHES_PER_BUNDLE)
    }

    /// Prepares for other objects, and returns whether they are others: then none is executed.
    pub(super) fn set_objects(&mut self, version: Version, objects: usize) -> bool {
        let differs = self.version != version;
        if differs {
            *self = Self { version, objects, ..Self::default() };
        }
        differs
    }

    /// Prepares for other executed static groups, and returns whether they are others.
    pub(super) fn set_executed(&mut self, version: Version) -> bool {
        let differs = self.executed != version;
        if differs {
            *self = Self { executed: version, drawn: 0, batches: 0, ..*self };
        }
        differs
    }

    /// Counts what is executed.
    pub(super) fn set_drawn(&mut self, objects: usize, batches: usize) {
        (self.drawn, self.batches) = (objects, batches);
    }

    /// The indices of the batches of a bundle.
    pub(super) fn bundle_range(&self, index: usize) -> Range<usize> {
        let start = index * BATCHES_PER_BUNDLE;
        start..self.batches.min(start + BATCHES_PER_BUNDLE)
    }
}

/// Lists are equal whatever they were made from.
impl PartialEq for DrawListStaticGroups {
    fn eq(&self, other: &Self) -> bool {
        (self.objects, self.drawn, self.batches) == (other.objects, other.drawn, other.batches)
    }
}

impl Eq for DrawListStaticGroups {}
