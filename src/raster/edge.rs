//! A triangle's edge as a function over the picture (Pineda 1988), in exact integers.

use std::ops::Range;

use super::grid::{GridPoint, HALF_PIXEL, STEPS_PER_PIXEL};

/// Tells on which side of an edge a pixel's middle lies: the function is twice the area, in square steps, of the
/// triangle that the edge makes with it, and not below 0 on the inner side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    /// At the middle of the picture's top left pixel.
    at_first: i64,
    /// How it changes to the next column.
    pub across: i64,
    /// How it changes to the next row.
    down: i64,
    /// The least value that is inside: of two triangles with a common edge, just one has the pixels on it. It is the
    /// one for which it is a left edge, or a top edge that is level: the rule of Direct3D, Metal and Vulkan's devices.
    least: i64,
}

impl Edge {
    /// The edge of a triangle whose corners follow each other clockwise in the picture.
    pub fn new(from: GridPoint, to: GridPoint) -> Self {
        let [x, y] = [to[0] - from[0], to[1] - from[1]];
        let is_inside = y < 0 || (y == 0 && x > 0);
        Self {
            at_first: x * (HALF_PIXEL - from[1]) - y * (HALF_PIXEL - from[0]),
            across: -y * STEPS_PER_PIXEL,
            down: x * STEPS_PER_PIXEL,
            least: i64::from(!is_inside),
        }
    }

    /// Its value at a pixel's middle.
    pub fn at(&self, column: i64, row: i64) -> i64 {
        self.at_first + self.across * column + self.down * row
    }

    /// The columns of a row of which the middle is inside, as far as this edge goes, out of `columns`.
    pub fn inside(&self, row: i64, columns: Range<i64>) -> Range<i64> {
        let above_least = self.at(0, row) - self.least;
        if self.across > 0 {
            columns.start.max(-above_least.div_euclid(self.across))..columns.end
        } else if self.across < 0 {
            columns.start..columns.end.min(above_least.div_euclid(-self.across) + 1)
        } else if above_least >= 0 {
            columns
        } else {
            0..0
        }
    }
}
