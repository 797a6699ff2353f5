//! What one pass draws, and what of it belongs to static groups.

use std::ops::{DerefMut, Range};

use super::{Batch, Bin, BinnedSegment, Bins, Bucket, ItemList, RenderCommand};

/// The version of something that is kept from frame to frame: equal versions have equal contents, so what is derived
/// from one need not be derived again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Version {
    /// The renderer's frame that made it, counted from 1; 0 for what no frame has made.
    pub frame: u64,
    /// Its index among what that frame made of the same kind.
    pub index: usize,
}

/// What one pass draws: sorted commands, the batches they merge into, and the objects of each batch.
#[derive(Clone, Debug, Default)]
pub struct DrawList {
    /// The commands in draw order, bucket by bucket, of a pass that sorts them. Only the first `bucket_count` vectors
    /// are part of the list; the others keep their memory for later frames.
    commands: Vec<Vec<RenderCommand>>,
    bucket_count: usize,
    /// The batches in draw order: those of the static groups that the view executes, then all others.
    pub batches: Vec<Batch>,
    /// What batches draw: the object index of each command, which are the 4 bytes per object that a pass uploads. Those
    /// of [static groups](crate::scene::StaticGroup) come first, also of static groups that the view does not execute.
    pub objects: Vec<u32>,
    /// Which of the objects and batches belong to static groups.
    static_groups: DrawListStaticGroups,
    /// The corners of the remaining triangles of partial batches, three per triangle.
    remaining_indices: Vec<u32>,
    /// The indices of partial batches, ascending, each with its range of `remaining_indices`.
    partial_batches: Vec<(u32, Range<u32>)>,
    /// What a pass of [items](crate::process::Draws::Items) draws, which has no commands and batches.
    pub items: ItemList,
    /// The version of batches and objects, without the objects of static groups.
    version: Version,
    /// The number of batches in a bundle, if it is less than [`DrawList::BATCHES_PER_BUNDLE`].
    bundle_size: Option<usize>,
    /// Scratch memory: the runs of all segments that are joined.
    run_order: Vec<SegmentRun>,
}

/// A run of a segment. Runs are ordered as they are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct SegmentRun {
    bin_rank: u32,
    level: u32,
    segment: u32,
    /// The first and the end of its objects in the segment.
    objects: [u32; 2],
}

impl DrawList {
    /// The most batches in a bundle, and their number unless a [`Granularity`](crate::Granularity) asks for fewer:
    /// smaller bundles cost up to three times as much per draw.
    pub const BATCHES_PER_BUNDLE: usize = 256;

    /// Sets the number of batches in a bundle, from 1 to [`BATCHES_PER_BUNDLE`](Self::BATCHES_PER_BUNDLE). Bundles of
    /// static groups are recorded once and keep that size.
    pub(crate) fn set_batches_per_bundle(&mut self, batches: usize) {
        self.bundle_size = (batches < Self::BATCHES_PER_BUNDLE).then_some(batches.max(1));
    }

    /// The version of the list: a backend that holds what it made of one need not make it again. Partial batches are no
    /// part of it. Lists of [`Version::default`] may differ.
    pub fn version(&self) -> Version {
        self.version
    }

    /// Gives the list a version, which no other list has.
    pub fn set_version(&mut self, version: Version) {
        self.version = version;
    }

    /// Removes everything and keeps the memory.
    pub fn clear(&mut self) {
        self.static_groups = DrawListStaticGroups::default();
        self.clear_own();
    }

    /// Removes everything but what belongs to static groups.
    pub(crate) fn clear_own(&mut self) {
        self.version = Version::default();
        self.bucket_count = 0;
        self.batches.truncate(self.static_groups.batch_count());
        self.objects.truncate(self.static_groups.object_count());
        self.remaining_indices.clear();
        self.partial_batches.clear();
        self.items.clear();
    }

    /// The number of its batches and items.
    pub(crate) fn draw_count(&self) -> usize {
        self.batches.len() + self.items.items().len()
    }

