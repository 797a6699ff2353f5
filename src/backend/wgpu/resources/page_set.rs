//! Pages: buffers of which ranges are handed out.

use std::sync::{Arc, OnceLock};

use super::range_allocator::RangeAllocator;

/// The buffers of a page. Whoever writes to it first makes them.
pub(crate) type PageBuffers<B> = Arc<OnceLock<B>>;

/// Pages with buffers `B`. A set grows by adding pages, so nothing that lies in one of them ever moves; a page that is
/// empty is released.
pub(crate) struct PageSet<B> {
    /// By index, which stays the same while the page exists.
    pages: Vec<Option<Page<B>>>,
    /// The length of all pages.
    length: u64,
    /// That of the pages in which nothing is.
    empty_length: u64,
}

struct Page<B> {
    ranges: RangeAllocator,
    length: u32,
    buffers: PageBuffers<B>,
}

/// A range of a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PageRange {
    pub(crate) page: u32,
    pub(crate) start: u32,
    pub(crate) length: u32,
}

impl PageRange {
    /// Whether both have a part of a page.
    pub(super) fn overlaps(self, other: Self) -> bool {
        self.page == other.page && self.start < other.start + other.length && other.start < self.start + self.length
    }
}

impl<B> Default for PageSet<B> {
    fn default() -> Self {
        Self { pages: Vec::new(), length: 0, empty_length: 0 }
    }
}

impl<B> PageSet<B> {
    /// A range of this length in a new page of `page_length`, or longer if the range is.
    pub(super) fn allocate_in_new_page(&mut self, length: u32, page_length: u32) -> PageRange {
        let page_length = page_length.max(length);
        let mut ranges = RangeAllocator::new(page_length);
        // It fits, because the page is as long.
        let start = ranges.allocate(length).unwrap_or_default();
        let page = Page { ranges, length: page_length, buffers: PageBuffers::default() };
        let index = self.pages.iter().position(Option::is_none).unwrap_or(self.pages.len());
        if index == self.pages.len() {
            self.pages.push(None);
        }
        self.length += u64::from(page_length);
        self.empty_length += if page.ranges.is_empty() { u64::from(page_length) } else { 0 };
        self.pages[index] = Some(page);
        PageRange { page: index as u32, start, length }
    }

    /// A range of this length in the first page that has room, if one has.
    pub(super) fn allocate_in_pages(&mut self, length: u32) -> Option<PageRange> {
        let mut pages = (0..).zip(&self.pages);
        let page = pages.find_map(|(index, page)| (page.as_ref()?.ranges.longest() >= length).then_some(index))?;
        let start = self.change_ranges(page, |ranges| ranges.allocate(length)).flatten()?;
        Some(PageRange { page, start, length })
    }

    /// Frees a range. The page stays if nothing else is in it.
    pub(super) fn vacate(&mut self, range: PageRange) {
        self.change_ranges(range.page, |ranges| ranges.free(range.start, range.length));
    }

    /// Takes a range that was vacated.
    pub(super) fn occupy(&mut self, range: PageRange) {
        self.change_ranges(range.page, |ranges| ranges.occupy(range.start, range.length));
    }

    /// Releases a page in which nothing is, unless it is still read. Returns whether it did.
    pub(super) fn release_if_empty(&mut self, page: u32, is_read: impl FnOnce() -> bool) -> bool {
        let Some(entry) = self.pages.get_mut(page as usize) else { return false };
        let Some(released) = entry.take_if(|page| page.ranges.is_empty() && !is_read()) else { return false };
        self.length -= u64::from(released.length);
        self.empty_length -= u64::from(released.length);
        while self.pages.last().is_some_and(Option::is_none) {
            self.pages.pop();
        }
        true
    }

    /// The longest of the pages in which nothing is.
    pub(super) fn longest_empty_page(&self) -> Option<(u32, u32)> {
        let pages = (0..).zip(&self.pages).filter_map(|(index, page)| Some((index, page.as_ref()?)));
        let empty = pages.filter(|(_, page)| page.ranges.is_empty()).map(|(index, page)| (index, page.length));
        empty.max_by_key(|(_, length)| *length)
    }

    fn change_ranges<R>(&mut self, page: u32, change: impl FnOnce(&mut RangeAllocator) -> R) -> Option<R> {
        let page = self.pages.get_mut(page as usize)?.as_mut()?;
        let empty_length = |page: &Page<B>| if page.ranges.is_empty() { u64::from(page.length) } else { 0 };
        self.empty_length -= empty_length(page);
        let result = change(&mut page.ranges);
        self.empty_length += empty_length(page);
        Some(result)
    }

