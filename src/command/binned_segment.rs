//! Bins: the draw states and meshes that a scene's objects have; and a segment of a view's visible objects, ordered by
//! bin.

use std::collections::HashMap;
use std::ops::Range;

use super::DrawState;

/// The pairs of draw state and mesh that a scene's objects have, or had. Equal commands become one draw, so the objects
/// of a bin are a batch. An object changes its bin seldom, so a pass counts its objects by bin and sorts nothing
/// (Bevy's binned render phases).
///
/// Numbers depend on timing: use [`Bins::in_order`] wherever order matters.
#[derive(Debug, Default)]
pub struct Bins {
    /// For each mesh, by slot, the number of its bin by state of texture set 0; [`NO_BIN`] where it has none.
    numbers: Vec<[u32; STATES]>,
    /// The numbers of the bins of other texture sets.
    of_texture_sets: HashMap<Bin, u32>,
    /// By number.
    bins: Vec<Bin>,
    /// The numbers in draw order; the bins from `in_order.len()` on are not in it yet.
    in_order: Vec<u32>,
    /// By number: the position in `in_order`.
    ranks: Vec<u32>,
}

/// What the objects of a bin have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Bin {
    /// The fixed-function state, of subdivision level 0 and level of detail 0.
    pub state: DrawState,
    /// The mesh's slot.
    pub mesh: u32,
}

/// The number of states of subdivision level 0, level of detail 0 and texture set 0.
const STATES: usize = DrawState::COUNT >> 6;

const NO_BIN: u32 = u32::MAX;

impl Bins {
    /// The number of a bin, if it has one.
    pub fn find(&self, bin: Bin) -> Option<u32> {
        if bin.state.texture_set() > 0 {
            return self.of_texture_sets.get(&bin).copied();
        }
        let number = *self.numbers.get(bin.mesh as usize)?.get(bin.state.index())?;
        (number != NO_BIN).then_some(number)
    }

    /// The number of a bin; a new one if it has none.
    ///
    /// # Panics
    /// If the state has a subdivision level or a level of detail above 0.
    pub fn insert(&mut self, bin: Bin) -> u32 {
        if let Some(number) = self.find(bin) {
            return number;
        }
        let (number, mesh) = (self.bins.len() as u32, bin.mesh as usize);
        if bin.state.texture_set() > 0 {
            self.of_texture_sets.insert(bin, number);
        } else {
            if mesh >= self.numbers.len() {
                self.numbers.resize(mesh + 1, [NO_BIN; STATES]);
            }
            self.numbers[mesh][bin.state.index()] = number;
        }
        self.bins.push(bin);
        number
    }

    /// Puts new bins in order. Call it between the last [`Bins::insert`] and the first [`Bins::in_order`].
    pub fn sort(&mut self) {
        if self.in_order.len() == self.bins.len() {
            return;
        }
        self.in_order.extend(self.in_order.len() as u32..self.bins.len() as u32);
        self.in_order.sort_unstable_by_key(|&number| self.bins[number as usize]);
        self.ranks.resize(self.bins.len(), 0);
        for (rank, &number) in (0..).zip(&self.in_order) {
            self.ranks[number as usize] = rank;
        }
    }

    /// The numbers in draw order: by state, then by mesh.
    pub fn in_order(&self) -> &[u32] {
        &self.in_order
    }

    /// The index of a bin in [`Bins::in_order`].
    ///
    /// # Panics
    /// If there is no bin with this number.
    pub fn rank(&self, number: u32) -> u32 {
        self.ranks[number as usize]
    }

    /// The bin with this number.
    ///
    /// # Panics
    /// If there is none.
    pub fn get(&self, number: u32) -> Bin {
        self.bins[number as usize]
    }

    /// The number of bins.
    #[allow(clippy::len_without_is_empty)] // It would have no caller.
    pub fn len(&self) -> usize {
        self.bins.len()
    }

    /// Removes all bins.
    pub fn clear(&mut self) {
        *self = Self::default();
    }
}

