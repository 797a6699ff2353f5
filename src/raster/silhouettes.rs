//! The pictures of convex parts, as a coarse depth buffer wants them.

use std::ops::Range;

use glam::DVec2;

/// Convex pieces of a picture, each with how near what it shows is at most: lines around it and planes over it, one array each
/// for all of them.
///
/// Nearness is any number that is larger for what is nearer, and linear in the picture for what is flat, as 1 ÷ depth is in
/// perspective. Places are in pixels, x to the right and y down.
#[derive(Clone, Debug, Default)]
pub struct Silhouettes {
    shapes: Vec<Shape>,
    /// What is inside is at `x · [0] + y · [1] + [2] ≥ 0`; and then 1 ÷ `[0]`.
    lines: Vec<[f64; 4]>,
    /// Nearness is `x · [0] + y · [1] + [2]`.
    planes: Vec<[f64; 3]>,
    /// Memory for what is on its way.
    corners: Vec<DVec2>,
    hull: Vec<DVec2>,
}

/// One of them.
#[derive(Clone, Debug)]
struct Shape {
    lines: Range<usize>,
    planes: Range<usize>,
    /// Its upper left and its lower right.
    around: [DVec2; 2],
    /// What is nearer than this all over a place is not there.
    nearest: f64,
    /// No place is nearer than this.
    max_nearness: f64,
}

/// One of them, as it is drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Silhouette<'a> {
    pub(super) lines: &'a [[f64; 4]],
    pub(super) planes: &'a [[f64; 3]],
    /// The lowest and highest x.
    pub(super) width: [f64; 2],
    pub(super) nearest: f64,
    pub(super) max_nearness: f64,
}

impl Silhouettes {
    /// Leaves none, and keeps the memory.
    pub fn clear(&mut self) {
        self.shapes.clear();
        self.lines.clear();
        self.planes.clear();
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.shapes.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// Adds what lies between `corners`, `margin` pixels inwards from its rim. It is as far away as the farthest of `planes`
    /// says at each place: for each the nearness at the picture's origin, last, and before it what a pixel to the right and one
    /// down add. Where all planes are nearer than `nearest`, nothing is known; and nothing is nearer than `most`.
    ///
    /// What has no area, no plane, or numbers that are not finite is left out.
    pub fn add(
        &mut self,
        corners: impl IntoIterator<Item = DVec2>,
        margin: f64,
        planes: impl IntoIterator<Item = [f64; 3]>,
        [nearest, max_nearness]: [f64; 2],
    ) {
        self.corners.clear();
        self.corners.extend(corners);
        let [first_line, first_plane] = [self.lines.len(), self.planes.len()];
        self.planes.extend(planes);
        convex_hull(&mut self.corners, &mut self.hull);
        let mut around = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        for (&from, &to) in self.hull.iter().zip(self.hull.iter().cycle().skip(1)) {
            let inwards = (to - from).perp().normalize();
            self.lines.push([inwards.x, inwards.y, -inwards.dot(from) - margin, 1.0 / inwards.x]);
            around = [around[0].min(from), around[1].max(from)];
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
        self.shapes.push(Shape { lines, planes, around, nearest, max_nearness });
    }

    /// Those of which any may be between these heights.
    pub(super) fn between(&self, low: f64, high: f64) -> impl Iterator<Item = Silhouette<'_>> {
        let is_between = move |shape: &&Shape| shape.around[0].y < high && shape.around[1].y > low;
        self.shapes.iter().filter(is_between).map(|shape| Silhouette {
            lines: &self.lines[shape.lines.clone()],
            planes: &self.planes[shape.planes.clone()],
            width: shape.around.map(|corner| corner.x),
            nearest: shape.nearest,
            max_nearness: shape.max_nearness,
        })
    }
}

/// The corners of the smallest convex polygon around all, counter-clockwise where y is up (Andrew's monotone chain, 1979).
///
/// Rounding may leave out a corner that all but lies between its neighbours, or keep one that lies just inside. What is inside of
/// all edges' lines is inside of the polygon in either case.
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
        // The last one is the other chain's first.
        hull.pop();
    }
}
