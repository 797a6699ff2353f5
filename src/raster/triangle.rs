//! Triangle setup, rasterisation and interpolation.

mod clip;
mod edge;

use std::array::from_fn;

pub use self::clip::NearPlane;
use self::clip::{ClipCorner, Overlap};
use self::edge::Edge;
use super::grid::{self, MAX_PICTURE_SIZE, Winding};
use super::{PixelBounds, Real, Vector4};

/// A triangle set up for a picture of some size, with `V` varyings.
///
/// It covers exactly the pixels that it covers on a device: corners are snapped to a 256th of a pixel, and a pixel is
/// covered if its centre is inside, or on a top or left edge. Coverage is computed in exact integers, so triangles with
/// a common edge leave no gap between them and overlap in no pixel.
#[derive(Clone, Debug)]
pub struct Triangle<R, const V: usize> {
    /// Clockwise in the picture; edge `i` is opposite corner `i`.
    edges: [Edge; 3],
    bounds: PixelBounds,
    /// 1 ÷ twice the area in square steps.
    inverse_area: R,
    /// The corners' depths: from 0 to 1, or more if the near plane clamps.
    depths: [R; 3],
    /// The corners' 1 ÷ w, times the least w: that of the nearest corner is 1.
    inverse_w: [R; 3],
    /// The corners' varyings.
    varyings: [[R; V]; 3],
}

/// Interpolated varyings at a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interpolated<R, const V: usize> {
    /// The values at the pixel's centre.
    pub value: [R; V],
    /// The derivatives `dpdx`: the changes to the next column.
    pub dpdx: [R; V],
    /// The derivatives `dpdy`: the changes to the next row.
    pub dpdy: [R; V],
}

impl<R: Real, const V: usize> Triangle<R, V> {
    /// Sets up a triangle, given by its corners' clip-space positions and varyings, for a `picture` of that width and
    /// height in pixels, and appends it to `triangles`: several triangles if it is clipped, none if it covers no pixel.
    /// `culled` is the winding to cull.
    ///
    /// Depth is reversed: visible points have 0 ≤ z ≤ w, or any z from 0 if the near plane clamps. The far plane is at
    /// z = 0, may be at infinity, and clips, as in wgpu. Nothing is appended if a corner is not finite, or if the
    /// picture is larger than [`MAX_PICTURE_SIZE`].
    pub fn set_up(
        corners: &[(Vector4<R>, [R; V]); 3],
        picture: [usize; 2],
        culled: Option<Winding>,
        near_plane: NearPlane,
        triangles: &mut Vec<Self>,
    ) {
        if picture.iter().any(|&side| side > MAX_PICTURE_SIZE) {
            return;
        }
        match clip::classify(corners, near_plane) {
            Overlap::Outside => (),
            Overlap::Inside => triangles.extend(Self::new(corners.each_ref(), picture, culled)),
            Overlap::Across => {
                let polygon = clip::clip(corners, near_plane);
                let parts = polygon.array_windows().skip(1).map(|[one, other]| [&polygon[0], one, other]);
                triangles.extend(parts.filter_map(|corners| Self::new(corners, picture, culled)));
            }
        }
    }

    /// Bounds of the pixels that the triangle covers, within the picture.
    pub fn bounds(&self) -> PixelBounds {
        self.bounds
    }

    /// Calls `visit` with the column and row, and the depth, of each covered pixel within some bounds: row by row from
    /// the top, each from left to right.
    ///
    /// Depth is z ÷ w, linear in the picture, and at most 1. It is bit-identical for any bounds, lies between the
    /// depths of the nearest and the farthest corner, and differs by at most 8 unit roundoffs (2⁻²⁴ of it each, in f32)
    /// from the exact interpolation between the snapped corners: it is the sum of each corner's depth times its
    /// barycentric weight, where no term is negative, so no error grows by cancellation. A weight is an exact integer
    /// rounded once (1 unit), the product (1), two sums (2), 1 ÷ area (2), and the product with it (1).
    pub fn rasterize(&self, within: PixelBounds, mut visit: impl FnMut([usize; 2], R)) {
        let bounds = self.bounds.intersection(within);
        for row in bounds.top..bounds.bottom {
            let all = bounds.left as i64..bounds.right as i64;
            let columns = self.edges.iter().fold(all, |columns, edge| edge.inside(row as i64, columns));
            let mut edge_values = self.edge_values([columns.start, row as i64]);
            for column in columns {
                visit([column as usize, row], self.depth(edge_values));
                edge_values = from_fn(|corner| edge_values[corner] + self.edges[corner].across);
            }
        }
    }

