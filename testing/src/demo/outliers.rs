//! Outliers: triangles so far from the rest of a scene that a picture of both would show neither.

use drawloom::glam::{DVec3, Vec3};

use super::bounds::bounds;

/// A triangle is an outlier if it is farther from the bulk than this many times the bulk's size.
const MAX_RELATIVE_DISTANCE: f64 = 1000.0;

/// The share of the area at either end of an axis that may be outliers.
const TAIL: f64 = 0.1;

/// The most triangles from which the bulk is estimated.
const MAX_SAMPLES: usize = 4096;

/// Removes the triangles that are far from the bulk: from the middle four fifths of the area along each axis.
pub(super) fn remove(triangles: &mut Vec<([DVec3; 3], Vec3)>) {
    let step = triangles.len().div_ceil(MAX_SAMPLES).max(1);
    let samples: Vec<[DVec3; 3]> = triangles.iter().step_by(step).map(|(corners, _)| *corners).collect();
    let (low, high) = bulk(&samples);
    let reach = MAX_RELATIVE_DISTANCE * (high - low).max_element();
    let is_near = |point: DVec3| (point - high).max(low - point).max_element() <= reach;
    let is_bulk = |(corners, _): &([DVec3; 3], Vec3)| corners.iter().any(|&corner| is_near(corner));
    // Nothing is left if the bulk has no size that a number can represent.
    if triangles.iter().any(is_bulk) {
        triangles.retain(is_bulk);
    }
}

/// The corners of the box around the triangles that are in the middle along each axis, by their area.
fn bulk(triangles: &[[DVec3; 3]]) -> (DVec3, DVec3) {
    let area = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a).length();
    let total: f64 = triangles.iter().map(area).sum();
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for axis in 0..3 {
        let centroid = |[a, b, c]: &[DVec3; 3]| a[axis] / 3.0 + b[axis] / 3.0 + c[axis] / 3.0;
        let mut order: Vec<&[DVec3; 3]> = triangles.iter().collect();
        order.sort_by(|one, other| centroid(one).total_cmp(&centroid(other)));
        let mut passed = 0.0;
        let is_middle = |triangle: &&&[DVec3; 3]| {
            let before = passed;
            passed += area(triangle);
            passed >= TAIL * total && before <= (1.0 - TAIL) * total
        };
        let (first, last) = bounds(order.iter().filter(is_middle).flat_map(|triangle| **triangle));
        (low[axis], high[axis]) = (first[axis], last[axis]);
    }
    (low, high)
}
