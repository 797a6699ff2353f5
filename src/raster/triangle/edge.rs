//! Edge functions (Pineda 1988) in exact integers.

use std::ops::Range;

use crate::raster::grid::{GridPoint, HALF_PIXEL, STEPS_PER_PIXEL};

/// The edge function of a triangle's edge: at a pixel's centre, twice the signed area, in square steps, of the triangle
/// between the edge and that centre. It is not negative on the inner side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    /// The value at the centre of the picture's top left pixel.
    at_first_pixel: i64,
    /// The change to the next column.
    pub across: i64,
    /// The change to the next row.
    down: i64,
    /// The least value that counts as inside, by the top-left rule of Direct3D, Metal and Vulkan's devices: of two
    /// triangles with a common edge, pixels on it belong to the one for which it is a left edge or a horizontal top
    /// edge.
    min_inside: i64,
}

impl Edge {
    /// The edge from one corner of a clockwise triangle to the next.
    pub fn new(from: GridPoint, to: GridPoint) -> Self {
        let [x, y] = [to[0] - from[0], to[1] - from[1]];
        let is_top_left = y < 0 || (y == 0 && x > 0);
        Self {
            at_first_pixel: x * (HALF_PIXEL - from[1]) - y * (HALF_PIXEL - from[0]),
            across: -y * STEPS_PER_PIXEL,
            down: x * STEPS_PER_PIXEL,
            min_inside: i64::from(!is_top_left),
        }
    }

    /// The value at a pixel's centre.
    pub fn at(&self, column: i64, row: i64) -> i64 {
        self.at_first_pixel + self.across * column + self.down * row
    }

    /// The part of `columns` whose centres in a row are on this edge's inner side.
    pub fn inside(&self, row: i64, columns: Range<i64>) -> Range<i64> {
        let above_min = self.at(0, row) - self.min_inside;
        if self.across > 0 {
            columns.start.max(-above_min.div_euclid(self.across))..columns.end
        } else if self.across < 0 {
            columns.start..columns.end.min(above_min.div_euclid(-self.across) + 1)
        } else if above_min >= 0 {
            columns
        } else {
            0..0
        }
    }
}
