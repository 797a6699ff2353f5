//! A conservative coarse depth buffer for occlusion culling.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use super::silhouettes::{Silhouette, Silhouettes};

/// For each tile of a picture, a conservative (farthest) depth of the occluders that fully cover the tile
/// (after Hasselgren, Andersson and Akenine-Möller, "Masked software occlusion culling", 2016; conservative by area,
/// where theirs is by samples).
///
/// Depth is stored as nearness, and occluders are drawn as [silhouettes](Silhouettes). A tile is divided into up to 4 ×
/// 4 cells, and is covered if each of them is inside all lines of some silhouette. Lines and planes are linear, so they
/// are evaluated at the worst corner of a cell only. Whatever is farther than a tile's nearness is hidden in the whole
/// tile. Silhouettes that cover some cells are merged until they cover all; the merged nearness is the least of theirs.
/// Drawing silhouettes nearest first keeps it as great as possible.
///
/// Different strips may be drawn at the same time. The buffer may be tested after all strips have been drawn.
#[derive(Debug, Default)]
pub struct CoarseDepth {
    /// A tile's width in pixels.
    tile_size: f64,
    /// A tile's width in cells.
    cells: usize,
    /// The numbers of columns and rows of tiles.
    size: [usize; 2],
    /// The nearness of each tile as the bits of an f32; 0 if the tile is not covered.
    tiles: Vec<AtomicU32>,
    /// The least nearness in each block of [`CoarseDepth::BLOCK`]² tiles.
    blocks: Vec<AtomicU32>,
    /// For each tile, the [`Layer`] that silhouettes are merged into while a strip is drawn.
    layers: Vec<AtomicU64>,
}

/// A mask of covered cells of a tile, and the least nearness of what covers them.
#[derive(Clone, Copy, Debug)]
struct Layer {
    cells: u32,
    nearness: f32,
}

impl Layer {
    const EMPTY: u64 = 0;

    fn from_bits(bits: u64) -> Self {
        Self { cells: (bits >> 32) as u32, nearness: f32::from_bits(bits as u32) }
    }

    fn bits(self) -> u64 {
        u64::from(self.cells) << 32 | u64::from(self.nearness.to_bits())
    }

    /// Merges two layers.
    fn merge(self, other: Self) -> Self {
        Self { cells: self.cells | other.cells, nearness: self.nearness.min(other.nearness) }
    }
}

impl CoarseDepth {
    /// A block's width in tiles. Large rectangles are tested against blocks first. A strip is a row of blocks.
    pub const BLOCK: usize = 8;

    /// Resizes the buffer for a picture, with tiles of `tile_size` pixels. The contents are valid only after all strips
    /// have been drawn.
    pub fn reset(&mut self, picture: [u32; 2], tile_size: u32) {
        self.tile_size = f64::from(tile_size.max(1));
        // A cell is at least a pixel wide.
        self.cells = (tile_size.max(1) as usize).min(MAX_CELLS);
        self.size = picture.map(|pixels| pixels.div_ceil(tile_size.max(1)) as usize);
        let [columns, rows] = self.size;
        self.tiles.resize_with(columns * rows, AtomicU32::default);
        self.layers.resize_with(columns * rows, AtomicU64::default);
        self.blocks.resize_with(columns.div_ceil(Self::BLOCK) * self.strip_count(), AtomicU32::default);
    }

    /// The number of strips.
    pub fn strip_count(&self) -> usize {
        self.size[1].div_ceil(Self::BLOCK)
    }

    /// Clears and draws a strip. One strip must not be drawn twice at the same time.
    pub fn draw(&self, strip: usize, silhouettes: &Silhouettes) {
        let [columns, rows] = self.size;
        let rows = strip * Self::BLOCK..rows.min((strip + 1) * Self::BLOCK);
        // Relaxed: jobs that read the tiles depend on this job.
        for tile in rows.start * columns..rows.end * columns {
            self.tiles[tile].store(0, Ordering::Relaxed);
            self.layers[tile].store(Layer::EMPTY, Ordering::Relaxed);
        }
        let [low, high] = [rows.start, rows.end].map(|row| row as f64 * self.tile_size);
        for silhouette in silhouettes.between(low, high) {
            rows.clone().for_each(|row| self.draw_row(row, &silhouette));
        }
        for (column, block) in (0..columns).step_by(Self::BLOCK).zip(self.blocks_in(strip)) {
            let tiles = rows.clone().flat_map(|row| self.row(row, column..columns.min(column + Self::BLOCK)));
            let min_nearness = tiles.map(|tile| tile.load(Ordering::Relaxed)).min();
            block.store(min_nearness.unwrap_or(0), Ordering::Relaxed);
        }
    }

