//! The position of vertices in pictures is precise, wherever in the world the camera is.

use drawloom_testing::precision::measure::{BOUND, HELD, MAGNIFYING, Origin, WORST_ANGLE, measure};
use drawloom_testing::random::Random;

const CASES: usize = 5000;

#[test]
fn vertices_are_within_a_thousandth_of_a_pixel_anywhere_in_the_world() {
    let mut random = Random::new();
    for kind in HELD {
        let found = measure(kind, Origin::Anywhere, CASES, &mut random).unwrap();
        assert!(found.cases > CASES * 9 / 10, "{}: {} of {CASES} were visible", kind.name(), found.cases);
        assert!(found.greatest <= BOUND, "{}: {:.2e} pixels", kind.name(), found.greatest);
    }
}

#[test]
fn views_that_magnify_angles_keep_the_angular_error_of_f32() {
    let mut random = Random::new();
    for kind in MAGNIFYING {
        let found = measure(kind, Origin::Anywhere, CASES, &mut random).unwrap();
        assert!(found.cases > CASES * 9 / 10, "{}: {} of {CASES} were visible", kind.name(), found.cases);
        assert!(found.greatest_angle <= WORST_ANGLE, "{}: {:.1} u", kind.name(), found.greatest_angle);
    }
}

#[test]
fn world_positions_in_f32_are_off_by_pixels_at_a_hundred_kilometres() {
    let found = measure(HELD[2], Origin::At(1e5), CASES, &mut Random::new()).unwrap();
    assert!(found.absolute_greatest > 1.0, "{:.2e} pixels", found.absolute_greatest);
}
