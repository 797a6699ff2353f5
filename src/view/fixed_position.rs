//! Fixed-point positions, whose difference is exact on any device.

use glam::DVec3;

/// A position in 64-bit fixed point, in steps of 2⁻³⁰ m (just below a nanometre).
///
/// Devices have no f64, and f32 is wrong by metres far from the origin. With 32-bit integers and a borrow, the
/// difference of two fixed-point positions is exact; only that difference, which is small where it matters, is rounded
/// to f32. So one table of positions serves every view, wherever its camera is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FixedPosition([i64; 3]);

impl FixedPosition {
    /// The largest coordinate in metres: 2³², about 4.3 million kilometres. The difference of any two positions also
    /// fits into 64 bits.
    pub const MAX_COORDINATE: f64 = 4_294_967_296.0;

    /// The world's origin.
    pub const ORIGIN: Self = Self([0; 3]);

    /// The nearest fixed-point position; `None` if a coordinate is not finite or beyond
    /// [`FixedPosition::MAX_COORDINATE`].
    pub fn new(position: DVec3) -> Option<Self> {
        let coordinates = position.to_array();
        coordinates.iter().all(|&coordinate| is_within_reach(coordinate)).then(|| Self(coordinates.map(nearest_step)))
    }

    /// The position at these numbers of steps.
    pub(super) fn from_steps(steps: [i64; 3]) -> Self {
        Self(steps)
    }

    /// Joins the halves that [`FixedPosition::halves`] returns.
    pub fn from_halves(low: [u32; 3], high: [i32; 3]) -> Self {
        Self(std::array::from_fn(|axis| i64::from(high[axis]) << 32 | i64::from(low[axis])))
    }

    /// The difference from another position in metres, rounded exactly as shaders round it.
    pub fn relative_to(self, other: Self) -> [f32; 3] {
        std::array::from_fn(|axis| {
            let steps = self.0[axis].wrapping_sub(other.0[axis]);
            let (high, low) = ((steps.unsigned_abs() >> 32) as u32, steps.unsigned_abs() as u32);
            let magnitude = high as f32 * 4.0 + low as f32 * 2_f32.powi(-30);
            if steps < 0 { -magnitude } else { magnitude }
        })
    }

    /// The lower and the upper 32 bits of each coordinate.
    pub fn halves(self) -> ([u32; 3], [i32; 3]) {
        (self.0.map(|steps| steps as u32), self.0.map(|steps| (steps >> 32) as i32))
    }
}

/// Whether a coordinate is finite and within [`FixedPosition::MAX_COORDINATE`].
#[inline(always)]
pub(super) fn is_within_reach(coordinate: f64) -> bool {
    // The comparison is false for NaN.
    coordinate.abs() < FixedPosition::MAX_COORDINATE
}

/// The step that is nearest to a coordinate within reach; of two, the even one.
///
/// It takes a few operations that exist as vector instructions; the conversion from f64 to i64 does not. Adding
/// [`INTEGERS`] to a number below 2⁵¹ rounds it to an integer, and the sum's bits minus those of [`INTEGERS`] are that
/// integer. The coordinate is split into a multiple of 4 m, which are 2³² steps, and a rest of at most 2 m. The
/// subtraction is exact: the rest is a multiple of the coordinate's last place, and no larger than the coordinate.
#[inline(always)]
pub(super) fn nearest_step(coordinate: f64) -> i64 {
    const STEPS_PER_METRE: f64 = 1_073_741_824.0;
    let integer = |sum: f64| (sum.to_bits() as i64).wrapping_sub(INTEGERS.to_bits() as i64);
    let whole = coordinate * 0.25 + INTEGERS;
    let rest = coordinate - (whole - INTEGERS) * 4.0;
    // Beyond reach the result means nothing.
    (integer(whole) << 32).wrapping_add(integer(rest * STEPS_PER_METRE + INTEGERS))
}