    fn draw_row(&self, row: usize, silhouette: &Silhouette<'_>) {
        let [left, right] = silhouette.width.map(|x| (x / self.tile_size).clamp(0.0, self.size[0] as f64));
        let max_nearness = (silhouette.max_nearness as f32).max(0.0).next_up().to_bits();
        let is_nearer = |tile: &AtomicU32| tile.load(Ordering::Relaxed) >= max_nearness;
        if self.row(row, left as usize..right.ceil() as usize).iter().all(is_nearer) {
            return;
        }
        let mut covered = [const { 0..0 }; MAX_CELLS];
        let (mut first, mut end) = (usize::MAX, 0);
        for (line, cells) in covered[..self.cells].iter_mut().enumerate() {
            *cells = self.covered_cells(row * self.cells + line, silhouette);
            if cells.start < cells.end {
                (first, end) = (first.min(cells.start), end.max(cells.end));
            }
        }
        for column in first / self.cells..end.div_ceil(self.cells) {
            self.draw_tile(row, column, &covered[..self.cells], silhouette);
        }
    }

    /// The cells of a row of cells that a silhouette covers.
    fn covered_cells(&self, row: usize, silhouette: &Silhouette<'_>) -> Range<usize> {
        let width = self.tile_size / self.cells as f64;
        let half = width / 2.0;
        let y = row as f64 * width + half;
        let (mut first, mut last) = (0.0, self.size[0] as f64 * self.tile_size);
        for [right, down, offset, across] in silhouette.lines {
            // The value at the cell's worst corner, as a function of its centre.
            let rest = down * y + offset - (right.abs() + down.abs()) * half;
            if *right > 0.0 {
                first = f64::max(first, -rest * across);
            } else if *right < 0.0 {
                last = f64::min(last, -rest * across);
            } else if rest < 0.0 {
                return 0..0;
            }
        }
        // Cell centres are at half-integer multiples of the width.
        let first = ((first - half) / width).ceil().max(0.0);
        let end = ((last - half) / width).floor() + 1.0;
        if first < end { first as usize..(end as usize).min(self.size[0] * self.cells) } else { 0..0 }
    }

    fn draw_tile(&self, row: usize, column: usize, covered: &[Range<usize>], silhouette: &Silhouette<'_>) {
        // Relaxed: only one job draws this strip.
        let index = row * self.size[0] + column;
        let (tile, layer) = (&self.tiles[index], &self.layers[index]);
        let behind = f32::from_bits(tile.load(Ordering::Relaxed));
        if f64::from(behind) >= silhouette.max_nearness {
            return;
        }
        let first = column * self.cells;
        // The bounds of the covered cells: planes are evaluated only there, not beyond the silhouette.
        let (mut cells, mut low, mut high) = (0, [usize::MAX; 2], [0; 2]);
        for (line, range) in covered.iter().enumerate() {
            let [start, end] = [range.start, range.end].map(|cell| cell.saturating_sub(first).min(self.cells));
            if start < end {
                cells |= ((1_u32 << end) - (1 << start)) << (line * self.cells);
                low = [low[0].min(start), low[1].min(line)];
                high = [high[0].max(end), high[1].max(line + 1)];
            }
        }
        if cells == 0 {
            return;
        }
        let width = self.tile_size / self.cells as f64;
        let center = |axis: usize, tile: usize| {
            (tile * self.cells) as f64 * width + (low[axis] + high[axis]) as f64 * 0.5 * width
        };
        let half = |axis: usize| (high[axis] - low[axis]) as f64 * 0.5 * width;
        let ([x, y], [half_x, half_y]) = ([center(0, column), center(1, row)], [half(0), half(1)]);
        let (mut nearness, mut max_nearness) = (f64::INFINITY, f64::INFINITY);
        for [right, down, offset] in silhouette.planes {
            let at_center = right * x + down * y + offset;
            let variation = right.abs() * half_x + down.abs() * half_y;
            nearness = nearness.min(at_center - variation);
            max_nearness = max_nearness.min(at_center + variation);
        }
        let nearness = nearness as f32;
        if max_nearness >= silhouette.opening_nearness || nearness <= behind {
            return;
        }
        let all = u32::MAX >> (u32::BITS as usize - self.cells * self.cells);
        if cells == all {
            tile.store(nearness.to_bits(), Ordering::Relaxed);
            return;
        }
        let own = Layer { cells, nearness };
        let merged = Layer::from_bits(layer.load(Ordering::Relaxed));
        // A layer that is empty or behind the tile's nearness is obsolete.
        let merged = if merged.nearness > behind { merged.merge(own) } else { own };
        if merged.cells == all {
            tile.store(merged.nearness.to_bits(), Ordering::Relaxed);
            layer.store(Layer::EMPTY, Ordering::Relaxed);
        } else {
            layer.store(merged.bits(), Ordering::Relaxed);
        }
    }

