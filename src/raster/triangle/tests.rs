use std::collections::BTreeMap;

use glam::{DMat3, DQuat, DVec3};
use proptest::prelude::*;

use super::*;
use crate::raster::Vector;
use crate::raster::grid::{GridPoint, HALF_PIXEL, MAX_COORDINATE, STEPS_PER_PIXEL};

const PICTURE: [usize; 2] = [32, 16];

proptest! {
    #[test]
    fn coverage_equals_that_in_exact_integers(
        points in prop::array::uniform3(any_point()),
        offset in prop::array::uniform2(-0.49..0.49_f64),
        inner in any_bounds(),
    ) {
        let expected = expected_coverage(points);
        let corners = points.map(|point| {
            let (mut clip, []) = corner_at::<f64, 0>(point, [0.5, 2.0]);
            for axis in 0..2 {
                // Less than half a step from the point that it snaps to.
                clip[axis] += offset[axis] * 2.0 * 2.0 / (PICTURE[axis] as f64 * STEPS_PER_PIXEL as f64);
            }
            (clip, [])
        });
        for (culled, winding) in [(Winding::Clockwise, -1), (Winding::CounterClockwise, 1)] {
            let drawn = draw(&corners, Some(culled));
            let all: Vec<_> = drawn.keys().copied().collect();
            prop_assert_eq!(&all, &expected.iter().filter(|one| one.1 == winding).map(|one| one.0).collect::<Vec<_>>());
        }
        let drawn = draw(&corners, None);
        prop_assert_eq!(drawn.len(), expected.len());
        for triangle in set_up(&corners, None) {
            let mut pixels = Vec::new();
            triangle.rasterize(inner, |pixel, depth| {
                assert_eq!(drawn[&pixel], depth);
                pixels.push(pixel);
            });
            prop_assert_eq!(pixels.len(), drawn.keys().filter(|pixel| is_in(inner, **pixel)).count());
            prop_assert!(drawn.keys().all(|pixel| is_in(triangle.bounds(), *pixel)));
            prop_assert!(pixels.is_sorted_by_key(|[column, row]| [*row, *column]));
        }
    }

    #[test]
    fn a_closed_surface_around_the_camera_covers_every_pixel_once(
        radii in prop::collection::vec(1.0..1.7_f64, 66),
        turn in prop::array::uniform3(-9.0..9.0_f64),
        field_of_view in prop::sample::select(vec![0.001, 0.1, 1.0, 2.0, 3.1]),
    ) {
        let turn = DMat3::from_quat(DQuat::from_scaled_axis(turn.into()));
        let scale = 1.0 / (field_of_view * 0.5_f64).tan();
        let triangles = around_the_camera(&radii).map(|corners| corners.map(|corner| {
            let [x, y, z] = (turn * corner).to_array();
            [x * scale * 0.5, y * scale, 1e-5, -z]
        }));
        let triangles: Vec<_> = triangles.collect();
        prop_assert_eq!(coverage::<f64>(&triangles), vec![1; PICTURE[0] * PICTURE[1]]);
        prop_assert_eq!(coverage::<f32>(&triangles), vec![1; PICTURE[0] * PICTURE[1]]);
    }

    #[test]
    fn depth_is_interpolated_between_the_corners(
        points in prop::array::uniform3(any_point()),
        depths in prop::array::uniform3((-60.0..0.0_f64).prop_map(f64::exp2)),
    ) {
        // Rounded to f32, so that both precisions have the same corners.
        let depths = depths.map(|depth| f64::from(depth as f32));
        let double = [0, 1, 2].map(|corner| corner_at::<f64, 0>(points[corner], [depths[corner], 1.0]));
        let single = [0, 1, 2].map(|corner| corner_at::<f32, 0>(points[corner], [depths[corner], 1.0]));
        let [least, greatest] = [f64::min, f64::max].map(|pick| depths.into_iter().reduce(pick).unwrap());
        let single = draw(&single, None);
        for (pixel, depth) in draw(&double, None) {
            let weights = expected_edge_values(points, pixel).map(|weight| weight as f64);
            let sum: f64 = weights.iter().sum();
            let expected: f64 = (0..3).map(|corner| weights[corner] * depths[corner]).sum::<f64>() / sum;
            prop_assert!((depth - expected).abs() <= 16.0 * f64::EPSILON * expected, "{depth} {expected}");
            prop_assert!((least..=greatest).contains(&depth));
            let depth = f64::from(single[&pixel]);
            prop_assert!((depth - expected).abs() <= 8.0 * 2_f64.powi(-24) * expected, "{depth} {expected}");
            prop_assert!((least..=greatest).contains(&depth));
        }
    }

    #[test]
    fn varyings_are_interpolated_with_perspective_correction(
        points in prop::array::uniform3(any_point()),
        powers in prop::array::uniform3(-8..8_i32),
    ) {
        // The varyings are the clip-space position, so each pixel must find its own position.
        let corners = [0, 1, 2].map(|corner| {
            let (clip, []) = corner_at::<f64, 0>(points[corner], [2_f64.powi(-9), 2_f64.powi(powers[corner])]);
            (clip, [clip[0], clip[1], clip[3], 7.1])
        });
        for triangle in set_up(&corners, None) {
            triangle.rasterize(PixelBounds::of_picture(PICTURE), |pixel, _| {
                let Interpolated { value: [x, y, w, constant], .. } = triangle.interpolate(pixel);
                let expected = clip_of(pixel.map(|coordinate| coordinate as i64 * STEPS_PER_PIXEL + HALF_PIXEL));
                assert!((x / w - expected[0]).abs() < 1e-9 && (y / w - expected[1]).abs() < 1e-9, "{pixel:?}");
                assert_eq!(constant, 7.1);
            });
        }
    }

    /// Snapping moves corners by half a step at most, so it moves no point between them farther.
    #[test]
    fn varyings_of_clipped_triangles_are_interpolated_with_perspective_correction(
        corners in prop::array::uniform3([-3.0..3.0_f64, -3.0..3.0_f64, -2.0..3.0_f64]),
        size in prop::sample::select(vec![1.0, 0.01]),
    ) {
        let corners = corners.map(|[x, y, w]| (Vector([x * size, y * size, 0.01, w]), [x * size, y * size, w]));
        let single = corners.map(|(clip, _)| (Vector(clip.0.map(|number| number as f32)), []));
        prop_assert!(draw(&single, None).values().all(|depth| (0.0..=1.0).contains(depth)));
        for triangle in set_up(&corners, None) {
            triangle.rasterize(PixelBounds::of_picture(PICTURE), |pixel, _| {
                let [x, y, w] = triangle.interpolate(pixel).value;
                let expected = clip_of(pixel.map(|coordinate| coordinate as i64 * STEPS_PER_PIXEL + HALF_PIXEL));
                let half_step = PICTURE.map(|side| 1.0 / (side as f64 * STEPS_PER_PIXEL as f64) + 1e-9);
                assert!((x / w - expected[0]).abs() <= half_step[0] && (y / w - expected[1]).abs() <= half_step[1]);
            });
        }
    }

    #[test]
    fn derivatives_are_the_differences_within_a_quad(points in prop::array::uniform3(any_point()), slope in -5.0..5.0_f64) {
        let corners = points.map(|point| {
            let (clip, []) = corner_at::<f64, 0>(point, [0.5, 1.0]);
            (clip, [slope * clip[0], clip[1] - clip[0]])
        });
        let step = PICTURE.map(|side| 2.0 / side as f64);
        for triangle in set_up(&corners, None) {
            let area = 1.0 / triangle.inverse_area;
            triangle.rasterize(PixelBounds::of_picture(PICTURE), |pixel, _| {
                let [column, row] = pixel;
                let here = triangle.interpolate(pixel);
                let columns = [column & !1, column | 1].map(|column| triangle.interpolate([column, row]).value);
                let rows = [row & !1, row | 1].map(|row| triangle.interpolate([column, row]).value);
                for index in 0..2 {
                    assert_eq!(here.dpdx[index], columns[1][index] - columns[0][index]);
                    assert_eq!(here.dpdy[index], rows[1][index] - rows[0][index]);
                }
                // Extrapolation from a sliver is inaccurate.
                if area > 1e5 {
                    let near = |derivative: f64, expected: f64| (derivative - expected).abs() < 1e-7;
                    assert!(near(here.dpdx[0], slope * step[0]) && near(here.dpdx[1], -step[0]));
                    assert!(near(here.dpdy[0], 0.0) && near(here.dpdy[1], -step[1]));
                }
            });
        }
    }

    #[test]
    fn arbitrary_numbers_do_no_harm(
        bits in prop::array::uniform12(any_number()),
        picture in prop::array::uniform2(prop::sample::select(vec![0, 1, 7, MAX_PICTURE_SIZE, MAX_PICTURE_SIZE + 1, usize::MAX])),
    ) {
        check_any(bits, picture);
        check_any(bits.map(f64::from), picture);
    }
}

