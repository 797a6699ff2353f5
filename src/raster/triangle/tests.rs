use std::collections::BTreeMap;

use glam::{DMat3, DQuat, DVec3};
use proptest::prelude::*;

use super::*;
use crate::raster::Vector;
use crate::raster::grid::{GridPoint, HALF_PIXEL, MAX_COORDINATE, STEPS_PER_PIXEL};

const PICTURE: [usize; 2] = [32, 16];

proptest! {
    #[test]
    fn it_covers_what_exact_integers_say(
        places in prop::array::uniform3(any_place()),
        off in prop::array::uniform2(-0.49..0.49_f64),
        inner in any_bounds(),
    ) {
        let expected = covered_by_hand(places);
        let corners = places.map(|place| {
            let (mut clip, []) = corner_at::<f64, 0>(place, [0.5, 2.0]);
            for axis in 0..2 {
                // Less than half a step from where it snaps to.
                clip[axis] += off[axis] * 2.0 * 2.0 / (PICTURE[axis] as f64 * STEPS_PER_PIXEL as f64);
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
            let mut places = Vec::new();
            triangle.rasterize(inner, |place, depth| {
                assert_eq!(drawn[&place], depth);
                places.push(place);
            });
            prop_assert_eq!(places.len(), drawn.keys().filter(|place| is_in(inner, **place)).count());
            prop_assert!(drawn.keys().all(|place| is_in(triangle.bounds(), *place)));
            prop_assert!(places.is_sorted_by_key(|[column, row]| [*row, *column]));
        }
    }

    #[test]
    fn what_is_closed_around_the_camera_covers_every_pixel_once(
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
        prop_assert_eq!(covers::<f64>(&triangles), vec![1; PICTURE[0] * PICTURE[1]]);
        prop_assert_eq!(covers::<f32>(&triangles), vec![1; PICTURE[0] * PICTURE[1]]);
    }

    #[test]
    fn depth_is_that_between_the_corners(
        places in prop::array::uniform3(any_place()),
        depths in prop::array::uniform3((-60.0..0.0_f64).prop_map(f64::exp2)),
    ) {
        // What is in f32 already, so that both have the same corners.
        let depths = depths.map(|depth| f64::from(depth as f32));
        let double = [0, 1, 2].map(|corner| corner_at::<f64, 0>(places[corner], [depths[corner], 1.0]));
        let single = [0, 1, 2].map(|corner| corner_at::<f32, 0>(places[corner], [depths[corner], 1.0]));
        let [least, greatest] = [f64::min, f64::max].map(|pick| depths.into_iter().reduce(pick).unwrap());
        let single = draw(&single, None);
        for (place, depth) in draw(&double, None) {
            let shares = shares_by_hand(places, place).map(|share| share as f64);
            let sum: f64 = shares.iter().sum();
            let expected: f64 = (0..3).map(|corner| shares[corner] * depths[corner]).sum::<f64>() / sum;
            prop_assert!((depth - expected).abs() <= 16.0 * f64::EPSILON * expected, "{depth} {expected}");
            prop_assert!((least..=greatest).contains(&depth));
            let depth = f64::from(single[&place]);
            prop_assert!((depth - expected).abs() <= 8.0 * 2_f64.powi(-24) * expected, "{depth} {expected}");
            prop_assert!((least..=greatest).contains(&depth));
        }
    }

    #[test]
    fn numbers_are_interpolated_in_perspective(
        places in prop::array::uniform3(any_place()),
        powers in prop::array::uniform3(-8..8_i32),
    ) {
        // Each corner hands on its own place in clip space, so that every pixel must find its own there.
        let corners = [0, 1, 2].map(|corner| {
            let (clip, []) = corner_at::<f64, 0>(places[corner], [2_f64.powi(-9), 2_f64.powi(powers[corner])]);
            (clip, [clip[0], clip[1], clip[3], 7.1])
        });
        for triangle in set_up(&corners, None) {
            triangle.rasterize(PixelBounds::of_picture(PICTURE), |place, _| {
                let Interpolated { value: [x, y, w, constant], .. } = triangle.interpolate(place);
                let expected = clip_of(place.map(|number| number as i64 * STEPS_PER_PIXEL + HALF_PIXEL));
                assert!((x / w - expected[0]).abs() < 1e-9 && (y / w - expected[1]).abs() < 1e-9, "{place:?}");
                assert_eq!(constant, 7.1);
            });
        }
    }

    /// Between corners that are each moved by half a step at most, nothing is moved farther.
    #[test]
    fn so_are_those_of_what_is_clipped(
        corners in prop::array::uniform3([-3.0..3.0_f64, -3.0..3.0_f64, -2.0..3.0_f64]),
        size in prop::sample::select(vec![1.0, 0.01]),
    ) {
        let corners = corners.map(|[x, y, w]| (Vector([x * size, y * size, 0.01, w]), [x * size, y * size, w]));
        let single = corners.map(|(clip, _)| (Vector(clip.0.map(|number| number as f32)), []));
        prop_assert!(draw(&single, None).values().all(|depth| (0.0..=1.0).contains(depth)));
        for triangle in set_up(&corners, None) {
            triangle.rasterize(PixelBounds::of_picture(PICTURE), |place, _| {
                let [x, y, w] = triangle.interpolate(place).value;
                let expected = clip_of(place.map(|number| number as i64 * STEPS_PER_PIXEL + HALF_PIXEL));
                let half_step = PICTURE.map(|side| 1.0 / (side as f64 * STEPS_PER_PIXEL as f64) + 1e-9);
                assert!((x / w - expected[0]).abs() <= half_step[0] && (y / w - expected[1]).abs() <= half_step[1]);
            });
        }
    }

    #[test]
    fn changes_are_those_within_a_quad(places in prop::array::uniform3(any_place()), slope in -5.0..5.0_f64) {
        let corners = places.map(|place| {
            let (clip, []) = corner_at::<f64, 0>(place, [0.5, 1.0]);
            (clip, [slope * clip[0], clip[1] - clip[0]])
        });
        let step = PICTURE.map(|side| 2.0 / side as f64);
        for triangle in set_up(&corners, None) {
            let area = 1.0 / triangle.per_area;
            triangle.rasterize(PixelBounds::of_picture(PICTURE), |place, _| {
                let [column, row] = place;
                let here = triangle.interpolate(place);
                let columns = [column & !1, column | 1].map(|column| triangle.interpolate([column, row]).value);
                let rows = [row & !1, row | 1].map(|row| triangle.interpolate([column, row]).value);
                for index in 0..2 {
                    assert_eq!(here.across[index], columns[1][index] - columns[0][index]);
                    assert_eq!(here.down[index], rows[1][index] - rows[0][index]);
                }
                // Where the triangle is a sliver, next to it is far from it.
                if area > 1e5 {
                    let near = |change: f64, expected: f64| (change - expected).abs() < 1e-7;
                    assert!(near(here.across[0], slope * step[0]) && near(here.across[1], -step[0]));
                    assert!(near(here.down[0], 0.0) && near(here.down[1], -step[1]));
                }
            });
        }
    }

    #[test]
    fn any_numbers_are_drawn_or_left_out(
        bits in prop::array::uniform12(any_number()),
        picture in prop::array::uniform2(prop::sample::select(vec![0, 1, 7, MAX_PICTURE_SIZE, MAX_PICTURE_SIZE + 1, usize::MAX])),
    ) {
        check_any(bits, picture);
        check_any(bits.map(f64::from), picture);
    }
}

#[test]
fn behind_the_camera_nothing_changes() {
    // A ceiling whose horizon lies between the two rows of a quad.
    let corner = |x: f64, w: f64| (Vector([x, 1.0 - 0.125 * w, 1e-3, w]), [w]);
    let mut at_horizon = 0;
    for triangle in set_up(&[corner(-9e3, 1e3), corner(9e3, 1e3), corner(0.0, 0.1)], None) {
        triangle.rasterize(PixelBounds::of_picture(PICTURE), |[column, row], _| {
            let Interpolated { value: [here], across: [across], down: [down] } = triangle.interpolate([column, row]);
            for (place, change) in [(column, across), (row, down)] {
                let beside = if place & 1 == 0 { here + change } else { here - change };
                assert!(here > 0.0 && beside > 0.0, "{column} {row}: {here} {beside}");
            }
            at_horizon += usize::from(row == 8 && down == 0.0);
        });
    }
    assert!(at_horizon > 0);
}

#[test]
fn the_far_end_of_what_begins_at_the_camera_has_its_numbers() {
    let corner = |place, w| (corner_at::<f32, 0>(place, [0.5, w]).0, [7.0]);
    let far = f64::from(2_f32.powi(100));
    let triangles = set_up(&[corner([128, 128], far), corner([4224, 128], far), corner([128, 2176], 1.0 / far)], None);
    assert_eq!(triangles[0].interpolate([5, 0]).value, [7.0]);
}

#[test]
fn a_corner_at_the_camera_is_nowhere() {
    let corners = [[0.0; 4], [1.0, 0.0, 0.5, 1.0], [0.0, 1.0, 0.5, 1.0]].map(|corner| (Vector(corner), []));
    assert!(set_up::<f64, 0>(&corners, None).is_empty());
}

#[test]
fn a_floor_from_far_behind_the_camera_covers_all_below_the_horizon() {
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

fn check_any<R: Real>(numbers: [R; 12], picture: [usize; 2]) {
    let corners = [0, 4, 8].map(|first| {
        let clip = Vector(from_fn::<_, 4, _>(|index| numbers[first + index]));
        (clip, [R::one(), clip[0]])
    });
    let mut triangles = Vec::new();
    Triangle::set_up(&corners, picture, None, &mut triangles);
    assert!(triangles.is_empty() || numbers.iter().all(|number| number.is_finite()));
    let within = [0, MAX_PICTURE_SIZE / 2 - 4, MAX_PICTURE_SIZE - 8];
    for triangle in &triangles {
        let bounds = triangle.bounds();
        assert!(bounds.right <= picture[0] && bounds.bottom <= picture[1] && picture[0] <= MAX_PICTURE_SIZE);
        for [left, top] in within.into_iter().flat_map(|left| within.map(|top| [left, top])) {
            let within = PixelBounds { left, top, right: left + 8, bottom: top + 8 };
            triangle.rasterize(within, |place, depth| {
                assert!(R::zero() <= depth && depth <= R::one(), "{depth:?}");
                let constant = triangle.interpolate(place).value[0];
                assert!(constant == R::one(), "{constant:?}");
            });
        }
    }
}

/// Each pixel's covers by triangles that are wound counter-clockwise, less those by others.
fn covers<R: Real>(triangles: &[[[f64; 4]; 3]]) -> Vec<i32> {
    let mut covers = vec![0; PICTURE[0] * PICTURE[1]];
    for corners in triangles {
        let corners = corners.map(|corner| (Vector(corner.map(R::of)), []));
        for (culled, count) in [(Winding::Clockwise, 1), (Winding::CounterClockwise, -1)] {
            for triangle in set_up::<R, 0>(&corners, Some(culled)) {
                triangle.rasterize(PixelBounds::of_picture(PICTURE), |place, _| {
                    covers[place[1] * PICTURE[0] + place[0]] += count
                });
            }
        }
    }
    covers
}

/// An octahedron with each face cut into 16, its corners at these distances; counter-clockwise from within.
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
            corners.map(|place| {
                // The 66 places that there are, in any order that is the same for all faces.
                let index = place.iter().fold(0, |index, &number| index * 9 + (number + 4) as usize);
                DVec3::from(place.map(f64::from)).normalize() * radii[index % radii.len()]
            })
        })
    })
}