    fn row(&self, row: usize, columns: Range<usize>) -> &[AtomicU32] {
        let start = row * self.size[0];
        &self.tiles[start + columns.start..start + columns.end.max(columns.start)]
    }

    fn blocks_in(&self, strip: usize) -> &[AtomicU32] {
        let count = self.size[0].div_ceil(Self::BLOCK);
        &self.blocks[strip * count..][..count]
    }

    /// The nearness of the tile at a point of the picture; 0 if it is not covered, and outside the picture.
    pub fn nearness_at(&self, x: f64, y: f64) -> f32 {
        let [column, row] = [x, y].map(|pixel| (pixel / self.tile_size).floor());
        let [columns, rows] = self.size.map(|count| count as f64);
        // The comparisons are false for NaN.
        if !(column >= 0.0 && row >= 0.0 && column < columns && row < rows) {
            return 0.0;
        }
        f32::from_bits(self.tiles[row as usize * self.size[0] + column as usize].load(Ordering::Relaxed))
    }

    /// Whether a rectangle of the picture is hidden beyond `nearness`. `low` and `high` are its corners in pixels. The
    /// part outside the picture is ignored; if the whole rectangle is outside, the result is `false`.
    pub fn hides(&self, low: [f64; 2], high: [f64; 2], nearness: f32) -> bool {
        let range = |axis: usize| {
            let count = self.size[axis] as f64;
            let [first, last] = [low[axis], high[axis]].map(|pixel| (pixel / self.tile_size).floor());
            // The comparisons are false for NaN.
            let is_inside = first < count && last >= 0.0 && count > 0.0;
            is_inside.then(|| first.max(0.0) as usize..last.min(count - 1.0) as usize + 1)
        };
        let (Some(columns), Some(rows)) = (range(0), range(1)) else { return false };
        // The bits of non-negative floats have the order of the floats.
        let nearness = nearness.max(0.0).to_bits();
        let covers = |tile: &AtomicU32| tile.load(Ordering::Relaxed) > nearness;
        let strips = rows.start / Self::BLOCK..(rows.end - 1) / Self::BLOCK + 1;
        for strip in strips {
            let rows = rows.start.max(strip * Self::BLOCK)..rows.end.min((strip + 1) * Self::BLOCK);
            let mut column = columns.start;
            while column < columns.end {
                let block = column / Self::BLOCK;
                let part = column..columns.end.min((block + 1) * Self::BLOCK);
                column = part.end;
                if !covers(&self.blocks_in(strip)[block])
                    && !rows.clone().all(|row| self.row(row, part.clone()).iter().all(covers))
                {
                    return false;
                }
            }
        }
        true
    }
}

/// The maximum width of a tile in cells. A layer's mask of 32 bits has room for 5 × 5.
const MAX_CELLS: usize = 4;

#[cfg(test)]
mod tests {
    use glam::DVec2;
    use proptest::prelude::*;

    use super::*;