    /// The varyings at a pixel's centre, interpolated with perspective correction, and their derivatives.
    ///
    /// The derivatives are a device's fine derivatives: the differences between the two columns, and the two rows, of
    /// the pixel's 2 × 2 quad, which starts at an even column and row. As on a device, pixels of the quad outside the
    /// triangle are extrapolated. Where extrapolation would lead behind the camera, the derivative is 0.
    pub fn interpolate(&self, pixel: [usize; 2]) -> Interpolated<R, V> {
        let [column, row] = pixel.map(|coordinate| coordinate as i64);
        let here = self.weights([column, row]).unwrap_or_else(|| self.linear_weights([column, row]));
        let value = self.blend(here);
        let derivative = |neighbour: [i64; 2], is_second: bool| {
            let neighbour = self.weights(neighbour).map_or(value, |weights| self.blend(weights));
            let [first, second] = if is_second { [neighbour, value] } else { [value, neighbour] };
            from_fn(|index| second[index] - first[index])
        };
        let dpdx = derivative([column ^ 1, row], column & 1 == 1);
        let dpdy = derivative([column, row ^ 1], row & 1 == 1);
        Interpolated { value, dpdx, dpdy }
    }

    fn new(corners: [&ClipCorner<R, V>; 3], picture: [usize; 2], culled: Option<Winding>) -> Option<Self> {
        if corners.iter().any(|(clip, _)| !(clip[3] > R::zero() && clip.0.iter().all(|number| number.is_finite()))) {
            return None;
        }
        let points = corners.map(|(clip, _)| grid::snap(clip, picture));
        let area = grid::doubled_area(points);
        let winding = Winding::of_area(area)?;
        let bounds = PixelBounds::of_points(points, picture);
        if culled == Some(winding) || bounds.is_empty() {
            return None;
        }
        let order = if winding == Winding::Clockwise { [0, 1, 2] } else { [0, 2, 1] };
        let [a, b, c] = order.map(|corner| points[corner]);
        let corners = order.map(|corner| corners[corner]);
        let min_w = corners.iter().fold(R::infinity(), |min_w, (clip, _)| min_w.min(clip[3]));
        Some(Self {
            edges: [Edge::new(b, c), Edge::new(c, a), Edge::new(a, b)],
            bounds,
            inverse_area: R::one() / R::of_integer(area.abs()),
            depths: corners.map(|(clip, _)| (clip[2] / clip[3]).max(R::zero())),
            inverse_w: corners.map(|(clip, _)| min_w / clip[3]),
            varyings: corners.map(|(_, varyings)| *varyings),
        })
    }

    /// The edge functions at a pixel's centre: exact barycentric coordinates, whose sum is constant.
    fn edge_values(&self, [column, row]: [i64; 2]) -> [i64; 3] {
        self.edges.each_ref().map(|edge| edge.at(column, row))
    }

    fn depth(&self, edge_values: [i64; 3]) -> R {
        let [a, b, c] = self.depths;
        let [weight_a, weight_b, weight_c] = edge_values.map(R::of_integer);
        let depth = (a * weight_a + b * weight_b + c * weight_c) * self.inverse_area;
        // Clamps rounding errors. Nothing here is NaN, so these closures suffice and are faster than `min` and `max`.
        let min = |a, b| if a < b { a } else { b };
        let max = |a, b| if a > b { a } else { b };
        min(max(depth, min(min(a, b), c)), min(max(max(a, b), c), R::one()))
    }

    /// The perspective-correct weights of the second and third corners at a pixel's centre; `None` behind the camera.
    fn weights(&self, pixel: [i64; 2]) -> Option<[R; 2]> {
        let edge_values = self.edge_values(pixel);
        let weights: [R; 3] = from_fn(|corner| R::of_integer(edge_values[corner]) * self.inverse_w[corner]);
        let sum = weights[0] + weights[1] + weights[2];
        (sum > R::zero()).then(|| [weights[1] / sum, weights[2] / sum])
    }

    /// The weights without perspective, for a pixel on the edge between corners so far away that their 1 ÷ w is 0.
    fn linear_weights(&self, pixel: [i64; 2]) -> [R; 2] {
        let [_, second, third] = self.edge_values(pixel);
        [second, third].map(|value| R::of_integer(value) * self.inverse_area)
    }

    /// Interpolates differences from the first corner, so that a varying that is equal at all corners stays exact.
    fn blend(&self, [second, third]: [R; 2]) -> [R; V] {
        let [a, b, c] = &self.varyings;
        from_fn(|index| a[index] + (b[index] - a[index]) * second + (c[index] - a[index]) * third)
    }
}

#[cfg(test)]
mod tests;
