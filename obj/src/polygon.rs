//! Triangulation of polygons.

use std::f64::consts::TAU;

use drawloom::glam::{DVec2, DVec3};

/// Ear clipping usually takes quadratic time, but cubic time in the worst case, so it is limited to polygons of this
/// many corners.
const MAX_EAR_CLIPPING_CORNERS: usize = 256;

/// A polygon with less area than this share of that of its largest part is one whose parts cancel each other.
const MIN_RELATIVE_AREA: f64 = 1e-9;

/// A corner of a large polygon may be this share of the polygon's size off its convex hull: less than 32-bit
/// coordinates resolve.
const CONVEXITY_TOLERANCE: f64 = 1e-7;

/// Triangulates a polygon into `corners.len() - 2` triangles of corner indices, with the winding of the polygon.
/// Returns false if the triangles may not cover the polygon exactly: it intersects itself, or is concave and too large.
/// Takes n log n time for n corners, if they are more than 256.
pub(crate) fn triangulate(corners: &[DVec3], triangles: &mut Vec<[usize; 3]>) -> bool {
    if corners.len() == 3 {
        triangles.push([0, 1, 2]);
        return true;
    }
    let flat = project(corners);
    if corners.len() > MAX_EAR_CLIPPING_CORNERS && is_convex(&flat) {
        halve(0, corners.len() - 1, triangles);
        return true;
    }
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

/// Triangulates a convex polygon: the triangle of the first, the last and the middle corner, and so on beside it. In a
/// fan of as many corners all triangles but a few would be thin, and all would meet in one corner.
fn halve(first: usize, last: usize, triangles: &mut Vec<[usize; 3]>) {
    if last - first < 2 {
        return;
    }
    let middle = first.midpoint(last);
    triangles.push([first, middle, last]);
    halve(first, middle, triangles);
    halve(middle, last, triangles);
}

/// Whether the polygon is its convex hull, but for the rounding of its corners. The hull is as large as the polygon
/// only if its corners are corners of the polygon in the same order, and the others are close to the line between their
/// neighbours on the hull.
fn is_convex(flat: &[DVec2]) -> bool {
    let hull = convex_hull(flat);
    let next = |at: usize| hull[(at + 1) % hull.len()];
    let descents = (0..hull.len()).filter(|&at| hull[at] >= next(at)).count();
    if hull.len() < 3 || descents != 1 {
        return false;
    }
    let (low, high) = flat.iter().fold((flat[0], flat[0]), |(low, high), &point| (low.min(point), high.max(point)));
    let tolerance = CONVEXITY_TOLERANCE * (high - low).max_element();
    (0..hull.len()).all(|at| {
        let (from, to) = (hull[at], next(at));
        let (start, along) = (flat[from], (flat[to] - flat[from]).normalize_or_zero());
        let steps = (to + flat.len() - from) % flat.len();
        (1..steps).all(|step| along.perp_dot(flat[(from + step) % flat.len()] - start).abs() <= tolerance)
    })
}

/// The corners of the convex hull, counter-clockwise (Andrew's monotone chain). Empty if a coordinate is not finite.
fn convex_hull(points: &[DVec2]) -> Vec<usize> {
    if !points.iter().all(|point| point.is_finite()) {
        return Vec::new();
    }
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_unstable_by(|&one, &other| {
        let (one, other) = (points[one], points[other]);
        one.x.total_cmp(&other.x).then(one.y.total_cmp(&other.y))
    });
    let mut hull: Vec<usize> = Vec::new();
    let chain = |order: &mut dyn Iterator<Item = usize>, hull: &mut Vec<usize>| {
        let start = hull.len();
        for point in order {
            while let [.., before, last] = hull[start..] {
                if signed_area(points[before], points[last], points[point]) > 0.0 {
                    break;
                }
                hull.pop();
            }
            hull.push(point);
        }
        // The last point begins the other chain.
        hull.pop();
    };
    chain(&mut order.iter().copied(), &mut hull);
    chain(&mut order.iter().rev().copied(), &mut hull);
    hull
}

/// The angle at `from` between two other points, from −π to π.
fn angle(from: DVec2, one: DVec2, other: DVec2) -> f64 {
    (one - from).angle_to(other - from)
}

/// Ear clipping: removes corners whose triangle is inside the polygon, until three are left. Returns false if it finds
/// none.
fn clip_ears(flat: &[DVec2], ring: &mut Vec<usize>, triangles: &mut Vec<[usize; 3]>) -> bool {
    let triangle_at = |ring: &[usize], index: usize| {
        let count = ring.len();
        [ring[(index + count - 1) % count], ring[index], ring[(index + 1) % count]]
    };
    let mut obstacles: Vec<_> = (0..ring.len()).map(|index| obstacle(flat, ring, triangle_at(ring, index))).collect();
    while ring.len() > 3 {
        // Ears with an area come first: a corner on a straight edge gives a degenerate triangle until a neighbour is
        // clipped.
        let ears = || (0..ring.len()).filter(|&index| obstacles[ring[index]].is_none());
        let has_area = |&index: &usize| {
            let [a, b, c] = triangle_at(ring, index).map(|corner| flat[corner]);
            signed_area(a, b, c) > 0.0
        };
        let Some(index) = ears().find(has_area).or_else(|| ears().next()) else {
            return false;
        };
        let [before, clipped, after] = triangle_at(ring, index);
        triangles.push([before, clipped, after]);
        ring.remove(index);
        // No other corner's triangle has changed, and its obstacle is still there.
        for at in 0..ring.len() {
            let corner = ring[at];
            if corner == before || corner == after || obstacles[corner] == Some(clipped) {
                obstacles[corner] = obstacle(flat, ring, triangle_at(ring, at));
            }
        }
    }
    // If the polygon intersects itself, the remaining triangle has the opposite winding.
    signed_area(flat[ring[0]], flat[ring[1]], flat[ring[2]]) >= 0.0
}

/// The corner that keeps the middle corner of a triangle from being an ear: one inside the triangle, or itself if it is
/// reflex. `None` for an ear.
fn obstacle(flat: &[DVec2], ring: &[usize], triangle: [usize; 3]) -> Option<usize> {
    let [a, b, c] = triangle.map(|corner| flat[corner]);
    // Points that coincide with a corner of the triangle do not count: polygons with holes repeat corners.
    let is_inside = |point: DVec2| {
        signed_area(a, b, point) >= 0.0
            && signed_area(b, c, point) >= 0.0
            && signed_area(c, a, point) >= 0.0
            && ![a, b, c].contains(&point)
    };
    if signed_area(a, b, c) >= 0.0 {
        ring.iter().copied().find(|&corner| is_inside(flat[corner]))
    } else {
        Some(triangle[1])
    }
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
    // The parts of a polygon that intersects itself may cancel each other, and say nothing of its plane then. One part
    // does.
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

#[cfg(test)]
mod tests {
    use drawloom::glam::DQuat;
    use proptest::prelude::*;

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

    proptest! {
        /// The polygon is a star: no ray from its centre leaves it more than once.
        #[test]
        fn triangles_cover_a_star_once(radii in prop::collection::vec(0.05..1.0_f64, 4..=MAX_EAR_CLIPPING_CORNERS)) {
            let count = radii.len();
            let corner = |(index, radius): (usize, f64)| {
                let (sine, cosine) = (index as f64 / count as f64 * TAU).sin_cos();
                DVec3::new(radius * cosine, radius * sine, 3.0)
            };
            let corners: Vec<_> = radii.into_iter().enumerate().map(corner).collect();
            let mut triangles = Vec::new();
            prop_assert!(triangulate(&corners, &mut triangles));
            prop_assert_eq!(triangles.len(), count - 2);
            let sizes = triangles.iter().map(|&[a, b, c]| (corners[b] - corners[a]).cross(corners[c] - corners[a]).z / 2.0);
            prop_assert!(sizes.clone().all(|size| size >= 0.0));
            let expected = (0..count).map(|at| corners[at].cross(corners[(at + 1) % count]).z / 2.0).sum::<f64>();
            prop_assert!((sizes.sum::<f64>() - expected).abs() < 1e-9);
        }
    }

    /// Ear clipping that looks at all corners each time.
    fn clip_ears_naively(flat: &[DVec2]) -> (bool, Vec<[usize; 3]>) {
        let (mut ring, mut triangles): (Vec<usize>, Vec<_>) = ((0..flat.len()).collect(), Vec::new());
        while ring.len() > 3 {
            let at = |index: usize| {
                [ring[(index + ring.len() - 1) % ring.len()], ring[index], ring[(index + 1) % ring.len()]]
            };
            let sides = |[a, b, c]: [usize; 3], point: DVec2| {
                [(a, b), (b, c), (c, a)].map(|(from, to)| (flat[to] - flat[from]).perp_dot(point - flat[from]))
            };
            let is_ear = |&index: &usize| {
                let corners = at(index);
                let is_inside = |point: &usize| {
                    sides(corners, flat[*point]).iter().all(|side| *side >= 0.0)
                        && corners.iter().all(|corner| flat[*corner] != flat[*point])
                };
                sides(corners, flat[corners[2]])[0] >= 0.0 && !ring.iter().any(is_inside)
            };
            let ears: Vec<_> = (0..ring.len()).filter(is_ear).collect();
            let has_area = |index: &&usize| sides(at(**index), flat[at(**index)[2]])[0] > 0.0;
            let Some(&ear) = ears.iter().find(has_area).or(ears.first()) else { return (false, triangles) };
            triangles.push(at(ear));
            ring.remove(ear);
        }
        ((flat[ring[1]] - flat[ring[0]]).perp_dot(flat[ring[2]] - flat[ring[0]]) >= 0.0, triangles)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        /// Corners that coincide or lie on an edge, and edges that cross, are frequent.
        #[test]
        fn ears_are_those_of_a_search_among_all_corners(corners in prop::collection::vec(prop::array::uniform2(0..5_i32), 4..14)) {
            let flat: Vec<_> = corners.iter().map(|[x, y]| DVec2::new(f64::from(*x), f64::from(*y))).collect();
            let (mut ring, mut triangles) = ((0..flat.len()).collect(), Vec::new());
            let is_exact = clip_ears(&flat, &mut ring, &mut triangles);
            prop_assert_eq!((is_exact, triangles), clip_ears_naively(&flat));
        }
    }

    #[test]
    fn a_self_intersecting_polygon_is_reported() {
        // The parts of the second one have the same area.
        for height in [2.0, 1.0] {
            let bow = [DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.0, height, 0.0)];
            let turned = bow.map(|point| DQuat::from_rotation_x(0.7) * DQuat::from_rotation_y(0.4) * point);
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

    /// A polygon around a circle of radius 1,000 around a distant point, its coordinates rounded to multiples of
    /// `step`.
    fn circle(count: usize, step: f64, mut radius: impl FnMut(usize) -> f64) -> Vec<DVec3> {
        let corner = |index: usize| {
            let (sine, cosine) = (index as f64 / count as f64 * TAU).sin_cos();
            let (x, y) = (3000.0 + radius(index) * cosine, 500.0 + radius(index) * sine);
            DVec3::new((x / step).round() * step, 7.0, (y / step).round() * step)
        };
        (0..count).map(corner).collect()
    }

    #[test]
    fn a_large_convex_polygon_has_no_corner_in_most_triangles() {
        for step in [1e-12, 1e-5] {
            for reversed in [false, true] {
                let mut corners = circle(100_000, step, |_| 1000.0);
                corners.rotate_left(12_345);
                if reversed {
                    corners.reverse();
                }
                let mut triangles = Vec::new();
                assert!(triangulate(&corners, &mut triangles), "{step}");
                assert_eq!(triangles.len(), corners.len() - 2);
                let expected = 1e6 * TAU / 2.0;
                assert!((area(&corners, &triangles) / expected - 1.0).abs() < 1e-6, "{step}");
                let mut uses = vec![0; corners.len()];
                triangles.iter().flatten().for_each(|&corner| uses[corner] += 1);
                assert!(*uses.iter().max().unwrap() < 64);
                let normal = |&[a, b, c]: &[usize; 3]| (corners[b] - corners[a]).cross(corners[c] - corners[a]).y;
                let winding = if reversed { 1.0 } else { -1.0 };
                assert!(triangles.iter().all(|triangle| normal(triangle) * winding > -step.max(1e-9)), "{step}");
            }
        }
    }

    #[test]
    fn a_large_polygon_that_is_not_convex_is_no_hull() {
        // A dent that is shallow at each of its corners.
        let dented = circle(100_000, 1e-12, |index| 1000.0 - 200.0 * (index as f64 / 100_000.0 * TAU * 3.0).sin());
        // Twice around, on the same corners, and on others.
        let twice = [circle(1_000, 1e-12, |_| 1000.0), circle(1_000, 1e-12, |_| 1000.0)].concat();
        let spiral = [circle(1_000, 1e-12, |_| 1000.0), circle(1_000, 1e-12, |_| 900.0)].concat();
        for corners in [dented, twice, spiral] {
            assert!(!is_convex(&project(&corners)));
        }
    }

    #[test]
    fn nan_does_not_hang() {
        let mut triangles = Vec::new();
        triangulate(&[DVec3::NAN; 9], &mut triangles);
        assert_eq!(triangles.len(), 7);
        triangulate(&[DVec3::NAN; 1000], &mut triangles);
        assert_eq!(triangles.len(), 7 + 998);
    }
}
