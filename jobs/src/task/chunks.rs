//! How a range is cut into chunks, and in which order they run.

use std::ops::Range;

/// The indices from 0 up to a length, cut into chunks of one size. The last chunk may be shorter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chunks {
    length: usize,
    size: usize,
    count: usize,
    /// The chunk at `position` of the order is number `(first + position × step) mod count`.
    first: usize,
    step: usize,
}

/// The most chunks: half of what fits into a number, so that numbers remain that stand for no chunk.
const MAX_CHUNKS: usize = usize::MAX / 2;

impl Chunks {
    /// A size of 0 counts as 1.
    #[inline]
    pub(crate) fn new(length: usize, size: usize) -> Self {
        let size = if length > MAX_CHUNKS { size.max(length.div_ceil(MAX_CHUNKS)) } else { size.max(1) };
        // Most ranges are one chunk, and the division would cost more than all the rest.
        let count = if length <= size { usize::from(length > 0) } else { length.div_ceil(size) };
        Self { length, size, count, first: 0, step: 1 }
    }

    /// The same chunks in a random order. `draw` returns a number below its argument, or `None` to keep the order.
    pub(crate) fn shuffled(self, draw: impl Fn(usize) -> Option<usize>) -> Self {
        let (Some(first), Some(step)) = (draw(self.count), draw(self.count)) else { return self };
        // The order contains each chunk once if step and count have no common divisor.
        let step = (step..self.count).find(|&step| greatest_common_divisor(step, self.count) == 1).unwrap_or(1);
        Self { first, step, ..self }
    }

    #[inline]
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// The indices of the chunk at this position of the order.
    #[inline]
    pub(crate) fn range(&self, position: usize) -> Range<usize> {
        let number = if self.step == 1 && self.first == 0 {
            position
        } else {
            ((self.first as u128 + position as u128 * self.step as u128) % self.count as u128) as usize
        };
        let start = number * self.size;
        start..start.saturating_add(self.size).min(self.length)
    }
}

fn greatest_common_divisor(one: usize, other: usize) -> usize {
    if other == 0 { one } else { greatest_common_divisor(other, one % other) }
}
