//! The position of vertices in pictures is precise, anywhere in the world: as computed in Rust in the order of the
//! shader. `tests/pictures` has the same of the shader itself.

use drawloom_testing::precision::measure::{BOUND, BOUNDED, MAGNIFYING, Origin, WORST_ANGLE, measure};
use drawloom_testing::precision::vertex::ShaderInRust;
use drawloom_testing::random::Random;

const CASES: usize = 5000;

#[test]
fn vertices_are_within_a_thousandth_of_a_pixel_anywhere_in_the_world() {
    let mut random = Random::new();
    for kind in BOUNDED {
        let errors = measure(kind, Origin::Anywhere, CASES, &mut random, &mut ShaderInRust).unwrap();
        assert!(errors.cases > CASES * 9 / 10, "{}: {} of {CASES} were visible", kind.name(), errors.cases);
        assert!(errors.greatest <= BOUND, "{}: {:.2e} pixels", kind.name(), errors.greatest);
    }
}

#[test]
fn views_that_magnify_angles_keep_the_angular_error_of_f32() {
    let mut random = Random::new();
    for kind in MAGNIFYING {
        let errors = measure(kind, Origin::Anywhere, CASES, &mut random, &mut ShaderInRust).unwrap();
        assert!(errors.cases > CASES * 9 / 10, "{}: {} of {CASES} were visible", kind.name(), errors.cases);
        assert!(errors.greatest_angle <= WORST_ANGLE, "{}: {:.1} u", kind.name(), errors.greatest_angle);
    }
}

#[test]
fn world_positions_in_f32_are_off_by_pixels_at_a_hundred_kilometres() {
    let errors = measure(BOUNDED[2], Origin::At(1e5), CASES, &mut Random::new(), &mut ShaderInRust).unwrap();
    assert!(errors.absolute_greatest > 1.0, "{:.2e} pixels", errors.absolute_greatest);
}