/// The objects of one pass among a segment of a view's visible objects, ordered by bin: by draw state, by mesh, and by
/// object.
///
/// They are counted and scattered (counting sort; Knuth, *The Art of Computer Programming* 3, 5.2), in time
/// proportional to the numbers of objects and bins. Where there are many more bins than objects, they are sorted.
#[derive(Clone, Debug, Default)]
pub struct BinnedSegment {
    /// The objects in their own order, and the number of the bin of each.
    objects: Vec<u32>,
    bins: Vec<u32>,
    /// The objects by bin.
    by_bin: Vec<u32>,
    /// The bins that have objects, in draw order.
    runs: Vec<Run>,
    /// Scratch memory: a counter for each bin.
    counts: Vec<u32>,
    /// Scratch memory: keys to sort by.
    keys: Vec<u64>,
    /// Scratch memory: runs that are divided by level of detail, and the objects of one of them.
    divided_runs: Vec<Run>,
    undivided: Vec<u32>,
}

/// Consecutive objects of one bin at one level of detail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    bin: u32,
    level_of_detail: u32,
    /// The end of its objects in [`BinnedSegment::by_bin`].
    end: u32,
}

impl BinnedSegment {
    /// Empties the segment.
    pub fn clear(&mut self) {
        self.objects.clear();
        self.bins.clear();
    }

    /// Appends an object, after all objects of lower indices.
    #[inline]
    pub fn push(&mut self, object: u32, bin: u32) {
        self.objects.push(object);
        self.bins.push(bin);
    }

    /// Orders the objects by bin.
    pub fn order(&mut self, bins: &Bins) {
        self.runs.clear();
        if bins.len() > self.objects.len() * BINS_PER_OBJECT {
            self.sort(bins);
        } else {
            self.count_and_scatter(bins);
        }
    }

    fn count_and_scatter(&mut self, bins: &Bins) {
        let Self { objects, bins: bin_of, by_bin, runs, counts, .. } = self;
        counts.clear();
        counts.resize(bins.len(), 0);
        for &bin in &*bin_of {
            counts[bin as usize] += 1;
        }
        let mut next = 0;
        for &bin in bins.in_order() {
            // From here on, where the bin's next object goes.
            let count = std::mem::replace(&mut counts[bin as usize], next);
            next += count;
            if count > 0 {
                runs.push(Run { bin, level_of_detail: 0, end: next });
            }
        }
        by_bin.resize(objects.len(), 0);
        for (&object, &bin) in objects.iter().zip(&*bin_of) {
            let position = &mut counts[bin as usize];
            by_bin[*position as usize] = object;
            *position += 1;
        }
    }

    fn sort(&mut self, bins: &Bins) {
        let Self { objects, bins: bin_of, by_bin, runs, keys, .. } = self;
        keys.clear();
        keys.extend(
            objects.iter().zip(&*bin_of).map(|(&object, &bin)| u64::from(bins.rank(bin)) << 32 | u64::from(object)),
        );
        keys.sort_unstable();
        by_bin.clear();
        for same_bin in keys.chunk_by(|one, next| one >> 32 == next >> 32) {
            by_bin.extend(same_bin.iter().map(|key| *key as u32));
            let bin = bins.in_order()[(same_bin[0] >> 32) as usize];
            runs.push(Run { bin, level_of_detail: 0, end: by_bin.len() as u32 });
        }
    }

    /// Makes this segment the objects in a range of positions of another one's order that `is_visible`, in the bins
    /// that `is_drawn`. They are in order.
    pub(crate) fn select(
        &mut self,
        all: &Self,
        positions: Range<usize>,
        is_drawn: impl Fn(u32) -> bool,
        is_visible: impl Fn(u32) -> bool,
    ) {
        let Self { by_bin, runs, .. } = self;
        runs.clear();
        by_bin.resize(positions.len(), 0);
        let (mut start, mut count) = (positions.start, 0);
        let first = all.runs.partition_point(|run| run.end as usize <= positions.start);
        for &Run { bin, end, .. } in &all.runs[first..] {
            let run = start..(end as usize).min(positions.end);
            if run.is_empty() {
                break;
            }
            start = run.end;
            if !is_drawn(bin) {
                continue;
            }
            let count_before = count;
            for &object in &all.by_bin[run] {
                // Branchless: a mispredicted branch costs more than a wasted store.
                by_bin[count] = object;
                count += usize::from(is_visible(object));
            }
            if count > count_before {
                runs.push(Run { bin, level_of_detail: 0, end: count as u32 });
            }
        }
        by_bin.truncate(count);
    }

