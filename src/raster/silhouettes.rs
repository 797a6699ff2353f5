//! Projected convex parts, prepared for drawing into a coarse depth buffer.

use std::ops::Range;

use glam::DVec2;

/// Convex polygons in the picture with bounds of their nearness: the lines of their edges and the planes of their
/// faces, in one array each for all silhouettes.
///
/// Nearness is any measure that grows towards the camera and is linear in the picture for a flat face, as 1 ÷ depth is
/// in perspective. Points are in pixels, x to the right and y down.
#[derive(Clone, Debug, Default)]
pub struct Silhouettes {
    shapes: Vec<Shape>,
    /// A point is inside if `x · [0] + y · [1] + [2] ≥ 0`; `[3]` is 1 ÷ `[0]`.
    lines: Vec<[f64; 4]>,
    /// The nearness is `x · [0] + y · [1] + [2]`.
    planes: Vec<[f64; 3]>,
    /// Memory reused by [`Silhouettes::add`].
    corners: Vec<DVec2>,
    hull: Vec<DVec2>,
}

/// A silhouette, as ranges of the arrays.
#[derive(Clone, Debug)]
struct Shape {
    lines: Range<usize>,
    planes: Range<usize>,
    /// The upper left and lower right corners of its bounding rectangle.
    bounds: [DVec2; 2],
    /// Nothing is covered where all planes are nearer than this: the near plane opens the part there.
    opening_nearness: f64,
    /// No point is nearer than this.
    max_nearness: f64,
}

/// A silhouette, for drawing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Silhouette<'a> {
    pub(super) lines: &'a [[f64; 4]],
    pub(super) planes: &'a [[f64; 3]],
    /// The least and greatest x.
    pub(super) width: [f64; 2],
    pub(super) opening_nearness: f64,
    pub(super) max_nearness: f64,
}

impl Silhouettes {
    /// Removes all silhouettes, and keeps the memory.
    pub fn clear(&mut self) {
        self.shapes.clear();
        self.lines.clear();
        self.planes.clear();
    }

    /// The number of silhouettes.
    pub fn len(&self) -> usize {
        self.shapes.len()
    }

    /// Adds the convex hull of `corners`, shrunk by `margin` pixels. At each point its nearness is the least of those
    /// of `planes`. A plane is its change per pixel to the right, its change per pixel down, and its value at the
    /// picture's origin. Where all planes are nearer than `opening_nearness`, nothing is covered. Nothing is nearer
    /// than `max_nearness`.
    ///
    /// Silhouettes without area or planes, or with numbers that are not finite, are ignored.
    pub fn add(
        &mut self,
        corners: impl IntoIterator<Item = DVec2>,
        margin: f64,
        planes: impl IntoIterator<Item = [f64; 3]>,
        [opening_nearness, max_nearness]: [f64; 2],
    ) {
        self.corners.clear();
        self.corners.extend(corners);
        let [first_line, first_plane] = [self.lines.len(), self.planes.len()];
        self.planes.extend(planes);
        convex_hull(&mut self.corners, &mut self.hull);
        let mut bounds = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        for (&from, &to) in self.hull.iter().zip(self.hull.iter().cycle().skip(1)) {
            let inwards = (to - from).perp().normalize();
            self.lines.push([inwards.x, inwards.y, -inwards.dot(from) - margin, 1.0 / inwards.x]);
            bounds = [bounds[0].min(from), bounds[1].max(from)];
        }
        let offsets = self.lines[first_line..].iter().map(|line| &line[2]);
        let numbers = offsets.chain(self.planes[first_plane..].iter().flatten());
        let is_finite = numbers.fold(0.0, |sum: f64, number| sum + number.abs()).is_finite() && margin >= 0.0;
        if self.hull.len() < 3 || first_plane == self.planes.len() || !is_finite {
            self.lines.truncate(first_line);
            self.planes.truncate(first_plane);
            return;
        }
        let (lines, planes) = (first_line..self.lines.len(), first_plane..self.planes.len());
        self.shapes.push(Shape { lines, planes, bounds, opening_nearness, max_nearness });
    }

    /// The silhouettes that may intersect the rows between two heights.
    pub(super) fn between(&self, low: f64, high: f64) -> impl Iterator<Item = Silhouette<'_>> {
        let is_between = move |shape: &&Shape| shape.bounds[0].y < high && shape.bounds[1].y > low;
        self.shapes.iter().filter(is_between).map(|shape| Silhouette {
            lines: &self.lines[shape.lines.clone()],
            planes: &self.planes[shape.planes.clone()],
            width: shape.bounds.map(|corner| corner.x),
            opening_nearness: shape.opening_nearness,
            max_nearness: shape.max_nearness,
        })
    }
}

/// The convex hull, counter-clockwise with y up (Andrew's monotone chain, 1979).
///
/// Rounding may omit a corner that almost lies between its neighbours, or keep one just inside the hull. In either
/// case, a point inside the lines of all edges is inside the polygon.
fn convex_hull(corners: &mut Vec<DVec2>, hull: &mut Vec<DVec2>) {
    corners.sort_unstable_by(|one, other| one.x.total_cmp(&other.x).then(one.y.total_cmp(&other.y)));
    corners.dedup();
    hull.clear();
    let turns_left = |a: DVec2, b: DVec2, c: DVec2| (b - a).perp_dot(c - a) > 0.0;
    for is_upper in [false, true] {
        let start = hull.len();
        let mut visit = |corner: DVec2| {
            while hull.len() >= start + 2 && !turns_left(hull[hull.len() - 2], hull[hull.len() - 1], corner) {
                hull.pop();
            }
            hull.push(corner);
        };
        if is_upper {
            corners.iter().rev().for_each(|&corner| visit(corner));
        } else {
            corners.iter().for_each(|&corner| visit(corner));
        }
        // The last corner is the first of the other chain.
        hull.pop();
    }
}
