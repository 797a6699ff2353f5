//! Tiles of a picture: each is drawn by one job.

use std::ops::Range;

use super::precision::Precision;
use crate::raster::PixelBounds;

/// A picture divided into tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tiling {
    size: [usize; 2],
    across: usize,
    down: usize,
}

/// The width and height of a tile in pixels.
const TILE_SIZE: usize = 64;

impl Tiling {
    pub(super) fn new(size: [usize; 2]) -> Self {
        Self { size, across: size[0].div_ceil(TILE_SIZE), down: size[1].div_ceil(TILE_SIZE) }
    }

    /// The picture's width and height in pixels.
    pub(super) fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The number of tiles.
    pub(super) fn count(&self) -> usize {
        self.across * self.down
    }

    /// The tile that holds a pixel, and the pixel's index in the tile.
    #[inline]
    pub(super) fn find(&self, [x, y]: [usize; 2]) -> (usize, usize) {
        (y / TILE_SIZE * self.across + x / TILE_SIZE, index_in_tile([x, y]))
    }

    /// The pixels of a tile that are in the picture.
    pub(super) fn bounds(&self, tile: usize) -> PixelBounds {
        let (left, top) = (tile % self.across * TILE_SIZE, tile / self.across * TILE_SIZE);
        let (right, bottom) = ((left + TILE_SIZE).min(self.size[0]), (top + TILE_SIZE).min(self.size[1]));
        PixelBounds { left, top, right, bottom }
    }

    /// The tiles that overlap these pixels.
    pub(super) fn touched(&self, bounds: PixelBounds) -> impl Iterator<Item = usize> {
        let across = self.across;
        let ends = |start: usize, end: usize| -> Range<usize> { start / TILE_SIZE..end.div_ceil(TILE_SIZE) };
        let (columns, rows) = (ends(bounds.left, bounds.right), ends(bounds.top, bounds.bottom));
        rows.flat_map(move |row| columns.clone().map(move |column| row * across + column))
    }
}

/// A pixel's index in its tile.
#[inline]
pub(super) fn index_in_tile([x, y]: [usize; 2]) -> usize {
    y % TILE_SIZE * TILE_SIZE + x % TILE_SIZE
}

/// A tile's pixels; those outside of the picture are unused.
#[derive(Clone)]
pub(super) struct Tile<R>(Box<[R]>);

impl<R: Precision> Tile<R> {
    /// A tile whose pixels have `channels` numbers each, all 0; `None` if out of memory.
    pub(super) fn new(channels: usize) -> Option<Self> {
        let mut numbers = Vec::new();
        numbers.try_reserve_exact(TILE_SIZE * TILE_SIZE * channels).ok()?;
        numbers.resize(TILE_SIZE * TILE_SIZE * channels, R::zero());
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

    /// The numbers of a pixel, by its index in the tile.
    #[inline]
    pub(super) fn pixel(&self, index: usize, channels: usize) -> &[R] {
        &self.0[index * channels..][..channels]
    }
}

/// The coordinates of these pixels, row by row.
pub(super) fn pixels_of(bounds: PixelBounds) -> impl Iterator<Item = [usize; 2]> {
    (bounds.top..bounds.bottom).flat_map(move |y| (bounds.left..bounds.right).map(move |x| [x, y]))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn every_pixel_is_in_one_tile(size in prop::array::uniform2(1..200_usize), within in prop::array::uniform4(0..200_usize)) {
            let tiling = Tiling::new(size);
            let all = PixelBounds::of_picture(size);
            let bounds = PixelBounds { left: within[0], top: within[1], right: within[2], bottom: within[3] };
            let bounds = bounds.intersection(all);
            let mut found = vec![0; size[0] * size[1]];
            for tile in 0..tiling.count() {
                for [x, y] in pixels_of(tiling.bounds(tile)) {
                    prop_assert_eq!(tiling.find([x, y]), (tile, index_in_tile([x, y])));
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