    /// Appends a bucket. The list takes the bucket's vectors and leaves its own in exchange, so neither allocates.
    ///
    /// The bucket's first batch continues the list's last one where both have the same state and mesh, and `can_merge`
    /// holds for that mesh's slot: the list does not depend on where the buckets begin.
    pub fn append(&mut self, bucket: &mut Bucket, can_merge: impl Fn(u32) -> bool) {
        if self.bucket_count == self.commands.len() {
            self.commands.push(Vec::new());
        }
        std::mem::swap(&mut self.commands[self.bucket_count], &mut bucket.commands);
        self.bucket_count += 1;
        if self.objects.is_empty() {
            std::mem::swap(&mut self.batches, &mut bucket.batches);
            std::mem::swap(&mut self.objects, &mut bucket.objects);
            return;
        }
        let first = self.objects.len() as u32;
        let mut batches = bucket.batches.iter().map(|batch| Batch { first: first + batch.first, ..*batch }).peekable();
        if let Some(last) = self.batches.last_mut().filter(|last| can_merge(last.mesh))
            && let Some(same) = batches.next_if(|next| (next.state, next.mesh) == (last.state, last.mesh))
        {
            last.count += same.count;
        }
        self.batches.extend(batches);
        self.objects.extend_from_slice(&bucket.objects);
    }

    /// Joins the segments of a pass that orders its objects by bin. Each bin becomes one batch for each level of
    /// detail. If `can_merge` is false for its mesh's slot, each object becomes a batch. The list may take the vectors
    /// of the segments and leave its own in exchange.
    ///
    /// The list has no commands. It does not depend on where the segments begin.
    pub fn join_bins<S: DerefMut<Target = BinnedSegment>>(
        &mut self,
        segments: &mut [S],
        bins: &Bins,
        can_merge: impl Fn(u32) -> bool,
    ) {
        if let [segment] = segments {
            let (mut index, first) = (0, self.objects.len());
            while let Some((run, objects)) = segment.run(index) {
                self.push_batches(bins, run, first + objects.start..first + objects.end, &can_merge);
                index += 1;
            }
            if first == 0 {
                std::mem::swap(&mut self.objects, segment.by_bin_mut());
            } else {
                self.objects.extend_from_slice(segment.by_bin_mut());
            }
            return;
        }
        let mut order = std::mem::take(&mut self.run_order);
        order.clear();
        for (index, segment) in (0..).zip(&*segments) {
            order.extend(segment.runs().map(|((bin, level), objects)| SegmentRun {
                bin_rank: bins.rank(bin),
                level,
                segment: index,
                objects: [objects.start as u32, objects.end as u32],
            }));
        }
        order.sort_unstable();
        for same_bin in order.chunk_by(|one, next| (one.bin_rank, one.level) == (next.bin_rank, next.level)) {
            let start = self.objects.len();
            for &SegmentRun { segment, objects: [first, end], .. } in same_bin {
                self.objects.extend_from_slice(segments[segment as usize].objects(first as usize..end as usize));
            }
            let SegmentRun { bin_rank, level, .. } = same_bin[0];
            let bin = bins.in_order()[bin_rank as usize];
            self.push_batches(bins, (bin, level), start..self.objects.len(), &can_merge);
        }
        self.run_order = order;
    }

    fn push_batches(
        &mut self,
        bins: &Bins,
        (bin, level): (u32, u32),
        objects: Range<usize>,
        can_merge: impl Fn(u32) -> bool,
    ) {
        let Bin { mesh, state } = bins.get(bin);
        let state = state.with_level_of_detail(level);
        let step = if can_merge(mesh) { objects.len() } else { 1 };
        let batches = objects.step_by(step).map(|first| Batch { mesh, state, first: first as u32, count: step as u32 });
        self.batches.extend(batches);
    }

    /// Makes a batch of one object partial: it draws only the triangles whose corners `append_indices` appends, three
    /// per triangle. Calls come in ascending order of `batch`.
    #[cfg(feature = "occlusion")]
    pub(crate) fn make_partial(&mut self, batch: u32, append_indices: impl FnOnce(&mut Vec<u32>)) {
        let first = self.remaining_indices.len() as u32;
        append_indices(&mut self.remaining_indices);
        self.partial_batches.push((batch, first..self.remaining_indices.len() as u32));
    }