    /// Divides the ordered objects of each bin that `has_levels` by `level_of` detail, the finest first. Objects of one
    /// level stay in order.
    pub(crate) fn divide_by_level(&mut self, has_levels: impl Fn(u32) -> bool, level_of: impl Fn(u32) -> u32) {
        let Self { by_bin, runs, divided_runs, undivided, .. } = self;
        divided_runs.clear();
        let mut start = 0;
        for &run in &*runs {
            let objects = &mut by_bin[start..run.end as usize];
            if has_levels(run.bin) {
                let mut counts = [0; DrawState::MAX_LEVEL_OF_DETAIL as usize + 1];
                objects.iter().for_each(|&object| counts[level_of(object) as usize] += 1);
                undivided.clear();
                undivided.extend_from_slice(objects);
                let (mut next, mut end) = ([0; DrawState::MAX_LEVEL_OF_DETAIL as usize + 1], start as u32);
                for (level_of_detail, &count) in (0..).zip(&counts).filter(|(_, count)| **count > 0) {
                    next[level_of_detail as usize] = end as usize - start;
                    end += count;
                    divided_runs.push(Run { bin: run.bin, level_of_detail, end });
                }
                for &object in &*undivided {
                    let position = &mut next[level_of(object) as usize];
                    objects[*position] = object;
                    *position += 1;
                }
            } else {
                divided_runs.push(run);
            }
            start = run.end as usize;
        }
        std::mem::swap(runs, divided_runs);
    }

    /// The number of objects in the segment.
    pub(crate) fn len(&self) -> usize {
        self.by_bin.len()
    }

    /// The ordered objects, for the list that takes them.
    pub(super) fn by_bin_mut(&mut self) -> &mut Vec<u32> {
        &mut self.by_bin
    }

    /// One of the bins that have objects, with one of their levels of detail, by index in draw order, and the range of
    /// its objects.
    pub(super) fn run(&self, index: usize) -> Option<((u32, u32), Range<usize>)> {
        let &Run { bin, level_of_detail, end } = self.runs.get(index)?;
        let start = index.checked_sub(1).map_or(0, |before| self.runs[before].end);
        Some(((bin, level_of_detail), start as usize..end as usize))
    }

    /// All runs in draw order: the bin and the level of detail of each, and the range of its objects.
    pub(super) fn runs(&self) -> impl Iterator<Item = ((u32, u32), Range<usize>)> {
        (0..self.runs.len()).filter_map(|index| self.run(index))
    }

    /// The objects in a range of a run.
    pub(super) fn objects(&self, range: Range<usize>) -> &[u32] {
        &self.by_bin[range]
    }
}

