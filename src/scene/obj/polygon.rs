//! Triangulation of polygons.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

/// Ear clipping takes cubic time in the worst case, so it is limited to polygons of this many corners.
const MAX_EAR_CLIPPING_CORNERS: usize = 256;

/// A polygon with less area than this share of that of its largest part is one whose parts cancel each other.
const MIN_RELATIVE_AREA: f64 = 1e-9;

/// Triangulates a polygon into `corners.len() - 2` triangles of corner indices, with the winding of the polygon. Returns
/// false if the triangles may not cover the polygon exactly: it intersects itself, or is concave and too large.
pub(super) fn triangulate(corners: &[DVec3], triangles: &mut Vec<[usize; 3]>) -> bool {
    if corners.len() == 3 {
        triangles.push([0, 1, 2]);
        return true;
    }
    let flat = project(corners);
    let mut ring: Vec<usize> = (0..corners.len()).collect();
    let smallest = (1..flat.len() - 1)
        .map(|corner| signed_area(flat[0], flat[corner], flat[corner + 1]))
        .fold(f64::INFINITY, f64::min);
    // A polygon that winds around its first corner more than once overlaps itself, even if every corner is convex.
    let swept: f64 = (1..flat.len() - 1).map(|corner| angle(flat[0], flat[corner], flat[corner + 1])).sum();
    let is_single = swept < TAU;
    let exact = if corners.len() <= MAX_EAR_CLIPPING_CORNERS {
        // Ear clipping avoids degenerate triangles of a fan, with a corner on the edge of a triangle.
        (is_single && smallest > 0.0) || clip_ears(&flat, &mut ring, triangles)
    } else {
        is_single && smallest >= 0.0
    };
    // The rest, which is the whole polygon if it is convex, becomes a fan around its first corner.
    triangles.extend(ring[1..].windows(2).map(|pair| [ring[0], pair[0], pair[1]]));
    exact
}

/// The angle at `from` between two other points, from −π to π.
fn angle(from: DVec2, one: DVec2, other: DVec2) -> f64 {
    (one - from).angle_to(other - from)
}

/// Ear clipping: removes corners whose triangle is inside the polygon, until three are left. Returns false if it finds none.
fn clip_ears(flat: &[DVec2], ring: &mut Vec<usize>, triangles: &mut Vec<[usize; 3]>) -> bool {
    while ring.len() > 3 {
        let count = ring.len();
        let triangle_at = |index: usize| [ring[(index + count - 1) % count], ring[index], ring[(index + 1) % count]];
        // Ears with an area come first: a corner on a straight edge gives a degenerate triangle until a neighbour is clipped.
        let ears = || (0..count).filter(|&index| is_ear(flat, ring, triangle_at(index)));
        let has_area = |&index: &usize| {
            let [a, b, c] = triangle_at(index).map(|corner| flat[corner]);
            signed_area(a, b, c) > 0.0
        };
        let Some(index) = ears().find(has_area).or_else(|| ears().next()) else {
            return false;
        };
        triangles.push(triangle_at(index));
        ring.remove(index);
    }
    // If the polygon intersects itself, the remaining triangle has the opposite winding.
    signed_area(flat[ring[0]], flat[ring[1]], flat[ring[2]]) >= 0.0
}

fn is_ear(flat: &[DVec2], ring: &[usize], ear: [usize; 3]) -> bool {
    let [a, b, c] = ear.map(|corner| flat[corner]);
    // Points that coincide with a corner of the ear do not count: polygons with holes repeat corners.
    let is_inside = |point: DVec2| {
        signed_area(a, b, point) >= 0.0
            && signed_area(b, c, point) >= 0.0
            && signed_area(c, a, point) >= 0.0
            && ![a, b, c].contains(&point)
    };
    signed_area(a, b, c) >= 0.0 && !ring.iter().any(|&corner| is_inside(flat[corner]))
}

