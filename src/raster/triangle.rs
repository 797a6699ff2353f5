//! Triangles, set up to be drawn.

use std::array::from_fn;

use super::clip::{self, ClipCorner, Overlap};
use super::edge::Edge;
use super::grid::{self, MAX_PICTURE_SIZE, Winding};
use super::{PixelBounds, Real, Vector4};

/// A triangle, set up to be drawn into a picture of some size, with `V` numbers to interpolate.
///
/// It covers just the pixels that it does on a device: corners are snapped to a 256th of a pixel, and the pixels whose
/// middle lies within are covered; of those on an edge, the ones on a top or a left edge. This is decided in exact
/// integers, so that triangles with a common edge leave no pixel out between them, and cover none twice.
#[derive(Clone, Debug)]
pub struct Triangle<R, const V: usize> {
    /// Clockwise in the picture; each opposite of the corner of the same number.
    edges: [Edge; 3],
    bounds: PixelBounds,
    /// One over twice the area, in square steps.
    per_area: R,
    /// At the corners, from 0 to 1.
    depths: [R; 3],
    /// At the corners: one over w, times the least w of them. The nearest corner has 1.
    nearness: [R; 3],
    /// At the corners.
    varyings: [[R; V]; 3],
}

/// What [`Triangle::interpolate`] gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interpolated<R, const V: usize> {
    /// At the pixel's middle.
    pub value: [R; V],
    /// How it changes to the next column: the derivative `dpdx`.
    pub across: [R; V],
    /// How it changes to the next row: the derivative `dpdy`.
    pub down: [R; V],
}

impl<R: Real, const V: usize> Triangle<R, V> {
    /// Sets up the triangle with these corners in clip space for a `picture` of so many pixels to the right and down,
    /// and appends it to `triangles`: in several parts where it has to be clipped, not at all where it covers no pixel.
    /// `culled`: the winding in the picture that is left out.
    ///
    /// Depth is reversed, and what is seen has 0 ≤ z ≤ w: the far plane is at z = 0, and may be infinitely far away. It
    /// clips, as it does in wgpu. A triangle is left out if a corner is not finite, or if the picture is larger than
    /// [`MAX_PICTURE_SIZE`].
    pub fn set_up(
        corners: &[(Vector4<R>, [R; V]); 3],
        picture: [usize; 2],
        culled: Option<Winding>,
        triangles: &mut Vec<Self>,
    ) {
        if picture.iter().any(|&side| side > MAX_PICTURE_SIZE) {
            return;
        }
        match clip::classify(corners) {
            Overlap::Outside => (),
            Overlap::Inside => triangles.extend(Self::new(corners.each_ref(), picture, culled)),
            Overlap::Across => {
                let polygon = clip::clip(corners);
                let parts = polygon.array_windows().skip(1).map(|[one, other]| [&polygon[0], one, other]);
                triangles.extend(parts.filter_map(|corners| Self::new(corners, picture, culled)));
            }
        }
    }

    /// The pixels among which are all that it covers, within the picture.
    pub fn bounds(&self) -> PixelBounds {
        self.bounds
    }

    /// Calls `visit` with the place and the depth of each pixel that it covers `within` some bounds: row by row from
    /// the top, and from left to right.
    ///
    /// Depth is z ÷ w, linear in the picture. It is the same to the bit whatever the bounds are, lies between that of
    /// the nearest and that of the farthest corner, and is within 8 units of rounding of what is between the snapped
    /// corners (2⁻²⁴ of it each, in f32): it is the sum of each corner's depth times a share, where nothing is below 0,
    /// so that no error grows by cancelling. A share is an exact integer rounded once (1 unit), the product (1), two
    /// sums (2), one over the area (2), and the product with it (1).
    pub fn rasterize(&self, within: PixelBounds, mut visit: impl FnMut([usize; 2], R)) {
        let bounds = self.bounds.intersection(within);
        for row in bounds.top..bounds.bottom {
            let all = bounds.left as i64..bounds.right as i64;
            let columns = self.edges.iter().fold(all, |columns, edge| edge.inside(row as i64, columns));
            let mut shares = self.shares([columns.start, row as i64]);
            for column in columns {
                visit([column as usize, row], self.depth(shares));
                shares = from_fn(|corner| shares[corner] + self.edges[corner].across);
            }
        }
    }