    /// The corners of the remaining triangles of partial batches, three per triangle: indices into the mesh's vertices.
    pub fn remaining_indices(&self) -> &[u32] {
        &self.remaining_indices
    }

    /// The range of [`DrawList::remaining_indices`] that a batch draws; `None` where it draws its whole mesh.
    pub fn remaining(&self, batch: usize) -> Option<Range<u32>> {
        let found = self.partial_batches.binary_search_by_key(&(batch as u32), |(batch, _)| *batch).ok()?;
        Some(self.partial_batches[found].1.clone())
    }

    /// Whether every batch draws its whole mesh.
    pub fn is_whole(&self) -> bool {
        self.partial_batches.is_empty()
    }

    /// Whether every batch of a bundle draws its whole mesh.
    pub fn bundle_is_whole(&self, bundle: usize) -> bool {
        let Range { start, end } = self.bundle_range(bundle);
        let next_partial = self.partial_batches.partition_point(|(batch, _)| (*batch as usize) < start);
        self.partial_batches.get(next_partial).is_none_or(|(batch, _)| *batch as usize >= end)
    }

    /// The sorted commands; none if the pass orders its objects by bin.
    pub fn commands(&self) -> impl DoubleEndedIterator<Item = &RenderCommand> + Clone {
        self.commands[..self.bucket_count].iter().flatten()
    }

    /// The number of objects that the batches draw.
    pub fn drawn_count(&self) -> usize {
        self.static_groups.drawn_count() + self.own_objects().len()
    }

    /// The objects of the batches that belong to no static group.
    pub fn own_objects(&self) -> Range<usize> {
        self.static_groups.object_count()..self.objects.len()
    }

    /// What belongs to static groups.
    pub fn static_groups(&self) -> DrawListStaticGroups {
        self.static_groups
    }

    /// Replaces the objects of static groups, unless they are those of this version.
    pub(crate) fn set_static_group_objects(&mut self, version: Version, objects: &[u32]) {
        self.clear_own();
        if self.static_groups.set_objects(version, objects.len()) {
            self.batches.clear();
            self.objects.clear();
            self.objects.extend_from_slice(objects);
        }
    }

    /// Replaces the batches of static groups, unless they are those of this version. They come in draw order;
    /// neighbours whose objects follow each other become one batch where both have the same state and mesh, and
    /// `can_merge` holds for that mesh's slot.
    pub(crate) fn execute_static_groups(
        &mut self,
        version: Version,
        batches: impl Iterator<Item = Batch>,
        can_merge: impl Fn(u32) -> bool,
    ) {
        self.clear_own();
        if !self.static_groups.set_executed(version) {
            return;
        }
        self.batches.clear();
        let mut drawn = 0;
        for batch in batches {
            drawn += batch.count as usize;
            match self.batches.last_mut() {
                Some(last)
                    if (last.state, last.mesh, last.first + last.count) == (batch.state, batch.mesh, batch.first)
                        && can_merge(batch.mesh) =>
                {
                    last.count += batch.count;
                }
                _ => self.batches.push(batch),
            }
        }
        self.static_groups.set_drawn(drawn, self.batches.len());
    }

    fn batches_per_bundle(&self) -> usize {
        self.bundle_size.unwrap_or(Self::BATCHES_PER_BUNDLE)
    }

    /// The number of bundles that the batches or items fill. No bundle has batches of static groups and of other objects.
    pub fn bundle_count(&self) -> usize {
        let own = self.batches.len() - self.static_groups.batch_count();
        self.static_groups.bundle_count() + own.div_ceil(self.batches_per_bundle()) + self.items.bundle_count()
    }

    /// The batches of one bundle.
    ///
    /// # Panics
    /// If `index` is [`DrawList::bundle_count`] or more.
    pub fn bundle(&self, index: usize) -> &[Batch] {
        &self.batches[self.bundle_range(index)]
    }