/// With more bins than this per object, sorting the objects takes less time than going through the bins.
const BINS_PER_OBJECT: usize = 8;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::command::{Batch, Cull, DrawList, DrawState};
    use crate::scene::{Blend, Topology};

    fn bin_of(kind: u32) -> Bin {
        let culls = [Cull::Back, Cull::Front, Cull::Nothing];
        let state = DrawState::new(Topology::TriangleList, culls[kind as usize % 3], Blend::None);
        Bin { state, mesh: kind / 3 % 40 }
    }

    proptest! {
        #[test]
        fn joined_segments_are_the_objects_in_the_order_of_state_mesh_and_index(
            kinds in prop::collection::vec((0_u32..120, prop::bool::weighted(0.7)), 0..300),
            unused in prop::collection::vec(0_u32..120, 0..120),
            cuts in prop::collection::vec(0_usize..300, 0..5),
            unmergeable in 0_u32..60,
        ) {
            let mut bins = Bins::default();
            // Numbers in an order of their own, some of bins without objects.
            let numbers: Vec<_> = unused.iter().map(|&kind| bins.insert(bin_of(kind))).collect();
            bins.sort();
            prop_assert!(numbers.iter().zip(&unused).all(|(&number, &kind)| bins.get(number) == bin_of(kind)));
            let drawn: Vec<_> = (0_u32..).zip(&kinds).filter(|(_, (_, is_drawn))| *is_drawn).map(|(object, (kind, _))| (object, bin_of(*kind))).collect();
            let of_objects: Vec<_> = drawn.iter().map(|&(object, bin)| (object, bins.insert(bin))).collect();
            bins.sort();

            let mut edges: Vec<_> = cuts.iter().map(|cut| cut % (drawn.len() + 1)).chain([0, drawn.len()]).collect();
            edges.sort_unstable();
            let mut segments: Vec<_> = edges.windows(2).map(|edge| {
                let mut segment = BinnedSegment::default();
                of_objects[edge[0]..edge[1]].iter().for_each(|&(object, bin)| segment.push(object, bin));
                segment.order(&bins);
                Box::new(segment)
            }).collect();
            let mut list = DrawList::default();
            list.join_bins(&mut segments, &bins, |mesh| mesh != unmergeable);

            // The same list, selected from all objects in order.
            let mut all = BinnedSegment::default();
            (0_u32..).zip(&kinds).for_each(|(object, (kind, _))| all.push(object, bins.insert(bin_of(*kind))));
            bins.sort();
            all.order(&bins);
            let mut edges: Vec<_> = cuts.iter().map(|cut| cut % (kinds.len() + 1)).chain([0, kinds.len()]).collect();
            edges.sort_unstable();
            let mut selected: Vec<_> = edges.windows(2).map(|edge| {
                let mut segment = BinnedSegment::default();
                segment.select(&all, edge[0]..edge[1], |_| true, |object| kinds[object as usize].1);
                Box::new(segment)
            }).collect();
            let mut selected_list = DrawList::default();
            selected_list.join_bins(&mut selected, &bins, |mesh| mesh != unmergeable);
            prop_assert_eq!((&selected_list.objects, &selected_list.batches), (&list.objects, &list.batches));
            let mut of_some_bins = BinnedSegment::default();
            of_some_bins.select(&all, 0..kinds.len(), |bin| bins.get(bin).mesh < 20, |_| true);
            let is_expected = |object: &u32| bin_of(kinds[*object as usize].0).mesh < 20;
            prop_assert!(of_some_bins.by_bin.iter().all(is_expected));
            let expected_count = (0..kinds.len() as u32).filter(is_expected).count();
            prop_assert_eq!(of_some_bins.len(), expected_count);

            let level_of = |object: u32| object * 7 % 5 % 3;
            let has_levels = |mesh: u32| mesh.is_multiple_of(2);
            let mut divided: Vec<_> = edges.windows(2).map(|edge| {
                let mut segment = BinnedSegment::default();
                segment.select(&all, edge[0]..edge[1], |_| true, |object| kinds[object as usize].1);
                segment.divide_by_level(|bin| has_levels(bins.get(bin).mesh), level_of);
                Box::new(segment)
            }).collect();
            let mut divided_list = DrawList::default();
            divided_list.join_bins(&mut divided, &bins, |mesh| mesh != unmergeable);
            let mut by_level: Vec<_> = drawn.iter().map(|&(object, bin)| {
                (bin, if has_levels(bin.mesh) { level_of(object) } else { 0 }, object)
            }).collect();
            by_level.sort();
            prop_assert_eq!(&divided_list.objects, &by_level.iter().map(|drawn| drawn.2).collect::<Vec<_>>());
            let levels = divided_list.batches.iter().flat_map(|batch| {
                let bin = Bin { mesh: batch.mesh, state: batch.state.with_level_of_detail(0) };
                vec![(bin, batch.state.level_of_detail()); batch.count as usize]
            });
            prop_assert!(levels.eq(by_level.iter().map(|&(bin, level, _)| (bin, level))));
            let is_merged = |pair: &[Batch]| (pair[0].state, pair[0].mesh) != (pair[1].state, pair[1].mesh);
            prop_assert!(divided_list.batches.windows(2).all(|pair| is_merged(pair) || pair[0].mesh == unmergeable));

            let mut expected = drawn;
            expected.sort_by_key(|&(object, bin)| (bin.state, bin.mesh, object));
            prop_assert_eq!(&list.objects, &expected.iter().map(|(object, _)| *object).collect::<Vec<_>>());
            let mut batches: Vec<Batch> = Vec::new();
            for (index, &(_, Bin { state, mesh })) in (0..).zip(&expected) {
                match batches.last_mut() {
                    Some(last) if (last.state, last.mesh) == (state, mesh) && mesh != unmergeable => last.count += 1,
                    _ => batches.push(Batch { mesh, state, first: index, count: 1 }),
                }
            }
            prop_assert_eq!(&list.batches, &batches);
        }
    }
}
