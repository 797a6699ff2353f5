//! The position of vertices, as the shader of frames computes it on the adapter: the cases of `benches/precision`.

use drawloom_testing::precision::cases::Kind;
use drawloom_testing::precision::device::ShaderOnDevice;
use drawloom_testing::precision::measure::{BOUND, BOUNDED, Errors, MAGNIFYING, Origin, WORST_ANGLE, measure};
use drawloom_testing::random::Random;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::device;
use crate::strategies::expect;

pub const CASES: &[Case] = &[
    ("the_shader_places_vertices_within_a_thousandth_of_a_pixel", || {
        check(&BOUNDED, |errors| errors.greatest <= BOUND)
    }),
    ("the_shader_keeps_the_angular_error_of_f32_where_views_magnify_angles", || {
        check(&MAGNIFYING, |errors| errors.greatest_angle <= WORST_ANGLE)
    }),
];

/// Vertices of each view.
const VERTICES: usize = 4000;

fn check(kinds: &[Kind], is_within: fn(&Errors) -> bool) -> Result<(), Failed> {
    let (device, queue) = device()?;
    let (mut random, mut shader) = (Random::new(), ShaderOnDevice::new(device, queue));
    for kind in kinds {
        let errors = measure(*kind, Origin::Anywhere, VERTICES, &mut random, &mut shader)?;
        let enough = errors.cases > VERTICES * 9 / 10;
        expect(enough && is_within(&errors), || format!("{}: {errors:?}", kind.name()))?;
    }
    Ok(())
}