#[test]
fn derivatives_towards_pixels_behind_the_camera_are_0() {
    // A ceiling whose horizon lies between the two rows of a quad.
    let corner = |x: f64, w: f64| (Vector([x, 1.0 - 0.125 * w, 1e-3, w]), [w]);
    let mut at_horizon = 0;
    for triangle in set_up(&[corner(-9e3, 1e3), corner(9e3, 1e3), corner(0.0, 0.1)], None) {
        triangle.rasterize(PixelBounds::of_picture(PICTURE), |[column, row], _| {
            let Interpolated { value: [here], dpdx: [dpdx], dpdy: [dpdy] } = triangle.interpolate([column, row]);
            for (coordinate, derivative) in [(column, dpdx), (row, dpdy)] {
                let neighbour = if coordinate & 1 == 0 { here + derivative } else { here - derivative };
                assert!(here > 0.0 && neighbour > 0.0, "{column} {row}: {here} {neighbour}");
            }
            at_horizon += usize::from(row == 8 && dpdy == 0.0);
        });
    }
    assert!(at_horizon > 0);
}

#[test]
fn the_far_edge_of_a_triangle_that_begins_at_the_camera_has_its_varyings() {
    // Along that edge, 1 ÷ w is 0, and the second varying grows by 1 from pixel to pixel.
    let corner = |point, w, varying| (corner_at::<f32, 0>(point, [0.5, w]).0, [7.0, varying]);
    let far = f64::from(2_f32.powi(100));
    let corners =
        [corner([128, 128], far, 0.0), corner([4224, 128], far, 16.0), corner([128, 2176], 1.0 / far, 1000.0)];
    for corners in [corners, [corners[2], corners[0], corners[1]], [corners[1], corners[2], corners[0]]] {
        let [constant, varying] = set_up(&corners, None)[0].interpolate([5, 0]).value;
        assert!(constant == 7.0 && (varying - 5.0).abs() < 1e-5, "{constant} {varying}");
    }
}

