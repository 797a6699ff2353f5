//! Squares of a picture: what one job draws.

use std::ops::Range;

use super::number::Number;
use crate::raster::PixelBounds;

/// A picture cut into squares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tiling {
    size: [usize; 2],
    across: usize,
    down: usize,
}

/// Pixels along a square's side.
const SIDE: usize = 64;

impl Tiling {
    pub(super) fn new(size: [usize; 2]) -> Self {
        Self { size, across: size[0].div_ceil(SIDE), down: size[1].div_ceil(SIDE) }
    }

    /// The picture's width and height in pixels.
    pub(super) fn size(&self) -> [usize; 2] {
        self.size
    }

    /// How many squares.
    pub(super) fn count(&self) -> usize {
        self.across * self.down
    }

    /// The square that holds a pixel, and the pixel's place in it.
    #[inline]
    pub(super) fn find(&self, [x, y]: [usize; 2]) -> (usize, usize) {
        (y / SIDE * self.across + x / SIDE, place_in_tile([x, y]))
    }

    /// The pixels of a square that are in the picture.
    pub(super) fn bounds(&self, tile: usize) -> PixelBounds {
        let (left, top) = (tile % self.across * SIDE, tile / self.across * SIDE);
        let (right, bottom) = ((left + SIDE).min(self.size[0]), (top + SIDE).min(self.size[1]));
        PixelBounds { left, top, right, bottom }
    }

    /// The squares that hold pixels of these.
    pub(super) fn touched(&self, bounds: PixelBounds) -> impl Iterator<Item = usize> {
        let across = self.across;
        let ends = |start: usize, end: usize| -> Range<usize> { start / SIDE..end.div_ceil(SIDE) };
        let (columns, rows) = (ends(bounds.left, bounds.right), ends(bounds.top, bounds.bottom));
        rows.flat_map(move |row| columns.clone().map(move |column| row * across + column))
    }
}

/// A pixel's place in its square.
#[inline]
pub(super) fn place_in_tile([x, y]: [usize; 2]) -> usize {
    y % SIDE * SIDE + x % SIDE
}

/// A square's pixels, whether they are all in the picture or not.
pub(super) struct Tile<R>(Box<[R]>);

impl<R: Number> Tile<R> {
    /// One whose pixels are so many numbers each, all 0; `None` where there is no memory for it.
    pub(super) fn new(channels: usize) -> Option<Self> {
        let mut numbers = Vec::new();
        numbers.try_reserve_exact(SIDE * SIDE * channels).ok()?;
        numbers.resize(SIDE * SIDE * channels, R::zero());
        Some(Self(numbers.into_boxed_slice()))
    }

    /// All numbers.
    pub(super) fn numbers(&self) -> &[R] {
        &self.0
    }

    /// All numbers, to change.
    pub(super) fn numbers_mut(&mut self) -> &mut [R] {
        &mut self.0
    }

    /// The numbers of the pixel at a place.
    #[inline]
    pub(super) fn pixel(&self, place: usize, channels: usize) -> &[R] {
        &self.0[place * channels..][..channels]
    }
}

/// Each pixel of these, row by row.
pub(super) fn pixels_of(bounds: PixelBounds) -> impl Iterator<Item = [usize; 2]> {
    (bounds.top..bounds.bottom).flat_map(move |y| (bounds.left..bounds.right).map(move |x| [x, y]))
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn every_pixel_is_in_one_square(size in prop::array::uniform2(1..200_usize), within in prop::array::uniform4(0..200_usize)) {
            let tiling = Tiling::new(size);
            let all = PixelBounds::of_picture(size);
            let bounds = PixelBounds { left: within[0], top: within[1], right: within[2], bottom: within[3] };
            let bounds = bounds.intersection(all);
            let mut found = vec![0; size[0] * size[1]];
            for tile in 0..tiling.count() {
                for [x, y] in pixels_of(tiling.bounds(tile)) {
                    prop_assert_eq!(tiling.find([x, y]), (tile, place_in_tile([x, y])));
                    found[y * size[0] + x] += 1;
                }
            }
            prop_assert!(found.iter().all(|count| *count == 1));
            let touched: Vec<_> = if bounds.is_empty() { Vec::new() } else { tiling.touched(bounds).collect() };
            let expected = (0..tiling.count()).filter(|tile| !tiling.bounds(*tile).intersection(bounds).is_empty());
            prop_assert_eq!(touched, expected.collect::<Vec<_>>());
        }
    }
}