fn set_up<R: Real, const V: usize>(corners: &[ClipCorner<R, V>; 3], culled: Option<Winding>) -> Vec<Triangle<R, V>> {
    let mut triangles = Vec::new();
    Triangle::set_up(corners, PICTURE, culled, &mut triangles);
    triangles
}

fn draw<R: Real>(corners: &[ClipCorner<R, 0>; 3], culled: Option<Winding>) -> BTreeMap<[usize; 2], R> {
    let mut drawn = BTreeMap::new();
    for triangle in set_up(corners, culled) {
        triangle.rasterize(PixelBounds::of_picture(PICTURE), |place, depth| {
            assert_eq!(drawn.insert(place, depth), None, "{place:?} is covered twice");
        });
    }
    drawn
}

/// A corner that is just at this place, with this depth, and w a power of 2.
fn corner_at<R: Real, const V: usize>(place: GridPoint, [depth, w]: [f64; 2]) -> (Vector4<R>, [R; V]) {
    let [x, y] = clip_of(place);
    (Vector([x * w, y * w, depth * w, w].map(R::of)), [R::zero(); V])
}

fn clip_of(place: GridPoint) -> [f64; 2] {
    let [x, y] = [0, 1].map(|axis| place[axis] as f64 / (PICTURE[axis] as f64 * STEPS_PER_PIXEL as f64 / 2.0));
    [x - 1.0, 1.0 - y]
}