#[test]
fn an_edge_is_clipped_between_numbers_whose_difference_overflows() {
    let corner = |z: f32, varying: f32| (Vector([0.0, 0.0, z, 1.0]), [varying]);
    let polygon = clip::clip(&[corner(0.5, f32::MAX), corner(2.5, -f32::MAX), corner(0.5, f32::MAX)], NearPlane::Clips);
    let shares: Vec<f32> = polygon.iter().map(|(_, [varying])| varying / f32::MAX).collect();
    let expected: [f32; 4] = [1.0, 0.5, 0.5, 1.0];
    assert_eq!(shares.len(), expected.len());
    assert!(shares.iter().zip(expected).all(|(share, expected)| (share - expected).abs() < 1e-6), "{shares:?}");
}

#[test]
fn triangles_in_the_near_and_the_far_plane_are_drawn() {
    for z in [0.0, 1.0] {
        let drawn = draw(&around_the_picture(z), None);
        assert_eq!(drawn.len(), PICTURE[0] * PICTURE[1]);
        assert!(drawn.values().all(|depth| *depth == z));
    }
}

#[test]
fn the_largest_picture_is_drawn_and_a_larger_one_is_not() {
    for (width, count) in [(MAX_PICTURE_SIZE, 1), (MAX_PICTURE_SIZE + 1, 0)] {
        let mut triangles = Vec::new();
        Triangle::set_up(&around_the_picture(0.5), [width, 4], None, NearPlane::Clips, &mut triangles);
        assert_eq!(triangles.len(), count);
        assert!(triangles.iter().all(|triangle| triangle.bounds() == PixelBounds::of_picture([width, 4])));
    }
}

#[test]
fn an_edge_is_clipped_from_the_corner_that_is_nearer_to_the_plane() {
    let corner = |z: f32, varying: f32| (Vector([0.0, 0.0, z, 1.0]), [varying]);
    let polygon = clip::clip(&[corner(0.0, 3.0), corner(1e30, 1e30), corner(0.0, 3.0)], NearPlane::Clips);
    let varyings: Vec<f32> = polygon.iter().map(|(_, [varying])| *varying).collect();
    assert_eq!(varyings, [3.0, 4.0, 4.0, 3.0]);
}