/// In the middle of the f64s that are all integers, and no others.
const INTEGERS: f64 = 1.5 * (1_u64 << 52) as f64;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The shader's computation, in the same 32-bit steps.
    fn difference(object: FixedPosition, camera: FixedPosition) -> [f32; 3] {
        let ((low, high), (camera_low, camera_high)) = (object.halves(), camera.halves());
        std::array::from_fn(|axis| {
            let borrow = i32::from(low[axis] < camera_low[axis]);
            let low = low[axis].wrapping_sub(camera_low[axis]);
            let high = high[axis].wrapping_sub(camera_high[axis]).wrapping_sub(borrow);
            let negative = high < 0;
            // Take the magnitude first: both halves of a small negative number are large.
            let carry = u32::from(low == 0);
            let magnitude_low = if negative { (!low).wrapping_add(1) } else { low };
            let magnitude_high = if negative { (!high as u32).wrapping_add(carry) } else { high as u32 };
            let magnitude = magnitude_high as f32 * 4.0 + magnitude_low as f32 * 2_f32.powi(-30);
            if negative { -magnitude } else { magnitude }
        })
    }

    proptest! {
        #[test]
        fn differences_are_exact_to_f32(
            coordinate in -4.29e9..4.29e9_f64, sign in prop::bool::ANY, exponent in -9.0..9.93_f64,
        ) {
            let offset = if sign { 10_f64.powf(exponent) } else { -10_f64.powf(exponent) };
            let other = (coordinate + offset).clamp(-4.29e9, 4.29e9);
            let (camera, object) = (DVec3::splat(coordinate), DVec3::splat(other));
            let (camera, object) = (FixedPosition::new(camera).unwrap(), FixedPosition::new(object).unwrap());
            let found = difference(object, camera);
            let (low, high) = object.halves();
            prop_assert_eq!(FixedPosition::from_halves(low, high).relative_to(camera), found);
            let exact = other - coordinate;
            let bound = 2_f64.powi(-30) + exact.abs() * 2_f64.powi(-22);
            prop_assert!((f64::from(found[0]) - exact).abs() <= bound, "{} for {exact}", found[0]);
        }
    }

    proptest! {
        #[test]
        fn positions_are_rounded_to_the_nearest_step(coordinate in prop_oneof![
            -4.294_967_29e9..4.294_967_29e9_f64, -10.0..10.0_f64, -1e-8..1e-8_f64,
            // Ties, and their neighbours.
            (-1_i64 << 40..1 << 40, -1_i32..=1).prop_map(|(halves, ulps)| {
                let tie = (halves as f64 + 0.5) / 1_073_741_824.0;
                if ulps > 0 { tie.next_up() } else if ulps < 0 { tie.next_down() } else { tie }
            }),
        ]) {
            // Exact: the product by a power of two is, and so is the difference of an integer and a near number.
            let steps = coordinate * 1_073_741_824.0;
            let nearest = steps.round_ties_even();
            prop_assert_eq!(nearest_step(coordinate), nearest as i64);
        }
    }

    proptest! {
        #[test]
        fn positions_beyond_reach_are_rejected_without_a_panic(coordinate in prop_oneof![
            any::<f64>(), (1_i64 << 31..1 << 40, -3_i32..3).prop_map(|(fours, rest)| fours as f64 * 4.0 + f64::from(rest)),
        ]) {
            nearest_step(coordinate);
            let is_within = coordinate.abs() < FixedPosition::MAX_COORDINATE;
            prop_assert_eq!(FixedPosition::new(DVec3::new(0.0, coordinate, 0.0)).is_some(), is_within);
        }
    }

    #[test]
    fn the_difference_of_opposite_world_corners_does_not_overflow() {
        let (one, other) = (DVec3::splat(-4.29e9), DVec3::splat(4.29e9));
        let found = difference(FixedPosition::new(other).unwrap(), FixedPosition::new(one).unwrap());
        assert!(found.iter().all(|&distance| (f64::from(distance) - 8.58e9).abs() < 1024.0), "{found:?}");
    }

    #[test]
    fn unrepresentable_positions_are_rejected() {
        for bad in [f64::NAN, f64::INFINITY, FixedPosition::MAX_COORDINATE, -1e300] {
            assert_eq!(FixedPosition::new(DVec3::new(0.0, bad, 0.0)), None);
        }
        assert!(FixedPosition::new(DVec3::splat(-4.29e9)).is_some());
    }
}
