//! Rectangles of pixels.

use super::grid::{GridPoint, pixel_centers};

/// A half-open rectangle of pixels: the columns `left..right` and the rows `top..bottom`, counted from the picture's
/// top left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelBounds {
    /// The first column.
    pub left: usize,
    /// The first row.
    pub top: usize,
    /// The column after the last.
    pub right: usize,
    /// The row after the last.
    pub bottom: usize,
}

impl PixelBounds {
    /// The bounds of a whole picture, given its width and height in pixels.
    pub fn of_picture([width, height]: [usize; 2]) -> Self {
        Self { left: 0, top: 0, right: width, bottom: height }
    }

    /// The pixels of a picture whose centres are in the bounding rectangle of three points, edges included.
    pub(super) fn of_points(points: [GridPoint; 3], picture: [usize; 2]) -> Self {
        let [columns, rows] = [0, 1].map(|axis| {
            let [a, b, c] = points.map(|point| point[axis]);
            let range = pixel_centers(a.min(b).min(c), a.max(b).max(c));
            [range.start, range.end].map(|end| end.clamp(0, picture[axis] as i64) as usize)
        });
        Self { left: columns[0], top: rows[0], right: columns[1], bottom: rows[1] }
    }

    /// Whether the rectangle contains no pixel.
    pub fn is_empty(&self) -> bool {
        self.left >= self.right || self.top >= self.bottom
    }

    /// The pixels in both rectangles.
    pub fn intersection(&self, other: Self) -> Self {
        Self {
            left: self.left.max(other.left),
            top: self.top.max(other.top),
            right: self.right.min(other.right),
            bottom: self.bottom.min(other.bottom),
        }
    }
}