/// In the largest picture, coordinates are limited just beyond the guard band.
#[test]
fn an_edge_to_a_corner_beyond_the_guard_band_keeps_its_direction() {
    let picture = [MAX_PICTURE_SIZE; 2];
    let half = MAX_PICTURE_SIZE as f64 / 2.0;
    for [x, y] in [[200.0, 50.0], [-200.0, 50.0], [50.0, 200.0], [50.0, -200.0]] {
        let corner = |x: f64, y: f64| (Vector([x, y, 0.5, 1.0]), []);
        let mut triangles: Vec<Triangle<f64, 0>> = Vec::new();
        // The edge from the middle of the picture; the third corner is to its left.
        Triangle::set_up(
            &[corner(0.0, 0.0), corner(x, y), corner(-y * 0.2, x * 0.2)],
            picture,
            None,
            NearPlane::Clips,
            &mut triangles,
        );
        let is_covered = |x: f64, y: f64| {
            let [left, top] = [half + x * half, half - y * half].map(|pixels| pixels as usize);
            let pixel = PixelBounds { left, top, right: left + 1, bottom: top + 1 };
            let mut count = 0;
            triangles.iter().for_each(|triangle| triangle.rasterize(pixel, |_, _| count += 1));
            count == 1
        };
        let aside = [-y, x].map(|coordinate| coordinate / x.hypot(y) * 5.0 / half);
        for share in [0.001, 0.002, 0.004] {
            let on_edge = [x * share, y * share];
            assert!(is_covered(on_edge[0] + aside[0], on_edge[1] + aside[1]), "{x} {y} {share}");
            assert!(!is_covered(on_edge[0] - aside[0], on_edge[1] - aside[1]), "{x} {y} {share}");
        }
    }
}

#[test]
fn a_triangle_with_a_corner_at_the_camera_is_dropped() {
    let corners = [[0.0; 4], [1.0, 0.0, 0.5, 1.0], [0.0, 1.0, 0.5, 1.0]].map(|corner| (Vector(corner), []));
    assert!(set_up::<f64, 0>(&corners, None).is_empty());
}

#[test]
fn a_triangle_without_area_is_dropped() {
    for last in [[2048, 1024], [1024, 512], [2048, 1023]] {
        let corners = [[0, 0], [1024, 512], last].map(|point| corner_at::<f32, 0>(point, [0.5, 1.0]));
        assert_eq!(set_up(&corners, None).is_empty(), last != [2048, 1023], "{last:?}");
    }
}

#[test]
fn a_floor_that_begins_far_behind_the_camera_covers_all_below_the_horizon() {
    let corner = |x: f32, z: f32| (Vector([x, -1.5, 1e-5, -z]), []);
    let [a, b, c, d] = [corner(-1e6, 1e6), corner(1e6, 1e6), corner(1e6, -1e6), corner(-1e6, -1e6)];
    let mut rows = [0; PICTURE[1]];
    for corners in [[a, b, c], [a, c, d]] {
        draw(&corners, Some(Winding::Clockwise)).keys().for_each(|[_, row]| rows[*row] += 1);
    }
    let horizon = PICTURE[1] / 2;
    let expected: [usize; PICTURE[1]] = from_fn(|row| if row < horizon { 0 } else { PICTURE[0] });
    assert_eq!(rows, expected);
}

/// The corners of a triangle around all of the picture.
fn around_the_picture(z: f32) -> [ClipCorner<f32, 0>; 3] {
    [[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]].map(|[x, y]| (Vector([x, y, z, 1.0]), []))
}

fn check_any<R: Real>(numbers: [R; 12], picture: [usize; 2]) {
    let corners = [0, 4, 8].map(|first| {
        let clip = Vector(from_fn::<_, 4, _>(|index| numbers[first + index]));
        (clip, [R::one(), clip[0]])
    });
    let mut triangles = Vec::new();
    Triangle::set_up(&corners, picture, None, NearPlane::Clips, &mut triangles);
    assert!(triangles.is_empty() || numbers.iter().all(|number| number.is_finite()));
    let within = [0, MAX_PICTURE_SIZE / 2 - 4, MAX_PICTURE_SIZE - 8];
    for triangle in &triangles {
        let bounds = triangle.bounds();
        assert!(bounds.right <= picture[0] && bounds.bottom <= picture[1] && picture[0] <= MAX_PICTURE_SIZE);
        for [left, top] in within.into_iter().flat_map(|left| within.map(|top| [left, top])) {
            let within = PixelBounds { left, top, right: left + 8, bottom: top + 8 };
            triangle.rasterize(within, |pixel, depth| {
                assert!(R::zero() <= depth && depth <= R::one(), "{depth:?}");
                let constant = triangle.interpolate(pixel).value[0];
                assert!(constant == R::one(), "{constant:?}");
            });
        }
    }
}