    /// The buffers of a page, and its length.
    pub(super) fn page(&self, index: u32) -> Option<(&PageBuffers<B>, u32)> {
        self.pages.get(index as usize)?.as_ref().map(|page| (&page.buffers, page.length))
    }

    /// The length of all pages.
    pub(super) fn length(&self) -> u64 {
        self.length
    }

    /// The length of all pages in which something is.
    pub(super) fn occupied_length(&self) -> u64 {
        self.length - self.empty_length
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl PageSet<()> {
        fn allocate(&mut self, length: u32, page_length: u32) -> PageRange {
            let found = self.allocate_in_pages(length);
            found.unwrap_or_else(|| self.allocate_in_new_page(length, page_length))
        }

        fn free(&mut self, range: PageRange) {
            self.vacate(range);
            self.release_if_empty(range.page, || false);
        }
    }

    #[test]
    fn live_ranges_never_overlap_and_empty_pages_are_released() {
        const PAGE: u32 = 100;
        let mut random = fastrand::Rng::with_seed(3);
        let (mut pages, mut live) = (PageSet::<()>::default(), Vec::<PageRange>::new());
        for step in 0..5000 {
            // It fills up, then empties, again and again.
            if random.u32(..100) < if step / 500 % 2 == 0 { 70 } else { 30 } {
                let length = if random.u32(..40) == 0 { PAGE * 3 } else { random.u32(1..60) };
                let range = pages.allocate(length, PAGE);
                let overlaps = |other: &&PageRange| {
                    other.page == range.page
                        && other.start < range.start + range.length
                        && range.start < other.start + other.length
                };
                assert_eq!(live.iter().find(overlaps), None);
                let (_, page_length) = pages.page(range.page).unwrap();
                assert!(range.start + range.length <= page_length && page_length >= PAGE);
                live.push(range);
            } else if !live.is_empty() {
                pages.free(live.swap_remove(random.usize(..live.len())));
            }
            let mut occupied: Vec<_> = live.iter().map(|range| range.page).collect();
            occupied.sort_unstable();
            occupied.dedup();
            assert_eq!(pages.pages.iter().flatten().count(), occupied.len());
            let used: u64 = pages.pages.iter().flatten().map(|page| u64::from(page.ranges.used())).sum();
            assert_eq!(used, live.iter().map(|range| u64::from(range.length)).sum::<u64>());
            let length: u64 = pages.pages.iter().flatten().map(|page| u64::from(page.length)).sum();
            assert_eq!((pages.length(), pages.occupied_length()), (length, length), "no page is empty");
        }
        live.drain(..).for_each(|range| pages.free(range));
        assert!(pages.pages.is_empty());
    }

    #[test]
    fn a_page_that_is_vacated_stays_until_it_is_released_and_its_ranges_can_be_put_back() {
        let mut pages = PageSet::<()>::default();
        let [first, second] = [30, 70].map(|length| pages.allocate(length, 100));
        let other = pages.allocate(50, 50);
        pages.vacate(first);
        pages.vacate(second);
        assert_eq!((pages.length(), pages.occupied_length(), pages.longest_empty_page()), (150, 50, Some((0, 100))));
        pages.occupy(second);
        assert_eq!((pages.allocate_in_pages(30), pages.longest_empty_page()), (Some(first), None));
        pages.vacate(first);
        pages.vacate(second);
        assert!(!pages.release_if_empty(0, || true), "something reads it");
        let mut release = |page| pages.release_if_empty(page, || false);
        assert!(release(0) && !release(0) && !release(other.page));
        assert_eq!((pages.length(), pages.occupied_length()), (50, 50));
    }

    #[test]
    fn a_range_longer_than_a_page_has_a_page_of_its_own() {
        let mut pages = PageSet::<()>::default();
        let large = pages.allocate(1000, 10);
        assert_eq!((large, pages.length()), (PageRange { page: 0, start: 0, length: 1000 }, 1000));
        let small = pages.allocate(1, 10);
        assert_eq!((small.page, pages.length()), (1, 1010));
        pages.free(large);
        assert_eq!((pages.length(), pages.allocate(3, 10)), (10, PageRange { page: 1, start: 1, length: 3 }));
    }
}
