//! The sub-pixel grid that vertices are snapped to. From there on, arithmetic is in exact integers.

use std::ops::Range;

use super::{Real, Vector4};

/// The maximum width and height of a picture in pixels. In a larger picture, triangles cover nothing.
pub const MAX_PICTURE_SIZE: usize = 1 << 14;

/// The winding order of a triangle in the picture, with y up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Winding {
    /// Front-facing, unless the object is mirrored.
    CounterClockwise,
    /// Back-facing, unless the object is mirrored.
    Clockwise,
}

impl Winding {
    /// The winding of a triangle with this [`doubled_area`]; `None` if that is 0.
    pub(super) fn of_area(area: i64) -> Option<Self> {
        match area {
            0 => None,
            1.. => Some(Self::Clockwise),
            _ => Some(Self::CounterClockwise),
        }
    }
}

/// A point of the grid: steps to the right and down from the picture's top left. A pixel has [`STEPS_PER_PIXEL`], as
/// Direct3D 11 requires and most other devices have (8 bits of sub-pixel precision).
pub(super) type GridPoint = [i64; 2];

/// The number of steps across a pixel.
pub(super) const STEPS_PER_PIXEL: i64 = 256;

/// The number of steps from a pixel's edge to its centre, where it is sampled.
pub(super) const HALF_PIXEL: i64 = STEPS_PER_PIXEL / 2;

/// The maximum absolute coordinate of a point: the difference of two is at most 2²⁹, a product of two differences 2⁵⁸,
/// and a difference of such products 2⁵⁹, which fits into an i64.
pub(super) const MAX_COORDINATE: i64 = 1 << 28;

/// Snaps a clip-space position to the grid of a picture, given in pixels. Requires w > 0 and finite coordinates.
pub(super) fn snap<R: Real>(clip: &Vector4<R>, picture: [usize; 2]) -> GridPoint {
    let [x, y, _, w] = clip.0;
    let half = picture.map(|side| R::of_integer(side as i64) * R::of(0.5));
    [nearest_step(half[0] + half[0] * (x / w)), nearest_step(half[1] - half[1] * (y / w))]
}

/// Rounds a distance in pixels to the nearest step; ties are always rounded up.
fn nearest_step<R: Real>(pixels: R) -> i64 {
    let limit = MAX_COORDINATE as f64;
    let steps = (pixels.as_f64() * STEPS_PER_PIXEL as f64).clamp(-limit, limit);
    // For a positive number the cast rounds down, and costs less than `floor`.
    (steps + limit + 0.5) as i64 - MAX_COORDINATE
}

/// Twice the signed area of a triangle in square steps: positive for a clockwise triangle.
pub(super) fn doubled_area([a, b, c]: [GridPoint; 3]) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
}

/// The pixels whose centres are in `low..=high`, in steps.
pub(super) fn pixel_centers(low: i64, high: i64) -> Range<i64> {
    (low + HALF_PIXEL - 1).div_euclid(STEPS_PER_PIXEL)..(high - HALF_PIXEL).div_euclid(STEPS_PER_PIXEL) + 1
}