    /// The indices of the batches of one bundle.
    ///
    /// # Panics
    /// If `index` is [`DrawList::bundle_count`] or more.
    pub fn bundle_range(&self, index: usize) -> Range<usize> {
        match index.checked_sub(self.static_groups.bundle_count()) {
            None => self.static_groups.bundle_range(index),
            Some(own) => {
                let start = self.static_groups.batch_count() + own * self.batches_per_bundle();
                start..self.batches.len().min(start + self.batches_per_bundle())
            }
        }
    }

    /// The number by which a backend that keeps bundles knows one of them. That of a bundle of static groups does not
    /// depend on other objects, and that of others not on static groups.
    pub fn bundle_slot(&self, index: usize) -> usize {
        index.checked_sub(self.static_groups.bundle_count()).map_or(2 * index, |own| 2 * own + 1)
    }

    /// More than the number of every bundle.
    pub fn bundle_slot_count(&self) -> usize {
        2 * self.bundle_count()
    }
}

impl PartialEq for DrawList {
    fn eq(&self, other: &Self) -> bool {
        self.batches == other.batches
            && self.objects == other.objects
            && (&self.remaining_indices, &self.partial_batches) == (&other.remaining_indices, &other.partial_batches)
            && self.static_groups == other.static_groups
            && self.commands().eq(other.commands())
    }
}

impl Eq for DrawList {}

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
        self.batches.div_ceil(DrawList::BATCHES_PER_BUNDLE)
    }

    /// Prepares for other objects, and returns whether they are others: then none is executed.
    fn set_objects(&mut self, version: Version, objects: usize) -> bool {
        let differs = self.version != version;
        if differs {
            *self = Self { version, objects, ..Self::default() };
        }
        differs
    }

    /// Prepares for other executed static groups, and returns whether they are others.
    fn set_executed(&mut self, version: Version) -> bool {
        let differs = self.executed != version;
        if differs {
            *self = Self { executed: version, drawn: 0, batches: 0, ..*self };
        }
        differs
    }

    /// Counts what is executed.
    fn set_drawn(&mut self, objects: usize, batches: usize) {
        (self.drawn, self.batches) = (objects, batches);
    }

    /// The indices of the batches of a bundle.
    fn bundle_range(&self, index: usize) -> Range<usize> {
        let start = index * DrawList::BATCHES_PER_BUNDLE;
        start..self.batches.min(start + DrawList::BATCHES_PER_BUNDLE)
    }
}

/// Lists are equal whatever they were made from.
impl PartialEq for DrawListStaticGroups {
    fn eq(&self, other: &Self) -> bool {
        (self.objects, self.drawn, self.batches) == (other.objects, other.drawn, other.batches)
    }
}