/// For each pixel, the number of counter-clockwise triangles that cover it, less that of clockwise ones.
fn coverage<R: Real>(triangles: &[[[f64; 4]; 3]]) -> Vec<i32> {
    let mut coverage = vec![0; PICTURE[0] * PICTURE[1]];
    for corners in triangles {
        let corners = corners.map(|corner| (Vector(corner.map(R::of)), []));
        for (culled, count) in [(Winding::Clockwise, 1), (Winding::CounterClockwise, -1)] {
            for triangle in set_up::<R, 0>(&corners, Some(culled)) {
                triangle.rasterize(PixelBounds::of_picture(PICTURE), |pixel, _| {
                    coverage[pixel[1] * PICTURE[0] + pixel[0]] += count
                });
            }
        }
    }
    coverage
}

/// An octahedron with each face divided into 16 triangles, its vertices at these distances; counter-clockwise seen from
/// inside.
fn around_the_camera(radii: &[f64]) -> impl Iterator<Item = [DVec3; 3]> {
    let signs = (0..8).map(|face| [0, 1, 2].map(|axis| if face >> axis & 1 == 0 { 1 } else { -1 }));
    let cells = (0..4).flat_map(|i| (0..4 - i).map(move |j| [i, j]));
    let cells = cells.flat_map(|[i, j]| {
        let upward = [[i, j], [i + 1, j], [i, j + 1]];
        let downward = [[i + 1, j], [i + 1, j + 1], [i, j + 1]];
        [Some(upward), (i + j < 3).then_some(downward)].into_iter().flatten()
    });
    signs.flat_map(move |signs: [i32; 3]| {
        cells.clone().map(move |cell| {
            let mut corners = cell.map(|[i, j]| [i * signs[0], j * signs[1], (4 - i - j) * signs[2]]);
            if signs.iter().product::<i32>() > 0 {
                corners.swap(0, 1);
            }
            corners.map(|vertex| {
                // Any order of the 66 vertices will do if it is the same for all faces.
                let index = vertex.iter().fold(0, |index, &coordinate| index * 9 + (coordinate + 4) as usize);
                DVec3::from(vertex.map(f64::from)).normalize() * radii[index % radii.len()]
            })
        })
    })
}

fn set_up<R: Real, const V: usize>(corners: &[ClipCorner<R, V>; 3], culled: Option<Winding>) -> Vec<Triangle<R, V>> {
    let mut triangles = Vec::new();
    Triangle::set_up(corners, PICTURE, culled, NearPlane::Clips, &mut triangles);
    triangles
}

fn draw<R: Real>(corners: &[ClipCorner<R, 0>; 3], culled: Option<Winding>) -> BTreeMap<[usize; 2], R> {
    let mut drawn = BTreeMap::new();
    for triangle in set_up(corners, culled) {
        triangle.rasterize(PixelBounds::of_picture(PICTURE), |pixel, depth| {
            assert_eq!(drawn.insert(pixel, depth), None, "{pixel:?} is covered twice");
        });
    }
    drawn
}

/// A corner exactly at a point of the grid, with this depth and w, which must be a power of 2.
fn corner_at<R: Real, const V: usize>(point: GridPoint, [depth, w]: [f64; 2]) -> (Vector4<R>, [R; V]) {
    let [x, y] = clip_of(point);
    (Vector([x * w, y * w, depth * w, w].map(R::of)), [R::zero(); V])
}

fn clip_of(point: GridPoint) -> [f64; 2] {
    let [x, y] = [0, 1].map(|axis| point[axis] as f64 / (PICTURE[axis] as f64 * STEPS_PER_PIXEL as f64 / 2.0));
    [x - 1.0, 1.0 - y]
}