    fn drawn(picture: [u32; 2], tile_size: u32, silhouettes: &Silhouettes) -> CoarseDepth {
        let mut depth = CoarseDepth::default();
        depth.reset(picture, tile_size);
        (0..depth.strip_count()).for_each(|strip| depth.draw(strip, silhouettes));
        depth
    }

    fn rectangle(low: [f64; 2], high: [f64; 2]) -> [DVec2; 4] {
        [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]].map(DVec2::from)
    }

    #[test]
    fn only_tiles_that_are_covered_entirely_count() {
        let mut silhouettes = Silhouettes::default();
        silhouettes.add(rectangle([8.0, 7.9], [31.9, 40.0]), 0.0, [[0.0, 0.0, 0.5]], [f64::INFINITY; 2]);
        let depth = drawn([64, 48], 8, &silhouettes);
        for row in 0..6 {
            for column in 0..8 {
                let expected = if (1..3).contains(&column) && (1..5).contains(&row) { 0.5 } else { 0.0 };
                let center = [column, row].map(|tile| f64::from(tile) * 8.0 + 4.0);
                assert_eq!(depth.nearness_at(center[0], center[1]), expected, "{column} {row}");
            }
        }
        assert!(depth.hides([8.0, 8.0], [23.9, 39.9], 0.4));
        assert!(!depth.hides([8.0, 8.0], [23.9, 39.9], 0.5));
        assert!(!depth.hides([7.9, 8.0], [23.9, 39.9], 0.4));
        assert!(!depth.hides([8.0, 8.0], [24.0, 39.9], 0.4));
        assert!(!depth.hides([8.0, f64::NAN], [20.0, 20.0], 0.4));
        assert!(!depth.hides([-9.0, 9.0], [-2.0, 20.0], 0.4));
        assert_eq!([depth.nearness_at(-1.0, 9.0), depth.nearness_at(f64::NAN, 9.0)], [0.0; 2]);
    }

    #[test]
    fn nothing_outside_the_picture_is_covered() {
        let mut silhouettes = Silhouettes::default();
        silhouettes.add(rectangle([-20.0; 2], [90.0; 2]), 0.0, [[0.0, 0.0, 0.5]], [f64::INFINITY; 2]);
        let depth = drawn([64, 48], 8, &silhouettes);
        assert_eq!(depth.nearness_at(63.9, 47.9), 0.5);
        for (x, y) in [(-1.0, 9.0), (9.0, -1.0), (64.0, 9.0), (9.0, 48.0), (f64::NAN, 9.0), (9.0, f64::NAN)] {
            assert_eq!(depth.nearness_at(x, y), 0.0, "{x} {y}");
        }
        assert!(!drawn([0, 0], 8, &silhouettes).hides([-9.0; 2], [9.0; 2], 0.1));
    }

    #[test]
    fn a_tile_is_as_near_as_the_farthest_of_its_corners_and_open_if_one_is_too_near() {
        let [right, down, offset] = [-0.004, -0.007, 0.9];
        // In two parts, one covers some cells of a tile and the other one the others.
        for (opening_nearness, split) in [(f64::INFINITY, 90.0), (0.63, 90.0), (f64::INFINITY, 36.0)] {
            let mut silhouettes = Silhouettes::default();
            for [from, to] in [[-20.0, split], [split, 90.0]] {
                let corners = rectangle([from, -20.0], [to, 90.0]);
                silhouettes.add(corners, 0.0, [[right, down, offset]], [opening_nearness, f64::INFINITY]);
            }
            let depth = drawn([64, 48], 8, &silhouettes);
            let mut open = 0;
            for (row, column) in (0..6).flat_map(|row| (0..8).map(move |column| (row, column))) {
                let [left, top] = [column, row].map(|tile| f64::from(tile) * 8.0);
                let nearnesses = rectangle([left, top], [left + 8.0, top + 8.0])
                    .map(|corner| right * corner.x + down * corner.y + offset);
                let is_open = nearnesses.iter().any(|nearness| *nearness >= opening_nearness);
                open += usize::from(is_open);
                let expected = if is_open { 0.0 } else { nearnesses.into_iter().fold(1.0, f64::min) };
                let found = f64::from(depth.nearness_at(left + 4.0, top + 4.0));
                assert!((found - expected).abs() < 1e-6, "{found} at {left} {top}, not {expected}");
            }
            assert_eq!(open > 0, opening_nearness.is_finite());
        }
    }

    #[test]
    fn a_margin_shrinks_a_silhouette() {
        let count = |margin: f64| {
            let mut silhouettes = Silhouettes::default();
            silhouettes.add(rectangle([8.0, 8.0], [40.0, 40.0]), margin, [[0.0, 0.0, 0.5]], [f64::INFINITY; 2]);
            let depth = drawn([64, 64], 8, &silhouettes);
            depth.tiles.iter().filter(|tile| tile.load(Ordering::Relaxed) > 0).count()
        };
        assert_eq!([0.0, 0.01, 8.0, 8.01].map(count), [16, 4, 4, 0]);
    }

    #[test]
    fn silhouettes_cover_a_tile_together() {
        let nearness_of = |parts: &[([f64; 2], f64)]| {
            let mut silhouettes = Silhouettes::default();
            for &([left, right], nearness) in parts {
                let corners = rectangle([left, -1.0], [right, 20.0]);
                silhouettes.add(corners, 0.0, [[0.0, 0.0, nearness]], [f64::INFINITY; 2]);
            }
            drawn([16, 16], 16, &silhouettes).nearness_at(8.0, 8.0)
        };
        assert_eq!(nearness_of(&[([-1.0, 8.0], 0.5), ([8.0, 17.0], 0.4)]), 0.4);
        assert_eq!(nearness_of(&[([-1.0, 8.0], 0.4), ([8.0, 17.0], 0.5)]), 0.4);
        // A cell of four pixels that neither covers, parts of cells that both cover, and two cells that both cover.
        assert_eq!(nearness_of(&[([-1.0, 7.9], 0.5), ([7.9, 17.0], 0.4)]), 0.0);
        assert_eq!(nearness_of(&[([-1.0, 9.0], 0.5), ([7.0, 17.0], 0.4)]), 0.4);
        assert_eq!(nearness_of(&[([-1.0, 12.0], 0.5), ([4.0, 17.0], 0.4)]), 0.4);
        // In front of a silhouette that covers the tile, and behind it.
        let whole = ([-1.0, 17.0], 0.45);
        assert_eq!(nearness_of(&[([-1.0, 8.0], 0.5), whole, ([8.0, 17.0], 0.4)]), 0.45);
        assert_eq!(nearness_of(&[whole, ([-1.0, 8.0], 0.5), ([8.0, 17.0], 0.49)]), 0.49);
        // Nearer silhouettes after the tile is covered.
        let halves = [([-1.0, 8.0], 0.3), ([8.0, 17.0], 0.2), ([-1.0, 8.0], 0.5), ([8.0, 17.0], 0.4)];
        assert_eq!(nearness_of(&halves), 0.4);
    }

    #[test]
    fn a_plane_counts_only_in_the_rows_of_cells_that_it_covers() {
        let mut silhouettes = Silhouettes::default();
        for ([top, bottom], plane) in [([-1.0, 8.0], [0.0, -0.05, 0.9]), ([8.0, 17.0], [0.0, 0.0, 0.6])] {
            silhouettes.add(rectangle([-1.0, top], [17.0, bottom]), 0.0, [plane], [f64::INFINITY; 2]);
        }
        let nearness = drawn([16, 16], 16, &silhouettes).nearness_at(8.0, 8.0);
        assert!((nearness - 0.5).abs() < 1e-6, "{nearness}");
    }

    #[test]
    fn silhouettes_without_area_or_with_nan_are_ignored() {
        let mut silhouettes = Silhouettes::default();
        let plane = [[0.0, 0.0, 0.5]];
        let line = [DVec2::ZERO, DVec2::ONE, DVec2::splat(7.0), DVec2::splat(7.0)];
        silhouettes.add(line, 0.0, plane, [1.0; 2]);
        silhouettes.add([DVec2::ZERO, DVec2::X, DVec2::new(f64::NAN, 3.0)], 0.0, plane, [1.0; 2]);
        silhouettes.add([DVec2::ZERO, DVec2::X, DVec2::new(f64::INFINITY, 3.0)], 0.0, plane, [1.0; 2]);
        silhouettes.add(rectangle([0.0; 2], [9.0; 2]), 0.0, [], [1.0; 2]);
        silhouettes.add(rectangle([0.0; 2], [9.0; 2]), 0.0, [[0.0, f64::NAN, 0.0]], [1.0; 2]);
        silhouettes.add(rectangle([0.0; 2], [9.0; 2]), f64::NAN, plane, [1.0; 2]);
        assert_eq!(silhouettes.len(), 0);
        silhouettes.add(rectangle([0.0; 2], [9.0; 2]), 0.0, plane, [1.0; 2]);
        assert_eq!(silhouettes.len(), 1);
        silhouettes.add([DVec2::ZERO, DVec2::X, DVec2::Y], 0.0, plane, [1.0; 2]);
        assert_eq!(silhouettes.len(), 2);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// Compares all tiles with points of each tile, tested against each silhouette.
        #[test]
        fn no_point_is_farther_than_its_tile(
            shapes in prop::collection::vec(
                (prop::collection::vec(prop::array::uniform2(-20.0..90.0_f64), 3..9), prop::array::uniform3(-0.01..0.01_f64)),
                1..8,
            ),
            side in prop::sample::select(vec![1_u32, 2, 4, 8, 16]),
            rectangle in prop::array::uniform4(-10.0..80.0_f64),
            nearness in 0.2..0.8_f32,
        ) {
            let mut silhouettes = Silhouettes::default();
            for (corners, [right, down, further]) in &shapes {
                let planes = [[*right, *down, 0.5], [*further, -*right, 0.6]];
                silhouettes.add(corners.iter().map(|&corner| DVec2::from(corner)), 0.0, planes, [f64::INFINITY; 2]);
            }
            let depth = drawn([70, 50], side, &silhouettes);
            let nearest_at = |x: f64, y: f64| {
                let mut nearest = 0.0;
                for (corners, [right, down, further]) in &shapes {
                    // A point is inside the hull if it is inside a triangle of any three corners.
                    let point = DVec2::new(x, y);
                    let corners: Vec<_> = corners.iter().map(|&corner| DVec2::from(corner)).collect();
                    let mut triangles = corners.iter().enumerate().flat_map(|(index, &a)| {
                        let corners = &corners;
                        (0..index).flat_map(move |other| (0..other).map(move |third| [a, corners[other], corners[third]]))
                    });
                    let is_inside = triangles.any(|[a, b, c]| {
                        let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| (to - from).perp_dot(point - from));
                        sides.iter().all(|&side| side >= -1e-9) || sides.iter().all(|&side| side <= 1e-9)
                    });
                    if is_inside {
                        nearest = f64::max(nearest, (right * x + down * y + 0.5).min(further * x - right * y + 0.6));
                    }
                }
                nearest
            };
            let [columns, rows] = depth.size;
            let width = f64::from(side);
            for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
                let [left, top] = [column, row].map(|tile| tile as f64 * width);
                let found = f64::from(depth.nearness_at(left + width / 2.0, top + width / 2.0));
                for share in [[0.01, 0.01], [0.99, 0.01], [0.01, 0.99], [0.99, 0.99], [0.5, 0.3]] {
                    let nearest = nearest_at(left + share[0] * width, top + share[1] * width);
                    prop_assert!(found <= nearest + 1e-6, "{found} at {left} {top}, and {nearest} in it");
                }
            }
            let [a, b, c, d] = rectangle;
            let (low, high) = ([a.min(b), c.min(d)], [a.max(b), c.max(d)]);
            let touched = |row: usize, column: usize| {
                let [left, top] = [column, row].map(|tile| tile as f64 * width);
                left <= high[0] && left + width > low[0] && top <= high[1] && top + width > low[1]
            };
            let mut tiles = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
            let mut any = false;
            let all = tiles.all(|(row, column)| {
                let is_touched = touched(row, column);
                any |= is_touched;
                let found = depth.nearness_at((column as f64 + 0.5) * width, (row as f64 + 0.5) * width);
                !is_touched || found > nearness
            });
            prop_assert_eq!(depth.hides(low, high, nearness), all && any);
        }
    }
}