impl Eq for DrawListStaticGroups {}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::command::DrawState;

    proptest! {
        /// Batches of static groups, then others, against a plain list of what is drawn.
        #[test]
        fn executed_static_groups_merge_and_their_bundles_are_apart_from_others(
            counts in prop::collection::vec((1_u32..4, 0_u32..3, any::<bool>()), 0..1_800),
            own in 0_usize..1_100,
            partial in prop::collection::btree_set(0_u32..2_000, 0..6),
            merges in any::<bool>(),
        ) {
            let mut list = DrawList::default();
            let (mut first, mut batches, mut expected) = (0, Vec::new(), Vec::new());
            let mut counts = counts;
            counts.sort_by_key(|(_, mesh, _)| *mesh);
            for &(count, mesh, is_executed) in &counts {
                if is_executed {
                    batches.push(Batch { mesh, state: DrawState::PLAIN, first, count });
                    expected.extend((first..first + count).map(|object| (mesh, object + 7)));
                }
                first += count;
            }
            let objects: Vec<_> = (7..first + 7).collect();
            for version in [1, 2] {
                // The second time with what is there already.
                list.set_static_group_objects(Version { frame: 1, index: 0 }, &objects);
                list.execute_static_groups(Version { frame: version, index: 0 }, batches.iter().copied(), |_| merges);
                prop_assert_eq!(list.drawn_count(), expected.len());
                let start = list.objects.len() as u32;
                list.objects.extend((0..own as u32).map(|object| object + 10_000));
                list.batches.extend((0..own as u32).map(|object| Batch { mesh: 9, state: DrawState::PLAIN, first: start + object, count: 1 }));
                let of_static_groups = list.static_groups().batch_count();
                let drawn = list.batches[..of_static_groups].iter().flat_map(|batch| {
                    let of_batch = &list.objects[batch.first as usize..][..batch.count as usize];
                    of_batch.iter().map(|object| (batch.mesh, *object))
                });
                prop_assert_eq!(drawn.collect::<Vec<_>>(), expected.clone());
                let could_merge = |pair: &[Batch]| {
                    (pair[0].mesh, pair[0].first + pair[0].count) == (pair[1].mesh, pair[1].first)
                };
                prop_assert!(!merges || !list.batches[..of_static_groups].windows(2).any(could_merge));
                prop_assert!(merges || of_static_groups == batches.len());
                let ranges: Vec<_> = (0..list.bundle_count()).map(|bundle| list.bundle_range(bundle)).collect();
                prop_assert_eq!(ranges.iter().cloned().flatten().collect::<Vec<_>>(), (0..list.batches.len()).collect::<Vec<_>>());
                prop_assert!(ranges.iter().all(|range| (1..=256).contains(&range.len())));
                prop_assert!(ranges.iter().all(|range| range.end <= of_static_groups || range.start >= of_static_groups));
                let mut slots: Vec<_> = (0..ranges.len()).map(|bundle| list.bundle_slot(bundle)).collect();
                prop_assert!(slots.iter().all(|slot| *slot < list.bundle_slot_count()));
                slots.sort_unstable();
                slots.dedup();
                prop_assert_eq!(slots.len(), ranges.len());
                for &batch in partial.range(..list.batches.len() as u32) {
                    list.make_partial(batch, |indices| indices.extend([batch, 8, 9]));
                }
                for (bundle, mut batches) in ranges.into_iter().enumerate() {
                    let is_whole = !batches.any(|batch| partial.contains(&(batch as u32)));
                    prop_assert_eq!(list.bundle_is_whole(bundle), is_whole);
                }
            }
            let executed = list.batches[..list.static_groups().batch_count()].to_vec();
            list.execute_static_groups(Version { frame: 2, index: 0 }, std::iter::empty(), |_| merges);
            prop_assert_eq!(list.batches, executed, "a version has one content");
        }
    }

    #[test]
    fn lists_are_equal_if_all_but_versions_and_spare_buckets_are() {
        let command = |object| RenderCommand { object, ..RenderCommand::EMPTY };
        let batch = |first| Batch { mesh: 0, state: DrawState::PLAIN, first, count: 1 };
        let mut one = DrawList::default();
        one.set_static_group_objects(Version { frame: 1, index: 0 }, &[5]);
        one.objects.extend([6, 7]);
        one.batches.extend([batch(1), batch(2)]);
        one.make_partial(1, |corners| corners.extend([0, 1, 2]));
        one.commands.push(vec![command(6), command(7)]);
        one.bucket_count = 1;

        let changed = |change: fn(&mut DrawList)| {
            let mut other = one.clone();
            change(&mut other);
            other
        };
        assert_eq!(changed(|list| list.set_version(Version { frame: 3, index: 0 })), one);
        assert_eq!(changed(|list| list.commands.push(vec![RenderCommand::EMPTY])), one);
        assert_ne!(changed(|list| list.batches[1].count = 2), one);
        assert_ne!(changed(|list| list.objects[2] = 8), one);
        assert_ne!(changed(|list| list.remaining_indices[2] = 3), one);
        assert_ne!(changed(|list| list.partial_batches[0].0 = 0), one);
        assert_ne!(changed(|list| list.static_groups = DrawListStaticGroups::default()), one);
        assert_ne!(changed(|list| list.commands[0][1].object = 8), one);
    }
}
