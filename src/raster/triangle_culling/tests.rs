use fastrand::Rng;
use glam::{DQuat, DVec3};
use proptest::prelude::*;

use super::*;
use crate::raster::grid::{HALF_PIXEL, STEPS_PER_PIXEL};
use crate::raster::{NearPlane, PixelBounds, Real, Triangle, Vector};

const PICTURE: [usize; 2] = [1024, 512];
const WINDINGS: [Option<Winding>; 3] = [None, Some(Winding::Clockwise), Some(Winding::CounterClockwise)];

proptest! {
    #[test]
    fn a_culled_triangle_covers_no_pixel(
        corners in prop::collection::vec(any_corner(), 3..24),
        indices in prop::collection::vec(prop::array::uniform3(0..24_u32), 1..40),
        mirrored: bool,
    ) {
        let sign = if mirrored { -1.0 } else { 1.0 };
        let clip: Vec<_> = corners.iter().map(|&Vector([x, y, z, w])| Vector([x * sign, y, z, w])).collect();
        let triangles: Vec<_> = indices.iter().map(|corners| corners.map(|corner| corner % clip.len() as u32)).collect();
        for culled in WINDINGS {
            let (kept, counts) = cull(&clip, &triangles, culled);
            let mut next = kept.as_chunks::<3>().0.iter().peekable();
            let mut culled_count = 0;
            for triangle in &triangles {
                if next.next_if_eq(&triangle).is_none() {
                    culled_count += 1;
                    let corners = triangle.map(|index| clip[index as usize]);
                    prop_assert!(!covers_any::<f64>(corners, culled), "{:?}", corners);
                    prop_assert!(!covers_any::<f32>(corners, culled), "{:?}", corners);
                }
            }
            prop_assert_eq!((culled_count, triangles.len()), (counts.culled(), counts.triangles));
        }
    }

    #[test]
    fn a_triangle_that_is_not_finite_is_kept(
        number in prop::sample::select(vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY]),
        axis in 0..4_usize,
    ) {
        let mut corners = [Vector([-9.0, 0.0, 0.5, 1.0]); 3];
        corners[1].0[axis] = number;
        for culled in WINDINGS {
            prop_assert_eq!(cull(&corners, &[[0, 1, 2], [1, 1, 1]], culled).1.culled(), 0);
        }
    }
}

/// A corner is outside a plane only by more than a 4096th of |x| + |y| + |z| + |w|, whichever of them is the largest.
#[test]
fn a_triangle_is_off_screen_if_it_is_outside_by_more_than_the_tolerance() {
    // The axis of each plane, and the sign with which a corner's distance from it is w − sign × coordinate. Where the
    // sign is 0, it is the far plane, and the distance is z.
    for (axis, sign) in [(2, 1.0), (2, 0.0), (0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)] {
        let others = [0, 1, 2].into_iter().filter(|other| *other != axis);
        for largest in others.chain([3]) {
            for (share, is_culled) in [(0.9, false), (1.1, true)] {
                let w = if largest == 3 { 1000.0 } else { 1.0 };
                let other = if largest == 3 { 0.0 } else { 1000.0 };
                // How far outside: `share` of the tolerance, of whose magnitudes it is a part.
                let magnitudes = w + other + if sign == 0.0 { 0.0 } else { w };
                let outside = share * magnitudes / (4096.0 - share);
                // Spread along another axis, so that no other plane has all three outside.
                let (aside, along) = if largest == 3 { ((axis + 1) % 3, 1.0) } else { (largest, other) };
                let corners = [along, -along, along / 2.0].map(|coordinate| {
                    let mut corner = [0.0, 0.0, 0.0, w];
                    corner[aside] = coordinate;
                    corner[axis] = if sign == 0.0 { -outside } else { sign * (w + outside) };
                    Vector(corner)
                });
                let (_, counts) = cull(&corners, &[[0, 1, 2]], None);
                assert_eq!(counts.off_screen == 1, is_culled, "axis {axis}, sign {sign}, largest {largest}, {share}");
            }
        }
    }
}

#[test]
fn counts_add_up_by_reason() {
    let one = CulledTriangles { triangles: 50, degenerate: 1, off_screen: 2, back_facing: 3, zero_size: 4 };
    let mut sum = CulledTriangles { triangles: 70, degenerate: 5, off_screen: 6, back_facing: 7, zero_size: 8 };
    sum += one;
    let expected = CulledTriangles { triangles: 120, degenerate: 6, off_screen: 8, back_facing: 10, zero_size: 12 };
    assert_eq!(sum, expected);
    assert_eq!((sum.culled(), sum.share()), (36, 0.3));
}