/// Twice the signed area of a triangle, which is positive if it is counter-clockwise.
fn signed_area(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Projects the polygon along the major axis of its normal (Newell's method), such that it is counter-clockwise.
fn project(corners: &[DVec3]) -> Vec<DVec2> {
    let origin = corners[0];
    let next = corners.iter().cycle().skip(1);
    let areas = corners.iter().zip(next).map(|(&from, &to)| (from - origin).cross(to - origin));
    let sum: DVec3 = areas.clone().sum();
    // The parts of a polygon that intersects itself may cancel each other, and say nothing of its plane then. One part does.
    let largest = areas.fold(DVec3::ZERO, |one, other| if other.length() > one.length() { other } else { one });
    let normal = if sum.length() > MIN_RELATIVE_AREA * largest.length() { sum } else { largest };
    let size = normal.abs();
    let to_plane = move |point: DVec3| {
        if size.x >= size.y && size.x >= size.z {
            DVec2::new(point.y, point.z * normal.x.signum())
        } else if size.y >= size.z {
            DVec2::new(point.z, point.x * normal.y.signum())
        } else {
            DVec2::new(point.x, point.y * normal.z.signum())
        }
    };
    corners.iter().map(|&corner| to_plane(corner - origin)).collect()
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    fn area(corners: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
        let size = |&[a, b, c]: &[usize; 3]| (corners[b] - corners[a]).cross(corners[c] - corners[a]).length() / 2.0;
        triangles.iter().map(size).sum()
    }

    #[test]
    fn a_concave_polygon_is_covered_exactly_in_every_orientation() {
        let comb = [[0., 0.], [6., 0.], [6., 4.], [5., 4.], [5., 1.], [4., 1.], [4., 4.], [3., 4.], [3., 1.], [0., 1.]];
        for axes in [[0, 1, 2], [1, 2, 0], [2, 0, 1]] {
            for reversed in [false, true] {
                for start in 0..comb.len() {
                    let mut corners = comb.map(|[x, y]| {
                        let mut point = [0.0; 3];
                        (point[axes[0]], point[axes[1]], point[axes[2]]) = (x, y, 0.25 * x + 7.0);
                        DVec3::from(point)
                    });
                    corners.rotate_left(start);
                    if reversed {
                        corners.reverse();
                    }
                    let mut triangles = Vec::new();
                    assert!(triangulate(&corners, &mut triangles));
                    assert_eq!(triangles.len(), corners.len() - 2);
                    let expected = 12.0 * (1.0_f64 + 0.25 * 0.25).sqrt();
                    assert!((area(&corners, &triangles) - expected).abs() < 1e-9, "{axes:?} {reversed} {start}");
                }
            }
        }
    }

    #[test]
    fn a_self_intersecting_polygon_is_reported() {
        // The parts of the second one have the same area.
        for height in [2.0, 1.0] {
            let bow = [DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.0, height, 0.0)];
            let turned = bow.map(|point| glam::DQuat::from_rotation_x(0.7) * glam::DQuat::from_rotation_y(0.4) * point);
            for bow in [bow, turned] {
                let mut triangles = Vec::new();
                assert!(!triangulate(&bow, &mut triangles));
                assert_eq!(triangles.len(), 2);
            }
        }
    }

    #[test]
    fn a_polygon_that_winds_twice_is_reported() {
        let around = |degrees: f64| DVec3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0);
        let mut spiral = vec![DVec3::ZERO];
        spiral.extend([0.0, 100.0, 200.0, 300.0, 400.0, 500.0].map(around));
        let mut triangles = Vec::new();
        assert!(!triangulate(&spiral, &mut triangles));
        assert_eq!(triangles.len(), 5);
    }

    #[test]
    fn a_degenerate_polygon_does_not_intersect_itself() {
        let line = [0.0, 1.0, 2.0, 3.0].map(|x| DVec3::new(x, 0.0, 0.0));
        let mut triangles = Vec::new();
        assert!(triangulate(&line, &mut triangles));
        assert_eq!(triangles.len(), 2);
    }

    #[test]
    fn nan_does_not_hang() {
        let mut triangles = Vec::new();
        triangulate(&[DVec3::NAN; 9], &mut triangles);
        assert_eq!(triangles.len(), 7);
    }
}