/// All pixels that a triangle covers, in order, each with 1 for a clockwise triangle and -1 for a counter-clockwise
/// one. Pixel centres are moved slightly to the right, and even less down, so those on a left or a top edge are inside.
fn expected_coverage(points: [GridPoint; 3]) -> Vec<([usize; 2], i32)> {
    const FINER: i128 = 1 << 40;
    let [a, b, c] = points.map(|point| point.map(|coordinate| i128::from(coordinate) * FINER));
    let area = |a: [i128; 2], b: [i128; 2], c: [i128; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let pixels = (0..PICTURE[0]).flat_map(|column| (0..PICTURE[1]).map(move |row| [column, row]));
    let winding = |pixel: [usize; 2]| {
        let [x, y] = pixel.map(|coordinate| (coordinate as i128 * 256 + 128) * FINER);
        let center = [x + (1 << 20), y + 1];
        let sides = [area(a, b, center), area(b, c, center), area(c, a, center)].map(|area| area.signum() as i32);
        (sides[0] != 0 && sides[0] == sides[1] && sides[1] == sides[2]).then_some((pixel, sides[0]))
    };
    pixels.filter_map(winding).collect()
}

fn expected_edge_values([a, b, c]: [GridPoint; 3], pixel: [usize; 2]) -> [i64; 3] {
    let center = pixel.map(|coordinate| coordinate as i64 * STEPS_PER_PIXEL + HALF_PIXEL);
    [[center, b, c], [a, center, c], [a, b, center]].map(grid::doubled_area)
}

fn is_in(bounds: PixelBounds, [column, row]: [usize; 2]) -> bool {
    (bounds.left..bounds.right).contains(&column) && (bounds.top..bounds.bottom).contains(&row)
}

/// Any point in and around the picture, often at the edge or the centre of a pixel.
fn any_point() -> impl Strategy<Value = GridPoint> {
    let along = |side: usize| {
        let (low, high) = (-(side as i64) * STEPS_PER_PIXEL / 2, side as i64 * STEPS_PER_PIXEL * 3 / 2);
        let few = (8..12_i64).prop_map(|number| number * HALF_PIXEL);
        let beside = few.clone().prop_flat_map(|coordinate| (-1..=1_i64).prop_map(move |offset| coordinate + offset));
        prop_oneof![
            low..high,
            (low / HALF_PIXEL..high / HALF_PIXEL).prop_map(|number| number * HALF_PIXEL),
            few,
            beside
        ]
    };
    [along(PICTURE[0]), along(PICTURE[1])]
}

fn any_bounds() -> impl Strategy<Value = PixelBounds> {
    (0..33_usize, 0..17_usize, 0..40_usize, 0..20_usize).prop_map(|(left, top, right, bottom)| PixelBounds {
        left,
        top,
        right,
        bottom,
    })
}

fn any_number() -> impl Strategy<Value = f32> {
    let special =
        [0.0, -0.0, 1.0, -1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 1e-45, 1e-38, 64.0];
    prop_oneof![
        any::<u32>().prop_map(f32::from_bits),
        prop::sample::select(special.to_vec()),
        -2.0..2.0_f32,
        -200.0..200.0_f32
    ]
}

#[test]
fn no_product_of_coordinates_overflows() {
    let far = MAX_COORDINATE;
    let [a, b, c] = [[-far, -far], [far, -far], [-far, far]];
    assert!(grid::doubled_area([a, b, c]) > 0 && grid::doubled_area([c, b, a]) < 0);
    let last = MAX_PICTURE_SIZE as i64 - 1;
    for [from, to] in [[a, b], [b, c], [c, a], [[far, far], a]] {
        for [column, row] in [[0, 0], [last, 0], [0, last], [last, last]] {
            let edge = Edge::new(from, to);
            let expected = grid::doubled_area([
                from,
                to,
                [column * STEPS_PER_PIXEL + HALF_PIXEL, row * STEPS_PER_PIXEL + HALF_PIXEL],
            ]);
            assert_eq!(edge.at(column, row), expected);
        }
    }
}

#[test]
fn what_is_in_front_of_a_near_plane_that_clamps_has_its_depth() {
    // Depth is 4 at the left edge of the picture, and falls by a quarter a column.
    let corner = |x: i64, y: i64| {
        let depth = 4.0 - 0.25 * x as f64;
        corner_at::<f64, 0>([x * STEPS_PER_PIXEL, y * STEPS_PER_PIXEL], [depth, 1.0])
    };
    let mut covered = BTreeMap::new();
    for corners in [[corner(0, 0), corner(0, 16), corner(16, 0)], [corner(16, 0), corner(0, 16), corner(16, 16)]] {
        let mut triangles = Vec::new();
        Triangle::set_up(&corners, PICTURE, None, NearPlane::Clamps, &mut triangles);
        for triangle in triangles {
            triangle.rasterize(PixelBounds::of_picture(PICTURE), |pixel, depth| _ = covered.insert(pixel, depth));
        }
    }
    assert_eq!(covered.len(), 16 * 16);
    for ([column, _], depth) in covered {
        let expected = (4.0 - 0.25 * (column as f64 + 0.5)).min(1.0);
        assert!((depth - expected).abs() < 1e-15, "{depth} in column {column}");
    }
}