/// The expected result tries all ways to move the corners by a step along each axis, in i128.
#[test]
fn no_sliver_that_a_device_may_draw_is_culled() {
    let slivers = 400_000;
    let mut random = Rng::with_seed(7);
    let mut counts = CulledTriangles::default();
    for _ in 0..slivers {
        let points = sliver(&mut random);
        let clip = points.map(corner_at);
        let (kept, count) = cull(&clip, &[[0, 1, 2]], Some(Winding::Clockwise));
        counts += count;
        if kept.is_empty() {
            let moved = (0..64).map(|moves: i64| {
                [0, 1, 2]
                    .map(|corner| [0, 1].map(|axis| points[corner][axis] + (moves >> (2 * corner + axis) & 1) * 2 - 1))
            });
            let is_back = moved.clone().all(|points| exact_area(points) > 0);
            let [a, b, c] = points;
            assert!(is_back || has_no_center(points) || a == b || b == c || c == a, "{points:?}");
        }
    }
    // Each outcome occurs often enough to test it.
    let each = [counts.back_facing, counts.zero_size, slivers - counts.culled()];
    assert!(each.iter().all(|&count| count > slivers / 100), "{counts:?}");
}

#[test]
fn each_reason_is_counted() {
    let points = [[40, 40], [40, 80], [80, 40], [42, 41], [42, 44], [44, 41]];
    let mut clip: Vec<_> =
        points.map(|point| corner_at(point.map(|coordinate| coordinate * STEPS_PER_PIXEL / 2))).into();
    clip.extend([[3.0, 0.0, 0.5, 1.0], [9.0, 0.3, 0.5, 1.0], [2.0, -5.0, 0.5, 1.0]].map(Vector));
    // Next to the camera plane, and behind it.
    clip.extend([[0.0, 0.0, 0.5, 0.1], [1.0, 0.0, 0.5, -1.0], [0.0, 1.0, 0.5, -2.0]].map(Vector));
    clip.extend([[600, 600], [610, 603], [605, 700]].map(corner_at));
    let triangles = [
        [0, 1, 2],
        [0, 2, 1],
        [0, 0, 2],
        [0, 2, 2],
        [0, 2, 0],
        [3, 4, 5],
        [6, 7, 8],
        [9, 10, 11],
        [12, 14, 13],
        [0, 1, 10],
        [0, 1, 99],
    ];
    let (kept, counts) = cull(&clip, &triangles, Some(Winding::Clockwise));
    let expected = CulledTriangles { triangles: 11, degenerate: 3, off_screen: 2, back_facing: 1, zero_size: 1 };
    assert_eq!(counts, expected);
    assert_eq!(kept, [[0, 1, 2], [3, 4, 5], [0, 1, 10], [0, 1, 99]].as_flattened());
    assert_eq!((counts.culled(), counts.share()), (7, 7.0 / 11.0));
    assert_eq!(cull(&clip, &triangles, None).1.back_facing, 0);
    assert_eq!(CulledTriangles::default().share(), 0.0);
}

#[test]
fn a_triangle_that_a_device_may_clip_is_kept() {
    let back_facing = [[0.0, 0.0, 0.5, 1.0], [0.0, 0.5, 0.4, 1.0], [0.5, 0.0, 0.3, 1.0]];
    let count = |corner: [f64; 4]| {
        let clip = [Vector(back_facing[0]), Vector(back_facing[1]), Vector(corner)];
        cull(&clip, &[[0, 1, 2]], Some(Winding::Clockwise)).1.back_facing
    };
    assert_eq!(count(back_facing[2]), 1);
    for [x, y, z, w] in [[0.5, 0.0, 1.0, 1.0], [0.5, 0.0, 0.0, 1.0], [2.0, 0.0, 0.3, 1.0], [0.5, -2.0, 0.3, 1.0]] {
        assert_eq!(count([x, y, z, w]), 0, "{x} {y} {z} {w}");
    }
}

