//! The grid that corners are snapped to, and what is exact from there on.

use std::ops::Range;

use super::{PixelBounds, Real, Vector4};

/// The longest side of a picture that can be drawn into, in pixels. In a larger one no triangle covers anything.
pub const MAX_PICTURE_SIZE: usize = 1 << 14;

/// The way round in which three corners follow each other in the picture, y up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Winding {
    /// The front of what is not mirrored.
    CounterClockwise,
    /// The back of it.
    Clockwise,
}

impl Winding {
    /// Of corners with this [`doubled_area`]; none if it is 0.
    pub(super) fn of_area(area: i64) -> Option<Self> {
        match area {
            0 => None,
            1.. => Some(Self::Clockwise),
            _ => Some(Self::CounterClockwise),
        }
    }
}

/// A place in the picture: steps to the right and down from its top left. There are [`STEPS_PER_PIXEL`] to a pixel, as Direct3D
/// 11 demands and most other devices have it (8 bits of sub-pixel precision).
pub(super) type GridPoint = [i64; 2];

/// Steps across a pixel.
pub(super) const STEPS_PER_PIXEL: i64 = 256;

/// Steps from a pixel's edge to its middle, where it is sampled.
pub(super) const HALF_PIXEL: i64 = STEPS_PER_PIXEL / 2;

/// No place is farther than this from the top left along either axis, so that a difference of two is at most 2²⁹, a
/// product of two differences 2⁵⁸, and a difference of these 2⁵⁹: all of it fits into an i64.
pub(super) const MAX_COORDINATE: i64 = 1 << 28;

/// The place of a corner in clip space in a picture of some pixels. Wants w > 0, and everything finite.
pub(super) fn snap<R: Real>(clip: &Vector4<R>, picture: [usize; 2]) -> GridPoint {
    let [x, y, _, w] = clip.0;
    let half = picture.map(|side| R::of_integer(side as i64) * R::of(0.5));
    [nearest_step(half[0] + half[0] * (x / w)), nearest_step(half[1] - half[1] * (y / w))]
}

/// Of a distance in pixels; what lies half way goes up, everywhere alike.
fn nearest_step<R: Real>(pixels: R) -> i64 {
    let farthest = MAX_COORDINATE as f64;
    let steps = (pixels.as_f64() * STEPS_PER_PIXEL as f64).clamp(-farthest, farthest);
    // Of a positive number, the cast is the floor, and costs less.
    (steps + farthest + 0.5) as i64 - MAX_COORDINATE
}

/// Twice the area of a triangle in square steps: above 0 if it is wound clockwise.
pub(super) fn doubled_area([a, b, c]: [GridPoint; 3]) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
}

/// The pixels whose middle lies from `low` to `high` steps, both included.
pub(super) fn pixel_centers(low: i64, high: i64) -> Range<i64> {
    (low + HALF_PIXEL - 1).div_euclid(STEPS_PER_PIXEL)..(high - HALF_PIXEL).div_euclid(STEPS_PER_PIXEL) + 1
}

/// The pixels of a picture whose middle lies in the rectangle around three places, its edges included.
pub(super) fn bounds(places: [GridPoint; 3], picture: [usize; 2]) -> PixelBounds {
    let [columns, rows] = [0, 1].map(|axis| {
        let [a, b, c] = places.map(|place| place[axis]);
        let middles = pixel_centers(a.min(b).min(c), a.max(b).max(c));
        [middles.start, middles.end].map(|end| end.clamp(0, picture[axis] as i64) as usize)
    });
    PixelBounds { left: columns[0], top: rows[0], right: columns[1], bottom: rows[1] }
}