/// Every pixel that a triangle covers, in order, and 1 if it is wound clockwise, or else -1. A pixel's middle is moved to the
/// right by next to nothing, and down by still less: what was on a left edge, or a top edge, is inside then.
fn covered_by_hand(places: [GridPoint; 3]) -> Vec<([usize; 2], i32)> {
    const FINER: i128 = 1 << 40;
    let [a, b, c] = places.map(|place| place.map(|number| i128::from(number) * FINER));
    let area = |a: [i128; 2], b: [i128; 2], c: [i128; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let pixels = (0..PICTURE[0]).flat_map(|column| (0..PICTURE[1]).map(move |row| [column, row]));
    let winding = |place: [usize; 2]| {
        let [x, y] = place.map(|number| (number as i128 * 256 + 128) * FINER);
        let middle = [x + (1 << 20), y + 1];
        let sides = [area(a, b, middle), area(b, c, middle), area(c, a, middle)].map(|area| area.signum() as i32);
        (sides[0] != 0 && sides[0] == sides[1] && sides[1] == sides[2]).then_some((place, sides[0]))
    };
    pixels.filter_map(winding).collect()
}

fn shares_by_hand([a, b, c]: [GridPoint; 3], place: [usize; 2]) -> [i64; 3] {
    let middle = place.map(|number| number as i64 * STEPS_PER_PIXEL + HALF_PIXEL);
    [[middle, b, c], [a, middle, c], [a, b, middle]].map(grid::doubled_area)
}

fn is_in(bounds: PixelBounds, [column, row]: [usize; 2]) -> bool {
    (bounds.left..bounds.right).contains(&column) && (bounds.top..bounds.bottom).contains(&row)
}

/// Anywhere in and around the picture, often at the edge or the middle of a pixel.
fn any_place() -> impl Strategy<Value = GridPoint> {
    let along = |side: usize| {
        let (low, high) = (-(side as i64) * STEPS_PER_PIXEL / 2, side as i64 * STEPS_PER_PIXEL * 3 / 2);
        let few = (8..12_i64).prop_map(|number| number * HALF_PIXEL);
        let beside = few.clone().prop_flat_map(|place| (-1..=1_i64).prop_map(move |off| place + off));
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
fn places_leave_no_product_out_of_range() {
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