#[test]
fn most_invisible_triangles_of_a_sphere_are_culled() {
    // A sphere half inside the picture, 500 m away, with a far plane at infinity and with a finite one.
    let perspective = |[x, y, z]: [f64; 3]| [x * 2.0, y * 4.0, 0.05, -z];
    let orthographic = |[x, y, z]: [f64; 3]| [x * 0.004, y * 0.008, 1.0 + z * 0.001, 1.0];
    for projection in [perspective, orthographic] {
        let vertex = |ring: i32, segment: i32| {
            let turn = DQuat::from_rotation_y(f64::from(segment) * 0.1) * DQuat::from_rotation_x(f64::from(ring) * 0.1);
            turn * DVec3::NEG_Y * 100.0 + DVec3::new(250.0, 0.0, -500.0)
        };
        let points = (0..=31).flat_map(|ring| (0..=63).map(move |segment| vertex(ring, segment)));
        let clip: Vec<_> = points.map(|point| Vector(projection(point.to_array()))).collect();
        let quads = (0..31).flat_map(|ring| (0..63).map(move |segment| ring * 64 + segment));
        let triangles: Vec<_> =
            quads.flat_map(|low| [[low, low + 1, low + 64], [low + 1, low + 65, low + 64]]).collect();
        let (_, counts) = cull(&clip, &triangles, Some(Winding::Clockwise));
        let (_, turned) = cull(&clip, &triangles, Some(Winding::CounterClockwise));
        let visible = counts.triangles - counts.off_screen;
        assert_eq!(counts.off_screen, turned.off_screen);
        assert!(counts.off_screen > counts.triangles * 2 / 5, "{counts:?}");
        assert!(counts.back_facing + turned.back_facing > visible * 9 / 10, "{counts:?} {turned:?}");
    }
}

fn cull(clip: &[Vector4<f64>], triangles: &[[u32; 3]], culled: Option<Winding>) -> (Vec<u32>, CulledTriangles) {
    let mut kept = Vec::new();
    let corners: Vec<_> = clip.iter().map(|&clip| CullVertex { clip, is_accurate: true }).collect();
    let counts = cull_triangles(&corners, triangles.iter().copied(), PICTURE, culled, &mut kept);
    (kept, counts)
}

fn covers_any<R: Real>(corners: [Vector4<f64>; 3], culled: Option<Winding>) -> bool {
    let corners = corners.map(|corner| (Vector(corner.0.map(R::of)), []));
    let (mut triangles, mut covers) = (Vec::new(), false);
    Triangle::<R, 0>::set_up(&corners, PICTURE, culled, NearPlane::Clips, &mut triangles);
    for triangle in triangles {
        triangle.rasterize(PixelBounds::of_picture(PICTURE), |_, _| covers = true);
    }
    covers
}

fn exact_area(points: [GridPoint; 3]) -> i128 {
    let [a, b, c] = points.map(|point| point.map(i128::from));
    a[0] * b[1] - b[0] * a[1] + b[0] * c[1] - c[0] * b[1] + c[0] * a[1] - a[0] * c[1]
}

fn has_no_center(points: [GridPoint; 3]) -> bool {
    (0..2).any(|axis| {
        let coordinates = points.map(|point| point[axis]);
        let (low, high) = (coordinates.into_iter().min().unwrap() - 1, coordinates.into_iter().max().unwrap() + 1);
        (low..=high).all(|coordinate| coordinate.rem_euclid(STEPS_PER_PIXEL) != HALF_PIXEL)
    })
}

/// A corner exactly at a point of the grid.
fn corner_at(point: GridPoint) -> Vector4<f64> {
    let [x, y] = [0, 1].map(|axis| point[axis] as f64 / (PICTURE[axis] as f64 * STEPS_PER_PIXEL as f64 / 2.0));
    Vector([x - 1.0, 1.0 - y, 0.5, 1.0])
}

/// Corners in and around the picture: many within a few pixels, many on a line, and some behind the camera.
fn any_corner() -> impl Strategy<Value = Vector4<f64>> {
    let along = prop_oneof![
        -1.5..1.5_f64,
        -200.0..200.0_f64,
        0.1..0.108_f64,
        prop::sample::select(vec![0.0, 1.0, -1.0, 2.0, -2.0])
    ];
    let w = prop_oneof![Just(1.0), 0.01..100.0_f64, -2.0..2.0_f64];
    let depth = prop_oneof![Just(0.01), Just(0.0), Just(1.0), -0.1..1.1_f64];
    (along.clone(), along, depth, w, any::<bool>(), -3..=3_i32).prop_map(|(x, y, depth, w, on_line, off)| {
        let y = if on_line { x * 0.7 + f64::from(off) * 1e-5 } else { y };
        Vector([x * w, y * w, depth, w])
    })
}

/// Two corners up to 2000 or up to 6 steps apart, and one within a few steps of the line between them.
fn sliver(random: &mut Rng) -> [GridPoint; 3] {
    let reach = if random.bool() { 2000 } else { 6 };
    let from = PICTURE.map(|length| random.i64(0..length as i64 * STEPS_PER_PIXEL));
    let to = from.map(|along| along + random.i64(-reach..=reach));
    let share = random.i64(0..=1000);
    let off = random.i64(1..=8);
    let third = [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * share / 1000 + random.i64(-off..=off));
    [from, to, third]
}