    /// The numbers at a pixel's middle, interpolated in perspective, and how they change to the next column and row.
    ///
    /// The changes are a device's fine derivatives: the differences between the two columns, and rows, of the 2 × 2
    /// pixels that the pixel belongs to, which start at even ones. Like a device, this looks at pixels outside of the
    /// triangle for it, where the numbers go on as they do inside. Where they would have to go on behind the camera,
    /// they do not change instead.
    pub fn interpolate(&self, place: [usize; 2]) -> Interpolated<R, V> {
        let [column, row] = place.map(|number| number as i64);
        let here = self.weights([column, row]).unwrap_or_else(|| self.flat_weights([column, row]));
        let value = self.blend(here);
        let change = |beside: [i64; 2], is_second: bool| {
            let beside = self.weights(beside).map_or(value, |weights| self.blend(weights));
            let [first, second] = if is_second { [beside, value] } else { [value, beside] };
            from_fn(|index| second[index] - first[index])
        };
        let across = change([column ^ 1, row], column & 1 == 1);
        let down = change([column, row ^ 1], row & 1 == 1);
        Interpolated { value, across, down }
    }

    fn new(corners: [&ClipCorner<R, V>; 3], picture: [usize; 2], culled: Option<Winding>) -> Option<Self> {
        if corners.iter().any(|(clip, _)| !(clip[3] > R::zero() && clip.0.iter().all(|number| number.is_finite()))) {
            return None;
        }
        let places = corners.map(|(clip, _)| grid::snap(clip, picture));
        let area = grid::doubled_area(places);
        let winding = Winding::of_area(area)?;
        let bounds = grid::bounds(places, picture);
        if culled == Some(winding) || bounds.is_empty() {
            return None;
        }
        let order = if winding == Winding::Clockwise { [0, 1, 2] } else { [0, 2, 1] };
        let [a, b, c] = order.map(|corner| places[corner]);
        let corners = order.map(|corner| corners[corner]);
        let nearest = corners.iter().fold(R::infinity(), |nearest, (clip, _)| nearest.min(clip[3]));
        Some(Self {
            edges: [Edge::new(b, c), Edge::new(c, a), Edge::new(a, b)],
            bounds,
            per_area: R::one() / R::of_integer(area.abs()),
            depths: corners.map(|(clip, _)| (clip[2] / clip[3]).max(R::zero()).min(R::one())),
            nearness: corners.map(|(clip, _)| nearest / clip[3]),
            varyings: corners.map(|(_, varyings)| *varyings),
        })
    }

    /// How much of each corner is in a pixel's middle: exact, and together the same everywhere.
    fn shares(&self, [column, row]: [i64; 2]) -> [i64; 3] {
        self.edges.each_ref().map(|edge| edge.at(column, row))
    }

    fn depth(&self, shares: [i64; 3]) -> R {
        let [a, b, c] = self.depths;
        let [share_a, share_b, share_c] = shares.map(R::of_integer);
        let depth = (a * share_a + b * share_b + c * share_c) * self.per_area;
        // Rounding may leave what is between the corners. None of this is ever no number, so that no `min` has to look
        // for it.
        let least = |a, b| if a < b { a } else { b };
        let greatest = |a, b| if a > b { a } else { b };
        least(greatest(depth, least(least(a, b), c)), greatest(greatest(a, b), c))
    }

    /// What the second and the third corner's numbers count for at a pixel's middle, in perspective; none where that is
    /// behind the camera.
    fn weights(&self, place: [i64; 2]) -> Option<[R; 2]> {
        let shares = self.shares(place);
        let weights: [R; 3] = from_fn(|corner| R::of_integer(shares[corner]) * self.nearness[corner]);
        let sum = weights[0] + weights[1] + weights[2];
        (sum > R::zero()).then(|| [weights[1] / sum, weights[2] / sum])
    }

    /// The same without perspective: for a pixel at the edge between corners so far away that one over their w is 0.
    fn flat_weights(&self, place: [i64; 2]) -> [R; 2] {
        let [_, second, third] = self.shares(place);
        [second, third].map(|share| R::of_integer(share) * self.per_area)
    }

    /// Differences from one corner leave a number exact that is the same at all of them.
    fn blend(&self, [second, third]: [R; 2]) -> [R; V] {
        let [a, b, c] = &self.varyings;
        from_fn(|index| a[index] + (b[index] - a[index]) * second + (c[index] - a[index]) * third)
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests;
