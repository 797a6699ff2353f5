//! Ranges within a page.

use std::collections::BTreeMap;

/// Hands out ranges of `0..capacity`, and takes them back. It places a range where it fits first, so that the end of a
/// page stays free.
#[derive(Debug)]
pub(super) struct RangeAllocator {
    /// The start and length of each free range. No two of them touch.
    free: BTreeMap<u32, u32>,
    used: u32,
    /// The length of the longest free range.
    longest: u32,
}

impl RangeAllocator {
    pub(super) fn new(capacity: u32) -> Self {
        let free = if capacity == 0 { BTreeMap::new() } else { BTreeMap::from([(0, capacity)]) };
        Self { free, used: 0, longest: capacity }
    }

    /// The start of a range of this length; `None` if none is free. An empty range is always at 0, and is not freed.
    pub(super) fn allocate(&mut self, length: u32) -> Option<u32> {
        if length == 0 {
            return Some(0);
        }
        if length > self.longest {
            return None;
        }
        let start = self.free.iter().find(|(_, free)| **free >= length).map(|(start, _)| *start)?;
        self.occupy(start, length);
        Some(start)
    }

    /// Takes a range that is free as a whole.
    pub(super) fn occupy(&mut self, start: u32, length: u32) {
        if length == 0 {
            return;
        }
        let Some((&first, &found)) = self.free.range(..=start).next_back() else { return };
        debug_assert!(first + found >= start + length, "the range is free");
        self.free.remove(&first);
        if first < start {
            self.free.insert(first, start - first);
        }
        if first + found > start + length {
            self.free.insert(start + length, first + found - start - length);
        }
        self.used += length;
        if found == self.longest {
            self.longest = self.free.values().copied().max().unwrap_or(0);
        }
    }

    /// Frees a range that was allocated.
    pub(super) fn free(&mut self, start: u32, length: u32) {
        if length == 0 {
            return;
        }
        let (mut first, mut end) = (start, start + length);
        if let Some(next) = self.free.remove(&end) {
            end += next;
        }
        if let Some((&before, &free)) = self.free.range(..start).next_back()
            && before + free == start
        {
            first = before;
        }
        self.free.insert(first, end - first);
        self.longest = self.longest.max(end - first);
        self.used -= length;
    }

    /// The length of the longest free range.
    pub(super) fn longest(&self) -> u32 {
        self.longest
    }

    /// The sum of all allocated ranges.
    #[cfg(test)]
    pub(super) fn used(&self) -> u32 {
        self.used
    }

    pub(super) fn is_empty(&self) -> bool {
        self.used == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Marks each unit of a page, and searches it from its start.
    struct MarkedPage(Vec<bool>);

    impl MarkedPage {
        fn allocate(&mut self, length: usize) -> Option<u32> {
            let starts = 0..(self.0.len() + 1).saturating_sub(length);
            let start = starts.into_iter().find(|start| self.0[*start..start + length].iter().all(|used| !used))?;
            self.0[start..start + length].fill(true);
            Some(start as u32)
        }

        fn longest_gap(&self) -> u32 {
            let gaps = self.0.chunk_by(|one, next| one == next).filter(|range| !range[0]);
            gaps.map(|range| range.len() as u32).max().unwrap_or(0)
        }

        /// The number of free ranges.
        fn gaps(&self) -> usize {
            self.0.chunk_by(|one, next| one == next).filter(|range| !range[0]).count()
        }
    }

    #[test]
    fn it_places_and_merges_ranges_as_a_page_of_marks_does() {
        let mut random = fastrand::Rng::with_seed(21);
        for capacity in [1, 7, 64, 1000] {
            let (mut ranges, mut marks) = (RangeAllocator::new(capacity), MarkedPage(vec![false; capacity as usize]));
            let mut live: Vec<(u32, u32)> = Vec::new();
            for _ in 0..2000 {
                if random.bool() || live.is_empty() {
                    let length = random.u32(1..=(capacity / 5).max(1) + 1);
                    let start = ranges.allocate(length);
                    assert_eq!(start, marks.allocate(length as usize));
                    live.extend(start.map(|start| (start, length)));
                } else {
                    let (start, length) = live.swap_remove(random.usize(..live.len()));
                    ranges.free(start, length);
                    if random.u8(..4) == 0 {
                        // What made room in vain is put back where it was.
                        ranges.occupy(start, length);
                        ranges.free(start, length);
                    }
                    marks.0[start as usize..(start + length) as usize].fill(false);
                }
                assert_eq!(ranges.used(), marks.0.iter().filter(|used| **used).count() as u32);
                assert_eq!(ranges.free.len(), marks.gaps(), "free ranges that touch are one");
                assert_eq!(ranges.longest(), marks.longest_gap());
                assert_eq!(ranges.is_empty(), live.is_empty());
            }
        }
    }

    #[test]
    fn a_range_as_long_as_the_page_fits_and_a_longer_one_does_not() {
        let mut ranges = RangeAllocator::new(8);
        assert_eq!((ranges.allocate(9), ranges.allocate(8), ranges.allocate(1)), (None, Some(0), None));
        ranges.free(0, 8);
        assert_eq!((ranges.allocate(0), ranges.allocate(u32::MAX), ranges.used()), (Some(0), None, 0));
    }
}
