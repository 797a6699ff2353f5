//! Polygons, cut into triangles.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

/// Cutting ears off takes time that grows with the cube of the corners, in the worst case.
const MOST_CORNERS: usize = 256;

/// Cuts a polygon into `corners.len() - 2` triangles, given as indices of corners, wound as it is. False if the triangles
/// may cover more or less than the polygon: it crosses itself, or is not convex and too large.
pub(super) fn triangulate(corners: &[DVec3], triangles: &mut Vec<[usize; 3]>) -> bool {
    if corners.len() == 3 {
        triangles.push([0, 1, 2]);
        return true;
    }
    let flat = flatten(corners);
    let mut ring: Vec<usize> = (0..corners.len()).collect();
    let smallest =
        (1..flat.len() - 1).map(|corner| turn(flat[0], flat[corner], flat[corner + 1])).fold(f64::INFINITY, f64::min);
    // Seen from its first corner, a polygon that goes round more than once covers itself, though it never turns back.
    let swept: f64 = (1..flat.len() - 1).map(|corner| angle(flat[0], flat[corner], flat[corner + 1])).sum();
    let is_single = swept < TAU;
    let exact = if corners.len() <= MOST_CORNERS {
        // A fan with a triangle without area would do, but then something lies on its edge that need not.
        (is_single && smallest > 0.0) || cut_ears(&flat, &mut ring, triangles)
    } else {
        is_single && smallest >= 0.0
    };
    // Whatever is left, and everything if it is convex, is a fan around its first corner.
    triangles.extend(ring[1..].windows(2).map(|pair| [ring[0], pair[0], pair[1]]));
    exact
}

/// The angle at `from` between two others, from −π to π.
fn angle(from: DVec2, one: DVec2, other: DVec2) -> f64 {
    (one - from).angle_to(other - from)
}

/// Cuts off corners whose triangle lies inside, until three are left. False if that cannot be done.
fn cut_ears(flat: &[DVec2], ring: &mut Vec<usize>, triangles: &mut Vec<[usize; 3]>) -> bool {
    while ring.len() > 3 {
        let count = ring.len();
        let around = |place: usize| [ring[(place + count - 1) % count], ring[place], ring[(place + 1) % count]];
        // A corner on a straight edge comes last: it gives a triangle without area, unless it is an end of another's base.
        let places = || (0..count).filter(|&place| is_ear(flat, ring, around(place)));
        let has_area = |&place: &usize| {
            let [a, b, c] = around(place).map(|corner| flat[corner]);
            turn(a, b, c) > 0.0
        };
        let Some(place) = places().find(has_area).or_else(|| places().next()) else {
            return false;
        };
        triangles.push(around(place));
        ring.remove(place);
    }
    // Of a polygon that crosses itself, a triangle that turns the other way is left.
    turn(flat[ring[0]], flat[ring[1]], flat[ring[2]]) >= 0.0
}

fn is_ear(flat: &[DVec2], ring: &[usize], ear: [usize; 3]) -> bool {
    let [a, b, c] = ear.map(|corner| flat[corner]);
    // What coincides with a corner of the ear does not hinder: that is how a polygon with a hole is written.
    let is_inside = |point: DVec2| {
        turn(a, b, point) >= 0.0 && turn(b, c, point) >= 0.0 && turn(c, a, point) >= 0.0 && ![a, b, c].contains(&point)
    };
    turn(a, b, c) >= 0.0 && !ring.iter().any(|&corner| is_inside(flat[corner]))
}

/// Twice the area of a triangle; positive if it turns counter-clockwise.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Drops the axis that the polygon faces most, such that it turns counter-clockwise. Its normal is Newell's.
fn flatten(corners: &[DVec3]) -> Vec<DVec2> {
    let origin = corners[0];
    let next = corners.iter().cycle().skip(1);
    let normal: DVec3 = corners.iter().zip(next).map(|(&from, &to)| (from - origin).cross(to - origin)).sum();
    let size = normal.abs();
    let drop = move |point: DVec3| {
        if size.x >= size.y && size.x >= size.z {
            DVec2::new(point.y, point.z * normal.x.signum())
        } else if size.y >= size.z {
            DVec2::new(point.z, point.x * normal.y.signum())
        } else {
            DVec2::new(point.x, point.y * normal.z.signum())
        }
    };
    corners.iter().map(|&corner| drop(corner - origin)).collect()
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    fn area(corners: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
        let size = |&[a, b, c]: &[usize; 3]| (corners[b] - corners[a]).cross(corners[c] - corners[a]).length() / 2.0;
        triangles.iter().map(size).sum()
    }

    #[test]
    fn a_polygon_that_is_not_convex_is_covered_exactly_from_every_side_and_start() {
        let comb = [[0., 0.], [6., 0.], [6., 4.], [5., 4.], [5., 1.], [4., 1.], [4., 4.], [3., 4.], [3., 1.], [0., 1.]];
        for axes in [[0, 1, 2], [1, 2, 0], [2, 0, 1]] {
            for reversed in [false, true] {
                for start in 0..comb.len() {
                    let mut corners = comb.map(|[x, y]| {
                        let mut place = [0.0; 3];
                        (place[axes[0]], place[axes[1]], place[axes[2]]) = (x, y, 0.25 * x + 7.0);
                        DVec3::from(place)
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
    fn a_polygon_that_crosses_itself_is_said_to() {
        let bow = [DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.0, 2.0, 0.0)];
        let mut triangles = Vec::new();
        assert!(!triangulate(&bow, &mut triangles));
        assert_eq!(triangles.len(), 2);
    }

    #[test]
    fn a_polygon_that_goes_round_more_than_once_is_said_to() {
        let around = |degrees: f64| DVec3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0);
        let mut spiral = vec![DVec3::ZERO];
        spiral.extend([0.0, 100.0, 200.0, 300.0, 400.0, 500.0].map(around));
        let mut triangles = Vec::new();
        assert!(!triangulate(&spiral, &mut triangles));
        assert_eq!(triangles.len(), 5);
    }

    #[test]
    fn a_polygon_without_area_crosses_nothing() {
        let line = [0.0, 1.0, 2.0, 3.0].map(|x| DVec3::new(x, 0.0, 0.0));
        let mut triangles = Vec::new();
        assert!(triangulate(&line, &mut triangles));
        assert_eq!(triangles.len(), 2);
    }

    #[test]
    fn what_is_no_number_hangs_nothing() {
        let mut triangles = Vec::new();
        triangulate(&[DVec3::NAN; 9], &mut triangles);
        assert_eq!(triangles.len(), 7);
    }
}
